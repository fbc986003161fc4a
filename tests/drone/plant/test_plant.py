"""The drone: airframe, rotors, rigid body, integrator, stock loops, and mixers, also at their limits."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant import loops
from mambo_sil.drone.plant.airframe import MAMBO, NOMINAL, airframe_of
from mambo_sil.drone.plant.integrator import NODES, bogacki_shampine
from mambo_sil.drone.plant.rigid_body import RigidBody
from mambo_sil.drone.plant.rotors import LEAST_YAW, WRENCH_SIGNS, Rotors, distribute, mix
from mambo_sil.drone.plant.vehicle import STEP_S, Vehicle, VehicleState, truth
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import MamboAttitude, MixerName
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M
from tests.support.scenarios import changed

FloatArray = NDArray[np.float64]

assert isinstance(NOMINAL.attitude, MamboAttitude)
LOOP = loops.StockLoop(NOMINAL, NOMINAL.attitude)

STOCK_MIXER = np.array(
    [
        [0.25, 103.5736, -5.66592, -5.66592],
        [0.25, -103.5736, -5.66592, 5.66592],
        [0.25, 103.5736, 5.66592, 5.66592],
        [0.25, -103.5736, 5.66592, -5.66592],
    ]
)
"""Stock table: thrust of each motor (negative up) from thrust (negative up), yaw, pitch, roll torque."""

OFFSET_M = 0.0441235
ROTOR_POSITIONS_M = np.array(
    [
        [OFFSET_M, -OFFSET_M, 0.0],
        [OFFSET_M, OFFSET_M, 0.0],
        [-OFFSET_M, OFFSET_M, 0.0],
        [-OFFSET_M, -OFFSET_M, 0.0],
    ]
)
ROTOR_SPINS = np.array([1.0, -1.0, 1.0, -1.0])


def rotation(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return R of equation 3 as the product of its three matrices."""
    about_x = [[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]]
    about_y = [[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]]
    about_z = [[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]]
    return np.array(about_z) @ np.array(about_y) @ np.array(about_x)


def paper_derivative(state: FloatArray, wrench: FloatArray, body: RigidBody) -> FloatArray:
    """Return the derivative (12,) from equations 2 to 7 in matrix form, and Euler's equation."""
    velocity, rates = state[3:6], state[9:12]
    roll, pitch, yaw = state[6:9]
    matrix = rotation(roll, pitch, yaw)
    gamma = np.array(
        [
            [1, np.sin(roll) * np.tan(pitch), np.cos(roll) * np.tan(pitch)],
            [0, np.cos(roll), -np.sin(roll)],
            [0, np.sin(roll) / np.cos(pitch), np.cos(roll) / np.cos(pitch)],
        ]
    )
    inertia = np.diag(np.array(body.inertia_kg_m2))
    wind = matrix.T @ np.array([*body.push_m_s2, 0.0])
    gravity = GRAVITY_M_S2 * np.array(
        [-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)]
    )
    force = -np.array([0.0, 0.0, wrench[0]]) / body.mass_kg - body.drag_1_s * velocity * [1.0, 1.0, 0.0]
    return np.concatenate(
        [
            matrix @ velocity,
            gravity + wind + force - np.cross(rates, velocity),
            gamma @ rates,
            np.linalg.solve(inertia, wrench[1:] - np.cross(rates, inertia @ rates)),
        ]
    )


TUMBLING = np.array([0.1, -0.2, -1.1, 0.5, -0.4, 0.3, 0.2, -0.1, 0.4, 3.0, 0.5, -0.4])
"""State of a drone that keeps rolling and stays away from the singularity at 90 degrees of pitch."""
HELD_WRENCH = np.array([0.6, 2e-6, 0.0, 0.0])


def tumble(body: RigidBody, duration_s: float, step_s: float) -> FloatArray:
    """Return the state (12,) after `duration_s` from `TUMBLING` under `HELD_WRENCH`."""
    state, wrench = TUMBLING[:, np.newaxis], HELD_WRENCH[:, np.newaxis]
    for _ in range(round(duration_s / step_s)):
        state = bogacki_shampine(body.derivative, state, (wrench, wrench, wrench), step_s)
    return state[:, 0]


def tumble_exactly(body: RigidBody, duration_s: float) -> FloatArray:
    """Return the same state from the matrix form and the classical method of order four in short steps."""
    state, step_s = TUMBLING, 2e-3
    for _ in range(round(duration_s / step_s)):
        k1 = paper_derivative(state, HELD_WRENCH, body)
        k2 = paper_derivative(state + 0.5 * step_s * k1, HELD_WRENCH, body)
        k3 = paper_derivative(state + 0.5 * step_s * k2, HELD_WRENCH, body)
        k4 = paper_derivative(state + step_s * k3, HELD_WRENCH, body)
        state = state + step_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return state


def fly_attitude(
    command_rad: FloatArray,
    ticks: int,
    *,
    drone: VehicleFile = NOMINAL,
    z_m: float = -HOVER_HEIGHT_M,
    yaw_reference_rad: float = 0.0,
) -> list[VehicleState]:
    """Return the states after each tick of held roll and pitch commands, from rest at `z_m`."""
    vehicle = Vehicle.of(drone)
    state = vehicle.at_rest(np.array([[0.0], [0.0], [z_m]]), 0.0, airframe_of(drone).hover_command)
    states = []
    for _ in range(ticks):
        seen = truth(state)
        thrust_n = loops.altitude_thrust(drone, -HOVER_HEIGHT_M, seen.position_m[2], seen.velocity_m_s[2])
        state, _ = vehicle.advance(state, command_rad[:, np.newaxis], thrust_n, yaw_reference_rad, seen=seen)
        states.append(state)
    return states


def test_derived_airframe_constants_match_the_stock_tables() -> None:
    """Inertia, hover speed, motor command, thrust per command and thrust-to-weight ratio are stock."""
    assert MAMBO.inertia_kg_m2 == (5.82857e-5, 7.16914e-5, 1e-4)
    assert pytest.approx(6.532844e-4, rel=1e-6) == MAMBO.thrust_per_command_n
    assert pytest.approx(0.0441235, rel=1e-5) == MAMBO.rotor_offset_m
    assert pytest.approx(2.41374e-3, rel=1e-5) == MAMBO.torque_per_thrust_m
    assert pytest.approx(236.5, rel=1e-3) == MAMBO.hover_command
    hover_speed_rad_s = np.sqrt(MAMBO.speed_squared_per_command_rad2_s2 * MAMBO.hover_command)
    assert hover_speed_rad_s == pytest.approx(1809.0, rel=1e-3)
    assert MAMBO.command_max / MAMBO.hover_command == pytest.approx(2.11, rel=2e-3)


@pytest.mark.parametrize("component", range(4))
def test_mixer_matches_the_stock_table(component: int) -> None:
    """Thrust, yaw, pitch and roll are distributed to the four motors with the stock factors."""
    demand = np.zeros(4)
    demand[0] = -0.618
    demand[component] += (-0.01, 1e-4, 1e-3, 1e-3)[component]
    thrust, yaw, pitch, roll = demand
    expected = -1530.72683 * (STOCK_MIXER @ demand)
    commands = mix(MAMBO, np.array([[-thrust], [roll], [pitch], [yaw]]))
    np.testing.assert_allclose(commands[:, 0], expected, rtol=1e-5)


def test_mixer_stays_within_the_command_limits() -> None:
    """Motor commands saturate at 10 and 500."""
    demands = np.array([[1e3, -1e3, 0.6], [0.0, 0.0, 10.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    commands = mix(MAMBO, demands)
    np.testing.assert_array_equal(commands[:, :2], [[500.0, 10.0]] * 4)
    np.testing.assert_array_equal(commands[:, 2], [500.0, 10.0, 10.0, 500.0])


def test_rotors_exert_the_wrench_that_the_mixer_is_given() -> None:
    """Within the command limits the mixer is the inverse of the rotors."""
    rng = np.random.default_rng(1)
    demand = np.array([[0.618], [1e-3], [1e-3], [1e-4]]) * (1.0 + rng.uniform(-0.3, 0.3, (4, 50)))
    rotors = Rotors(MAMBO, 0.0)
    speeds = rotors.commanded_speed_rad_s(mix(MAMBO, demand))
    np.testing.assert_allclose(rotors.wrench(speeds[np.newaxis])[:, 0], demand, rtol=1e-12)


def test_wrench_is_the_sum_of_the_forces_at_the_rotors() -> None:
    """Torque is lever arm times force plus the reaction to the spin, with b and k of each flight."""
    speeds = np.random.default_rng(2).uniform(500.0, 2500.0, (4, 2))
    factors = np.array([4.0e-8, 4.9e-8])
    rotors = Rotors(replace(MAMBO, thrust_factor_n_s2=factors), 0.0)
    wrench = rotors.wrench(speeds[np.newaxis])[:, 0]
    for flight, factor in enumerate(factors):
        forces = np.zeros((4, 3))
        forces[:, 2] = -factor * speeds[:, flight] ** 2
        torque = np.cross(ROTOR_POSITIONS_M, forces).sum(axis=0)
        torque[2] -= (ROTOR_SPINS * 1.139284e-10 * speeds[:, flight] ** 2).sum()
        np.testing.assert_allclose(wrench[0, flight], -forces[:, 2].sum(), rtol=1e-12)
        np.testing.assert_allclose(wrench[1:, flight], torque, rtol=1e-5)


def test_derivative_matches_the_matrix_form_of_the_paper() -> None:
    """Every flight of a batch, each with its own airframe, obeys equations 2 to 7 and Euler's equation."""
    rng = np.random.default_rng(3)
    flights = 40
    states, wrenches = rng.uniform(-1.4, 1.4, (12, flights)), rng.uniform(-1.0, 1.0, (4, flights))
    masses, drags = rng.uniform(0.05, 0.08, flights), rng.uniform(0.0, 0.2, flights)
    inertias, winds = rng.uniform(5e-5, 1.5e-4, (3, flights)), rng.uniform(-1.0, 1.0, (2, flights))
    body = RigidBody(masses, (inertias[0], inertias[1], inertias[2]), drags, (winds[0], winds[1]))
    rates = body.derivative(states, wrenches)
    for flight in range(flights):
        x, y, z = (float(value) for value in inertias[:, flight])
        wind_x, wind_y = (float(value) for value in winds[:, flight])
        alone = RigidBody(float(masses[flight]), (x, y, z), float(drags[flight]), (wind_x, wind_y))
        expected = paper_derivative(states[:, flight], wrenches[:, flight], alone)
        np.testing.assert_allclose(rates[:, flight], expected, rtol=1e-11, atol=1e-12)


def test_integrator_is_exact_for_a_quadratic_input() -> None:
    """A third-order rule integrates t^2 without error, which a mismatch of nodes and weights would spoil."""

    def derivative(_: FloatArray, time: float) -> FloatArray:
        return np.array([3.0 * time**2])

    nodes = (float(NODES[0]), float(NODES[1]), float(NODES[2]))
    np.testing.assert_allclose(bogacki_shampine(derivative, np.zeros(1), nodes, 1.0), [1.0], rtol=1e-15)


def test_integrator_step_is_the_third_order_taylor_polynomial() -> None:
    """On y' = -y one step gives 1 - h + h^2/2 - h^3/6."""
    step = bogacki_shampine(lambda state, _: -state, np.ones(1), (None, None, None), 0.3)
    np.testing.assert_allclose(step, [1.0 - 0.3 + 0.3**2 / 2.0 - 0.3**3 / 6.0], rtol=1e-15)


def test_free_motion_converges_at_third_order() -> None:
    """Halving the step divides the error against the matrix form by about eight, to 1e-4."""
    body = replace(Vehicle().rigid_body, push_m_s2=(0.3, -0.2))
    exact = tumble_exactly(body, 2.0)
    errors = [np.linalg.norm(tumble(body, 2.0, step_s) - exact) for step_s in (0.02, 0.01, 0.005)]
    assert errors[0] / errors[1] == pytest.approx(8.0, abs=0.1)
    assert errors[1] / errors[2] == pytest.approx(8.0, abs=0.1)
    assert errors[2] < 1e-4


def test_rotors_lag_and_their_thrust_is_integrated_within_the_step() -> None:
    """Speed and vertical velocity agree with the closed forms; rotors without lag have no speed error."""
    lag_s, ticks = 0.03, 20
    vehicle = Vehicle(motor_lag_s=np.array([lag_s, 0.0]))
    start, goal = np.sqrt(13840.8 * 100.0), np.sqrt(13840.8 * 300.0)
    state = vehicle.at_rest(np.zeros((3, 2)), 0.0, 100.0)
    for _ in range(ticks):
        body, speed = vehicle.integrate(state, np.full((4, 2), 300.0))
        np.testing.assert_allclose(speed[:, 1], goal, rtol=1e-15)
        state = VehicleState(body, speed, state.memory)
    time_s = ticks * STEP_S
    gap, left = start - goal, np.exp(-time_s / lag_s)
    np.testing.assert_allclose(speed[:, 0], goal + gap * left, rtol=1e-12)
    square = (
        goal**2 * time_s + 2.0 * goal * gap * lag_s * (1.0 - left) + gap**2 * lag_s / 2.0 * (1.0 - left**2)
    )
    expected = GRAVITY_M_S2 * time_s - 4.0 * 4.71999e-8 * square / 0.063
    np.testing.assert_allclose(body[5, 0], expected, rtol=0.0, atol=2e-6)


def test_hover_holds_still() -> None:
    """Five seconds of hover move the drone by less than a nanometre."""
    start = np.array([0.0, 0.0, -1.1])
    last = fly_attitude(np.zeros(2), 1000)[-1]
    np.testing.assert_allclose(last.body[:3, 0], start, atol=1e-9)
    np.testing.assert_allclose(last.body[3:, 0], 0.0, atol=1e-9)


@pytest.mark.parametrize(("axis", "lag_s"), [(0, 0.245), (1, 0.155)])
def test_attitude_reaches_its_command_with_the_stock_lag(axis: int, lag_s: float) -> None:
    """A step of 0.05 rad reaches 63 % after 0.245 s in roll and 0.155 s in pitch."""
    command_rad = np.zeros(2)
    command_rad[axis] = 0.05
    angles = np.array([state.body[6 + axis, 0] for state in fly_attitude(command_rad, 400)])
    reached_s = STEP_S * (1 + np.flatnonzero(angles >= 0.05 * (1.0 - np.exp(-1.0)))[0])
    assert reached_s == pytest.approx(lag_s, abs=0.0051)


def test_the_altitude_loop_has_the_stock_gains() -> None:
    """On height and climb; the thrust is limited. Those of attitude and yaw are in test_vehicle."""
    none, climbing = np.zeros(1), np.full(1, 0.1)
    weight_n = 0.063 * 9.81
    for reference_m, vz_m_s, thrust_n in (
        (-0.1, none, weight_n + 0.08),
        (0.0, climbing, weight_n + 0.03),
        (100.0, none, -1.20204),
        (-100.0, none, 1.20204),
    ):
        found = loops.altitude_thrust(NOMINAL, reference_m, none, vz_m_s)
        np.testing.assert_allclose(found, thrust_n, rtol=1e-14)


def test_altitude_and_heading_reach_their_references() -> None:
    """From half a metre below and 0.3 rad off, height and heading are reached within five seconds."""
    last = fly_attitude(np.zeros(2), 1000, z_m=-0.6, yaw_reference_rad=0.3)[-1]
    np.testing.assert_allclose(last.body[[2, 8], 0], [-1.1, 0.3], atol=1e-3)


def test_attitude_integral_leaks_and_is_limited() -> None:
    """It grows by error times period, leaks a thousandth per second and saturates at 2 rad s."""
    error, none = np.array([[0.2], [-0.4]]), np.zeros((2, 1))
    np.testing.assert_allclose(LOOP.attitude_integral(error, none, none), 0.005 * error, rtol=1e-15)
    held = np.array([[1.0], [-1.0]])
    np.testing.assert_allclose(LOOP.attitude_integral(none, none, held), held * (1.0 - 5e-6), rtol=1e-15)
    limited = LOOP.attitude_integral(3e3 * error, none, none)
    np.testing.assert_array_equal(limited, [[2.0], [-2.0]])


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
    states = fly_attitude(np.zeros(2), 1000, drone=drone, yaw_reference_rad=step_rad)
    assert float(states[-1].body[8, 0]) == pytest.approx(step_rad, abs=0.25)
    return max(float(state.body[2, 0]) + HOVER_HEIGHT_M for state in states)


@pytest.mark.long
def test_a_step_of_the_heading_costs_height() -> None:
    """Of 2 rad: most where all motors are lowered, least where yaw gives way first."""
    lowered_m, clipped_m, kept_m = (lost_height_m(mixer, 2.0) for mixer in ("lower", "clip", "yaw-last"))
    found_m = [lowered_m, clipped_m, kept_m]
    np.testing.assert_allclose(found_m, [0.137, 0.067, 0.049], atol=0.002)
