"""Write the products of a floating point controller as plain C: `nmpc_gain_product(a, b)` becomes `a * b`.

Fixed point needs a function for each product, since it rounds and shifts to the format of the result
(`nmpc_products_fixed.h.j2`). The templates call these functions for every scalar type; in floating point,
where each is no more than `a * b`, the C shows that. The order of operations is the one of the calls.
"""

import re
from typing import Final

_FORMS: Final = {
    "thrust_product": "{} * {}",
    "sine_product": "{} * {}",
    "velocity_product": "{} * {}",
    "gain_product": "{} * {}",
    "share_product": "{} * {}",
    "step_product": "{} * {}",
    "target_product": "{} * {}",
    "tracker_product": "{} * {}",
    "initial_error": "{}",
    "error_change": "{}",
    "distance_gradient": "({} * {}) + ({} * {})",
    "tracking_cost": "{} * {}",
    "effort_cost": "{} * {}",
    "tracking_gradient": "{} * {}",
    "effort_gradient": "{}",
    "speed_product": "{} * {}",
    "drag_product": "{} * {}",
    "tilt_product": "{} * {}",
    "command_product": "{} * {}",
    "feedback_product": "{} * {}",
    "ratio_product": "{} * {}",
    "per_step_product": "{} * {}",
    "per_step2_product": "{} * {}",
    "aged_position": "{} * {}",
    "aged_velocity": "{} * {}",
    "position_correction": "({} * {}) + ({} * {})",
    "velocity_correction": "({} * {}) + ({} * {})",
    "disturbance_correction": "({} * {}) + ({} * {})",
    "half_change": "NMPC_HALF * {}",
    "position_change": "{}",
    "sine_difference": "({} * {}) - ({} * {})",
    "sine_sum": "({} * {}) + ({} * {})",
    "move_acceleration": "{}",
    "velocity_change": "{}",
    "attitude_sum": "{}",
    "row_sum": "{}",
}
"""What a function of `nmpc_products_fixed.h.j2` is in floating point."""

_CALL = re.compile(rf"\bnmpc_({'|'.join(_FORMS)})\(")
_STATEMENT_END: Final = ";,)"
_STATEMENT_START: Final = ("=", "(", ",", "return")


def infix(text: str) -> str:
    """Return `text` with every call written as a product, in brackets where it is an operand."""
    while call := _CALL.search(text):
        arguments, end = _arguments(text, call.end())
        form = _FORMS[call[1]]
        factors = [f"({one})" if "*" in form and " " in one else one for one in arguments]
        product = form.format(*factors)
        alone = text[: call.start()].rstrip().endswith(_STATEMENT_START) and text[end] in _STATEMENT_END
        if not alone and " " in product:
            product = f"({product})"
        text = text[: call.start()] + product + text[end:]
    return text


def _arguments(text: str, start: int) -> tuple[list[str], int]:
    """Return the arguments of the call whose brackets open before `start`, and the index after the call."""
    arguments, depth, begin = [], 0, start
    for index in range(start, len(text)):
        if depth == 0 and text[index] in ",)":
            arguments.append(" ".join(text[begin:index].split()))
            begin = index + 1
            if text[index] == ")":
                return arguments, index + 1
        depth += {"(": 1, ")": -1}.get(text[index], 0)
    raise ValueError("a call without a closing bracket")
