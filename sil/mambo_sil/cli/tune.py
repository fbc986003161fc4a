"""The command `tune`: search for settings on random flights."""

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_codegen.errors import echo
from mambo_sil.cli.options import AsJson, OtherDrone, Workers, output_option, show

if TYPE_CHECKING:
    from optuna import Study

    from mambo_sil.cli.progress import Bar
    from mambo_sil.model.tune.tuning_file import Tuning
    from mambo_sil.model.tune.tuning_report import TuneSummary


def tune(
    source: Annotated[
        Path | None, typer.Argument(help="A tune.toml; the default study if none is named.")
    ] = None,
    *,
    output: Annotated[
        Path,
        output_option("Folder for the results; a study started there is continued."),
    ] = Path("tune"),
    vehicle: OtherDrone = None,
    trials: Annotated[int, typer.Option(help="Total number of trials.", min=1, max=100_000)] = 100,
    workers: Workers = None,
    storage: Annotated[
        str | None,
        typer.Option(help="URL of a database that several machines share, instead of a file in the folder."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Search for settings that track well with calm commands; continue an interrupted search."""
    from mambo_sil.cli.progress import counting_bar

    with counting_bar("starting", "trials", trials) as bar:
        count = workers or os.cpu_count() or 1
        summary = _run(source, vehicle, output, trials, bar, workers=count, storage=storage)
    from mambo_sil.model.tune.tuning_report import CONTROLLER, FRONT, tune_text
    from mambo_sil.results.folders import SUMMARY

    show(summary, tune_text(summary), as_json=as_json)
    written = f"{CONTROLLER}, {FRONT}.csv, {FRONT}.png, {FRONT}.svg, {SUMMARY}"
    typer.echo(f"{echo(str(output))}: {written}", err=True)


def _run(
    source: Path | None,
    vehicle: str | None,
    output: Path,
    trials: int,
    bar: "Bar",
    *,
    workers: int,
    storage: str | None,
) -> "TuneSummary":
    """Run the missing trials and write the results."""
    from mambo_sil.errors import StudyError
    from mambo_sil.experiment.campaign.store import claim, convert_os_errors
    from mambo_sil.model.tune import tuning_file
    from mambo_sil.model.tune.study import demand_optuna, finished_trials, open_study, owner_of
    from mambo_sil.model.tune.tuning_report import finish
    from mambo_sil.results.folders import create_folder, lock

    tuning = tuning_file.default(vehicle) if source is None else tuning_file.read(source, vehicle)
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
            bar(len(finished_trials(study)))
            if len(finished_trials(study)) < trials:
                owner = owner_of(output, storage)
                _search(tuning, study, owner, trials, bar, workers=workers, folder=output)
            found = finished_trials(study)
        bar.stage("drawing the front")
        return finish(tuning, found, output)


def _search(
    tuning: "Tuning",
    study: "Study",
    owner: str,
    trials: int,
    bar: "Bar",
    *,
    workers: int,
    folder: Path,
) -> None:
    """Search until `trials` are finished; if interrupted print how many are."""
    from mambo_sil.experiment.campaign.executors import processes
    from mambo_sil.model.tune.study import finished_trials, search

    bar.stage("tuning")
    try:
        with processes(workers) as pool:
            search(tuning, study, owner, trials, pool=pool, progress=bar, running=bar.running)
    except KeyboardInterrupt:
        with contextlib.suppress(OSError):
            typer.echo(
                f"{echo(str(folder))}: stopped with {len(finished_trials(study))} of {trials} trials "
                "finished; the same command continues from there",
                err=True,
            )
        raise
