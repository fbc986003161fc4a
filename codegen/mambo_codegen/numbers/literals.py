"""Spell Python numbers as C literals."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from mambo_codegen.numbers.fixed_point import LARGEST, raw

Scalar = type[np.floating[Any]]
"""The scalar type of a floating point controller, `numpy.float32` or `numpy.float64`."""

SCALARS: Final[dict[str, Scalar]] = {"float32": np.float32, "float64": np.float64}
C_TYPES: Final[dict[str, str]] = {"float32": "float", "float64": "double", "fixed": "int"}
SUM_TYPES: Final[dict[str, str]] = C_TYPES | {"fixed": "long long"}
_INDENT: Final = 4
_WIDTH: Final = 110
_SUFFIXES: Final[dict[str, str]] = {"float32": "f", "float64": ""}
_LEAST_POSITIONAL: Final = 1e-4
_SCIENTIFIC_FROM: Final[dict[str, float]] = {"float32": 1e6, "float64": 1e16}
"""Magnitudes without an exponent; `str` of NumPy has other ones with each of its versions."""


class Spelling:
    """How the constants of one controller are spelled.

    In floating point all quantities have one format; in fixed point `bits` has the format of each.
    """

    def __init__(self, scalar: str, bits: Mapping[str, int] | None = None) -> None:
        self._scalar = scalar
        self._bits = bits

    def real(self, value: float, quantity: str = "") -> str:
        """Spell one number; one without a quantity is for the user's code, and always floating point."""
        if self._bits is None:
            return real(value, self._scalar)
        return fixed(value, self._bits[quantity]) if quantity else real(value, "float32")

    def rows(
        self,
        values: Iterable[Sequence[float]],
        quantity: str | Sequence[str] = "",
        indent: int = _INDENT,
    ) -> str:
        """Spell a two-dimensional table, each row in braces; `quantity` is one for all or for each column."""

        def words(row: Sequence[float]) -> list[str]:
            names = [quantity] * len(row) if isinstance(quantity, str) else quantity
            return [self.real(value, name) for value, name in zip(row, names, strict=True)]

        return ",\n".join(_row(words(row), indent) for row in values)

    def row(self, values: Sequence[float], quantity: str = "", indent: int = _INDENT) -> str:
        """Spell a one-dimensional table without its braces."""
        return _wrap([self.real(value, quantity) for value in values], " " * indent)


def real(value: float, scalar: str) -> str:
    """Spell `value`, rounded once to `scalar`, as the shortest decimal that reads back to the same bits.

    Raises ValueError for a value that is not finite in `scalar`: C99 has no literal for it.
    """
    rounded = SCALARS[scalar](value)
    if not np.isfinite(rounded):
        raise ValueError(f"{value!r} has no {scalar} literal in C")
    if rounded == 0 or _LEAST_POSITIONAL <= abs(float(rounded)) < _SCIENTIFIC_FROM[scalar]:
        digits = np.format_float_positional(rounded, trim="0")
    else:
        digits = np.format_float_scientific(rounded, trim="-", exp_digits=2)
    return f"{digits}{_SUFFIXES[scalar]}"


def fixed(value: float, bits: int) -> str:
    """Spell the number of format `bits` nearest to `value`; one beyond 32 bits gets the suffix LL."""
    number = raw(value, bits)
    return f"{number}LL" if abs(number) > LARGEST else str(number)


def _row(words: list[str], indent: int) -> str:
    margin = " " * indent
    return f"{margin}{{ {_wrap(words, margin + '  ').lstrip()} }}"


def _wrap(words: list[str], margin: str) -> str:
    lines = [margin]
    for word in (*(f"{word}," for word in words[:-1]), words[-1]):
        if lines[-1] != margin and len(lines[-1]) + len(word) + 1 > _WIDTH:
            lines.append(margin)
        lines[-1] += word if lines[-1] == margin else f" {word}"
    return "\n".join(lines)
