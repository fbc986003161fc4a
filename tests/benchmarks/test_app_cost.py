"""What a call of the Crazyflie's app costs, which its firmware makes every millisecond."""

import pytest

from benchmarks.app_cost import call_cost
from mambo_sil.drone.vehicles import vehicle_toml
from tests.support.derived import settings_for
from tests.support.tools import require

MOST_INSTRUCTIONS = 750
MOST_WITH_A_STEP = 4800
MOST_FRAME_BYTES = 160


@pytest.mark.long
def test_a_call_is_short() -> None:
    """Work on a set-point is done when it changes; between steps a call only watches the position."""
    require("arm-none-eabi-gcc", "gcc-arm-none-eabi")
    pytest.importorskip("unicorn")
    cost = call_cost(settings_for(vehicle_toml.preset("crazyflie"), exact=True))
    assert cost.mean <= MOST_INSTRUCTIONS
    assert cost.most <= MOST_WITH_A_STEP
    assert sum(cost.by_function.values()) == pytest.approx(cost.mean)
    assert cost.frames_bytes[0] <= MOST_FRAME_BYTES
