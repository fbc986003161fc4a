"""The variables of a controller as a functional mock-up unit: names, units, ranges and start values."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Literal

from mambo_codegen.methods import method_of
from mambo_codegen.numbers.gravity import hover_thrust
from mambo_codegen.numbers.representation import ATTITUDE_LIMIT_RAD, YAW_LIMIT_RAD
from mambo_codegen.port.row import COUNT, WHOLE, Number
from mambo_codegen.port.taken import MOST_KNOWN
from mambo_codegen.settings.fields import SMALLEST_LIMIT
from mambo_codegen.settings.model import Settings

_UNITS: Final = {
    "position": "m",
    "velocity": "m/s",
    "angle": "rad",
    "yaw": "rad",
    "thrust": "m/s2",
    "braking": "m/s2",
}
HEADING_RATE_RAD_S: Final = 4.0
"""Start value of the rate at which the set-point of the heading turns."""


@dataclass(frozen=True)
class FmuVariable:
    """A real variable; its value reference is its place in the list."""

    name: str
    causality: Literal["input", "output", "parameter"]
    unit: str
    least: float
    most: float
    start: float
    description: str

    @property
    def variability(self) -> str:
        """Values are held between updates; weights may be changed in a simulation."""
        return "tunable" if self.causality == "parameter" else "discrete"


def fmu_variables(settings: Settings) -> tuple[FmuVariable, ...]:
    """Return the variables in the order of the C: 12 inputs, 2 outputs, of some settings, of the heading.

    An observed target has 5 inputs, a 1-norm 2 weights; limits of speed, braking and place are 6 parameters.
    A height has 5 inputs and an output in place of the thrust, 2 inputs of an observed target, and 4 limits.
    The heading has an input, a parameter and an output. The last one of a height is the delivered thrust.
    """
    port = method_of(settings).port
    later = [one for one in port.numbers("target") if set(one.row.when) - {"height"}]
    return (
        *_taken(settings, port.numbers("state")),
        *_taken(settings, (one for one in port.numbers("target") if one not in later)),
        *_thrust(settings),
        *_command(settings),
        *_taken(settings, later),
        *_weights(settings),
        *_limits(settings),
        *_heading(),
        *_delivered_thrust(settings),
    )


def _input(name: str, unit: str, most: float, description: str) -> FmuVariable:
    """Return an input of either sign."""
    return FmuVariable(name, "input", unit, -most, most, 0.0, description)


def _parameter(name: str, unit: str, values: tuple[float, float, float], description: str) -> FmuVariable:
    """Return a parameter; `values` are the least, the most and that at the start."""
    return FmuVariable(name, "parameter", unit, *values, description)


def _output(name: str, unit: str, values: tuple[float, float, float], description: str) -> FmuVariable:
    return FmuVariable(name, "output", unit, *values, description)


def _taken(settings: Settings, numbers: Iterable[Number]) -> list[FmuVariable]:
    """Return the inputs of numbers of a state or target."""
    ranges, found = settings.ranges, list[FmuVariable]()
    largest = {
        "position": ranges.position_m,
        "velocity": ranges.velocity_m_s,
        "angle": ATTITUDE_LIMIT_RAD,
        "yaw": YAW_LIMIT_RAD,
        "thrust": ranges.thrust_acceleration_max_m_s2,
    }
    for number in numbers:
        name, words = number.told
        if number.row.kind == WHOLE:
            most = float(MOST_KNOWN) if number.row.draw is COUNT else 1.0
            found.append(FmuVariable(name, "input", "1", 0.0, most, 0.0, words))
        else:
            most = largest.get(number.quantity, math.inf)
            found.append(_input(name, _UNITS.get(number.quantity, "1"), most, words))
    return found


def _thrust(settings: Settings) -> list[FmuVariable]:
    """Return the input of the thrust; none with a height."""
    if settings.height is not None:
        return []
    ranges = settings.ranges
    bounds = ranges.thrust_acceleration_min_m_s2, ranges.thrust_acceleration_max_m_s2, hover_thrust(settings)
    return [FmuVariable("thrust_acceleration", "input", "m/s2", *bounds, "thrust over mass")]


def _command(settings: Settings) -> list[FmuVariable]:
    """Return the outputs of a command."""
    tilt_rad, height = settings.limits.tilt_rad, settings.height
    values = {"angle": (-tilt_rad, tilt_rad, 0.0)}
    if height is not None:
        values["thrust"] = (*height.command_m_s2, hover_thrust(settings))
    return [
        _output(one.told[0], _UNITS[one.quantity], values[one.quantity], one.told[1])
        for one in method_of(settings).port.numbers("command")
    ]


def _weights(settings: Settings) -> list[FmuVariable]:
    """Return the weights of the cost; none if the C takes none."""
    method, cost = method_of(settings), settings.cost
    starts = cost.tracking_weight, cost.effort_weight
    return [
        _parameter(one.told[0], one.row.unit, (0.0, most, start), one.told[1])
        for one, most, start in zip(
            method.port.numbers("weights"), method.weight_limits, starts, strict=False
        )
    ]


def _limits(settings: Settings) -> list[FmuVariable]:
    """Return the limits of speed, braking and place, with a height of the height; none without limits.

    The tilt limit is none of them.
    """
    method, ranges = method_of(settings), settings.ranges
    if method.limiting is None:
        return []
    most_m_s2 = method.limiting.tilted.at(settings.limits.tilt_rad)
    ends = {
        "velocity": (SMALLEST_LIMIT, ranges.velocity_m_s),
        "braking": (SMALLEST_LIMIT, max(most_m_s2, method.limiting.named["braking_m_s2"])),
        "position": (-ranges.position_m, ranges.position_m),
    }
    return [
        _parameter(one.told[0], _UNITS[one.quantity], (*ends[one.quantity], start), one.told[1])
        for one, start in zip(method.port.numbers("limits"), method.limiting.limits.tolist(), strict=True)
        if one.quantity in ends
    ]


def _heading() -> list[FmuVariable]:
    """Return what slews the set-point of the heading."""
    rate_rad_s = (0.0, 100.0, HEADING_RATE_RAD_S)
    way = (-YAW_LIMIT_RAD, YAW_LIMIT_RAD, 0.0)
    words = "set-point of the heading, on the shortest way from the measured one"
    return [
        _input("target_yaw", "rad", YAW_LIMIT_RAD, "heading of the target"),
        _parameter("heading_rate", "rad/s", rate_rad_s, "largest rate of the heading's set-point"),
        _output("yaw_command", "rad", way, words),
    ]


def _delivered_thrust(settings: Settings) -> list[FmuVariable]:
    """Return the input that tells what a mixer made of the last thrust; none without a height."""
    if settings.height is None:
        return []
    most_m_s2 = settings.ranges.thrust_acceleration_max_m_s2
    words = "thrust over mass that the motors were given since the last step; 0: as commanded"
    return [FmuVariable("thrust_delivered", "input", "m/s2", 0.0, most_m_s2, 0.0, words)]
