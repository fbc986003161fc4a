"""The drone: inner loops, rotors and rigid body, advanced by one tick at a time.

The commands run its equal in C, `flight/engine/vehicle.h`, which has the same bits.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np

from mambo_sil.arguments import require_kind, require_path, require_per_flight
from mambo_sil.drone.plant.airframe import MAMBO, NOMINAL, Airframe, airframe_of
from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.cascade import CascadeLoop
from mambo_sil.drone.plant.elementary import sine_cosine
from mambo_sil.drone.plant.first_order import FirstOrderDrone, Surroundings
from mambo_sil.drone.plant.integrator import NODES, bogacki_shampine
from mambo_sil.drone.plant.loops import Demand, MotorLoop, StockLoop
from mambo_sil.drone.plant.rigid_body import (
    EULER,
    POSITION,
    RATES,
    STATE_ROWS,
    VELOCITY,
    RigidBody,
    SineCosine,
    to_body,
    to_world,
)
from mambo_sil.drone.plant.rotors import Rotors
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import (
    LONGEST_ARM_M,
    CascadeAttitude,
    FirstOrderAttitude,
    MamboAttitude,
)

STEP_S: Final = NOMINAL.step_s
"""The Mambo's tick: integration step and period of its inner loops; motor commands are held over it."""

Lever = tuple[PerFlight, PerFlight, PerFlight]

LARGEST_LAG_S: Final = 1.0
LARGEST_DRAG_1_S: Final = 100.0
LEVER_ERRORS_M: Final = (0.05, -0.05, -0.1)
"""How far below where they are told to be sensors lie when margins and faults try it: above is negative."""


@dataclass(frozen=True, eq=False)
class VehicleState:
    """State of n drones."""

    body: FloatArray
    """State of the rigid body (12, n), rows as in `rigid_body`."""
    rotor_speed_rad_s: FloatArray
    """(4, n)."""
    memory: FloatArray
    """What the attitude loop keeps from tick to tick (its rows, n); the stock loop: its integrals (2, n)."""

    @cached_property
    def sine_cosine(self) -> SineCosine:
        """Sines and cosines of roll, pitch, yaw, each (3, n)."""
        return sine_cosine(self.body[EULER])


@dataclass(frozen=True, eq=False)
class Seen:
    """The state as the controllers receive it, true or estimated.

    Every field is (3, n); position and velocity are in the world frame.
    """

    position_m: FloatArray
    velocity_m_s: FloatArray
    euler_rad: FloatArray
    rates_rad_s: FloatArray


def truth(state: VehicleState) -> Seen:
    """Return the true state in the form that controllers receive."""
    body = state.body
    velocity_m_s = to_world(*state.sine_cosine, body[VELOCITY])
    return Seen(body[POSITION], velocity_m_s, body[EULER], body[RATES])


def arm_in_world(euler_rad: FloatArray, lever_m: Lever) -> FloatArray:
    """Return the way (3, n) from the centre of mass to a place that lies `lever_m` from it in the body."""
    arm_m = np.empty_like(euler_rad)
    for row in range(3):
        arm_m[row] = lever_m[row]
    return to_world(*sine_cosine(euler_rad), arm_m)


def beside(seen: Seen, lever_m: Lever) -> Seen:
    """Return what is seen at a place that lies `lever_m` (forward, right, down) from the place that is."""
    x, y, z = lever_m
    p, q, r = seen.rates_rad_s
    moving_m_s = np.stack([q * z - r * y, r * x - p * z, p * y - q * x])
    return replace(
        seen,
        position_m=seen.position_m + arm_in_world(seen.euler_rad, lever_m),
        velocity_m_s=seen.velocity_m_s + to_world(*sine_cosine(seen.euler_rad), moving_m_s),
    )


@dataclass(frozen=True, eq=False)
class Moment:
    """Disturbances during one tick; the default is undisturbed."""

    thrust_share: PerFlight = 1.0
    """Rotor thrust and torque, relative to a fresh battery."""
    payload_kg: PerFlight = 0.0
    air_m_s: tuple[PerFlight, PerFlight] | None = None
    """Air velocity along x and y of the world; None is still air."""
    push_m_s2: tuple[PerFlight, PerFlight] = (0.0, 0.0)
    """Steady acceleration along x and y of the world."""
    lift_m_s2: PerFlight = 0.0
    """Acceleration upwards."""


@dataclass(frozen=True, eq=False, repr=False)
class Vehicle:
    """The simulated drone: what differs between flights, and the drone whose inner loops and mixer it has."""

    airframe: Airframe = MAMBO
    motor_lag_s: PerFlight = NOMINAL.motor_lag_s
    drag_1_s: PerFlight = NOMINAL.body.drag_1_s
    drone: VehicleFile = NOMINAL
    lever_error_m: Lever = (0.0, 0.0, 0.0)
    """How far what measures lies from where `sensors.lever_m` says, along the axes of the body."""

    def __repr__(self) -> str:
        """Return the drone's name, mass, loop and sensors."""
        low_kg, high_kg = float(np.min(self.airframe.mass_kg)), float(np.max(self.airframe.mass_kg))
        mass = f"{low_kg:.3g} kg" if low_kg == high_kg else f"{low_kg:.3g} to {high_kg:.3g} kg"
        drone = self.drone
        return f"Vehicle({drone.name}: {mass}, attitude {drone.attitude.kind}, sensors {drone.sensors.kind})"

    def __post_init__(self) -> None:
        """Raise ArgumentError for values outside the ranges of a vehicle.toml, and for other types."""
        require_kind("airframe", self.airframe, Airframe, "an Airframe; Vehicle.from_preset makes a Vehicle")
        require_kind("drone", self.drone, VehicleFile, "a VehicleFile")
        self.require_flights(None)

    def require_flights(self, flights: int | None) -> None:
        """Raise ArgumentError unless every array has one value for each flight; None: any number of them."""
        require_per_flight("motor_lag_s", self.motor_lag_s, 0.0, LARGEST_LAG_S, flights)
        require_per_flight("drag_1_s", self.drag_1_s, 0.0, LARGEST_DRAG_1_S, flights)
        for along in self.lever_error_m:
            require_per_flight("lever_error_m", along, -LONGEST_ARM_M, LONGEST_ARM_M, flights)

    @classmethod
    def of(cls, drone: VehicleFile) -> "Vehicle":
        """Return a drone as it is described; raises ArgumentError for what is no VehicleFile."""
        require_kind("drone", drone, VehicleFile, "a VehicleFile; from_preset and from_file read one")
        return cls(airframe_of(drone), drone.motor_lag_s, drone.body.drag_1_s, drone=drone)

    @classmethod
    def from_preset(cls, name: str) -> "Vehicle":
        """Return a shipped drone; raises SourceNotFoundError, ArgumentError for what is no text."""
        require_kind("name", name, str, f"one of {', '.join(vehicle_toml.names())}")
        return cls.of(vehicle_toml.preset(name))

    @classmethod
    def from_file(cls, path: str | Path) -> "Vehicle":
        """Return the drone of a vehicle.toml.

        Raises UnreadableFileError, and InvalidSettingsError with all broken rules.
        """
        require_path("path", path, "a vehicle.toml")
        return cls.of(vehicle_toml.read(Path(path)))

    @cached_property
    def loop(self) -> MotorLoop | FirstOrderDrone:
        """The attitude loop, or the whole drone if its loop is not known."""
        match self.drone.attitude:
            case MamboAttitude() as attitude:
                return StockLoop(self.drone, attitude)
            case CascadeAttitude() as attitude:
                return CascadeLoop(self.drone, attitude)
            case FirstOrderAttitude() as attitude:
                return FirstOrderDrone(self.drone, attitude)

    @cached_property
    def is_seen_beside(self) -> bool:
        """Whether any drone is seen at another place than its controller was told."""
        return any(bool(np.any(along)) for along in self.lever_error_m)

    def measured(self, true: Seen) -> Seen:
        """Return the true state of drones where it is measured."""
        return beside(true, self.lever_error_m) if self.is_seen_beside else true

    @cached_property
    def rotors(self) -> Rotors:
        """The rotors of this drone."""
        return Rotors(self.airframe, self.motor_lag_s)

    @cached_property
    def rigid_body(self) -> RigidBody:
        """The rigid body of this drone, undisturbed."""
        return RigidBody(self.airframe.mass_kg, self.airframe.inertia_kg_m2, self.drag_1_s)

    @cached_property
    def rotor_decay(self) -> FloatArray:
        """Share of a rotor speed error that remains at the nodes and at the end of a step (4, 1, n or 1)."""
        return self.rotors.decay(self.drone.step_s * np.append(NODES, 1.0))

    def at_rest(self, position_m: FloatArray, yaw_rad: PerFlight, motor_command: PerFlight) -> VehicleState:
        """Return n drones level and at rest at positions (3, n), their rotors steady at a motor command."""
        flights = position_m.shape[1]
        body = np.zeros((STATE_ROWS, flights))
        body[POSITION] = position_m
        body[8] = yaw_rad
        commands = np.broadcast_to(motor_command, (4, flights))
        speed = self.rotors.commanded_speed_rad_s(commands)
        loop = self.loop
        if isinstance(loop, FirstOrderDrone):
            thrust_n = 4.0 * commands[0] * airframe_of(self.drone).thrust_per_command_n
            return VehicleState(body, speed, loop.at_rest(thrust_n))
        return VehicleState(body, speed, np.zeros((loop.rows, flights)))

    def apply_impulse(
        self, state: VehicleState, impulse_n_s: FloatArray, payload_kg: PerFlight
    ) -> VehicleState:
        """Return the state right after an impulse (3, n) in the world frame."""
        body = state.body.copy()
        change_m_s = to_body(body[EULER], impulse_n_s / (self.airframe.mass_kg + payload_kg))
        body[VELOCITY] = np.where(impulse_n_s.any(axis=0), body[VELOCITY] + change_m_s, body[VELOCITY])
        return replace(state, body=body)

    def advance(
        self,
        state: VehicleState,
        command_rad: FloatArray,
        thrust_n: FloatArray,
        yaw_reference_rad: PerFlight,
        *,
        seen: Seen,
        moment: Moment | None = None,
    ) -> tuple[VehicleState, FloatArray]:
        """Return the state one tick later, and the thrust (n,) that the motors were commanded in sum.

        `command_rad` (2, n) is roll and pitch, `thrust_n` (n,) the demanded total thrust. The inner loops
        receive `seen`.
        """
        loop = self.loop
        if isinstance(loop, FirstOrderDrone):
            around = self._surroundings(thrust_n, moment or Moment())
            body, memory = loop.advance(state.body, state.memory, command_rad, yaw_reference_rad, around)
            return VehicleState(body, state.rotor_speed_rad_s, memory), around.demand_n
        demand = Demand(command_rad, yaw_reference_rad, thrust_n, seen.euler_rad, seen.rates_rad_s)
        motor_command, memory = loop.command_motors(demand, state.memory)
        commanded_n = np.add.reduce(motor_command, axis=0) * airframe_of(self.drone).thrust_per_command_n
        return VehicleState(*self.integrate(state, motor_command, moment), memory), np.asarray(commanded_n)

    def _surroundings(self, thrust_n: FloatArray, moment: Moment) -> Surroundings:
        """Return the forces on drones without rotors, with their demanded thrust (n,)."""
        return Surroundings(
            np.maximum(thrust_n, 0.0),
            moment.thrust_share * self.airframe.thrust_factor_n_s2,
            self.airframe.mass_kg + moment.payload_kg,
            self.drag_1_s,
            moment.push_m_s2,
            moment.air_m_s or (0.0, 0.0),
            moment.lift_m_s2,
        )

    def integrate(
        self, state: VehicleState, motor_command: FloatArray, moment: Moment | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return rigid-body state (12, n) and rotor speeds (4, n) after a tick of held commands (4, n)."""
        steady = self.rotors.commanded_speed_rad_s(motor_command)
        speeds = steady + (state.rotor_speed_rad_s - steady) * self.rotor_decay
        wrenches = self.rotors.wrench(speeds[:3])
        body = self.rigid_body
        if moment is not None:
            wrenches = moment.thrust_share * wrenches
            mass_kg = self.airframe.mass_kg + moment.payload_kg
            body = replace(
                body,
                mass_kg=mass_kg,
                push_m_s2=moment.push_m_s2,
                air_m_s=moment.air_m_s,
                lift_m_s2=moment.lift_m_s2,
            )
        inputs = (wrenches[:, 0], wrenches[:, 1], wrenches[:, 2])

        def derivative(stage: FloatArray, wrench: FloatArray) -> FloatArray:
            return body.derivative(stage, wrench, state.sine_cosine if stage is state.body else None)

        return bogacki_shampine(derivative, state.body, inputs, self.drone.step_s), speeds[3]
