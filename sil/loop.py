"""The closed loop: trajectory, position controller and vehicle, for n flights at once.

    target ------------------> position controller --roll, pitch--> stock loops -> rotors -> rigid body
                               every update period                  every 5 ms                    |
                                       ^-------------------------- state -------------------------'

The simulation is pure: the same flight with the same controller gives the same trace, and a flight
among many is the same, bit for bit, as the flight alone.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sil.arrays import FloatArray, IntArray, PerFlight
from sil.errors import FlightError
from sil.plant import loops
from sil.plant.airframe import MAMBO
from sil.plant.rigid_body import EULER, POSITION, world_velocity
from sil.plant.vehicle import STEP_S, Vehicle, VehicleState, thrust_demand
from sil.traces import Trace
from sil.trajectories import Trajectory

HEIGHT_REFERENCE_M = -1.1
"""z of every flight, up being negative."""

TAKE_OFF_PHASE_S = 5.0
"""Time that a take-off has before the trajectory's clock starts."""

LOST_M = 1e4
"""Distance from the origin, along any axis, at which a flight counts as lost."""


class Outcome(Protocol):
    """What a position controller returns for n flights."""

    @property
    def command_rad(self) -> NDArray[np.floating[Any]]:
        """Roll and pitch (n, 2)."""
        ...

    @property
    def status(self) -> IntArray:
        """0 where all went well (n,)."""
        ...


class PositionController(Protocol):
    """What the closed loop asks of a position controller."""

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Outcome:
        """Return the command for states (n, 7), targets (n, 4) and thrust accelerations (n,).

        The columns are [x, y, vx, vy, roll, pitch, yaw] and [x, y, vx, vy], in the world frame (NED).
        The thrust acceleration is positive along -z of the body.
        """
        ...


class Start(Enum):
    """How a flight begins, always above or at the first point of its trajectory."""

    HOVER = "hover"
    """At `HEIGHT_REFERENCE_M`, level and at rest, at t = 0."""
    TAKE_OFF = "take-off"
    """On the ground, `TAKE_OFF_PHASE_S` before t = 0."""


@dataclass(frozen=True, eq=False)
class Flight:
    """One simulation of n flights; what differs between them comes as an array (n,)."""

    trajectory: Trajectory
    duration_s: float = 100.0
    flights: int = 1
    start: Start = Start.HOVER
    yaw_rad: PerFlight = 0.0
    """Heading at the start, which the yaw loop holds."""
    yaw_rate_rad_s: PerFlight = 0.0
    """Rate at which the heading held turns, from t = 0 on."""
    vehicle: Vehicle = field(default_factory=Vehicle)
    update_period_s: float = 0.01
    """Period of the position controller: a whole number of ticks of 5 ms."""

    def __post_init__(self) -> None:
        if not self.update_period_s <= self.duration_s < math.inf:
            raise FlightError(
                f"duration_s = {self.duration_s:g} must be finite and at least "
                f"update_period_s = {self.update_period_s:g}"
            )
        if self.update_period_s <= 0.0 or abs(math.remainder(self.update_period_s, STEP_S)) > 1e-9:
            raise FlightError(
                f"update_period_s = {self.update_period_s:g} must be a whole multiple of {STEP_S:g}"
            )

    @property
    def ticks_per_update(self) -> int:
        """Ticks of the stock loops for each step of the position controller."""
        return round(self.update_period_s / STEP_S)

    def times_s(self) -> FloatArray:
        """Return the instants (k,) at which the position controller runs; t = 0 is one of them."""
        before = round(TAKE_OFF_PHASE_S / self.update_period_s) if self.start is Start.TAKE_OFF else 0
        after = round(self.duration_s / self.update_period_s)
        return self.update_period_s * np.arange(-before, after + 1, dtype=np.float64)

    def targets(self) -> FloatArray:
        """Return the targets (k, n, 4) at these instants; raises `FlightError`."""
        target = self.trajectory.target(self.times_s())
        if target.ndim == 2:
            return np.broadcast_to(target[:, np.newaxis, :], (len(target), self.flights, 4))
        if target.shape[1] != self.flights:
            raise FlightError(f"flights = {self.flights} must be {target.shape[1]}, one for each trajectory")
        return target


def fly(
    flight: Flight, controller: PositionController, progress: Callable[[float], None] | None = None
) -> Trace:
    """Simulate and return the trace; `progress` hears the share flown (0 to 1) after every update.

    Raises `FlightError`.
    """
    ticks_per_update = flight.ticks_per_update
    times_s, targets = flight.times_s(), flight.targets()
    trace = _blank(times_s, targets)
    open_loop_until_s = times_s[0] + (loops.TAKE_OFF_S if flight.start is Start.TAKE_OFF else 0.0)
    vehicle, state = flight.vehicle, _start(flight, targets[0])
    for update, time_s in enumerate(times_s):
        state = _without_lost(state)
        lifting = time_s < open_loop_until_s - STEP_S / 2.0
        command_rad = _record(trace, update, state, _thrust_n(state, lifting), controller)
        heading_rad = flight.yaw_rad + flight.yaw_rate_rad_s * max(time_s, 0.0)
        for _ in range(ticks_per_update):
            with np.errstate(all="ignore"):
                state = vehicle.step(state, command_rad, _thrust_n(state, lifting), heading_rad)
        if progress is not None:
            progress((update + 1) / len(times_s))
    return trace


def _start(flight: Flight, first_target: FloatArray) -> VehicleState:
    """Return the state in which n flights begin above or at their first targets (n, 4)."""
    position_m = np.zeros((3, flight.flights))
    position_m[:2] = first_target[:, :2].T
    if flight.start is Start.TAKE_OFF:
        return flight.vehicle.at_rest(position_m, flight.yaw_rad, MAMBO.command_min)
    position_m[2] = HEIGHT_REFERENCE_M
    return flight.vehicle.at_rest(position_m, flight.yaw_rad, MAMBO.hover_command)


def _thrust_n(state: VehicleState, lifting: bool) -> FloatArray:
    """Return the total thrust (n,) asked for: open loop while lifting off, then the altitude loop."""
    if lifting:
        return np.full(state.body.shape[1], loops.take_off_thrust())
    return thrust_demand(state, HEIGHT_REFERENCE_M)


def _without_lost(state: VehicleState) -> VehicleState:
    """Return the state with NaN in the flights that are lost."""
    lost = ~(np.abs(state.body[POSITION]).max(axis=0) < LOST_M) | ~np.isfinite(state.body).all(axis=0)
    if not lost.any():
        return state
    return VehicleState(
        np.where(lost, np.nan, state.body), state.rotor_speed_rad_s, state.attitude_integral_rad_s
    )


def _blank(times_s: FloatArray, targets: FloatArray) -> Trace:
    """Return a trace to be filled in."""
    shape = targets.shape[:2]
    return Trace(
        time_s=times_s,
        position_m=np.empty((*shape, 3)),
        velocity_m_s=np.empty((*shape, 3)),
        euler_rad=np.empty((*shape, 3)),
        target=targets,
        command_rad=np.empty((*shape, 2)),
        thrust_acceleration_m_s2=np.empty(shape),
        status=np.empty(shape, dtype=np.int64),
    )


def _record(
    trace: Trace, update: int, state: VehicleState, thrust_n: FloatArray, controller: PositionController
) -> FloatArray:
    """Let the controller take one step, enter it in the trace, and return the command (2, n).

    The state is the true one: sensors would stand here.
    """
    position_m, euler_rad = state.body[POSITION], state.body[EULER]
    velocity_m_s = world_velocity(state.body)
    measured = np.ascontiguousarray(np.concatenate([position_m[:2], velocity_m_s[:2], euler_rad]).T)
    thrust_acceleration_m_s2 = thrust_n / MAMBO.mass_kg
    outcome = controller.step(measured, np.ascontiguousarray(trace.target[update]), thrust_acceleration_m_s2)
    trace.position_m[update] = position_m.T
    trace.velocity_m_s[update] = velocity_m_s.T
    trace.euler_rad[update] = euler_rad.T
    trace.command_rad[update] = outcome.command_rad
    trace.thrust_acceleration_m_s2[update] = thrust_acceleration_m_s2
    trace.status[update] = outcome.status
    command_rad: FloatArray = trace.command_rad[update].T
    return command_rad
