"""How templates write the products of a control step: `{{ gain_product("gain", "tilt") }}`.

In floating point that is `gain * tilt`, and as an operand, by the filter `term`, `(gain * tilt)`. In fixed
point it is `gain_product(gain, tilt)`: each product is a function, since it rounds and shifts to the
format of its result (`products_fixed.c.j2`).
"""

from collections.abc import Callable
from functools import partial
from typing import Final

_NAMES: Final = (
    *("aged_position", "aged_velocity", "angle_square", "approach_product", "approach_ratio", "attitude_sum"),
    *("braking_product", "command_product", "disturbance_correction", "drag_product", "effort_cost"),
    *("effort_gradient", "error_change", "factor_product", "feedback_product", "gain_correction"),
    *(
        "gain_product",
        "gravity_product",
        "half_change",
        "halved",
        "initial_error",
        "knee_product",
        "learning_product",
        "noise_product",
    ),
    *("move_acceleration", "per_step2_product", "per_step_product", "position_change"),
    *("position_correction", "rate_product", "ratio_product", "reach_product", "row_sum", "scaled_velocity"),
    *("share_product", "sine_difference", "sine_product", "sine_sum", "speed_product", "speed_ratio"),
    *("squared", "step2_product", "step_product", "target_product", "thrust_product", "tilt_product"),
    *("to_factor", "to_move", "tracker_product", "tracking_cost", "tracking_gradient", "velocity_change"),
    *("velocity_correction", "velocity_product", "wide_product"),
    *("angle_to_yaw", "factor_to_sine", "sine_to_angle", "slope_acceleration"),
)
"""The functions of fixed point."""

_FORMS: Final = {1: "{}", 2: "{} * {}", 4: "({} * {}) + ({} * {})"}
"""What they are in floating point, by the number of their arguments."""

_OTHER_FORMS: Final = {
    "half_change": "NMPC_HALF * {}",
    "halved": "NMPC_HALF * {}",
    "squared": "{0} * {0}",
    "angle_square": "{0} * {0}",
    "sine_difference": "({} * {}) - ({} * {})",
}
"""The same of those that are something else."""


class Infix(str):
    """A product written with operators."""

    __slots__ = ()


def products(*, fixed: bool, weighs: bool = False, learns: bool = False) -> dict[str, Callable[..., str]]:
    """Return the functions of the templates that write products, by name.

    weighed, over_weight: an acceleration of a tilt times its weight, and over it; as it is without `weighs`.
    gained: such an acceleration times the share of the learnt gain of its axis; as it is without `learns`.
    """

    def call(name: str) -> Callable[..., str]:
        return lambda *arguments: f"{name}({', '.join(arguments)})"

    def infix(name: str) -> Callable[..., str]:
        def write(*arguments: str) -> str:
            form = _OTHER_FORMS.get(name) or _FORMS[len(arguments)]
            return Infix(form.format(*map(_factor if "*" in form else str, arguments)))

        return write

    found = {name: call(name) if fixed else infix(name) for name in _NAMES}
    factors = {"weighed": "weight", "over_weight": "inverse"}

    def gained(acceleration: str, axis: str) -> str:
        share = f"tilt_gain_share(learnt, {axis})"
        return found["factor_product"](acceleration, share) if learns else acceleration

    return found | {
        "gained": gained,
        **{
            name: partial(_times, found["factor_product"], factor) if weighs else str
            for name, factor in factors.items()
        },
    }


def term(product: str) -> str:
    """Return a product as an operand: in brackets if it is written with operators."""
    return f"({product})" if isinstance(product, Infix) and " " in product else product


def _times(product: Callable[..., str], factor: str, acceleration: str) -> str:
    return product(acceleration, factor)


def _factor(argument: str) -> str:
    return f"({argument})" if " " in argument else argument
