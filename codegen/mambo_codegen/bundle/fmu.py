"""The variables of a controller as a functional mock-up unit: names, units, ranges and start values."""

from dataclasses import dataclass
from typing import Literal

from mambo_codegen.methods import method_of
from mambo_codegen.methods.limits_constants import LIMITS
from mambo_codegen.numbers.gravity import hover_thrust
from mambo_codegen.settings.fields import SMALLEST_LIMIT
from mambo_codegen.settings.limits import ATTITUDE_LIMIT_RAD, YAW_LIMIT_RAD
from mambo_codegen.settings.model import Settings


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
    """Return the variables in the order of the C: 12 inputs, 2 outputs, then those of some settings.

    A given acceleration of the target has 2 inputs, a 1-norm 2 weights; limits of speed, braking and place
    are 6 parameters.
    """
    ranges, tilt_rad = settings.ranges, settings.limits.tilt_rad

    def symmetric(name: str, unit: str, most: float, description: str) -> FmuVariable:
        return FmuVariable(name, "input", unit, -most, most, 0.0, description)

    variables = [
        symmetric("x", "m", ranges.position_m, "measured position north"),
        symmetric("y", "m", ranges.position_m, "measured position east"),
        symmetric("vx", "m/s", ranges.velocity_m_s, "measured velocity north"),
        symmetric("vy", "m/s", ranges.velocity_m_s, "measured velocity east"),
        symmetric("roll", "rad", ATTITUDE_LIMIT_RAD, "measured roll, right side down"),
        symmetric("pitch", "rad", ATTITUDE_LIMIT_RAD, "measured pitch, nose up"),
        symmetric("yaw", "rad", YAW_LIMIT_RAD, "measured yaw, clockwise from above"),
        symmetric("target_x", "m", ranges.position_m, "position of the target north"),
        symmetric("target_y", "m", ranges.position_m, "position of the target east"),
        symmetric("target_vx", "m/s", ranges.velocity_m_s, "velocity of the target north"),
        symmetric("target_vy", "m/s", ranges.velocity_m_s, "velocity of the target east"),
        FmuVariable(
            "thrust_acceleration",
            "input",
            "m/s2",
            ranges.thrust_acceleration_min_m_s2,
            ranges.thrust_acceleration_max_m_s2,
            hover_thrust(settings),
            "thrust over mass",
        ),
        FmuVariable("roll_command", "output", "rad", -tilt_rad, tilt_rad, 0.0, "roll command"),
        FmuVariable("pitch_command", "output", "rad", -tilt_rad, tilt_rad, 0.0, "pitch command"),
    ]
    if settings.target.acceleration == "given":
        most_m_s2 = ranges.thrust_acceleration_max_m_s2
        variables += [
            symmetric("target_ax", "m/s2", most_m_s2, "acceleration of the target north"),
            symmetric("target_ay", "m/s2", most_m_s2, "acceleration of the target east"),
        ]
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
    return tuple(variables)
