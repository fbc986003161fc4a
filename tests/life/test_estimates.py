"""The estimate that the controller gets, of those that come in any order and at any age."""

import random
from collections import deque

import numpy as np
import pytest

from mambo_sil.flight.frames import wrapped
from mambo_sil.life.estimates import Estimates, carry
from mambo_sil.life.records import EstimatedState

PUSH_M_S2, TURN_RAD_S = np.array([2.0, -1.0, 0.5]), np.array([0.5, -0.3, 2.0])


def moving(time_s: float, resets: int = 0) -> EstimatedState:
    """Return the state of a drone that accelerates steadily and turns, its nose over south."""
    return EstimatedState(
        time_s,
        np.array([3.0, 0.0, -1.0]) + 0.5 * time_s**2 * PUSH_M_S2,
        time_s * PUSH_M_S2,
        wrapped(np.array([0.0, 0.0, 3.1]) + time_s * TURN_RAD_S),
        resets,
    )


@pytest.mark.parametrize("ahead_s", [-0.06, -0.003, 0.007, 0.06])
def test_a_state_is_carried_along_its_motion(ahead_s: float) -> None:
    """Exactly where the acceleration is steady, into the past as into the future, over the heading of pi."""
    found, there = (
        carry(deque(map(moving, (0.0, 0.01, 0.02, 0.055))), 0.055 + ahead_s),
        moving(0.055 + ahead_s),
    )
    np.testing.assert_allclose(found.position_m, there.position_m, atol=1e-12)
    np.testing.assert_allclose(found.velocity_m_s, there.velocity_m_s, atol=1e-12)
    np.testing.assert_allclose(wrapped(found.attitude_rad - there.attitude_rad), 0.0, atol=1e-12)
    assert np.abs(found.attitude_rad).max() <= np.pi


def test_states_that_come_at_one_age_stay_as_they_are() -> None:
    """Bit for bit."""
    estimates = Estimates()
    for count in range(50):
        state = moving(0.01 * count)
        estimates.receive(state, 7.03 + 0.01 * count, in_flight=count > 0)
        assert estimates.carried(7.03 + 0.01 * count) is state


def test_states_that_overtake_each_other_get_one_age() -> None:
    """Of 20 to 80 ms and a third lost: near the true ones, at times that pass as the clock does."""
    estimates, chance = Estimates(), random.Random(1)
    on_the_way, ages_s, errors_m_s = list[tuple[float, float]](), list[float](), list[float]()
    for count in range(1000):
        now_s = 0.01 * count
        if chance.random() > 0.33:
            on_the_way.append((now_s + chance.uniform(0.02, 0.08), now_s))
        for one in sorted(one for one in on_the_way if one[0] <= now_s):
            on_the_way.remove(one)
            estimates.receive(moving(one[1]), now_s, in_flight=count > 100)
        found = estimates.carried(now_s)
        if count > 200 and found is not None:
            ages_s.append(now_s - found.time_s)
            errors_m_s.append(float(np.abs(found.velocity_m_s - moving(found.time_s).velocity_m_s).max()))
    assert len(ages_s) == 799
    assert 0.02 < min(ages_s) <= max(ages_s) < 0.06
    assert np.abs(np.diff(ages_s)).max() < 0.005
    assert max(errors_m_s) < 1e-9


def test_a_jump_of_the_frame_is_no_motion() -> None:
    """Behind a counted reset a state is carried by its own velocity alone, until there are others."""
    estimates = Estimates()
    for count in range(10):
        estimates.receive(moving(0.01 * count), 0.01 * count, in_flight=count > 0)
    estimates.receive(moving(3.0, resets=1), 3.0, in_flight=True)
    found = estimates.carried(3.02)
    assert found is not None
    np.testing.assert_allclose(found.velocity_m_s, 3.0 * PUSH_M_S2)
    np.testing.assert_allclose(found.position_m, moving(3.0).position_m + 0.06 * PUSH_M_S2)
