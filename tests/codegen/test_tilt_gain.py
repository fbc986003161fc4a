"""The learnt gain of the tilt: its equations by another route, and when it learns nothing."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.methods.quadratic.controller import QuadraticController
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.methods.quadratic.tilt_gain import TiltGain, TiltGainState
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.height import CRAZYFLIE
from tests.support.quadratic import settings_of, told

LEVEL = settings_of(
    {
        "controller.method": "quadratic",
        "model.roll_lag_s": 0.1,
        "model.pitch_lag_s": 0.1,
        "limits.tilt_rad": 0.5,
        "code.scalar": "float64",
        "observer.tilt_gain": "learnt",
    }
)
HIGH = settings_of(CRAZYFLIE | {"code.scalar": "float64", "observer.tilt_gain": "learnt"})


def controller(settings: Settings, gain: float = 1.0) -> QuadraticController:
    """Return a controller that has learnt a gain."""
    found = Quadratic(settings).reference_controller()
    learnt = replace(found.memory.tilt_gain, gain=np.full((1, 2), gain))
    found.memory = replace(found.memory, tilt_gain=learnt)
    return found


def part(settings: Settings) -> TiltGain:
    """Return the part of the controller that learns."""
    found = controller(settings).parts.tilt_gain
    assert found is not None
    return found


def state(**tilts_m_step2: float) -> TiltGainState:
    """Return means, 0 but for those that are given, and a gain of 1."""
    values = (
        dict.fromkeys(("quick_m_step2", "slow_m_step2", "seen_quick_m_step2", "seen_slow_m_step2"), 0.0)
        | {"gain": 1.0}
        | tilts_m_step2
    )
    return TiltGainState(**{name: np.full((1, 2), value) for name, value in values.items()})


def learning() -> Callable[..., TiltGainState]:
    """Return a function that gives the state after a state and a step with two accelerations, m/step^2."""
    learns, pair, limit = part(LEVEL), np.ones((1, 2)), np.full((1, 1), 0.5)

    def step(before: TiltGainState, model: float, seen: float, command_rad: float = 0.0) -> TiltGainState:
        return learns.learn(before, model * pair, seen * pair, command_rad * pair, limit)

    return step


def test_the_means_are_low_passes_of_4_and_half_a_rad_per_second() -> None:
    """A step reaches 1 - 1/e after 1/4 s and 2 s; a sine of the corner frequency keeps 1/sqrt(2)."""
    learnt = learning()
    step_s, found = LEVEL.horizon.update_period_s, state()
    for _ in range(round(2.0 / step_s)):
        found = learnt(found, 1e-6, 2e-6)
    assert found.slow_m_step2[0] == pytest.approx(1e-6 * (1 - math.exp(-1.0)))
    assert found.quick_m_step2[0] == pytest.approx(1e-6 * (1 - math.exp(-8.0)))
    assert found.seen_slow_m_step2[0] == pytest.approx(2 * found.slow_m_step2[0])
    assert found.seen_quick_m_step2[0] == pytest.approx(2 * found.quick_m_step2[0])
    swings = []
    for k in range(3000):
        found = learnt(found, 1e-6 * math.sin(4.0 * k * step_s), 0.0)
        swings.append(found.quick_m_step2[0, 0])
    assert max(swings[-500:]) == pytest.approx(1e-6 / math.sqrt(2), rel=0.03)


@pytest.mark.parametrize(("seen_m_s2", "rate_1_s"), [(2.5, 0.3), (1.5, -0.3), (9.0, 0.6), (-9.0, -0.6)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_error_changes_the_gain_by_its_size(seen_m_s2: float, rate_1_s: float, sign: float) -> None:
    """0.6 of it in a second for 1 m/s^2, which is the largest that counts, whichever way the drone tilts."""
    learnt = learning()
    step_s = LEVEL.horizon.update_period_s
    unit = sign * step_s**2
    steady = {"quick_m_step2": 2.0 * unit, "seen_quick_m_step2": seen_m_s2 * unit}
    found = learnt(state(**steady), 2.0 * unit, seen_m_s2 * unit)
    assert found.gain - 1.0 == pytest.approx(np.full((1, 2), rate_1_s * step_s), rel=0.02)


def test_the_gain_stays_between_half_and_1_6() -> None:
    """However long the drone tilts by less, or by more."""
    learnt = learning()
    unit = LEVEL.horizon.update_period_s**2
    for seen, end in ((0.0, 0.5), (9.0, 1.6)):
        found = state()
        for k in range(2000):
            swing = 3.0 * unit * math.sin(0.02 * k)
            found = learnt(found, swing, seen / 3.0 * swing)
        assert found.gain.tolist() == [[end, end]]


def test_little_is_no_reason_to_learn_nor_is_a_command_at_the_limit() -> None:
    """Below 0.25 m/s^2 of the model, and beyond 90 % of the tilt limit, as the drone tilts."""
    learnt = learning()
    unit = LEVEL.horizon.update_period_s**2
    for model, command_rad, learns in (
        (0.24, 0.0, False),
        (0.26, 0.0, True),
        (2.0, 0.449, True),
        (2.0, 0.451, False),
        (2.0, -0.451, False),
    ):
        steady = {"quick_m_step2": model * unit, "seen_quick_m_step2": 2 * model * unit}
        found = learnt(state(**steady), model * unit, 2 * model * unit, command_rad)
        assert (found.gain[0, 0] != 1.0) == learns, (model, command_rad)
    wide = learnt(state(quick_m_step2=2 * unit, gain=1.5), 2 * unit, 0.0, 0.31)
    assert wide.gain.tolist() == [[1.5, 1.5]]
    assert learnt(state(quick_m_step2=2 * unit, gain=1.5), 2 * unit, 0.0, 0.29).gain[0, 0] < 1.5


def test_what_is_sent_and_what_is_meant_are_inverse() -> None:
    """For every gain."""
    learns, command = part(LEVEL), np.full((1, 2), 0.3)
    for gain in np.linspace(0.5, 1.6, 12):
        found = state(gain=float(gain))
        assert learns.sent(found, command) == pytest.approx(command / gain, rel=2e-7)
        assert learns.meant(found, learns.sent(found, command)) == pytest.approx(command, rel=2e-7)


@pytest.mark.parametrize("gain", [0.6, 0.8, 1.3])
def test_a_drone_that_tilts_more_gets_smaller_commands(gain: float) -> None:
    """The first command is that of the model over the gain; at the limit it stays within it."""
    states = np.zeros((1, 7))
    for target_m, is_free in ((0.05, True), (50.0, False)):
        targets = told([[target_m, -target_m, 0.0, 0.0]])
        thrust = np.full(1, 9.81)
        plain = controller(LEVEL).step(states, targets, thrust)
        found = controller(LEVEL, gain).step(states, targets, thrust)
        limit = LEVEL.limits.tilt_rad
        if is_free:
            assert found.command_rad == pytest.approx(plain.command_rad / gain, rel=1e-6)
        else:
            assert np.abs(found.command_rad) == pytest.approx(min(limit, limit / gain), rel=1e-6)
        assert found.saturated[0] == (not is_free)


def test_a_command_that_was_sent_means_more_to_the_model_of_a_drone_that_tilts_more() -> None:
    """The change of the model's command is that of the settings' model, times the gain."""
    sent = np.array([[0.1, -0.2]])
    moved = []
    for gain in (1.0, 1.4):
        found = controller(LEVEL, gain)
        found.report_command(sent)
        moved.append(found.memory.attitude.command)
    assert moved[1] == pytest.approx(1.4 * moved[0])


def test_on_the_floor_and_without_a_state_nothing_is_learnt() -> None:
    """The means of a drone on the floor start anew, those of one without a state stay; a reset forgets."""
    found = controller(HIGH, 1.2)
    found.memory = replace(found.memory, steps_blind=np.zeros(1, np.int64))
    seen = np.zeros((1, 10))
    seen[:, 4], target = 0.3, np.zeros((1, len(Quadratic(HIGH).target)))
    for _ in range(50):
        found.step(seen, target)
    gain = found.memory.tilt_gain.gain
    assert gain[0, 0] < 1.1
    before = found.memory.tilt_gain
    found.step(np.full_like(seen, np.nan), target)
    assert _numbers(found.memory.tilt_gain) == _numbers(before)
    seen[:, 9] = 1.0
    for _ in range(50):
        found.step(seen, target)
    after = found.memory.tilt_gain
    assert after.gain.tolist() == gain.tolist()
    assert after.seen_quick_m_step2.tolist() == after.seen_slow_m_step2.tolist()
    found.frame_jumped(np.array([[1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.5]]))
    assert _numbers(found.memory.tilt_gain) == _numbers(after)
    found.reset(np.array([[0.0, 0.0, 9.81]]))
    assert found.memory.tilt_gain.gain.tolist() == [[1.0, 1.0]]


def _numbers(found: TiltGainState) -> Any:
    return [value.tolist() for value in vars(found).values()]


@pytest.mark.parametrize("settings", [LEVEL, HIGH])
def test_it_stores_four_means_and_a_gain_of_each_angle(settings: Settings) -> None:
    """Behind the attitude model, as nmpc_t has them."""
    stored = Quadratic(settings).stored
    without = Quadratic(with_option(settings, "observer.tilt_gain", "given")).stored
    assert stored == (*without[:16], *["acceleration"] * 8, *["factor"] * 2, *without[16:])
    assert len(controller(settings).stored[0]) == len(stored)


def test_without_it_the_c_is_that_of_before() -> None:
    """No word of it."""
    files = render(with_option(HIGH, "observer.tilt_gain", "given"), with_digest=False)
    assert "tilt_gain" not in files["nmpc.c"] + files["nmpc.h"]
    assert "tilt_gain_sent(&self->tilt_gain, " in render(HIGH, with_digest=False)["nmpc.c"]
