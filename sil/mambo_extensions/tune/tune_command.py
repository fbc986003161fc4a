"""`tune`: search for settings on random flights."""

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from mambo_sil.cli.command import JoinedCommand
from mambo_sil.cli.options import AsJson, Drone, Workers, continued_later, output_option, show_result
from mambo_sil.cli.progress import Bar, counting_bar
from mambo_sil.errors import StudyError
from mambo_sil.results.folders import SUMMARY, create_folder, lock

if TYPE_CHECKING:
    from mambo_extensions.tune.tuning_report import TuneSummary


def tune(
    source: Annotated[
        Path | None, typer.Argument(help="A tune.toml; the default study if none is named.")
    ] = None,
    *,
    output: Annotated[
        Path,
        output_option("Folder for the results; a study started there is continued."),
    ] = Path("tune"),
    vehicle: Drone = None,
    trials: Annotated[
        int, typer.Option(help="Total number of trials.", metavar="N", min=1, max=100_000)
    ] = 100,
    workers: Workers = None,
    storage: Annotated[
        str | None,
        typer.Option(
            help="Address of a database that several machines share, instead of a file in the folder.",
            metavar="URL",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Search for settings that track well with calm commands; continue an interrupted search.

    When the settings of `design` are not good enough, and an hour of search is worth it.
    """
    with counting_bar("starting", "trials", trials) as bar:
        count = workers or os.cpu_count() or 1
        summary = _tune(source, vehicle, output, trials, bar, workers=count, storage=storage)
    from mambo_extensions.tune.tuning_report import CONTROLLER, FRONT

    written = (CONTROLLER, f"{FRONT}.csv", f"{FRONT}.png", f"{FRONT}.svg", SUMMARY)
    show_result(summary, output, written, as_json=as_json)


def _tune(
    source: Path | None,
    vehicle: str | None,
    output: Path,
    trials: int,
    bar: Bar,
    *,
    workers: int,
    storage: str | None,
) -> "TuneSummary":
    """Run the missing trials and write the results; if interrupted print how many are finished."""
    from mambo_extensions.tune import tuning_file
    from mambo_extensions.tune.study import demand_optuna, finished_trials, open_study, owner_of, search
    from mambo_extensions.tune.tuning_report import finish
    from mambo_sil.experiment.campaign.executors import processes
    from mambo_sil.experiment.campaign.store import claim, convert_os_errors

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
                bar.stage("tuning")
                with (
                    continued_later(output, lambda: len(finished_trials(study)), trials, "trials"),
                    processes(workers) as pool,
                ):
                    search(tuning, study, owner, trials, pool=pool, progress=bar, running=bar.running)
            found = finished_trials(study)
        bar.stage("measuring margins, drawing the front")
        return finish(tuning, found, output)


COMMAND: Final = JoinedCommand(
    tune,
    panel="Settings",
    after="design",
    examples="""\
mambo-nmpc tune -o tuned
mambo-nmpc tune tune.toml --trials 300 -o tuned
mambo-nmpc tune --vehicle my-drone.toml -o tuned-for-mine
mambo-nmpc tune --storage postgresql://db/studies -o tuned
""",
)
