"""The section of the limits: of commands, speed, braking and place."""

import math
from typing import Annotated

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from mambo_codegen.settings.fields import (
    WITH_HEIGHT,
    BrakingLimit,
    Number,
    SettingsSection,
    SpeedLimit,
)


class Fence(SettingsSection):
    """A box that the drone stays in, along x and y of the world: north and east; with [height] upwards."""

    x_min_m: Number = Field(0.0, ge=-10000, le=9999, description="Least x in the fence, in metres.")
    x_max_m: Number = Field(
        0.0,
        ge=-9999,
        le=10000,
        description="Largest x in the fence, in metres; more than x_min_m. Both 0 for no walls along x.",
    )
    y_min_m: Number = Field(0.0, ge=-10000, le=9999, description="Least y in the fence, in metres.")
    y_max_m: Number = Field(
        0.0,
        ge=-9999,
        le=10000,
        description="Largest y in the fence, in metres; more than y_min_m. Both 0 for no walls along y.",
    )

    floor_m: Annotated[Number, WITH_HEIGHT] = Field(
        0.0, ge=-10000, le=9999, description="Least height in the fence, in metres."
    )
    ceiling_m: Annotated[Number, WITH_HEIGHT] = Field(
        0.0,
        ge=-9999,
        le=10000,
        description="Largest height in the fence, in metres; more than floor_m. Both 0 for neither.",
    )

    @field_validator("x_max_m", "y_max_m", "ceiling_m")
    @classmethod
    def _max_above_min(cls, largest: float, info: ValidationInfo) -> float:
        name = info.field_name or ""
        other = "floor_m" if name == "ceiling_m" else f"{name[0]}_min_m"
        smallest = info.data.get(other, -math.inf)
        if largest <= smallest and not largest == smallest == 0:
            raise PydanticCustomError("fence", f"must be more than {smallest!r} (limits.fence.{other})")
        return largest


class Limits(SettingsSection):
    """The limits of commands, speed, braking and place."""

    tilt_rad: Number = Field(
        0.35,
        ge=0.01,
        le=1.2,
        description="Tilt limit, in radians: each iteration clamps every move of roll and pitch to plus or "
        "minus this value. Not in the paper; without it no bound on the command can be proven.",
    )
    speed_m_s: SpeedLimit = Field(
        0.0,
        description="Speed limit, in metres per second: the controller aims at no larger horizontal speed, "
        "however far the target; 0 for none. A target that moves faster is left behind.",
    )
    braking_m_s2: BrakingLimit = Field(
        0.0,
        description="Braking limit, in metres per second squared: the drone approaches a target or a wall at "
        "a speed that this deceleration takes away in time. 0 for 0.8 of what the tilt limit gives; with the "
        "1-norm, which has no limits unless one is set, also for none.",
    )
    fence: Fence = Field(
        Fence(),
        description="A box that the drone stays in, by its estimated position: a target outside counts as "
        "one on the wall, and a drone outside flies back in.",
    )
