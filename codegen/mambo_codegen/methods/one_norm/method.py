"""The 1-norm of the paper, minimised by RPROP, behind the interface of all methods."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from mambo_codegen.methods.interface import Method, StepResult
from mambo_codegen.methods.one_norm.constants import OneNormConstants
from mambo_codegen.methods.one_norm.controller import OneNormController, OneNormStep
from mambo_codegen.methods.one_norm.formats import refusals
from mambo_codegen.methods.shared.limits_constants import LATER_LIMITS, ONE_NORM_TILT, has_limits
from mambo_codegen.methods.shared.limits_constants import refusals as limits_refusals
from mambo_codegen.methods.shared.proofs import FLOAT_PROOFS
from mambo_codegen.methods.shared.rate_feedback import lag_refusals
from mambo_codegen.numbers.representation import WEIGHTS
from mambo_codegen.settings.key import Refusal


class OneNorm(OneNormConstants, Method):
    """A controller with the 1-norm."""

    folder: ClassVar[str] = "one_norm"
    step_type: ClassVar[type] = OneNormStep
    sub_blocks: ClassVar[Mapping[str, str]] = {
        "numbers": "comparisons, limits and products",
        "signs": "signs and magnitudes",
        "inputs": "the checks of inputs",
        "trigonometry": "sine and cosine of the heading",
        "tracker": "acceleration of the target",
        "predictor": "the errors over the horizon, eqs 8-11",
        "cost": "their sum and its subgradient, eq 12",
        "optimizer": "RPROP",
        "limits_arithmetic": "roots and products of the limits",
        "limits": "speed, braking and place",
        "set_limits": "what the limits need, and their functions of nmpc.h",
        "step": "a control step",
        "interface": "the functions of nmpc.h",
        "heading": "set-points of a yaw loop",
        "float": "the same functions with floats",
    }
    setter: ClassVar[str] = "set_weights"
    digested: ClassVar[tuple[str, ...]] = (
        "steps_blind",
        "iterations",
        "converged",
        "cost",
        "gradient",
        "plan_rad",
    )
    iterates: ClassVar[bool] = True
    unnamed: ClassVar[tuple[str, ...]] = (
        *("controller.method", "model.thrust", "damping", "target"),
        *LATER_LIMITS,
    )
    float_proofs: ClassVar[Mapping[str, tuple[str, ...]]] = FLOAT_PROOFS

    def refusals(self) -> list[Refusal]:
        """Return why a controller with the 1-norm cannot have the settings."""
        settings = self.settings
        refused = lag_refusals(settings, needs_lag=False) or limits_refusals(
            settings, ONE_NORM_TILT, is_limited=has_limits(settings)
        )
        return refused or (refusals(settings) if settings.code.scalar == "fixed" else [])

    def reference_controller(self, n: int = 1) -> OneNormController:
        """Return n controllers in NumPy that compute the bits of the C."""
        return OneNormController(self, n)

    @property
    def results(self) -> tuple[StepResult, ...]:
        """The results of a step."""
        moves = self.settings.horizon.control
        return (
            StepResult("status"),
            StepResult("command_rad", ("angle",), (2,)),
            StepResult("cost", ("cost",)),
            StepResult("gradient", ("gradient",), (moves, 2)),
            StepResult("plan_rad", ("angle",), (moves, 2)),
            StepResult("iterations"),
            StepResult("converged", count_type=np.bool_),
            *(self._limits_results if self.limiting else ()),
        )

    @property
    def _limits_results(self) -> tuple[StepResult, ...]:
        stored = self.limits_stored
        return (
            StepResult("limits", stored, (len(stored),)),
            StepResult("steps_blind"),
            StepResult("active_limits"),
        )

    @property
    def setter_quantities(self) -> tuple[str, ...]:
        """The quantities of the weights."""
        return WEIGHTS

    @property
    def work(self) -> tuple[int, int]:
        """Predicted states times moves in each iteration, and iterations."""
        horizon = self.settings.horizon
        return horizon.prediction * horizon.control, self.settings.optimizer.iterations

    @property
    def context(self) -> dict[str, object]:
        """What only the templates of the 1-norm insert."""
        settings = self.settings
        tracking_limit, effort_limit = self.weight_limits
        return {
            "quadratic": False,
            "backtracking": settings.optimizer.variant == "rprop+",
            "tables": self.tables,
            "hover": settings.model.thrust == "hover",
            "tracking_limit": tracking_limit,
            "effort_limit": effort_limit,
        }
