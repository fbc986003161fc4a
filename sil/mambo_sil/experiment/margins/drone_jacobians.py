"""Simulated drones as linear systems: every number of their state changed, one tick simulated.

A drone is what a flight has: stock loops, motors and, if the flight has sensors, instruments and estimators.
"""

import math
from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.airframe import Airframe, airframe_of
from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.first_order import FirstOrderDrone
from mambo_sil.drone.plant.loops import Demand, altitude_thrust
from mambo_sil.drone.plant.rotors import WRENCH_SIGNS
from mambo_sil.drone.plant.vehicle import Moment, Vehicle, VehicleState, truth
from mambo_sil.drone.sensors.estimators import Suite
from mambo_sil.drone.sensors.instruments import FLOW_IMAGES_PER_TICKS, Sensors
from mambo_sil.drone.sensors.mocap import MotionCapture, sampling
from mambo_sil.drone.sensors.suites import noises_of, suite_of
from mambo_sil.experiment.margins.rebuild import GivenDraws, rebuild
from mambo_sil.flight.loop import HEIGHT_REFERENCE_M, Flight

SETTLE_S: Final = 0.3
"""Time in which the estimators come to rest before the drone is linearised."""
_CHANGE: Final = 1e-5
"""Change of a number, relative to it if it is larger than 1: errors grow with its square, rounding falls."""

_ROUNDING: Final = 1e-8
"""Slopes below it, between numbers scaled as above, are 0: they are differences of rounding errors."""

_WRENCH: Final = WRENCH_SIGNS[[1, 2, 0]]
_ROTORS: Final = 4


@dataclass(frozen=True)
class Signals:
    """Where inputs and outputs of a drone are, for its axes: roll and pitch, 2; with the height 3."""

    axes: int

    @property
    def command(self) -> slice:
        """Inputs: command of roll and pitch, and the thrust over the nominal mass beyond hover."""
        return slice(0, self.axes)

    @property
    def motor(self) -> slice:
        """Inputs: additions to the motor commands that turn about x and y and lift, per command of hover."""
        return slice(self.axes, 2 * self.axes)

    @property
    def push(self) -> slice:
        """Inputs: acceleration along y and x of the world, and upwards."""
        return slice(2 * self.axes, 3 * self.axes)

    @property
    def noise(self) -> int:
        """First input of standard normal noise."""
        return 3 * self.axes

    @property
    def seen(self) -> slice:
        """Outputs: the seen state [x, y, vx, vy, roll, pitch, yaw], then height and climb."""
        return slice(0, 7 if self.axes == LEVEL_AXES else 9)

    @property
    def demand(self) -> slice:
        """Outputs: shares of the motor commands that turn about x and y and lift, per command of hover."""
        return slice(self.seen.stop, self.seen.stop + self.axes)

    @property
    def true(self) -> slice:
        """Outputs: true y and x, and height."""
        return slice(self.demand.stop, self.demand.stop + self.axes)


LEVEL_AXES: Final = 2
"""Axes of a controller without a height, and of a drone whose own loop holds its height."""


@dataclass(frozen=True, eq=False)
class DroneJacobians:
    """D drones over the ticks after which their sensors repeat, each array (D, ticks, rows, columns).

    state' = transition state + inputs input, output = outputs state + feed input, with the inputs and outputs
    of `signals`.
    """

    signals: Signals
    transition: FloatArray
    inputs: FloatArray
    outputs: FloatArray
    feed: FloatArray

    def drone(self, number: int) -> "DroneJacobians":
        """Return one of the drones, each array (ticks, rows, columns)."""
        arrays = (self.transition, self.inputs, self.outputs, self.feed)
        return DroneJacobians(self.signals, *(array[number] for array in arrays))


@dataclass(frozen=True, eq=False)
class _Moving:
    """What a simulation keeps from tick to tick: the drones, and their sensors or None."""

    state: VehicleState
    suite: Any


def repeating_ticks(flight: Flight) -> int:
    """Return the number of ticks after which controller and sensors are called in the same order again."""
    match flight.sensors:
        case Sensors():
            period = FLOW_IMAGES_PER_TICKS[1]
        case MotionCapture() as capture:
            period = sampling(capture.figures, flight.vehicle.drone.step_s).period_ticks
        case _:
            period = 1
    return math.lcm(flight.ticks_per_update, period)


def drone_jacobians(flight: Flight, axes: int = LEVEL_AXES) -> DroneJacobians:
    """Return the drones of a flight at hover, linearised in each of `repeating_ticks`.

    With 3 axes the command of the thrust takes the place of their altitude loop.
    """
    n, vehicle, ticks, signals = flight.flights, flight.vehicle, repeating_ticks(flight), Signals(axes)
    state = _hovering(vehicle, n, signals)
    moving = _Moving(state, _still_sensors(flight, state))
    inputs = np.zeros((signals.noise + noises_of(flight.sensors), n))
    settling = -(-round(SETTLE_S / vehicle.drone.step_s) // ticks) * ticks
    for _ in range(settling):
        moving, _ = _tick(vehicle, moving, inputs, signals)
    found = []
    for _ in range(ticks):
        found.append(_differentiate(vehicle, moving, inputs, signals))
        moving, _ = _tick(vehicle, moving, inputs, signals)
    return DroneJacobians(signals, *(np.stack(parts, axis=1) for parts in zip(*found, strict=True)))


def hover_thrust_n(vehicle: Vehicle) -> PerFlight:
    """Return the demanded thrust that carries the weight of drones, one value or (n,)."""
    share = vehicle.airframe.thrust_factor_n_s2 / airframe_of(vehicle.drone).thrust_factor_n_s2
    return vehicle.airframe.mass_kg * GRAVITY_M_S2 / (vehicle.drone.thrust_gain * share)


def _hovering(vehicle: Vehicle, n: int, signals: Signals) -> VehicleState:
    """Return n drones at rest, where their altitude loop demands the thrust that carries their weight."""
    drone, demand_n = vehicle.drone, hover_thrust_n(vehicle)
    position_m = np.zeros((3, n))
    position_m[2] = HEIGHT_REFERENCE_M
    if signals.axes == LEVEL_AXES:
        position_m[2] -= (drone.weight_n - demand_n) / max(drone.altitude.p_n_m, 1e-9)
    return vehicle.at_rest(position_m, 0.0, demand_n / (4.0 * airframe_of(drone).thrust_per_command_n))


def _still_sensors(flight: Flight, state: VehicleState) -> Any:
    """Return the sensors of a flight without noise, or None.

    The accelerometer does not correct the tilt: in flight noise does not let it. Smoothed, the Mambo's
    has 18 times the width of the gate.
    """
    given = flight.sensors
    if given is None:
        return None
    if isinstance(given, Sensors):
        unbiased = (0.0, 0.0, 0.0)
        given = replace(given, accelerometer_bias_m_s2=unbiased, gyro_bias_rad_s=unbiased)
    n = flight.flights
    suite = suite_of(given, (0,) * n, truth(state), flight.vehicle.drone.step_s)
    suite = rebuild(suite, n, np.copy, GivenDraws(np.zeros((noises_of(given), n))))
    if isinstance(suite, Suite):
        suite.shut_gate()
    return suite


def _tick(
    vehicle: Vehicle, moving: _Moving, inputs: FloatArray, signals: Signals
) -> tuple[_Moving, FloatArray]:
    """Return n drones one tick later, and the outputs (rows, n) at this tick, for inputs (columns, n)."""
    state, suite, commands_thrust = moving.state, moving.suite, signals.axes > LEVEL_AXES
    command, push = inputs[signals.command], inputs[signals.push]
    true = truth(state)
    seen = vehicle.measured(true)
    if suite is not None:
        suite = rebuild(suite, inputs.shape[1], np.copy, GivenDraws(inputs[signals.noise :]))
        seen = suite.estimate(seen)
    if commands_thrust:
        thrust_n = hover_thrust_n(vehicle) + vehicle.drone.body.mass_kg * command[2]
    else:
        thrust_n = altitude_thrust(
            vehicle.drone, HEIGHT_REFERENCE_M, seen.position_m[2], seen.velocity_m_s[2]
        )
    moment = Moment(push_m_s2=(push[1], push[0]), lift_m_s2=push[2] if commands_thrust else 0.0)
    demand = np.zeros((signals.axes, inputs.shape[1]))
    if isinstance(vehicle.loop, FirstOrderDrone):
        state, _ = vehicle.advance(state, command[:2], thrust_n, 0.0, seen=seen, moment=moment)
    else:
        asked = Demand(command[:2], 0.0, thrust_n, seen.euler_rad, seen.rates_rad_s)
        motor_command, memory = vehicle.loop.command_motors(asked, state.memory)
        hover, signs = airframe_of(vehicle.drone).hover_command, _WRENCH[: signals.axes]
        demand = signs @ motor_command / (_ROTORS * hover)
        motor_command = motor_command + hover * (signs.T @ inputs[signals.motor])
        state = VehicleState(*vehicle.integrate(state, motor_command, moment), memory)
    outputs = [seen.position_m[:2], seen.velocity_m_s[:2], seen.euler_rad]
    outputs += [-seen.position_m[2:], -seen.velocity_m_s[2:]] if commands_thrust else []
    outputs += [demand, true.position_m[1::-1], *([-true.position_m[2:]] if commands_thrust else [])]
    return _Moving(state, suite), np.concatenate(outputs)


def _differentiate(
    vehicle: Vehicle, moving: _Moving, inputs: FloatArray, signals: Signals
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return transition, inputs, outputs and feed of D drones in one tick, each (D, rows, columns)."""
    base = _numbers(moving)
    rows, n = base.shape
    changed = rows + len(inputs)
    change = _CHANGE * np.maximum(1.0, np.abs(np.concatenate([base, inputs])))
    signs = np.array([1.0, -1.0])
    changes = np.einsum("rn,rc,s->rncs", change, np.eye(changed), signs).reshape(changed, -1)
    many = np.repeat(np.concatenate([base, inputs]), 2 * changed, axis=1) + changes
    copies, moved = _repeat(vehicle, 2 * changed), _with_numbers(moving, many[:rows])
    after, outputs = _tick(copies, moved, many[rows:], signals)
    both = np.concatenate([_numbers(after), outputs]).reshape(-1, n, changed, 2)
    slopes = (both[..., 0] - both[..., 1]) / (2.0 * change.T)
    scale = np.ones((len(slopes), n))
    scale[:rows] = change[:rows] / _CHANGE
    size = np.abs(slopes) * (change / _CHANGE).T / scale[:, :, np.newaxis]
    slopes = np.where(size > _ROUNDING, slopes, 0.0).swapaxes(0, 1)
    return (
        slopes[:, :rows, :rows],
        slopes[:, :rows, rows:],
        slopes[:, rows:, :rows],
        slopes[:, rows:, rows:],
    )


def _numbers(moving: _Moving) -> FloatArray:
    """Return all numbers (rows, n) that a simulation keeps.

    In place of four speeds of rotors, what they share: so roll and pitch do not depend on the same number.
    """
    state, n = moving.state, moving.state.body.shape[1]
    shared_rad_s = WRENCH_SIGNS @ state.rotor_speed_rad_s / _ROTORS
    found = [state.body, shared_rad_s, state.memory]

    def note(array: FloatArray) -> FloatArray:
        found.append(array.reshape(-1, n))
        return array

    rebuild(moving.suite, n, note, GivenDraws(np.zeros(0)))
    return np.concatenate(found)


def _with_numbers(moving: _Moving, numbers: FloatArray) -> _Moving:
    """Return a simulation of m drones with numbers (rows, m), in the order of `_numbers`."""
    first, n = 0, moving.state.body.shape[1]

    def take(array: FloatArray) -> FloatArray:
        nonlocal first
        count = int(np.prod(array.shape[:-1]))
        first += count
        return numbers[first - count : first].reshape(*array.shape[:-1], -1)

    state = moving.state
    body, shared_rad_s = take(state.body), take(state.rotor_speed_rad_s)
    given = VehicleState(body, WRENCH_SIGNS.T @ shared_rad_s, take(state.memory))
    return _Moving(given, rebuild(moving.suite, n, take, GivenDraws(np.zeros(0))))


def _repeat(vehicle: Vehicle, times: int) -> Vehicle:
    """Return each of n drones `times` times, one after the other."""

    def each(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(each, value))
        return np.repeat(value, times) if np.ndim(value) else value

    airframe = Airframe(*(each(getattr(vehicle.airframe, one.name)) for one in fields(Airframe)))
    lag_s, drag_1_s = each(vehicle.motor_lag_s), each(vehicle.drag_1_s)
    lever_error_m = each(vehicle.lever_error_m)
    return replace(
        vehicle, airframe=airframe, motor_lag_s=lag_s, drag_1_s=drag_1_s, lever_error_m=lever_error_m
    )
