"""The laws without a model with which the NMPC is compared: the paper's PD, and two with feed-forward.

The commands run its equal in C, `flight/engine/pd.c`, which has the same bits.

`PdController` is the stock PD position controller of the Mambo, the paper's baseline. Source: block "XY to
angles" of the MathWorks asbQuadcopter example; Kp = 0.24, Kd = 0.1 as in the paper (section III), after
Pounds et al. It neither knows that the target moves nor that it turns.

`PdFeedForwardController` does. `PidFeedForwardController` adds all that helps without a model: integral,
feed-forward of the jerk, low-pass and feedback of the tilt. Source of their gains: the search in
benchmarks/gains/feedforward.py.
"""

from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.toml_file import parse_document
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import sine_cosine
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.names import PdName

POSITION_P_RAD_M = 0.24
POSITION_D_RAD_S_M = 0.1
ERROR_LIMIT_M = 3.0


@dataclass(frozen=True, eq=False)
class PdOutcome:
    """Result of one step: `command_rad` (n, 2), roll and pitch, and `status` (n,), always 0."""

    command_rad: FloatArray
    status: NDArray[np.int64]


class PdController:
    """Tilt = P x position error - D x velocity, in body axes.

    The error is clamped per axis, the tilt is not; the target's velocity is ignored.
    """

    def step(
        self,
        state: FloatArray,
        target: FloatArray,
        thrust_acceleration_m_s2: FloatArray,  # noqa: ARG002 - part of the interface
    ) -> PdOutcome:
        """Return the commands for states (n, 7) and targets (n, 4) in the world frame.

        The columns are [x, y, vx, vy, roll, pitch, yaw] and [x, y, vx, vy] in m, m/s and rad.
        """
        sine, cosine = sine_cosine(state[:, 6])
        error_x, error_y = target[:, 0] - state[:, 0], target[:, 1] - state[:, 1]
        velocity_x, velocity_y = state[:, 2], state[:, 3]
        forward = np.clip(cosine * error_x + sine * error_y, -ERROR_LIMIT_M, ERROR_LIMIT_M)
        right = np.clip(cosine * error_y - sine * error_x, -ERROR_LIMIT_M, ERROR_LIMIT_M)
        command_rad = np.empty((len(state), 2))
        command_rad[:, 0] = POSITION_P_RAD_M * right - POSITION_D_RAD_S_M * (
            cosine * velocity_y - sine * velocity_x
        )
        command_rad[:, 1] = POSITION_D_RAD_S_M * (cosine * velocity_x + sine * velocity_y) - (
            POSITION_P_RAD_M * forward
        )
        return PdOutcome(command_rad, np.zeros(len(state), dtype=np.int64))


@dataclass(frozen=True)
class PdGains:
    """Gains of the PD with feed-forward.

    position_rad_m:        tilt per position error.
    velocity_rad_s_m:      tilt per velocity error.
    acceleration_rad_s2_m: tilt per acceleration of the target; 1/g for a drone without lag.
    """

    position_rad_m: float
    velocity_rad_s_m: float
    acceleration_rad_s2_m: float


GAINS: Final = PdGains(0.436, 0.357, 0.0905)
TILT_LIMIT_RAD: Final = 0.35
"""The tilt limit of the presets."""


def _limited(tilt_x: FloatArray, tilt_y: FloatArray, sine: FloatArray, cosine: FloatArray) -> PdOutcome:
    """Return tilts (n,) along x and y of the world as commands in body axes, clamped."""
    command_rad = np.stack([cosine * tilt_y - sine * tilt_x, -(cosine * tilt_x + sine * tilt_y)], axis=-1)
    limited_rad = np.clip(command_rad, -TILT_LIMIT_RAD, TILT_LIMIT_RAD)
    return PdOutcome(limited_rad, np.zeros(len(limited_rad), dtype=np.int64))


class PdFeedForwardController:
    """Tilt = P x position error + D x velocity error + A x target acceleration, in body axes, clamped.

    Position and velocity errors are those to the moving target, whose acceleration is given.
    """

    def __init__(self, gains: PdGains = GAINS) -> None:
        self.gains = gains

    def step(
        self,
        state: FloatArray,
        target: FloatArray,
        thrust_acceleration_m_s2: FloatArray,  # noqa: ARG002 - part of the interface
    ) -> PdOutcome:
        """Return the commands for states (n, 7) and targets (n, 9), or with a height."""
        gains = self.gains
        sine, cosine = sine_cosine(state[:, 6])
        tilt_x, tilt_y = (
            gains.position_rad_m * (target[:, axis] - state[:, axis])
            + gains.velocity_rad_s_m * (target[:, 2 + axis] - state[:, 2 + axis])
            + gains.acceleration_rad_s2_m * target[:, 4 + axis]
            for axis in (0, 1)
        )
        return _limited(tilt_x, tilt_y, sine, cosine)


@dataclass(frozen=True)
class PidGains(PdGains):
    """Gains of the PID with feed-forward: the gains of the PD, and these.

    jerk_rad_s3_m:    tilt per jerk of the target.
    integral_rad_m_s: tilt per integral of the position error.
    tilt_feedback:    share by which the tilt is corrected for what the measured tilt lacks.
    low_pass_s:       time constant of the low-pass behind the sum.
    """

    jerk_rad_s3_m: float
    integral_rad_m_s: float
    tilt_feedback: float
    low_pass_s: float


INTEGRAL_LIMIT_RAD: Final = 0.15
"""Limit of the integral, per axis."""
INTEGRATED_ERROR_M: Final = 0.6
"""With an error of this size along any axis the integral rests."""
JERK_LIMIT_M_S3: Final = 20.0
"""A faster change is a jump of the target, which has no feed-forward."""


@lru_cache
def pid_gains() -> dict[str, PidGains]:
    """Return the tuned gains of the PID with feed-forward by shipped drone."""
    file = resources.files("mambo_sil.flight").joinpath("data", "gains", "pid-feedforward.toml")
    gains = parse_document(file.read_text("utf-8"), file.name)
    return {drone: PidGains(**values) for drone, values in gains.items()}


class PidFeedForwardController:
    """n controllers: the PD with feed-forward, with integral, jerk, tilt feedback and low-pass.

    Per axis of the world:

        tilt = P x position error + D x velocity error + A x target acceleration + J x target jerk
               + integral - K x (measured tilt - target acceleration / g - integral)

    then the low-pass, body axes, and the clamp. The jerk is the change of the target's acceleration since the
    last update. The integral rests while an error is large or the tilt exceeds its limit. A state with NaN
    changes no memory.
    """

    def __init__(self, gains: PidGains, n: int = 1, update_period_s: float = 0.01) -> None:
        self.gains, self.n, self.update_period_s = gains, n, update_period_s
        self._integral_rad = np.zeros((n, 2))
        self._acceleration_m_s2 = np.full((n, 2), np.nan)
        self._tilt_rad = np.zeros((n, 2))

    @property
    def low_pass_share(self) -> float:
        """The share of a change that passes the low-pass in one update."""
        return self.update_period_s / (self.gains.low_pass_s + self.update_period_s)

    def step(
        self,
        state: FloatArray,
        target: FloatArray,
        thrust_acceleration_m_s2: FloatArray,  # noqa: ARG002 - part of the interface
    ) -> PdOutcome:
        """Return the commands for states (n, 7) and targets (n, 9), or with a height."""
        sine, cosine = sine_cosine(state[:, 6])
        roll, pitch = state[:, 4], state[:, 5]
        measured_rad = np.stack([-(cosine * pitch + sine * roll), cosine * roll - sine * pitch], axis=-1)
        error_m, acceleration_m_s2 = target[:, :2] - state[:, :2], target[:, 4:6]
        tilt_rad = self._sum(error_m, target[:, 2:4] - state[:, 2:4], acceleration_m_s2, measured_rad)
        known = ~np.isnan(tilt_rad[:, 0] + tilt_rad[:, 1])
        self._integrate(error_m, tilt_rad)
        passed_rad = self._tilt_rad + self.low_pass_share * (tilt_rad - self._tilt_rad)
        self._tilt_rad = np.where(known[:, np.newaxis], passed_rad, self._tilt_rad)
        self._acceleration_m_s2 = np.where(known[:, np.newaxis], acceleration_m_s2, self._acceleration_m_s2)
        tilt_x, tilt_y = self._tilt_rad.T
        return _limited(tilt_x, tilt_y, sine, cosine)

    def _sum(
        self,
        error_m: FloatArray,
        velocity_error_m_s: FloatArray,
        acceleration_m_s2: FloatArray,
        measured_rad: FloatArray,
    ) -> FloatArray:
        """Return the tilts (n, 2) before the low-pass; all arguments are (n, 2), in axes of the world."""
        gains, integral_rad = self.gains, self._integral_rad
        change = (acceleration_m_s2 - self._acceleration_m_s2) / self.update_period_s
        jerk_m_s3 = np.where(np.abs(change) <= JERK_LIMIT_M_S3, change, 0.0)
        wanted_rad = (
            gains.position_rad_m * error_m
            + gains.velocity_rad_s_m * velocity_error_m_s
            + gains.acceleration_rad_s2_m * acceleration_m_s2
            + gains.jerk_rad_s3_m * jerk_m_s3
            + integral_rad
        )
        excess_rad = measured_rad - acceleration_m_s2 / GRAVITY_M_S2 - integral_rad
        return np.asarray(wanted_rad - gains.tilt_feedback * excess_rad)

    def _integrate(self, error_m: FloatArray, tilt_rad: FloatArray) -> None:
        """Add the errors (n, 2) to the integral where they and the tilts (n, 2) are small, and not NaN."""
        near = (np.abs(error_m) < INTEGRATED_ERROR_M).all(axis=1)
        tilt_x, tilt_y = tilt_rad.T
        free = tilt_x * tilt_x + tilt_y * tilt_y < TILT_LIMIT_RAD * TILT_LIMIT_RAD
        grown_rad = self._integral_rad + self.update_period_s * (self.gains.integral_rad_m_s * error_m)
        grown_rad = np.clip(grown_rad, -INTEGRAL_LIMIT_RAD, INTEGRAL_LIMIT_RAD)
        self._integral_rad = np.where((near & free)[:, np.newaxis], grown_rad, self._integral_rad)


AnyPd = PdController | PdFeedForwardController | PidFeedForwardController
"""The laws without a model."""


def pd_controller(name: PdName, flight: Flight) -> AnyPd:
    """Return the controllers called `name` for a flight.

    The PID has the gains of the flight's drone, or of `mambo` if there are none for it.
    """
    match name:
        case "pd":
            return PdController()
        case "pd-feedforward":
            return PdFeedForwardController()
        case "pid-feedforward":
            tuned = pid_gains()
            gains = tuned.get(flight.vehicle.drone.name, tuned[vehicle_toml.DEFAULT])
            return PidFeedForwardController(gains, flight.flights, flight.update_period_s)
