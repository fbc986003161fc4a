"""Constants of the airframe, each with its source."""

import math
from dataclasses import dataclass

from mambo_nmpc.sil.plant.arrays import PerFlight

GRAVITY_M_S2 = 9.81


@dataclass(frozen=True, eq=False)
class Airframe:
    """Mass, inertia and rotor constants of a quadrotor in X configuration.

    Mass, inertia and the two rotor factors may be arrays (n,), one airframe per flight.
    """

    mass_kg: PerFlight
    inertia_kg_m2: tuple[PerFlight, PerFlight, PerFlight]
    """Principal moments about the body axes x, y, z."""
    arm_m: float
    """Distance from the centre to a rotor axis."""
    thrust_factor_n_s2: PerFlight
    """b in thrust = b w^2, w the rotor speed."""
    torque_factor_n_m_s2: PerFlight
    """k in torque = k w^2."""
    speed_squared_per_command_rad2_s2: float
    """Increase of w^2 per unit of motor command in steady state."""
    command_min: float
    command_max: float

    @property
    def rotor_offset_m(self) -> float:
        """Lever arm of every rotor about body x and about body y: arm / sqrt(2)."""
        return self.arm_m / math.sqrt(2.0)

    @property
    def torque_per_thrust_m(self) -> PerFlight:
        """Reaction torque per newton of rotor thrust: k / b."""
        return self.torque_factor_n_m_s2 / self.thrust_factor_n_s2

    @property
    def thrust_per_command_n(self) -> PerFlight:
        """Thrust of one rotor per unit of its motor command."""
        return self.speed_squared_per_command_rad2_s2 * self.thrust_factor_n_s2

    @property
    def hover_command(self) -> PerFlight:
        """Motor command at which four rotors of a level drone carry its weight."""
        return self.mass_kg * GRAVITY_M_S2 / (4.0 * self.thrust_per_command_n)


MAMBO = Airframe(
    mass_kg=0.063,
    inertia_kg_m2=(5.82857e-5, 7.16914e-5, 1.0e-4),
    arm_m=0.0624,
    thrust_factor_n_s2=4.71999e-8,
    torque_factor_n_m_s2=1.139284e-10,
    speed_squared_per_command_rad2_s2=13840.8,
    command_min=10.0,
    command_max=500.0,
)
"""Parrot Mambo: `vehicleVars` (mass, inertia, arm, rotor) and `controllerVars` (motor command) of the
MathWorks asbQuadcopter example, R2018b to R2020a."""
