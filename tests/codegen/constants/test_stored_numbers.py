"""What a controller stores in fixed point stands for what it stores in float64, number by number."""

from typing import Any

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.height import CRAZYFLIE
from tests.support.quadratic import EVERYTHING, TWO_MOVES, settings_of

LIMITED = {"limits.speed_m_s": 1.5, "limits.fence.x_min_m": -1.0, "limits.fence.x_max_m": 2.0}
ONE_NORM = with_option(presets.preset("mambo-1norm"), "limits.speed_m_s", 1.5)
CASES = {
    "feedback, tracked": EVERYTHING,
    "given": settings_of(TWO_MOVES | LIMITED | {"target.acceleration": "given"}),
    "limits": settings_of(TWO_MOVES | LIMITED),
    "height, tracked": settings_of(CRAZYFLIE | LIMITED | {"target.acceleration": "tracked"}),
    "height, given": settings_of(CRAZYFLIE | LIMITED | {"target.acceleration": "given"}),
    "height, feedback": settings_of(CRAZYFLIE | {"damping.roll_rate_feedback_s": 0.01}),
    "height, acceleration": settings_of(CRAZYFLIE | {"height.learn": "acceleration"}),
    "1-norm": ONE_NORM,
    "1-norm, given": with_option(ONE_NORM, "target.acceleration", "given"),
    "1-norm, no tracker": with_option(ONE_NORM, "target.acceleration", "none"),
}


def stored(settings: Settings, scalar: str) -> Any:
    """Return the numbers (k,) that a controller stores after 40 updates; of the 1-norm its bounds."""
    method: Any = method_of(with_option(settings, "code.scalar", scalar))
    controller, outcome = method.reference_controller(1), None
    heights = 2 if settings.height is not None else 0
    for step in range(40):
        time_s = 0.01 * step
        state = [0.4 + 0.3 * time_s, -0.2, 0.3, -0.4, 0.05, -0.03 + 0.1 * time_s, 0.7]
        target = [1.1 + 0.8 * time_s, 0.3, 0.8, 0.2 - 0.3 * time_s]
        target += [0.3, -0.2] * (len(method.level_target) > 4)
        target += [1.2 + 0.2 * time_s, 0.2 + 0.1 * time_s][:heights] + [0.1] * (len(method.target) in (9,))
        state += [1.0 + 0.15 * time_s, 0.15, 0.0] * (heights > 0)
        given = () if heights else ([9.9],)
        outcome = controller.step([state], [target], *given)
    assert outcome is not None
    assert outcome.status.tolist() == [0]
    if settings.cost.norm == "quadratic":
        return outcome.stored[0]
    return method.numbers.to_si(controller.stored_limits, *method.limits_stored)[0]


@pytest.mark.parametrize("name", CASES)
def test_fixed_point_stands_for_the_numbers_of_float64(name: str) -> None:
    """Each to 2 %, where a wrong format is wrong by a factor of 2 or more."""
    fixed, exact = (stored(CASES[name], scalar) for scalar in ("fixed", "float64"))
    assert len(fixed) == len(exact)
    counts = np.abs(exact) > 1e-7
    assert np.count_nonzero(counts) > 0.6 * len(exact)
    assert fixed[counts] == pytest.approx(exact[counts], rel=0.02, abs=1e-6)
