"""Constants of a controller with the 1-norm against what it does: outages, and weights that it takes."""

from typing import Any

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings


def one_norm(**options: object) -> Settings:
    """Return preset mambo-1norm without limits, and with a short search."""
    settings = presets.preset("mambo-1norm")
    for path, value in ({"optimizer__iterations": 1} | options).items():
        settings = with_option(settings, path.replace("__", "."), value)
    return settings


@pytest.mark.parametrize(("period_s", "steps"), [(0.001, 250), (0.1, 5), (0.3, 2), (0.7, 1)])
def test_the_command_is_level_half_a_second_after_the_last_state(period_s: float, steps: int) -> None:
    """To the nearest step, of which there are at most 250, at least one; without limits it is held."""
    for limited in (True, False):
        settings = one_norm(horizon__update_period_s=period_s, limits__speed_m_s=2.0 if limited else 0.0)
        method, target = method_of(settings), np.zeros((1, 4))
        controller: Any = method.reference_controller(1)
        target[0, :2] = 5.0
        for _ in range(3):
            controller.step(np.zeros((1, 7)), target, [9.81])
        lost = [controller.step(np.full((1, 7), np.nan), target, [9.81]) for _ in range(steps + 1)]
        held = [bool(np.any(one.command_rad != 0)) for one in lost]
        assert held == [True] * (steps - 1) + [not limited] * 2
        assert method.outage_steps == (steps if limited else None)


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_weights_are_taken_up_to_their_limits(scalar: str) -> None:
    """Each by itself, to 1 in a thousand."""
    settings = one_norm(code__scalar=scalar)
    most = np.array(method_of(settings).weight_limits)
    assert most.shape == (2,)
    weights = [most * share for share in ((0.999, 0.999), (1.001, 0.999), (0.999, 1.001), (0.0, 0.0))]
    controller: Any = method_of(settings).reference_controller(4)
    expected = [Status.OK, Status.BAD_WEIGHT, Status.BAD_WEIGHT, Status.OK]
    assert controller.set_weights(weights).tolist() == expected
    assert most[0] > settings.cost.tracking_weight
    assert most[1] > settings.cost.effort_weight
