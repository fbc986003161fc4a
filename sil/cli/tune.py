"""The command `tune`: search for settings on random flights."""

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.sil.cli.options import Workers, output_option

if TYPE_CHECKING:
    from optuna import Study

    from mambo_nmpc.sil.tuning.file import Tuning
    from mambo_nmpc.sil.tuning.study import FinishedTrial

CONTROLLER, FRONT = "controller.toml", "front"


def tune(
    source: Annotated[
        Path | None, typer.Argument(help="A tune.toml; the default study if none is named.")
    ] = None,
    *,
    output: Annotated[
        Path,
        output_option("Folder for the results; a study started there is continued."),
    ] = Path("tune"),
    trials: Annotated[int, typer.Option(help="Total number of trials.", min=1, max=100_000)] = 100,
    workers: Workers = None,
    storage: Annotated[
        str | None,
        typer.Option(help="URL of a database that several machines share, instead of a file in the folder."),
    ] = None,
) -> None:
    """Search for settings that track well with calm commands; continue an interrupted search."""
    from mambo_nmpc.sil.campaign.store import claim, convert_os_errors
    from mambo_nmpc.sil.errors import StudyError
    from mambo_nmpc.sil.files.folders import create_folder, lock
    from mambo_nmpc.sil.tuning import file
    from mambo_nmpc.sil.tuning.front import RULE, choose, pareto_front
    from mambo_nmpc.sil.tuning.study import demand_optuna, finished_trials, open_study

    tuning = file.default() if source is None else file.read(source)
    demand_optuna()
    with convert_os_errors(output), create_folder(output), lock(output):
        new = not any(output.iterdir())
        claim(output, "study", {"command": "tune", **tuning.document()})
        with contextlib.ExitStack() as stack:
            try:
                study = stack.enter_context(open_study(tuning, output, storage))
            except StudyError:
                for path in output.iterdir() if new else ():
                    path.unlink()
                raise
            _search(tuning, study, output, trials, workers or os.cpu_count() or 1)
            found = finished_trials(study)
        _finish(tuning, found, output)
    best = choose(pareto_front(found))
    for name, one in (*(("base", one) for one in _base(tuning, found)), ("chosen", best)):
        typer.echo(
            f"{name:8} trial {one.number:<6} IAE {one.iae_m_s:8.4g} m s   command variation "
            f"{one.command_variation_rad:9.4g} rad per update   "
            f"{one.crashed} of {tuning.file.flights} crashed"
        )
    typer.echo(f"chosen by the rule: {RULE}")
    typer.echo(f"{echo(str(output))}: {CONTROLLER}, {FRONT}.csv, {FRONT}.png, {FRONT}.svg", err=True)


def _search(tuning: "Tuning", study: "Study", folder: Path, trials: int, workers: int) -> None:
    """Search until `trials` are finished; on Ctrl-C print how many are."""
    from mambo_nmpc.sil.campaign.executors import processes
    from mambo_nmpc.sil.cli.progress import counting_bar
    from mambo_nmpc.sil.tuning.study import finished_trials, search

    if len(finished_trials(study)) >= trials:
        return
    try:
        with counting_bar("tuning", "trials", trials) as progress, processes(workers) as pool:
            search(tuning, study, folder, trials, pool=pool, progress=progress)
    except KeyboardInterrupt:
        with contextlib.suppress(OSError):
            typer.echo(
                f"{echo(str(folder))}: stopped with {len(finished_trials(study))} of {trials} trials "
                "finished; the same command continues from there",
                err=True,
            )
        raise


def _base(tuning: "Tuning", found: "list[FinishedTrial]") -> "list[FinishedTrial]":
    """Return the trial with the base settings: the first one, unless the run was killed during it."""
    return [one for one in found if one.values == tuning.start][:1]


def _finish(tuning: "Tuning", found: "list[FinishedTrial]", folder: Path) -> None:
    """Write Pareto front, plot and, last, the chosen controller."""
    from mambo_nmpc.codegen.atomic import put
    from mambo_nmpc.sil.campaign.store import convert_os_errors
    from mambo_nmpc.sil.tuning.front import controller_text, front_csv, pareto_front
    from mambo_nmpc.sil.tuning.plots import draw_front

    with convert_os_errors(folder):
        put(folder / f"{FRONT}.csv", front_csv(pareto_front(found)).encode())
        draw_front(found, _base(tuning, found), folder / FRONT)
        put(folder / CONTROLLER, controller_text(tuning, found).encode())
