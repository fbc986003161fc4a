"""Constants of the quadratic cost's exact minimum, for each axis of the heading.

Along right and forward the drone's error obeys, in seconds and metres,

    e' = v,  v' = a + w

with a from `attitude_constants.py`, and w the disturbance less the target's acceleration. The cost is the
sum over all control steps of

    e^2 + (weight v)^2 + (response^3 (u_k - u_k-1) / T_s)^2

without end: behind the free moves the Riccati equation gives the cost to go. The first free move is the
command of this control step; the second, if there is one, is reached by a ramp. Their minimum is linear in
the state, [e, v, w, a, i, c, u_k-1]; the limits of the command cut it off. A row also takes of the target's
jerk j what follows a steady jerk without a distance.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.kept import keep
from mambo_codegen.methods.quadratic.attitude_constants import LoopValues, attitude_loops
from mambo_codegen.methods.quadratic.thrust_vector_constants import refusals as thrust_vector_refusals
from mambo_codegen.methods.shared.limits_constants import (
    LimitsConstants,
    TiltAcceleration,
    limits_constants,
)
from mambo_codegen.methods.shared.limits_constants import refusals as limits_refusals
from mambo_codegen.methods.shared.rate_feedback import lag_refusals
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.key import Refusal
from mambo_codegen.settings.sections import Sections

STATES: Final = ("e", "v", "w", "j", "a", "i", "c", "u")
MOVED: Final = ("e", "v", "a", "i", "c", "u")
"""The states that the command moves."""
MOST_OUTAGE_STEPS: Final = 250
"""The controller counts the control steps of an outage in one byte."""


@dataclass(frozen=True)
class LawConstants:
    """Constants of the law, float64, for lengths in m and times in steps of an update period.

    moves:          1, or 2 with a ramp.
    rows:           (2, moves, 8) the unlimited minimum, the free moves in m/step^2, from the state,
                    `STATES`; axis 0 is right (roll), axis 1 forward (pitch).
    snap_s:         (2,) what the first move takes of the derivative of the target's jerk, over what it
                    takes of the jerk.
    ratios:         (2,) H12/H11 of the second derivatives H of the cost by two moves: by how much the best
                    first move falls when the second rises; 0 for one move.
    spectral_radius: (2,) of the closed loop without limits.
    """

    moves: int
    rows: NDArray[np.float64]
    snap_s: NDArray[np.float64]
    ratios: NDArray[np.float64]
    spectral_radius: NDArray[np.float64]


@dataclass(frozen=True)
class LawSolution:
    """The law along one axis, in lists of floats.

    rows, ratio: as in `LawConstants`.
    snap_s:      as in `LawConstants`.
    curvature:   (2, 2) second derivatives of the cost by the two free moves; None for one.
    closed_loop: (6, 6) transition of the states `MOVED` without the limits of the command, in SI units.
    """

    rows: list[list[float]]
    ratio: float
    curvature: list[list[float]] | None
    closed_loop: list[list[float]]
    snap_s: float

    @property
    def spectral_radius(self) -> float:
        """The largest absolute eigenvalue of the closed loop."""
        return float(np.max(np.abs(np.linalg.eigvals(np.array(self.closed_loop)))))


def law_constants(settings: Sections) -> LawConstants:
    """Derive the constants of the law."""
    laws = _laws(settings)
    return LawConstants(
        moves=len(laws[0].rows),
        rows=np.array([law.rows for law in laws]),
        snap_s=np.array([law.snap_s for law in laws]),
        ratios=np.array([law.ratio for law in laws]),
        spectral_radius=np.array([law.spectral_radius for law in laws]),
    )


def second_derivatives(settings: Sections) -> NDArray[np.float64]:
    """Return the second derivatives of the cost by the free moves, (2, 2, 2) for both axes of two moves.

    Raises ValueError for one move, whose minimum does not depend on them.
    """
    laws = _laws(settings)
    if laws[0].curvature is None:
        raise ValueError("there is one free move")
    return np.array([law.curvature for law in laws])


def closed_loops(settings: Sections) -> NDArray[np.float64]:
    """Return the transition of the states `MOVED` in a control step under the law, (2, 6, 6) in SI units."""
    return np.array([law.closed_loop for law in _laws(settings)])


def _laws(settings: Sections) -> list[LawSolution]:
    return [_law(settings, loop) for loop in attitude_loops(settings.model, settings.damping)]


def _law(settings: Sections, loop: LoopValues) -> LawSolution:
    return axis_law(settings, settings.cost.response_time_s, settings.cost.velocity_weight_s, loop)


def axis_law(
    settings: Sections, response_time_s: float, velocity_weight_s: float, loop: LoopValues
) -> LawSolution:
    """Return the law along an axis whose acceleration answers its command by `loop`."""
    horizon = settings.horizon
    inputs = horizon.update_period_s, horizon.ramp_s, response_time_s, velocity_weight_s, loop

    def solve() -> dict[str, Any]:
        from mambo_codegen.methods.quadratic.solutions import solve_law  # noqa: PLC0415 - imports mpmath

        return solve_law(*inputs)

    return LawSolution(**keep("law", inputs, solve))


def limits(settings: Sections) -> LimitsConstants:
    """Derive the constants of the limits of speed, braking and place."""
    rows = law_constants(settings).rows[:, 0]
    rates_1_s = rows[:, 0] / rows[:, 1] / settings.horizon.update_period_s
    return limits_constants(settings, float(np.min(rates_1_s)), _tilted(settings))


def _tilted(settings: Sections) -> TiltAcceleration:
    model = settings.model
    slope_m_s2_rad = GRAVITY_M_S2 * model.acceleration_per_tilt
    return TiltAcceleration(
        slope_m_s2_rad * min(model.roll_gain, model.pitch_gain),
        slope_m_s2_rad * max(abs(model.roll_trim_rad), abs(model.pitch_trim_rad)),
    )


def refusals(settings: Sections) -> list[Refusal]:
    """Return why a controller with a quadratic cost cannot have `settings`."""
    refused = lag_refusals(settings, needs_lag=True)
    horizon, model = settings.horizon, settings.model
    for angle in ("roll", "pitch"):
        trim_rad, gain = getattr(model, f"{angle}_trim_rad"), getattr(model, f"{angle}_gain")
        if abs(trim_rad) >= gain * settings.limits.tilt_rad:
            rule = f"must be less than model.{angle}_gain times limits.tilt_rad"
            refused.append(Refusal("model", f"{angle}_trim_rad", rule))
    if round(settings.observer.outage_s / horizon.update_period_s) > MOST_OUTAGE_STEPS:
        rule = f"must be at most {MOST_OUTAGE_STEPS} times horizon.update_period_s"
        refused.append(Refusal("observer", "outage_s", rule))
    if horizon.ramp_s and horizon.ramp_s < 2 * horizon.update_period_s:
        refused.append(Refusal("horizon", "ramp_s", "must be 0 or at least 2 update periods"))
    refused = (
        refused
        or thrust_vector_refusals(settings)
        or limits_refusals(settings, _tilted(settings), is_limited=True)
    )
    if refused:
        return refused
    try:
        radius = float(np.max(law_constants(settings).spectral_radius))
    except ValueError:
        radius = math.inf
    if not radius < 1:
        rule = (
            f"gives an unstable loop (spectral radius {radius:.4f}) with cost.response_time_s = "
            f"{settings.cost.response_time_s:g}; write a shorter ramp or a longer response time"
        )
        refused.append(Refusal("horizon", "ramp_s", rule))
    return refused
