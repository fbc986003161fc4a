"""What is no curve, or not finite, is refused by name."""

import math
from typing import Any

import pytest

from mambo_nmpc import ArgumentError, Controller, Vehicle, fly
from mambo_nmpc.curves import Circle, sample


@pytest.mark.parametrize(
    ("trajectory", "time_s", "message"),
    [
        (None, 0.0, "trajectory = None must have the methods target and acceleration"),
        (Circle, 0.0, "trajectory = .* must have the methods target and acceleration"),
        (
            Circle(math.nan, 1.0),
            0.0,
            r"trajectory = Circle\(radius_m=nan, .*\) must be finite at these times",
        ),
        (Circle(1.0, 1.0), [0.0, math.nan], r"time_s = \[0\.0, nan\] must be finite"),
        (Circle(1.0, 1.0), math.inf, "time_s = inf must be finite"),
        (Circle(1.0, 1.0), "now", 'time_s = "now" must be numbers'),
    ],
)
def test_what_cannot_be_sampled_is_refused(trajectory: Any, time_s: Any, message: str) -> None:
    """By name and value: no curve, a curve that is NaN, and times that are not finite."""
    with pytest.raises(ArgumentError, match=message):
        sample(trajectory, time_s)


def test_a_curve_of_nan_is_not_flown() -> None:
    """It would be a flight without a target."""
    pilot, vehicle = Controller.from_preset("crazyflie"), Vehicle.from_preset("crazyflie")
    with pytest.raises(ArgumentError, match=r"trajectory = Circle\(radius_m=nan, .*\) must be finite at 0 s"):
        fly(pilot, vehicle, Circle(math.nan, 1.0))
