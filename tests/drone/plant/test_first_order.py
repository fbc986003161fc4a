"""A drone of whose code nothing is known: its angles and its motion against closed forms."""

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_sil.drone.plant.airframe import airframe_of
from mambo_sil.drone.plant.vehicle import Moment, Seen, Vehicle, VehicleState, truth
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from tests.support.scenarios import FLOWN, LATE, changed

FloatArray = NDArray[np.float64]

NONE = np.zeros((3, 1))
UNSEEN = Seen(*[np.full((3, 1), np.nan)] * 4)
"""The angles do not depend on what sensors see."""


def fly(
    drone: VehicleFile,
    command_rad: tuple[float, float],
    ticks: int,
    *,
    yaw_rad: float = 0.0,
    reference_rad: float | None = None,
    vehicle: Vehicle | None = None,
    moment: Moment | None = None,
    thrust: float = 1.0,
) -> list[VehicleState]:
    """Return the states at the start and after each tick of a held command, with thrust over weight."""
    vehicle = vehicle or Vehicle.of(drone)
    states = [vehicle.at_rest(np.zeros((3, 1)), yaw_rad, 0.0)]
    for _ in range(ticks):
        state, _ = vehicle.advance(
            states[-1],
            np.array([[command_rad[0]], [command_rad[1]]]),
            np.array([thrust * drone.weight_n]),
            yaw_rad if reference_rad is None else reference_rad,
            seen=UNSEEN,
            moment=moment,
        )
        states.append(state)
    return states


@pytest.mark.parametrize("drone", [FLOWN, LATE, changed(LATE, attitude={"rate_hz": 1000})])
def test_each_angle_has_its_gain_lag_and_dead_time(drone: VehicleFile) -> None:
    """Exactly, although dead times are no multiples of a tick: gain (1 - exp(-(t - dead time) / lag))."""
    attitude = drone.attitude
    assert attitude.kind == "first_order"
    states = fly(drone, (0.1, -0.2), 200)
    time_s = drone.step_s * np.arange(201)
    for axis, response in enumerate((attitude.roll, attitude.pitch)):
        grown = 1.0 - np.exp(-np.maximum(time_s - response.dead_time_s, 0.0) / response.lag_s)
        angle = [state.body[6 + axis, 0] for state in states]
        np.testing.assert_allclose(angle, (0.1, -0.2)[axis] * response.gain * grown, atol=1e-12)


def test_yaw_follows_its_reference_with_a_lag() -> None:
    """Reference (1 - exp(-t / lag))."""
    states = fly(LATE, (0.0, 0.0), 300, reference_rad=0.5)
    time_s = LATE.step_s * np.arange(301)
    expected = 0.5 * (1.0 - np.exp(-time_s / 0.3))
    np.testing.assert_allclose([state.body[8, 0] for state in states], expected, atol=1e-12)


def test_a_tilt_accelerates_by_its_share_of_g_against_drag() -> None:
    """At constant tilt and height the velocity approaches k g tan(tilt) / drag with exp(-drag t)."""
    vehicle = Vehicle.of(FLOWN)
    state = fly(FLOWN, (0.1, 0.0), 400, yaw_rad=0.7)[-1]
    tilt_rad = 0.82 * 0.1
    assert state.body[6, 0] == pytest.approx(tilt_rad, rel=1e-12)
    thrust_n = np.array([FLOWN.weight_n / np.cos(tilt_rad)])
    start = truth(state).velocity_m_s[:, 0]
    for _ in range(200):
        state, _ = vehicle.advance(state, np.array([[0.1], [0.0]]), thrust_n, 0.7, seen=UNSEEN)
    limit = 0.87 * 9.81 * np.tan(tilt_rad) / 0.15 * np.array([-np.sin(0.7), np.cos(0.7), 0.0])
    expected = limit + (start - limit) * np.exp([-0.15, -0.15, 0.0])
    expected[2] = start[2]
    np.testing.assert_allclose(truth(state).velocity_m_s[:, 0], expected, rtol=1e-8)


def test_at_its_trims_a_drone_does_not_accelerate() -> None:
    """The angles are those that it reports; level, it accelerates as if tilted by minus its trims."""
    trims = {"roll_trim_rad": 0.03, "pitch_trim_rad": -0.02}
    gain = {"gain": 1.0, "lag_s": 0.05}
    drone = changed(FLOWN, body={"drag_1_s": 0.0}, attitude=trims | {"roll": gain, "pitch": gain})
    states = fly(drone, (0.03, -0.02), 400)
    at_trim, later = (truth(states[tick]).velocity_m_s[:, 0] for tick in (200, 400))
    np.testing.assert_allclose(at_trim, later, atol=1e-9)
    levelled = truth(fly(drone, (0.0, 0.0), 100)[-1]).velocity_m_s[:, 0]
    tilted = truth(fly(changed(drone, attitude=dict.fromkeys(trims, 0.0)), (0.0, 0.0), 100)[-1])
    assert not tilted.velocity_m_s[:2].any()
    expected = 0.87 * 9.81 * np.array([np.tan(-0.02) * np.cos(0.03), -np.sin(0.03)]) * 0.5
    np.testing.assert_allclose(levelled[:2], expected, rtol=2e-3)


def test_air_push_battery_and_payload_act_on_the_body() -> None:
    """Still and level: drag towards the air, the push's acceleration, and thrust over the whole mass."""
    vehicle = Vehicle.of(FLOWN)
    vehicle = Vehicle(vehicle.airframe, 0.0, 0.15, FLOWN)
    moment = Moment(thrust_share=0.9, payload_kg=0.01, air_m_s=(2.0, -1.0), push_m_s2=(0.3, -0.2))
    state = fly(FLOWN, (0.0, 0.0), 1, vehicle=vehicle, moment=moment)[-1]
    found = truth(state).velocity_m_s[:, 0] / FLOWN.step_s
    expected = [0.15 * 2.0 + 0.3, -0.15 - 0.2, 9.81 * (1.0 - 0.9 * 0.03 / 0.04)]
    np.testing.assert_allclose(found, expected, rtol=1e-3)


def test_a_negative_demand_is_no_thrust() -> None:
    """Rotors do not pull down: the drone falls freely."""
    state = fly(FLOWN, (0.0, 0.0), 100, thrust=-1.0)[-1]
    assert truth(state).velocity_m_s[2, 0] == pytest.approx(9.81 * 0.5, rel=1e-12)


@pytest.mark.parametrize("dead_time_s", [0.0, 0.02, 0.0151])
def test_the_thrust_has_its_gain_lag_and_dead_time(dead_time_s: float) -> None:
    """At rest, then asked for twice the weight: gain weight (2 - exp(-(t - dead time) / lag)), integrated."""
    response = {"gain": 0.9, "lag_s": 0.06, "dead_time_s": dead_time_s}
    drone = changed(LATE, attitude={"roll_trim_rad": 0.0, "pitch_trim_rad": 0.0}, thrust=response)
    vehicle = Vehicle.of(drone)
    state = vehicle.at_rest(np.zeros((3, 1)), 0.0, airframe_of(drone).hover_command)
    down_m_s = []
    for _ in range(100):
        state, _ = vehicle.advance(
            state, np.zeros((2, 1)), np.array([2.0 * drone.weight_n]), 0.0, seen=UNSEEN
        )
        down_m_s.append(truth(state).velocity_m_s[2, 0])
    time_s = drone.step_s * np.arange(1, 101)
    acting_s = np.maximum(time_s - dead_time_s, 0.0)
    risen_s = acting_s - 0.06 * (1.0 - np.exp(-acting_s / 0.06))
    np.testing.assert_allclose(down_m_s, 9.81 * (time_s - 0.9 * (time_s + risen_s)), atol=1e-5)


def test_the_body_rates_are_those_of_the_angles() -> None:
    """Once both commands act, the differences of the angles are what equations 4 and 5 make of the rates."""
    drone = changed(LATE, attitude={"rate_hz": 1000})
    states = fly(drone, (0.3, -0.4), 400, reference_rad=0.8)
    for before, here, after in zip(states[110:], states[111:], states[112:], strict=False):
        (roll, pitch, _), (p, q, r) = here.body[6:9, 0], here.body[9:, 0]
        turning = (np.sin(roll) * q + np.cos(roll) * r) / np.cos(pitch)
        euler_rates = [p + np.sin(pitch) * turning, np.cos(roll) * q - np.sin(roll) * r, turning]
        change = (after.body[6:9, 0] - before.body[6:9, 0]) / (2.0 * drone.step_s)
        np.testing.assert_allclose(euler_rates, change, atol=2e-3)
