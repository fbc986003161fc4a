"""The whole vehicle: stock loops, mixer, rotors and rigid body, one tick of 5 ms at a time."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sil.arrays import FloatArray, PerFlight
from sil.plant import loops
from sil.plant.airframe import MAMBO, Airframe
from sil.plant.integrator import NODES, bogacki_shampine
from sil.plant.rigid_body import EULER, POSITION, RATES, STATE_ROWS, RigidBody, world_velocity
from sil.plant.rotors import Rotors, mix

STEP_S = loops.PERIOD_S
"""Integration step, and period of the stock loops: commands are held over it."""


@dataclass(frozen=True, eq=False)
class VehicleState:
    """Everything that the vehicle remembers from one tick to the next, for n flights."""

    body: FloatArray
    """State of the rigid body (12, n), rows as in `sil.plant.rigid_body`."""
    rotor_speed_rad_s: FloatArray
    """(4, n)."""
    attitude_integral_rad_s: FloatArray
    """Integrators of the attitude loop (2, n), roll then pitch."""


@dataclass(frozen=True, eq=False)
class Vehicle:
    """The vehicle that really flies; its stock loops and mixer believe in the nominal Mambo."""

    airframe: Airframe = MAMBO
    motor_lag_s: PerFlight = 0.0
    drag_1_s: PerFlight = 0.067
    """Blade flapping of the Mambo at hover, derived from the rotor model of asbQuadcopter."""
    wind_m_s2: tuple[PerFlight, PerFlight] = (0.0, 0.0)

    @cached_property
    def rotors(self) -> Rotors:
        """The rotors of this vehicle."""
        return Rotors(self.airframe, self.motor_lag_s)

    @cached_property
    def rigid_body(self) -> RigidBody:
        """The rigid body of this vehicle."""
        return RigidBody(self.airframe.mass_kg, self.airframe.inertia_kg_m2, self.drag_1_s, self.wind_m_s2)

    @cached_property
    def _rotor_decay(self) -> FloatArray:
        """Share of a rotor speed error left at the nodes and at the end of a step (4, 1, n or 1)."""
        return self.rotors.decay(STEP_S * np.append(NODES, 1.0))

    def at_rest(self, position_m: FloatArray, yaw_rad: PerFlight, motor_command: PerFlight) -> VehicleState:
        """Return n vehicles level and at rest at positions (3, n), rotors steady at one motor command."""
        flights = position_m.shape[1]
        body = np.zeros((STATE_ROWS, flights))
        body[POSITION] = position_m
        body[8] = yaw_rad
        commands = np.broadcast_to(motor_command, (4, flights))
        return VehicleState(body, self.rotors.commanded_speed_rad_s(commands), np.zeros((2, flights)))

    def step(
        self, state: VehicleState, command_rad: FloatArray, thrust_n: FloatArray, yaw_reference_rad: PerFlight
    ) -> VehicleState:
        """Return the state one tick later.

        `command_rad` (2, n) is roll and pitch, `thrust_n` (n,) the total thrust asked for.
        """
        angles_rad, rates_rad_s = state.body[EULER], state.body[RATES]
        wrench = np.empty((4, state.body.shape[1]))
        wrench[0] = thrust_n
        wrench[1:3] = loops.attitude_torque(
            command_rad, angles_rad[:2], rates_rad_s[:2], state.attitude_integral_rad_s
        )
        wrench[3] = loops.yaw_torque(yaw_reference_rad, angles_rad[2], rates_rad_s[2])
        return VehicleState(
            *self.coast(state, mix(MAMBO, wrench)),
            loops.attitude_integral(command_rad, angles_rad[:2], state.attitude_integral_rad_s),
        )

    def coast(self, state: VehicleState, motor_command: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rigid body (12, n) and rotor speeds (4, n) after a tick of held motor commands (4, n)."""
        goal = self.rotors.commanded_speed_rad_s(motor_command)
        speeds = goal + (state.rotor_speed_rad_s - goal) * self._rotor_decay
        wrenches = self.rotors.wrench(speeds[:3])
        inputs = (wrenches[:, 0], wrenches[:, 1], wrenches[:, 2])
        return bogacki_shampine(self.rigid_body.derivative, state.body, inputs, STEP_S), speeds[3]


def thrust_demand(state: VehicleState, reference_m: float) -> FloatArray:
    """Return the total thrust (n,) that the altitude loop asks for."""
    return loops.altitude_thrust(reference_m, state.body[2], world_velocity(state.body)[2])
