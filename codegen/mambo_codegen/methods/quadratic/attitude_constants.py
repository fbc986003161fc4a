"""Constants of the attitude model: how the accelerations of roll and pitch follow their commands.

Along right and forward, the axes of the heading, let u be the commanded acceleration, a that of the tilt, c
the command behind the dead time, and i the integral part of the attitude loop, all in m/step^2, where a step
is an update period:

    lag a'   = c - a + i
    i'       = integral (u - a) - i / 1000 s
    delay c' = u - c

A command held over a step gives the constants below. All arithmetic has 40 digits; constants are rounded to
float64 once.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.riccati import Matrix, hold, mp
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.sections import Damping, Model, Sections

_LEAK_1_S: Final = "0.001"
"""The integral part decays at this rate, so that a loop that never answers has a bounded model."""

_SETTLING: Final = 42
"""Lags after which what decays with at least half their rate is below 1e-9."""


@dataclass(frozen=True)
class AttitudeLoop:
    """The loop of roll or pitch, in seconds; `integral_1_s` is its integral gain over its angle gain."""

    lag_s: Any
    delay_s: Any
    integral_1_s: Any

    def rates(self, period_s: Any) -> tuple[Matrix, Matrix]:
        """Return the rates (3, 3) of [a, i / integral, c] and of the command (3, 1), in 1/s.

        Without a delay a follows the command itself, and c, which nothing reads, follows within a period.
        """
        prompt = self.delay_s == 0
        follow = 1 / (period_s if prompt else self.delay_s)
        a, c, u = 1 / self.lag_s, mp.mpf(0) if prompt else 1 / self.lag_s, 1 / self.lag_s
        return (
            mp.matrix([[-a, self.integral_1_s * a, c], [-1, -mp.mpf(_LEAK_1_S), 0], [0, 0, -follow]]),
            mp.matrix([[u if prompt else 0], [1], [follow]]),
        )


@dataclass(frozen=True)
class AttitudeConstants:
    """Constants of the attitude model, float64; axis 0 is right (roll), axis 1 forward (pitch).

    gain_m_step2_rad:         acceleration per measured tilt with the thrust of hover, m/step^2 per rad.
    command_gain_m_step2_rad: (2,) acceleration per commanded roll and pitch.
    command_rad_step2_m:      (2,) command per acceleration, the inverse.
    trim_rad:                 (2,) measured roll and pitch without acceleration.
    trim_command_rad:         (2,) commanded roll and pitch without acceleration.
    command_limit_m_step2:    (2,) largest acceleration that commands within the tilt limit give, either way.
    tilt_row:                 (2, 4) the next a from [a, i, c, u].
    integral_row:             (2, 4) the next i from the same.
    lagged_share:             (2,) share of u - c that c takes in a step.
    limit_m_step2:            beyond every |a|, |i|, |c|, |u| of all commands within the tilt limit, also if
                              they turn with the heading.
    """

    gain_m_step2_rad: float
    command_gain_m_step2_rad: NDArray[np.float64]
    command_rad_step2_m: NDArray[np.float64]
    trim_rad: NDArray[np.float64]
    trim_command_rad: NDArray[np.float64]
    command_limit_m_step2: NDArray[np.float64]
    tilt_row: NDArray[np.float64]
    integral_row: NDArray[np.float64]
    lagged_share: NDArray[np.float64]
    limit_m_step2: float


def attitude_loops(model: Model, damping: Damping) -> tuple[AttitudeLoop, AttitudeLoop]:
    """Return the loops of roll and pitch, with what rate feedback takes off their lags."""
    return (
        AttitudeLoop(
            mp.mpf(model.roll_lag_s) - mp.mpf(damping.roll_rate_feedback_s),
            mp.mpf(model.roll_delay_s),
            mp.mpf(model.roll_integral_1_s),
        ),
        AttitudeLoop(
            mp.mpf(model.pitch_lag_s) - mp.mpf(damping.pitch_rate_feedback_s),
            mp.mpf(model.pitch_delay_s),
            mp.mpf(model.pitch_integral_1_s),
        ),
    )


def attitude_constants(settings: Sections) -> AttitudeConstants:
    """Derive the constants of the attitude model."""
    model, period_s = settings.model, mp.mpf(settings.horizon.update_period_s)
    loops = attitude_loops(model, settings.damping)
    rows = [_rows(loop, period_s) for loop in loops]
    step_s = settings.horizon.update_period_s
    gain = GRAVITY_M_S2 * model.acceleration_per_tilt * (step_s * step_s)
    loop_gains = np.array([model.roll_gain, model.pitch_gain])
    trim_rad = np.array([model.roll_trim_rad, model.pitch_trim_rad])
    tilt_rad = loop_gains * settings.limits.tilt_rad
    largest = float(np.max(gain * (tilt_rad + np.abs(trim_rad))))
    return AttitudeConstants(
        gain_m_step2_rad=gain,
        command_gain_m_step2_rad=gain * loop_gains,
        command_rad_step2_m=1 / (gain * loop_gains),
        trim_rad=trim_rad,
        trim_command_rad=trim_rad / loop_gains,
        command_limit_m_step2=gain * (tilt_rad - np.abs(trim_rad)),
        tilt_row=np.array([row[0] for row in rows]),
        integral_row=np.array([row[1] for row in rows]),
        lagged_share=np.array([row[2][3] for row in rows]),
        limit_m_step2=max(_peak(*axis, period_s) for axis in zip(rows, loops, strict=True)) * largest,
    )


def _rows(loop: AttitudeLoop, period_s: Any) -> list[list[float]]:
    """Return the next a, i and c from [a, i, c, u], (3, 4)."""
    transition, inputs = hold(*loop.rates(period_s), period_s)
    share = loop.integral_1_s
    for other in range(3):
        if other != 1:
            transition[1, other] *= share
            transition[other, 1] = transition[other, 1] / share if share else mp.mpf(0)
    inputs[1] *= share
    return [[float(value) for value in (*transition[row, :], inputs[row])] for row in range(3)]


def _peak(rows: list[list[float]], loop: AttitudeLoop, period_s: Any) -> float:
    """Return a bound of |a|, |i|, |c| for |u| <= 1: the sums of the absolute impulse responses.

    When all but a slow integral part has settled, responses keep their signs: the sum of the rest is exact.
    Twice that, since the components of a vector that turns are at most the sum of both.
    """
    response, sums = [row[3] for row in rows], [0.0] * 3
    for _ in range(math.ceil(_SETTLING * max(loop.lag_s, loop.delay_s, period_s) / period_s)):
        a, i, c = response
        sums = [total + abs(value) for total, value in zip(sums, response, strict=True)]
        response = [((row[0] * a) + (row[1] * i)) + (row[2] * c) for row in rows]
    rest = mp.lu_solve(mp.eye(3) - mp.matrix([row[:3] for row in rows]), mp.matrix(response))
    return 2.02 * max(1.0, *(total + float(abs(value)) for total, value in zip(sums, rest, strict=True)))
