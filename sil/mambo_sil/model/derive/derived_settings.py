"""Derive the settings of a controller with a quadratic cost from a drone, with a reason for each.

Thresholds and factors are measured: docs/explanation/design.md.
"""

import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from mambo_codegen import __version__
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.numbers.reach import tilted_m_s2
from mambo_codegen.settings.controller_toml import VEHICLE, comment
from mambo_codegen.settings.key import spell
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import (
    AutopilotSensors,
    FirstOrderAttitude,
    FlowDeckSensors,
    MamboSensors,
    MocapSensors,
    TrueState,
)
from mambo_sil.model.derive.step_response import fit_steps

UPDATE_PERIOD_S: Final = 0.01
RAMP_S: Final = 0.4

SPEED_LIMIT_M_S: Final = 5.0
BRAKING_SHARE: Final = 0.65
"""Braking limit over what the tilt limit gives: the rest is left for wind and lag."""
LEAST_BRAKING_M_S2: Final = 0.1
MOST_DISTURBANCE_M_S2: Final = 20.0
"""Largest observer.disturbance_limit_m_s2."""

QUICKEST_RESPONSE_S, SLOWEST_RESPONSE_S = 0.1, 2.0
MOST_TILT_RAD, MOST_TILT_BY_FLOW_RAD = 0.5, 0.35
LEAST_TILT_RAD = 0.02
"""With less a controller can hardly brake: settings want 0.125 m/s^2."""
TILT_SHARE: Final = 0.5
"""With small angles, tilt limit over the tilt at which the largest thrust still carries the weight."""
EXACT_TILT_SHARES: Final = (0.7, 0.6, 0.5)
"""The same with the exact tilt, the best first: a flight chooses."""

DEFAULT_DISTURBANCE_M_S3: Final = 0.3
QUICK_DISTURBANCE_M_S3: Final = 3.0
CALM_DISTURBANCE_M_S3: Final = 1.0
LATE_VELOCITY_M_S: Final = 0.15
TRUE_VELOCITY_M_S: Final = 0.02
FIRM_RESPONSE, FIRM_DISTURBANCE = 0.76, 10.0 / 3.0
"""Response time and learning of firm settings over those of calm ones, which a push moves twice as far."""
LEAST_POSITION_M: Final = 0.001
FLOW_POSITION_M: Final = 0.04
ESTIMATED_POSITION_M, ESTIMATED_VELOCITY_M_S, SLOW_DISTURBANCE_M_S3 = 0.03, 1.0, 0.5
"""Noise densities of the observer."""
ESTIMATED_ERROR_M_S, LEAST_ERROR_SHARE = 0.12, 0.25
"""Error of the estimated velocity that these are for, as EKF2's; the least share of it that they follow."""
LONGEST_AGE_S: Final = 0.2
LONGEST_GYROSCOPE_AGE_S: Final = 0.02
"""With a firmware's filter, whose velocity and attitude are those of now: an older state shakes the drone."""

QUICKEST_HEIGHT_S, SLOWNESS, CLIMB_WEIGHT = 0.1, 1.3, 2.0
HEIGHT_DISTURBANCE_M_S3: Final = 1.5
"""A quicker learning takes gain and phase from the loop, most where rotors are quicker than the file says."""
LEAST_LAG_S, LONGEST_LAG_S = 0.03, 0.5
"""A shorter lag in the model of the thrust rings on a drone whose rotors are slower."""
THRUST_MIN_M_S2, THRUST_SHARE = 2.9, 0.95
LEAST_THRUST_MAX_M_S2, MOST_THRUST_MAX_M_S2 = 10.8, 100.0
"""Bounds of height.thrust_max_m_s2."""
TILT_SWINGS, TILT_SWINGS_1_S, THRUST_SWINGS_1_S = 3.0, 12.0, 8.0
"""What a guard lets vary at once and in a second, over the tilt limit and over the range of the thrust."""
DESCENT_M_S, DESCENT_S = 1.5, 0.265
"""Default of height.descent_m_s; and speed that is surely braked, over the acceleration upwards."""

MOST_THRUST_M_S2: Final = 50.0
"""Default of ranges.thrust_acceleration_max_m_s2."""


@dataclass(frozen=True)
class Derived:
    """One key of a controller.toml, its value, and the reason, which becomes its comment."""

    section: str
    key: str
    value: float | str
    reason: str


def wants_exact(drone: VehicleFile) -> bool:
    """Return whether more tilt than small angles allow is of use.

    Not without a height, which a larger tilt takes, nor behind the optical flow of a Mambo, which drifts.
    """
    return any(_height(drone)) and not isinstance(drone.sensors, MamboSensors)


def derive(drone: VehicleFile, *, exact_share: float | None = None, firm: bool = False) -> list[Derived]:
    """Return the settings for a drone that differ from the defaults, section by section.

    exact_share: tilt limit over the possible tilt, with the exact thrust vector; None: with small angles.
    firm:        with quicker answers to errors and pushes, and commands that change more.
    """
    attitude = list(_attitude(drone))
    times_s = [float(each.value) for each in attitude if each.key.endswith(("_lag_s", "_delay_s"))]
    tilt = _tilt_limit(drone, exact_share)
    return [
        Derived("controller", "method", "quadratic", "The exact minimum of the cost, without a search"),
        *_horizon(drone),
        *attitude,
        Derived("model", "drag_1_s", drone.body.drag_1_s, "As body.drag_1_s"),
        Derived("model", "start_attitude", "predicted", "No quick loop through the measured attitude"),
        *([] if exact_share is None else [_exact_tilt(drone)]),
        _response(sum(times_s) / 2.0, firm=firm),
        *(_firmly(_observer(drone)) if firm else _observer(drone)),
        _disturbance_limit(drone, float(tilt.value)),
        *_limits(drone, tilt),
        *_thrust_range(drone),
        *(height := list(_height(drone))),
        *_guard(float(tilt.value), height),
    ]


def controller_text(
    drone: VehicleFile,
    source: str,
    vehicle: str | None = None,
    *,
    exact_share: float | None = None,
    firm: bool = False,
) -> str:
    """Return a controller.toml for the drone of `source`, with the reason of each value as a comment.

    vehicle: what the key `vehicle` names, for commands that fly the settings; None leaves it out.
    exact_share, firm: as for `derive`.
    """
    lines = [
        comment(f"For vehicle {source}, derived from its file by mambo-nmpc {__version__}."),
        comment("A missing key takes the value of preset table1."),
    ]
    if vehicle is not None:
        lines += [
            "",
            comment("The drone that commands fly; the C does not depend on it."),
        ]
        lines += [f"{VEHICLE} = {json.dumps(vehicle, ensure_ascii=False)}"]
    section = ""
    for each in derive(drone, exact_share=exact_share, firm=firm):
        if each.section != section:
            section = each.section
            lines += ["", f"[{section}]"]
        lines += [comment(f"{each.reason}."), f"{each.key} = {spell(each.value)}"]
    return "\n".join(lines) + "\n"


def _horizon(drone: VehicleFile) -> Iterator[Derived]:
    """Yield the update period, the whole number of ticks nearest to 10 ms, and the ramp."""
    rate_hz, period_s = drone.attitude.rate_hz, _update_period_s(drone)
    if period_s != UPDATE_PERIOD_S:
        ticks = round(period_s * rate_hz)
        words = f"{ticks} of the inner loops' ticks, attitude.rate_hz = {rate_hz}"
        yield Derived("horizon", "update_period_s", period_s, words)
    yield Derived("horizon", "ramp_s", RAMP_S, "So that the controller sees its tilt limit coming")


def _update_period_s(drone: VehicleFile) -> float:
    """Return the whole number of ticks nearest to 10 ms."""
    rate_hz = drone.attitude.rate_hz
    return max(1, round(UPDATE_PERIOD_S * rate_hz)) / rate_hz


def _attitude(drone: VehicleFile) -> Iterator[Derived]:
    """Yield the attitude model: as the file has it, or fitted to the answer of its loops."""
    if isinstance(drone.attitude, FirstOrderAttitude):
        for name, axis in (("roll", drone.attitude.roll), ("pitch", drone.attitude.pitch)):
            yield Derived("model", f"{name}_gain", axis.gain, f"As attitude.{name}.gain")
            yield Derived("model", f"{name}_lag_s", axis.lag_s, f"As attitude.{name}.lag_s")
            yield Derived("model", f"{name}_delay_s", axis.dead_time_s, f"As attitude.{name}.dead_time_s")
        share = drone.attitude.acceleration_per_tilt_g
        yield Derived("model", "acceleration_per_tilt", share, "As attitude.acceleration_per_tilt_g")
        for name in ("roll_trim_rad", "pitch_trim_rad"):
            if trim_rad := getattr(drone.attitude, name):
                yield Derived("model", name, trim_rad, f"As attitude.{name}")
        return
    for name, fit in zip(("roll", "pitch"), fit_steps(drone), strict=True):
        words = f"Fitted to the answer of the attitude loop to a step; leaves {100.0 * fit.error:.1f} % (rms)"
        yield Derived("model", f"{name}_lag_s", _round(fit.lag_s), words)
        yield Derived("model", f"{name}_delay_s", _round(fit.delay_s), "Likewise")
        if fit.integral_1_s:
            yield Derived("model", f"{name}_integral_1_s", _round(fit.integral_1_s), "Likewise")


def _exact_tilt(drone: VehicleFile) -> Derived:
    ratio = drone.largest_thrust_n / drone.weight_n
    words = f"The thrust, {ratio:.3g} times the weight, carries more tilt than small angles are good for"
    return Derived("model", "tilt", "exact", words)


def _response(slowness_s: float, *, firm: bool) -> Derived:
    """Return the response time for a mean lag plus delay."""
    wanted_s = (FIRM_RESPONSE if firm else 1.0) * slowness_s
    value = _round(min(max(wanted_s, QUICKEST_RESPONSE_S), SLOWEST_RESPONSE_S))
    words = f"{f'Firm: {FIRM_RESPONSE:g} of lag' if firm else 'Lag'} plus delay, the mean of roll and pitch"
    if wanted_s < QUICKEST_RESPONSE_S:
        words = "A shorter one passes more noise on to the commands, and is no closer"
    return Derived("cost", "response_time_s", value, words)


def _observer(drone: VehicleFile) -> Iterator[Derived]:
    """Yield noise densities and age; the Mambo's sensors have the defaults."""
    sensors = drone.sensors
    if isinstance(sensors, MocapSensors):
        density_m = min(max(sensors.position_noise_m, LEAST_POSITION_M), 10.0)
        words = f"As sensors.position_noise_m, at least {spell(LEAST_POSITION_M)}"
        yield Derived("observer", "position_noise", density_m, words)
        words = "Learns wind within tenths of a second"
        yield Derived("observer", "disturbance_noise", QUICK_DISTURBANCE_M_S3, words)
        words = "Large, because the filter of the velocity makes it late"
        yield Derived("observer", "velocity_noise", LATE_VELOCITY_M_S, words)
        yield _age(sensors)
    elif isinstance(sensors, FlowDeckSensors):
        words = "A flow deck's position is an integral: with less, commands rattle and take the thrust"
        yield Derived("observer", "position_noise", FLOW_POSITION_M, words)
        words = "Learns wind within tenths of a second"
        yield Derived("observer", "disturbance_noise", QUICK_DISTURBANCE_M_S3, words)
        yield Derived("observer", "velocity_noise", LATE_VELOCITY_M_S, "As with motion capture")
        yield Derived("observer", "measurement_age_s", UPDATE_PERIOD_S, "A frame of the flow chip")
    elif isinstance(sensors, AutopilotSensors):
        yield from _estimated(sensors)
    elif drone.knows_sensors and isinstance(sensors, TrueState):
        yield Derived("observer", "position_noise", LEAST_POSITION_M, "The true state has no noise")
        words = "Learns wind within tenths of a second"
        yield Derived("observer", "disturbance_noise", QUICK_DISTURBANCE_M_S3, words)
        yield Derived("observer", "velocity_noise", TRUE_VELOCITY_M_S, "The true velocity is never late")
    elif isinstance(sensors, TrueState):
        words = (
            "No sensors in the file: calm with those of the Mambo and with motion capture, best with neither"
        )
        yield Derived("observer", "disturbance_noise", CALM_DISTURBANCE_M_S3, words)
        yield Derived("observer", "velocity_noise", LATE_VELOCITY_M_S, "Likewise")


def _estimated(sensors: AutopilotSensors) -> Iterator[Derived]:
    """Yield the noise densities behind an autopilot's estimator.

    Where its velocity errs less, it is believed more and learns wind sooner. The exponents lead from EKF2's
    densities to about those for motion capture at the least share: 3 mm, 0.16 m/s, 3.2 m/s^3.
    """
    share = min(max(sensors.velocity_error_m_s / ESTIMATED_ERROR_M_S, LEAST_ERROR_SHARE), 1.0)
    position_m = _round(ESTIMATED_POSITION_M * share ** (5.0 / 3.0))
    velocity_m_s = _round(ESTIMATED_VELOCITY_M_S * share ** (4.0 / 3.0))
    disturbance_m_s3 = _round(SLOW_DISTURBANCE_M_S3 / share ** (4.0 / 3.0))
    reasons = (
        "The estimate goes astray by centimetres, and back: not at once into a command",
        "Learns wind within a second: what is quicker is the error of the estimate",
        "Large, because the estimated velocity errs by decimetres a second",
    )
    if share < 1.0:
        by = "by sensors.velocity_error_m_s"
        reasons = (
            f"Less than behind EKF2, {spell(ESTIMATED_POSITION_M)}: {by}",
            f"Learns wind sooner than behind EKF2, {spell(SLOW_DISTURBANCE_M_S3)}: {by}",
            f"Less than behind EKF2, {spell(ESTIMATED_VELOCITY_M_S)}: {by}",
        )
    yield Derived("observer", "position_noise", position_m, reasons[0])
    yield Derived("observer", "disturbance_noise", disturbance_m_s3, reasons[1])
    yield Derived("observer", "velocity_noise", velocity_m_s, reasons[2])


def _firmly(observer: Iterable[Derived]) -> Iterator[Derived]:
    """Yield what is derived of the observer, but that it learns pushes more quickly."""
    found = {each.key: each for each in observer}
    calm_m_s3 = DEFAULT_DISTURBANCE_M_S3
    if "disturbance_noise" in found:
        calm_m_s3 = float(found["disturbance_noise"].value)
    words = f"Firm: learns pushes more quickly than with {spell(calm_m_s3)}"
    firm = Derived("observer", "disturbance_noise", _round(FIRM_DISTURBANCE * calm_m_s3), words)
    yield from (found | {firm.key: firm}).values()


def _age(sensors: MocapSensors) -> Derived:
    """Return the age of the state: all of the delay, unless a filter makes up for a part by its gyroscope."""
    held_s = max(1.0 / sensors.position_rate_hz - UPDATE_PERIOD_S, 0.0) / 2.0
    age_s, most_s = sensors.position_delay_s + held_s, LONGEST_AGE_S
    words = "As sensors.position_delay_s" + (", and half the time that a position is held" if held_s else "")
    if sensors.estimator is not None and age_s > LONGEST_GYROSCOPE_AGE_S:
        most_s = LONGEST_GYROSCOPE_AGE_S
        words += f"; at most {most_s:g}, since the estimator makes up for the rest by its gyroscope"
    return Derived("observer", "measurement_age_s", _round(min(age_s, most_s)), words)


def _disturbance_limit(drone: VehicleFile, tilt_rad: float) -> Derived:
    """Return the push that the tilt limit holds in level flight."""
    held_m_s2 = tilted_m_s2(tilt_rad, ((1.0, 0.0),))
    if isinstance(drone.attitude, FirstOrderAttitude):
        attitude = drone.attitude
        axes = (attitude.roll.gain, attitude.roll_trim_rad), (attitude.pitch.gain, attitude.pitch_trim_rad)
        held_m_s2 = tilted_m_s2(tilt_rad, axes, attitude.acceleration_per_tilt_g)
    words = "The push that limits.tilt_rad holds; a stronger one carries the drone away"
    limit_m_s2 = min(_round(held_m_s2), MOST_DISTURBANCE_M_S2)
    return Derived("observer", "disturbance_limit_m_s2", limit_m_s2, words)


def _limits(drone: VehicleFile, tilt: Derived) -> Iterator[Derived]:
    """Yield the limits of tilt and, if the tilt allows some braking, of speed and braking."""
    yield tilt
    gain, trim_m_s2 = GRAVITY_M_S2, 0.0
    if isinstance(drone.attitude, FirstOrderAttitude):
        attitude = drone.attitude
        slope = GRAVITY_M_S2 * attitude.acceleration_per_tilt_g
        gain = slope * min(attitude.roll.gain, attitude.pitch.gain)
        trim_m_s2 = slope * max(abs(attitude.roll_trim_rad), abs(attitude.pitch_trim_rad))
    # A large swing from braking to tilt and back takes the mixer's thrust.
    tilt_rad = min(float(tilt.value), MOST_TILT_RAD)
    most_m_s2 = gain * tilt_rad - trim_m_s2
    braking_m_s2 = _round(BRAKING_SHARE * most_m_s2)
    if braking_m_s2 >= LEAST_BRAKING_M_S2:
        words = "No file says how fast a drone may be; a target farther away is flown to at this speed"
        yield Derived("limits", "speed_m_s", SPEED_LIMIT_M_S, words)
        words = f"{BRAKING_SHARE:g} of {most_m_s2:.3g}, what a tilt of {tilt_rad:g} gives"
        words += "; the rest is for wind and lag"
        yield Derived("limits", "braking_m_s2", braking_m_s2, words)


def _tilt_limit(drone: VehicleFile, exact_share: float | None) -> Derived:
    """Return a share of the tilt at which the largest thrust carries the weight, as far as angles may be."""
    ratio = drone.largest_thrust_n / drone.weight_n
    share = TILT_SHARE if exact_share is None else exact_share
    tilt_rad = share * math.acos(1.0 / ratio)
    part = "Half" if share == 0.5 else f"{share:g} of"
    words = f"{part} the tilt at which the largest thrust, {ratio:.3g} times the weight, still carries it"
    most_rad, why = MOST_TILT_RAD, "the model takes a tilt for its tangent"
    if isinstance(drone.sensors, MamboSensors):
        most_rad, why = MOST_TILT_BY_FLOW_RAD, "the optical flow drifts in larger tilts"
    if tilt_rad > most_rad and exact_share is None:
        tilt_rad, words = most_rad, f"{words}; at most {most_rad:g}, since {why}"
    return Derived("limits", "tilt_rad", _round(max(tilt_rad, LEAST_TILT_RAD)), words)


def _thrust_range(drone: VehicleFile) -> Iterator[Derived]:
    """Yield the largest accepted thrust of a drone that has more than the default."""
    largest_m_s2 = drone.altitude.thrust_max_n / drone.body.mass_kg
    if largest_m_s2 > MOST_THRUST_M_S2:
        words = "The largest thrust over the mass, altitude.thrust_max_n and body.mass_kg"
        yield Derived("ranges", "thrust_acceleration_max_m_s2", float(math.ceil(largest_m_s2)), words)


def _height(drone: VehicleFile) -> Iterator[Derived]:
    """Yield the height of a drone whose thrust is known, as far as it can climb; nothing for another."""
    thrust_m_s2 = drone.largest_thrust_n / drone.body.mass_kg
    most_m_s2 = _round(min(THRUST_SHARE * thrust_m_s2, MOST_THRUST_MAX_M_S2))
    if (drone.rotors is None and drone.thrust is None) or most_m_s2 < LEAST_THRUST_MAX_M_S2:
        return
    source = "rotors.lag_s" if drone.thrust is None else "thrust.lag_s"
    lag_s = min(drone.motor_lag_s if drone.thrust is None else drone.thrust.lag_s, LONGEST_LAG_S)
    dead_time_s = 0.0 if drone.thrust is None else drone.thrust.dead_time_s
    words = f"As {source}"
    if lag_s < LEAST_LAG_S:
        words = f"Longer than {source}: a model as quick as that rings on slower rotors"
    yield Derived("height", "lag_s", _round(max(lag_s, LEAST_LAG_S)), words)
    delay_s = _round(min(dead_time_s + _update_period_s(drone) / 2.0, 0.1))
    words = "Half an update period" + (" and thrust.dead_time_s" if dead_time_s else "")
    yield Derived("height", "delay_s", delay_s, words)
    if drone.thrust_gain != 1.0:
        yield Derived("height", "thrust_gain", drone.thrust_gain, "As thrust.gain")
    slowness_s = SLOWNESS * (max(lag_s, LEAST_LAG_S) + delay_s)
    response_s = _round(min(max(QUICKEST_HEIGHT_S, slowness_s), SLOWEST_RESPONSE_S))
    words = f"{SLOWNESS:g} times lag and delay, at least {QUICKEST_HEIGHT_S:g}"
    yield Derived("height", "response_time_s", response_s, words)
    weight_s = float(f"{min(CLIMB_WEIGHT * response_s, SLOWEST_RESPONSE_S):.2g}")
    yield Derived("height", "velocity_weight_s", weight_s, f"{CLIMB_WEIGHT:g} times that")
    words = "Learns the weight within half a second; quicker takes margins from the loop"
    yield Derived("height", "disturbance_noise", HEIGHT_DISTURBANCE_M_S3, words)
    yield Derived("height", "thrust_min_m_s2", THRUST_MIN_M_S2, "0.3 g: roll and pitch need some thrust")
    gain = "" if drone.thrust_gain == 1.0 else "thrust.gain times "
    words = f"{THRUST_SHARE:g} of {thrust_m_s2:.3g}, {gain}altitude.thrust_max_n over body.mass_kg"
    yield Derived("height", "thrust_max_m_s2", most_m_s2, words)
    descent_m_s = _round(DESCENT_S * (most_m_s2 - GRAVITY_M_S2))
    words = "What the largest thrust brakes in time" + (
        "" if descent_m_s < DESCENT_M_S else f", at most {DESCENT_M_S:g}"
    )
    yield Derived("height", "descent_m_s", min(descent_m_s, DESCENT_M_S), words)


def _guard(tilt_rad: float, height: list[Derived]) -> Iterator[Derived]:
    """Yield the guard, by the tilt limit and, with settings of the height, the range of the thrust."""
    words = f"{TILT_SWINGS:g} times limits.tilt_rad: swings are free, and a mixer keeps its thrust"
    yield Derived("guard", "tilt_budget_rad", _round(TILT_SWINGS * tilt_rad), words)
    words = f"{TILT_SWINGS_1_S:g} times limits.tilt_rad in a second: commands that rattle by more are bounded"
    yield Derived("guard", "tilt_budget_rad_s", _round(TILT_SWINGS_1_S * tilt_rad), words)
    found = {each.key: float(each.value) for each in height}
    if not found:
        return
    swing_m_s2 = found["thrust_max_m_s2"] - found["thrust_min_m_s2"]
    yield Derived("guard", "thrust_budget_m_s2", _round(swing_m_s2), "From the least thrust to the largest")
    words = f"{THRUST_SWINGS_1_S:g} times that in a second"
    yield Derived("guard", "thrust_budget_m_s3", _round(THRUST_SWINGS_1_S * swing_m_s2), words)


def _round(value: float) -> float:
    """Return a value with three digits."""
    return float(f"{value:.3g}")
