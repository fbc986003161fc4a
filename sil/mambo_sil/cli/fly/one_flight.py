"""Run the flight that the options of `fly` describe."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import typer

from mambo_codegen.errors import echo
from mambo_codegen.methods import method_of
from mambo_codegen.numbers.representation import TARGET
from mambo_codegen.settings.messages import degrees_hint
from mambo_codegen.settings.model import Settings
from mambo_sil.cli.fly.fly_options import DURATION_S, RATE_RAD_S, SIZE_M, Conditions, Course, Output, Runner
from mambo_sil.cli.fly.target_columns import target_columns
from mambo_sil.cli.options import load, load_drone, show_result
from mambo_sil.cli.progress import progress_bar
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.gusts import LIGHT_M_S
from mambo_sil.drone.plant.vehicle import LARGEST_LAG_S, Vehicle
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import FirstOrderAttitude
from mambo_sil.errors import FlightError, TrajectoryError
from mambo_sil.flight.altitude_loops import AltitudeLaw
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.own_law import Law, OwnLaws, load_law, period_of
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.engine.simulate import fly as simulate
from mambo_sil.flight.flight_report import FlightSummary, FlySummary, judge
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.names import CONTROLLER_NAMES, CURVE_FORMS, SIZED, TIMED, PdName, flies_settings
from mambo_sil.flight.own_curve import check_curve, curve_named, is_curve_file, load_curve
from mambo_sil.flight.polynomials import Pieces
from mambo_sil.flight.scenario import (
    LARGEST_RATE_RAD_S,
    LARGEST_SEED,
    LARGEST_SIZE_M,
    LARGEST_WIND_M_S,
    LONGEST_S,
    Scenario,
    choose_sensors,
)
from mambo_sil.flight.traces import Trace, write_csv, write_npz
from mambo_sil.flight.trajectories import CURVES, Trajectory
from mambo_sil.results.build_folders import scratch_folder
from mambo_sil.results.folders import new_results
from mambo_sil.results.terminal import sentence

CALM, GUSTS = "none", "gusts"
TRACE_FILES = ("trace.csv", "trace.npz")
FLIGHT_FILES = (*TRACE_FILES, "flight.png", "flight.svg")


def fly_once(course: Course, conditions: Conditions, runner: Runner, output: Output) -> None:
    """Fly once, write the results; exit 1 if the drone crashes or is lost, or bits differ.

    Raises FlightError, TrajectoryError, and the errors of loading settings or boards and of building the C.
    """
    if runner.real_time:
        raise FlightError(
            "--real-time lets the clock of a board call the step: give its --port, or leave it out"
        )
    _refuse_settings(runner)
    law = None if runner.controller in CONTROLLER_NAMES else load_law(runner.controller)
    settings, drone = load_settings(runner), load_drone(conditions.vehicle, named_source(runner))
    flight = described_flight(course, conditions, runner, settings, drone, law=law)
    laws = None if law is None else OwnLaws(law, flight)
    with new_results(output.output, FlySummary.command, FLIGHT_FILES) as folder:
        if runner.on is not None:
            flies = _on_board(runner, settings)
        else:
            flies = laws or _controller(runner, settings, flight)
        with progress_bar("flying") as progress:
            trace = simulate(flight, flies, progress)
        same_bits = None
        if runner.on is not None:
            same_bits = trace.same_bits(simulate(flight, _controller(runner, settings, flight)))
        if settings.height is not None and flies_settings(runner.controller):
            trace = trace.in_space()
        fields = summary_fields(course, conditions, runner, flight, settings)
        limited = Scenario() if flies_settings(runner.controller) else None
        fields |= judge(trace, settings, drone, limited, flight.trajectory) | {"same_bits_as_host": same_bits}
        summary = FlySummary(**fields)
        write_flight(trace, summary, settings, output, folder, flight=flight)
        summary.write(folder)
    tell_failures(laws)
    finish(summary, output, written(output))


def tell_failures(laws: OwnLaws | None) -> None:
    """Say when and why laws failed."""
    for failure in laws.failures.values() if laws else ():
        typer.echo(sentence(failure), err=True)


def load_settings(runner: Runner) -> Settings:
    """Return the settings to fly; a PD, which has none, flies at the rate of the default ones."""
    return load(named_source(runner), runner.scalar)


def named_source(runner: Runner) -> str:
    """Return the preset or file of the settings."""
    return "mambo" if runner.source is None else runner.source


def described_flight(
    course: Course,
    conditions: Conditions,
    runner: Runner,
    settings: Settings,
    drone: VehicleFile,
    *,
    law: Law | None = None,
) -> Flight:
    """Return the flight that the options describe, of `law` or settings.

    Raises FlightError and TrajectoryError.
    """
    period_s = settings.horizon.update_period_s if law is None else period_of(law)
    curve = curve_of(course)
    _demand_angle("--yaw-rad", course.yaw_rad)
    _demand_angle("--wind-direction-rad", conditions.wind_direction_rad)
    wind = _wind_speed_m_s(conditions.wind), conditions.wind_direction_rad
    disturbances = Disturbances(*wind, push_m_s2=_push_m_s2(conditions.push))
    vehicle = _vehicle(conditions, drone)
    try:
        sensors = choose_sensors(conditions.sensors, drone)
    except FlightError as error:
        raise FlightError(f"--{error}") from error
    duration_s = duration_of(course)
    _within("--duration-s", duration_s, period_s, LONGEST_S)
    _within("--seed", conditions.seed, 0, LARGEST_SEED)
    try:
        flight = Flight(
            curve,
            duration_s=duration_s,
            start=course.start,
            yaw_rad=course.yaw_rad,
            vehicle=vehicle,
            update_period_s=period_s,
            seeds=(conditions.seed,),
            disturbances=disturbances,
            sensors=sensors,
            altitude=AltitudeLaw(conditions.altitude_loop),
        )
    except FlightError as error:
        source = f"{echo(named_source(runner))}: horizon." if law is None else f"{echo(runner.controller)}: "
        raise FlightError(f"{source}{error}; only the simulation requires this") from error
    if flies_settings(runner.controller):
        _check_ranges(flight, settings, course.trajectory)
    return flight


def summary_fields(
    course: Course, conditions: Conditions, runner: Runner, flight: Flight, settings: Settings
) -> dict[str, Any]:
    """Return the fields of a `FlySummary` that do not follow from the trace."""
    has_settings = flies_settings(runner.controller)
    size_m, rate_rad_s = _size_and_rate(course)
    return (vars(course) | vars(conditions) | vars(runner)) | {
        "source": named_source(runner) if has_settings else None,
        "settings": settings.digest if has_settings else None,
        "board": runner.on,
        "vehicle": flight.vehicle.drone,
        "motor_lag_s": flight.vehicle.motor_lag_s,
        "update_period_s": flight.update_period_s,
        "size_m": size_m,
        "rate_rad_s": rate_rad_s,
        "duration_s": _flown_s(flight),
        "trajectory_sha256": load_curve(course.trajectory)[1] if is_curve_file(course.trajectory) else None,
        "push_m_s2": flight.disturbances.push_m_s2,
        "wind_speed_m_s": flight.disturbances.wind_speed_m_s,
        "wind_direction_rad": flight.disturbances.wind_direction_rad,
    }


def _flown_s(flight: Flight) -> float:
    """Return the time on the trajectory, a whole number of update periods; say if it is not the given one."""
    flown_s = float(flight.times_s()[-1])
    if math.isclose(flown_s, flight.duration_s, rel_tol=1e-9):
        return flight.duration_s
    typer.echo(
        f"--duration-s = {flight.duration_s:g}: flown {flown_s:g} s, "
        f"a whole number of update periods of {flight.update_period_s:g} s",
        err=True,
    )
    return flown_s


def written(output: Output) -> tuple[str, ...]:
    """Return the names of the files of one flight, without its summary."""
    return TRACE_FILES if output.no_pictures else FLIGHT_FILES


def write_flight(
    trace: Trace, summary: FlySummary, settings: Settings, output: Output, folder: Path, *, flight: Flight
) -> None:
    """Write the files of `written`."""
    others = target_columns(flight, settings) if flies_settings(summary.controller) else {}
    write_trace(trace, folder, others)
    if not output.no_pictures:
        draw(trace, summary, summary.about, summary.duration_s, folder)


def write_trace(trace: Trace, folder: Path, others: Mapping[str, FloatArray]) -> None:
    """Write `TRACE_FILES`; `others` are further columns."""
    write_csv(trace, folder / "trace.csv", others=others)
    write_npz(trace, folder / "trace.npz")


def draw(trace: Trace, summary: FlightSummary, about: str, duration_s: float, folder: Path) -> None:
    """Write the pictures of `FLIGHT_FILES`."""
    from mambo_sil.flight.flight_plots import draw_flight  # matplotlib is slow to import

    message = f"Distance to the target: {'; '.join(summary.answer(duration_s))}"
    draw_flight(trace, message, about, folder / "flight", summary.marks)


def finish(summary: FlightSummary, output: Output, files: tuple[str, ...]) -> None:
    """Print the results and the files written; exit 1 unless the summary is good."""
    show_result(summary, output.output, files, as_json=output.as_json)
    if not summary.good:
        raise typer.Exit(1)


def _refuse_settings(runner: Runner) -> None:
    """Raise FlightError for settings or a scalar type that would not fly."""
    if flies_settings(runner.controller):
        return
    for option, value in (("", runner.source), ("--scalar ", runner.scalar)):
        if value is not None:
            raise FlightError(
                f"{option}{echo(value)}: --controller {runner.controller} has no settings; leave it out, "
                "or fly it with --controller nmpc"
            )


def _controller(runner: Runner, settings: Settings, flight: Flight) -> PositionController:
    match runner.controller:
        case "reference":
            return method_of(settings).reference_controller()
        case "nmpc":
            return CompiledController(settings)
        case pd:
            return pd_controller(cast("PdName", pd), flight)


def _on_board(runner: Runner, settings: Settings) -> PositionController:
    """Build the C for a board, and load it into the board's emulated core."""
    from mambo_codegen import boards
    from mambo_sil.board.emulated import EmulatedController, build_guest  # unicorn is slow to import
    from mambo_sil.board.firmware.firmware_build import builder

    board = str(runner.on)
    if runner.controller != "nmpc":
        raise FlightError(f"--on {echo(board)} runs the C: use it with --controller nmpc only")
    chosen = boards.load(board)
    core = chosen.emulated_core.value
    with scratch_folder() as work:
        return EmulatedController(settings, build_guest(settings, builder(chosen), work), core)


def duration_of(course: Course, default_s: float = DURATION_S) -> float:
    """Return the duration of a course: the given one, that of a file's pieces, or `default_s`.

    Raises FlightError and TrajectoryError.
    """
    if course.duration_s is not None:
        return course.duration_s
    flown = load_curve(course.trajectory)[0] if is_curve_file(course.trajectory) else None
    return flown.flown_s if isinstance(flown, Pieces) else default_s


def curve_of(course: Course) -> Trajectory:
    """Return the curve by name, or that of a file; raises FlightError and TrajectoryError."""
    size_m, rate_rad_s = _size_and_rate(course)
    if course.trajectory not in CURVES and not is_curve_file(course.trajectory):
        raise TrajectoryError(f"--trajectory {echo(course.trajectory)} must be {CURVE_FORMS}")
    curve = curve_named(course.trajectory, size_m or 0.0, rate_rad_s or 0.0)
    if is_curve_file(course.trajectory):
        check_curve(echo(course.trajectory), curve, duration_of(course))
    return curve


def _size_and_rate(course: Course) -> tuple[float | None, float | None]:
    """Return size and angular rate of the curve, None for what it has not; raises FlightError."""
    found: list[float | None] = []
    for option, given, default, largest, curves in (
        ("--size-m", course.size_m, SIZE_M, LARGEST_SIZE_M, SIZED),
        ("--rate-rad-s", course.rate_rad_s, RATE_RAD_S, LARGEST_RATE_RAD_S, TIMED),
    ):
        if course.trajectory in curves:
            value = default if given is None else given
            _within(option, value, -largest, largest)
            found.append(value)
        elif given is None:
            found.append(None)
        else:
            raise FlightError(
                f"{option} = {given:g}: --trajectory {echo(course.trajectory)} has none; leave it out, "
                f"or fly {', '.join(curves)}"
            )
    return found[0], found[1]


def _vehicle(conditions: Conditions, drone: VehicleFile) -> Vehicle:
    """Return the drone with the lag of its motors; raises FlightError."""
    lag_s = conditions.motor_lag_s
    if lag_s is None:
        return Vehicle.of(drone)
    _within("--motor-lag-s", lag_s, 0.0, LARGEST_LAG_S)
    if isinstance(drone.attitude, FirstOrderAttitude):
        raise FlightError(
            f"--motor-lag-s = {lag_s:g}: vehicle {echo(drone.name)} is simulated without motors "
            f'(attitude.kind = "{drone.attitude.kind}"); leave it out, or change lag_s in its file'
        )
    return replace(Vehicle.of(drone), motor_lag_s=lag_s)


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
    for word, speed_m_s in ((CALM, 0.0), (GUSTS, LIGHT_M_S)):
        if wind == word:
            return speed_m_s
    try:
        speed_m_s = float(wind)
    except ValueError:
        raise FlightError(
            f"--wind {echo(wind)} must be {CALM}, {GUSTS} or a speed in m/s; a steady acceleration is "
            "--push X,Y, in m/s^2"
        ) from None
    _within("--wind", speed_m_s, 0.0, LARGEST_WIND_M_S)
    return speed_m_s


def _push_m_s2(text: str) -> tuple[float, float]:
    try:
        x, y = (float(word) for word in text.split(","))
    except ValueError:
        raise FlightError(f"--push {echo(text)} must be two numbers, as in 0.5,0") from None
    _within("--push", x, -100.0, 100.0)
    _within("--push", y, -100.0, 100.0)
    return x, y


def _demand_angle(option: str, angle_rad: float) -> None:
    """Raise FlightError unless an angle is at most a full turn: what is more may be in degrees."""
    try:
        _within(option, angle_rad, -math.tau, math.tau)
    except FlightError as error:
        hint = degrees_hint(angle_rad) if abs(math.radians(angle_rad)) <= math.tau else ""
        raise FlightError(f"{error}{hint}") from None


def _within(option: str, value: float, low: float, high: float) -> None:
    """Raise FlightError unless the value of an option is a number from `low` to `high`."""
    if not math.isfinite(value):
        raise FlightError(f"{option} = {value} must be a finite number; it must lie in {low:g}..{high:g}")
    if not low <= value <= high:
        raise FlightError(f"{option} = {value} must lie in {low:g}..{high:g}")
