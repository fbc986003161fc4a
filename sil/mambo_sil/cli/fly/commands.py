"""The commands of the panel Fly: fly, campaign, faults, replay."""

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_codegen import extensions
from mambo_codegen.errors import UnwritableError, echo
from mambo_sil.cli.fly.fly_options import Conditions, Course, OtherFlight, Output, Runner, command_of
from mambo_sil.cli.options import (
    AsJson,
    Drone,
    OptionalSensors,
    Results,
    Scalar,
    Source,
    Workers,
    continued_later,
    demand_port,
    load,
    load_drone,
    output_option,
    show_result,
)
from mambo_sil.cli.progress import Bar, counting_bar, progress_bar
from mambo_sil.errors import FlightError
from mambo_sil.flight.names import SensorsName
from mambo_sil.results.folders import SUMMARY, new_results
from mambo_sil.results.terminal import sentence

if TYPE_CHECKING:
    from mambo_sil.experiment.campaign.campaign_file import Campaign
    from mambo_sil.experiment.campaign.campaign_report import CampaignSummary


def _fly(runner: Runner, course: Course, conditions: Conditions, output: Output, other: OtherFlight) -> None:
    """Simulate one flight; write trace, metrics and plots; exit 1 if the drone crashes.

    To see how settings fly a curve, a push, gusts, sensors or another drone.
    """
    if other.repeat is not None:
        from mambo_sil.cli.fly.repeat import fly_again

        fly_again(other.repeat, output, other)
        return
    if other.app is not None:
        fly_app = extensions.load("apps", other.app)
        fly_app(course, conditions, runner, output, other)
        return
    if other.events is not None:
        raise typer.BadParameter("it is for a flight with --app", param_hint="--events")
    demand_port(runner.port, runner.baud)
    if runner.port is not None:
        fly_on_port = extensions.load("port", "fly")
        fly_on_port(course, conditions, runner, output)
    else:
        from mambo_sil.cli.fly.one_flight import fly_once

        fly_once(course, conditions, runner, output)


fly = command_of(_fly, Runner, Course, Conditions, Output, OtherFlight)


def campaign(
    source: Annotated[
        Path | None, typer.Argument(help="A campaign.toml; the default campaign if none is named.")
    ] = None,
    *,
    output: Annotated[
        Path,
        output_option("Folder for the results; a campaign started there is continued."),
    ] = Path("campaign"),
    vehicle: Drone = None,
    sensors: OptionalSensors = None,
    flights: Annotated[
        int, typer.Option(help="Total number of flights.", metavar="N", min=1, max=1_000_000)
    ] = 1000,
    workers: Workers = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            help="Address of a running Dask scheduler; its workers fly, not this machine.", metavar="ADDRESS"
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Fly many random flights with several controllers and compare them; continue an interrupted campaign.

    For the question how a controller flies drones, winds and courses that nobody chose for it.
    """
    if workers is not None and scheduler is not None:
        raise typer.BadParameter("it has its own workers: leave out --workers", param_hint="--scheduler")

    with counting_bar("starting", "flights", flights) as bar:
        chosen = _campaign(source, vehicle, sensors)
        summary = _fly_campaign(chosen, output, flights, bar, workers=workers, scheduler=scheduler)
    from mambo_sil.experiment.campaign.campaign_records import RECORDS
    from mambo_sil.experiment.campaign.campaign_report import PICTURE
    from mambo_sil.experiment.campaign.store import TABLE

    files = (TABLE, SUMMARY, f"{PICTURE}.png", f"{PICTURE}.svg", f"{RECORDS}/")
    show_result(summary, output, files, as_json=as_json)


def _campaign(source: Path | None, vehicle: str | None, sensors: SensorsName | None) -> "Campaign":
    """Return a campaign, with another drone and other sensors if these are named."""
    from mambo_sil.experiment.campaign import campaign_file

    found = campaign_file.default(vehicle) if source is None else campaign_file.read(source, vehicle)
    return found if sensors is None else found.with_sensors(sensors)


def _fly_campaign(
    chosen: "Campaign",
    output: Path,
    flights: int,
    bar: Bar,
    *,
    workers: int | None,
    scheduler: str | None,
) -> "CampaignSummary":
    """Fly the missing flights and write the results; if interrupted print how many are finished.

    Print in how many of these flights a law of the user's own failed, and why in one of them.
    """
    from mambo_sil.experiment.campaign.campaign_report import finish
    from mambo_sil.experiment.campaign.campaign_run import fly_missing, missing_flights, open_campaign
    from mambo_sil.experiment.campaign.executors import cluster, processes

    failures = dict[str, list[str]]()

    def failed(name: str, flight: int, reason: str) -> None:
        failures.setdefault(name, []).append(f"flight {flight}, {reason}")

    with (
        open_campaign(chosen, output) as store,
        continued_later(output, lambda: len(store.finished), flights, "flights"),
    ):
        bar(len(store.finished))
        try:
            if missing_flights(store, flights):
                pool = processes(workers or os.cpu_count() or 1) if scheduler is None else cluster(scheduler)
                with pool as open_pool:
                    bar.stage("flying")
                    fly_missing(chosen, store, flights, open_pool, bar, running=bar.running, failed=failed)
            return finish(chosen, store, bar.stage)
        except KeyboardInterrupt:
            with contextlib.suppress(UnwritableError):
                store.export()
            raise
        finally:
            for name, reasons in failures.items():
                flown = "1 flight" if len(reasons) == 1 else f"{len(reasons)} flights"
                typer.echo(sentence(f"{name} failed in {flown}, as in {min(reasons)}"), err=True)


FAULTS_FILES = ("faults.csv", "faults.png", "faults.svg")


def faults(
    source: Source = "mambo",
    *,
    output: Results = Path("faults"),
    vehicle: Drone = None,
    scalar: Scalar = None,
    as_json: AsJson = False,
) -> None:
    """Fly with faults of sensors, timing, target and operator; exit 1 if the drone crashes.

    Before a first flight: what becomes of it if the state is lost, late, frozen or in other units.
    """
    from mambo_sil.experiment.faults.fault_flights import fly_faults
    from mambo_sil.experiment.faults.faults_report import FaultsSummary, write_csv
    from mambo_sil.flight.controllers.compiled import CompiledController

    settings, drone = load(source, scalar), load_drone(vehicle, source)
    with new_results(output, FaultsSummary.command, FAULTS_FILES) as folder:
        with progress_bar("flying with faults") as bar:
            try:
                verdicts = fly_faults(settings, lambda n: CompiledController(settings, n), bar, drone=drone)
            except FlightError as error:
                raise FlightError(f"{echo(source)}: {error}") from error
            summary = FaultsSummary(
                source=source, settings=settings.digest, vehicle=drone, flights=list(verdicts)
            )
            bar.stage("drawing pictures")
            from mambo_sil.experiment.faults.faults_plots import draw_faults

            draw_faults(verdicts, summary.result(folder).finding, summary.subject, folder / "faults")
        write_csv(verdicts, folder / "faults.csv")
        summary.write(folder)
    show_result(summary, output, as_json=as_json)
    if summary.crashed:
        raise typer.Exit(1)


def replay(
    log: Annotated[
        Path, typer.Argument(help="A log: trace.csv, CSV of a Crazyflie, or a .ulg of PX4.", metavar="LOG")
    ],
    source: Source = "mambo",
    *,
    scalar: Scalar = None,
    output: Results = Path("replayed"),
    columns: Annotated[
        str,
        typer.Option(
            help="Columns of the log by signal, with sign and factor if needed.",
            metavar="SIGNAL=COLUMN,...",
        ),
    ] = "",
    as_json: AsJson = False,
) -> None:
    """Compare the commands in a log with those of the compiled controller.

    Exit 0 if it is what flew, 1 if it is not, 2 if the log does not tell.

    After a flight: whether the firmware has these settings, and gets the inputs that you believe.
    """
    from mambo_sil.model.identify.columns import parse_columns
    from mambo_sil.model.replay.log_replay import replay_log, write_curves
    from mambo_sil.model.replay.logged_columns import SIGNALS
    from mambo_sil.model.replay.replay_plots import draw_replay
    from mambo_sil.model.replay.replay_report import CURVES, PICTURES, LogReplaySummary, summarise

    settings = load(source, scalar)
    with progress_bar("replaying"):
        replayed = replay_log(log, parse_columns(columns, SIGNALS), settings)
    summary = summarise(replayed, str(log), source, settings.digest)
    with new_results(output, LogReplaySummary.command, (CURVES, *PICTURES)) as folder:
        write_curves(replayed, folder / CURVES)
        draw_replay(folder / CURVES, folder / "replay")
        summary.write(folder)
    show_result(summary, output, (CURVES, *PICTURES, SUMMARY), as_json=as_json)
    if not summary.good:
        raise typer.Exit(2 if summary.good is None else 1)
