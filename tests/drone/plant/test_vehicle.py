"""The assembled drone: which loop drives which axis; battery, payload, wind and push during a tick."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_sil.drone.plant.airframe import MAMBO
from mambo_sil.drone.plant.vehicle import STEP_S, Moment, Seen, Vehicle, VehicleState, truth

FloatArray = NDArray[np.float64]

HOVER = np.full((4, 1), MAMBO.hover_command)
TURNING = HOVER * [[1.0], [1.1], [0.8], [1.3]]
"""Motor commands that turn the drone about all axes."""


def moving(flights: int = 1) -> VehicleState:
    """Return n equal drones that move, lean and turn, their rotors away from the steady speed."""
    state = Vehicle().at_rest(np.zeros((3, flights)), 0.0, 200.0)
    state.body[3:] = np.array([0.5, -0.4, 0.3, 0.2, -0.1, 0.4, 0.3, 0.5, -0.4])[:, np.newaxis]
    return state


def hovering(flights: int = 1) -> VehicleState:
    """Return n level drones at rest."""
    return Vehicle().at_rest(np.zeros((3, flights)), 0.0, MAMBO.hover_command)


def drift(vehicle: Vehicle, state: VehicleState, ticks: int, moment: Moment | None = None) -> VehicleState:
    """Return the state after some ticks of the hover command."""
    for _ in range(ticks):
        body, speed = vehicle.integrate(state, HOVER, moment)
        state = replace(state, body=body, rotor_speed_rad_s=speed)
    return state


def same_bits(one: tuple[FloatArray, ...], other: tuple[FloatArray, ...]) -> bool:
    """Return whether all arrays are equal in every bit."""
    return all(a.tobytes() == b.tobytes() for a, b in zip(one, other, strict=True))


def test_the_nominal_drone_slows_down_with_the_drag_of_the_mambo() -> None:
    """Level at hover thrust the horizontal velocity decays with exp(-0.067 t) and the height stays."""
    state = hovering()
    state.body[3:5, 0] = [1.0, -2.0]
    end = drift(Vehicle(), state, 1000).body
    np.testing.assert_allclose(end[3:5, 0], np.array([1.0, -2.0]) * np.exp(-0.067 * 5.0), rtol=1e-9)
    np.testing.assert_allclose(end[[2, 5], 0], 0.0, atol=1e-12)


def test_wind_carries_the_drone_along() -> None:
    """Level at hover thrust the velocity approaches that of the air with exp(-d t), along world x and y."""
    state = hovering()
    state.body[8] = 0.7
    end = truth(drift(Vehicle(drag_1_s=0.5), state, 400, Moment(air_m_s=(2.0, -1.5))))
    np.testing.assert_allclose(
        end.velocity_m_s[:, 0], np.array([2.0, -1.5, 0.0]) * (1.0 - np.exp(-0.5 * 2.0)), rtol=1e-9, atol=1e-12
    )


def test_a_default_moment_is_undisturbed() -> None:
    """Full battery, no payload and still air give the bits of a tick without disturbances."""
    vehicle, state = Vehicle(motor_lag_s=0.03), moving()
    assert same_bits(vehicle.integrate(state, TURNING, Moment()), vehicle.integrate(state, TURNING))


def test_a_tired_battery_weakens_thrust_and_torques_alike() -> None:
    """Half the rotor thrust and torque is a drone with half of both rotor factors, in every bit."""
    half = replace(
        MAMBO,
        thrust_factor_n_s2=0.5 * MAMBO.thrust_factor_n_s2,
        torque_factor_n_m_s2=0.5 * MAMBO.torque_factor_n_m_s2,
    )
    tired = Vehicle(motor_lag_s=0.03).integrate(moving(), TURNING, Moment(thrust_share=0.5))
    weak = Vehicle(half, motor_lag_s=0.03).integrate(moving(), TURNING)
    assert same_bits(tired, weak)


def test_a_payload_is_mass_only() -> None:
    """A drone with a payload is a drone of the sum of the masses, with the same inertia, in every bit."""
    loaded = Vehicle().integrate(moving(), TURNING, Moment(payload_kg=0.005))
    heavy = Vehicle(replace(MAMBO, mass_kg=MAMBO.mass_kg + 0.005)).integrate(moving(), TURNING)
    assert same_bits(loaded, heavy)


def test_a_push_changes_the_velocity_by_impulse_over_total_mass() -> None:
    """A payload of 7 g makes 70 g; the change is along the axes of the world for a leaning drone."""
    state = moving()
    impulse_n_s = np.array([[0.007], [-0.0014], [0.0021]])
    pushed = Vehicle().apply_impulse(state, impulse_n_s, 0.007)
    change_m_s = truth(pushed).velocity_m_s - truth(state).velocity_m_s
    np.testing.assert_allclose(change_m_s[:, 0], [0.1, -0.02, 0.03], rtol=1e-12)
    np.testing.assert_array_equal(pushed.body[[0, 1, 2, *range(6, 12)]], state.body[[0, 1, 2, *range(6, 12)]])


def test_a_push_leaves_its_input_and_the_flights_beside_it_alone() -> None:
    """Not a bit of another flight changes, not even the sign of a zero; the state before stays as it was."""
    state = moving(2)
    state.body[3:6, 1] = -0.0
    before = state.body.copy()
    pushed = Vehicle().apply_impulse(state, np.array([[0.01, 0.0]] * 3), 0.0)
    assert state.body.tobytes() == before.tobytes()
    assert pushed.body[:, 1].tobytes() == before[:, 1].tobytes()


NONE = np.zeros((3, 1))
TORQUE_INPUTS = {
    "roll command": (0, 0.010),
    "pitch command": (1, 0.013),
    "yaw reference": (2, 0.004),
    "roll": (0, -0.010),
    "pitch": (1, -0.013),
    "yaw": (2, -0.004),
    "roll rate": (0, -0.0028),
    "pitch rate": (1, -0.0020),
    "yaw rate": (2, -0.0012),
    "roll integral": (0, 0.010),
    "pitch integral": (1, 0.010),
}
"""Axis and torque in N m per unit of every input of the attitude and yaw loops."""


@pytest.mark.parametrize("name", TORQUE_INPUTS)
def test_every_loop_turns_its_own_axis(name: str) -> None:
    """One tick after 0.01 of one input only its axis turns, by torque times period over inertia."""
    axis, gain = TORQUE_INPUTS[name]
    size = 0.01
    values = {what: size * (what == name) for what in TORQUE_INPUTS}
    angles = np.array([[values[what]] for what in ("roll", "pitch", "yaw")])
    rates = np.array([[values[f"{what} rate"]] for what in ("roll", "pitch", "yaw")])
    integral = np.array([[values["roll integral"]], [values["pitch integral"]]])
    after, _ = Vehicle().advance(
        replace(hovering(), memory=integral),
        np.array([[values["roll command"]], [values["pitch command"]]]),
        np.array([MAMBO.mass_kg * 9.81]),
        values["yaw reference"],
        seen=Seen(NONE, NONE, angles, rates),
    )
    expected = np.zeros(3)
    expected[axis] = gain * size * STEP_S / float(MAMBO.inertia_kg_m2[axis])
    np.testing.assert_allclose(after.body[9:, 0], expected, rtol=1e-9, atol=1e-13)
    error = [values[f"{what} command"] - values[what] for what in ("roll", "pitch")]
    grown = integral[:, 0] * (1.0 - 5e-6) + STEP_S * np.array(error)
    np.testing.assert_allclose(after.memory[:, 0], grown, rtol=1e-12)


def test_a_drone_at_rest_has_no_integral() -> None:
    """Both integral states (2, n) are zero at the start."""
    np.testing.assert_array_equal(hovering(3).memory, np.zeros((2, 3)), strict=True)
