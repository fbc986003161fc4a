"""What limits of speed, braking and place are worth: steps, circles and fences, state known and seen.

Prints a table in Markdown and draws a step of 30 m and a fence that a target leaves, into the folder
that is given. `tests/benchmarks/test_limits.py` holds the figures to bounds.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from benchmarks.markdown import table
from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import TRANSIENT_S, horizontal_error_m
from mambo_sil.flight.scenario import choose_sensors
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import STEP_TIME_S, Circle, PositionStep, Trajectory, Waypoints
from mambo_sil.results.pictures import save
from mambo_sil.results.style import BLUE, BROAD, INK, PAGE_INCHES, TARGET, VERMILION, style

HEADINGS: Final = 8
PRESETS: Final = {"mambo": "mambo", "crazyflie": "crazyflie", "mambo-1norm": "mambo", "table1": "mambo"}
"""The vehicle that each preset flies."""
SPEEDS_M_S: Final = (1.0, 2.0, 4.0, 6.0)
"""Speeds at which a target leaves the fence."""
WALL_M: Final = 2.0


@dataclass(frozen=True)
class LimitsCase:
    """What a flight meets beside its target.

    seen:      whether the controller sees the drone through the vehicle's sensors.
    changes:   of the vehicle.
    push_m_s2: steady acceleration along x and y.
    gusts_m_s: mean wind with gusts.
    """

    seen: bool = False
    changes: dict[str, Any] = field(default_factory=dict)
    push_m_s2: tuple[float, float] = (0.0, 0.0)
    gusts_m_s: float = 0.0


def cases(vehicle: str) -> dict[str, LimitsCase]:
    """Return the cases of a vehicle by their names."""
    mass_kg = Vehicle.of(vehicle_toml.preset(vehicle)).airframe.mass_kg
    return {
        "state known": LimitsCase(),
        "slow motors": LimitsCase(changes={"motor_lag_s": 0.10 if vehicle == "crazyflie" else 0.05}),
        "push of 1 m/s^2": LimitsCase(push_m_s2=(0.8, 0.6)),
        "15 % more mass": LimitsCase(changes={"mass_kg": 1.15 * mass_kg}),
        "sensors": LimitsCase(seen=True),
        "sensors, gusts": LimitsCase(seen=True, gusts_m_s=5.0),
    }


def limited(preset: str, speed_m_s: float, braking_m_s2: float, wall_m: float = 0.0) -> Settings:
    """Return a preset with these limits, and walls at plus and minus `wall_m` along x and y; 0 for none."""
    settings = presets.preset(preset)
    walls = {f"{axis}_{end}_m": sign * wall_m for axis in "xy" for end, sign in (("min", -1), ("max", 1))}
    limits = {"speed_m_s": speed_m_s, "braking_m_s2": braking_m_s2, "fence": walls}
    for name, value in limits.items():
        settings = with_option(settings, f"limits.{name}", value)
    return settings


def flown(
    settings: Settings, vehicle: str, trajectory: Trajectory, duration_s: float, case: LimitsCase
) -> Trace:
    """Fly at HEADINGS headings round the circle."""
    drone = vehicle_toml.preset(vehicle)
    plant = Vehicle.of(drone)
    in_airframe = {name: value for name, value in case.changes.items() if hasattr(plant.airframe, name)}
    others = {name: value for name, value in case.changes.items() if name not in in_airframe}
    flight = Flight(
        trajectory,
        duration_s=duration_s,
        flights=HEADINGS,
        yaw_rad=np.linspace(0, 2 * np.pi, HEADINGS, endpoint=False),
        vehicle=replace(plant, airframe=replace(plant.airframe, **in_airframe), **others),
        update_period_s=settings.horizon.update_period_s,
        seeds=tuple(range(HEADINGS)),
        disturbances=Disturbances(push_m_s2=case.push_m_s2, wind_speed_m_s=case.gusts_m_s),
        sensors=choose_sensors("mocap" if vehicle == "crazyflie" else "mambo-derotated", drone)
        if case.seen
        else None,
    )
    return fly(flight, CompiledController(settings, HEADINGS))


def leaving(speed_m_s: float) -> Waypoints:
    """Return a target that leaves a fence of WALL_M, stays outside for 3 s and comes back."""
    away_s = 8.0 / speed_m_s
    points = ((2.0, 0.0), (2.0 + away_s, 8.0), (5.0 + away_s, 8.0), (5.0 + (2 * away_s), 0.0))
    return Waypoints(tuple((time_s, x_m, 0.0) for time_s, x_m in points))


def top_speed_m_s(trace: Trace) -> FloatArray:
    """Return the largest horizontal speed (n,)."""
    return np.asarray(np.hypot(trace.velocity_m_s[..., 0], trace.velocity_m_s[..., 1]).max(axis=0))


def overshoot_m(trace: Trace) -> FloatArray:
    """Return how far beyond its last target each drone came, along the line from its first (n,)."""
    last = trace.target[-1, 0, :2]
    along = (trace.position_m[..., :2] - last) @ (last / np.hypot(*last))
    return np.asarray(along.max(axis=0))


def settling_s(trace: Trace) -> FloatArray:
    """Return the time from the step to the last sample more than 5 cm from the target (n,)."""
    far = horizontal_error_m(trace) > 0.05
    last = np.array([np.flatnonzero(column)[-1] if column.any() else 0 for column in far.T])
    return np.asarray(trace.time_s[last] - STEP_TIME_S)


def past_wall_m(trace: Trace) -> FloatArray:
    """Return the largest distance past a wall (n,); less than 0 where the drone stayed inside."""
    return np.asarray(np.abs(trace.position_m[..., :2]).max(axis=(0, 2)) - WALL_M)


def rows() -> list[dict[str, str]]:
    """Fly everything and return the table: median, worst over the headings."""

    def cell(values: FloatArray, scale: float = 1.0, digits: int = 2) -> str:
        return f"{scale * np.median(values):.{digits}f}, {scale * np.max(values):.{digits}f}"

    found = []
    for preset, vehicle in PRESETS.items():
        circle = Circle(1.0, 2.2)
        if method_of(presets.preset(preset)).limiting is None:
            step, turned = (
                flown(presets.preset(preset), vehicle, path, duration_s, LimitsCase())
                for path, duration_s in ((PositionStep(24, 18), 20.0), (circle, 30.0))
            )
            found.append(_row(preset, "state known, no limits", step, turned, cell))
        for name, case in cases(vehicle).items():
            step = flown(limited(preset, 5.0, 2.0), vehicle, PositionStep(24, 18), 20.0, case)
            fenced = limited(preset, 3.0, 2.0, WALL_M)
            past = [
                past_wall_m(flown(fenced, vehicle, leaving(speed), 12.0 + (16.0 / speed), case))
                for speed in SPEEDS_M_S
            ]
            turned = flown(limited(preset, 2.0, 2.0), vehicle, circle, 30.0, case)
            row = _row(preset, name, step, turned, cell)
            found.append(row | {"past the wall, mm": cell(np.array(past), 1000.0, 1)})
    return found


def _row(preset: str, name: str, step: Trace, circle: Trace, cell: Callable[..., str]) -> dict[str, str]:
    error_m = horizontal_error_m(circle)[circle.time_s > TRANSIENT_S].max(axis=0)
    return {
        "preset": f"`{preset}`",
        "case": name,
        "speed, m/s": cell(top_speed_m_s(step)),
        "overshoot, cm": cell(overshoot_m(step), 100.0, 1),
        "settled, s": cell(settling_s(step), 1.0, 1),
        "past the wall, mm": "-",
        "circle, m": cell(error_m),
    }


def draw_step(stem: Path) -> None:
    """Draw distance flown and speed of a step of 30 m, with and without limits."""
    flights = {
        "mambo-1norm, no limits": (presets.preset("mambo-1norm"), VERMILION),
        "mambo, speed 5 m/s, braking 3 m/s$^2$": (limited("mambo", 5.0, 3.0), BLUE),
    }
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 2.2), layout="constrained")
        place, speed = figure.subplots(1, 2)
        for label, (settings, colour) in flights.items():
            trace = flown(settings, "mambo", PositionStep(30.0, 0.0), 14.0, LimitsCase())
            time_s = trace.time_s - STEP_TIME_S
            place.plot(time_s, trace.position_m[:, 0, 0], color=colour, label=label)
            speed.plot(time_s, np.hypot(*trace.velocity_m_s[:, 0, :2].T), color=colour, label=label)
        place.plot(time_s, trace.target[:, 0, 0], color=TARGET, linewidth=BROAD, label="target", zorder=0)
        place.set(xlabel="time, s", ylabel="x, m", title="A target 30 m away")
        speed.set(xlabel="time, s", ylabel="speed, m/s", title="Speed")
        place.legend(loc="lower right")
        save(figure, stem)


def draw_fence(stem: Path) -> None:
    """Draw a target that leaves a fence, and the drone in it."""
    target = Waypoints(((2.0, 0.0, 0.0), (4.0, 3.4, 2.6), (6.5, 3.4, -1.0), (9.0, -0.6, -1.2)))
    trace = flown(limited("mambo", 5.0, 3.0, WALL_M), "mambo", target, 12.0, LimitsCase())
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 2.6), layout="constrained")
        plan, along = figure.subplots(1, 2)
        walls = [-WALL_M, WALL_M, WALL_M, -WALL_M, -WALL_M]
        plan.plot(walls, np.roll(walls, -1)[[0, 1, 2, 3, 0]], color=INK, linestyle="--", label="fence")
        plan.plot(*trace.target[:, 0, :2].T, color=TARGET, linewidth=BROAD, label="target")
        plan.plot(*trace.position_m[:, 0, :2].T, color=BLUE, label="drone")
        plan.set(aspect="equal", xlabel="x, m", ylabel="y, m", title="From above")
        along.axhline(WALL_M, color=INK, linestyle="--")
        along.plot(trace.time_s, trace.target[:, 0, 0], color=TARGET, linewidth=BROAD)
        along.plot(trace.time_s, trace.position_m[:, 0, 0], color=BLUE)
        along.set(xlabel="time, s", ylabel="x, m", title="Along x")
        plan.legend(loc="center left")
        save(figure, stem)


def main(arguments: list[str]) -> None:
    """Print the table, and draw the pictures into the folder that `arguments` name."""
    print(table(rows()), flush=True)
    folder = Path(arguments[0])
    folder.mkdir(parents=True, exist_ok=True)
    draw_step(folder / "limits-step")
    draw_fence(folder / "limits-fence")


if __name__ == "__main__":
    main(sys.argv[1:])
