"""The command `faults`: what becomes of flights in which something goes wrong."""

from pathlib import Path
from typing import Annotated

import typer

from mambo_nmpc.codegen import cli as generating
from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.sil.cli.boards import AsJson, Source
from mambo_nmpc.sil.cli.progress import progress_bar
from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.errors import FlightError
from mambo_nmpc.sil.faults.flights import End, fly_faults
from mambo_nmpc.sil.faults.report import records, table, write_csv
from mambo_nmpc.sil.files.folders import SUMMARY, new_results, summary_text

FAULT_FILES = ("faults.csv", "faults.png", "faults.svg")


def register(app: typer.Typer) -> None:
    """Add the command of this module to `app`."""
    app.command(
        epilog=generating.examples("mambo-nmpc faults mambo -o faults", "mambo-nmpc faults --scalar fixed")
    )(faults)


def faults(
    source: Source = "mambo",
    *,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Folder for the results; earlier ones there are overwritten."),
    ] = Path("faults"),
    scalar: generating.Scalar = None,
    as_json: AsJson = False,
) -> None:
    """Fly with faults of sensors, timing, target and operator; exit 1 if one crashes the drone."""
    settings = generating.load(source, scalar)
    with new_results(output, "faults", FAULT_FILES) as folder:
        try:
            with progress_bar("flying with faults") as progress:
                verdicts = fly_faults(settings, lambda n: CompiledController(settings, n), progress)
        except FlightError as error:
            raise FlightError(f"{echo(source)}: {error}") from error
        from mambo_nmpc.sil.faults.plots import draw_faults  # noqa: PLC0415 - loaded when drawing

        draw_faults(verdicts, folder / "faults")
        write_csv(verdicts, folder / "faults.csv")
        summary = {"source": source, "settings": settings.digest, "flights": records(verdicts)}
        text = summary_text("faults", summary)
        (folder / SUMMARY).write_text(text, "utf-8")
    typer.echo(text if as_json else table(verdicts), nl=not as_json)
    if any(verdict.end is End.CRASHED for verdict in verdicts):
        raise typer.Exit(1)
