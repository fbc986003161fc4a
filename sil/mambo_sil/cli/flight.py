"""Run the flight that the options of `fly` describe."""

import hashlib
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import typer

from mambo_codegen.errors import echo
from mambo_codegen.methods import method_of
from mambo_codegen.numbers.representation import TARGET
from mambo_codegen.settings.model import Settings
from mambo_sil.cli.options import FlyOptions, load, show
from mambo_sil.cli.progress import progress_bar
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.gusts import LIGHT_M_S
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import FlightError, TrajectoryError
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.engine.simulate import fly as simulate
from mambo_sil.flight.flight_report import FlightSummary, FlySummary, flight_text, judge
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.names import PD_TITLES
from mambo_sil.flight.scenario import choose_sensors
from mambo_sil.flight.traces import Trace, write_csv, write_npz
from mambo_sil.flight.trajectories import CURVES, Trajectory, Waypoints
from mambo_sil.results.folders import new_results
from mambo_sil.results.scratch import scratch_folder

CALM, GUSTS = "none", "gusts"
LONGEST_FLIGHT_S = 3600.0
LARGEST_SEED = 2**63 - 1
TRACE_FILES = ("trace.csv", "trace.npz")
FLIGHT_FILES = (*TRACE_FILES, "flight.png", "flight.svg")


def fly_once(options: FlyOptions) -> None:
    """Fly once as `options` say, write the results; exit 1 if the drone crashes or is lost, or bits differ.

    Raises FlightError, TrajectoryError, and the errors of loading settings or boards and of building the C.
    """
    if options.real_time:
        raise FlightError(
            "--real-time lets the clock of a board call the step: give its --port, or leave it out"
        )
    settings = load(options.source, options.scalar)
    drone = vehicle_toml.load(options.vehicle)
    flight = flight_of_options(options, settings, drone)
    with new_results(options.output, FlySummary.command, FLIGHT_FILES) as folder:
        controller = _on_board(options, settings) if options.on else _controller(options, settings, flight)
        with progress_bar("flying") as progress:
            trace = simulate(flight, controller, progress)
        same_bits = (
            None
            if options.on is None
            else trace.same_bits(simulate(flight, _controller(options, settings, flight)))
        )
        write_flight(trace, options, folder)
        summary = FlySummary(
            **summary_fields(options, settings, drone, flight, trace) | {"same_bits_as_host": same_bits}
        )
        summary.write(folder)
    finish(summary, flight_text(summary), options, written(options))


def flight_of_options(options: FlyOptions, settings: Settings, drone: VehicleFile) -> Flight:
    """Return the flight that the options describe; raises FlightError and TrajectoryError."""
    name, period_s = echo(options.source), settings.horizon.update_period_s
    curve = _trajectory(options)
    _within("--yaw-rad", options.yaw_rad, -1000.0, 1000.0)
    motor_lag_s = drone.motor_lag_s if options.motor_lag_s is None else options.motor_lag_s
    _within("--motor-lag-s", motor_lag_s, 0.0, 1.0)
    disturbances = Disturbances(_wind_speed_m_s(options.wind), push_m_s2=_push_m_s2(options.push))
    try:
        sensors = choose_sensors(options.sensors, drone)
    except FlightError as error:
        raise FlightError(f"--{error}") from error
    _within("--duration-s", options.duration_s, period_s, LONGEST_FLIGHT_S)
    _within("--seed", options.seed, 0, LARGEST_SEED)
    try:
        flight = Flight(
            curve,
            duration_s=options.duration_s,
            start=options.start,
            yaw_rad=options.yaw_rad,
            vehicle=replace(Vehicle.of(drone), motor_lag_s=motor_lag_s),
            update_period_s=period_s,
            seeds=(options.seed,),
            disturbances=disturbances,
            sensors=sensors,
        )
    except FlightError as error:
        raise FlightError(f"{name}: horizon.{error}; only the simulation requires this") from error
    if options.controller not in PD_TITLES:
        _check_ranges(flight, settings, options.trajectory)
    return flight


def summary_fields(
    options: FlyOptions, settings: Settings, drone: VehicleFile, flight: Flight, trace: Trace
) -> dict[str, Any]:
    """Return the fields of a `FlySummary` but `same_bits_as_host`."""
    waypoints = Path(options.trajectory) if isinstance(flight.trajectory, Waypoints) else None
    return vars(options) | {
        "board": options.on,
        "settings": settings.digest,
        "vehicle": drone,
        "motor_lag_s": flight.vehicle.motor_lag_s,
        "update_period_s": flight.update_period_s,
        "trajectory_sha256": waypoints and hashlib.sha256(waypoints.read_bytes()).hexdigest(),
        "push_m_s2": flight.disturbances.push_m_s2,
        "wind_speed_m_s": flight.disturbances.wind_speed_m_s,
        **judge(trace, settings, drone),
    }


def written(options: FlyOptions) -> tuple[str, ...]:
    """Return the names of the files of one flight, without its summary."""
    return FLIGHT_FILES if options.pictures else TRACE_FILES


def write_flight(trace: Trace, options: FlyOptions, folder: Path) -> None:
    """Write the files of `written`."""
    write_trace(trace, folder)
    if options.pictures:
        draw_flight(trace, PD_TITLES.get(options.controller, f"NMPC, {echo(options.source)}"), folder)


def write_trace(trace: Trace, folder: Path) -> None:
    """Write `TRACE_FILES`."""
    write_csv(trace, folder / "trace.csv")
    write_npz(trace, folder / "trace.npz")


def draw_flight(trace: Trace, title: str, folder: Path) -> None:
    """Write the pictures of `FLIGHT_FILES`."""
    from mambo_sil.flight.flight_plots import draw_flights  # matplotlib is slow to import

    draw_flights({title: trace}, folder / "flight")


def finish(summary: FlightSummary, text: str, options: FlyOptions, files: tuple[str, ...]) -> None:
    """Print the results, as `text` or JSON, and the files written; exit 1 unless the summary is good."""
    show(summary, text, as_json=options.as_json)
    typer.echo(f"{echo(str(options.output))}: {', '.join(files)}", err=True)
    if not summary.good:
        raise typer.Exit(1)


def _controller(options: FlyOptions, settings: Settings, flight: Flight) -> PositionController:
    match options.controller:
        case "reference":
            return method_of(settings).reference_controller()
        case "nmpc":
            return CompiledController(settings)
        case pd:
            return pd_controller(pd, flight)


def _on_board(options: FlyOptions, settings: Settings) -> PositionController:
    """Build the C for a board, and load it into the board's emulated core."""
    from mambo_codegen import boards
    from mambo_sil.board.emulated import EmulatedController, build_guest  # unicorn is slow to import
    from mambo_sil.board.firmware.firmware_build import builder

    board = str(options.on)
    if options.controller != "nmpc":
        raise FlightError(f"--on {echo(board)} runs the C: use it with --controller nmpc only")
    chosen = boards.load(board)
    core = chosen.emulated_core.value
    with scratch_folder() as work:
        return EmulatedController(settings, build_guest(settings, builder(chosen), work), core)


def _trajectory(options: FlyOptions) -> Trajectory:
    _within("--size-m", options.size_m, -1000.0, 1000.0)
    _within("--rate-rad-s", options.rate_rad_s, -100.0, 100.0)
    for name, curve in CURVES.items():
        if name == options.trajectory:
            return curve(options.size_m, options.rate_rad_s)
    if not options.trajectory.lower().endswith(".csv"):
        raise TrajectoryError(
            f"--trajectory {echo(options.trajectory)} must be {', '.join(CURVES)} or a file ending in .csv"
        )
    return Waypoints.read(Path(options.trajectory))


def _check_ranges(flight: Flight, settings: Settings, trajectory: str) -> None:
    """Raise FlightError if the controller, in its scalar type, would refuse a target of the flight."""
    method, ranges = method_of(settings), settings.ranges
    numbers, limits = method.numbers, method.limits
    given = np.abs(flight.targets()[:, :1]).max(axis=0)
    x, y, vx, vy = numbers.quantize(given, TARGET)[0]
    for what, refused, largest, unit, key, limit in (
        ("position", max(x, y) > limits.position, given[0, :2].max(), "m", "position_m", ranges.position_m),
        (
            "speed",
            max(vx, vy) > limits.velocity,
            given[0, 2:].max(),
            "m/s",
            "velocity_m_s",
            ranges.velocity_m_s,
        ),
    ):
        if refused:
            raise FlightError(
                f"--trajectory {echo(trajectory)}: the target's {what} along an axis, up to {largest:g} "
                f"{unit}, exceeds ranges.{key} = {limit:g}; the controller would refuse it"
            )


def _wind_speed_m_s(wind: str) -> float:
    if wind not in (CALM, GUSTS):
        raise FlightError(
            f"--wind {echo(wind)} must be {CALM} or {GUSTS}; a steady acceleration is --push X,Y, in m/s^2"
        )
    return LIGHT_M_S if wind == GUSTS else 0.0


def _push_m_s2(text: str) -> tuple[float, float]:
    try:
        x, y = (float(word) for word in text.split(","))
    except ValueError:
        raise FlightError(f"--push {echo(text)} must be two numbers, as in 0.5,0") from None
    _within("--push", x, -100.0, 100.0)
    _within("--push", y, -100.0, 100.0)
    return x, y


def _within(option: str, value: float, low: float, high: float) -> None:
    """Raise FlightError unless the value of an option is a number from `low` to `high`."""
    if not math.isfinite(value):
        raise FlightError(f"{option} = {value} must be a finite number; it must lie in {low:g}..{high:g}")
    if not low <= value <= high:
        raise FlightError(f"{option} = {value} must lie in {low:g}..{high:g}")
