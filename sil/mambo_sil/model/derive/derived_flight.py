"""Flights of derived settings on their drone: it keeps its place, also if pushed, and survives tilts."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from mambo_codegen.errors import BuildError
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import PlacedSensors
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.crashes import first_crash
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.flown_settings import FlownSettings
from mambo_sil.flight.loop import Flight, Offset
from mambo_sil.flight.metrics import height_error_m
from mambo_sil.flight.names import DEFAULT_SENSORS, SensorsName
from mambo_sil.flight.scenario import Scenario, choose_sensors, flight_of
from mambo_sil.flight.traces import SensedTrace, Trace
from mambo_sil.flight.trajectories import Hover, Trajectory
from mambo_sil.model.derive.derived_settings import EXACT_TILT_SHARES, controller_text, wants_exact

DURATION_S: Final = 10.0
JUDGED_S: Final = 5.0
"""Length of the end that is judged."""
HEADINGS: Final = 4
START: Final = Offset((-0.7, 0.7, 0.3))
"""Where the drone starts: a metre beside its target, and below it."""

CALM: Final = Disturbances()

FAR_M: Final = 0.05
"""A drone whose mean place is farther from its target is not there: 12 mm is the most of shipped ones."""
SWINGING_RAD: Final = 0.15
"""Rms of a tilt that oscillates: 0.02 is the most of shipped drones, 0.07 that with 2 cm of noise."""
QUICK_CIRCLE: Final = 1.2
"""Rate of a circle over the one that takes the whole tilt limit."""
SLOWER_ROTORS, OTHER_MASS, DRAWN = 1.5, 0.1, 16
"""How much slower the rotors on that circle are, what the mass may differ by, and how many drones fly it."""
LOST_HEIGHT_M: Final = 1.0

PUSHES_M_S2: Final = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
"""Steady accelerations from the side, as of wind of as many m/s on a drone with a drag of 1 1/s."""
PUSHED_S: Final = 15.0
BORNE_SHARE, BORNE_M_S2 = 0.6, 5.0
"""Push that good settings bear: that share of what the tilt limit holds, at most so much."""

FIRM_PUSH_M_S2: Final = 0.5
"""Push by which firm settings are compared with calm ones."""

LEVERS_M: Final = (0.01, 0.02, 0.03, 0.05, 0.07, 0.1)
"""How far from where they are told to be sensors are tried."""
LEVER_SWING, LEAST_SWING_RAD = 2.0, 0.002
"""Share by which a drone that is seen elsewhere may swing more, and what any drone may."""

SWINGING_M_S: Final = 0.2
"""Rms of a velocity that oscillates: 0.03 is the most of shipped drones, 0.05 that with 2 cm of noise."""


@dataclass(frozen=True)
class ChosenSettings:
    """A controller.toml, and why it has small angles where the exact tilt is of use."""

    text: str
    small_angles: str | None


def fly_derived(settings: Settings, drone: VehicleFile) -> FlownSettings:
    """Fly to a place and stay there, at headings around the whole turn, through the drone's own sensors.

    A height is judged only if the settings hold it. Raises BuildError, CacheError.
    """
    sensors = _own_sensors(drone)
    trace = _flown(settings, drone, Hover(), START)
    where = "true state" if sensors == "true" else f"through sensors {sensors}"
    fault = _fault(trace, drone, axes=2 if settings.height is None else 3)
    if fault is not None:
        return FlownSettings(good=False, words=f"flown for {DURATION_S:g} s: {fault} ({where})")
    return FlownSettings(good=True, words=f"flown for {DURATION_S:g} s: stays at its target ({where})")


def fly_pushed(settings: Settings, drone: VehicleFile) -> FlownSettings:
    """Push a drone that hovers, more and more, along each axis of its heading and between them.

    It bears a push if it returns to its target and stays there. Raises BuildError, CacheError.
    """
    holds_m_s2 = settings.observer.disturbance_limit_m_s2
    wanted_m_s2 = min(BORNE_M_S2, BORNE_SHARE * holds_m_s2)
    borne_m_s2, axes = 0.0, 2 if settings.height is None else 3
    for push_m_s2 in (one for one in PUSHES_M_S2 if one < holds_m_s2):
        world = Disturbances(push_m_s2=(push_m_s2, 0.0))
        trace = _flown(settings, drone, Hover(), Offset(), world, duration_s=PUSHED_S)
        fault = _fault(trace, drone, axes)
        if fault is None:
            borne_m_s2 = push_m_s2
        elif push_m_s2 > wanted_m_s2:
            break
        else:
            return FlownSettings(good=False, words=f"pushed by {push_m_s2:g} m/s^2: {fault}")
    words = f"bears a steady push of {borne_m_s2:g} m/s^2 from every side"
    if not borne_m_s2:
        words = f"bears no steady push: its tilt limit holds {holds_m_s2:g} m/s^2"
    return FlownSettings(good=True, words=words)


def fly_beside(settings: Settings, drone: VehicleFile) -> FlownSettings | None:
    """See a drone that hovers farther and farther below and above the place that its controller was told.

    It bears a place at which it neither leaves its target nor swings more than LEVER_SWING times as much as
    when it is seen where it was told. None for a drone whose sensors have no such place. Raises BuildError,
    CacheError.
    """
    if not isinstance(drone.sensors, PlacedSensors):
        return None
    calm_rad = _swing_rad(_flown(settings, drone, Hover(), START))
    borne_m = {}
    for side, sign in (("below", 1.0), ("above", -1.0)):
        borne_m[side] = 0.0
        for error_m in LEVERS_M:
            seen = replace(Vehicle.of(drone), lever_error_m=(0.0, 0.0, sign * error_m))
            trace = _flown(settings, drone, Hover(), START, vehicle=seen)
            if (
                _fault(trace, drone, axes=2)
                or not _swing_rad(trace) < LEVER_SWING * calm_rad + LEAST_SWING_RAD
            ):
                break
            borne_m[side] = error_m
    reach = " and ".join(f"{100.0 * most_m:g} cm {side}" for side, most_m in borne_m.items())
    return FlownSettings(good=True, words=f"bears to be seen {reach} where sensors.lever_m says")


def firm_words(firm: Settings, calm: Settings, drone: VehicleFile) -> str:
    """Return what firm settings gain in a push over calm ones, and what they take.

    Raises BuildError, CacheError.
    """
    moved_m, changed_rad = [], []
    for settings in (firm, calm):
        world = Disturbances(push_m_s2=(FIRM_PUSH_M_S2, 0.0))
        trace = _flown(settings, drone, Hover(), Offset(), world)
        off_m = (trace.position_m - _target_m(trace))[..., :2]
        moved_m.append(float(np.hypot(off_m[..., 0], off_m[..., 1]).max()))
        changed_rad.append(float(np.abs(np.diff(trace.command_rad, axis=0)).mean()))
    return (
        f"firm: a push of {FIRM_PUSH_M_S2:g} m/s^2 moves it by {1e3 * moved_m[0]:.0f} mm, with --calm by "
        f"{1e3 * moved_m[1]:.0f}; its commands change {changed_rad[0] / changed_rad[1]:.1f} times as much"
    )


def quick_rate_rad_s(tilt_rad: float) -> float:
    """Return the rate of a circle of 1 m that asks for more than a tilt limit."""
    return QUICK_CIRCLE * math.sqrt(GRAVITY_M_S2 * math.tan(tilt_rad))


def flies_quick_circle(settings: Settings, drone: VehicleFile) -> bool:
    """Return whether drones with slower rotors survive a circle that asks for more than their tilt limit.

    Masses, headings and sensor noise are drawn. Lost is a drone whose height is a metre off, as that of one
    that lies on the ground is. Raises BuildError, CacheError.
    """
    parts = {name: getattr(drone, name) for name in ("rotors", "thrust")}
    slower = {
        name: part.model_copy(update={"lag_s": SLOWER_ROTORS * part.lag_s})
        for name, part in parts.items()
        if part is not None
    }
    rng = np.random.default_rng(0)
    circles = [
        Scenario(
            vehicle=drone.model_copy(update=slower),
            seed=seed,
            trajectory="circle",
            size_m=1.0,
            rate_rad_s=quick_rate_rad_s(settings.limits.tilt_rad),
            duration_s=DURATION_S,
            yaw_rad=rng.uniform(0.0, 2.0 * math.pi),
            mass_kg=drone.body.mass_kg * rng.uniform(1.0 - OTHER_MASS, 1.0 + OTHER_MASS),
            sensors=_own_sensors(drone),
        )
        for seed in range(DRAWN)
    ]
    flight = flight_of(circles, settings.horizon.update_period_s)
    trace = fly(flight, CompiledController(settings, DRAWN))
    return bool((np.abs(height_error_m(trace)) < LOST_HEIGHT_M).all())


def _own_sensors(drone: VehicleFile) -> SensorsName:
    return DEFAULT_SENSORS[drone.sensors.kind]


def _flown(
    settings: Settings,
    drone: VehicleFile,
    trajectory: Trajectory,
    offset: Offset,
    disturbances: Disturbances = CALM,
    *,
    duration_s: float = DURATION_S,
    vehicle: Vehicle | None = None,
) -> Trace:
    """Return flights at headings around the whole turn, through the drone's own sensors."""
    flight = Flight(
        trajectory,
        duration_s=duration_s,
        flights=HEADINGS,
        yaw_rad=2.0 * math.pi * np.arange(HEADINGS) / HEADINGS,
        vehicle=vehicle or Vehicle.of(drone),
        update_period_s=settings.horizon.update_period_s,
        seeds=tuple(range(HEADINGS)),
        offset=offset,
        disturbances=disturbances,
        sensors=choose_sensors(_own_sensors(drone), drone),
    )
    return fly(flight, CompiledController(settings, HEADINGS))


def _swing_rad(trace: Trace) -> float:
    """Return the largest rms of a tilt at the end of flights, about its mean."""
    judged = trace.time_s >= trace.time_s[-1] - JUDGED_S
    return float(trace.euler_rad[judged][..., :2].std(axis=0).max())


def _fault(trace: Trace, drone: VehicleFile, axes: int) -> str | None:
    """Return what is wrong with flights that end at rest, along the first `axes` of x, y and z."""
    crashes = [first_crash(trace, number, drone) for number in range(HEADINGS)]
    crashed = [crash for crash in crashes if crash is not None]
    if crashed:
        crash = min(crashed, key=lambda one: one.time_s)
        return f"CRASHES after {crash.time_s:.3g} s, {crash.how}"
    judged = trace.time_s >= trace.time_s[-1] - JUDGED_S
    # The estimates of sensors drift; the settings hold the place that is seen.
    seen_m = trace.seen_position_m if isinstance(trace, SensedTrace) else trace.position_m
    off_m = (seen_m[judged] - _target_m(trace)[judged]).mean(axis=0)[:, :axes]
    tilt_rad = float(trace.euler_rad[judged][..., :2].std(axis=0).max())
    speed_m_s = float(trace.velocity_m_s[judged][..., :axes].std(axis=0).max())
    # A flight that was lost is NaN.
    if not (tilt_rad < SWINGING_RAD and speed_m_s < SWINGING_M_S):
        return f"OSCILLATES, by {tilt_rad:.2g} rad and {speed_m_s:.2g} m/s (rms)"
    farthest = np.unravel_index(np.abs(off_m).argmax(), off_m.shape)
    if abs(off_m[farthest]) > FAR_M:
        return f"FAR OFF, {1e3 * abs(off_m[farthest]):.0f} mm along {'xyz'[farthest[1]]} in the mean"
    return None


def _target_m(trace: Trace) -> FloatArray:
    """Return the targets (k, n, 3) in the world frame."""
    return np.concatenate([trace.target[..., :2], -trace.target_height_m[..., np.newaxis]], axis=-1)


def choose_settings(
    drone: VehicleFile, source: str, vehicle: str | None = None, *, firm: bool = False
) -> ChosenSettings:
    """Return the controller.toml that `design` writes: see `controller_text`.

    With the exact thrust vector if it is of use, and the largest tilt limit with which drones survive a
    circle that is too quick for it. Small angles stay without a compiler.
    """
    small_angles = controller_text(drone, source, vehicle, firm=firm)
    if not wants_exact(drone):
        return ChosenSettings(small_angles, None)
    for share in EXACT_TILT_SHARES:
        exact = controller_text(drone, source, vehicle, exact_share=share, firm=firm)
        settings = controller_toml.parse(exact, source)
        try:
            if flies_quick_circle(settings, drone):
                return ChosenSettings(exact, None)
        except BuildError:
            return ChosenSettings(small_angles, "no compiler: not flown with the exact tilt")
    rate_rad_s = quick_rate_rad_s(settings.limits.tilt_rad)
    why = (
        f"with the exact tilt, up to {settings.limits.tilt_rad:g} rad, it is lost on a circle of 1 m at "
        f"{rate_rad_s:.2g} rad/s with rotors {SLOWER_ROTORS:g} times slower"
    )
    return ChosenSettings(small_angles, why)


def chosen_text(drone: VehicleFile, source: str, vehicle: str | None = None) -> str:
    """Return the text alone that `choose_settings` returns."""
    return choose_settings(drone, source, vehicle).text
