"""What the sections of the settings share: their base, the types of their numbers, and marks of keys."""

from dataclasses import dataclass
from typing import Annotated, Any, Final, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

SHORTEST_LAG_S: Final = 0.001
"""An attitude lag is 0 (none) or at least this; a shorter one is negligible."""

SMALLEST_LIMIT: Final = 0.1
"""A limit of speed or braking is 0 (none) or at least this, in m/s or m/s^2."""

SHORTEST_RAMP_S: Final = 0.02
"""A ramp is 0 (none) or at least this."""


def _without_minus_zero(value: float) -> float:
    """Return `value` with -0.0 as 0.0, so that equal settings have equal digests and equal C."""
    return value + 0.0


def _none_or_lag(value: float) -> float:
    """Return an attitude lag in seconds; refuse one between 0 and SHORTEST_LAG_S."""
    if 0 < value < SHORTEST_LAG_S:
        raise PydanticCustomError("lag", f"must be 0 or lie in {SHORTEST_LAG_S}..2; 0 means no lag")
    return value


def _none_or_delay(value: float) -> float:
    """Return a dead time in seconds; refuse one between 0 and SHORTEST_LAG_S."""
    if 0 < value < SHORTEST_LAG_S:
        raise PydanticCustomError("delay", f"must be 0 or lie in {SHORTEST_LAG_S}..0.1; 0 means no dead time")
    return value


def _none_or_ramp(value: float) -> float:
    """Return a ramp in seconds; refuse one between 0 and SHORTEST_RAMP_S."""
    if 0 < value < SHORTEST_RAMP_S:
        raise PydanticCustomError("ramp", f"must be 0 or lie in {SHORTEST_RAMP_S}..2; 0 means one free move")
    return value


def _none_or_limit(value: float) -> float:
    """Return a limit of speed or braking; refuse one between 0 and SMALLEST_LIMIT."""
    if 0 < value < SMALLEST_LIMIT:
        raise PydanticCustomError("limit", f"must be 0 or at least {SMALLEST_LIMIT}; 0 means no limit")
    return value


Number = Annotated[float, AfterValidator(_without_minus_zero)]
Lag = Annotated[
    float,
    Field(ge=0, le=2, json_schema_extra={"not": {"exclusiveMinimum": 0, "exclusiveMaximum": SHORTEST_LAG_S}}),
    AfterValidator(_none_or_lag),
    AfterValidator(_without_minus_zero),
]
Delay = Annotated[
    float,
    Field(
        ge=0, le=0.1, json_schema_extra={"not": {"exclusiveMinimum": 0, "exclusiveMaximum": SHORTEST_LAG_S}}
    ),
    AfterValidator(_none_or_delay),
    AfterValidator(_without_minus_zero),
]
Ramp = Annotated[
    float,
    Field(
        ge=0, le=2, json_schema_extra={"not": {"exclusiveMinimum": 0, "exclusiveMaximum": SHORTEST_RAMP_S}}
    ),
    AfterValidator(_none_or_ramp),
    AfterValidator(_without_minus_zero),
]
SpeedLimit = Annotated[
    float,
    Field(
        ge=0, le=1000, json_schema_extra={"not": {"exclusiveMinimum": 0, "exclusiveMaximum": SMALLEST_LIMIT}}
    ),
    AfterValidator(_none_or_limit),
    AfterValidator(_without_minus_zero),
]
BrakingLimit = Annotated[
    float,
    Field(
        ge=0, le=10, json_schema_extra={"not": {"exclusiveMinimum": 0, "exclusiveMaximum": SMALLEST_LIMIT}}
    ),
    AfterValidator(_none_or_limit),
    AfterValidator(_without_minus_zero),
]


@dataclass(frozen=True)
class OnlyFor:
    """Marks a section or a key that only controllers with this `cost.norm` use."""

    norm: str


@dataclass(frozen=True)
class OnlyWith:
    """Marks a section or a key that only controllers with this optional section use."""

    section: str


ONE_NORM: Final = OnlyFor("1-norm")
QUADRATIC: Final = OnlyFor("quadratic")
WITH_GUARD: Final = OnlyWith("guard")
WITH_HEIGHT: Final = OnlyWith("height")


class SettingsSection(BaseModel):
    """The rules of all sections: read-only, no unknown keys, no conversion of types, finite numbers."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        validate_default=True,
        defer_build=True,
        field_title_generator=lambda name, _: name,
    )


def type_of(field: FieldInfo) -> type[Any]:
    """Return the section that `field` is, also if it is optional; else the type of its default."""
    kinds = (kind for kind in get_args(field.annotation) if isinstance(kind, type))
    return next((kind for kind in kinds if issubclass(kind, SettingsSection)), type(field.default))
