"""Drones as linear systems against their simulation, tick by tick, from small random inputs."""

from dataclasses import replace
from typing import Any, Final

import numpy as np
import pytest

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.airframe import airframe_of
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.first_order import FirstOrderDrone
from mambo_sil.drone.plant.loops import Demand, altitude_thrust
from mambo_sil.drone.plant.vehicle import Moment, Vehicle, truth
from mambo_sil.drone.vehicles import VEHICLES, vehicle_toml
from mambo_sil.experiment.margins.drone_jacobians import Signals, _hovering, drone_jacobians
from mambo_sil.flight.loop import HEIGHT_REFERENCE_M, Flight
from mambo_sil.flight.trajectories import Hover

WEAK: Final = Vehicle.of(
    vehicle_toml.parse(
        VEHICLES.text("crazyflie-flown") + "\n[thrust]\nlag_s = 0.06\ngain = 0.8\n", "mine", "mine.toml"
    )
)
"""A drone that gets 0.8 of the demanded thrust."""
SIGNS: Final = np.array([[1.0, -1.0, -1.0, 1.0], [1.0, 1.0, -1.0, -1.0], [1.0, 1.0, 1.0, 1.0]])
"""Of each rotor, in what turns about x, about y, and lifts."""
TICKS: Final = 40


def simulated(vehicle: Vehicle, axes: int, given: FloatArray) -> Any:
    """Return what is seen, shares of the motor commands, and the true place, in each tick (ticks, outputs).

    From hover; inputs (ticks, 3 axes) are commands, additions to the motors, and accelerations.
    """
    drone, airframe = vehicle.drone, airframe_of(vehicle.drone)
    gain = drone.thrust.gain if drone.thrust else 1.0
    hover_n = drone.body.mass_kg * GRAVITY_M_S2 / gain
    state = vehicle.at_rest(
        np.array([[0.0], [0.0], [HEIGHT_REFERENCE_M]]), 0.0, hover_n / (4.0 * airframe.thrust_per_command_n)
    )
    found = []
    for values in given:
        command, motors, push = values.reshape(3, axes, 1)
        true, demand = truth(state), np.zeros((axes, 1))
        thrust_n = np.array([hover_n])
        if axes == 3:
            thrust_n = thrust_n + drone.body.mass_kg * command[2]
        else:
            thrust_n = altitude_thrust(drone, HEIGHT_REFERENCE_M, true.position_m[2], true.velocity_m_s[2])
        moment = Moment(push_m_s2=(push[1], push[0]), lift_m_s2=push[2] if axes == 3 else 0.0)
        loop = vehicle.loop
        if isinstance(loop, FirstOrderDrone):
            after, _ = vehicle.advance(state, command[:2], thrust_n, 0.0, seen=true, moment=moment)
        else:
            asked = Demand(command[:2], 0.0, thrust_n, true.euler_rad, true.rates_rad_s)
            commanded, memory = loop.command_motors(asked, state.memory)
            demand = SIGNS[:axes] @ commanded / (4.0 * airframe.hover_command)
            commanded = commanded + airframe.hover_command * (SIGNS[:axes].T @ motors)
            after = type(state)(*vehicle.integrate(state, commanded, moment), memory)
        x_m, y_m, z_m = true.position_m[:, 0]
        lift = [-z_m, -true.velocity_m_s[2, 0]] if axes == 3 else []
        seen = [x_m, y_m, *true.velocity_m_s[:2, 0], *true.euler_rad[:, 0], *lift]
        found.append([*seen, *demand[:, 0], y_m, x_m, *lift[:1]])
        state = after
    return np.array(found)


@pytest.mark.parametrize(
    ("vehicle", "axes"),
    [
        (Vehicle.from_preset("mambo"), 2),
        (Vehicle.from_preset("crazyflie"), 2),
        (Vehicle.from_preset("crazyflie"), 3),
        (Vehicle.from_preset("generic"), 2),
        (Vehicle.from_preset("generic"), 3),
        (WEAK, 3),
    ],
)
def test_outputs_are_those_of_a_simulation(vehicle: Vehicle, axes: int) -> None:
    """Of commands, motors and pushes of a millionth at once: to a part of ten thousand, each to 0.5 %."""
    given = np.random.default_rng(3).normal(0, 1e-6, (TICKS, 3 * axes))
    expected = simulated(vehicle, axes, given) - simulated(vehicle, axes, 0.0 * given)
    system = drone_jacobians(Flight(Hover(), vehicle=vehicle), axes).drone(0)
    assert system.signals.true.stop == expected.shape[1]
    state, found = np.zeros(system.transition.shape[1]), []
    for tick, values in enumerate(given):
        phase = tick % len(system.transition)
        found.append(system.outputs[phase] @ state + system.feed[phase] @ values)
        state = system.transition[phase] @ state + system.inputs[phase] @ values
    scale = np.abs(expected).max(axis=0)
    assert np.array(found) == pytest.approx(expected, rel=0.0, abs=1e-4 * scale.max())
    for column, size in enumerate(scale):
        assert np.array(found)[:, column] == pytest.approx(
            expected[:, column], rel=0.0, abs=5e-3 * size + 3e-13
        )


def loaded(mass: Any, thrust: Any) -> Vehicle:
    """Return a Crazyflie, or several, with other masses and thrusts than those that its loops expect."""
    vehicle = Vehicle.from_preset("crazyflie")
    kept = vehicle.airframe
    airframe = replace(kept, mass_kg=mass * kept.mass_kg, thrust_factor_n_s2=thrust * kept.thrust_factor_n_s2)
    return replace(vehicle, airframe=airframe)


def test_a_loaded_drone_rests_where_its_loop_carries_it() -> None:
    """With 1.2 times the mass and 0.9 times the thrust, for half a second."""
    vehicle = loaded(1.2, 0.9)
    drone, state = vehicle.drone, _hovering(vehicle, 1, Signals(2))
    start = state.body.copy()
    for _ in range(round(0.5 / drone.step_s)):
        true = truth(state)
        thrust_n = altitude_thrust(drone, HEIGHT_REFERENCE_M, true.position_m[2], true.velocity_m_s[2])
        state, _ = vehicle.advance(state, np.zeros((2, 1)), thrust_n, 0.0, seen=true)
    assert state.body == pytest.approx(start, abs=1e-9)


@pytest.mark.parametrize("axes", [2, 3])
def test_drones_side_by_side_are_those_alone(axes: int) -> None:
    """Each with its own mass and thrust."""
    masses, thrusts = np.array([1.0, 1.2, 0.9]), np.array([1.0, 0.9, 1.1])
    together = drone_jacobians(Flight(Hover(), vehicle=loaded(masses, thrusts), flights=3), axes)
    for number, (mass, thrust) in enumerate(zip(masses.tolist(), thrusts.tolist(), strict=True)):
        alone = drone_jacobians(Flight(Hover(), vehicle=loaded(mass, thrust)), axes).drone(0)
        found = together.drone(number)
        for name in ("transition", "inputs", "outputs", "feed"):
            assert getattr(found, name) == pytest.approx(getattr(alone, name), rel=1e-6, abs=1e-7)
