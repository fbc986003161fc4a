"""The design of one controller: everything that is derived from its settings, derived once.

Rendering, self-test, digest and reference controller take the same design, so that all of them compute with
the numbers of the C.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mambo_codegen.methods.one_norm.formats import formats
from mambo_codegen.methods.one_norm.horizon import HorizonTables, horizon_tables
from mambo_codegen.methods.quadratic.attitude_constants import (
    AttitudeConstants,
    attitude_constants,
    feedback_steps,
)
from mambo_codegen.methods.quadratic.formats import exact_formats
from mambo_codegen.methods.quadratic.law import QuadraticConstants, quadratic_constants
from mambo_codegen.methods.quadratic.observer_constants import ObserverConstants, observer_constants
from mambo_codegen.methods.tracker_constants import TrackerConstants, tracker_constants
from mambo_codegen.numbers.representation import ACCELERATION, TARGET, InputLimits, Representation
from mambo_codegen.numbers.trigonometry import fixed_trigonometry, trigonometry
from mambo_codegen.settings.model import Settings


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
        """The constants of the target tracker, in float64; None with `target.acceleration = "none"`."""
        return tracker_constants(self.settings)

    @property
    def is_quadratic(self) -> bool:
        """Whether the cost is quadratic; else it is the paper's 1-norm."""
        return self.settings.cost.norm == "quadratic"

    @cached_property
    def attitude(self) -> AttitudeConstants:
        """The constants of the attitude model, in float64; for a quadratic cost."""
        return attitude_constants(self.settings)

    @cached_property
    def observer(self) -> ObserverConstants:
        """The constants of the observer, in float64; for a quadratic cost."""
        return observer_constants(self.settings)

    @cached_property
    def law(self) -> QuadraticConstants:
        """The constants of the quadratic cost's minimum, in float64; for a quadratic cost."""
        return quadratic_constants(self.settings)

    @cached_property
    def feedback_steps(self) -> tuple[float, float] | None:
        """Commands of roll and pitch per change of the angle in an update period; None without feedback."""
        return feedback_steps(self.settings)

    @property
    def target(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_target_t, in their order."""
        return (*TARGET, *ACCELERATION) if self.tracker and self.tracker.is_given else TARGET

    @property
    def stored(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_t, in their order; for a quadratic cost."""
        observer = [*["position"] * 2, *["speed"] * 2, *["acceleration"] * 2]
        attitude = [*["acceleration"] * 8, *["sine"] * 2]
        tracker = ["acceleration"] * 4 if self.tracker else []
        if self.tracker and not self.tracker.is_given:
            tracker = ["velocity"] * 2 + tracker
        tilt = ["angle"] * 2 if self.feedback_steps else []
        return (*observer, *attitude, *tracker, *tilt, "angle", "angle")

    @cached_property
    def numbers(self) -> Representation:
        """The scalar type of the C, and in fixed point the format of each quantity."""
        scalar = self.settings.code.scalar
        if scalar != "fixed":
            return Representation(scalar, None)
        exact = self.is_quadratic
        return Representation(
            scalar, exact_formats(self.settings) if exact else formats(self.settings, self.tables)
        )

    @cached_property
    def limits(self) -> InputLimits:
        """The limits of inputs and commands, rounded to the numbers of the C."""
        return self.numbers.limits(self.settings)

    @property
    def tilt_limit_rad(self) -> float:
        """The tilt limit in rad, as the C has it."""
        return float(self.numbers.to_si(np.array([self.limits.tilt]), "angle")[0])

    @cached_property
    def trigonometry(self) -> Any:
        """The constants of sine and cosine: `Trigonometry`, or `FixedTrigonometry` in fixed point."""
        found = self.numbers.formats
        return trigonometry(self.settings.code.scalar) if found is None else fixed_trigonometry(found)
