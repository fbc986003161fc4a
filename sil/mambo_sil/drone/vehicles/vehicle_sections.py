"""The sections of vehicle.toml: every key of a drone, its bounds, unit and meaning.

The attribute path is the TOML path (`vehicle.body.mass_kg` is `mass_kg` under `[body]`). The descriptions are
part of the JSON schema and of the messages.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError

LONGEST_DELAY_S = 0.2
"""Longest dead time of an attitude loop and longest delay of a sensor."""


class VehicleSection(BaseModel):
    """The rules of all sections: read-only, no unknown keys, no conversion of types, finite numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False, defer_build=True)


Mass = Annotated[float, Field(ge=0.001, le=100)]
Inertia = Annotated[float, Field(ge=1e-9, le=100)]
Gain = Annotated[float, Field(ge=0, le=1e9)]
Limit = Annotated[float, Field(ge=0, le=1e9)]
Positive = Annotated[float, Field(ge=1e-15, le=1e9)]
Rate = Annotated[int, Field(ge=50, le=2000)]
Lag = Annotated[float, Field(ge=0.001, le=2)]
Delay = Annotated[float, Field(ge=0, le=LONGEST_DELAY_S)]
Noise = Annotated[float, Field(ge=0, le=1e6)]
Trim = Annotated[float, Field(ge=-0.2, le=0.2)]
HalfWidth = Annotated[float, Field(ge=0, le=1e6)]
LONGEST_ARM_M = 1.0
Arm = Annotated[float, Field(ge=-LONGEST_ARM_M, le=LONGEST_ARM_M)]


class Body(VehicleSection):
    """Mass, inertia and drag."""

    mass_kg: Mass = Field(description="Mass in flight, with battery.")
    drag_1_s: Annotated[float, Field(ge=0, le=100)] = Field(
        description="Drag in the plane of the rotors, as deceleration over speed."
    )
    inertia_x_kg_m2: Inertia | None = Field(None, description="Moment of inertia about the forward axis.")
    inertia_y_kg_m2: Inertia | None = Field(None, description="Moment of inertia about the right axis.")
    inertia_z_kg_m2: Inertia | None = Field(None, description="Moment of inertia about the down axis.")


MixerName = Literal["clip", "lower", "yaw-last"]
"""What a mixer does with motor commands beyond their limits."""


class RotorFigures(VehicleSection):
    """Four equal rotors in X configuration: thrust = b w^2, torque = k w^2, w^2 in proportion to the command.

    Who knows the thrust per command, but no speeds, writes 1 for `speed_squared_per_command_rad2_s2`: b is
    then the thrust per command, k the torque per command.
    """

    arm_m: Annotated[float, Field(ge=0.001, le=10)] = Field(
        description="Distance from the centre to a rotor axis."
    )
    thrust_factor_n_s2: Positive = Field(description="b in thrust = b w^2, w the rotor speed in rad/s.")
    torque_factor_n_m_s2: Positive = Field(description="k in torque = k w^2.")
    speed_squared_per_command_rad2_s2: Positive = Field(
        description="Increase of w^2 per unit of motor command, in steady state."
    )
    command_min: Annotated[float, Field(ge=0, le=1e9)] = Field(description="Smallest motor command.")
    command_max: Positive = Field(description="Largest motor command.")
    lag_s: Annotated[float, Field(ge=0, le=1)] = Field(
        description="Time constant from commanded to actual rotor speed; 0 for none."
    )
    mixer: MixerName = Field(
        "clip",
        description="What gives way at command_max: each motor by itself (clip), all by the largest excess "
        "(lower), or yaw first, then all (yaw-last).",
    )


class TorqueGains(VehicleSection):
    """Gains of an axis whose loop demands a torque: P angle error + I its integral - D rate."""

    p_n_m: Gain = Field(description="Torque per rad of angle error.")
    i_n_m_s: Gain = Field(0.0, description="Torque per rad s of the error's integral.")
    d_n_m_s: Gain = Field(description="Torque per rad/s of body rate, against it.")


class YawGains(VehicleSection):
    """Gains of a yaw loop that demands a torque: P angle error - D rate."""

    p_n_m: Gain = Field(description="Torque per rad of angle error.")
    d_n_m_s: Gain = Field(description="Torque per rad/s of body rate, against it.")


class MamboAttitude(VehicleSection):
    """The stock loop of the Mambo: PID of each angle to a torque, and a mixer to motor commands."""

    kind: Literal["mambo"] = Field(description="PID of each angle to a torque, as in the stock code.")
    rate_hz: Rate = Field(200, description="Rate of all inner loops and of the simulation.")
    roll: TorqueGains = Field(description="Gains of roll.")
    pitch: TorqueGains = Field(description="Gains of pitch.")
    yaw: YawGains = Field(description="Gains of yaw.")
    integral_limit_rad_s: Limit = Field(description="Largest integral of the error of roll and pitch.")
    integral_leak_1_s: Gain = Field(0.0, description="Share of the integral that leaks per second.")


class CascadeGains(VehicleSection):
    """Gains of an axis: PID of the angle demands a body rate, PID of the rate adds to the motor commands."""

    p_1_s: Gain = Field(description="Demanded rate per angle error.")
    i_1_s2: Gain = Field(0.0, description="Demanded rate per rad s of the angle error's integral.")
    d: Gain = Field(0.0, description="Demanded rate per body rate, against it.")
    integral_limit_rad_s: Limit = Field(0.0, description="Largest integral of the angle error.")
    rate_p_s_rad: Gain = Field(description="Motor command per rad/s of rate error.")
    rate_i_1_rad: Gain = Field(0.0, description="Motor command per rad of the rate error's integral.")
    rate_d_s2_rad: Gain = Field(0.0, description="Motor command per rad/s^2 of rate change, against it.")
    rate_integral_limit_rad: Limit = Field(0.0, description="Largest integral of the rate error.")


class CascadeAttitude(VehicleSection):
    """A PID of each angle around a PID of each body rate, whose output is added to the motor commands."""

    kind: Literal["cascade"] = Field(description="PID of each angle around a PID of each body rate.")
    rate_hz: Rate = Field(description="Rate of all inner loops and of the simulation.")
    roll: CascadeGains = Field(description="Gains of roll.")
    pitch: CascadeGains = Field(description="Gains of pitch.")
    yaw: CascadeGains = Field(description="Gains of yaw.")
    rate_max_rad_s: Positive = Field(description="Largest demanded body rate.")
    output_max: Positive = Field(description="Largest motor command of one axis.")


class Response(VehicleSection):
    """The response of an angle to its command: angle = gain x command, late and with a lag."""

    gain: Annotated[float, Field(ge=0.1, le=3)] = Field(description="Steady angle over command.")
    lag_s: Lag = Field(description="Time constant of the first-order lag.")
    dead_time_s: Delay = Field(0.0, description="Time before a new command has any effect.")


class FirstOrderAttitude(VehicleSection):
    """A drone of whose code nothing is known: the response of its angles to commands, as a log shows it."""

    kind: Literal["first_order"] = Field(description="Gain, lag and dead time of each angle.")
    rate_hz: Rate = Field(200, description="Rate of the altitude loop and of the simulation.")
    roll: Response = Field(description="Response of roll.")
    pitch: Response = Field(description="Response of pitch.")
    yaw_lag_s: Lag = Field(0.2, description="Time constant of yaw, which follows its reference.")
    acceleration_per_tilt_g: Annotated[float, Field(ge=0.1, le=3)] = Field(
        1.0, description="Horizontal acceleration over that which the tilt of the log would give."
    )
    roll_trim_rad: Trim = Field(0.0, description="Reported roll at which the drone does not accelerate.")
    pitch_trim_rad: Trim = Field(0.0, description="Reported pitch at which the drone does not accelerate.")


class AltitudeGains(VehicleSection):
    """The altitude loop: thrust = weight + P height error - D vertical speed, within limits."""

    p_n_m: Gain = Field(description="Thrust per metre of height error.")
    d_n_s_m: Gain = Field(description="Thrust per m/s of vertical speed, against it.")
    thrust_max_n: Positive = Field(
        description="Largest demanded thrust; what it gives is more than the weight."
    )


class ThrustResponse(VehicleSection):
    """The response of the thrust to its demand: thrust = gain x demand, late and with a lag."""

    gain: Annotated[float, Field(ge=0.1, le=3)] = Field(
        1.0, description="Steady thrust over the demanded one."
    )
    lag_s: Lag = Field(description="Time constant of the first-order lag.")
    dead_time_s: Delay = Field(0.0, description="Time before a new demand has any effect.")


class Uncertainty(VehicleSection):
    """Half-widths of the 95 % intervals of the values that a log has shown; no flight reads them."""

    drag_1_s: HalfWidth | None = Field(None, description="That of body.drag_1_s.")
    roll_gain: HalfWidth | None = Field(None, description="That of attitude.roll.gain.")
    roll_lag_s: HalfWidth | None = Field(None, description="That of attitude.roll.lag_s.")
    roll_dead_time_s: HalfWidth | None = Field(None, description="That of attitude.roll.dead_time_s.")
    roll_split_s: HalfWidth | None = Field(
        None,
        description="Time of attitude.roll.lag_s that may be dead time, or the reverse.",
    )
    pitch_gain: HalfWidth | None = Field(None, description="That of attitude.pitch.gain.")
    pitch_lag_s: HalfWidth | None = Field(None, description="That of attitude.pitch.lag_s.")
    pitch_dead_time_s: HalfWidth | None = Field(None, description="That of attitude.pitch.dead_time_s.")
    pitch_split_s: HalfWidth | None = Field(
        None,
        description="Time of attitude.pitch.lag_s that may be dead time, or the reverse.",
    )
    acceleration_per_tilt_g: HalfWidth | None = Field(
        None, description="That of attitude.acceleration_per_tilt_g."
    )
    roll_trim_rad: HalfWidth | None = Field(None, description="That of attitude.roll_trim_rad.")
    pitch_trim_rad: HalfWidth | None = Field(None, description="That of attitude.pitch_trim_rad.")
    thrust_gain: HalfWidth | None = Field(None, description="That of thrust.gain.")
    thrust_lag_s: HalfWidth | None = Field(None, description="That of thrust.lag_s.")


FirmwareName = Literal["crazyflie"]
"""A firmware whose app `generate` writes."""


def _three_arms(value: object) -> object:
    """Return a place as a tuple; raises PydanticCustomError, one for all three numbers."""
    numbers = list(value) if isinstance(value, list | tuple) else []
    good = all(type(one) in (int, float) and abs(one) <= LONGEST_ARM_M for one in numbers)
    if len(numbers) != 3 or not good:
        limits = {"most": f"{LONGEST_ARM_M:g}"}
        raise PydanticCustomError("place", "must be 3 numbers, each in -{most}..{most}, in metres", limits)
    return tuple(map(float, numbers))


class PlacedSensors(VehicleSection):
    """What measures a position at one place of the drone."""

    lever_m: Annotated[tuple[Arm, Arm, Arm], BeforeValidator(_three_arms)] = Field(
        (0.0, 0.0, 0.0),
        description="Where the measured place lies from the centre of mass: forward, right, down.",
    )


class TrueState(PlacedSensors):
    """Controller and loops get the true state; a simulator gives it at `lever_m`."""

    kind: Literal["true"] = Field("true", description="No sensors: the true state.")


class MamboSensors(VehicleSection):
    """IMU, sonar, barometer and optical flow with the Mambo's stock estimators; variances of their noise."""

    kind: Literal["mambo"] = Field(description="IMU, sonar, barometer, optical flow, stock estimators.")
    accelerometer_xy_m2_s4: Noise = Field(description="Variance of the accelerometer along x and y.")
    accelerometer_z_m2_s4: Noise = Field(description="Variance of the accelerometer along z.")
    gyro_rad2_s2: Noise = Field(description="Variance of the gyro.")
    sonar_m2: Noise = Field(description="Variance of the sonar.")
    pressure_pa2: Noise = Field(description="Variance of the pressure.")


class MocapSensors(PlacedSensors):
    """Motion capture of the position, a filter for the velocity, and the drone's own attitude."""

    kind: Literal["mocap"] = Field(description="Position by motion capture, attitude by the drone.")
    position_rate_hz: Annotated[int, Field(ge=10, le=2000)] = Field(
        100, description="Positions per second; a divisor of attitude.rate_hz."
    )
    position_noise_m: Noise = Field(description="Standard deviation of a position along each axis.")
    position_delay_s: Delay = Field(0.0, description="Age of a position when it arrives.")
    velocity_filter_s: Annotated[float, Field(ge=0, le=1)] = Field(
        description="Time constant of the low-pass on the difference quotient of positions; 0 for none."
    )
    attitude_noise_rad: Noise = Field(description="Standard deviation of roll, pitch and yaw.")
    estimator: FirmwareName | None = Field(
        None,
        description="Firmware whose filter gets the positions, and flies on by its gyroscope: crazyflie. "
        "`design` then flies its app too; other commands fly the filter of velocity_filter_s.",
    )


class FlowDeckSensors(VehicleSection):
    """A Crazyflie's flow deck: optical flow and range to the floor; nothing measures where the drone is.

    The defaults are the errors of a hover at 1 m on the desk.
    """

    kind: Literal["flow-deck"] = Field("flow-deck", description="Optical flow and range, on a Crazyflie.")
    velocity_error_m_s: Noise = Field(
        0.034, description="Standard deviation of the velocity's error along x and y, which drift."
    )
    velocity_error_s: Annotated[float, Field(ge=0.05, le=10)] = Field(
        0.7, description="Correlation time of all errors."
    )
    height_error_m: Noise = Field(0.002, description="Standard deviation of the height's error.")


class AutopilotSensors(VehicleSection):
    """The estimator of an autopilot, whose velocity errs slowly."""

    kind: Literal["autopilot"] = Field("autopilot", description="The estimator of PX4 or ArduPilot.")
    velocity_error_m_s: Noise = Field(0.12, description="Standard deviation of the velocity's error.")
    velocity_error_s: Annotated[float, Field(ge=0.05, le=10)] = Field(
        0.7, description="Correlation time of that error; with it errors of the position fade."
    )


AnyAttitude = Annotated[MamboAttitude | CascadeAttitude | FirstOrderAttitude, Field(discriminator="kind")]
AnySensors = Annotated[
    TrueState | MamboSensors | MocapSensors | FlowDeckSensors | AutopilotSensors, Field(discriminator="kind")
]
