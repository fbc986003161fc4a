"""Convert between values in SI units and the numbers of a controller.

Outside the controller, values are floating point in SI units. A float32 or float64 controller rounds them to
its type; a fixed point controller takes integers, in a format for each quantity.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.numbers.fixed_point import LARGEST, SINE_BITS, Formats, raw
from mambo_codegen.numbers.literals import SCALARS

STATE: Final = (*["position"] * 2, *["velocity"] * 2, *["angle"] * 2, "yaw")
TARGET: Final = (*["position"] * 2, *["velocity"] * 2)
THRUST: Final = ("thrust",)
COMMAND: Final = ("angle", "angle")
WEIGHTS: Final = ("tracking", "effort")
"""The quantity of each column of an input."""

SUMS: Final = frozenset({"cost", "gradient"})
"""Quantities whose numbers are of type nmpc_sum_t."""


ATTITUDE_LIMIT_RAD: Final = 3.25
"""Largest measured roll or pitch: just over half a turn, so that most values in degrees are refused."""

YAW_LIMIT_RAD: Final = 1024.0
"""Largest yaw, either way: its 652 quarter turns fit in ten bits, so the argument reduction is exact."""

WEIGHT_LIMIT: Final = 1e6
"""Largest weight at run time; the same as the bound of the settings of `cost`."""


@dataclass(frozen=True)
class InputLimits:
    """The largest magnitudes of inputs and commands, and both limits of thrust, in the numbers of the C."""

    position: Any
    velocity: Any
    attitude: Any
    yaw: Any
    thrust_least: Any
    thrust_most: Any
    tilt: Any
    weights: NDArray[Any]

    @property
    def largest(self) -> dict[str, Any]:
        """The largest magnitudes of what a controller takes, by quantity."""
        return {
            "position": self.position,
            "velocity": self.velocity,
            "angle": self.attitude,
            "yaw": self.yaw,
            "thrust": self.thrust_most,
        }


class Representation:
    """The numbers of one controller.

    scalar:   type of nmpc_real_t, the numbers of the interface.
    wide:     type of nmpc_sum_t, cost and gradient.
    computed: type that the reference computes with.
    formats:  the formats of fixed point, None in floating point.
    bits:     fractional bits by quantity, None in floating point.
    """

    def __init__(self, scalar: str, formats: Formats | None) -> None:
        self.formats = formats
        self.scalar: Any = np.int32 if formats else SCALARS[scalar]
        self.wide: Any = np.int64 if formats else self.scalar
        self.computed: Any = self.wide
        self.bits: Mapping[str, int] | None = (
            {**formats.bits, "sine": SINE_BITS, "whole": 0} if formats else None
        )

    @property
    def bytes(self) -> tuple[int, int]:
        """Bytes of nmpc_real_t and of nmpc_sum_t."""
        return np.dtype(self.scalar).itemsize, np.dtype(self.wide).itemsize

    def constant(self, value: float, quantity: str) -> Any:
        """Round `value` in SI units to a number of the C, in the type that the reference computes with."""
        return self.scalar(value) if self.bits is None else np.int64(raw(value, self.bits[quantity]))

    def type_of(self, quantity: str) -> Any:
        """Return the type of the C's numbers of a quantity: `wide` for cost and gradient, else `scalar`."""
        return self.wide if quantity in SUMS else self.scalar

    def quantize(self, values: ArrayLike, quantities: Sequence[str]) -> NDArray[Any]:
        """Convert `values` in SI units, whose last axis holds `quantities`, to numbers of the C.

        Fixed point rounds to nearest, ties away from zero. NaN and values too large for their format become
        the largest integer, which is outside every input range, so the controller refuses it.
        """
        if self.bits is None:
            return np.ascontiguousarray(values, self.scalar)
        with np.errstate(all="ignore"):
            scaled = np.ldexp(np.asarray(values, np.float64), [self.bits[name] for name in quantities])
            fits = np.abs(scaled) < LARGEST
            whole = np.trunc(np.where(fits, scaled, 0))
            rest = np.where(fits, scaled, 0) - whole
        rounded = whole + np.trunc(2 * rest)
        return np.where(fits, rounded, LARGEST).astype(self.scalar)

    def to_si(self, numbers: NDArray[Any], *quantities: str) -> NDArray[Any]:
        """Convert `numbers` of the C to SI units; from fixed point exactly, as float64.

        The last axis holds `quantities`; a single one applies to all numbers.
        """
        if self.bits is None:
            return numbers
        values: NDArray[Any] = np.ldexp(numbers.astype(np.float64), [-self.bits[name] for name in quantities])
        return values

    def from_si(self, values: NDArray[Any], *quantities: str) -> NDArray[Any]:
        """Convert results of a step, whose last axis holds `quantities`, back to numbers of the C.

        A single quantity applies to all values.
        """
        if self.bits is None:
            return values
        numbers: NDArray[Any] = np.ldexp(values, [self.bits[name] for name in quantities])
        return numbers.astype(self.type_of(quantities[0]))
