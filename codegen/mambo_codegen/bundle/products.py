"""How templates write the products of a control step: `{{ gain_product("gain", "tilt") }}`.

In floating point that is `gain * tilt`, and as an operand, by the filter `term`, `(gain * tilt)`. In fixed
point it is `gain_product(gain, tilt)`: each product is a function, since it rounds and shifts to the
format of its result (`products_fixed.c.j2`).
"""

from collections.abc import Callable
from typing import Final

_FORMS: Final = (
    dict.fromkeys(
        (
            "thrust_product",
            "wide_product",
            "sine_product",
            "velocity_product",
            "gain_product",
            "share_product",
            "step_product",
            "target_product",
            "tracker_product",
            "tracking_cost",
            "effort_cost",
            "tracking_gradient",
            "speed_product",
            "drag_product",
            "tilt_product",
            "command_product",
            "feedback_product",
            "ratio_product",
            "per_step_product",
            "per_step2_product",
            "aged_position",
            "aged_velocity",
            "approach_product",
            "approach_ratio",
            "braking_product",
            "knee_product",
            "rate_product",
            "scaled_velocity",
            "speed_ratio",
            "reach_product",
            "gravity_product",
            "step2_product",
            "factor_product",
        ),
        "{} * {}",
    )
    | dict.fromkeys(
        (
            "initial_error",
            "error_change",
            "effort_gradient",
            "position_change",
            "velocity_change",
            "move_acceleration",
            "attitude_sum",
            "row_sum",
            "to_move",
            "to_factor",
        ),
        "{}",
    )
    | {
        "half_change": "NMPC_HALF * {}",
        "halved": "NMPC_HALF * {}",
        "squared": "{0} * {0}",
        "angle_square": "{0} * {0}",
        "sine_difference": "({} * {}) - ({} * {})",
        "sine_sum": "({} * {}) + ({} * {})",
        "position_correction": "({} * {}) + ({} * {})",
        "velocity_correction": "({} * {}) + ({} * {})",
        "disturbance_correction": "({} * {}) + ({} * {})",
        "gain_correction": "({} * {}) + ({} * {})",
    }
)
"""What each product is in floating point, by the name of its function."""


class Infix(str):
    """A product written with operators."""

    __slots__ = ()


def products(*, fixed: bool) -> dict[str, Callable[..., str]]:
    """Return the functions of the templates that write products, by name."""

    def call(name: str) -> Callable[..., str]:
        return lambda *arguments: f"{name}({', '.join(arguments)})"

    def infix(form: str) -> Callable[..., str]:
        return lambda *arguments: Infix(form.format(*map(_factor if "*" in form else str, arguments)))

    return {name: call(name) if fixed else infix(form) for name, form in _FORMS.items()}


def term(product: str) -> str:
    """Return a product as an operand: in brackets if it is written with operators."""
    return f"({product})" if isinstance(product, Infix) and " " in product else product


def _factor(argument: str) -> str:
    return f"({argument})" if " " in argument else argument
