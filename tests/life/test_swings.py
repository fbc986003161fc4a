"""A loop that swings between its limits of tilt is noticed, a quick curve is not."""

import numpy as np
import pytest

from mambo_sil.life.swings import Swings

LIMIT_RAD = 0.7


@pytest.mark.parametrize(
    ("rate_hz", "share", "swings"),
    [(1.2, 1.0, True), (2.4, 0.8, True), (0.7, 1.0, False), (3.0, 0.6, False)],
    ids=["swings", "swings-quickly", "curve", "rattles-below-the-limit"],
)
def test_swings_between_the_limits_are_noticed(rate_hz: float, share: float, swings: bool) -> None:
    """Of roll and pitch together ten in three seconds; after a new beginning none."""
    watch = Swings(LIMIT_RAD)
    for time_s in np.arange(0.0, 6.0, 0.01).tolist():
        angle = 2.0 * np.pi * rate_hz * time_s
        watch.watch(share * LIMIT_RAD * np.array([np.sin(angle), np.cos(angle)]), time_s)
    assert watch.are_there is swings
    watch.begin()
    assert not watch.are_there
