"""Flights in simulators of one drone: contestants, noise, search for gains, and what is yielded."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, Protocol

import numpy as np

from benchmarks.simulators.missions import (
    LEAST_HEIGHT_M,
    MISSIONS,
    STEP_S,
    TUNED_ON,
    Flight3d,
    Mission,
    Score,
    cost_of,
)
from benchmarks.simulators.pilots import Sight, as_seen, through
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.sensors.mocap import MocapSuite, MotionCapture
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors

SEEDS: Final = (101, 102, 103)
SEARCH_SEED: Final = 201
CANDIDATES: Final = 30


class Contestant(Protocol):
    """A simulated drone with its controller."""

    period_s: float

    def begin(self, position_m: FloatArray, seed: int | None) -> None:
        """Place a drone at rest (3,), and start the controller afresh; without a seed it knows its state."""
        ...

    def sight(self) -> Sight:
        """Return the true state of the drone."""
        ...

    def advance(self, seen: Sight, target: FloatArray, force_m_s2: FloatArray) -> None:
        """Fly to a target (9,) for one period, under a force over the mass (3,)."""
        ...


def fly_alone(one: Contestant, mission: Mission, seed: int | None, noise: MocapSensors | None) -> Flight3d:
    """Return one flight, of which nothing is known after a crash."""
    targets, times_s = mission.targets(one.period_s), mission.times_s(one.period_s)
    position_m, level = np.full((len(times_s), 1, 3), np.nan), np.full((len(times_s), 1), -1.0)
    one.begin(targets[0, :3], seed)
    suite = None
    if noise is not None and seed is not None:
        suite = MocapSuite(MotionCapture(noise), (seed,), as_seen(one.sight()), STEP_S)
    for step, target in enumerate(targets):
        true = one.sight()
        position_m[step] = true.position_m
        level[step] = np.cos(true.angles_rad[:, 0]) * np.cos(true.angles_rad[:, 1])
        if not (true.position_m[0, 2] > LEAST_HEIGHT_M and np.abs(true.position_m).max() < 40.0):
            break
        seen = true if suite is None else through(suite, true)
        one.advance(seen, target, mission.force_m_s2(float(times_s[step])))
    return Flight3d(position_m, level)


def search(
    made: Callable[[FloatArray], Contestant],
    factors: int,
    noise: MocapSensors | None,
    missions: Mapping[str, Mission] = TUNED_ON,
) -> tuple[Contestant, list[float]]:
    """Return the best of 30 random candidates, the first of which has its own gains, and its factors.

    made: returns a contestant whose gains are multiplied by factors (k,), between a third and three.
    """
    draws = np.random.default_rng(7)
    best: tuple[float, FloatArray] | None = None
    for number in range(CANDIDATES):
        tried = np.exp(draws.uniform(-1.1, 1.1, factors)) if number else np.ones(factors)
        scores: dict[str, Score] = {}
        for name, mission in missions.items():
            one = made(tried)
            scores[name] = mission.scores(fly_alone(one, mission, SEARCH_SEED, noise), one.period_s)[0]
            if best is not None and cost_of(scores) > best[0]:
                break
        if best is None or cost_of(scores) < best[0]:
            best = cost_of(scores), tried
    assert best is not None
    return made(best[1]), [float(f"{factor:.3g}") for factor in best[1]]


def measure(
    title: str,
    contestants: Mapping[str, Callable[[], Contestant]],
    noise: MocapSensors | None,
    seeds: Sequence[int] = SEEDS,
    missions: Mapping[str, Mission] = MISSIONS,
) -> Iterator[tuple[str, dict[str, Any], Mapping[str, Any]]]:
    """Yield title, scores by controller and mission, and the paths of the first seed on the eight (k, 3)."""
    figures: dict[str, dict[str, Any]] = {who: {} for who in contestants}
    paths: dict[str, Any] = {}
    for who, made in contestants.items():
        one = made()
        for name, mission in missions.items():
            flights = [fly_alone(one, mission, seed, noise) for seed in seeds]
            scores = [mission.scores(flown, one.period_s)[0] for flown in flights]
            figures[who][name] = scores
            if name == "eight":
                paths[who] = flights[0].position_m[:, 0]
        print(f"{title}: {who}", flush=True)
    yield title, figures, paths
