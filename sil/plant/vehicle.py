"""The drone: stock loops, mixer, rotors and rigid body, advanced by one tick of 5 ms at a time."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mambo_nmpc.sil.plant import loops
from mambo_nmpc.sil.plant.airframe import MAMBO, Airframe
from mambo_nmpc.sil.plant.arrays import FloatArray, PerFlight
from mambo_nmpc.sil.plant.elementary import sine_cosine
from mambo_nmpc.sil.plant.integrator import NODES, bogacki_shampine
from mambo_nmpc.sil.plant.rigid_body import (
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
from mambo_nmpc.sil.plant.rotors import Rotors, mix

STEP_S = loops.PERIOD_S
"""Integration step and period of the stock loops, called a tick; motor commands are held over it."""


@dataclass(frozen=True, eq=False)
class VehicleState:
    """State of n drones."""

    body: FloatArray
    """State of the rigid body (12, n), rows as in `rigid_body`."""
    rotor_speed_rad_s: FloatArray
    """(4, n)."""
    attitude_integral_rad_s: FloatArray
    """Integral states of the attitude loop (2, n), roll then pitch."""

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


@dataclass(frozen=True, eq=False)
class Moment:
    """Battery, payload and wind during one tick; the default is undisturbed."""

    thrust_share: PerFlight = 1.0
    """Rotor thrust and torque, relative to a fresh battery."""
    payload_kg: PerFlight = 0.0
    air_m_s: tuple[PerFlight, PerFlight] | None = None
    """Air velocity along x and y of the world; None is still air."""


@dataclass(frozen=True, eq=False)
class Vehicle:
    """The simulated drone. Its stock loops and mixer always use the constants of the nominal Mambo."""

    airframe: Airframe = MAMBO
    motor_lag_s: PerFlight = 0.0
    drag_1_s: PerFlight = 0.067
    """Drag by blade flapping; the default is that of the Mambo at hover, from asbQuadcopter's rotor model."""
    wind_m_s2: tuple[PerFlight, PerFlight] = (0.0, 0.0)

    @cached_property
    def rotors(self) -> Rotors:
        """The rotors of this drone."""
        return Rotors(self.airframe, self.motor_lag_s)

    @cached_property
    def rigid_body(self) -> RigidBody:
        """The rigid body of this drone, without payload and in still air."""
        return RigidBody(self.airframe.mass_kg, self.airframe.inertia_kg_m2, self.drag_1_s, self.wind_m_s2)

    @cached_property
    def rotor_decay(self) -> FloatArray:
        """Share of a rotor speed error that remains at the nodes and at the end of a step (4, 1, n or 1)."""
        return self.rotors.decay(STEP_S * np.append(NODES, 1.0))

    def at_rest(self, position_m: FloatArray, yaw_rad: PerFlight, motor_command: PerFlight) -> VehicleState:
        """Return n drones level and at rest at positions (3, n), their rotors steady at a motor command."""
        flights = position_m.shape[1]
        body = np.zeros((STATE_ROWS, flights))
        body[POSITION] = position_m
        body[8] = yaw_rad
        commands = np.broadcast_to(motor_command, (4, flights))
        return VehicleState(body, self.rotors.commanded_speed_rad_s(commands), np.zeros((2, flights)))

    def apply_push(self, state: VehicleState, impulse_n_s: FloatArray, payload_kg: PerFlight) -> VehicleState:
        """Return the state right after an impulse (3, n) in the world frame."""
        body = state.body.copy()
        change_m_s = to_body(body[EULER], impulse_n_s / (self.airframe.mass_kg + payload_kg))
        body[VELOCITY] = np.where(impulse_n_s.any(axis=0), body[VELOCITY] + change_m_s, body[VELOCITY])
        return replace(state, body=body)

    def step(
        self,
        state: VehicleState,
        command_rad: FloatArray,
        thrust_n: FloatArray,
        yaw_reference_rad: PerFlight,
        *,
        seen: Seen,
        moment: Moment | None = None,
    ) -> VehicleState:
        """Return the state one tick later.

        `command_rad` (2, n) is roll and pitch, `thrust_n` (n,) the demanded total thrust. The stock loops
        receive `seen`.
        """
        angles_rad, rates_rad_s = seen.euler_rad, seen.rates_rad_s
        wrench = np.empty((4, state.body.shape[1]))
        wrench[0] = thrust_n
        wrench[1:3] = loops.attitude_torque(
            command_rad, angles_rad[:2], rates_rad_s[:2], state.attitude_integral_rad_s
        )
        wrench[3] = loops.yaw_torque(yaw_reference_rad, angles_rad[2], rates_rad_s[2])
        return VehicleState(
            *self.integrate(state, mix(MAMBO, wrench), moment),
            loops.attitude_integral(command_rad, angles_rad[:2], state.attitude_integral_rad_s),
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
            body = replace(body, mass_kg=mass_kg, air_m_s=moment.air_m_s)
        inputs = (wrenches[:, 0], wrenches[:, 1], wrenches[:, 2])

        def derivative(stage: FloatArray, wrench: FloatArray) -> FloatArray:
            return body.derivative(stage, wrench, state.sine_cosine if stage is state.body else None)

        return bogacki_shampine(derivative, state.body, inputs, STEP_S), speeds[3]
