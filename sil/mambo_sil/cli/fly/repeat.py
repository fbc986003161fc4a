"""`fly --repeat`: repeat a recorded flight, and record every iteration of the optimizer."""

from pathlib import Path

from mambo_codegen.errors import echo
from mambo_codegen.methods import method_of
from mambo_sil.cli.fly.fly_options import OtherFlight, Output
from mambo_sil.cli.fly.one_flight import (
    FLIGHT_FILES,
    TRACE_FILES,
    draw,
    finish,
    tell_failures,
    write_trace,
)
from mambo_sil.cli.fly.target_columns import target_columns
from mambo_sil.cli.progress import progress_bar
from mambo_sil.experiment.campaign.campaign_records import campaign_record
from mambo_sil.flight.controllers.inner_steps import WatchedController, write_inner_steps
from mambo_sil.flight.controllers.own_law import OwnLaws, load_law, period_of
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.engine.simulate import fly as simulate
from mambo_sil.flight.fences import fenced
from mambo_sil.flight.flight_report import RepeatSummary, about_flight, judge
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.names import flies_settings
from mambo_sil.flight.scenario import Record, flight_of, read_record
from mambo_sil.results.folders import new_results

INNER_STEPS = "inner-steps.npz"
ALLOWED = frozenset({"repeat", "output", "no_pictures", "as_json"})
"""Options allowed with --repeat; the record contains all others."""


def fly_again(file: Path, output: Output, other: OtherFlight) -> None:
    """Repeat the flight recorded in `file`, or in the database of its campaign, with the reference.

    Exits 1 if the drone crashes or is lost, or if a bit differs from the recorded flight.

    Raises FlightError and ScenarioError.
    """
    other.refuse(ALLOWED, f"--repeat {echo(str(file))} contains the whole flight")
    record = (None if file.exists() else campaign_record(file)) or read_record(file)
    law = load_law(record.controller) if ".py:" in record.controller else None
    period_s = record.settings.horizon.update_period_s if law is None else period_of(law)
    flight = flight_of([record.scenario], period_s)
    laws = None if law is None else OwnLaws(law, flight)
    watched, flies = (None, laws) if laws else _controllers(record, flight)
    controller = laws or fenced(flies, record.settings, [record.scenario], flight)
    files = FLIGHT_FILES if watched is None else (*FLIGHT_FILES, INNER_STEPS)
    with new_results(output.output, RepeatSummary.command, files) as folder:
        with progress_bar("repeating") as progress:
            trace = simulate(flight, controller, progress)
        has_settings = flies_settings(record.controller)
        write_trace(trace, folder, target_columns(flight, record.settings) if has_settings else {})
        if watched is not None:
            write_inner_steps(watched, folder / INNER_STEPS)
        recorded = record.trace_sha256
        limited = record.scenario if has_settings else None
        summary = RepeatSummary(
            repeat=str(file),
            same_bits_as_recorded=None if recorded is None else trace.digest() == recorded,
            same_bits_as_host=None,
            controller=record.controller,
            scenario=record.scenario,
            settings=record.settings.digest if has_settings else None,
            **judge(trace, record.settings, record.scenario.vehicle, limited),
        )
        if not output.no_pictures:
            about = about_flight(file.name, record.scenario)
            draw(trace, summary, about, record.scenario.duration_s, folder)
        summary.write(folder)
    tell_failures(laws)
    written = TRACE_FILES if output.no_pictures else FLIGHT_FILES
    finish(summary, output, written if watched is None else (*written, INNER_STEPS))


def _controllers(record: Record, flight: Flight) -> tuple[WatchedController | None, PositionController]:
    """Return the one that records its iterations, None if it has none, and the one that flies."""
    match record.controller:
        case "pd" | "pd-feedforward" | "pid-feedforward":
            return None, pd_controller(record.controller, flight)
        case _ if not method_of(record.settings).iterates:
            return None, method_of(record.settings).reference_controller()
        case _:
            watched = WatchedController(record.settings)
            return watched, watched
