"""The rigid body of the paper: equations 2 to 7 with r_C = 0, and Euler's rotational dynamics.

The commands run its equal in C, `flight/engine/rigid_body.h`, which has the same bits.

World frame NED, body frame forward-right-down, Euler angles 3-2-1. The rows of a state (12, n) are

    0:3   position in the world frame, m                      r_A
    3:6   velocity in the body frame, m/s                     v_A
    6:9   roll, pitch, yaw, rad                               phi, theta, psi
    9:12  body rates, rad/s                                   w_A

and the rows of a wrench (4, n) are the total rotor thrust along -z of the body (N, u1 of equation 6) and the
torques about the body axes x, y, z (N m).

Local names: `heading_x`, `heading_y` are components in the world frame turned by yaw, `pitched_z` in that
frame turned by pitch, too.
"""

from dataclasses import dataclass

import numpy as np

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.elementary import sine_cosine

POSITION = slice(0, 3)
VELOCITY = slice(3, 6)
EULER = slice(6, 9)
RATES = slice(9, 12)
STATE_ROWS = 12

SineCosine = tuple[FloatArray, FloatArray]
"""Sines and cosines of roll, pitch, yaw, each (3, n)."""


@dataclass(frozen=True, eq=False)
class RigidBody:
    """A rigid body under gravity, thrust, linear rotor drag, wind and a push.

    The drag models blade flapping: it acts in the plane of the rotors and is proportional to the velocity in
    that plane (Pounds, Mahony and Corke 2010). `push_m_s2` is a steady acceleration in the world frame,
    `lift_m_s2` one upwards.
    """

    mass_kg: PerFlight
    inertia_kg_m2: tuple[PerFlight, PerFlight, PerFlight]
    drag_1_s: PerFlight
    push_m_s2: tuple[PerFlight, PerFlight] = (0.0, 0.0)
    air_m_s: tuple[PerFlight, PerFlight] | None = None
    """Air velocity along x and y of the world; None is still air."""
    lift_m_s2: PerFlight = 0.0

    def derivative(
        self, state: FloatArray, wrench: FloatArray, known: SineCosine | None = None
    ) -> FloatArray:
        """Return the time derivative (12, n) of a state (12, n) under a wrench (4, n).

        `known` holds sines and cosines of the state's angles, if they have been computed already.
        """
        sines, cosines = known or sine_cosine(state[EULER])
        sin_roll, sin_pitch, sin_yaw = sines
        cos_roll, cos_pitch, cos_yaw = cosines
        u, v, w = state[VELOCITY]
        p, q, r = state[RATES]
        thrust, roll_torque, pitch_torque, yaw_torque = wrench
        inertia_x, inertia_y, inertia_z = self.inertia_kg_m2
        push_x, push_y = self.push_m_s2

        rate = np.empty_like(state)

        # Equation 2.
        rate[POSITION] = to_world(sines, cosines, state[VELOCITY])

        # Equation 7, gravity less lift plus push: R transposed takes the sum to the body frame.
        heading_x = cos_yaw * push_x + sin_yaw * push_y
        heading_y = cos_yaw * push_y - sin_yaw * push_x
        down = GRAVITY_M_S2 - self.lift_m_s2
        pitched_z = cos_pitch * down + sin_pitch * heading_x
        external_x = cos_pitch * heading_x - sin_pitch * down
        external_y = cos_roll * heading_y + sin_roll * pitched_z
        external_z = cos_roll * pitched_z - sin_roll * heading_y

        # Equation 6, solved for the derivative of v_A.
        rate[3] = external_x - self.drag_1_s * u - (q * w - r * v)
        rate[4] = external_y - self.drag_1_s * v - (r * u - p * w)
        if self.air_m_s is not None:  # drag is proportional to the velocity relative to the air
            air_x, air_y = self.air_m_s
            heading_x = cos_yaw * air_x + sin_yaw * air_y
            heading_y = cos_yaw * air_y - sin_yaw * air_x
            rate[3] += self.drag_1_s * (cos_pitch * heading_x)
            rate[4] += self.drag_1_s * (cos_roll * heading_y + sin_roll * (sin_pitch * heading_x))
        rate[5] = external_z - thrust / self.mass_kg - (p * v - q * u)

        # Equations 4 and 5.
        yaw_rate = (sin_roll * q + cos_roll * r) / cos_pitch
        rate[6] = p + sin_pitch * yaw_rate
        rate[7] = cos_roll * q - sin_roll * r
        rate[8] = yaw_rate

        # Euler's equation: J w' = torque - w x J w.
        rate[9] = (roll_torque - (inertia_z - inertia_y) * (q * r)) / inertia_x
        rate[10] = (pitch_torque - (inertia_x - inertia_z) * (r * p)) / inertia_y
        rate[11] = (yaw_torque - (inertia_y - inertia_x) * (p * q)) / inertia_z
        return rate


def to_world(sines: FloatArray, cosines: FloatArray, vector: FloatArray) -> FloatArray:
    """Return R (eq 3) times a body vector (3, n), given sines and cosines (3, n) of roll, pitch, yaw."""
    sin_roll, sin_pitch, sin_yaw = sines
    cos_roll, cos_pitch, cos_yaw = cosines
    x, y, z = vector
    heading_y = cos_roll * y - sin_roll * z
    pitched_z = sin_roll * y + cos_roll * z
    heading_x = cos_pitch * x + sin_pitch * pitched_z
    world = np.empty_like(vector)
    world[0] = cos_yaw * heading_x - sin_yaw * heading_y
    world[1] = sin_yaw * heading_x + cos_yaw * heading_y
    world[2] = cos_pitch * pitched_z - sin_pitch * x
    return world


def to_body(euler_rad: FloatArray, vector: FloatArray) -> FloatArray:
    """Return R transposed times a world vector (3, n), given roll, pitch, yaw (3, n)."""
    (sin_roll, sin_pitch, sin_yaw), (cos_roll, cos_pitch, cos_yaw) = sine_cosine(euler_rad)
    x, y, z = vector
    heading_x = cos_yaw * x + sin_yaw * y
    heading_y = cos_yaw * y - sin_yaw * x
    pitched_z = cos_pitch * z + sin_pitch * heading_x
    body = np.empty_like(vector)
    body[0] = cos_pitch * heading_x - sin_pitch * z
    body[1] = cos_roll * heading_y + sin_roll * pitched_z
    body[2] = cos_roll * pitched_z - sin_roll * heading_y
    return body
