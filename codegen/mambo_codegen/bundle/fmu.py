"""The variables of a controller as a functional mock-up unit: names, units, ranges and start values."""

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
    return (
        *_state(settings),
        *_target(settings),
        *_command(settings),
        *_given_acceleration(settings),
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


def _state(settings: Settings) -> list[FmuVariable]:
    """Return the inputs of a state."""
    position_m, velocity_m_s = settings.ranges.position_m, settings.ranges.velocity_m_s
    level = [
        _input("x", "m", position_m, "measured position north"),
        _input("y", "m", position_m, "measured position east"),
        _input("vx", "m/s", velocity_m_s, "measured velocity north"),
        _input("vy", "m/s", velocity_m_s, "measured velocity east"),
        _input("roll", "rad", ATTITUDE_LIMIT_RAD, "measured roll, right side down"),
        _input("pitch", "rad", ATTITUDE_LIMIT_RAD, "measured pitch, nose up"),
        _input("yaw", "rad", YAW_LIMIT_RAD, "measured yaw, clockwise from above"),
    ]
    contact = (0.0, 1.0, 0.0, "1 while the drone touches the floor, else 0")
    upward = [
        _input("height", "m", position_m, "measured height, upwards"),
        _input("climb", "m/s", velocity_m_s, "measured velocity upwards"),
        FmuVariable("grounded", "input", "1", *contact),
    ]
    return level + upward if settings.height else level


def _target(settings: Settings) -> list[FmuVariable]:
    """Return the inputs of a target; without a height also the thrust."""
    ranges = settings.ranges
    level = [
        _input("target_x", "m", ranges.position_m, "position of the target north"),
        _input("target_y", "m", ranges.position_m, "position of the target east"),
        _input("target_vx", "m/s", ranges.velocity_m_s, "velocity of the target north"),
        _input("target_vy", "m/s", ranges.velocity_m_s, "velocity of the target east"),
    ]
    upward = [
        _input("target_height", "m", ranges.position_m, "height of the target"),
        _input("target_climb", "m/s", ranges.velocity_m_s, "velocity of the target upwards"),
    ]
    bounds = ranges.thrust_acceleration_min_m_s2, ranges.thrust_acceleration_max_m_s2, hover_thrust(settings)
    thrust = FmuVariable("thrust_acceleration", "input", "m/s2", *bounds, "thrust over mass")
    return level + (upward if settings.height else [thrust])


def _command(settings: Settings) -> list[FmuVariable]:
    """Return the outputs of a command."""
    tilt_rad, height = settings.limits.tilt_rad, settings.height
    angles = [
        _output(f"{angle}_command", "rad", (-tilt_rad, tilt_rad, 0.0), f"{angle} command")
        for angle in ("roll", "pitch")
    ]
    if height is None:
        return angles
    values = (*height.command_m_s2, hover_thrust(settings))
    return [*angles, _output("thrust_command", "m/s2", values, "thrust over mass")]


def _given_acceleration(settings: Settings) -> list[FmuVariable]:
    """Return the inputs of the target's acceleration; none unless it is given."""
    if settings.target.acceleration != "given":
        return []
    most_m_s2 = settings.ranges.thrust_acceleration_max_m_s2
    ways = ("north", "east", "upwards") if settings.height else ("north", "east")
    return [
        _input(f"target_a{axis}", "m/s2", most_m_s2, f"acceleration of the target {way}")
        for axis, way in zip("xyz", ways, strict=False)
    ]


def _weights(settings: Settings) -> list[FmuVariable]:
    """Return the weights of the cost; none if the C takes none."""
    limits, cost = method_of(settings).weight_limits, settings.cost
    names = (
        ("tracking_weight", "1/m", cost.tracking_weight, "lambda1, eq 12"),
        ("effort_weight", "1/rad", cost.effort_weight, "lambda2, eq 12"),
    )
    return [
        _parameter(name, unit, (0.0, most, start), words)
        for (name, unit, start, words), most in zip(names, limits, strict=False)
    ]


def _limits(settings: Settings) -> list[FmuVariable]:
    """Return the limits of speed, braking and place, with a height of the height; none without limits."""
    limiting, ranges = method_of(settings).limiting, settings.ranges
    if limiting is None:
        return []
    reach_m, most_m_s, least = ranges.position_m, ranges.velocity_m_s, SMALLEST_LIMIT
    speed_m_s, braking_m_s2, *walls, _ = limiting.limits[: len(LIMITS)].tolist()
    most_m_s2 = max(limiting.tilted.at(settings.limits.tilt_rad), braking_m_s2)
    ends = (("x_min", "least x"), ("y_min", "least y"), ("x_max", "largest x"), ("y_max", "largest y"))
    level = [
        _parameter("speed_limit", "m/s", (least, most_m_s, speed_m_s), "speed limit"),
        _parameter("braking_limit", "m/s2", (least, most_m_s2, braking_m_s2), "braking limit"),
        *(
            _parameter(f"fence_{name}", "m", (-reach_m, reach_m, wall_m), f"{words} in the fence")
            for (name, words), wall_m in zip(ends, walls, strict=True)
        ),
    ]
    if settings.height is None:
        return level
    floor_m, ceiling_m, climb_m_s, descent_m_s = limiting.limits[len(LIMITS) :].tolist()
    refused = "refused where the thrust cannot brake it in time"
    return [
        *level,
        _parameter("floor", "m", (-reach_m, reach_m, floor_m), "least height in the fence"),
        _parameter("ceiling", "m", (-reach_m, reach_m, ceiling_m), "largest height in the fence"),
        _parameter("climb_limit", "m/s", (least, most_m_s, climb_m_s), f"speed limit upwards, {refused}"),
        _parameter(
            "descent_limit", "m/s", (least, most_m_s, descent_m_s), f"speed limit downwards, {refused}"
        ),
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
