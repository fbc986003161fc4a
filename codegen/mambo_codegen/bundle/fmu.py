"""The variables of a controller as a functional mock-up unit: names, units, ranges and start values."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.limits_constants import LIMITS
from mambo_codegen.numbers.gravity import hover_thrust
from mambo_codegen.numbers.representation import ATTITUDE_LIMIT_RAD, YAW_LIMIT_RAD
from mambo_codegen.settings.fields import SMALLEST_LIMIT
from mambo_codegen.settings.model import Settings

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

    A given acceleration of the target has 2 inputs, a 1-norm 2 weights; limits of speed, braking and place
    are 6 parameters. A height has 5 inputs and an output in place of the thrust, an input for a given
    acceleration, and 4 limits. The heading has an input, a parameter and an output. The last one of a height
    is the delivered thrust.
    """
    ranges, tilt_rad = settings.ranges, settings.limits.tilt_rad

    def symmetric(name: str, unit: str, most: float, description: str) -> FmuVariable:
        return FmuVariable(name, "input", unit, -most, most, 0.0, description)

    has_height = settings.height is not None
    variables = [
        symmetric("x", "m", ranges.position_m, "measured position north"),
        symmetric("y", "m", ranges.position_m, "measured position east"),
        symmetric("vx", "m/s", ranges.velocity_m_s, "measured velocity north"),
        symmetric("vy", "m/s", ranges.velocity_m_s, "measured velocity east"),
        symmetric("roll", "rad", ATTITUDE_LIMIT_RAD, "measured roll, right side down"),
        symmetric("pitch", "rad", ATTITUDE_LIMIT_RAD, "measured pitch, nose up"),
        symmetric("yaw", "rad", YAW_LIMIT_RAD, "measured yaw, clockwise from above"),
        *(_measured_height(symmetric, settings) if has_height else ()),
        symmetric("target_x", "m", ranges.position_m, "position of the target north"),
        symmetric("target_y", "m", ranges.position_m, "position of the target east"),
        symmetric("target_vx", "m/s", ranges.velocity_m_s, "velocity of the target north"),
        symmetric("target_vy", "m/s", ranges.velocity_m_s, "velocity of the target east"),
        *(_height_of_target(symmetric, settings) if has_height else (_thrust(settings),)),
        FmuVariable("roll_command", "output", "rad", -tilt_rad, tilt_rad, 0.0, "roll command"),
        FmuVariable("pitch_command", "output", "rad", -tilt_rad, tilt_rad, 0.0, "pitch command"),
        *_thrust_command(settings),
    ]
    if settings.target.acceleration == "given":
        most_m_s2 = ranges.thrust_acceleration_max_m_s2
        variables += [
            symmetric("target_ax", "m/s2", most_m_s2, "acceleration of the target north"),
            symmetric("target_ay", "m/s2", most_m_s2, "acceleration of the target east"),
        ]
        if has_height:
            variables.append(symmetric("target_az", "m/s2", most_m_s2, "acceleration of the target upwards"))
    if limits := method_of(settings).weight_limits:
        tracking, effort = settings.cost.tracking_weight, settings.cost.effort_weight
        most_tracking, most_effort = limits
        variables += [
            FmuVariable(
                "tracking_weight", "parameter", "1/m", 0.0, most_tracking, tracking, "lambda1, eq 12"
            ),
            FmuVariable("effort_weight", "parameter", "1/rad", 0.0, most_effort, effort, "lambda2, eq 12"),
        ]
    if (limiting := method_of(settings).limiting) is not None:
        reach_m = ranges.position_m
        speed_m_s, braking_m_s2, *walls, _ = limiting.limits[: len(LIMITS)].tolist()
        most_m_s2 = limiting.tilted.at(tilt_rad)
        variables += [
            FmuVariable(
                *("speed_limit", "parameter", "m/s", SMALLEST_LIMIT),
                *(ranges.velocity_m_s, speed_m_s, "speed limit"),
            ),
            FmuVariable(
                *("braking_limit", "parameter", "m/s2", SMALLEST_LIMIT),
                *(max(most_m_s2, braking_m_s2), braking_m_s2, "braking limit"),
            ),
        ]
        ends = (("x_min", "least x"), ("y_min", "least y"), ("x_max", "largest x"), ("y_max", "largest y"))
        variables += [
            FmuVariable(f"fence_{name}", "parameter", "m", -reach_m, reach_m, wall_m, f"{words} in the fence")
            for (name, words), wall_m in zip(ends, walls, strict=True)
        ]
        variables += _height_limits(settings, limiting.limits[len(LIMITS) :].tolist())
    rate = (0.0, 100.0, HEADING_RATE_RAD_S, "largest rate of the heading's set-point")
    variables += [
        symmetric("target_yaw", "rad", YAW_LIMIT_RAD, "heading of the target"),
        FmuVariable("heading_rate", "parameter", "rad/s", *rate),
        FmuVariable(
            *("yaw_command", "output", "rad", -YAW_LIMIT_RAD, YAW_LIMIT_RAD, 0.0),
            "set-point of the heading, on the shortest way from the measured one",
        ),
        *_thrust_delivered(settings),
    ]
    return tuple(variables)


_Symmetric = Callable[[str, str, float, str], FmuVariable]


def _thrust(settings: Settings) -> FmuVariable:
    """Return the input of a controller without a height."""
    ranges = settings.ranges
    return FmuVariable(
        "thrust_acceleration",
        "input",
        "m/s2",
        ranges.thrust_acceleration_min_m_s2,
        ranges.thrust_acceleration_max_m_s2,
        hover_thrust(settings),
        "thrust over mass",
    )


def _measured_height(symmetric: _Symmetric, settings: Settings) -> list[FmuVariable]:
    """Return the inputs of a state with a height."""
    ranges = settings.ranges
    contact = (0.0, 1.0, 0.0, "1 while the drone touches the floor, else 0")
    return [
        symmetric("height", "m", ranges.position_m, "measured height, upwards"),
        symmetric("climb", "m/s", ranges.velocity_m_s, "measured velocity upwards"),
        FmuVariable("grounded", "input", "1", *contact),
    ]


def _height_of_target(symmetric: _Symmetric, settings: Settings) -> list[FmuVariable]:
    """Return the inputs of a target with a height."""
    ranges = settings.ranges
    return [
        symmetric("target_height", "m", ranges.position_m, "height of the target"),
        symmetric("target_climb", "m/s", ranges.velocity_m_s, "velocity of the target upwards"),
    ]


def _thrust_command(settings: Settings) -> list[FmuVariable]:
    """Return the output of a controller with a height; none without."""
    height = settings.height
    if height is None:
        return []
    values = (*height.command_m_s2, hover_thrust(settings))
    return [FmuVariable("thrust_command", "output", "m/s2", *values, "thrust over mass")]


def _thrust_delivered(settings: Settings) -> list[FmuVariable]:
    """Return the input that tells what a mixer made of the last thrust; none without a height."""
    if settings.height is None:
        return []
    most_m_s2 = settings.ranges.thrust_acceleration_max_m_s2
    words = "thrust over mass that the motors were given since the last step; 0: as commanded"
    return [FmuVariable("thrust_delivered", "input", "m/s2", 0.0, most_m_s2, 0.0, words)]


def _height_limits(settings: Settings, values: list[float]) -> list[FmuVariable]:
    """Return the limits of floor, ceiling, climb and descent; none without a height."""
    if not values:
        return []
    reach_m, most_m_s = settings.ranges.position_m, settings.ranges.velocity_m_s
    floor_m, ceiling_m, climb_m_s, descent_m_s = values
    return [
        FmuVariable("floor", "parameter", "m", -reach_m, reach_m, floor_m, "least height in the fence"),
        FmuVariable("ceiling", "parameter", "m", -reach_m, reach_m, ceiling_m, "largest height in the fence"),
        FmuVariable(
            *("climb_limit", "parameter", "m/s", SMALLEST_LIMIT, most_m_s, climb_m_s),
            "speed limit upwards, refused where the thrust cannot brake it in time",
        ),
        FmuVariable(
            *("descent_limit", "parameter", "m/s", SMALLEST_LIMIT, most_m_s, descent_m_s),
            "speed limit downwards, refused where the thrust cannot brake it in time",
        ),
    ]
