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

from dataclasses import dataclass
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.kept import keep
from mambo_codegen.methods.quadratic.thrust_vector_constants import (
    has_thrust_vector,
    most_slopes,
    steepest_slope,
)
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.sections import Damping, Model, Sections

MOST_WEIGHT: Final = 1.9
"""With a height, by how much a tilt may count more than in hover: the largest (g + a)/g."""


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
    lagged_row:               (2, 2) the next c from [c, u].
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
    lagged_row: NDArray[np.float64]
    limit_m_step2: float


LoopValues = tuple[float, float, float, float]
"""A loop of roll or pitch: lag, what rate feedback takes off the lag, and dead time, in s; its integral gain
over its angle gain, in 1/s."""


def attitude_loops(model: Model, damping: Damping) -> tuple[LoopValues, LoopValues]:
    """Return the loops of roll and pitch."""
    return (
        (model.roll_lag_s, damping.roll_rate_feedback_s, model.roll_delay_s, model.roll_integral_1_s),
        (model.pitch_lag_s, damping.pitch_rate_feedback_s, model.pitch_delay_s, model.pitch_integral_1_s),
    )


def attitude_constants(settings: Sections) -> AttitudeConstants:
    """Derive the constants of the attitude model."""
    model, step_s = settings.model, settings.horizon.update_period_s
    solutions = [attitude_solution(step_s, loop) for loop in attitude_loops(model, settings.damping)]
    rows = [solution["rows"] for solution in solutions]
    gain = GRAVITY_M_S2 * model.acceleration_per_tilt * (step_s * step_s)
    loop_gains = np.array([model.roll_gain, model.pitch_gain])
    trim_rad = np.array([model.roll_trim_rad, model.pitch_trim_rad])
    tilt_rad = loop_gains * settings.limits.tilt_rad
    most, largest = tilt_rad - np.abs(trim_rad), float(np.max(gain * (tilt_rad + np.abs(trim_rad))))
    if has_thrust_vector(settings):
        most, largest = most_slopes(settings), gain * steepest_slope(settings)
    if settings.height is not None:
        largest *= MOST_WEIGHT
    return AttitudeConstants(
        gain_m_step2_rad=gain,
        command_gain_m_step2_rad=gain * loop_gains,
        command_rad_step2_m=1 / (gain * loop_gains),
        trim_rad=trim_rad,
        trim_command_rad=trim_rad / loop_gains,
        command_limit_m_step2=gain * most,
        tilt_row=np.array([row[0] for row in rows]),
        integral_row=np.array([row[1] for row in rows]),
        lagged_row=np.array([row[2][2:] for row in rows]),
        limit_m_step2=max(solution["peak"] for solution in solutions) * largest,
    )


def attitude_solution(update_period_s: float, loop: LoopValues) -> dict[str, Any]:
    """Return what `solve_attitude` returns for a loop."""

    def solve() -> dict[str, Any]:
        from mambo_codegen.methods.quadratic.solutions import solve_attitude  # noqa: PLC0415 - imports mpmath

        return solve_attitude(update_period_s, loop)

    return cast(dict[str, Any], keep("attitude", (update_period_s, loop), solve))
