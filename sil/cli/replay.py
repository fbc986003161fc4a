"""`fly --replay`: a recorded flight, flown again tick by tick with the optimizer's inner steps."""

from pathlib import Path

import typer

from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.sil.cli.progress import progress_bar
from mambo_nmpc.sil.controllers.inner_steps import WatchedController, write_inner_steps
from mambo_nmpc.sil.controllers.pd import PdController
from mambo_nmpc.sil.errors import FlightError
from mambo_nmpc.sil.files.folders import SUMMARY, new_results, summary_text
from mambo_nmpc.sil.flight import report
from mambo_nmpc.sil.flight.loop import fly as simulate
from mambo_nmpc.sil.flight.scenario import flight_of, read_record
from mambo_nmpc.sil.flight.traces import write_csv, write_npz

COMMAND = "fly --replay"
REPLAY_FILES = ("trace.csv", "trace.npz", "flight.png", "flight.svg")
INNER_STEPS = "inner-steps.npz"
BESIDE = frozenset({"replay", "output", "as_json"})
"""Options that go with --replay: the record says everything else."""


def fly_again(context: typer.Context, file: Path, output: Path, *, as_json: bool) -> None:
    """Fly what the record in `file` says, with the reference in place of the C; exit 1 if it differs.

    Raises FlightError and ScenarioError.
    """
    for name in context.params.keys() - BESIDE:
        given = context.get_parameter_source(name)
        if given is not None and given.name == "COMMANDLINE":
            option = "the settings" if name == "source" else f"--{name.replace('_', '-')}"
            raise FlightError(f"--replay {echo(str(file))} says how to fly: leave out {option}")
    record = read_record(file)
    watched = WatchedController(record.settings) if record.controller != "pd" else None
    flight = flight_of([record.scenario], record.settings.horizon.update_period_s)
    files = REPLAY_FILES if watched is None else (*REPLAY_FILES, INNER_STEPS)
    with new_results(output, COMMAND, files) as folder:
        with progress_bar("flying again") as progress:
            trace = simulate(flight, PdController() if watched is None else watched, progress)
        write_csv(trace, folder / "trace.csv")
        write_npz(trace, folder / "trace.npz")
        if watched is not None:
            write_inner_steps(watched, folder / INNER_STEPS)
        from mambo_nmpc.sil.show.plots import draw_flights  # noqa: PLC0415 - loaded when drawing

        draw_flights({file.name: trace}, folder / "flight")
        recorded = record.trace_sha256
        summary = {
            "replay": str(file),
            "same_bits_as_recorded": None if recorded is None else trace.digest() == recorded,
            "same_bits_as_host": None,
            **record.model_dump(mode="json", include={"controller", "scenario"}),
            "settings": record.settings.digest,
            **report.found(trace, record.settings),
        }
        text = summary_text(COMMAND, summary)
        (folder / SUMMARY).write_text(text, "utf-8")
    typer.echo(text if as_json else report.flight_text(summary), nl=not as_json)
    typer.echo(f"{echo(str(output))}: {', '.join(files)}", err=True)
    if summary["lost"] or summary["mostly_refused"] or summary["same_bits_as_recorded"] is False:
        raise typer.Exit(1)
