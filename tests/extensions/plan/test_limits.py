"""Limits of plans: by simulated lags, by differences, and against what the generated C keeps."""

import math
from dataclasses import replace

import numpy as np
import pytest

from mambo_codegen.numbers.reach import THRUST_LEFT
from mambo_codegen.settings import controller_toml, presets
from mambo_extensions.plan.limits import Figures, figures_of, limits_of
from mambo_sil.api.campaigns import draw_vehicles
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import Uncertainty

FIGURES = Figures(
    thrust_m_s2=16.0,
    least_thrust_m_s2=3.0,
    slope=0.7,
    tilt_lag_s=0.07,
    tilt_dead_time_s=0.05,
    thrust_lag_s=0.09,
    thrust_dead_time_s=0.01,
    drag_1_s=0.4,
    speed_m_s=3.0,
    climb_m_s=2.0,
    descent_m_s=1.5,
    walls_m=((0, 1.0, 2.0), (1, -1.0, -1.5)),
)


def test_what_is_commanded_gives_the_acceleration_behind_lag_and_dead_time() -> None:
    """Fed into a first-order lag behind a dead time, stepped finely, the command gives course and drag."""
    thrust = limits_of(FIGURES)[0]
    position = np.polynomial.Polynomial([0.3, -0.2, 0.5, 0.4, -0.3])
    derivatives = [position.deriv(order) for order in range(1, 5)]

    def commanded(time_s: np.ndarray) -> np.ndarray:
        moved = [position(time_s), *(one(time_s) for one in derivatives)]
        motion = np.stack([np.stack([row, row, row], axis=-1) for row in moved])
        summed: np.ndarray = np.einsum("kc,k...c->...c", thrust.weights, motion) + thrust.offset
        return summed

    step_s, ends_s = 1e-4, 1.5
    times_s = np.arange(0.0, ends_s, step_s)
    for axis, lag_s, dead_s, drag_1_s in ((0, 0.07, 0.05, 0.4), (2, 0.09, 0.01, 0.0)):
        inputs = commanded(times_s - dead_s + step_s / 2)[:, axis] - (9.81 if axis == 2 else 0.0)
        answer, decay = 0.0, math.exp(-step_s / lag_s)
        for one in inputs:
            answer = one + (answer - one) * decay
        wanted = derivatives[1](ends_s) + drag_1_s * derivatives[0](ends_s)
        # An acceleration of third degree and more is left out: here there is none but by the drag.
        assert answer == pytest.approx(wanted, abs=2e-3)


def test_gradients_are_those_of_differences() -> None:
    """Of every limit, by each derivative of the position, at random motions and shares."""
    random = np.random.default_rng(0)
    motion = random.normal(size=(5, 6, 3)) * np.array([1.0, 2.0, 4.0, 10.0, 30.0])[:, np.newaxis, np.newaxis]
    allowed = np.array([0.5, 0.8, 1.0, 1.0, 1.2, 1.5])
    for limit in limits_of(FIGURES):
        _, gradient = limit.of(motion, allowed)
        for order in range(5):
            for axis in range(3):
                change = np.zeros_like(motion)
                change[order, :, axis] = 1e-6
                after, before = (limit.of(motion + one, allowed)[0] for one in (change, -change))
                slope = (after - before) / 2e-6
                np.testing.assert_allclose(slope, limit.weights[order, axis] * gradient[:, axis], atol=1e-6)


@pytest.mark.parametrize(
    ("name", "order", "vector", "share"),
    [
        ("tilt", 2, (0.7 * 9.81, 0.0, 0.0), 1.0),
        ("thrust", 2, (0.0, 0.0, THRUST_LEFT * 16.0 - 9.81), 1.0),
        ("thrust", 2, (0.0, 0.0, 0.0), 0.0),
        ("least thrust", 2, (0.0, 0.0, 3.0 - 9.81), 1.0),
        ("speed", 1, (1.8, 2.4, 9.0), 1.0),
        ("climb", 1, (0.0, 0.0, 1.0), 0.5),
        ("descent", 1, (0.0, 0.0, -3.0), 2.0),
        ("fence", 0, (2.5, 0.0, 0.0), 1.5),
        ("fence", 0, (0.0, -1.7, 0.0), 1.2),
    ],
)
def test_shares_of_limits_by_hand(
    name: str, order: int, vector: tuple[float, float, float], share: float
) -> None:
    """Motions whose share of a limit one can tell: the thrust from the weight on, walls by the metre."""
    motion = np.zeros((5, 3))
    motion[order] = vector
    still = replace(FIGURES, drag_1_s=0.0)
    found = [1.0 + float(limit.of(motion)[0]) for limit in limits_of(still) if limit.name == name]
    assert max(found) == pytest.approx(share, abs=1e-6)


def test_the_weakest_drawn_drone_limits_the_thrust() -> None:
    """Its thrust over its mass, one drone after the other, over that of the file."""
    drone, settings = vehicle_toml.preset("crazyflie"), presets.preset("crazyflie")
    vehicle = Vehicle.of(drone)
    drawn = draw_vehicles(vehicle, 5, 3)
    factors, masses_kg = (
        np.atleast_1d(getattr(drawn.airframe, name)) for name in ("thrust_factor_n_s2", "mass_kg")
    )
    ratios = [float(factor) / float(mass_kg) for factor, mass_kg in zip(factors, masses_kg, strict=True)]
    nominal = float(vehicle.airframe.thrust_factor_n_s2) / float(vehicle.airframe.mass_kg)
    alone = figures_of(drone, settings, vehicle)
    found = figures_of(drone, settings, drawn)
    assert found.thrust_m_s2 == pytest.approx(alone.thrust_m_s2 * min(ratios) / nominal)


def test_uncertain_figures_count_at_their_worse_end() -> None:
    """Longer lag and dead time, less gain of tilt and thrust, by the half-widths of [uncertainty]."""
    drone = vehicle_toml.preset("crazyflie-brushless")
    known = Uncertainty(
        roll_gain=0.0894, roll_lag_s=0.02, pitch_dead_time_s=0.01, thrust_gain=0.0959, thrust_lag_s=0.03
    )
    settings = controller_toml.parse(
        "[model]\nroll_gain = 0.894\npitch_gain = 0.894\nroll_lag_s = 0.07\npitch_lag_s = 0.07\n"
        'roll_delay_s = 0.052\npitch_delay_s = 0.052\n[controller]\nmethod = "quadratic"\n',
        "test",
    )
    sure = figures_of(drone, settings, Vehicle.of(drone))
    unsure = figures_of(drone.model_copy(update={"uncertainty": known}), settings, Vehicle.of(drone))
    assert unsure.tilt_lag_s == pytest.approx(sure.tilt_lag_s + 0.02)
    assert unsure.tilt_dead_time_s == pytest.approx(sure.tilt_dead_time_s + 0.01)
    assert unsure.thrust_lag_s == pytest.approx(sure.thrust_lag_s + 0.03)
    assert unsure.slope == pytest.approx(0.9 * sure.slope)
    assert unsure.thrust_m_s2 == pytest.approx(0.9 * sure.thrust_m_s2)


def test_walls_stand_where_the_fence_does() -> None:
    """The fence's east becomes minus y; a pair of equal walls is none."""
    settings = controller_toml.parse(
        "[limits.fence]\nx_min_m = -1.0\nx_max_m = 2.0\ny_min_m = -3.0\ny_max_m = 0.5\n", "test"
    )
    drone = vehicle_toml.preset("mambo")
    walls = figures_of(drone, settings, Vehicle.of(drone)).walls_m
    assert set(walls) == {(0, -1.0, -1.0), (0, 1.0, 2.0), (1, -1.0, -0.5), (1, 1.0, 3.0)}
