"""The constants of a controller with the 1-norm."""

import math
from functools import cached_property

from mambo_codegen.methods.constants import Constants
from mambo_codegen.methods.one_norm.formats import OneNormFormats, formats
from mambo_codegen.methods.one_norm.horizon import HorizonTables, horizon_tables
from mambo_codegen.settings.limits import WEIGHT_LIMIT


class OneNormConstants(Constants):
    """What follows from settings with `cost.norm = "1-norm"`."""

    @property
    def step_s(self) -> float:
        """The step of the prediction, tau."""
        return self.settings.horizon.prediction_step_s

    @cached_property
    def tables(self) -> HorizonTables:
        """The constants of the prediction, in float64."""
        return horizon_tables(self.settings)

    def choose_formats(self) -> OneNormFormats:
        """Choose the formats of fixed point."""
        return formats(self.settings, self.tables)

    @property
    def weight_limits(self) -> tuple[float, float]:
        """The largest tracking and effort weight, in SI units."""
        found = self.numbers.formats
        if not isinstance(found, OneNormFormats):
            return WEIGHT_LIMIT, WEIGHT_LIMIT
        return (
            math.ldexp(found.tracking_limit, -found.tracking),
            math.ldexp(found.effort_limit, -found.effort),
        )
