"""The cascade: the Crazyflie answers as its firmware does, and every limit and gain does its part."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_sil.drone.plant import loops
from mambo_sil.drone.plant.airframe import airframe_of
from mambo_sil.drone.plant.cascade import ANGLE_INTEGRAL, LAST_RATE, RATE_INTEGRAL, CascadeLoop
from mambo_sil.drone.plant.vehicle import Vehicle, truth
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import CascadeAttitude
from tests.support.scenarios import CRAZYFLIE, changed

FloatArray = NDArray[np.float64]

NONE = np.zeros((3, 1))
HOVER_N = np.array([CRAZYFLIE.weight_n])


@pytest.mark.first_is_quick
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("size_rad", [0.02, 0.3])
def test_the_crazyflie_answers_a_step_as_its_firmware(axis: int, size_rad: float) -> None:
    """0.135 s to 63 %, 0.291 s to 90 %, 6 % of overshoot, each within a tenth.

    Measured with the firmware's own code on RotorPy's Crazyflie, steps of 0.02 to 0.3 rad.
    """
    vehicle = Vehicle.of(CRAZYFLIE)
    state = vehicle.at_rest(np.array([[0.0], [0.0], [-1.1]]), 0.0, airframe_of(CRAZYFLIE).hover_command)
    command_rad = np.zeros((2, 1))
    command_rad[axis] = size_rad
    answer = []
    for _ in range(1000):
        seen = truth(state)
        thrust_n = loops.altitude_thrust(CRAZYFLIE, -1.1, seen.position_m[2], seen.velocity_m_s[2])
        state, _ = vehicle.advance(state, command_rad, thrust_n, 0.0, seen=seen)
        answer.append(float(state.body[6 + axis, 0]) / size_rad)

    def reached_s(share: float) -> float:
        return CRAZYFLIE.step_s * (1 + int(np.argmax(np.array(answer) >= share)))

    assert reached_s(1.0 - np.exp(-1.0)) == pytest.approx(0.135, rel=0.1)
    assert reached_s(0.9) == pytest.approx(0.291, rel=0.1)
    assert max(answer) - 1.0 == pytest.approx(0.06, rel=0.1)


def loop_of(drone: VehicleFile) -> CascadeLoop:
    """Return the cascade of a drone."""
    assert isinstance(drone.attitude, CascadeAttitude)
    return CascadeLoop(drone, drone.attitude)


def answer_of(
    drone: VehicleFile, angles: FloatArray = NONE, rates: FloatArray = NONE, **demanded: Any
) -> tuple[FloatArray, FloatArray]:
    """Return motor commands (4,) less those at hover, and memory (9,), after a tick from rest."""
    demand = loops.Demand(demanded.get("command", NONE[:2]), demanded.get("yaw", 0.0), HOVER_N, angles, rates)
    loop = loop_of(drone)
    commands, memory = loop.command_motors(demand, np.zeros((loop.rows, 1)))
    return commands[:, 0] - airframe_of(drone).hover_command, memory[:, 0]


def plain(**axis: float) -> VehicleFile:
    """Return a Crazyflie whose axes have only these gains."""
    attitude = CRAZYFLIE.attitude
    assert isinstance(attitude, CascadeAttitude)
    only = dict.fromkeys(type(attitude.roll).model_fields, 0.0) | axis
    return changed(CRAZYFLIE, attitude={"roll": only, "pitch": only, "yaw": only})


ERROR = 0.001
SIGNS = {0: [1, -1, -1, 1], 1: [1, 1, -1, -1], 2: [-1, 1, -1, 1]}


@pytest.mark.parametrize("axis", SIGNS)
def test_an_angle_error_turns_its_axis(axis: int) -> None:
    """By rate gain times angle gain, with the signs of the mixer; roll, pitch and yaw reference alike."""
    drone = plain(p_1_s=5.0, rate_p_s_rad=1000.0)
    angles = NONE.copy()
    angles[axis] = -ERROR
    commands, _ = answer_of(drone, angles)
    np.testing.assert_allclose(commands, 5000.0 * ERROR * np.array(SIGNS[axis]), rtol=1e-9)
    if axis == 2:
        demanded, _ = answer_of(drone, yaw=ERROR)
    else:
        command = NONE[:2].copy()
        command[axis] = ERROR
        demanded, _ = answer_of(drone, command=command)
    np.testing.assert_array_equal(demanded, commands)


def test_a_body_rate_is_braked_by_both_loops() -> None:
    """By its own error, the derivative of the angle, and its change since the last tick."""
    rates = np.array([[0.01], [0.0], [0.0]])
    for gains, expected in (
        ({"rate_p_s_rad": 1000.0}, 1000.0),
        ({"rate_p_s_rad": 1000.0, "d": 0.5}, 1500.0),
        ({"rate_d_s2_rad": 2.0}, 2.0 / CRAZYFLIE.step_s),
    ):
        commands, _ = answer_of(plain(**gains), rates=rates)
        np.testing.assert_allclose(commands, -expected * 0.01 * np.array(SIGNS[0]), rtol=1e-9)


def test_integrals_grow_by_their_errors_and_stop_at_their_limits() -> None:
    """The angle's, then the rate's; the last rates are kept as they are."""
    angles, rates = np.array([[-0.1], [0.2], [0.3]]), np.array([[0.5], [-0.4], [0.3]])
    drone = plain(p_1_s=2.0, integral_limit_rad_s=1.0, rate_integral_limit_rad=1.0)
    _, memory = answer_of(drone, angles, rates)
    step_s = drone.step_s
    np.testing.assert_allclose(memory[ANGLE_INTEGRAL], -step_s * angles[:, 0], rtol=1e-12)
    np.testing.assert_allclose(
        memory[RATE_INTEGRAL], step_s * (-2.0 * angles[:, 0] - rates[:, 0]), rtol=1e-12
    )
    np.testing.assert_array_equal(memory[LAST_RATE], rates[:, 0])
    limited = plain(p_1_s=2.0, integral_limit_rad_s=1e-5, rate_integral_limit_rad=1e-6)
    _, memory = answer_of(limited, angles, rates)
    np.testing.assert_allclose(memory[ANGLE_INTEGRAL], [1e-5, -1e-5, -1e-5], rtol=1e-12)
    np.testing.assert_allclose(memory[RATE_INTEGRAL], [-1e-6, 0.0, -1e-6], rtol=1e-9, atol=1e-15)


def test_demanded_rate_and_output_are_limited() -> None:
    """Whatever the angle error."""
    angles = np.array([[-1.0], [0.0], [0.0]])
    slow = changed(plain(p_1_s=5.0, rate_p_s_rad=1000.0), attitude={"rate_max_rad_s": 2.0})
    np.testing.assert_allclose(answer_of(slow, angles)[0], 2000.0 * np.array(SIGNS[0]), rtol=1e-9)
    weak = changed(slow, attitude={"output_max": 700.0})
    np.testing.assert_allclose(answer_of(weak, angles)[0], 700.0 * np.array(SIGNS[0]), rtol=1e-9)
