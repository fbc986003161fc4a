"""What a third axis is worth: a Crazyflie's height through motion capture, by three altitude loops and by it.

Prints a table in Markdown and draws a helix into the folder that is given. Each flight is flown at 8 headings
with noise of its own; the table has the worst of them. Loops and third axis fly with the same roll and pitch:
those that `design` derives for the Crazyflie.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, get_args

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from benchmarks.markdown import table
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.optional_sections import Guard
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight import columns
from mambo_sil.flight.altitude_loops import AltitudeLaw
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.thrust_controller import adapted
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.height_profiles import (
    FALL_TIME_S,
    PLANNED_S,
    RISE_TIME_S,
    HeightProfile,
    TakeOffAndLanding,
    UpAndDown,
)
from mambo_sil.flight.loop import Flight, Outcome, PositionController
from mambo_sil.flight.metrics import height_error_m, horizontal_error_m
from mambo_sil.flight.names import AltitudeName
from mambo_sil.flight.scenario import choose_sensors
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import CURVES, Circle, Hover, InSpace, PositionStep, Trajectory
from mambo_sil.model.derive.derived_flight import chosen_text
from mambo_sil.model.derive.derived_settings import controller_text
from mambo_sil.results.pictures import save
from mambo_sil.results.style import BLUE, BROAD, PAGE_INCHES, TARGET, VERMILION, style

HEADINGS: Final = 8
"""Columns of the states of controllers of the height."""
RANDOM: Final = 60
CAMPAIGN: Final = 1000
TRANSIENT_S: Final = 3.0
LATER_S: Final = 4.0
"""When payloads are dropped and gusts begin."""
BAND_M: Final = 0.03
LIFT_M: Final = 0.05
"""Height of a target at which the motors are to come up to speed."""
APP_GROUND_M: Final = 0.05
APP_LIFT_M: Final = 0.125
"""Up to this height the Crazyflie's app is on the floor, where it lifts targets that climb to the other."""
PLACES: Final = 4
"""Of the circle, where a step of height begins."""
LOOPS: Final[tuple[AltitudeName, ...]] = get_args(AltitudeName)
TITLES: Final = ("the vehicle's loop", "with feed-forward", "PID", "third axis")
DRONE: Final = vehicle_toml.preset("crazyflie")
MASS_KG: Final = DRONE.body.mass_kg


@dataclass(frozen=True)
class Change:
    """What differs from the nominal drone in still air; each one value or (n,)."""

    mass: Any = 1.0
    thrust: Any = 1.0
    lag: Any = 1.0
    payload: Any = 0.0
    sag_1_s: Any = 0.0
    gust_m_s2: Any = 0.0


NOMINAL: Final = Change()


class AppTakeOff:
    """Controllers of the height, one for each heading, with the take-off of the Crazyflie's app."""

    def __init__(self, controller: PositionController) -> None:
        self.controller = adapted(controller)
        self._is_up = np.zeros(HEADINGS, np.bool_)

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Outcome:
        """Step with contact with the floor, and targets, as the app gives them."""
        self._is_up |= state[:, columns.STATE["height_m"]][:, 0] > APP_GROUND_M
        height_m, climb_m_s = (target[:, columns.TARGET[name]][:, 0] for name in ("height_m", "climb_m_s"))
        given_m = np.where(self._is_up | (climb_m_s <= 0.0), height_m, np.maximum(height_m, APP_LIFT_M))
        state, target = state.copy(), target.copy()
        state[:, columns.STATE["on_ground"].start], target[:, columns.TARGET["height_m"].start] = (
            ~self._is_up,
            given_m,
        )
        outcome: Outcome = self.controller.step(state, target, thrust_acceleration_m_s2)
        return outcome


def settings_of(*, height: bool) -> Settings:
    """Return the settings that `design` derives, or with small angles and without a height."""
    text = chosen_text(DRONE, "crazyflie") if height else controller_text(DRONE, "crazyflie")
    settings = controller_toml.parse(text, "derived")
    return settings if height else _without_height(settings)


def _without_height(settings: Settings) -> Settings:
    """Return settings without [height], and without what a guard has for the thrust."""
    guard = settings.guard
    if guard is not None:
        thrust = {
            name: Guard.model_fields[name].default for name in ("thrust_budget_m_s2", "thrust_budget_m_s3")
        }
        guard = guard.model_copy(update=thrust)
    return Settings.model_validate(settings.model_copy(update={"height": None, "guard": guard}).model_dump())


def flown(
    trajectory: Trajectory,
    duration_s: float,
    loop: AltitudeName | None,
    change: Change = NOMINAL,
    flights: int = HEADINGS,
    *,
    around: Callable[[PositionController], PositionController] = lambda controller: controller,
) -> Trace:
    """Fly with an altitude loop, or with the third axis (None), and what is `around` the controllers."""
    plant = Vehicle.of(DRONE)
    airframe = replace(
        plant.airframe,
        mass_kg=MASS_KG * np.asarray(change.mass),
        thrust_factor_n_s2=plant.airframe.thrust_factor_n_s2 * np.asarray(change.thrust),
        torque_factor_n_m_s2=plant.airframe.torque_factor_n_m_s2 * np.asarray(change.thrust),
    )
    flight = Flight(
        trajectory,
        duration_s=duration_s,
        flights=flights,
        yaw_rad=np.linspace(0.0, 2.0 * np.pi, flights, endpoint=False),
        vehicle=replace(plant, airframe=airframe, motor_lag_s=plant.motor_lag_s * np.asarray(change.lag)),
        seeds=tuple(range(flights)),
        disturbances=Disturbances(
            battery_sag_1_s=change.sag_1_s,
            payload_kg=MASS_KG * np.asarray(change.payload),
            payload_time_s=LATER_S,
            vertical_gust_m_s2=change.gust_m_s2,
            vertical_gust_time_s=LATER_S,
        ),
        sensors=choose_sensors("mocap", DRONE),
        altitude=AltitudeLaw(loop or "stock"),
    )
    return fly(flight, around(CompiledController(settings_of(height=loop is None), flights)))


Figures = tuple[float, ...]
Measure = Callable[[AltitudeName | None], Figures]


def _rms(error_m: FloatArray) -> FloatArray:
    """Return the rms (n,) of errors (k, n)."""
    return np.asarray(np.sqrt(np.mean(error_m * error_m, axis=0)))


def _between(trace: Trace, begin_s: float, end_s: float) -> FloatArray:
    """Return the error of the height (k, n) in a time."""
    return height_error_m(trace)[(trace.time_s >= begin_s) & (trace.time_s < end_s)]


def swing(loop: AltitudeName | None) -> Figures:
    """Return the rms errors of height and place on a circle of 1 m with 0.3 m of swing, 1.5 rad/s."""
    trace = flown(CURVES["tilted-circle"](1.0, 1.5), 20.0, loop)
    late = trace.time_s >= TRANSIENT_S
    return float(_rms(height_error_m(trace)[late]).max()), float(_rms(horizontal_error_m(trace)[late]).max())


def step(loop: AltitudeName | None) -> Figures:
    """Return over-shoot and settling time of a step of 2 m up, and the same down."""
    trace = flown(CURVES["height-step"](2.0, 0.0), 11.0, loop)
    found: list[float] = []
    for begin_s, end_s, sign in ((RISE_TIME_S, FALL_TIME_S, 1.0), (FALL_TIME_S, 11.0, -1.0)):
        error_m = sign * _between(trace, begin_s, end_s)
        far = np.abs(error_m) > BAND_M
        settled_s = 0.01 * (len(far) - np.argmax(far[::-1], axis=0))
        found += [max(float(error_m.max()), 0.0), float(settled_s.max())]
    return tuple(found)


@dataclass(frozen=True)
class Later:
    """A profile of heights that begins `delay_s` later."""

    profile: HeightProfile
    delay_s: float

    def vertical(self, time_s: ArrayLike) -> FloatArray:
        """Return [height, climb, acceleration] (..., 3)."""
        return self.profile.vertical(np.asarray(time_s) - self.delay_s)


def step_on_circle(loop: AltitudeName | None) -> Figures:
    """Return the worst distance to the circle of 1 m, 1.5 rad/s, after a step of 2 m up, and down.

    The drone starts at rest, and has caught up with the circle when the step begins.
    """
    up, down = [], []
    for place in range(PLACES):
        later_s = TRANSIENT_S + place / PLACES * (2.0 * np.pi / 1.5)
        trace = flown(InSpace(Circle(1.0, 1.5), Later(UpAndDown(2.0), later_s)), 11.0 + later_s, loop)
        error_m, time_s = horizontal_error_m(trace), trace.time_s - later_s
        up.append(float(error_m[(time_s >= RISE_TIME_S) & (time_s < FALL_TIME_S)].max()))
        down.append(float(error_m[time_s >= FALL_TIME_S].max()))
    return max(up), max(down)


class Prepared:
    """The planned take-off and landing of 1 m; before it the target jumps to 5 cm, for a second."""

    def vertical(self, time_s: ArrayLike) -> FloatArray:
        """Return [height, climb, acceleration] (..., 3)."""
        found, time_s = TakeOffAndLanding(1.0).vertical(time_s), np.asarray(time_s)
        rising = ((time_s > 0.0) & (time_s < FALL_TIME_S))[..., np.newaxis]
        return np.asarray(np.where(rising, (LIFT_M, 0.0, 0.0) + (1.0 - LIFT_M) * found, found))


def _planned(trace: Trace) -> FloatArray:
    """Return the error of the height (k, n) in a planned take-off and the second after it."""
    return _between(trace, RISE_TIME_S, RISE_TIME_S + PLANNED_S + 1.0)


def _late_m(trajectory: Trajectory, loop: AltitudeName | None) -> Figures:
    """Return the largest lag of a planned take-off, and that with 30 % more mass."""
    return tuple(
        -float(_planned(flown(trajectory, 9.0, loop, Change(mass=mass))).min()) for mass in (1.0, 1.3)
    )


def take_off(loop: AltitudeName | None) -> Figures:
    """Return the lags from motors that idle on the floor."""
    return _late_m(CURVES["take-off-and-landing"](1.0, 0.0), loop)


def prepared_take_off(loop: AltitudeName | None) -> Figures:
    """Return the lags after a second with a target at 5 cm."""
    return _late_m(InSpace(Hover(), Prepared()), loop)


def app_take_off(loop: AltitudeName | None) -> Figures:
    """Return how far ahead the Crazyflie's app takes off, and its lag with 30 % more mass; without loops."""
    if loop is not None:
        return ()
    curve = CURVES["take-off-and-landing"](1.0, 0.0)
    light, heavy = (
        _planned(flown(curve, 9.0, None, Change(mass=mass), around=AppTakeOff)) for mass in (1.0, 1.3)
    )
    return float(light.max()), -float(heavy.min())


def weight(loop: AltitudeName | None) -> Figures:
    """Return the drop with 20 % more mass, what stays of it, and the rise when 15 % are dropped."""
    heavy = flown(Hover(), 12.0, loop, Change(mass=1.2))
    dropped = flown(Hover(), 12.0, loop, Change(mass=1.15, payload=-0.15))
    rest = np.abs(_between(heavy, 10.0, 12.0).mean(axis=0)).max()
    before = _between(dropped, LATER_S - 0.5, LATER_S).mean(axis=0)
    rise = (_between(dropped, LATER_S, 12.0) - np.minimum(before, 0.0)).max()
    return -float(height_error_m(heavy).min()), float(rest), float(rise)


def gust(loop: AltitudeName | None) -> Figures:
    """Return the largest error in a gust of 1 m/s^2 upwards, and the one left a second later."""
    trace = flown(Hover(), 8.0, loop, Change(gust_m_s2=1.0))
    worst = np.abs(_between(trace, LATER_S, LATER_S + 1.0)).max()
    return float(worst), float(np.abs(_between(trace, LATER_S + 1.0, LATER_S + 2.0).mean(axis=0)).max())


def drawn(count: int, seed: int) -> Change:
    """Return random drones: mass, thrust, lag of the motors, sag, gust."""
    rng = np.random.default_rng(seed)
    return Change(
        mass=rng.uniform(0.9, 1.2, count),
        thrust=rng.uniform(0.9, 1.05, count),
        lag=rng.uniform(0.5, 1.5, count),
        sag_1_s=rng.uniform(0.0, 0.001, count),
        gust_m_s2=rng.uniform(-1.0, 1.0, count),
    )


def random_drones(loop: AltitudeName | None) -> Figures:
    """Return median and 95 % quantile over random drones of the rms error on the circle with swing."""
    trace = flown(CURVES["tilted-circle"](1.0, 1.5), 20.0, loop, drawn(RANDOM, 60), RANDOM)
    late = trace.time_s >= TRANSIENT_S
    median, most = np.quantile(_rms(height_error_m(trace)[late]), (0.5, 0.95))
    return float(median), float(most)


def noise(loop: AltitudeName | None) -> Figures:
    """Return the mean change of the thrust over mass from update to update, on the circle with swing."""
    trace = flown(CURVES["tilted-circle"](1.0, 1.5), 20.0, loop)
    change = np.abs(np.diff(trace.thrust_acceleration_m_s2[trace.time_s >= TRANSIENT_S], axis=0))
    return (float(change.mean(axis=0).max()),)


def level(loop: AltitudeName | None) -> Figures:
    """Return the rms distance on level courses: a circle, an eight, a step."""
    courses: Sequence[Trajectory] = (Circle(1.0, 1.5), CURVES["bernoulli"](1.5, 1.0), PositionStep(2.0, 0.0))
    return tuple(float(_rms(horizontal_error_m(flown(one, 20.0, loop))).mean()) for one in courses)


def campaign(loop: AltitudeName | None) -> Figures:
    """Return the crashes of random drones on three curves in space."""
    crashes = 0
    curves = (
        CURVES["tilted-circle"](1.0, 1.5),
        CURVES["swinging-eight"](1.0, 1.0),
        CURVES["helix"](1.0, 1.5),
    )
    for number, curve in enumerate(curves):
        count = CAMPAIGN // len(curves) + (number < CAMPAIGN % len(curves))
        trace = flown(curve, 12.0, loop, drawn(count, number), count)
        crashes += int(detect_crashes(trace, DRONE).sum())
    return (float(crashes),)


MEASURES: Final[dict[str, tuple[Measure, str]]] = {
    "circle 1 m, 1.5 rad/s, swing 0.3 m: rms of the height; of the place, m": (swing, "{:.4f}; {:.4f}"),
    "step of 2 m up: over, m, settled in 3 cm, s; down": (step, "{:.3f}, {:.2f}; {:.3f}, {:.2f}"),
    "the step from 4 places of that circle: worst place up; down, m": (step_on_circle, "{:.3f}; {:.3f}"),
    "planned take-off, 1 m in 2 s: late; with 30 % more mass, m": (take_off, "{:.4f}; {:.3f}"),
    "the same after a second with the target at 5 cm, m": (prepared_take_off, "{:.4f}; {:.3f}"),
    "the same as the Crazyflie's app begins it: ahead; late with 30 % more mass, m": (
        app_take_off,
        "{:.4f}; {:.3f}",
    ),
    "20 % more mass: drop, what stays; 15 % dropped: up, m": (weight, "{:.3f}, {:.4f}; {:.3f}"),
    "vertical gust of 1 m/s^2: worst, left after a second, m": (gust, "{:.3f}, {:.4f}"),
    "60 random drones on that circle: rms, median; 95 %, m": (random_drones, "{:.4f}; {:.4f}"),
    "change of the thrust from update to update, m/s^2": (noise, "{:.3f}"),
    "level circle; eight; step: rms of the place, m": (level, "{:.4f}; {:.4f}; {:.4f}"),
    "1000 random drones in space: crashes": (campaign, "{:.0f}"),
}
"""What is measured, by its words in the table, and the form of its figures."""


def _spell(form: str, figures: Figures) -> str:
    return form.format(*figures) if figures else "\N{EN DASH}"


def rows() -> list[dict[str, str]]:
    """Fly everything and return the table."""
    return [
        {"flight": words}
        | {title: _spell(form, measure(loop)) for title, loop in zip(TITLES, (*LOOPS, None), strict=True)}
        for words, (measure, form) in MEASURES.items()
    ]


def draw_helix(stem: Path) -> None:
    """Draw a helix flown by the vehicle's loop and by the third axis, and the errors of the height."""
    laws: dict[str, tuple[AltitudeName | None, str]] = {
        TITLES[0]: ("stock", VERMILION),
        TITLES[-1]: (None, BLUE),
    }
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 2.8), layout="constrained")
        space = figure.add_subplot(1, 2, 1, projection="3d")
        error = figure.add_subplot(1, 2, 2)
        for label, (loop, colour) in laws.items():
            trace = flown(CURVES["helix"](1.0, 1.5), 12.6, loop, flights=1)
            x_m, y_m, z_m = trace.position_m[:, 0].T
            space.plot(x_m, y_m, -z_m, color=colour, label=label)
            error.plot(trace.time_s, height_error_m(trace)[:, 0], color=colour, label=label)
        target = trace.target[:, 0]
        space.plot(
            target[:, 0], target[:, 1], target[:, 4], color=TARGET, linewidth=BROAD, label="target", zorder=0
        )
        space.set(xlabel="x, m", ylabel="y, m", zlabel="height, m")
        error.set(xlabel="time, s", ylabel="m", title="Error of the height")
        error.legend(loc="lower right")
        save(figure, stem)


def main(arguments: list[str]) -> None:
    """Print the table, and draw the picture into the folder that `arguments` name."""
    print(table(rows()), flush=True)
    folder = Path(arguments[0])
    folder.mkdir(parents=True, exist_ok=True)
    draw_helix(folder / "height-helix")


if __name__ == "__main__":
    main(sys.argv[1:])
