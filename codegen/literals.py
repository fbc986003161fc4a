"""Spell Python values as C tokens: the one place that knows C's lexical rules."""

from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np

Scalar = type[np.floating[Any]]
"""The scalar type of a controller, `numpy.float32` or `numpy.float64`."""

SCALARS: Final[dict[str, Scalar]] = {"float32": np.float32, "float64": np.float64}
C_TYPES: Final[dict[str, str]] = {"float32": "float", "float64": "double"}
_SUFFIXES: Final[dict[str, str]] = {"float32": "f", "float64": ""}


def real(value: float, scalar: str) -> str:
    """Spell `value`, rounded once to `scalar`, as the shortest decimal that reads back to the same bits.

    Raises ValueError for a value that is not finite in `scalar`: C99 has no literal for it.
    """
    rounded = SCALARS[scalar](value)
    if not np.isfinite(rounded):
        raise ValueError(f"{value!r} has no {scalar} literal in C")
    return f"{rounded!s}{_SUFFIXES[scalar]}"


def rows(values: Iterable[Sequence[float]], scalar: str, indent: int = 4, width: int = 110) -> str:
    """Spell a two-dimensional table, a brace-enclosed row for each sequence, wrapped at `width` columns."""
    return ",\n".join(_row([real(value, scalar) for value in row], indent, width) for row in values)


def row(values: Sequence[float], scalar: str, indent: int = 4, width: int = 110) -> str:
    """Spell a one-dimensional table without its braces, wrapped at `width` columns."""
    return _wrapped([real(value, scalar) for value in values], " " * indent, width)


def _row(words: list[str], indent: int, width: int) -> str:
    margin = " " * indent
    return f"{margin}{{ {_wrapped(words, margin + '  ', width).lstrip()} }}"


def _wrapped(words: list[str], margin: str, width: int) -> str:
    lines = [margin]
    for word in (*(f"{word}," for word in words[:-1]), words[-1]):
        if lines[-1] != margin and len(lines[-1]) + len(word) + 1 > width:
            lines.append(margin)
        lines[-1] += word if lines[-1] == margin else f" {word}"
    return "\n".join(lines)
