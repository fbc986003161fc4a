"""The constants of a controller with the 1-norm."""

import math
from functools import cached_property

from mambo_codegen.methods.one_norm.formats import OneNormFormats, formats
from mambo_codegen.methods.one_norm.horizon import HorizonTables, horizon_tables
from mambo_codegen.methods.shared.constants import Constants
from mambo_codegen.methods.shared.limits_constants import (
    ONE_NORM_OUTAGE_S,
    LimitsConstants,
    one_norm_limits,
)
from mambo_codegen.numbers.representation import COMMAND, WEIGHT_LIMIT


class OneNormConstants(Constants):
    """What follows from settings with `controller.method = "1-norm"`."""

    @property
    def step_s(self) -> float:
        """The step of the prediction, tau."""
        return self.settings.horizon.prediction_step_s

    @cached_property
    def tables(self) -> HorizonTables:
        """The constants of the prediction, in float64."""
        return horizon_tables(self.settings)

    @cached_property
    def limiting(self) -> LimitsConstants | None:
        """The constants of the limits of speed, braking and place, in float64; None without any."""
        return one_norm_limits(self.settings)

    @property
    def presence(self) -> dict[str, bool]:
        """Whether each part is there."""
        settings, tables, common = self.settings, self.tables, super().presence
        return common | {
            "backtracking": settings.optimizer.variant == "rprop+",
            "halves": self.numbers.formats is not None and tables.halves,
            "hover": settings.model.thrust == "hover",
            "lag": tables.has_lag,
            "later_moves": settings.horizon.control > 1,
            "later_steps": settings.horizon.prediction > 1,
            "long_horizon": settings.horizon.prediction > 32,
            "printed_yaw": settings.model.yaw_convention == "printed",
            "quadratic": False,
            "shift": self.tracker is not None or self.has_limits,
            "warm_plan": settings.optimizer.warm_start == "plan",
        }

    @property
    def sizes(self) -> dict[str, int]:
        """The constants of nmpc.h that are sizes of arrays."""
        return super().sizes | {"NMPC_MOVES": len(COMMAND) * self.settings.horizon.control}

    @property
    def names(self) -> dict[str, str]:
        """What depends on the settings in the words of the port's rows."""
        has_lag = self.tables.has_lag
        return {
            "at_moves": ", at the moves" if has_lag else "",
            "less_target": ", less A_T" if self.tracker else "",
            "tilt": "the measured phi_k, theta_k" if has_lag else "0, as eq 8 uses only the moves",
            "first_moves": "first moves" if self.feedback_steps else "command",
        }

    @property
    def limits_stored(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_bounds_t, in their order."""
        return self.port.quantities("bounds")

    @property
    def outage_steps(self) -> int | None:
        """Control steps without a good state after which the command is level; None without limits."""
        period_s = self.settings.horizon.update_period_s
        return min(250, max(1, round(ONE_NORM_OUTAGE_S / period_s))) if self.limiting else None

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
