"""Convert between values in SI units and the numbers of a controller.

Outside the controller, values are floating point in SI units. A float32 or float64 controller rounds them to
its type; a fixed point controller takes integers, in a format for each quantity.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods.one_norm.formats import LARGEST, SINE_BITS, Formats, raw
from mambo_codegen.methods.quadratic.formats import ExactFormats
from mambo_codegen.methods.quadratic.law import STATES
from mambo_codegen.numbers.literals import SCALARS
from mambo_codegen.settings.limits import ATTITUDE_LIMIT_RAD, WEIGHT_LIMIT, YAW_LIMIT_RAD
from mambo_codegen.settings.sections import Sections

STATE: Final = (*["position"] * 2, *["velocity"] * 2, *["angle"] * 2, "yaw")
TARGET: Final = (*["position"] * 2, *["velocity"] * 2)
ACCELERATION: Final = ("thrust", "thrust")
THRUST: Final = ("thrust",)
COMMAND: Final = ("angle", "angle")
WEIGHTS: Final = ("tracking", "effort")
ROW: Final = tuple(f"row_{state}" for state in STATES)
"""The quantity of each column of an input."""

OUTCOME: Final = {"command_rad": "angle", "cost": "cost", "gradient": "gradient", "plan_rad": "angle"}
"""The quantity of each result of a step."""


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


class Representation:
    """The numbers of one controller.

    scalar:   type of nmpc_real_t, the numbers of the interface.
    wide:     type of nmpc_sum_t, cost and gradient.
    computed: type that the reference computes with.
    formats:  the formats of fixed point, None in floating point.
    bits:     fractional bits by quantity, None in floating point.
    tracking_limit, effort_limit: largest weights, in SI units.
    """

    def __init__(self, scalar: str, formats: Formats | ExactFormats | None) -> None:
        self.formats = formats
        self.scalar: Any = np.int32 if formats else SCALARS[scalar]
        self.wide: Any = np.int64 if formats else self.scalar
        self.computed: Any = self.wide
        self.bits: Mapping[str, int] | None = None
        self.tracking_limit = self.effort_limit = WEIGHT_LIMIT
        if isinstance(formats, ExactFormats):
            self.bits = {**formats.bits, "sine": SINE_BITS, "whole": 0}
        elif formats:
            self.bits = asdict(formats) | {"sine": SINE_BITS, "whole": 0}
            self.tracking_limit = math.ldexp(formats.tracking_limit, -formats.tracking)
            self.effort_limit = math.ldexp(formats.effort_limit, -formats.effort)

    def constant(self, value: float, quantity: str) -> Any:
        """Round `value` in SI units to a number of the C, in the type that the reference computes with."""
        return self.scalar(value) if self.bits is None else np.int64(raw(value, self.bits[quantity]))

    def row_constants(self, rows: NDArray[np.float64]) -> NDArray[Any]:
        """Round the rows of the exact optimizer (2, moves, 8), each column in its quantity."""
        return np.array(
            [
                [[self.constant(value, name) for value, name in zip(row, ROW, strict=True)] for row in axis]
                for axis in rows
            ]
        )

    def limits(self, settings: Sections) -> InputLimits:
        """Return the limits of inputs and commands that `settings` give."""
        ranges = settings.ranges
        return InputLimits(
            position=self.constant(ranges.position_m, "position"),
            velocity=self.constant(ranges.velocity_m_s, "velocity"),
            attitude=self.constant(ATTITUDE_LIMIT_RAD, "angle"),
            yaw=self.constant(YAW_LIMIT_RAD, "yaw"),
            thrust_least=self.constant(ranges.thrust_acceleration_min_m_s2, "thrust"),
            thrust_most=self.constant(ranges.thrust_acceleration_max_m_s2, "thrust"),
            tilt=self.constant(settings.limits.tilt_rad, "angle"),
            weights=np.array(
                [self.constant(self.tracking_limit, "tracking"), self.constant(self.effort_limit, "effort")]
                if settings.cost.norm == "1-norm"
                else []
            ),
        )

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

    def from_si(self, values: NDArray[Any], name: str) -> NDArray[Any]:
        """Convert the result `name` of a step (a key of OUTCOME) from SI units back to numbers of the C."""
        if self.bits is None:
            return values
        kind = self.wide if name in ("cost", "gradient") else self.scalar
        numbers: NDArray[Any] = np.ldexp(values, self.bits[OUTCOME[name]]).astype(kind)
        return numbers

    def stored_from_si(self, values: NDArray[Any], quantities: Sequence[str]) -> NDArray[Any]:
        """Convert the stored numbers of a step (n, k) from SI units back to numbers of the C."""
        if self.bits is None:
            return values
        numbers: NDArray[Any] = np.ldexp(values, [self.bits[name] for name in quantities]).astype(self.scalar)
        return numbers
