"""The benchmark of simulators: its scores, its laws and its tables; the simulators are not installed here."""

import importlib
from typing import Any

import numpy as np
import pytest

from benchmarks.evidence.item import Figures
from benchmarks.evidence.simulator_tables import (
    BOUNDLESS,
    FOUND_BOUNDLESS,
    L250,
    OURS,
    PRESET,
    aims,
    median,
    summary,
    through_noise,
    unrest,
    with_truth,
)
from benchmarks.simulators.missions import AWAY_S, MISSIONS, Flight3d, Mission, largest_mm
from benchmarks.simulators.pilots import Challenger, OurSettings, Sight, laws
from mambo_codegen.settings import presets
from mambo_nmpc.curves import Hover
from mambo_sil.drone.vehicles import vehicle_toml
from tests.support.tools import require_module

CRAZYFLIE = vehicle_toml.preset("crazyflie")


def flown(mission: Mission, *shifts_m: tuple[float, float, float]) -> Flight3d:
    """Return drones at a constant distance from their target."""
    position_m = mission.targets()[:, np.newaxis, :3] + np.array(shifts_m)
    return Flight3d(position_m, np.ones(position_m.shape[:2]))


def test_flights_are_judged_by_their_distance_or_their_height() -> None:
    """A curve by its root mean square in mm, a push by its largest; a crash has no score."""
    eight, push, heading = MISSIONS["eight"], MISSIONS["push"], MISSIONS["heading"]
    shifts = (0.03, 0.04, 0.0), (0.0, 0.0, -0.2), (0.0, 0.0, -1.0)
    assert eight.scores(flown(eight, *shifts)) == pytest.approx([50.0, 0.0, None])
    assert push.scores(flown(push, *shifts)) == pytest.approx([50.0, 0.0, None])
    assert heading.scores(flown(heading, *shifts)) == pytest.approx([1.0, 0.8, None])
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


@pytest.mark.parametrize("name", ["step", "far step", "eight", "circle", "heading"])
def test_a_planned_target_is_smooth_and_ends_with_the_others(name: str) -> None:
    """It begins at rest; its velocity and acceleration are its derivatives."""
    mission = MISSIONS[name]
    planned, jump = mission.targets(planned=True), mission.targets()
    np.testing.assert_allclose(planned[-1], jump[-1], atol=1e-9)
    np.testing.assert_allclose(planned[0, 3:9], 0.0, atol=1e-9)
    assert np.abs(np.diff(planned[:, 9])).max() < 0.041
    for rate, of in ((slice(3, 6), slice(0, 3)), (slice(6, 9), slice(3, 6))):
        np.testing.assert_allclose(np.gradient(planned[:, of], 0.01, axis=0), planned[:, rate], atol=0.05)


def test_things_happen_when_they_should() -> None:
    """A push for 5 s, a weight and a heading for good."""
    push, payload, heading = (MISSIONS[name] for name in ("push", "payload", "heading"))
    assert [push.force_m_s2(time_s)[0] for time_s in (4.0, 6.0, 11.0)] == [0.0, 1.0, 0.0]
    assert payload.force_m_s2(AWAY_S + 1.0)[2] < -1.0
    assert heading.targets()[[0, -1], 9].tolist() == [0.0, 2.0]


def test_every_pilot_flies_towards_its_target() -> None:
    """Forward and left of it, and up; with a true state and through noise."""
    target = np.array([0.5, 0.3, 1.1, *np.zeros(7)])
    seen = Sight(np.tile([0.0, 0.0, 1.0], (2, 1)), np.zeros((2, 3)), np.zeros((2, 3)))
    challengers: dict[str, Challenger] = {
        **laws(CRAZYFLIE),
        "ours": OurSettings(presets.preset("crazyflie"), CRAZYFLIE),
    }
    assert len(challengers) == 3
    for challenger in challengers.values():
        for noisy in (False, True):
            command = challenger.pilot(2, 0.03, noisy=noisy).command(seen, target)
            assert command.shape == (2, 4)
            assert (command[:, 1] > 0.0).all()  # nose down, in NWU
            assert (command[:, 0] < 0.0).all()
            assert (command[:, 3] > 0.03 * 9.81).all()


def test_rotorpy_is_flown_by_its_controller_and_by_ours() -> None:
    """Both hold a place through noise; ours knows the age of what it sees."""
    require_module("rotorpy")
    rotorpy_flights: Any = importlib.import_module("benchmarks.simulators.rotorpy_flights")
    hover = Mission("hover", Hover(), 2.0, largest_mm)
    ours = OurSettings(presets.preset("crazyflie"), CRAZYFLIE)
    for challenger in (rotorpy_flights.Geometric(), ours):
        position_m, level, commands = rotorpy_flights.fly(challenger, hover, 0)
        assert position_m.shape == (201, 3)
        assert commands.shape == (201, 4)
        assert np.linalg.norm(position_m - [0.0, 0.0, 1.0], axis=1).max() < 0.02
        assert level.min() > 0.99


def test_tables_show_spread_and_loss() -> None:
    """The median with its range, how many were lost, and the best of each column."""
    cell = {"truth": 1.0, "noise": [2.0, 4.0, 3.0, None, 5.0], "unrest_rad": 0.002}
    gone = {"truth": None, "noise": [None] * 5, "unrest_rad": 0.1}
    figures = {
        "RotorPy": {"theirs": dict.fromkeys(MISSIONS, gone), "ours": dict.fromkeys(MISSIONS, cell)},
    }
    assert median(cell) == 4.0
    assert median({"noise": [1.0, None, None]}) is None
    assert "| ours | **4.00 (2.00..5.00, 1 lost)** |" in through_noise(figures)
    assert "| theirs | lost |" in with_truth(figures)
    assert "| ours | 2.00 |" in unrest(figures)


def test_tables_show_best_worst_and_aims() -> None:
    """Of others and of ours; variants that show what a part is worth are neither."""
    scores = dict(zip(("Mellinger", *OURS, BOUNDLESS), (5.0, 1.0, 2.0, 3.0, 4.0, 9.0), strict=True))
    lost = {name: {"noise": [None, 1.0, None]} for name in MISSIONS}
    flights: Figures = {who: {name: {"noise": [score]} for name in MISSIONS} for who, score in scores.items()}
    flights |= {FOUND_BOUNDLESS: lost}
    row = summary({"RotorPy": flights}).splitlines()[2].split(" | ")
    assert row[1] == "5.00; 1.00..4.00"
    assert row[-1] == "5.00; 4.00..1.00 |"  # a height
    crashed = summary({"RotorPy": flights | {PRESET: lost}}).splitlines()[2].split(" | ")
    assert crashed[1] == "5.00; 2.00..lost"
    text = aims(dict.fromkeys(L250, flights))
    assert "| eight; identified | 2.0 | 4.00 | 1.8 | 4.00 |" in text
    assert "| step; identified, without limits | 1.0 | lost | 1.0 | lost |" in text
