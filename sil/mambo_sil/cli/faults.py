"""The command `faults`: flights with faults, and how they end."""

from pathlib import Path

import typer

from mambo_codegen.errors import echo
from mambo_sil.cli.options import AsJson, Drone, Results, Scalar, Source, load, show

FILES = ("faults.csv", "faults.png", "faults.svg")


def faults(
    source: Source = "mambo",
    *,
    output: Results = Path("faults"),
    vehicle: Drone = "mambo",
    scalar: Scalar = None,
    as_json: AsJson = False,
) -> None:
    """Fly with faults of sensors, timing, target and operator; exit 1 if the drone crashes."""
    from mambo_sil.cli.progress import progress_bar
    from mambo_sil.drone.vehicles import vehicle_toml
    from mambo_sil.errors import FlightError
    from mambo_sil.experiment.faults.fault_flights import End, fly_faults
    from mambo_sil.experiment.faults.faults_report import FaultsSummary, table, write_csv
    from mambo_sil.flight.controllers.compiled import CompiledController
    from mambo_sil.results.folders import new_results

    settings, drone = load(source, scalar), vehicle_toml.load(vehicle)
    with new_results(output, FaultsSummary.command, FILES) as folder:
        with progress_bar("flying with faults") as bar:
            try:
                verdicts = fly_faults(settings, lambda n: CompiledController(settings, n), bar, drone=drone)
            except FlightError as error:
                raise FlightError(f"{echo(source)}: {error}") from error
            bar.stage("drawing pictures")
            from mambo_sil.experiment.faults.faults_plots import draw_faults

            draw_faults(verdicts, folder / "faults")
        write_csv(verdicts, folder / "faults.csv")
        summary = FaultsSummary(
            source=source, settings=settings.digest, vehicle=drone, flights=list(verdicts)
        )
        summary.write(folder)
    show(summary, table(verdicts), as_json=as_json)
    if any(verdict.end is End.CRASHED for verdict in verdicts):
        raise typer.Exit(1)
