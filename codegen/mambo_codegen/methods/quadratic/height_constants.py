"""Constants of the height: model of the thrust, observer and law; and of what couples the axes.

The model, the cost and the observer are those of right and forward, with the thrust in place of the tilt:

    lag a' = c - a,  delay c' = u - c,   e' = v,  v' = a + w

where g + u is the commanded thrust over mass along the vertical. The chapter *height* has the equations.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.attitude_constants import MOST_WEIGHT, LoopValues, attitude_solution
from mambo_codegen.methods.quadratic.law import STATES, LawSolution, axis_law
from mambo_codegen.methods.quadratic.observer_constants import observer_gain
from mambo_codegen.methods.quadratic.reciprocal import Reciprocal, never_too_small, reciprocal
from mambo_codegen.methods.quadratic.thrust_vector_constants import LEAST_SHARE, has_thrust_vector
from mambo_codegen.methods.shared.tracker_constants import JUMP_MARGIN
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.key import Refusal
from mambo_codegen.settings.optional_sections import Height
from mambo_codegen.settings.sections import Sections

LEAST_WEIGHT: Final = 0.3
"""Least (g + a)/g, the factor by which the tilt of a climbing drone counts; MOST_WEIGHT is the largest."""

LEAST_COSINE: Final = 0.6
"""The thrust is compensated for the tilt as if cos roll cos pitch were at least this."""

COSINE_TERMS: Final = 0.5, 0.0416
"""cos x = 1 - x^2 (0.5 - 0.0416 x^2), within 9e-4 where that is more than LEAST_COSINE."""

STEEPEST_RAD: Final = 1.2
"""Beyond this angle the cosine is less than LEAST_COSINE."""

DESCENT_SHARE: Final = 0.7
"""A descent ends by at most this share of the largest acceleration upwards."""

FLOOR_MARGIN_M: Final = 0.02
"""A target at most this far above a drone on the floor is one on the floor."""

INTEGRAL: Final = STATES.index("i")
"""The place among the law's states of the integral part, which a thrust does not have."""


@dataclass(frozen=True)
class HeightConstants:
    """Constants of the height, float64, for lengths in m and times in steps of an update period.

    thrust_row:    (3,) the next a from [a, c, u].
    lagged_row:    (2,) the next c from [c, u].
    rows, ratio:   (moves, k) the unlimited minimum from `states`, and H12/H11, as in `LawConstants`.
    states:        (k,) those of the law less the integral part.
    gain:          (3, 2) of the observer, as in `ObserverConstants`; with a learnt thrust gain the last row
                   is that of the gain.
    learnt_limit:  largest deviation of the gain from 1, or largest learnt acceleration, m/step^2.
    gravity_m_step2, per_gravity: g and its inverse.
    thrust_m_step2: (2,) least and largest thrust over mass.
    limit_m_step2: beyond every |a|, |c| and |u|.
    reach_steps:   1/k of the approach rate k: the law flies at the climb v_T + k (p_T - p).
    thrust_gain:   delivered over commanded thrust.
    step2_s2, steps2_per_s2: T_s^2 times that, and its inverse: from a command, m/s^2, to what it delivers.
    command_m_s2:  (3,) least and largest command, and that of hover.
    up_m, down_m:  distances at which the law flies at the largest climb and descent.
    most_m_s:      (2,) largest limits of climb and descent: those that can be braked in time.
    least_share:   the thrust is compensated for the tilt as if cos roll cos pitch were at least this.
    thrust_inverse, weight_inverse: of the thrust's factors, and of (g + u)/g; the latter is never too small.
    snap_s:        as in `LawConstants`.
    """

    thrust_row: NDArray[np.float64]
    lagged_row: NDArray[np.float64]
    rows: NDArray[np.float64]
    states: tuple[str, ...]
    ratio: float
    gain: NDArray[np.float64]
    learnt: str
    learnt_limit: float
    gravity_m_step2: float
    per_gravity: float
    thrust_m_step2: tuple[float, float]
    limit_m_step2: float
    reach_steps: float
    up_m: float
    down_m: float
    thrust_gain: float
    step2_s2: float
    steps2_per_s2: float
    command_m_s2: tuple[float, float, float]
    most_m_s: tuple[float, float]
    least_share: float
    thrust_inverse: Reciprocal
    weight_inverse: Reciprocal
    snap_s: float

    @property
    def learns_gain(self) -> bool:
        """Whether a factor of the thrust is learnt."""
        return self.learnt == "gain"

    @property
    def learns_acceleration(self) -> bool:
        """Whether a vertical acceleration is learnt."""
        return self.learnt == "acceleration"


def height_constants(settings: Sections) -> HeightConstants | None:
    """Derive the constants of the height; None if `settings` have none."""
    height, step_s = settings.height, settings.horizon.update_period_s
    if height is None:
        return None
    delivered_s2 = step_s * step_s * height.thrust_gain
    rows, law = np.array(attitude_solution(step_s, _loop(height))["rows"]), _law(settings, height)
    gravity = GRAVITY_M_S2 * (step_s * step_s)
    gain = observer_gain(settings, height.disturbance_noise)
    deviation = height.learnt_gain_limit if height.learnt == "gain" else 0.0
    if height.learnt == "gain":
        gain = gain / np.array([[1.0], [1.0], [gravity]])
    least, most = (step_s * step_s * thrust for thrust in (height.thrust_min_m_s2, height.thrust_max_m_s2))
    reach_steps = float(law[0, 1] / law[0, 0])
    least_share = LEAST_SHARE if has_thrust_vector(settings) else LEAST_COSINE
    return HeightConstants(
        thrust_row=rows[0, [0, 2, 3]],
        lagged_row=rows[2, 2:],
        rows=law,
        states=tuple(name for name in STATES if name != "i"),
        ratio=_solution(settings, height).ratio,
        gain=gain,
        learnt=height.learnt,
        learnt_limit=_learnt_limit(height, step_s),
        gravity_m_step2=gravity,
        per_gravity=1 / gravity,
        thrust_m_step2=(least, most),
        limit_m_step2=max(gravity, ((1 + deviation) * most) - gravity),
        reach_steps=reach_steps,
        up_m=reach_steps * step_s * height.climb_m_s,
        down_m=reach_steps * step_s * height.descent_m_s,
        thrust_gain=height.thrust_gain,
        step2_s2=delivered_s2,
        steps2_per_s2=1 / delivered_s2,
        command_m_s2=(*height.command_m_s2, GRAVITY_M_S2 / height.thrust_gain),
        most_m_s=_most_m_s(settings, height, reach_steps * step_s),
        least_share=least_share,
        thrust_inverse=reciprocal(least_share * (1 - deviation), 1 + deviation),
        weight_inverse=never_too_small(reciprocal(LEAST_WEIGHT, MOST_WEIGHT)),
        snap_s=_solution(settings, height).snap_s,
    )


def _learnt_limit(height: Height, step_s: float) -> float:
    """Return the largest deviation of the gain from 1, or the largest learnt acceleration, m/step^2."""
    if height.learnt == "gain":
        return height.learnt_gain_limit
    return height.learnt_acceleration_limit_m_s2 * (step_s * step_s)


def refusals(settings: Sections) -> list[Refusal]:
    """Return why a controller cannot have the height of `settings`."""
    height, step_s = settings.height, settings.horizon.update_period_s
    if height is None:
        return []
    refused = []
    most_m_s2, gain = settings.ranges.thrust_acceleration_max_m_s2, height.thrust_gain
    if height.command_m_s2[1] > most_m_s2:
        times = "" if gain == 1.0 else f"{gain!r} (height.thrust_gain) times "
        rule = f"must be at most {times}{most_m_s2!r} (ranges.thrust_acceleration_max_m_s2)"
        refused.append(Refusal("height", "thrust_max_m_s2", rule))
    try:
        solution = _solution(settings, height)
    except ValueError:
        solution = None
    if solution is None or not solution.spectral_radius < 1:
        rule = "gives an unstable loop of the height with horizon.ramp_s; write a longer one"
        return [*refused, Refusal("height", "response_time_s", rule)]
    law = _law(settings, height)
    approach_s = float(law[0, 1] / law[0, 0]) * step_s
    for name, most_m_s, rest in zip(
        ("climb_m_s", "descent_m_s"),
        _most_m_s(settings, height, approach_s),
        ("height.thrust_min_m_s2", "height.thrust_max_m_s2"),
        strict=True,
    ):
        if getattr(height, name) > most_m_s:
            floor = np.floor(most_m_s * 1000) / 1000
            rule = f"must be at most {floor:g}, which the drone can brake in time with {rest} and this law"
            refused.append(Refusal("height", name, rule))
    return refused


def height_context(height: HeightConstants | None) -> dict[str, object]:
    """Return what the templates of the height insert."""
    return {
        "height": height,
        "cosine_terms": COSINE_TERMS,
        "least_cosine": LEAST_COSINE,
        "steepest_rad": STEEPEST_RAD,
        "floor_margin_m": FLOOR_MARGIN_M,
        "least_weight": LEAST_WEIGHT,
        "most_weight": MOST_WEIGHT,
    }


def _most_m_s(settings: Sections, height: Height, approach_s: float) -> tuple[float, float]:
    """Return the largest climb and descent whose braking, speed / approach_s, the thrust can give."""
    most_m_s = settings.ranges.velocity_m_s
    return (
        min(most_m_s, approach_s * (GRAVITY_M_S2 - height.thrust_min_m_s2)),
        min(most_m_s, approach_s * DESCENT_SHARE * (height.thrust_max_m_s2 - GRAVITY_M_S2)),
    )


def jump_m_s2(height: Height) -> float:
    """Return the acceleration of a target that has jumped."""
    return JUMP_MARGIN * max(GRAVITY_M_S2 - height.thrust_min_m_s2, height.thrust_max_m_s2 - GRAVITY_M_S2)


def _loop(height: Height) -> LoopValues:
    return (height.lag_s, 0.0, height.delay_s, 0.0)


def _solution(settings: Sections, height: Height) -> LawSolution:
    return axis_law(settings, height.response_time_s, height.velocity_weight_s, _loop(height))


def _law(settings: Sections, height: Height) -> NDArray[np.float64]:
    """Return the rows of the law's states less the integral part."""
    return np.delete(np.array(_solution(settings, height).rows), INTEGRAL, axis=1)
