"""The stock estimators: attitude, altitude, velocity and position from readings, at 200 Hz for n flights.

The commands run its equal in C, `flight/engine/sensors.h`, which has the same bits.

Source: `estimatorVars` and the state estimator of the MathWorks asbQuadcopter example, R2018b to R2020a.
These releases leave the camera's rotation in the optical flow; later ones subtract it with the gyro, as
`derotated` does.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import arc_sine, arc_tangent, sine_cosine
from mambo_sil.drone.plant.rigid_body import to_body, to_world
from mambo_sil.drone.plant.vehicle import STEP_S, Seen
from mambo_sil.drone.sensors.instruments import PA_PER_M, SONAR_MIN_M, Instruments, Readings, Sensors

ACCELEROMETER_TAPS: Final = (0.02640772, 0.14053, 0.33306, 0.33306, 0.14053, 0.02640772)
"""FIR low-pass of the specific force before the attitude filter (order 5, cut-off 0.1 of 100 Hz)."""
TILT_WEIGHT: Final = 0.001
"""Weight of the accelerometer's tilt at each tick."""
TILT_GATE: Final = 0.002
"""The accelerometer corrects the tilt while its magnitude deviates from g by less than this share of g."""

ALTITUDE_NOISE: Final = (0.0005, 0.1)
"""Q, process noise of the velocity per tick in m^2/s^2; R, measurement noise of the sonar in m^2."""
SONAR_JUMP_M: Final = 0.3
"""Gate: largest accepted distance of the sonar reading from the estimate."""
PRESSURE_JUMP_M: Final = 0.8
"""Gate: the same for the low-passed barometer height."""
SLOW_JUMP_M: Final = 0.4
"""Gate: the same for the low-passed sonar height."""

LOW_PASS_A: Final = (-2.9371707284498907, 2.8762997234793319, -0.939098940325283)
LOW_PASS_B: Final = 3.7568380197861018e-06
"""Coefficients of the low-pass of sonar and barometer heights: Butterworth, third order, cut-off 1 Hz."""

VELOCITY_NOISE: Final = (0.09, 5.0)
"""Q, process noise per tick, and R, measurement noise of the optical flow, both in m^2/s^2."""
ACCELERATION_GAIN: Final = 0.2
"""Share of the measured acceleration that the velocity filter integrates."""
FLOW_TILT_RAD: Final = 0.6
FLOW_RATE_RAD_S: Final = 7.0
FLOW_SLOW_RAD_S: Final = 0.5
"""Below this rate the flow is accepted at any tilt."""
FLOW_JUMP_M_S: Final = 5.0
FLOW_MIN_HEIGHT_M: Final = 0.4


@lru_cache
def altitude_gains() -> tuple[float, float]:
    """Return the stationary Kalman gains of position and velocity (1/s); A = [1 Ts; 0 1], C = [1 0]."""
    q, r = ALTITUDE_NOISE
    pp, pv, vv = r, 0.0, r  # covariance of position and velocity
    for _ in range(20_000):  # the slowest mode decays by a factor of e in about 75 ticks
        kept = r / (pp + r)
        gain = pv / (pp + r)
        pp, pv, vv = kept * pp, kept * pv, vv - gain * pv
        pp, pv, vv = pp + 2.0 * STEP_S * pv + STEP_S * STEP_S * vv, pv + STEP_S * vv, vv + q
    return pp / (pp + r), pv / (pp + r)


def velocity_gain() -> float:
    """Return the stationary Kalman gain for A = 1, C = 1."""
    q, r = VELOCITY_NOISE
    variance = (q + math.sqrt(q * q + 4.0 * q * r)) / 2.0
    return variance / (variance + r)


class Attitude:
    """Complementary filter: integrates the rates and corrects roll and pitch by the accelerometer's tilt.

    The correction acts only while the smoothed specific force is close to g (`TILT_GATE`).
    """

    def __init__(self, euler_rad: FloatArray) -> None:
        self.euler_rad = euler_rad.copy()
        self.sines, self.cosines = sine_cosine(self.euler_rad)
        self._gate_m_s2 = TILT_GATE * GRAVITY_M_S2
        self._forces: list[FloatArray] = []

    def place(self, euler_rad: FloatArray, put: NDArray[np.bool_]) -> None:
        """Start again with the drones that are `put` (n,) elsewhere, at rest."""
        self.euler_rad = np.where(put, euler_rad, self.euler_rad)
        self.sines, self.cosines = sine_cosine(self.euler_rad)
        weight = np.zeros_like(euler_rad)
        weight[2] = -GRAVITY_M_S2
        at_rest = to_body(euler_rad, weight)
        self._forces = [np.where(put, at_rest, force) for force in self._forces]

    def shut_gate(self) -> None:
        """Correct the angles no more by the accelerometer, as noise does for most of a flight."""
        self._gate_m_s2 = 0.0

    def update(self, imu: FloatArray) -> None:
        """Advance the angles by one tick with specific force and rates (6, n)."""
        roll, pitch, yaw = self.euler_rad
        p, q, r = imu[3:]
        (sin_roll, sin_pitch, _), (cos_roll, cos_pitch, _) = self.sines, self.cosines
        yaw_rate = (sin_roll * q + cos_roll * r) / cos_pitch
        roll = roll + STEP_S * (p + sin_pitch * yaw_rate)
        pitch = pitch + STEP_S * (cos_roll * q - sin_roll * r)
        x, y, z = self._smooth(imu[:3])
        trusted = np.abs(np.sqrt(x * x + y * y + z * z) - GRAVITY_M_S2) < self._gate_m_s2
        if trusted.any():
            force_roll = arc_tangent(y / z)
            force_pitch = arc_sine(np.clip(x / GRAVITY_M_S2, -1.0, 1.0))
            roll = np.where(trusted, (1.0 - TILT_WEIGHT) * roll + TILT_WEIGHT * force_roll, roll)
            pitch = np.where(trusted, (1.0 - TILT_WEIGHT) * pitch + TILT_WEIGHT * force_pitch, pitch)
        self.euler_rad = np.stack([roll, pitch, yaw + STEP_S * yaw_rate])
        self.sines, self.cosines = sine_cosine(self.euler_rad)

    def _smooth(self, force: FloatArray) -> FloatArray:
        earlier = self._forces or [force] * len(ACCELEROMETER_TAPS)
        self._forces = [force, *earlier[:-1]]
        smooth = ACCELEROMETER_TAPS[0] * self._forces[0]
        for tap, before in zip(ACCELEROMETER_TAPS[1:], self._forces[1:], strict=True):
            smooth = smooth + tap * before
        return smooth


class _LowPass:
    """Butterworth low-pass of third order, cut-off 1 Hz, in steady state with its first input."""

    def __init__(self, start: FloatArray) -> None:
        self._state = [start / (8.0 * LOW_PASS_B)] * 3

    def place(self, start: FloatArray, put: NDArray[np.bool_]) -> None:
        """Start again in the flights that are `put` (n,)."""
        self._state = [np.where(put, start / (8.0 * LOW_PASS_B), one) for one in self._state]

    def update(self, value: FloatArray) -> FloatArray:
        """Return the output at this tick for the input at this tick."""
        first, second, third = self._state
        a1, a2, a3 = LOW_PASS_A
        now = value - a1 * first - a2 * second - a3 * third
        self._state = [now, first, second]
        return np.asarray(LOW_PASS_B * (now + 3.0 * first + 3.0 * second + third))


class Altitude:
    """Kalman filter of z and its rate, driven by the vertical acceleration and corrected by the sonar.

    A sonar reading is accepted if it is above the sonar's least height and near the estimate, and if the
    low-passed pressure or the low-passed sonar is near the estimate, too.
    """

    def __init__(self, z_m: FloatArray, velocity_m_s: FloatArray) -> None:
        self.z_m, self.velocity_m_s = z_m.copy(), velocity_m_s.copy()
        self._predicted = self.z_m, self.velocity_m_s
        self._gains = altitude_gains()
        self._low_pass = _LowPass(np.stack([z_m, z_m]))

    def place(self, z_m: FloatArray, velocity_m_s: FloatArray, put: NDArray[np.bool_]) -> None:
        """Start again with the drones that are `put` (n,) elsewhere."""
        self.z_m = np.where(put, z_m, self.z_m)
        self.velocity_m_s = np.where(put, velocity_m_s, self.velocity_m_s)
        pairs = zip((z_m, velocity_m_s), self._predicted, strict=True)
        predicted_m, predicted_m_s = (np.where(put, fresh, one) for fresh, one in pairs)
        self._predicted = predicted_m, predicted_m_s
        self._low_pass.place(np.stack([z_m, z_m]), put)

    def update(self, readings: Readings, acceleration_m_s2: FloatArray) -> None:
        """Correct with the readings; predict the next tick with the acceleration (n,) along world z."""
        sonar = -readings.sonar_m
        slow_pressure, slow_sonar = self._low_pass.update(np.stack([readings.pressure_pa / PA_PER_M, sonar]))
        accepted = (
            (np.abs(self.z_m - sonar) <= SONAR_JUMP_M)
            & (sonar < -SONAR_MIN_M)
            & (
                (np.abs(slow_pressure - self.z_m) < PRESSURE_JUMP_M)
                | (np.abs(slow_sonar - self.z_m) < SLOW_JUMP_M)
            )
        )
        z_m, velocity_m_s = self._predicted
        innovation = np.where(accepted, sonar - z_m, 0.0)
        self.z_m = z_m + self._gains[0] * innovation
        self.velocity_m_s = velocity_m_s + self._gains[1] * innovation
        self._predicted = (
            self.z_m + STEP_S * self.velocity_m_s,
            self.velocity_m_s + STEP_S * acceleration_m_s2,
        )


class Velocity:
    """Kalman filter of the velocity along body x and y, driven by a share of the acceleration."""

    def __init__(self, velocity_m_s: FloatArray, *, derotated: bool) -> None:
        self._derotated = derotated
        self.velocity_m_s = velocity_m_s.copy()
        self._predicted = self.velocity_m_s
        self._gain = velocity_gain()

    def place(self, velocity_m_s: FloatArray, put: NDArray[np.bool_]) -> None:
        """Start again with the drones that are `put` (n,) elsewhere."""
        self.velocity_m_s = np.where(put, velocity_m_s, self.velocity_m_s)
        self._predicted = np.where(put, velocity_m_s, self._predicted)

    def update(
        self, readings: Readings, tilt_rad: FloatArray, z_m: FloatArray, acceleration_m_s2: FloatArray
    ) -> None:
        """Correct with the optical flow if it passes the gates; predict with the acceleration (2, n)."""
        tilt, rates = np.abs(tilt_rad).max(axis=0), np.abs(readings.imu[3:5]).max(axis=0)
        jump = np.abs(readings.flow_m_s - self.velocity_m_s).max(axis=0)
        accepted = (
            (((tilt <= FLOW_TILT_RAD) & (rates <= FLOW_RATE_RAD_S)) | (rates <= FLOW_SLOW_RAD_S))
            & (jump <= FLOW_JUMP_M_S)
            & (z_m <= -FLOW_MIN_HEIGHT_M)
        )
        flow_m_s = readings.flow_m_s
        if self._derotated:
            p, q = readings.imu[3:5]
            flow_m_s = flow_m_s + z_m * np.stack([q, -p])
        innovation = np.where(accepted, flow_m_s - self._predicted, 0.0)
        self.velocity_m_s = self._predicted + self._gain * innovation
        self._predicted = self.velocity_m_s + STEP_S * ACCELERATION_GAIN * acceleration_m_s2


class Suite:
    """Instruments and estimators of n flights; the estimates start from the true state."""

    def __init__(self, sensors: Sensors, seeds: Sequence[int], start: Seen) -> None:
        self._instruments = Instruments(sensors, seeds, start)
        self._attitude = Attitude(start.euler_rad)
        self._altitude = Altitude(start.position_m[2], start.velocity_m_s[2])
        velocity_m_s = to_body(start.euler_rad, start.velocity_m_s)[:2]
        self._velocity = Velocity(velocity_m_s, derotated=sensors.derotated)
        self._position_m = start.position_m[:2].copy()

    def place(self, start: Seen, put: NDArray[np.bool_]) -> None:
        """Start again with the drones that are `put` (n,) elsewhere, at rest."""
        self._instruments.place(start, put)
        self._attitude.place(start.euler_rad, put)
        self._altitude.place(start.position_m[2], start.velocity_m_s[2], put)
        self._velocity.place(to_body(start.euler_rad, start.velocity_m_s)[:2], put)
        self._position_m = np.where(put, start.position_m[:2], self._position_m)

    def shut_gate(self) -> None:
        """Correct roll and pitch no more by the accelerometer, as noise does for most of a flight."""
        self._attitude.shut_gate()

    def estimate(self, true: Seen) -> Seen:
        """Return the estimate that the controllers receive at this tick; call it once per tick of 5 ms."""
        readings = self._instruments.read(true)
        self._attitude.update(readings.imu)
        sines, cosines = self._attitude.sines, self._attitude.cosines
        force = to_world(sines, cosines, readings.imu[:3])
        self._altitude.update(readings, force[2] + GRAVITY_M_S2)
        force_x, force_y = readings.imu[:2]
        gravity_x, gravity_y = -GRAVITY_M_S2 * sines[1], GRAVITY_M_S2 * sines[0] * cosines[1]
        self._velocity.update(
            readings,
            self._attitude.euler_rad[:2],
            self._altitude.z_m,
            np.stack([force_x + gravity_x, force_y + gravity_y]),
        )
        velocity_z = self._altitude.velocity_m_s
        velocity_m_s = to_world(sines, cosines, np.stack([*self._velocity.velocity_m_s, velocity_z]))
        velocity_m_s[2] = velocity_z
        position_m = np.stack([*self._position_m, self._altitude.z_m])
        self._position_m = self._position_m + STEP_S * velocity_m_s[:2]
        return Seen(position_m, velocity_m_s, self._attitude.euler_rad, readings.imu[3:])
