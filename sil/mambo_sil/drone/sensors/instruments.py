"""The instruments of the Mambo: IMU, sonar, barometer and optical flow, sampled at 200 Hz for n flights.

The commands run its equal in C, `flight/engine/sensors.h`, which has the same bits.

Sources: `sensorsVars` of the MathWorks asbQuadcopter example, R2018b to R2020a; noise variances of the MIT
RollingSpiderEdu toolbox. IMU readings are in the body frame: at rest the accelerometer reads -g in z.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, cast

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.elementary import exponential, sine_cosine
from mambo_sil.drone.plant.randomness import Draws, Purpose
from mambo_sil.drone.plant.rigid_body import to_body
from mambo_sil.drone.plant.vehicle import STEP_S, Seen
from mambo_sil.drone.vehicles.vehicle_sections import MamboSensors

Three = tuple[PerFlight, PerFlight, PerFlight]

IMU_RAD_S: Final = 190.0
IMU_DAMPING: Final = 0.707
ACCELEROMETER_LIMIT_M_S2: Final = 50.0
GYRO_LIMIT_RAD_S: Final = 10.0

NOISES: Final = 8
"""Random numbers of a tick: accelerometer x, y, z, gyro x, y, z, sonar, pressure."""

SONAR_MIN_M: Final = 0.44
"""Lower end of the sonar's range."""
PA_PER_M: Final = 12.01725
"""Decrease of the pressure per metre of height: 9.81 m/s^2 times 1.225 kg/m^3."""

FLOW_COUPLING: Final = 0.8
"""Share of the camera's rotation that the optical flow misreads as translation."""
FLOW_IMAGES_PER_TICKS: Final = (3, 10)
"""3 images in 10 ticks: 60 Hz at 200 ticks a second."""

DELAY_TICKS: Final = 1
"""Delay of all readings."""


_NOMINAL: Final = cast(MamboSensors, NOMINAL.sensors)


@dataclass(frozen=True, eq=False)
class Sensors:
    """Parameters of the sensors of n flights, one value for all or an array (n,).

    The stock code measures the biases of the IMU at rest before take-off and subtracts them; the biases here
    are the residual ones.
    """

    noise_scale: PerFlight = 1.0
    """Factor on the standard deviation of all noise; 0 is noise-free."""
    accelerometer_bias_m_s2: Three = (0.0, 0.0, 0.0)
    gyro_bias_rad_s: Three = (0.0, 0.0, 0.0)
    derotated: bool = False
    """Whether the estimator subtracts the rotation from the optical flow; the same for all flights."""
    figures: MamboSensors = _NOMINAL
    """Variances of the noise."""


@dataclass(frozen=True, eq=False)
class Readings:
    """Readings of the instruments of n flights at one tick."""

    imu: FloatArray
    """Specific force in m/s^2 and body rates in rad/s (6, n)."""
    sonar_m: FloatArray
    """Height (n,), saturated at `SONAR_MIN_M` from below."""
    pressure_pa: FloatArray
    """Pressure relative to that at the ground (n,)."""
    flow_m_s: FloatArray
    """Velocity along body x and y from the optical flow (2, n), held between images."""


def noise_deviations(sensors: Sensors, flights: int) -> FloatArray:
    """Return the standard deviations of the noise (8, n), in the order of `NOISES`."""
    figures = sensors.figures
    xy, gyro = figures.accelerometer_xy_m2_s4, figures.gyro_rad2_s2
    imu = (xy, xy, figures.accelerometer_z_m2_s4, gyro, gyro, gyro)
    deviations = np.sqrt(np.array([*imu, figures.sonar_m2, figures.pressure_pa2]))[:, np.newaxis]
    return np.asarray(deviations * np.broadcast_to(np.asarray(sensors.noise_scale, np.float64), flights))


class Instruments:
    """The instruments of n flights; call `read` once per tick."""

    def __init__(self, sensors: Sensors, seeds: Sequence[int], start: Seen) -> None:
        flights = len(seeds)
        self._draws = Draws(seeds, Purpose.SENSORS, NOISES)
        self._noise = noise_deviations(sensors, flights)
        biases = (*sensors.accelerometer_bias_m_s2, *sensors.gyro_bias_rad_s)
        self._bias = np.stack([np.broadcast_to(np.asarray(bias, np.float64), flights) for bias in biases])
        self._transition, self._input_gain = discretize_imu(STEP_S)
        self._velocity_m_s = start.velocity_m_s
        self._motion = self._measure_motion(start)
        self._imu = np.stack([self._motion, np.zeros_like(self._motion)])
        self._flow_m_s = _measure_flow(start)
        self._tick = 0
        self._delayed: list[Readings] = []

    def place(self, start: Seen, put: NDArray[np.bool_]) -> None:
        """Measure from now on the drones that are `put` (n,) elsewhere, at rest."""
        self._velocity_m_s = np.where(put, start.velocity_m_s, self._velocity_m_s)
        motion, height_m = self._measure_motion(start), -start.position_m[2]
        self._motion = np.where(put, motion, self._motion)
        self._imu = np.where(put, np.stack([motion, np.zeros_like(motion)]), self._imu)
        self._flow_m_s = np.where(put, _measure_flow(start), self._flow_m_s)
        sonar_m, pressure_pa = np.maximum(height_m, SONAR_MIN_M), -PA_PER_M * height_m
        self._delayed = [
            Readings(
                imu=np.where(put, motion + self._bias, one.imu),
                sonar_m=np.where(put, sonar_m, one.sonar_m),
                pressure_pa=np.where(put, pressure_pa, one.pressure_pa),
                flow_m_s=np.where(put, self._flow_m_s, one.flow_m_s),
            )
            for one in self._delayed
        ]

    def read(self, true: Seen) -> Readings:
        """Return the readings that reach the estimators at this tick, measured `DELAY_TICKS` earlier."""
        motion = self._measure_motion(true)
        mean = 0.5 * (self._motion + motion)
        self._motion, self._velocity_m_s = motion, true.velocity_m_s
        value, rate = self._imu
        ((a00, a01), (a10, a11)), (b0, b1) = self._transition, self._input_gain
        self._imu = np.stack([a00 * value + a01 * rate + b0 * mean, a10 * value + a11 * rate + b1 * mean])
        noise = self._noise * self._draws.next()
        imu = self._imu[0] + self._bias + noise[:6]
        images, ticks = FLOW_IMAGES_PER_TICKS
        if images * self._tick // ticks != images * (self._tick - 1) // ticks:
            self._flow_m_s = _measure_flow(true)
        self._tick += 1
        height_m = -true.position_m[2]
        self._delayed.append(
            Readings(
                imu=np.clip(imu, -IMU_LIMITS, IMU_LIMITS),
                sonar_m=np.maximum(height_m + noise[6], SONAR_MIN_M),
                pressure_pa=noise[7] - PA_PER_M * height_m,
                flow_m_s=self._flow_m_s,
            )
        )
        return self._delayed.pop(0) if len(self._delayed) > DELAY_TICKS else self._delayed[0]

    def _measure_motion(self, true: Seen) -> FloatArray:
        """Return (6, n): mean specific force since the last tick, in current body axes, and body rates."""
        force = (true.velocity_m_s - self._velocity_m_s) / STEP_S
        force[2] -= GRAVITY_M_S2
        return np.concatenate([to_body(true.euler_rad, force), true.rates_rad_s])


IMU_LIMITS: Final = np.array([[ACCELEROMETER_LIMIT_M_S2]] * 3 + [[GYRO_LIMIT_RAD_S]] * 3)
"""Largest magnitudes of specific force and body rates (6, 1)."""


def _measure_flow(true: Seen) -> FloatArray:
    """Return the optical flow (2, n): body velocity plus a share of camera rotation times height."""
    body_m_s = to_body(true.euler_rad, true.velocity_m_s)[:2]
    p, q, _ = true.rates_rad_s
    z = true.position_m[2]
    rotation = np.stack([-q, p])
    return np.asarray(body_m_s + FLOW_COUPLING * z * rotation)


def discretize_imu(
    step_s: float,
) -> tuple[tuple[tuple[float, float], tuple[float, float]], tuple[float, float]]:
    """Return transition matrix and input gain of y'' = w^2 (u - y) - 2 d w y', state (y, y'), u held."""
    decay, frequency = IMU_DAMPING * IMU_RAD_S, IMU_RAD_S * math.sqrt(1.0 - IMU_DAMPING * IMU_DAMPING)
    envelope = exponential(-decay * step_s)
    sine, cosine = (float(envelope * value) for value in sine_cosine(frequency * step_s))
    a00 = cosine + decay / frequency * sine
    a10 = -(IMU_RAD_S * IMU_RAD_S) / frequency * sine
    return ((a00, sine / frequency), (a10, cosine - decay / frequency * sine)), (1.0 - a00, -a10)
