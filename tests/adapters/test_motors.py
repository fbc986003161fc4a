"""Attitude loop and mixer for worlds with motors only: the plant's own, in any frame, rotors anywhere."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mambo_nmpc import ArgumentError, Controller, DroneState, TargetState, Vehicle, attitude_of_quaternion
from mambo_nmpc.adapters.motors import Motors
from mambo_sil.drone.plant.airframe import airframe_of
from mambo_sil.drone.plant.first_order import FirstOrderDrone
from mambo_sil.drone.plant.loops import Demand
from mambo_sil.flight.frames import FRAMES, FrameName, attitude_to_ned, vectors_to_ned

FLIPS = np.array([1.0, -1.0, -1.0])
PLUS = np.array([[0.2, 0.0], [0.0, 0.2], [-0.2, 0.0], [0.0, -0.2]])
TURNS = np.array([1.0, -1.0, 1.0, -1.0])


def some_inputs(n: int, rng: np.random.Generator, tilt_rad: float = 0.4) -> tuple[Any, Any, Any]:
    """Return commands (n, 4), quaternions (n, 4) and rates (n, 3), small enough for every motor to follow."""
    angles = rng.uniform(-tilt_rad, tilt_rad, (2, n, 3))
    commands = np.column_stack([angles[0], np.full(n, 0.3)])
    return commands, Rotation.from_euler("ZYX", angles[1][:, ::-1]).as_quat(), rng.uniform(-1.0, 1.0, (n, 3))


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("name", ["crazyflie", "mambo", "hummingbird"])
def test_it_is_the_loop_of_the_plant(name: str, frame: FrameName) -> None:
    """Of both kinds, with integrals, in every frame: the thrusts tick by tick; a reset forgets them."""
    vehicle, n = Vehicle.from_preset(name), 5
    loop, motors = vehicle.loop, Motors(vehicle, n, frame=frame)
    assert not isinstance(loop, FirstOrderDrone)
    memory, per_command_n = np.zeros((loop.rows, n)), airframe_of(vehicle.drone).thrust_per_command_n
    inputs = some_inputs(n, np.random.default_rng(3))
    first = motors.thrusts_n(*inputs)
    for tick in range(5):
        commands, quaternions, rates = inputs
        wanted = attitude_to_ned(frame, commands[:, :3]).T
        angles = attitude_to_ned(frame, attitude_of_quaternion(quaternions)).T
        demand = Demand(
            wanted[:2],
            wanted[2],
            commands[:, 3],
            angles,
            (rates * (1.0 if frame == "NED" else FLIPS)).T,
        )
        expected, memory = loop.command_motors(demand, memory)
        found = first if tick == 0 else motors.thrusts_n(*inputs)
        np.testing.assert_allclose(found, per_command_n * expected.T, rtol=1e-9, atol=1e-12)
    before = motors.thrusts_n(*inputs)
    motors.reset(np.arange(n) == 1)
    assert np.array_equal(motors.thrusts_n(*inputs)[1], first[1])
    motors.reset()
    assert np.array_equal(motors.thrusts_n(*inputs), first)
    assert name == "hummingbird" or not np.array_equal(before, first)


def test_rotors_anywhere_give_the_same_torques() -> None:
    """A plus, and the X in another order, by the moments of their forces; the thrust is the command's."""
    vehicle = Vehicle.from_preset("hummingbird")
    rotors = airframe_of(vehicle.drone)
    arm_m, turn_m = rotors.rotor_offset_m, float(rotors.torque_per_thrust_m)
    x_left = np.array([[arm_m, arm_m], [arm_m, -arm_m], [-arm_m, -arm_m], [-arm_m, arm_m]])
    commands, quaternions, rates = some_inputs(4, np.random.default_rng(5), tilt_rad=0.02)
    commands[:, 3] = 5.0
    other, found = [2, 0, 3, 1], []
    for places, turns, motors in (
        (x_left, TURNS, Motors(vehicle, 4)),
        (PLUS, TURNS, Motors(vehicle, 4, rotors_m=PLUS, reaction=TURNS)),
        (x_left[other], TURNS[other], Motors(vehicle, 4, rotors_m=x_left[other], reaction=TURNS[other])),
    ):
        thrusts_n = motors.thrusts_n(commands, quaternions, 0.1 * rates)
        assert (thrusts_n > 0.0).all()
        x_m, y_m = places.T
        found.append(
            np.column_stack(
                [thrusts_n.sum(axis=1), thrusts_n @ y_m, -thrusts_n @ x_m, thrusts_n @ (turns * turn_m)]
            )
        )
    np.testing.assert_allclose(found[0][:, 0], 5.0, rtol=1e-12)
    np.testing.assert_allclose(found[1], found[0], atol=1e-12)
    np.testing.assert_allclose(found[2], found[0], atol=1e-12)
    assert np.abs(found[0][:, 1:]).min() > 1e-4


def test_motors_stay_within_their_limits() -> None:
    """Whatever is asked: no thrust is less than that of the smallest command, or more than of the largest."""
    vehicle = Vehicle.from_preset("crazyflie")
    rotors = airframe_of(vehicle.drone)
    commands, quaternions, rates = some_inputs(50, np.random.default_rng(7), tilt_rad=1.2)
    commands[:, 3] = np.linspace(-1.0, 3.0, 50)
    thrusts_n = (
        Motors(vehicle, 50).thrusts_n(commands, quaternions, 20.0 * rates) / rotors.thrust_per_command_n
    )
    assert thrusts_n.min() == pytest.approx(rotors.command_min)
    assert thrusts_n.max() == pytest.approx(rotors.command_max)


def test_a_rigid_body_with_four_forces_flies_to_its_target() -> None:
    """Of this file's own integration, across the turn of the heading at pi: a step of a metre."""
    vehicle = Vehicle.from_preset("hummingbird")
    body, rotors = vehicle.drone.body, airframe_of(vehicle.drone)
    inertia = np.array([body.inertia_x_kg_m2, body.inertia_y_kg_m2, body.inertia_z_kg_m2], np.float64)
    arm_m, turn_m = rotors.rotor_offset_m, float(rotors.torque_per_thrust_m)
    controller, motors = Controller.from_vehicle(vehicle, sensors="true"), Motors(vehicle)
    position, velocity, rates = np.array([0.0, 0.0, 1.0]), np.zeros(3), np.zeros(3)
    turned = Rotation.from_euler("z", 3.1)
    target = TargetState.in_frame("NWU", [1.0, -0.5, 1.3], [0.0, 0.0, 0.0], yaw_rad=-3.1)
    for _ in range(500):
        state = DroneState.in_frame("NWU", position, velocity, attitude_of_quaternion(turned.as_quat()))
        command = controller.step(state, target).attitude_thrust("NWU", mass_kg=body.mass_kg)
        for _ in range(round(0.01 / motors.tick_s)):
            f = motors.thrusts_n(command, turned.as_quat(), rates)
            torque = np.array(
                [
                    arm_m * (f[0] - f[1] - f[2] + f[3]),
                    -arm_m * (f[0] + f[1] - f[2] - f[3]),
                    turn_m * f @ TURNS,
                ]
            )
            rates = rates + motors.tick_s * (torque - np.cross(rates, inertia * rates)) / inertia
            turned = turned * Rotation.from_rotvec(motors.tick_s * rates)
            lift = turned.apply([0.0, 0.0, f.sum() / body.mass_kg])
            velocity = velocity + motors.tick_s * (lift - [0.0, 0.0, 9.81])
            position = position + motors.tick_s * velocity
    assert np.abs(position - [1.0, -0.5, 1.3]).max() < 0.01
    np.testing.assert_allclose(target.position_m, vectors_to_ned("NWU", [1.0, -0.5, 1.3]))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"vehicle": "generic"}, 'attitude.kind = "first_order"; it must be "mambo" or "cascade"'),
        ({"frame": "FLU"}, 'frame = "FLU" must be'),
        ({"rotors_m": PLUS[:3]}, r"rotors_m: has shape \(3, 2\); it must be \(4, 2\)"),
        ({"reaction": [1, 2, 1, 1]}, r"reaction = \[1, 2, 1, 1\] must be 1 or -1"),
        ({"rotors_m": PLUS, "reaction": [1, 1, 1, 1]}, "two of thrust, roll, pitch and yaw are one"),
    ],
)
def test_what_cannot_fly_is_refused(arguments: dict[str, Any], words: str) -> None:
    """By name."""
    with pytest.raises(ArgumentError, match=words):
        Motors(**({"vehicle": "crazyflie"} | arguments))


def test_other_shapes_are_refused() -> None:
    """A single drone may have no first axis; several must."""
    commands, quaternions, rates = some_inputs(2, np.random.default_rng(1))
    assert Motors("crazyflie").thrusts_n(commands[0], quaternions[0], rates[0]).shape == (4,)
    assert Motors("crazyflie").thrusts_n(commands[:1], quaternions[:1], rates[:1]).shape == (1, 4)
    with pytest.raises(ArgumentError, match=r"command: has shape \(4,\); it must be \(2, 4\)"):
        Motors("crazyflie", 2).thrusts_n(commands[0], quaternions[0], rates[0])
