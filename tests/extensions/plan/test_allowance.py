"""What a plan may take after flights: more where drones keep near it, less where they fall behind."""

import numpy as np

from mambo_extensions.plan.allowance import (
    SHARES,
    STEP,
    Allowance,
)
from mambo_extensions.plan.course import course_of
from mambo_extensions.plan.plan_flight import FlownPlan
from mambo_extensions.plan.points import PlanPoint
from mambo_sil.drone.plant.arrays import FloatArray

POINTS = [PlanPoint(float(x_m), 0.0, 1.0, tolerance_m=0.2) for x_m in range(5)]
COURSE = course_of(POINTS, closed=False)
TOLERANCE_M = np.full(4, 0.2)


def flown(error_m: list[float], off_m: list[float]) -> FlownPlan:
    """Return flights of two drones, one of which keeps to the plan."""
    rows: list[FloatArray] = [np.stack([np.zeros(4), np.array(one)]) for one in (error_m, off_m)]
    none = np.zeros(2)
    return FlownPlan(rows[1], none > 0.0, rows[0], none, none)


def test_a_share_grows_where_drones_keep_near_the_plan() -> None:
    """By a step where they do, by less where they are nearly astray, and it shrinks where they are."""
    kept = flown([0.02, 0.19, 0.4, 0.02], [0.01, 0.01, 0.01, 0.01])
    after = Allowance.of(COURSE).after(COURSE, kept, TOLERANCE_M)
    assert after.share[0] == after.share[3] == np.exp(STEP)
    assert 1.0 < after.share[1] < after.share[0]
    assert after.share[2] < 1.0


def test_a_plan_that_is_missed_returns_half_way() -> None:
    """Towards the shares of the one that is flown, from where they grow by half the step."""
    larger = Allowance(np.full(4, 1.21)).between(COURSE)
    np.testing.assert_allclose(larger.share, np.full(4, 1.1))
    after = larger.after(COURSE, flown([0.02] * 4, [0.01] * 4), TOLERANCE_M)
    np.testing.assert_allclose(after.share, np.full(4, 1.1 * np.exp(STEP / 2.0)))


def test_all_shares_shrink_until_drones_fly_a_plan() -> None:
    """Down to the least one."""
    allowance = Allowance.of(COURSE)
    for _ in range(3):
        assert not allowance.is_least
        allowance = allowance.lowered()
        if allowance.is_least:
            break
    np.testing.assert_array_equal(allowance.share, np.full(4, SHARES[0]))
