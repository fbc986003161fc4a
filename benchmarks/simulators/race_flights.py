"""Laps of examples/race.py in crazyflow: 24 drawn drones, noise of actions and forces, gates 40 cm wide.

Masses +-5 g, inertias, places and attitudes at the start, and noise are as in level 1 of the course
lsy_drone_racing, which commands at 50 Hz; the gates are ours. Flies the plan, and splines through the same
points, whose times in s are arguments.
"""

import importlib.util
import sys
from pathlib import Path
from typing import Any, Final

import numpy as np
from crazyflow.sim import Sim
from scipy.spatial.transform import Rotation

from benchmarks.flights.laps import spline
from mambo_extensions.plan.hermite import pieces_of
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.polynomials import PiecesInSpace

EXAMPLE: Final = Path(__file__).parents[2] / "examples" / "race.py"
DRONES: Final = 24
FREQ_HZ, TICKS = 500, 10
ACTION_NOISE, MOST_FORCE_N = 0.001, 0.1
RADIUS_M, ABOVE_M = 0.086, 0.02
"""Of the ball by which crazyflow's drone touches others, and how far above the centre of mass it is."""
OPENING_M, FRAME_M = 0.4, 0.72
AFTER_S: Final = 0.5


def racing() -> Any:
    """Return the example as a module."""
    spec = importlib.util.spec_from_file_location("race", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def drawn(start_m: FloatArray, random: np.random.Generator) -> Any:
    """Return a simulation of drones near a start, whose masses and inertias differ."""
    sim = Sim(n_worlds=DRONES, drone="cf21B_500", dynamics="first_principles", freq=FREQ_HZ)
    sim.reset()
    states, params = sim.data.states, sim.data.params
    places_m = start_m + random.uniform([-0.1, -0.1, 0.0], [0.1, 0.1, 0.02], (DRONES, 1, 3))
    lean = Rotation.from_euler("xyz", random.uniform(-0.1, 0.1, (DRONES, 3))).as_quat()[:, np.newaxis]
    mass_kg = np.ravel(params.mass)[0] + random.uniform(-0.005, 0.005, (DRONES, 1, 1))
    inertia = np.asarray(params.J) + np.eye(3) * random.uniform(-1e-6, 1e-6, (DRONES, 1, 3, 1))
    kind = np.float32
    inverse = np.linalg.inv(inertia).astype(kind)
    sim.data = sim.data.replace(
        states=states.replace(pos=places_m.astype(kind), quat=lean.astype(kind)),
        params=params.replace(mass=mass_kg.astype(kind), J=inertia.astype(kind), J_inv=inverse),
    )
    return sim


def flown(sim: Any, racers: list[Any], random: np.random.Generator, duration_s: float) -> FloatArray:
    """Return where the balls of the drones were at each tick (k, n, 3)."""
    balls = []
    for _ in range(round(duration_s * FREQ_HZ / TICKS)):
        states = sim.data.states
        seen = [np.asarray(part, np.float64)[:, 0] for part in (states.pos, states.vel, states.quat)]
        commands = np.array(
            [
                racer.compute_control({"pos": position, "vel": velocity, "quat": quaternion})
                for racer, position, velocity, quaternion in zip(racers, *seen, strict=True)
            ]
        )
        noisy = commands + random.normal(0.0, ACTION_NOISE, commands.shape)
        sim.attitude_control(noisy[:, np.newaxis].astype(np.float32))
        for _ in range(TICKS):
            force_n = random.uniform(-MOST_FORCE_N, MOST_FORCE_N, (DRONES, 1, 3)).astype(np.float32)
            sim.data = sim.data.replace(states=sim.data.states.replace(force=force_n))
            sim.step()
            position = np.asarray(sim.data.states.pos)[:, 0]
            upright = Rotation.from_quat(np.asarray(sim.data.states.quat)[:, 0])
            balls.append(position + upright.apply([0.0, 0.0, ABOVE_M]))
    return np.array(balls)


def passed_s(balls: FloatArray, gates: FloatArray) -> float:
    """Return when the ball (k, 3) of a drone has passed all gates in turn; NaN if not, or after a touch."""
    tick, touch = 0, len(balls)
    for gate in gates:
        ahead = gate[3:]
        left = np.array([-ahead[1], ahead[0], 0.0])
        place = (balls - gate[:3]) @ np.stack([ahead, left, [0.0, 0.0, 1.0]], axis=1)
        off_m = np.abs(place[:-1, 1:]).max(axis=1)
        crossed = np.sign(place[:-1, 0]) != np.sign(place[1:, 0])
        free = (off_m < OPENING_M / 2.0 - RADIUS_M) | (off_m > FRAME_M / 2.0 + RADIUS_M)
        touch = min([touch, *np.flatnonzero(crossed & ~free)])
        through = crossed & (place[1:, 0] >= 0.0) & (off_m < OPENING_M / 2.0)
        later = np.flatnonzero(through[tick:])
        if not len(later):
            return float("nan")
        tick += int(later[0])
    return tick / FREQ_HZ if tick < touch else float("nan")


class Laps:
    """Flies curves through the gates of the example, each with the same drawn drones."""

    def __init__(self) -> None:
        self._race = racing()
        self._gates = np.array(self._race.GATES, np.float64)
        turns = np.arctan2(self._gates[:, 4], self._gates[:, 3])[:, np.newaxis] * [0.0, 0.0, 1.0]
        self._seen = {
            "gates_pos": self._gates[:, :3],
            "gates_quat": Rotation.from_rotvec(turns).as_quat(),
        }

    def fly(self, curve: PiecesInSpace | None = None) -> str:
        """Return how many drones finish, when the last does, and when it should; None: the racer's plan."""
        random = np.random.default_rng(0)
        track = {"env": {"track": {"drones": [{"pos": self._race.START}]}}}
        racers = [self._race.Racer(self._seen, {}, track) for _ in range(DRONES)]
        for racer in racers:
            racer.curve = curve or racer.curve
        flown_curve = racers[0].curve
        ends_s = np.cumsum([piece.duration_s for piece in flown_curve.pieces])
        due_s = [end_s for end_s, point in zip(ends_s, flown_curve.points or ends_s, strict=True) if point][
            -2
        ]
        sim = drawn(np.array(self._race.START), random)
        balls = flown(sim, racers, random, flown_curve.duration_s + AFTER_S)
        times_s = np.array([passed_s(balls[:, drone], self._gates) for drone in range(DRONES)])
        finished = times_s[np.isfinite(times_s)]
        last = f", the last after {finished.max():.2f} s" if finished.size else ""
        return f"last gate due after {due_s:.2f} s: {finished.size} of {DRONES} drones finish{last}"

    def spline(self, time_s: float) -> PiecesInSpace:
        """Return a spline of least snap through the plan's points."""
        gates_m = self._gates[:, :3] - [0.0, 0.0, self._race.BELOW_M]
        behind_m = self._gates[-1, :3] + 0.5 * self._gates[-1, 3:]
        start_m = np.add(self._race.START, (0.0, 0.0, 0.2))
        course = spline(np.vstack([start_m, gates_m, behind_m]), time_s)
        return pieces_of(course.knots, course.duration_s)


def main() -> None:
    """Print how the plan is flown, and each spline."""
    laps = Laps()
    print(f"plan: {laps.fly()}")
    for time_s in map(float, sys.argv[1:]):
        print(f"spline: {laps.fly(laps.spline(time_s))}")


if __name__ == "__main__":
    main()
