"""The sections of the settings: every key of controller.toml, its default, bounds, unit and source.

The attribute path is the TOML path (`settings.horizon.prediction` is `prediction` under `[horizon]`).
The defaults are preset `table1`: Table I of the paper, and where the paper is silent the documented choice.
The descriptions below are the text of the commented controller.toml, the JSON schema and the reference.
"""

import math
from typing import Annotated, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
)
from pydantic_core import PydanticCustomError

from mambo_nmpc.codegen.settings import reserved

SHORTEST_LAG_S = 0.001
"""An attitude lag is 0 (none) or at least this: below it the exact discretisation is a unit step."""


def _without_minus_zero(value: float) -> float:
    """Return `value` with -0.0 as 0.0, so that equal settings have equal digests and equal C."""
    return value + 0.0


def _none_or_lag(value: float) -> float:
    """Return `value`, an attitude lag in seconds; refuse those that round to no lag at all."""
    if 0 < value < SHORTEST_LAG_S:
        raise PydanticCustomError("lag", f"must be 0 or lie in {SHORTEST_LAG_S}..2; 0 means no lag")
    return value


Number = Annotated[float, AfterValidator(_without_minus_zero)]
Lag = Annotated[
    float,
    Field(ge=0, le=2, json_schema_extra={"not": {"exclusiveMinimum": 0, "exclusiveMaximum": SHORTEST_LAG_S}}),
    AfterValidator(_none_or_lag),
    AfterValidator(_without_minus_zero),
]


class _Section(BaseModel):
    """What all sections share: frozen, no unknown keys, no silent conversion, finite numbers only."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        validate_default=True,
        field_title_generator=lambda name, _: name,
    )


class Horizon(_Section):
    """How far the controller looks ahead, and how often it runs."""

    prediction: int = Field(
        10,
        ge=1,
        le=50,
        description="N_p, prediction horizon, in prediction steps: the states that the cost weighs "
        "(eq 12, Table I).",
    )
    control: int = Field(
        2,
        ge=1,
        le=50,
        description="N_c, control horizon, in prediction steps: their moves of roll and pitch are the "
        "unknowns of the optimizer (eq 12, Table I). The last moves are held to the end of the prediction, "
        "so N_c is at most N_p.",
    )
    prediction_step_s: Number = Field(
        0.07,
        ge=0.001,
        le=1,
        description="tau of the predictor, in seconds: the time between two predicted states (eqs 9-11). "
        "The paper prints 0.01 s, a horizon shorter than the attitude loop's lag, which does not fly on the "
        "Mambo.",
    )
    update_period_s: Number = Field(
        0.01,
        ge=0.001,
        le=1,
        description="Update period, in seconds: the time between two calls of the step function (100 Hz in "
        "the paper, section on simulation).",
    )

    @field_validator("control")
    @classmethod
    def _within_prediction(cls, control: int, info: ValidationInfo) -> int:
        longest = info.data.get("prediction", control)
        if control > longest:
            raise PydanticCustomError("horizon", f"must lie in 1..{longest} (horizon.prediction)")
        return control


class Model(_Section):
    """How the predictor moves the drone."""

    position_update: Literal["exact", "printed"] = Field(
        "exact",
        description='How acceleration moves the position (eq 9): "exact" adds tau^2/2 times it, as units '
        'ask; "printed" adds tau/2 times it, as the paper prints.',
    )
    yaw_convention: Literal["rotation", "printed"] = Field(
        "rotation",
        description='Signs of the yaw psi in eq 8: "rotation" takes them from the rotation matrix (eq 3, '
        'NED); "printed" takes them as eq 8 prints them, which flies away at 45 degrees of yaw.',
    )
    roll_lag_s: Lag = Field(
        0.0,
        description="Time constant of the roll loop, in seconds: a first-order lag between commanded and "
        "predicted roll phi, 0 for none (not in the paper; identified on the Mambo's attitude loop).",
    )
    pitch_lag_s: Lag = Field(
        0.0,
        description="Time constant of the pitch loop, in seconds: a first-order lag between commanded and "
        "predicted pitch theta, 0 for none (not in the paper; identified on the Mambo's attitude loop).",
    )

    @field_validator("roll_lag_s", "pitch_lag_s")
    @classmethod
    def _no_lag_in_print(cls, lag: float, info: ValidationInfo) -> float:
        if lag > 0 and info.data.get("position_update") == "printed":
            raise PydanticCustomError(
                "lag",
                'must be 0 with model.position_update = "printed", which knows no lag; '
                'write 0 here or position_update = "exact"',
            )
        return lag


class Cost(_Section):
    """What the controller pays for: distance from the target and moves of the attitude command."""

    tracking_weight: Number = Field(
        2250.0,
        ge=0.001,
        le=1e6,
        description="lambda_1, per metre: weight of the 1-norm of the distance between predicted and target "
        "position (eq 12, Table I).",
    )
    effort_weight: Number = Field(
        1.0,
        ge=0,
        le=1e6,
        description="lambda_2, per radian: weight of the 1-norm of the change from one move to the next (eq "
        "12, Table I). A larger one calms the commands and costs tracking.",
    )


class Optimizer(_Section):
    """The resilient backpropagation (RPROP) that searches the moves."""

    variant: Literal["rprop+", "irprop-"] = Field(
        "rprop+",
        description='What follows a slope that changes sign: "rprop+" takes the last move back (Riedmiller '
        'and Braun 1993), "irprop-" stays and takes a smaller step next (Igel and Huesken 2000).',
    )
    iterations: int = Field(
        5,
        ge=1,
        le=100,
        description="I_max, iterations in every control step: always as many evaluations of the cost "
        "(Table I).",
    )
    tolerance: Number = Field(
        0.05,
        ge=0,
        le=1e6,
        description="epsilon, in units of the cost: once an iteration changes the cost by less, the plan is "
        "frozen and reported as converged (Table I).",
    )
    initial_step_rad: Number = Field(
        0.01,
        ge=1e-6,
        le=1,
        description="U_step or Delta_0, in radians: step size at the start of every control step (Table I).",
    )
    increase: Number = Field(
        1.2,
        ge=1,
        le=10,
        description="eta+, a factor: growth of the step size while the slope keeps its sign (Table I).",
    )
    decrease: Number = Field(
        0.8,
        ge=0.01,
        le=1,
        description="eta-, a factor: shrinkage of the step size when the slope changes sign (Table I).",
    )
    step_max_rad: Number = Field(
        0.1, ge=1e-6, le=1, description="Delta_max, in radians: the largest step size (Table I)."
    )
    step_min_rad: Number = Field(
        1e-6, ge=1e-9, le=1, description="Delta_min, in radians: the smallest step size (Table I)."
    )
    warm_start: Literal["last_command", "plan"] = Field(
        "last_command",
        description='Omega_k, where every control step begins: "last_command" starts all moves at the '
        'command last applied, "plan" at the plan last found (the paper does not say).',
    )

    @field_validator("step_max_rad")
    @classmethod
    def _max_above_initial(cls, step_max: float, info: ValidationInfo) -> float:
        initial = info.data.get("initial_step_rad", step_max)
        if step_max < initial:
            raise PydanticCustomError(
                "step", f"must lie in {initial!r}..1 (from optimizer.initial_step_rad up)"
            )
        return step_max

    @field_validator("step_min_rad")
    @classmethod
    def _min_below_initial(cls, step_min: float, info: ValidationInfo) -> float:
        initial = info.data.get("initial_step_rad", step_min)
        if step_min > initial:
            raise PydanticCustomError(
                "step", f"must lie in 1e-9..{initial!r} (up to optimizer.initial_step_rad)"
            )
        return step_min


class Limits(_Section):
    """What the controller may command."""

    tilt_rad: Number = Field(
        0.35,
        ge=0.01,
        le=1.2,
        description="Tilt limit, in radians: every move of roll and pitch is clamped to plus and minus this "
        "in each iteration (not in the paper; without it no bound on the command can be proven).",
    )


class Ranges(_Section):
    """What the controller accepts: an input outside is refused with a status and the last good command."""

    position_m: Number = Field(
        1000.0,
        ge=1,
        le=10000,
        description="Largest magnitude of a position of drone or target, in metres, per axis.",
    )
    velocity_m_s: Number = Field(
        100.0,
        ge=0.1,
        le=1000,
        description="Largest magnitude of a velocity of drone or target, in metres per second, per axis.",
    )
    thrust_acceleration_min_m_s2: Number = Field(
        1.0,
        ge=0.1,
        le=100,
        description="Smallest thrust over mass, u_1/m of eq 8, in metres per second squared; hover is 9.81.",
    )
    thrust_acceleration_max_m_s2: Number = Field(
        50.0,
        ge=0.1,
        le=1000,
        description="Largest thrust over mass, u_1/m of eq 8, in metres per second squared; above the "
        "smallest.",
    )

    @field_validator("thrust_acceleration_max_m_s2")
    @classmethod
    def _max_above_min(cls, largest: float, info: ValidationInfo) -> float:
        smallest = info.data.get("thrust_acceleration_min_m_s2", -math.inf)
        if largest <= smallest:
            raise PydanticCustomError(
                "range", f"must be more than {smallest!r} (ranges.thrust_acceleration_min_m_s2)"
            )
        return largest


class Code(_Section):
    """How the C is spelled."""

    scalar: Literal["float32", "float64", "fixed"] = Field(
        "float32",
        description="Type of every number in the C: float32 is C's float, float64 its double, fixed whole "
        "numbers of 32 bits, for processors without an FPU.",
    )
    prefix: str = Field(
        "nmpc",
        max_length=24,
        pattern=r"^[a-z][a-z0-9]*(_[a-z0-9]+)*$",
        description="How public names begin, as in nmpc_step and NMPC_OK: controllers with different "
        "prefixes live in one image.",
    )

    @field_validator("prefix")
    @classmethod
    def _no_keyword(cls, prefix: str) -> str:
        if prefix in reserved.KEYWORDS:
            raise PydanticCustomError(
                "keyword", f"must not be a keyword of C or C++; write for example {prefix}_nmpc"
            )
        if prefix in reserved.STANDARD_NAMES:
            raise PydanticCustomError(
                "keyword",
                f"must not be a header or a name of the C library or POSIX; write for example {prefix}_nmpc",
            )
        return prefix


class Sections(_Section):
    """All sections; `Settings` adds the rule that joins them."""

    horizon: Horizon = Field(
        Horizon(), description="How far the controller looks ahead, and how often it runs."
    )
    model: Model = Field(Model(), description="How the predictor moves the drone.")
    cost: Cost = Field(Cost(), description="What the controller pays for: distance and effort.")
    optimizer: Optimizer = Field(Optimizer(), description="The RPROP search for the moves.")
    limits: Limits = Field(Limits(), description="What the controller may command.")
    ranges: Ranges = Field(
        Ranges(), description="What the controller accepts; anything outside is refused with a status."
    )
    code: Code = Field(Code(), description="How the C is spelled.")
