"""The closed loop: trajectory, position controller and drone, for n flights at once.

The commands run its equal in C, `flight/engine/loop.c`, which has the same bits.

    target -> position controller --roll, pitch--> link -> inner loops -> rotors -> rigid body <- disturbances
              every update period                          every tick                    |
                      ^------------------------------------------^-- sensors (optional) -'

The simulation is deterministic: the same flight with the same controller gives the same trace, and a flight
gives the same bits alone and in a batch.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.errors import echo
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.port.taken import AHEAD_S
from mambo_sil.arguments import as_numbers
from mambo_sil.drone.plant import loops
from mambo_sil.drone.plant.airframe import airframe_of
from mambo_sil.drone.plant.arrays import FloatArray, IntArray, PerFlight
from mambo_sil.drone.plant.disturbances import Disturbances, World
from mambo_sil.drone.plant.ground import carry_on_ground
from mambo_sil.drone.plant.link import NOT_CALLED, Drops, Link, Wire
from mambo_sil.drone.plant.rigid_body import EULER, POSITION, VELOCITY, to_body
from mambo_sil.drone.plant.vehicle import STEP_S, Seen, Vehicle, VehicleState, truth
from mambo_sil.drone.sensors.instruments import Sensors
from mambo_sil.drone.sensors.suites import AnySensors, suite_of
from mambo_sil.errors import FlightError
from mambo_sil.flight.altitude_loops import AltitudeLaw, AltitudeLoop, Vertical
from mambo_sil.flight.columns import LEVEL, SPACE, STATE, TARGET, Columns
from mambo_sil.flight.controllers.thrust_controller import (
    ThrustDelivery,
    adapted,
    columns_of,
    numbers_of,
)
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M
from mambo_sil.flight.names import Start
from mambo_sil.flight.traces import AXES, SensedTrace, Trace
from mambo_sil.flight.trajectories import Trajectory, is_spatial, known_of, vertical_of

HEIGHT_REFERENCE_M = -HOVER_HEIGHT_M
"""Altitude reference of a flight on a level course: z points down."""

_TRACED: Final = ("position_m", "velocity_m_s")
_VERTICAL: Final = ("height_m", "climb_m_s", "climb_acceleration_m_s2", "climb_ahead_m_s2")
"""Members of a target that a trace has, and those of a course with heights."""

TAKE_OFF_PHASE_S = 5.0
"""Time from the beginning of a take-off to t = 0 of the trajectory's clock."""

LOST_M = 1e4
"""Distance from the origin along any axis beyond which a flight is lost."""


class Outcome(Protocol):
    """The output of a position controller for n flights."""

    @property
    def command_rad(self) -> NDArray[np.floating[Any]]:
        """Roll and pitch (n, 2)."""
        ...

    @property
    def status(self) -> IntArray:
        """0 where the controller accepted its input (n,).

        A controller of the height also has `thrust_m_s2` (n,), the commanded thrust over mass.
        """
        ...


class PositionController(Protocol):
    """The interface of a position controller to the closed loop."""

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Outcome:
        """Return the command for states (n, 7), targets (n, 9) and thrust accelerations (n,).

        The columns are [x, y, vx, vy, roll, pitch, yaw] and those of `flight/columns.py`, in the world frame
        (NED). On a course with a height the targets (n, 13) end with what is of the height, up.
        The thrust acceleration is positive along -z of the body. Inputs of a controller of the height:
        `controllers/thrust_controller.py`.
        """
        ...


Three = tuple[PerFlight, PerFlight, PerFlight]


@dataclass(frozen=True, eq=False)
class Offset:
    """How a start differs from the one described by `Flight.start`."""

    position_m: Three = (0.0, 0.0, 0.0)
    """In the world frame."""
    velocity_m_s: Three = (0.0, 0.0, 0.0)
    """In the world frame."""
    tilt_rad: tuple[PerFlight, PerFlight] = (0.0, 0.0)
    """Roll and pitch."""


@dataclass(frozen=True, eq=False)
class Flight:
    """One simulation of n flights; a quantity that differs between them is an array (n,)."""

    trajectory: Trajectory
    duration_s: float = 100.0
    flights: int = 1
    start: Start = "hover"
    """At the first point of the trajectory, which is at `HEIGHT_REFERENCE_M` on a level course, level and at
    rest, at t = 0; or on the ground, `TAKE_OFF_PHASE_S` before t = 0."""
    yaw_rad: PerFlight = 0.0
    """Heading at the start, and reference of the yaw loop."""
    yaw_rate_rad_s: PerFlight = 0.0
    """Rate of the yaw reference from t = 0 on."""
    vehicle: Vehicle = field(default_factory=Vehicle)
    update_period_s: float = 0.01
    """Period of the position controller: a whole multiple of the tick."""
    seeds: tuple[int, ...] | None = None
    """Random seed of each flight; None is 0 for all."""
    offset: Offset | None = None
    disturbances: Disturbances = field(default_factory=Disturbances)
    link: Link = field(default_factory=Link)
    sensors: AnySensors | None = None
    """Sensors behind the estimates that position controller and stock loops receive; None: the true state."""
    altitude: AltitudeLaw = field(default_factory=AltitudeLaw)
    """What holds the height."""

    def __post_init__(self) -> None:
        step_s = self.vehicle.drone.step_s
        if not self.update_period_s <= self.duration_s < math.inf:
            raise FlightError(
                f"duration_s = {self.duration_s:g} must be finite and at least "
                f"update_period_s = {self.update_period_s:g}"
            )
        if self.update_period_s <= 0.0 or abs(math.remainder(self.update_period_s, step_s)) > 1e-9:
            raise FlightError(
                f"update_period_s = {self.update_period_s:g} must be a whole multiple of {step_s:g}; "
                f"the inner loops of vehicle {echo(self.vehicle.drone.name)} run at {1.0 / step_s:g} Hz"
            )
        if isinstance(self.sensors, Sensors) and step_s != STEP_S:
            raise FlightError(f"sensors: those of the Mambo run at {1.0 / STEP_S:g} Hz, not {1.0 / step_s:g}")
        if self.seeds is not None and len(self.seeds) != self.flights:
            raise FlightError(f"seeds: there are {len(self.seeds)} for {self.flights} flights")

    @property
    def ticks_per_update(self) -> int:
        """Ticks of the inner loops for each step of the position controller."""
        return round(self.update_period_s / self.vehicle.drone.step_s)

    def times_s(self) -> FloatArray:
        """Return the times (k,) of the position controller's updates; t = 0 is one of them."""
        before = round(TAKE_OFF_PHASE_S / self.update_period_s) if self.start == "take-off" else 0
        after = round(self.duration_s / self.update_period_s)
        return self.update_period_s * np.arange(-before, after + 1, dtype=np.float64)

    def targets(self) -> FloatArray:
        """Return the targets (k, n, 4) at the times of the updates.

        Raises `FlightError` if the number of trajectories is not the number of flights.
        """
        return self._for_each_flight("target", self.trajectory.target(self.times_s()), 4)

    @cached_property
    def given_targets(self) -> FloatArray:
        """The targets as controllers are given them: (k, n, 9), on a course with a height (k, n, 13).

        Those of a flight are contiguous in memory, as in `allocate_trace`.
        Raises `FlightError` as `targets`.
        """
        targets, spatial = self.targets(), is_spatial(self.trajectory)
        columns = (SPACE if spatial else LEVEL).target
        given = np.zeros((self.flights, len(targets), columns)).swapaxes(0, 1)
        given[..., TARGET["position_m"]] = targets[..., :2]
        given[..., TARGET["velocity_m_s"]] = targets[..., 2:]
        times_s = self.times_s()
        for name, when_s in (("acceleration_m_s2", times_s), ("ahead_m_s2", times_s + AHEAD_S)):
            given[..., TARGET[name]] = self._for_each_flight(
                "acceleration", self.trajectory.acceleration(when_s), 2
            )
        given[..., TARGET["known"]] = np.reshape(known_of(self.trajectory), (-1, 1))
        if spatial:
            now, ahead = (
                self._for_each_flight("vertical", vertical_of(self.trajectory, when_s), 3)
                for when_s in (times_s, times_s + AHEAD_S)
            )
            _put_vertical(given, np.concatenate([now, ahead[..., 2:]], axis=-1))
        return given

    @cached_property
    def traced_targets(self) -> FloatArray:
        """The targets as a trace has them: (k, n, 4), on a course with a height (k, n, 6)."""
        given = self.given_targets
        members = _TRACED if given.shape[2] == LEVEL.target else (*_TRACED, *_VERTICAL[:2])
        traced = np.concatenate([given.swapaxes(0, 1)[..., TARGET[name]] for name in members], axis=-1)
        return traced.swapaxes(0, 1)

    @cached_property
    def targets_in_space(self) -> FloatArray:
        """The targets (k, n, 13) as controllers of the height are given them, also on a level course."""
        given = self.given_targets
        if given.shape[2] == SPACE.target:
            return given
        by_flight = given.swapaxes(0, 1)
        space = np.zeros((*by_flight.shape[:2], SPACE.target))
        space[..., : LEVEL.target] = by_flight
        _put_vertical(space, np.array([HOVER_HEIGHT_M, 0.0, 0.0, 0.0]))
        return space.swapaxes(0, 1)

    def targets_for(self, columns: Columns) -> FloatArray:
        """Return the targets (k, n, 9 or 13) as a controller is given them."""
        return self.targets_in_space if columns.target == SPACE.target else self.given_targets

    @cached_property
    def landing(self) -> NDArray[np.bool_]:
        """Which courses (n,) touch the ground; there it carries the drone."""
        return np.asarray((self.given_targets[..., TARGET["height_m"]] <= 0.0).any(axis=(0, 2)))

    def _for_each_flight(self, method: str, values: FloatArray, columns: int) -> FloatArray:
        """Return what a method of one trajectory gives (k, m), or of each (k, n, m), as (k, n, m)."""
        values, k = as_numbers(f"trajectory.{method}()", values), len(self.times_s())
        if values.shape == (k, columns):
            return np.broadcast_to(values[:, np.newaxis, :], (k, self.flights, columns))
        if values.ndim != 3 or (len(values), values.shape[2]) != (k, columns):
            raise FlightError(
                f"trajectory.{method}(): has shape {values.shape} for {k} times; "
                f"it must be ({k}, {columns}), or ({k}, n, {columns}) for n flights"
            )
        if values.shape[1] != self.flights:
            raise FlightError(f"flights = {self.flights} must be {values.shape[1]}, one for each trajectory")
        return values


def fly(
    flight: Flight, controller: PositionController, progress: Callable[[float], None] | None = None
) -> Trace:
    """Simulate the flights in NumPy; return their trace, and call `progress` after every update.

    Raises `FlightError` if the number of trajectories is not the number of flights.
    """
    controller = adapted(controller)
    columns, times_s = columns_of(controller), flight.times_s()
    has_thrust, targets = columns.commands_thrust, flight.targets_for(columns)
    open_loop_until, landing = open_loop_updates(flight, times_s), flight.landing
    seeds = flight.seeds or (0,) * flight.flights
    vehicle, state = flight.vehicle, start_state(flight, targets[0])
    drone, step_s = vehicle.drone, vehicle.drone.step_s
    mass_kg, most_n = drone.body.mass_kg, drone.altitude.thrust_max_n
    altitude = AltitudeLoop(flight.altitude, drone, flight.flights)
    delivery = ThrustDelivery(drone, flight.flights)
    take_off_n = np.full(flight.flights, loops.take_off_thrust_n(drone))
    world = World(flight.disturbances, vehicle, seeds, -HEIGHT_REFERENCE_M)
    suite = suite_of(flight.sensors, seeds, truth(state), step_s)
    trace = allocate_trace(times_s, flight.traced_targets, sensed=suite is not None)
    drops, first = Drops(flight.link, seeds), first_command(flight, state, has_thrust=has_thrust)
    caller, wire = _Caller(controller, drops, targets, trace, first), Wire(flight.link, first)
    for update, time_s in enumerate(times_s):
        state = _mark_lost(state)
        open_loop = update < open_loop_until
        heading_rad = flight.yaw_rad + flight.yaw_rate_rad_s * max(float(time_s), 0.0)
        wanted = vertical_target(targets[update])
        for tick in range(flight.ticks_per_update):
            with np.errstate(all="ignore"):
                state, moment = world.tick(state, time_s + step_s * tick)
                true = truth(state)
                measured = vehicle.measured(true)
                seen = measured if suite is None else suite.estimate(measured)
                stock = not has_thrust and not open_loop
                thrust_n = altitude.thrust_n(wanted, seen) if stock else take_off_n
            if tick == 0:
                on_ground = landing & (true.position_m[2] >= 0.0)
                reported_m_s2 = delivery.report() if has_thrust else thrust_n / mass_kg
                caller.call(update, true, seen, on_ground, reported_m_s2)
                if open_loop:
                    trace.thrust_acceleration_m_s2[update] = thrust_n / mass_kg
            command = wire.carry(caller.command)
            with np.errstate(all="ignore"):
                if has_thrust and not open_loop:
                    thrust_n = np.clip(mass_kg * command[2], -most_n, most_n)
                state, given_n = vehicle.advance(
                    state, command[:2], thrust_n, heading_rad, seen=seen, moment=moment
                )
                if has_thrust:
                    delivery.note(mass_kg * command[2], given_n)
                if landing.any():
                    state = carry_on_ground(state, landing)
        if progress is not None:
            progress((update + 1) / len(times_s))
    _unify_nan(trace)
    return trace


def first_command(flight: Flight, state: VehicleState, *, has_thrust: bool) -> FloatArray:
    """Return the commands (2, n) that drones have before the first of their controllers: level.

    With controllers of the height (3, n): and with the thrust over mass of hover, on the ground 0.
    """
    z_m = state.body[POSITION][2]
    level = np.zeros((2, len(z_m)))
    if not has_thrust:
        return level
    hover_m_s2 = GRAVITY_M_S2 / flight.vehicle.drone.thrust_gain
    return np.concatenate([level, np.where(z_m < 0.0, hover_m_s2, 0.0)[np.newaxis]])


def open_loop_updates(flight: Flight, times_s: FloatArray) -> int:
    """Return how many of the updates at `times_s` (k,) fall into the open-loop beginning of a take-off."""
    open_loop_s = loops.TAKE_OFF_S if flight.start == "take-off" else 0.0
    return int((times_s < times_s[0] + open_loop_s - flight.vehicle.drone.step_s / 2.0).sum())


def start_state(flight: Flight, first_target: FloatArray) -> VehicleState:
    """Return the initial state of n flights, at their first targets (n, 9 or 13) or on the ground below."""
    position_m = np.zeros((3, flight.flights))
    position_m[:2] = first_target[:, :2].T
    nominal = airframe_of(flight.vehicle.drone)
    command: PerFlight = nominal.command_min
    if flight.start == "hover":
        position_m[2] = vertical_target(first_target).z_m
        hover = nominal.hover_command / flight.vehicle.drone.thrust_gain
        command = np.where(position_m[2] < 0.0, hover, nominal.command_min)
    state = flight.vehicle.at_rest(position_m, flight.yaw_rad, command)
    if flight.offset is None:
        return state
    offset, body = flight.offset, state.body
    for row in range(3):
        body[POSITION][row] += offset.position_m[row]
    for row in range(2):
        body[EULER][row] = offset.tilt_rad[row]
    velocity_m_s = np.stack([np.broadcast_to(component, flight.flights) for component in offset.velocity_m_s])
    body[VELOCITY] = to_body(body[EULER], velocity_m_s)
    return state


def vertical_target(target: FloatArray) -> Vertical:
    """Return what the altitude loop is to follow, for targets (n, 9) or (n, 13)."""
    if target.shape[1] < SPACE.target:
        return Vertical(HEIGHT_REFERENCE_M)
    height_m, climb_m_s, acceleration_m_s2 = (target[:, TARGET[name].start] for name in _VERTICAL[:3])
    return Vertical(0.0 - height_m, climb_m_s, acceleration_m_s2)


def _put_vertical(targets: FloatArray, vertical: FloatArray) -> None:
    """Write height, climb, vertical acceleration and that ahead (..., 4) into targets, in place."""
    for k, name in enumerate(_VERTICAL):
        targets[..., TARGET[name].start] = vertical[..., k]


def _mark_lost(state: VehicleState) -> VehicleState:
    """Return the state with NaN in the flights that left the bounds or are not finite."""
    lost = ~(np.abs(state.body[POSITION]).max(axis=0) < LOST_M) | ~np.isfinite(state.body).all(axis=0)
    if not lost.any():
        return state
    return VehicleState(np.where(lost, np.nan, state.body), state.rotor_speed_rad_s, state.memory)


def _unify_nan(trace: Trace) -> None:
    """Replace every NaN of a trace by the same one: its sign and payload depend on the processor."""
    for column in fields(trace):
        values = getattr(trace, column.name)
        if column.name not in ("time_s", "target", "status"):
            values[np.isnan(values)] = np.nan


def allocate_trace(times_s: FloatArray, targets: FloatArray, *, sensed: bool) -> Trace:
    """Return a trace with times and targets set and its other arrays uninitialized.

    The samples of a flight are contiguous in memory: the engine writes a flight after the other.
    """
    kind = SensedTrace if sensed else Trace
    shape = targets.shape[:2]
    arrays: dict[str, Any] = {
        column.name: np.empty((*shape[::-1], *AXES[column.name.removeprefix("seen_")])).swapaxes(0, 1)
        for column in fields(kind)
        if column.name not in ("time_s", "target", "status")
    }
    return kind(time_s=times_s, target=targets, status=np.empty(shape[::-1], np.int64).T, **arrays)


def _measured(seen: Seen, on_ground: NDArray[np.bool_]) -> dict[str, FloatArray]:
    """Return the numbers of states by member (count, n)."""
    return {
        "position_m": seen.position_m[:2],
        "velocity_m_s": seen.velocity_m_s[:2],
        "roll_rad": seen.euler_rad[:1],
        "pitch_rad": seen.euler_rad[1:2],
        "yaw_rad": seen.euler_rad[2:],
        "height_m": -seen.position_m[2:],
        "climb_m_s": -seen.velocity_m_s[2:],
        "on_ground": on_ground[np.newaxis].astype(np.float64),
    }


class _Caller:
    """Calls the position controller of n flights, records the trace and holds the command.

    The command is (2, n), roll and pitch; of a controller of the height (3, n), with the thrust over mass.
    """

    def __init__(
        self,
        controller: PositionController,
        drops: Drops,
        targets: FloatArray,
        trace: Trace,
        first: FloatArray,
    ) -> None:
        self._controller, self._columns = controller, columns_of(controller).state
        self._drops, self._targets, self._trace = drops, targets, trace
        self.command = first

    def call(
        self, update: int, true: Seen, seen: Seen, on_ground: NDArray[np.bool_], thrust_m_s2: FloatArray
    ) -> None:
        """Call the controller with the state `seen` and the thrust (n,), and record the update.

        A flight whose update is dropped passes NaN: the controller rejects it and keeps its internal state.
        """
        trace, has_thrust = self._trace, len(self.command) > LEVEL.command
        measured = np.zeros((len(on_ground), self._columns))
        for member, rows in _measured(seen, on_ground).items():
            if STATE[member].stop <= measured.shape[1]:
                measured[:, STATE[member]] = rows.T
        dropped = self._drops.next()
        if dropped is not None:
            measured[dropped] = np.nan
        outcome = self._controller.step(measured, self._targets[update], thrust_m_s2)
        trace.position_m[update] = true.position_m.T
        trace.velocity_m_s[update] = true.velocity_m_s.T
        trace.euler_rad[update] = true.euler_rad.T
        if isinstance(trace, SensedTrace):
            trace.seen_position_m[update] = seen.position_m.T
            trace.seen_velocity_m_s[update] = seen.velocity_m_s.T
            trace.seen_euler_rad[update] = seen.euler_rad.T
        command = numbers_of(outcome).T
        trace.status[update] = outcome.status
        if dropped is not None:
            command[:, dropped] = self.command[:, dropped]
            trace.status[update, dropped] = NOT_CALLED
        trace.command_rad[update] = command[:2].T
        trace.thrust_acceleration_m_s2[update] = command[2] if has_thrust else thrust_m_s2
        self.command = command
