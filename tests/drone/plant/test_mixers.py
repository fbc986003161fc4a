"""Mixers: what gives way when motor commands exceed their limits."""

from dataclasses import replace

import numpy as np
import pytest

from mambo_sil.drone.plant import loops
from mambo_sil.drone.plant.airframe import airframe_of
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.rotors import LEAST_YAW, WRENCH_SIGNS, distribute
from mambo_sil.drone.plant.vehicle import Vehicle, truth
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import MixerName
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M
from tests.support.scenarios import changed

CRAZYFLIE = vehicle_toml.preset("crazyflie")
FRAME = replace(airframe_of(CRAZYFLIE), command_min=0.0, command_max=100.0)
MIXERS: tuple[MixerName, ...] = ("clip", "lower", "yaw-last")


def mixed(mixer: MixerName, *shares: float) -> FloatArray:
    """Return the four commands of shares of thrust, roll, pitch and yaw."""
    return distribute(replace(FRAME, mixer=mixer), np.array(shares)[:, np.newaxis])[:, 0]


def components(commands: FloatArray) -> FloatArray:
    """Return the shares of thrust, roll, pitch and yaw in four commands."""
    return np.asarray(WRENCH_SIGNS @ commands / 4.0)


@pytest.mark.parametrize("mixer", MIXERS)
def test_within_the_limits_all_mixers_are_one(mixer: MixerName) -> None:
    """The sums, bit for bit."""
    shares = np.random.default_rng(1).uniform(-10.0, 10.0, (4, 50)) + np.array([[50.0], [0.0], [0.0], [0.0]])
    found = distribute(replace(FRAME, mixer=mixer), shares)
    assert found.tobytes() == distribute(FRAME, shares).tobytes()
    np.testing.assert_allclose(WRENCH_SIGNS @ found / 4.0, shares, atol=1e-12)


def test_beyond_the_largest_command_each_mixer_gives_up_something_else() -> None:
    """Of thrust 70, roll 20, yaw 40: clipping loses all three, lowering mostly thrust, the last one yaw."""
    assert mixed("clip", 70.0, 20.0, 0.0, 40.0).tolist() == [50.0, 90.0, 10.0, 100.0]
    assert mixed("lower", 70.0, 20.0, 0.0, 40.0).tolist() == [20.0, 60.0, 0.0, 100.0]
    assert mixed("yaw-last", 70.0, 20.0, 0.0, 40.0).tolist() == [80.0, 60.0, 40.0, 100.0]
    assert components(mixed("yaw-last", 70.0, 20.0, 0.0, 40.0)).tolist() == [70.0, 20.0, 0.0, 10.0]
    assert components(mixed("yaw-last", 70.0, 20.0, 0.0, -40.0)).tolist() == [70.0, 20.0, 0.0, -10.0]


def test_yaw_keeps_a_share_and_the_smallest_command_limits_it_too() -> None:
    """Two in a hundred where the others leave nothing; without yaw nothing is divided by 0."""
    assert LEAST_YAW * FRAME.command_max == 2.0
    assert components(mixed("yaw-last", 90.0, 20.0, 0.0, 40.0)).tolist() == [78.0, 20.0, 0.0, 2.0]
    assert components(mixed("yaw-last", 20.0, 10.0, 0.0, 40.0)).tolist() == [20.0, 10.0, 0.0, 10.0]
    assert mixed("yaw-last", 70.0, 40.0, 0.0, 0.0).tolist() == [100.0, 20.0, 20.0, 100.0]


def lost_height_m(mixer: MixerName, step_rad: float) -> float:
    """Return what a hovering Crazyflie loses in height when its heading reference jumps."""
    drone = changed(CRAZYFLIE, rotors={"mixer": mixer})
    vehicle, command_rad = Vehicle.of(drone), np.zeros((2, 1))
    state = vehicle.at_rest(
        np.array([[0.0], [0.0], [-HOVER_HEIGHT_M]]), 0.0, airframe_of(drone).hover_command
    )
    lowest_m = 0.0
    for _ in range(1000):
        seen = truth(state)
        z_m, vz_m_s = seen.position_m[2], seen.velocity_m_s[2]
        thrust_n = loops.altitude_thrust(drone, -HOVER_HEIGHT_M, z_m, vz_m_s)
        state, _ = vehicle.advance(state, command_rad, thrust_n, step_rad, seen=seen)
        lowest_m = max(lowest_m, float(z_m[0]) + HOVER_HEIGHT_M)
    assert float(state.body[8, 0]) == pytest.approx(step_rad, abs=0.25)
    return lowest_m


@pytest.mark.long
def test_a_step_of_the_heading_costs_height() -> None:
    """Of 2 rad: most where all motors are lowered, least where yaw gives way first."""
    lowered_m, clipped_m, kept_m = (lost_height_m(mixer, 2.0) for mixer in ("lower", "clip", "yaw-last"))
    found_m = [lowered_m, clipped_m, kept_m]
    np.testing.assert_allclose(found_m, [0.137, 0.067, 0.049], atol=0.002)
