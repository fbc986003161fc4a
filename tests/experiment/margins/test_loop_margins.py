"""Margins against their definitions: a loop that is changed by one has a pole on the unit circle."""

import itertools
from collections.abc import Callable
from functools import partial
from typing import Any, Final

import control
import numpy as np
import pytest
from scipy.optimize import brentq

from mambo_sil.experiment.margins.hover_loop import PeriodicLoop
from mambo_sil.experiment.margins.loop_margins import LoopMargins, measure_loop

STEP_S: Final = 0.01
PERIOD_S: Final = 0.02
_S: Final = control.tf("s")
LOOPS: Final = {
    "an integrator with lags": 3.0 / (_S * (0.1 * _S + 1) * (0.03 * _S + 1)),
    "conditionally stable": 4.0 * (_S + 1) ** 2 / (_S**3 * (_S / 30 + 1) ** 2),
    "a resonance with a lead": 0.9 * _S * (_S / 1.7 + 1) / ((_S**2 + 0.3 * _S + 9.0) * (_S / 100 + 1) ** 2),
    "an unstable drone": 6.0 * (_S + 1) / (_S * (_S - 1) * (0.02 * _S + 1)),
    "two lower margins": 200.0 * (_S + 1) ** 2 / (_S * (10 * _S + 1) ** 2 * (_S / 30 + 1) ** 2),
    "a margin of a twentieth": 34.06 / (_S * (0.1 * _S + 1) * (0.03 * _S + 1)),
    "a lag of two steps": 2.0 / (0.02 * _S + 1),
    "a weak lag": 0.1 / (0.02 * _S + 1),
    "a weak resonance": 0.15 * _S / (_S**2 + 0.3 * _S + 9.0),
}


class Broken:
    """A loop of negative feedback with transition a, input b and output c in a step."""

    def __init__(self, loop: Any) -> None:
        system = control.ss(control.sample_system(loop, STEP_S))
        self.a, self.b, self.c = (np.asarray(one) for one in (system.A, system.B, system.C))

    def closed(self) -> PeriodicLoop:
        """Return the closed loop, from an addition at its input to what returns there."""
        feed = np.zeros((1, 1, 1))
        whole = self.a - self.b @ self.c
        return PeriodicLoop(STEP_S, whole[None], self.b[None], -self.c[None], feed, np.ones((1, 1), np.bool_))

    def size(self, gain: complex = 1.0) -> float:
        """Return the largest absolute pole with the loop's gain changed by a factor."""
        return float(np.abs(np.linalg.eigvals(self.a - gain * self.b @ self.c)).max())

    def size_turned(self, turn: complex, angle_rad: float) -> float:
        """Return the same with L times exp(turn angle)."""
        return self.size(np.exp(turn * angle_rad))

    def size_delayed(self, steps: int) -> float:
        """Return the largest absolute pole with a dead time of `steps`."""
        n = len(self.a)
        whole = np.zeros((n + steps, n + steps))
        whole[:n, :n] = self.a
        whole[:n, n + steps - 1 : n + steps] = self.b
        whole[n, :n] = -self.c[0]
        whole[n + 1 :, n:-1] = np.eye(steps - 1)
        return float(np.abs(np.linalg.eigvals(whole)).max())

    def returned(self, rad_s: Any) -> Any:
        """Return L (f,)."""
        z = np.exp(1j * rad_s * STEP_S)[:, None, None]
        return (self.c @ np.linalg.solve(z * np.eye(len(self.a)) - self.a, self.b[None]))[:, 0, 0]


@pytest.fixture(params=LOOPS)
def broken(request: pytest.FixtureRequest) -> Broken:
    """Each of the loops."""
    return Broken(LOOPS[request.param])


def margins(broken: Broken) -> LoopMargins:
    """Return the margins of a loop."""
    return measure_loop(broken.closed(), np.geomspace(0.02, np.pi / STEP_S, 2000), PERIOD_S)


def edge(size: Callable[[float], float], points: Any) -> float:
    """Return where, along increasing or decreasing points, the largest absolute pole first reaches 1."""
    for before, after in itertools.pairwise(points.tolist()):
        if size(after) >= 1.0 + 1e-9:
            return float(brentq(lambda at: size(at) - (1.0 + 1e-9), before, after, xtol=1e-12))
    return float("nan")


def test_every_loop_is_stable(broken: Broken) -> None:
    """Without a change."""
    assert broken.size() < 1.0


def test_gain_margins_are_factors_at_which_a_pole_reaches_the_unit_circle(broken: Broken) -> None:
    """Upwards and downwards; where none does, they are infinity and 0."""
    found = margins(broken)
    up, down = (edge(broken.size, np.geomspace(1.0, end, 1000)) for end in (900.0, 1.0 / 900.0))
    assert found.gain_up == pytest.approx(np.inf if np.isnan(up) else up, rel=1e-5)
    assert found.gain_down == pytest.approx(0.0 if np.isnan(down) else down, rel=1e-5)


def test_the_phase_margin_is_the_turn_that_a_loop_bears(broken: Broken) -> None:
    """Either way: L times exp(i angle), a complex gain."""
    found, angles = margins(broken), np.linspace(0.0, np.pi, 400)
    edges = [edge(partial(broken.size_turned, turn), angles) for turn in (1j, -1j)]
    if np.isnan(edges).all():
        assert found.phase_deg == found.delay_s == np.inf
        assert np.isnan(found.crossover_rad_s)
    else:
        assert np.radians(found.phase_deg) == pytest.approx(np.nanmin(edges), rel=1e-5)
        assert np.abs(broken.returned(np.array([found.crossover_rad_s]))) == pytest.approx(1.0, rel=1e-6)


def test_the_delay_margin_is_the_dead_time_that_a_loop_bears(broken: Broken) -> None:
    """With whole steps, of which one less is stable; a crossover beyond 180 degrees bears more, not less."""
    found = margins(broken)
    assert found.delay_updates == pytest.approx(found.delay_s / PERIOD_S)
    if found.delay_s == np.inf:
        assert max(broken.size_delayed(steps) for steps in (1, 2, 4, 8, 16, 32, 64)) < 1.0
        return
    unstable = next(steps for steps in range(1, 1000) if broken.size_delayed(steps) >= 1.0)
    assert unstable - 1 <= found.delay_s / STEP_S <= unstable


def test_sensitivities_are_the_largest_of_all_frequencies(broken: Broken) -> None:
    """On a fine grid: |1/(1+L)|, |L/(1+L)|, and where the first, if it begins below it, passes 1/sqrt(2)."""
    found, rad_s = margins(broken), np.geomspace(0.02, np.pi / STEP_S, 50_000)
    loop = broken.returned(rad_s)
    s, t = np.abs(1 / (1 + loop)), np.abs(loop / (1 + loop))
    assert found.sensitivity == pytest.approx(s.max(), rel=1e-5)
    assert found.sensitivity_rad_s == pytest.approx(rad_s[s.argmax()], rel=1e-3)
    assert found.complementary == pytest.approx(t.max(), rel=1e-5)
    if s.min() > np.sqrt(0.5):
        assert np.isnan(found.bandwidth_rad_s)
    elif s[0] < np.sqrt(0.5):
        assert found.bandwidth_rad_s == pytest.approx(rad_s[np.argmax(s > np.sqrt(0.5))], rel=1e-3)


@pytest.mark.parametrize(("margin", "found"), [(950.0, 950.0), (1050.0, np.inf)])
def test_a_margin_above_a_thousand_is_none(margin: float, found: float) -> None:
    """Upwards, of a loop of so small a gain."""
    loop = LOOPS["an integrator with lags"]
    weak = Broken(loop * margins(Broken(loop)).gain_up / margin)
    assert margins(weak).gain_up == pytest.approx(found, rel=1e-5)


def test_the_loops_differ_in_what_they_show() -> None:
    """One has two crossovers, the first beyond 180 degrees; one has none; two have a lower margin."""
    found = {name: margins(Broken(loop)) for name, loop in LOOPS.items()}
    rad_s = np.geomspace(0.02, np.pi / STEP_S, 20_000)
    loop = Broken(LOOPS["a resonance with a lead"]).returned(rad_s)
    first, last = np.flatnonzero((np.abs(loop[:-1]) > 1) != (np.abs(loop[1:]) > 1))
    assert np.degrees(np.angle(loop[[first, last]])) == pytest.approx([129.0, -20.0], abs=2.0)
    assert {name for name, one in found.items() if one.gain_down > 0.0} == {
        *("conditionally stable", "an unstable drone", "two lower margins")
    }
    assert found["two lower margins"].gain_down > 0.1, "not the lower of both"
    assert 1.0 < found["a margin of a twentieth"].gain_up < 1.1
    assert {name for name, one in found.items() if one.delay_s == np.inf} == {
        "a weak lag",
        "a weak resonance",
    }
