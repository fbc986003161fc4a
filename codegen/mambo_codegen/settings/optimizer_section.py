"""The section of the optimizer of the 1-norm."""

from typing import Literal

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from mambo_codegen.settings.fields import Number, SettingsSection


class Optimizer(SettingsSection):
    """The search for the moves by resilient backpropagation (RPROP)."""

    variant: Literal["rprop+", "irprop-"] = Field(
        "rprop+",
        description='What RPROP does when a gradient changes its sign: "rprop+" restores the previous move '
        '(Riedmiller and Braun 1993), "irprop-" keeps the move and makes a smaller step in the next '
        "iteration (Igel and Huesken 2000).",
    )
    iterations: int = Field(
        5,
        ge=1,
        le=100,
        description="I_max, iterations in every control step; each evaluates the cost once (Table I).",
    )
    tolerance: Number = Field(
        0.05,
        ge=0,
        le=1e6,
        description="epsilon, in units of the cost: when the cost changes by less from one iteration to the "
        "next, the search has converged and the plan no longer changes (Table I).",
    )
    initial_step_rad: Number = Field(
        0.01,
        ge=1e-6,
        le=1,
        description="U_step or Delta_0, in radians: initial step size of every search (Table I).",
    )
    increase: Number = Field(
        1.2,
        ge=1,
        le=10,
        description="eta+: factor of the step size while the gradient keeps its sign (Table I).",
    )
    decrease: Number = Field(
        0.8,
        ge=0.01,
        le=1,
        description="eta-: factor of the step size when the gradient changes its sign (Table I).",
    )
    step_max_rad: Number = Field(
        0.1, ge=1e-6, le=1, description="Delta_max, in radians: the largest step size (Table I)."
    )
    step_min_rad: Number = Field(
        1e-6, ge=1e-9, le=1, description="Delta_min, in radians: the smallest step size (Table I)."
    )
    warm_start: Literal["last_command", "plan"] = Field(
        "last_command",
        description='Omega_k, the initial guess of every search: "last_command" sets all moves to the last '
        'command, "plan" keeps the last plan. The paper does not say which.',
    )

    @field_validator("step_max_rad")
    @classmethod
    def _max_above_initial(cls, step_max: float, info: ValidationInfo) -> float:
        initial = info.data.get("initial_step_rad", step_max)
        if step_max < initial:
            raise PydanticCustomError(
                "step", f"must lie in {initial!r}..1 (at least optimizer.initial_step_rad)"
            )
        return step_max

    @field_validator("step_min_rad")
    @classmethod
    def _min_below_initial(cls, step_min: float, info: ValidationInfo) -> float:
        initial = info.data.get("initial_step_rad", step_min)
        if step_min > initial:
            raise PydanticCustomError(
                "step", f"must lie in 1e-9..{initial!r} (at most optimizer.initial_step_rad)"
            )
        return step_min
