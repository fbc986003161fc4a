"""What the evidence of the height promises."""

import numpy as np
import pytest

from benchmarks.flights.height import (
    LOOPS,
    app_take_off,
    drawn,
    gust,
    prepared_take_off,
    settings_of,
    step_on_circle,
    swing,
    weight,
)


def test_a_loop_flies_with_the_same_roll_and_pitch() -> None:
    """The settings without a height have the same cost."""
    assert settings_of(height=True).height is not None
    assert settings_of(height=False).height is None
    assert settings_of(height=False).cost == settings_of(height=True).cost


@pytest.mark.long
def test_the_third_axis_keeps_its_promises() -> None:
    """Height and place on circles with swing and steps, take-off, weight, gust; it beats every loop there."""
    rms_m, place_m = swing(None)
    assert rms_m <= 0.002
    assert place_m <= 0.005
    assert max(step_on_circle(None)) <= 0.04
    late_m, heavy_late_m = prepared_take_off(None)
    assert late_m <= 0.01
    assert heavy_late_m <= 0.08
    ahead_m, heavy_late_m = app_take_off(None)
    assert ahead_m <= 0.08
    assert heavy_late_m <= 0.1
    assert not app_take_off("pid")
    drop_m, rest_m, rise_m = weight(None)
    assert drop_m <= 0.08
    assert rest_m <= 0.002
    assert rise_m <= 0.06
    worst_m, left_m = gust(None)
    assert worst_m <= 0.05
    assert left_m <= 0.005
    assert all(rms_m < swing(loop)[0] for loop in LOOPS)


def test_drones_are_drawn_alike_for_every_law() -> None:
    """By their seed alone."""
    one, again, other = drawn(5, 1), drawn(5, 1), drawn(5, 2)
    for name, values in vars(one).items():
        assert np.array_equal(values, getattr(again, name))
    assert not np.array_equal(one.mass, other.mass)
