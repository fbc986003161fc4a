"""The constants of the target tracker are those of their definitions, over a table of settings."""

from typing import Final

import numpy as np
import pytest
from scipy.optimize import linprog

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared import tracker_constants as module
from mambo_codegen.methods.shared.tracker_constants import target_limit_m_s2
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.benedict_bordner import no_pair_is_better
from tests.support.quadratic import TWO_MOVES, settings_of

ONE_NORM: Final = with_option(presets.preset("mambo-1norm"), "horizon.prediction_step_s", 0.15)
TABLE: Final[tuple[dict[str, float], ...]] = (
    {"target.tracker_gain": 0.1},
    {"target.tracker_gain": 0.3, "limits.tilt_rad": 0.4},
    {"target.tracker_gain": 0.8, "horizon.prediction_step_s": 0.1},
    {"ranges.velocity_m_s": 0.1, "horizon.update_period_s": 0.1},
)


def largest_m_s2(settings: Settings) -> float:
    """Return the drone's largest acceleration at its tilt limit, by linear programmes for both ways."""
    bounds = [(-settings.limits.tilt_rad, settings.limits.tilt_rad)]
    return float(max(-linprog([-sign * GRAVITY_M_S2], bounds=bounds).fun for sign in (1, -1)))


def defined(settings: Settings) -> dict[str, float]:
    """Return each constant by its definition: differences of places, ends of ranges, the worst inputs."""
    update_s, step_s = settings.horizon.update_period_s, method_of(settings).step_s
    gain, range_m_s = settings.target.tracker_gain, settings.ranges.velocity_m_s
    change_m_s = min(1.5 * largest_m_s2(settings) * update_s, float(np.ptp(range_m_s * np.array([-1, 1]))))
    (difference_m,) = np.diff(0.5 * (step_s * np.arange(3)) ** 2, n=2)
    limit = difference_m * change_m_s / update_s
    worst = 0.0
    for _ in range(3000):
        worst = (1 - gain) * (worst + limit / 10) + gain * limit
    return {
        "change_limit_m_s": change_m_s,
        "factor_s": difference_m / update_s,
        "acceleration_limit_m_step2": limit,
        "jerk_limit_m_step2_update": limit / 10,
        "acceleration_bound_m_step2": 1.01 * worst,
        "tested_change_m_s": change_m_s / (1 - 1 / 5),
        "gain": gain,
        "velocity_range_m_s": range_m_s,
    }


@pytest.mark.parametrize("values", TABLE)
def test_constants_are_those_of_their_definitions(values: dict[str, float]) -> None:
    """Each, and the gain of the jerk: Benedict and Bordner's, of which no other pair is better in both."""
    settings = ONE_NORM
    for name, value in values.items():
        settings = with_option(settings, name, value)
    found = method_of(settings).tracker
    assert found is not None
    expected = defined(settings)
    assert {name: getattr(found, name) for name in expected} == pytest.approx(expected, rel=1e-9)
    assert no_pair_is_better(found.gain, found.jerk_gain)


def test_the_limit_of_a_target_within_limits_is_what_the_drone_follows_or_the_range() -> None:
    """1.5 times what the tilt limit gives; or the largest thrust over mass that is accepted."""
    assert (module.JUMP_MARGIN, module.JERK_SHARE) == (1.5, 0.1)
    quadratic = settings_of(TWO_MOVES)
    assert target_limit_m_s2(quadratic) == pytest.approx(1.5 * largest_m_s2(quadratic), rel=1e-12)
    weak = with_option(quadratic, "ranges.thrust_acceleration_min_m_s2", 1.0)
    assert target_limit_m_s2(with_option(weak, "ranges.thrust_acceleration_max_m_s2", 6.0)) == 6.0
