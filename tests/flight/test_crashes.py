"""Crashes: which samples count, and what is said of the first one."""

from dataclasses import replace

import numpy as np
import pytest

from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.flight.controllers.pd import PdController
from mambo_sil.flight.crashes import Crash, crash_tilt_rad, detect_crashes, first_crash
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import Hover

CRASH_TILT_RAD = crash_tilt_rad(NOMINAL)


@pytest.fixture
def calm() -> Trace:
    """Return a take-off and 0.1 s of hovering, two flights."""
    return fly(Flight(Hover(), duration_s=0.1, start="take-off", flights=2), PdController())


def with_sample(trace: Trace, name: str, axis: int, value: float, after_s: float = 0.05) -> Trace:
    """Return the trace with one value changed in all samples of the second flight from `after_s` on."""
    array = getattr(trace, name).copy()
    array[trace.time_s >= after_s, 1, axis] = value
    return replace(trace, **{name: array})


def test_a_calm_flight_has_no_crash(calm: Trace) -> None:
    """The drone stands on the ground before it takes off; that is no crash."""
    assert calm.position_m[0, 0, 2] > -0.1
    assert not detect_crashes(calm).any()
    assert first_crash(calm) is None


def test_a_tilt_beyond_what_carries_the_weight_is_a_crash(calm: Trace) -> None:
    """59 degrees, from roll and pitch together; the first such sample is named."""
    tilted = with_sample(calm, "euler_rad", 0, CRASH_TILT_RAD + 0.01)
    assert detect_crashes(tilted).tolist() == [False, True]
    assert first_crash(tilted) is None
    crash = first_crash(tilted, 1)
    assert crash is not None
    assert crash.time_s == pytest.approx(0.05)
    assert crash.how.startswith("tilted 59.")
    together = with_sample(with_sample(calm, "euler_rad", 0, 0.8), "euler_rad", 1, 0.8)
    assert detect_crashes(together).tolist() == [False, True]
    assert not detect_crashes(with_sample(calm, "euler_rad", 1, 0.8)).any()


@pytest.mark.parametrize(
    ("name", "axis", "value", "crashed"),
    [
        ("euler_rad", 0, CRASH_TILT_RAD - 1e-9, False),
        ("euler_rad", 0, CRASH_TILT_RAD, True),
        ("euler_rad", 1, -CRASH_TILT_RAD, True),
        ("position_m", 2, -1e-9, False),
        ("position_m", 2, 0.0, True),
        ("position_m", 2, 1e-9, True),
    ],
)
def test_the_first_crash_is_one_that_is_detected(
    calm: Trace, *, name: str, axis: int, value: float, crashed: bool
) -> None:
    """The limits themselves are crashes to both functions."""
    changed = with_sample(calm, name, axis, value)
    assert detect_crashes(changed).tolist() == [False, crashed]
    assert (first_crash(changed, 1) is not None) == crashed


def test_the_ground_is_a_crash(calm: Trace) -> None:
    """Z points down: a height of 0 or less."""
    landed = with_sample(calm, "position_m", 2, 0.0)
    first_s = float(landed.time_s[landed.time_s >= 0.05][0])
    assert first_crash(landed, 1) == Crash(time_s=first_s, how="on the ground")


def test_below_a_low_target_the_ground_is_none(calm: Trace) -> None:
    """Before a take-off and after a landing a drone stands; with a target above 0.5 m it has fallen."""
    landed = with_sample(calm, "position_m", 2, 0.0)
    for height_m, crashed in ((0.5, False), (0.5001, True)):
        heights = np.broadcast_to([height_m, 0.0], (*landed.target.shape[:2], 2))
        lower = replace(landed, target=np.concatenate([landed.target, heights], axis=-1))
        assert detect_crashes(lower).tolist() == [False, crashed]
        assert (first_crash(lower, 1) is not None) == crashed


def test_a_lost_flight_counts_and_has_no_first_crash(calm: Trace) -> None:
    """NaN is neither tilt nor ground; `lost` says it."""
    lost = with_sample(with_sample(calm, "euler_rad", 0, np.nan), "position_m", 2, np.nan)
    assert detect_crashes(lost).tolist() == [False, True]
    assert first_crash(lost, 1) is None
