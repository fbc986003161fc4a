"""How C in floating point writes the products of a control step: with operators.

In fixed point each product is a function, since it rounds and shifts to the format of its result
(`products_fixed`). The kernel calls these functions; for floating point the filter `infix` writes
`gain * tilt` for `gain_product(gain, tilt)`, in brackets where that is an operand.
"""

import re
from collections.abc import Sequence
from typing import Final

_OTHER_NAMES: Final = (
    *("aged_position", "aged_velocity", "angle_square", "angle_to_yaw", "approach_ratio"),
    *("attitude_sum", "distance_gradient", "disturbance_correction", "effort_cost", "effort_gradient"),
    *("error_change", "factor_to_sine", "gain_correction", "half_change", "halved"),
    *("initial_error", "move_acceleration", "position_change", "position_correction", "row_sum"),
    *("share_product", "sine_difference", "sine_sum", "sine_to_angle", "slope_acceleration"),
    *("length_ratio", "squared", "to_factor", "to_move", "tracking_cost"),
    *("tracking_gradient", "velocity_change", "velocity_correction"),
)
"""The functions of fixed point beside those whose name ends in `_product`."""

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


COLUMNS: Final = 120
"""Of a line of C."""

CALL: Final = re.compile(rf"\b(\w+_product|{'|'.join(_OTHER_NAMES)})\(")
"""A call of a product, up to its first argument."""

_OPERATOR: Final = re.compile(r" (?:[-+*/]|&&|\|\||[<>=!]=|[<>]) ")
_OPENINGS: Final = ("(", ",", "[", "{", "=", "return")
_COMPARISONS: Final = ("==", "<=", ">=", "!=")
_MARK: Final = "\0"
"""Of what has become a product with operators."""
_BLANKS: Final = f" \n{_MARK}"


def infix(text: str) -> str:
    """Return C whose calls of products are written with operators, in brackets where they are operands.

    Lines that come out longer than `COLUMNS` are wrapped.
    """
    place = 0
    while found := CALL.search(text, place):
        place = found.start()
        end, arguments = arguments_of(text, found.end())
        product = form(found[1], arguments)
        before, after = text[: found.start()].rstrip(_BLANKS), text[end:].lstrip(_BLANKS)
        is_whole = before.endswith(_OPENINGS) and not before.endswith(_COMPARISONS) and after[0] in ",;)]}"
        text = f"{text[: found.start()]}{_MARK}{product if is_whole else _bracketed(product)}{text[end:]}"
    lines = text.split("\n")
    return "\n".join(wrap(line.replace(_MARK, "")) if _MARK in line else line for line in lines)


def form(name: str, arguments: Sequence[str]) -> str:
    """Return a product with operators."""
    written = _OTHER_FORMS.get(name) or _FORMS[len(arguments)]
    return written.format(*(map(_bracketed, arguments) if "*" in written else arguments))


def arguments_of(text: str, start: int) -> tuple[int, list[str]]:
    """Return where the call whose arguments begin at `start` ends, and the arguments."""
    depth, begin, arguments = 1, start, []
    for place in range(start, len(text)):
        depth += (text[place] in "([{") - (text[place] in ")]}")
        if depth == 0 or (depth == 1 and text[place] == ","):
            arguments.append(" ".join(text[begin:place].split()))
            begin = place + 1
        if depth == 0:
            return place + 1, arguments
    raise ValueError(f"a call that does not end: {text[start : start + 40]}")


def _bracketed(operand: str) -> str:
    """Return an operand, in brackets if it has an operator of its own."""
    depth = 0
    for place, letter in enumerate(operand):
        depth += (letter in "([{") - (letter in ")]}")
        if depth == 0 and letter == " " and operand[place - 1] != ",":
            return f"({operand})"
    return operand


def wrap(line: str, column: int | None = None) -> str:
    """Break a line of C that is too long: behind a comma or before an operator, outside of brackets.

    `column`: where what goes on from the line before begins; None for the first line of a statement.
    """
    if len(line) <= COLUMNS:
        return line
    indent = len(line) - len(line.lstrip()) + 4
    opened, breaks = [indent if column is None else column], []
    for place, letter in enumerate(line[: COLUMNS + 1]):
        if letter in "([{":
            opened.append(place + 1)
        elif letter in ")]}" and len(opened) > 1:
            opened.pop()
        elif letter == " " and (line[place - 1] == "," or _OPERATOR.match(line, place)):
            breaks.append((len(opened), -place, opened[-1]))
        if column is None and len(opened) == 1 and line.startswith((" = ", "return "), place):
            opened[0] = line.index(" ", place + 1) + 1
    if not breaks:
        return line
    _, place, begin = min(breaks)
    return line[:-place].rstrip() + "\n" + wrap(" " * begin + line[-place:].lstrip(), begin)
