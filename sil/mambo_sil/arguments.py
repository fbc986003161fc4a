"""Checks of the arguments of Python calls: ArgumentError names argument, value and rule."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.errors import echo
from mambo_codegen.settings.key import spell
from mambo_sil.errors import ArgumentError


def require(holds: bool, name: str, value: object, rule: str) -> None:
    """Raise ArgumentError unless the rule, which follows "must", holds for the argument `name`."""
    if not holds:
        spelled = spell(value) if isinstance(value, str) else repr(value)
        raise ArgumentError(f"{name} = {echo(spelled)} must {rule}")


def require_choice(name: str, value: object, choices: Sequence[str]) -> None:
    """Raise ArgumentError unless `value` is one of the names in `choices`."""
    known = isinstance(value, str) and value in choices
    require(known, name, value, f"be {' or '.join(map(spell, choices))}")


def require_kind(name: str, value: object, kind: type | tuple[type, ...], words: str) -> None:
    """Raise ArgumentError unless `value` is of a type, which `words` call "a path", say."""
    require(isinstance(value, kind), name, value, f"be {words}")


def require_path(name: str, value: object, kind: str) -> None:
    """Raise ArgumentError unless `value` can be the path of a file; `kind` says of which file."""
    whole = isinstance(value, str | Path) and "\0" not in str(value)
    require(whole, name, value, f"be the path of {kind}")


def is_whole(value: object, low: int, high: int) -> bool:
    """Return whether `value` is a whole number in low..high; True and False are no numbers."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        return False
    return low <= int(value) <= high


def as_numbers(name: str, values: object) -> NDArray[np.float64]:
    """Return numbers as an array of any shape; raises ArgumentError for text, None and ragged lists."""
    try:
        array: NDArray[Any] = np.asarray(values)
    except (TypeError, ValueError):
        array = np.empty(0, np.object_)
    require(array.dtype.kind in "fiu", name, values, "be numbers, in an array or in lists of equal length")
    return array.astype(np.float64, copy=False)


def of_shape(name: str, values: object, *shapes: tuple[int, ...]) -> NDArray[np.float64]:
    """Return numbers as an array of one of `shapes`; raises ArgumentError for another shape."""
    array = as_numbers(name, values)
    if array.shape not in shapes:
        raise ArgumentError(f"{name}: has shape {array.shape}; it must be {' or '.join(map(str, shapes))}")
    return array


def require_number(name: str, value: object, low: float, high: float) -> None:
    """Raise ArgumentError unless `value` is one number in low..high."""
    array = of_shape(name, value, ())
    require(bool(low <= array <= high), name, value, f"lie in {low:g}..{high:g}")


def require_per_flight(name: str, value: object, low: float, high: float, flights: int | None = None) -> None:
    """Raise ArgumentError unless `value` is a number in low..high, or an array with one for each flight.

    Without `flights` the array may have any length.
    """
    array = as_numbers(name, value)
    if array.ndim:
        of_shape(name, value, (len(array) if flights is None else flights,))
    inside = bool(((array >= low) & (array <= high)).all())
    require(inside, name, value, f"lie in {low:g}..{high:g}")
