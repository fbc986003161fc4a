"""Flights with a preview: in engine and NumPy, behind the end of a piece, and with late set-points."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight import loop
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.thrust_controller import adapted
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.polynomials import Piece, Pieces
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.flight.trajectories import CURVES, Bernoulli, Trajectory, vertical_of
from tests.support.height import CRAZYFLIE
from tests.support.quadratic import settings_of

DRONE = vehicle_toml.load("crazyflie")
TOLD = settings_of(
    CRAZYFLIE | {"target.acceleration": "preview", "model.tilt": "exact", "limits.tilt_rad": 0.7}
)
PIECE = Piece(1.5, (0.0, 0.0, 0.0, 4.0, -4.0, 1.0, 0.0, 0.0), (0.0,) * 8, (0.0,) * 8)
"""It ends with a velocity and an acceleration."""


class Late:
    """A controller whose set-point, preview and all, is repeated from 2 s on for a number of updates."""

    def __init__(self, updates: int) -> None:
        self.controller = adapted(CompiledController(TOLD, 1))
        self._update, self._late, self._target = 0, range(200, 200 + updates), np.zeros(0)

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Any:
        """Step with the last set-point while the next ones are late."""
        if self._update not in self._late:
            self._target = target
        self._update += 1
        return self.controller.step(state, self._target, thrust_acceleration_m_s2)


def flight_on(course: Trajectory, duration_s: float, drones: int = 2) -> Flight:
    """Return the flights of drones of several headings in wind through motion capture."""
    flights = [
        Scenario(
            vehicle=DRONE,
            seed=number,
            trajectory="hover",
            duration_s=duration_s,
            yaw_rad=2.0 * number,
            sensors="mocap",
            wind_speed_m_s=1.0,
        )
        for number in range(drones)
    ]
    return replace(flight_of(flights, 0.01), trajectory=course)


def errors_m(course: Trajectory, duration_s: float) -> tuple[FloatArray, FloatArray]:
    """Fly a course, and return the times (k,) and the horizontal distances from its target (k, n)."""
    trace = fly(flight_on(course, duration_s), CompiledController(TOLD, 2))
    return trace.time_s, np.linalg.norm(trace.position_m[..., :2] - trace.target[..., :2], axis=-1)


@pytest.mark.parametrize("name", ["bernoulli", "helix"])
def test_the_engine_has_the_bits_of_numpy(name: str) -> None:
    """On a level curve, and on one with a height, whose preview is that of the height too."""
    flight = flight_on(CURVES["bernoulli" if name == "bernoulli" else "helix"](2.0, 1.2), 1.0)
    compiled = fly(flight, CompiledController(TOLD, 2))
    expected = loop.fly(flight, method_of(TOLD).reference_controller(2))
    for part in ("position_m", "command_rad", "thrust_acceleration_m_s2", "status"):
        np.testing.assert_array_equal(getattr(compiled, part), getattr(expected, part))
    assert not compiled.status.any()


def test_the_targets_hold_what_the_curve_will_do() -> None:
    """Columns behind those of now are the accelerations of the curve, 0.05 s apart, along x, y and up."""
    course = CURVES["helix"](1.0, 1.5)
    flight = flight_on(course, 1.0)
    targets = flight.targets_for(commands_thrust=True, has_preview=True)
    assert targets.shape == (101, 2, 27)
    for time in range(6):
        times_s = flight.times_s() + 0.05 * (time + 1)
        expected = np.column_stack([course.acceleration(times_s), vertical_of(course, times_s)[:, 2]])
        np.testing.assert_allclose(targets[:, 1, 9 + (3 * time) : 12 + (3 * time)], expected, atol=1e-12)


def test_a_preview_takes_away_error() -> None:
    """On an eight at 1.2 rad/s, beside a target that is tracked."""
    course = Bernoulli(2.0, 1.2)
    time_s, told_m = errors_m(course, 8.0)
    tracked = with_option(TOLD, "target.acceleration", "tracked")
    trace = fly(flight_on(course, 8.0), CompiledController(tracked, 2))
    tracked_m = np.linalg.norm(trace.position_m[..., :2] - trace.target[..., :2], axis=-1)
    assert told_m[time_s > 4.0].mean() < 0.6 * tracked_m[time_s > 4.0].mean()


def test_behind_the_end_of_a_piece_the_drone_comes_to_rest() -> None:
    """Though the piece ends with an acceleration: no derivative runs past it."""
    time_s, error_m = errors_m(Pieces((PIECE,)), 6.0)
    assert error_m[time_s < 1.5].max() < 0.25
    assert error_m[time_s > 4.0].max() < 0.05


@pytest.mark.parametrize("updates", [10, 50])
def test_a_late_set_point_is_flown_as_it_is(updates: int) -> None:
    """For 0.1 and 0.5 s: the drone stays near the place that it was given, and finds the curve again."""
    trace = fly(flight_on(Bernoulli(2.0, 1.0), 8.0, drones=1), Late(updates))
    error_m = np.linalg.norm(trace.position_m[..., :2] - trace.target[..., :2], axis=-1)
    away_m = np.linalg.norm(trace.target[200 + updates, 0, :2] - trace.target[200, 0, :2])
    assert 0.02 * updates / 10 < error_m[200:].max() < away_m + 0.1
    assert error_m[trace.time_s > 5.0].max() < 0.2
