"""How finely the column of a table is rounded: to decimals, to significant digits, or to half precision."""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray

MOST_DIGITS: Final = 7
"""Decimals or digits beyond which a column has all digits: single precision has no more."""
LEAST_CHANGES: Final = 20
"""Changes of a value without which nothing can be read: a target at rest has few digits in every log."""
_LIKELIER: Final = 2.0
"""Values from 0.1 to 1 have as many decimals as digits: they count as rounded to decimals."""


@dataclass(frozen=True)
class Resolution:
    """How a column is rounded.

    number: of the decimals or the significant digits.
    unit:   factor from the column to the SI unit.
    """

    kind: Literal["decimals", "digits", "half precision"]
    number: int
    unit: float = 1.0

    @property
    def text(self) -> str:
        """The resolution in words, such as "3 decimals"."""
        return self.kind if self.kind == "half precision" else f"{self.number} {self.kind}"

    def finer(self, factor: float) -> str:
        """Return in words a resolution that is finer by `factor`, at least 1."""
        if self.kind == "half precision":
            return "single precision"
        return f"{self.number + max(int(np.ceil(np.log10(factor))), 1)} {self.kind}"

    def spacing(self, values: FloatArray) -> FloatArray:
        """Return the distance (k,) of the numbers next to values (k,), both in the SI unit."""
        size = np.abs(values) / self.unit
        if self.kind == "decimals":
            return np.full(len(size), self.unit * 10.0**-self.number)
        if self.kind == "digits":
            power = np.floor(np.log10(np.maximum(size, 1e-30)))
            return np.asarray(self.unit * 10.0 ** (power + 1 - self.number))
        return np.asarray(self.unit * np.spacing(size.astype(np.float16)).astype(np.float64))


def hardly_changes(values: FloatArray) -> bool:
    """Return whether values (k,) change too rarely to see how they are rounded."""
    return bool(np.count_nonzero(np.diff(values)) < LEAST_CHANGES)


def read_resolution(values: FloatArray, unit: float = 1.0) -> Resolution | None:
    """Return how the finite values (k,) of a column are rounded, the coarsest that all of them show.

    None for a column with all digits, or that hardly changes.
    """
    if hardly_changes(values):
        return None
    found = []
    decimals = next((d for d in range(MOST_DIGITS) if (np.round(values, d) == values).all()), None)
    if decimals is not None:
        found.append(Resolution("decimals", decimals, unit))
    digits = next((d for d in range(2, MOST_DIGITS + 1) if _has_digits(values, d)), None)
    if digits is not None:
        found.append(Resolution("digits", digits, unit))
    with np.errstate(over="ignore"):
        if (values.astype(np.float16) == values).all():
            found.append(Resolution("half precision", 0, unit))
    coarser = {"decimals": _LIKELIER, "digits": 1.0, "half precision": 1.0}
    mean = [coarser[one.kind] * float(np.mean(one.spacing(unit * values))) for one in found]
    return found[int(np.argmax(mean))] if found else None


def _has_digits(values: FloatArray, digits: int) -> bool:
    """Return whether no value (k,) has more than `digits` significant digits."""
    return all(float(f"{value:.{digits}g}") == value for value in values.tolist())
