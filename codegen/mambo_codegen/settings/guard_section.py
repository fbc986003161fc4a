"""The optional section of the guard: its presence bounds how much the commands vary."""

from typing import Annotated

from pydantic import Field

from mambo_codegen.settings.fields import WITH_HEIGHT, Number, SettingsSection


class Guard(SettingsSection):
    """Bounds of what commands do where target or estimate are noisy."""

    tilt_rad: Number = Field(
        1.5,
        ge=0.02,
        le=10,
        description="How much roll and pitch commands may vary at once, in radians; twice the tilt limit, "
        "a swing from one end to the other, if this is less.",
    )
    tilt_rad_s: Number = Field(
        6.0,
        ge=0.1,
        le=1000,
        description="How much they may vary for long, in radians per second. A mixer that serves attitude "
        "first takes the thrust of a drone whose commands rattle by more.",
    )
    thrust_m_s2: Annotated[Number, WITH_HEIGHT] = Field(
        12.0,
        ge=0.1,
        le=10000,
        description="How much the thrust over mass may vary at once, in metres per second squared.",
    )
    thrust_m_s3: Annotated[Number, WITH_HEIGHT] = Field(
        100.0,
        ge=0.1,
        le=100000,
        description="How much it may vary for long, in metres per second cubed.",
    )
    target_noise_m_s2: Number = Field(
        0.3,
        ge=0.01,
        le=10,
        description="Noise of the target's acceleration, in metres per second squared, at which the tracker "
        "believes half of what is new: noise reverses its sign, a corner of the path does not.",
    )
    position_noise: Number = Field(
        0.03,
        ge=1e-5,
        le=10,
        description="Noise density of the position while the caller says that none is measured, in m per "
        "root Hz, if it is more than observer.position_noise.",
    )
