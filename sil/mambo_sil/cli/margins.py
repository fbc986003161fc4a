"""The command margins: how far a controller on a drone is from instability."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from mambo_codegen.errors import echo
from mambo_sil.cli.options import (
    AsJson,
    Drone,
    OptionalResults,
    OptionalSensors,
    Source,
    load,
    load_drone,
    show_result,
)
from mambo_sil.cli.progress import counting_bar, progress_bar
from mambo_sil.flight.names import SensorsName
from mambo_sil.results.folders import SUMMARY

if TYPE_CHECKING:
    from mambo_sil.experiment.campaign.campaign_file import Campaign
    from mambo_sil.experiment.margins.margins_record import MarginsSummary
    from mambo_sil.experiment.margins.margins_run import Many, MarginSubject

_DEFAULT: Final = "default"
"""Names the default campaign."""


def margins(
    source: Source = "mambo",
    *,
    vehicle: Drone = None,
    sensors: OptionalSensors = None,
    campaign: Annotated[
        str | None,
        typer.Option(
            help="Also the drones that a campaign draws: a campaign.toml, or `default`.", metavar="FILE"
        ),
    ] = None,
    uncertainty: Annotated[
        bool,
        typer.Option(
            "--uncertainty",
            help="Also the drones at the ends of the intervals in the vehicle.toml, section uncertainty.",
        ),
    ] = False,
    all_figures: Annotated[
        bool, typer.Option("--all", help="Print every figure, not the margins only.")
    ] = False,
    drones: Annotated[
        int, typer.Option(help="Number of drones with --campaign.", metavar="N", min=1, max=100_000)
    ] = 100,
    output: OptionalResults = None,
    as_json: AsJson = False,
) -> None:
    """Measure gain, phase and delay margins of a controller on a drone at hover; exit 1 if it is unstable.

    Before a first flight: how wrong the model, or how late the position, may be.
    """
    from mambo_sil.drone.vehicles import vehicle_toml
    from mambo_sil.experiment.margins.margins_record import DRONES, PICTURES, RESPONSES
    from mambo_sil.experiment.margins.margins_run import MarginSubject, measure

    if campaign is not None and uncertainty:
        raise typer.BadParameter("leave out one of the two", param_hint="--campaign, --uncertainty")
    settings = load(source, None)
    if campaign is None:
        drone = load_drone(vehicle, source)
        subject = MarginSubject(source, settings, drone, sensors or "true")
        with progress_bar("measuring"):
            summary = measure(subject, _corners(subject) if uncertainty else None, output)
    else:
        drawing = _campaign(campaign, vehicle, vehicle_toml.of_settings(source), sensors)
        subject = MarginSubject(source, settings, drawing.drone, drawing.file.flight.sensors or "true")
        summary = _measure_drawn(subject, campaign, drawing, drones, output)
    drawn = (*PICTURES, RESPONSES) if summary.axes else ()
    written = (*drawn, *((DRONES,) if summary.many else ()), SUMMARY)
    shown = summary.model_copy(update={"all_figures": all_figures})
    show_result(shown, output, written, as_json=as_json)
    if not summary.stable:
        raise typer.Exit(1)


def _corners(subject: "MarginSubject") -> "Many":
    """Return the drones at the ends of the intervals that a log has shown."""
    from mambo_sil.experiment.margins.many_drones import corner_drones
    from mambo_sil.experiment.margins.margins_run import Many

    return Many(
        "at the ends of the intervals in [uncertainty]",
        lambda: corner_drones(subject.settings, subject.drone, subject.sensors),
    )


def _measure_drawn(
    subject: "MarginSubject", named: str, drawing: "Campaign", drones: int, output: Path | None
) -> "MarginsSummary":
    """Measure the first drones of a campaign, too; show the progress."""
    from mambo_sil.experiment.campaign.campaign_file import demand_flyable
    from mambo_sil.experiment.margins.many_drones import campaign_drones
    from mambo_sil.experiment.margins.margins_run import Many, measure

    demand_flyable(subject.settings, drawing.flight, drawing.draw(0), echo(subject.source))
    with counting_bar("measuring", "drones", drones) as bar:
        many = Many(
            f"the first that campaign {echo(named)} draws",
            lambda: campaign_drones(subject.settings, drawing, drones, bar),
        )
        return measure(subject, many, output)


def _campaign(
    named: str, vehicle: str | None, of_settings: str | None, sensors: SensorsName | None
) -> "Campaign":
    """Load a campaign, and replace its sensors if others are given; raises InvalidSettingsError.

    Its drone is `vehicle`, else the one that its file names, else `of_settings`, the one of the settings.
    """
    from mambo_sil.experiment.campaign import campaign_file

    default = named == _DEFAULT
    own = default or not campaign_file.names_drone(Path(named))
    chosen = vehicle or (of_settings if own else None)
    drawing = campaign_file.default(chosen) if default else campaign_file.read(Path(named), chosen)
    return drawing if sensors is None else drawing.with_sensors(sensors)
