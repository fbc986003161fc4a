"""The instruments of the Mambo: IMU, sonar, pressure and optical flow, sampled at 200 Hz for n flights.

Sources: `sensorsVars` of the MathWorks asbQuadcopter example, R2018b to R2020a; noise variances of the MIT
RollingSpiderEdu toolbox. Readings stand in the body frame (NED axes): an accelerometer at rest reads -g in z.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_nmpc.sil.plant.airframe import GRAVITY_M_S2
from mambo_nmpc.sil.plant.arrays import FloatArray, PerFlight
from mambo_nmpc.sil.plant.randomness import Draws, Purpose
from mambo_nmpc.sil.plant.rigid_body import to_body
from mambo_nmpc.sil.plant.vehicle import STEP_S, Seen

Three = tuple[PerFlight, PerFlight, PerFlight]

IMU_RAD_S: Final = 190.0
IMU_DAMPING: Final = 0.707
ACCELEROMETER_LIMIT_M_S2: Final = 50.0
GYRO_LIMIT_RAD_S: Final = 10.0

NOISE_VARIANCES: Final = (0.3, 0.3, 0.5, 0.002, 0.002, 0.002, 0.001, 50.0)
"""Of accelerometer x y z in m^2/s^4, gyro x y z in rad^2/s^2, sonar in m^2, pressure in Pa^2."""

SONAR_LEAST_M: Final = 0.44
PA_PER_M: Final = 12.01725
"""Fall of the pressure with the height: 9.81 m/s^2 times 1.225 kg/m^3."""

FLOW_COUPLING: Final = 0.8
"""Share of the rotation of the camera that the optical flow takes for motion."""
FLOW_EVERY: Final = (3, 10)
"""Images in so many ticks: 60 Hz beside 200 Hz."""

DELAY_TICKS: Final = 1
"""By which all readings come late."""


@dataclass(frozen=True, eq=False)
class Sensors:
    """What differs between the sensors of n flights, one value for all or one for each (n,).

    The stock code measures the biases of the IMU at rest before it takes off and subtracts them; the biases
    here are what that leaves over.
    """

    noise_scale: PerFlight = 1.0
    """Factor on the standard deviation of every reading's noise; 0 is noise-free."""
    accelerometer_bias_m_s2: Three = (0.0, 0.0, 0.0)
    gyro_bias_rad_s: Three = (0.0, 0.0, 0.0)
    derotated: bool = False
    """Whether the estimator takes the rotation out of the optical flow; the same for all flights."""


@dataclass(frozen=True, eq=False)
class Readings:
    """What the instruments of n flights say at one tick."""

    imu: FloatArray
    """Specific force in m/s^2 and rates in rad/s (6, n)."""
    sonar_m: FloatArray
    """Height (n,); `SONAR_LEAST_M` for what is below."""
    pressure_pa: FloatArray
    """Pressure over that of the ground (n,)."""
    flow_m_s: FloatArray
    """Velocity along body x and y that the optical flow suggests (2, n), held between images."""


class Instruments:
    """The instruments of n flights, which remember a few ticks."""

    def __init__(self, sensors: Sensors, seeds: Sequence[int], start: Seen) -> None:
        flights = len(seeds)
        self._draws = Draws(seeds, Purpose.SENSORS, len(NOISE_VARIANCES))
        deviations = np.sqrt(np.array(NOISE_VARIANCES))[:, np.newaxis]
        self._noise = deviations * np.broadcast_to(np.asarray(sensors.noise_scale, np.float64), flights)
        biases = (*sensors.accelerometer_bias_m_s2, *sensors.gyro_bias_rad_s)
        self._bias = np.stack([np.broadcast_to(np.asarray(bias, np.float64), flights) for bias in biases])
        self._from_state, self._from_input = _second_order(STEP_S)
        self._velocity_m_s = start.velocity_m_s
        self._felt = self._feel(start)
        self._imu = np.stack([self._felt, np.zeros_like(self._felt)])
        self._flow_m_s = _flow(start)
        self._tick = 0
        self._late: list[Readings] = []

    def read(self, true: Seen) -> Readings:
        """Return the readings of this tick, which are `DELAY_TICKS` old."""
        felt = self._feel(true)
        mean = 0.5 * (self._felt + felt)
        self._felt, self._velocity_m_s = felt, true.velocity_m_s
        value, rate = self._imu
        ((stay, drift), (pull, keep)), (gain, push) = self._from_state, self._from_input
        self._imu = np.stack(
            [stay * value + drift * rate + gain * mean, pull * value + keep * rate + push * mean]
        )
        noise = self._noise * self._draws.next()
        imu = self._imu[0] + self._bias + noise[:6]
        images, ticks = FLOW_EVERY
        if images * self._tick // ticks != images * (self._tick - 1) // ticks:
            self._flow_m_s = _flow(true)
        self._tick += 1
        height_m = -true.position_m[2]
        self._late.append(
            Readings(
                imu=np.clip(imu, -_LIMITS, _LIMITS),
                sonar_m=np.maximum(height_m + noise[6], SONAR_LEAST_M),
                pressure_pa=noise[7] - PA_PER_M * height_m,
                flow_m_s=self._flow_m_s,
            )
        )
        return self._late.pop(0) if len(self._late) > DELAY_TICKS else self._late[0]

    def _feel(self, true: Seen) -> FloatArray:
        """Return the mean specific force since the last tick, in the body axes of now, and the rates."""
        force = (true.velocity_m_s - self._velocity_m_s) / STEP_S
        force[2] -= GRAVITY_M_S2
        return np.concatenate([to_body(true.euler_rad, force), true.rates_rad_s])


_LIMITS: Final = np.array([[ACCELEROMETER_LIMIT_M_S2]] * 3 + [[GYRO_LIMIT_RAD_S]] * 3)


def _flow(true: Seen) -> FloatArray:
    """Return the flow (2, n): body velocity, and what the turning camera adds in proportion to the height."""
    body_m_s = to_body(true.euler_rad, true.velocity_m_s)[:2]
    p, q, _ = true.rates_rad_s
    z = true.position_m[2]
    turning = np.stack([-q, p])
    return np.asarray(body_m_s + FLOW_COUPLING * z * turning)


def _second_order(
    step_s: float,
) -> tuple[tuple[tuple[float, float], tuple[float, float]], tuple[float, float]]:
    """Return what value and rate of y'' = w^2 (u - y) - 2 d w y' a step later have of (y, y'), and of u."""
    decay, turn = IMU_DAMPING * IMU_RAD_S, IMU_RAD_S * math.sqrt(1.0 - IMU_DAMPING**2)
    fade = math.exp(-decay * step_s)
    sine, cosine = fade * math.sin(turn * step_s), fade * math.cos(turn * step_s)
    stay = cosine + decay / turn * sine
    pull = -(IMU_RAD_S**2) / turn * sine
    return ((stay, sine / turn), (pull, cosine - decay / turn * sine)), (1.0 - stay, -pull)
