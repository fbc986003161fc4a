"""The design of one controller: everything that is derived from its settings, derived once.

Rendering, self-test, digest and reference controller take the same design, so that all of them compute with
the numbers of the C.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from mambo_nmpc.codegen.fixed_point import formats
from mambo_nmpc.codegen.horizon import HorizonTables, horizon_tables
from mambo_nmpc.codegen.representation import InputLimits, Representation
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.codegen.tracker import TrackerConstants, tracker_constants
from mambo_nmpc.codegen.trigonometry import fixed_trigonometry, trigonometry


@dataclass(frozen=True)
class Design:
    """What follows from `settings`; each property is derived at its first use and cached."""

    settings: Settings

    @cached_property
    def tables(self) -> HorizonTables:
        """The constants of the prediction, in float64."""
        return horizon_tables(self.settings)

    @cached_property
    def tracker(self) -> TrackerConstants | None:
        """The constants of the target tracker, in float64; None without `target.acceleration = "tracked"`."""
        return tracker_constants(self.settings)

    @cached_property
    def numbers(self) -> Representation:
        """The scalar type of the C, and in fixed point the format of each quantity."""
        scalar = self.settings.code.scalar
        return Representation(scalar, formats(self.settings, self.tables) if scalar == "fixed" else None)

    @cached_property
    def limits(self) -> InputLimits:
        """The limits of inputs and commands, rounded to the numbers of the C."""
        return self.numbers.limits(self.settings)

    @cached_property
    def trigonometry(self) -> Any:
        """The constants of sine and cosine: `Trigonometry`, or `FixedTrigonometry` in fixed point."""
        found = self.numbers.formats
        return trigonometry(self.settings.code.scalar) if found is None else fixed_trigonometry(found)
