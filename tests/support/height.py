"""Settings with a height: corners, then random ones of a seed."""

from typing import Any, Final

import numpy as np

from mambo_codegen.methods.quadratic.thrust_vector_constants import MOST_TILT_RAD
from mambo_codegen.settings.model import Settings
from tests.support.quadratic import ONE_MOVE, TWO_MOVES, case_values, settings_of
from tests.support.strategies import Values

CRAZYFLIE: Final[Values] = TWO_MOVES | {
    "height.lag_s": 0.072,
    "height.delay_s": 0.005,
    "height.thrust_max_m_s2": 15.2,
    "height.descent_m_s": 1.5,
}
"""The Crazyflie's thrust."""

EVERY_FUNCTION: Final = settings_of(
    CRAZYFLIE
    | {
        "observer.measurement_age_s": 0.01,
        "model.drag_1_s": 0.2,
        "model.roll_gain": 0.9,
        "limits.speed_m_s": 5.0,
        "guard.tilt_budget_rad_s": 5.0,
        "guard.position_noise": 0.03,
    }
)
"""Settings of every function of nmpc.h; roll and pitch differ."""

HEIGHT_CORNERS: Final[tuple[Values, ...]] = (
    CRAZYFLIE | {"observer.measurement_age_s": 0.01, "observer.outage_s": 0.05},
    CRAZYFLIE
    | {
        "limits.speed_m_s": 1.5,
        "limits.fence.floor_m": -0.5,
        "limits.fence.ceiling_m": 1.5,
        "observer.outage_s": 0.03,
        "model.roll_trim_rad": 0.02,
    },
    ONE_MOVE
    | {
        "height.learnt": "acceleration",
        "model.start_attitude": "measured",
        "height.learnt_acceleration_limit_m_s2": 0.981,
        "height.descent_m_s": 1.2,
    },
    CRAZYFLIE
    | {
        "height.learnt": "none",
        "height.thrust_gain": 0.4,
        "height.delay_s": 0.0,
        "limits.braking_m_s2": 2.0,
    },
    CRAZYFLIE
    | {
        "limits.fence.x_min_m": -1.5,
        "limits.fence.x_max_m": 2.0,
        "damping.pitch_rate_feedback_s": 0.02,
        "height.learnt_gain_limit": 0.6,
        "height.thrust_gain": 1.7,
        "ranges.position_m": 5.0,
        "ranges.velocity_m_s": 2.0,
    },
    CRAZYFLIE
    | {
        "limits.speed_m_s": 1.5,
        "guard.tilt_budget_rad_s": 1.0,
        "guard.thrust_budget_m_s2": 3.0,
        "guard.thrust_budget_m_s3": 20.0,
    },
    CRAZYFLIE
    | {
        "model.tilt": "exact",
        "limits.tilt_rad": 0.7,
        "model.roll_gain": 0.8,
        "model.pitch_gain": 1.2,
        "model.pitch_trim_rad": -0.03,
        "limits.speed_m_s": 1.5,
        "damping.pitch_rate_feedback_s": 0.02,
        "guard.tilt_budget_rad_s": 1.0,
        "guard.thrust_budget_m_s2": 3.0,
        "guard.thrust_budget_m_s3": 20.0,
    },
    CRAZYFLIE
    | {
        "model.tilt": "exact",
        "limits.tilt_rad": 1.2,
        "height.learnt": "acceleration",
        "height.learnt_acceleration_limit_m_s2": 0.981,
        "height.thrust_max_m_s2": 39.0,
        "model.start_attitude": "measured",
        "observer.outage_s": 0.05,
    },
    CRAZYFLIE
    | {
        "model.tilt": "exact",
        "limits.tilt_rad": 0.7,
        "model.drag_1_s": 0.244,
        "limits.speed_m_s": 1.5,
        "observer.outage_s": 0.05,
        "guard.tilt_budget_rad_s": 8.4,
    },
)
"""One move and two, all that can be learnt, with and without limits, fence, age, feedback
and guard; drones that deliver less than the commanded thrust, and more; with small angles and with the
thrust vector."""


def _learnt(learnt: str, share: float) -> Values:
    """Return what is learnt, at most `share` of the thrust, or of g."""
    limits: dict[str, Values] = {
        "gain": {"height.learnt_gain_limit": share},
        "acceleration": {"height.learnt_acceleration_limit_m_s2": 9.81 * share},
    }
    return {"height.learnt": learnt} | limits.get(learnt, {})


def height_case(index: int, scalar: str) -> Settings:
    """Make the valid settings number `index` with a height."""
    return settings_of(_values(index) | {"code.scalar": scalar})


def _values(index: int) -> Values:
    if index < len(HEIGHT_CORNERS):
        return HEIGHT_CORNERS[index]
    rng = np.random.default_rng(index)
    level: dict[str, Any] = case_values(index)
    shortest_s = max(0.08, 0.5 * level["horizon.ramp_s"])
    values = level | {
        "height.lag_s": float(10.0 ** rng.uniform(-2, -0.7)),
        "height.delay_s": float(rng.choice([0.0, 0.005, 0.04])),
        "height.response_time_s": shortest_s * float(rng.uniform(1, 3)),
        "height.velocity_weight_s": float(rng.choice([0.0, 0.15, 0.5])),
        "height.thrust_min_m_s2": float(rng.uniform(0.5, 4)),
        "height.thrust_max_m_s2": float(rng.uniform(14, 40)),
        "height.climb_m_s": float(rng.uniform(0.1, 0.4)),
        "height.descent_m_s": float(rng.uniform(0.1, 0.3)),
        **_learnt(str(rng.choice(["gain", "gain", "acceleration", "none"])), float(rng.uniform(0, 0.6))),
        "height.disturbance_noise": float(10.0 ** rng.uniform(-1, 1)),
    }
    if rng.random() < 0.4:
        values |= {"limits.fence.floor_m": -1.0, "limits.fence.ceiling_m": float(rng.uniform(0, 3))}
    most_gain = max(values.get("model.roll_gain", 1.0), values.get("model.pitch_gain", 1.0))
    if rng.random() < 0.4 and values["limits.tilt_rad"] * most_gain <= MOST_TILT_RAD:
        values |= {"model.tilt": "exact"}
    return values
