"""The benchmark of simulators: its scores, its search and its tables; RotorPy alone is installed here."""

import importlib
from typing import Any

import numpy as np
import pytest

from benchmarks.evidence.item import Figures
from benchmarks.evidence.simulator_tables import PAGE, every_controller, median, summary
from benchmarks.simulators.missions import (
    AWAY_S,
    LOST,
    MISSIONS,
    STEP_S,
    Flight3d,
    Mission,
    cost_of,
    largest_mm,
)
from benchmarks.simulators.pilots import Challenger, Designed, Preset, Sight
from benchmarks.simulators.single import CANDIDATES, fly_alone, measure, search
from mambo_nmpc.curves import Hover
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles import vehicle_toml
from tests.support.tools import require_module

CRAZYFLIE = vehicle_toml.preset("crazyflie")


def flown(mission: Mission, *shifts_m: tuple[float, float, float]) -> Flight3d:
    """Return drones at a constant distance from their target."""
    position_m = mission.targets()[:, np.newaxis, :3] + np.array(shifts_m)
    return Flight3d(position_m, np.ones(position_m.shape[:2]))


def test_flights_are_judged_by_their_distance_in_space() -> None:
    """A curve by its root mean square in mm, a push by its largest; a crash has no score."""
    eight, push = MISSIONS["eight"], MISSIONS["push"]
    shifts = (0.03, 0.04, 0.0), (0.0, 0.0, -0.2), (0.0, 0.0, -1.0)
    assert eight.scores(flown(eight, *shifts)) == pytest.approx([50.0, 200.0, None])
    assert push.scores(flown(push, *shifts)) == pytest.approx([50.0, 200.0, None])
    tilted = flown(eight, shifts[0])
    tilted.level[100] = 0.1
    assert eight.scores(tilted) == [None]
    lost = flown(eight, shifts[0])
    lost.position_m[700:] = np.nan
    assert eight.scores(lost) == [None]


def test_a_step_is_judged_by_the_time_to_5_cm() -> None:
    """From the step on, for good; a drone that does not arrive has no score."""
    step = MISSIONS["step"]
    late = flown(step, (0.0, 0.0, 0.0))
    late.position_m[100:250, 0, 0] = 0.9  # until 2.49 s
    assert step.scores(late) == pytest.approx([1.5])
    assert step.scores(flown(step, (0.06, 0.0, 0.0))) == [None]


@pytest.mark.parametrize("name", ["eight", "circle", "space", "mass"])
def test_curves_begin_at_rest(name: str) -> None:
    """And then go on at the rate of the curve; velocity and acceleration are derivatives."""
    targets = MISSIONS[name].targets()
    np.testing.assert_allclose(targets[0, 3:], 0.0, atol=1e-9)
    for rate, of in ((slice(3, 6), slice(0, 3)), (slice(6, 9), slice(3, 6))):
        np.testing.assert_allclose(np.gradient(targets[:, of], STEP_S, axis=0), targets[:, rate], atol=0.05)


def test_things_happen_when_they_should() -> None:
    """A push for 5 s, a weight for good; nothing else changes with the period of the commands."""
    push, mass = MISSIONS["push"], MISSIONS["mass"]
    assert [push.force_m_s2(time_s)[0] for time_s in (4.0, 6.0, 11.0)] == [0.0, 1.0, 0.0]
    assert mass.force_m_s2(AWAY_S + 1.0)[2] == pytest.approx(-0.2 * 9.81)
    np.testing.assert_allclose(mass.targets(0.02)[300], mass.targets()[600], atol=1e-12)


@pytest.mark.parametrize("challenger", [Designed(CRAZYFLIE), Preset(CRAZYFLIE)])
@pytest.mark.parametrize("noisy", [False, True])
def test_every_pilot_flies_towards_its_target(challenger: Challenger, noisy: bool) -> None:
    """Forward and left of it, and up; with a true state and through noise."""
    target = np.array([0.5, 0.3, 1.1, *np.zeros(6)])
    seen = Sight(np.tile([0.0, 0.0, 1.0], (2, 1)), np.zeros((2, 3)), np.zeros((2, 3)))
    command = challenger.pilot(2, 0.03, noisy=noisy).command(seen, target)
    assert command.shape == (2, 4)
    assert (command[:, 1] > 0.0).all()  # nose down, in NWU
    assert (command[:, 0] < 0.0).all()
    assert (command[:, 3] > 0.03 * 9.81).all()


class PointMass:
    """A contestant whose stiffness is the square of a factor, with a damping that overshoots far from 1."""

    period_s = 0.02

    def __init__(self, factors: FloatArray) -> None:
        self.stiffness = 4.0 * float(factors[0])

    def begin(self, position_m: FloatArray, seed: int | None) -> None:  # noqa: ARG002 - has no noise
        """Place it at rest."""
        self.position_m, self.velocity_m_s = np.array(position_m), np.zeros(3)

    def sight(self) -> Sight:
        """Return where it is."""
        return Sight(self.position_m[np.newaxis], self.velocity_m_s[np.newaxis], np.zeros((1, 3)))

    def advance(self, seen: Sight, target: FloatArray, force_m_s2: FloatArray) -> None:
        """Fly to a target."""
        error_m, slow_m_s = target[:3] - seen.position_m[0], target[3:6] - seen.velocity_m_s[0]
        pulled_m_s2 = self.stiffness * error_m + 4.0 * slow_m_s + target[6:] + force_m_s2
        self.velocity_m_s = self.velocity_m_s + self.period_s * pulled_m_s2
        self.position_m = self.position_m + self.period_s * self.velocity_m_s


def test_a_search_finds_better_gains() -> None:
    """A stiffer one is pushed less far; the first candidate has its own gains."""
    best, factors = search(PointMass, 1, None)
    assert isinstance(best, PointMass)
    own, found = (
        MISSIONS["push"].scores(fly_alone(one, MISSIONS["push"], 1, None), one.period_s)[0]
        for one in (PointMass(np.ones(1)), best)
    )
    assert own is not None
    assert found is not None
    assert found < 0.75 * own
    assert factors[0] > 1.3
    assert CANDIDATES == 30


def test_a_lost_flight_costs_most() -> None:
    """And no other costs more."""
    assert cost_of({"space": 30.0, "step": 1.0, "push": 80.0}) == 3.0
    assert cost_of({"space": None, "step": 1e6}) == 2.0 * LOST


def test_rotorpy_is_flown_by_its_controller_and_by_ours() -> None:
    """Both hold a place through noise, in steps of the one and of the other."""
    require_module("rotorpy")
    flights: Any = importlib.import_module("benchmarks.simulators.rotorpy_flights")
    hover = Mission("hover", Hover(), 1.0, largest_mm)
    for challenger in (np.ones(6), Designed(flights.HUMMINGBIRD)):
        one = flights.RotorpyDrone(challenger)
        path = fly_alone(one, hover, 1, flights.noise())
        assert path.position_m.shape == (101, 1, 3)
        assert np.linalg.norm(path.position_m[:, 0] - [0.0, 0.0, 1.0], axis=1).max() < 0.02
        assert path.level.min() > 0.99


def test_scores_are_kept_by_controller_and_mission() -> None:
    """With each seed; the path of the first on the eight."""
    one = PointMass(np.ones(1))
    ((title, figures, paths),) = measure("a point", {"own": lambda: one}, None, seeds=(1, 2))
    assert title == "a point"
    assert list(figures["own"]) == list(MISSIONS)
    assert all(len(scores) == 2 for scores in figures["own"].values())
    assert paths["own"].shape == (1001, 3)


def test_tables_show_spread_and_loss() -> None:
    """The median with its range, how many were lost, and the best of each column."""
    some, gone = [2.0, 4.0, 3.0, None, 5.0], [None] * 5
    assert median(some) == 4.0
    assert median([1.0, None, None]) is None
    figures: Figures = {
        "a drone": {
            "theirs": dict.fromkeys(MISSIONS, gone),
            "theirs, tuned": dict.fromkeys(MISSIONS, [7.0] * 3),
            PAGE: dict.fromkeys((*MISSIONS, "wind"), some),
        },
    }
    figures["a drone"]["theirs"]["wind"] = figures["a drone"]["theirs, tuned"]["wind"] = gone
    table = every_controller(figures)
    assert f"| {PAGE} | **4.00 (2.00..5.00, 1 lost)** |" in table
    assert "| theirs | lost |" in table
    assert "| theirs, tuned | 7.00 (7.00..7.00) |" in table
    row = summary(figures).splitlines()[2]
    assert row.startswith("| a drone: theirs | lost; 7.00; **4.00** |")
    assert row.endswith("| lost; lost; **4.00** |")
