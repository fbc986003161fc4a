"""The optional sections: the height, a third axis, and the guard, which bounds how much the commands vary."""

from typing import Annotated, Literal

from pydantic import Field

from mambo_codegen.settings.fields import (
    LEARNT_ACCELERATION,
    LEARNT_GAIN,
    WITH_HEIGHT,
    Delay,
    Number,
    SettingsSection,
)


class Height(SettingsSection):
    """The height as a third axis of the controller, whose command is the thrust."""

    lag_s: Number = Field(
        0.05,
        ge=0.005,
        le=0.5,
        description="Time constant of the first-order lag from commanded to delivered thrust, that of the "
        "rotors, in seconds. Too long is safe; one that is too short rings, so never less than 0.03 for a "
        "drone whose lag is not measured.",
    )
    delay_s: Delay = Field(
        0.0,
        description="Dead time of the thrust and its lags other than lag_s, in seconds, together: they count "
        "as one first-order lag.",
    )
    thrust_gain: Number = Field(
        1.0,
        ge=0.1,
        le=3,
        description="Thrust over mass that the drone delivers for a commanded 1 m/s^2, in steady state: "
        "commands are thrusts over this gain, and the learnt gain is relative to it.",
    )
    response_time_s: Number = Field(
        0.13,
        ge=0.02,
        le=2,
        description="Time in which the drone answers an error of height, in seconds, as "
        "cost.response_time_s: shorter is closer to the target, noisier and less robust.",
    )
    velocity_weight_s: Number = Field(
        0.15,
        ge=0,
        le=2,
        description="Weight of the climb's error beside the height's, in seconds: more damping after large "
        "steps.",
    )
    thrust_min_m_s2: Number = Field(
        2.9,
        ge=0.5,
        le=9,
        description="Least thrust over mass, in metres per second squared: enough for roll and pitch to be "
        "controlled. The least command is this over thrust_gain.",
    )
    thrust_max_m_s2: Number = Field(
        15.0,
        ge=10.8,
        le=100,
        description="Largest thrust over mass, in metres per second squared: what the motors deliver, less a "
        "reserve for roll, pitch and yaw. The largest command is this over thrust_gain.",
    )
    climb_m_s: Number = Field(
        2.0,
        ge=0.1,
        le=20,
        description="Largest speed upwards that the controller aims at, in metres per second.",
    )
    descent_m_s: Number = Field(
        1.2,
        ge=0.1,
        le=20,
        description="Largest speed downwards that the controller aims at, in metres per second.",
    )
    learnt: Literal["gain", "acceleration", "none"] = Field(
        "gain",
        description='What the observer learns of the height: "gain", by which factor the thrust is more or '
        'less than expected, as weight, battery and propellers make it; "acceleration", a vertical '
        'acceleration, such as wind; "none", nothing.',
    )
    learnt_gain_limit: Annotated[Number, LEARNT_GAIN] = Field(
        0.5, ge=0, le=0.6, description='With "gain": largest deviation of the learnt gain from 1.'
    )
    learnt_acceleration_limit_m_s2: Annotated[Number, LEARNT_ACCELERATION] = Field(
        4.905,
        ge=0,
        le=5.886,
        description='With "acceleration": largest learnt acceleration, in metres per second squared.',
    )
    disturbance_noise: Number = Field(
        3.0,
        ge=1e-4,
        le=100,
        description="Noise density of the rate of what is learnt, in m/s^3 per root Hz: a larger one learns "
        "faster. The other noises, age and outage are those of [observer].",
    )

    @property
    def command_m_s2(self) -> tuple[float, float]:
        """The least and the largest command."""
        return self.thrust_min_m_s2 / self.thrust_gain, self.thrust_max_m_s2 / self.thrust_gain


class Guard(SettingsSection):
    """Bounds of what commands do where target or estimate are noisy."""

    tilt_budget_rad: Number = Field(
        1.5,
        ge=0.02,
        le=10,
        description="How much roll and pitch commands may vary at once, in radians; twice the tilt limit, "
        "a swing from one end to the other, if this is less.",
    )
    tilt_budget_rad_s: Number = Field(
        6.0,
        ge=0.1,
        le=1000,
        description="How much they may vary for long, in radians per second. A mixer that serves attitude "
        "first takes the thrust of a drone whose commands rattle by more.",
    )
    thrust_budget_m_s2: Annotated[Number, WITH_HEIGHT] = Field(
        12.0,
        ge=0.1,
        le=10000,
        description="How much the thrust over mass may vary at once, in metres per second squared.",
    )
    thrust_budget_m_s3: Annotated[Number, WITH_HEIGHT] = Field(
        100.0,
        ge=0.1,
        le=100000,
        description="How much it may vary for long, in metres per second cubed.",
    )
    position_noise: Number = Field(
        0.03,
        ge=1e-5,
        le=10,
        description="Noise density of the position while the caller says that none is measured, in m per "
        "root Hz, if it is more than observer.position_noise.",
    )
