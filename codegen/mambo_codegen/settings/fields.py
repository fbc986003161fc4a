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


def _none_or(least: float, most: float) -> Any:
    """Return the bounds of a number that is 0 or lies in `least`..`most`, for the JSON schema."""
    return Field(ge=0, le=most, json_schema_extra={"not": {"exclusiveMinimum": 0, "exclusiveMaximum": least}})


def _refuse_between(least: float, kind: str, rule: str) -> AfterValidator:
    """Return a validator that refuses a number between 0 and `least`; `rule` is the message."""

    def check(value: float) -> float:
        if 0 < value < least:
            raise PydanticCustomError(kind, rule)
        return value

    return AfterValidator(check)


_REFUSE_LIMIT: Final = _refuse_between(
    SMALLEST_LIMIT, "limit", f"must be 0 or at least {SMALLEST_LIMIT}; 0 means no limit"
)

_NO_MINUS_ZERO: Final = AfterValidator(_without_minus_zero)

Number = Annotated[float, _NO_MINUS_ZERO]
Lag = Annotated[
    float,
    _none_or(SHORTEST_LAG_S, 2),
    _refuse_between(SHORTEST_LAG_S, "lag", f"must be 0 or lie in {SHORTEST_LAG_S}..2; 0 means no lag"),
    _NO_MINUS_ZERO,
]
Delay = Annotated[
    float,
    _none_or(SHORTEST_LAG_S, 0.1),
    _refuse_between(
        SHORTEST_LAG_S, "delay", f"must be 0 or lie in {SHORTEST_LAG_S}..0.1; 0 means no dead time"
    ),
    _NO_MINUS_ZERO,
]
Ramp = Annotated[
    float,
    _none_or(SHORTEST_RAMP_S, 2),
    _refuse_between(
        SHORTEST_RAMP_S, "ramp", f"must be 0 or lie in {SHORTEST_RAMP_S}..2; 0 means one free move"
    ),
    _NO_MINUS_ZERO,
]
SpeedLimit = Annotated[float, _none_or(SMALLEST_LIMIT, 1000), _REFUSE_LIMIT, _NO_MINUS_ZERO]
BrakingLimit = Annotated[float, _none_or(SMALLEST_LIMIT, 10), _REFUSE_LIMIT, _NO_MINUS_ZERO]


@dataclass(frozen=True)
class OnlyFor:
    """Marks a section or a key that only controllers use whose key at `path` has this value."""

    path: str
    value: str


@dataclass(frozen=True)
class OnlyWith:
    """Marks a section or a key that only controllers with this optional section use."""

    section: str


ONE_NORM: Final = OnlyFor("controller.method", "1-norm")
QUADRATIC: Final = OnlyFor("controller.method", "quadratic")
LEARNT_GAIN: Final = OnlyFor("height.learnt", "gain")
LEARNT_ACCELERATION: Final = OnlyFor("height.learnt", "acceleration")
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
