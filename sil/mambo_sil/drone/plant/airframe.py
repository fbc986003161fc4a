"""The airframe of a drone: mass, inertia and rotors, which may differ from flight to flight."""

import math
from dataclasses import dataclass
from typing import Final

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import PerFlight
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import MixerName


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
    mixer: MixerName = "clip"

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


def airframe_of(drone: VehicleFile) -> Airframe:
    """Return the airframe of a drone.

    A drone without rotors has ones in their place: its thrust is the demanded one times the thrust factor.
    """
    body, rotors = drone.body, drone.rotors
    if rotors is None:
        return Airframe(body.mass_kg, (1.0, 1.0, 1.0), 1.0, 1.0, 1.0, 1.0, 0.0, math.inf)
    return Airframe(
        mass_kg=body.mass_kg,
        inertia_kg_m2=drone.inertia_kg_m2,
        arm_m=rotors.arm_m,
        thrust_factor_n_s2=rotors.thrust_factor_n_s2,
        torque_factor_n_m_s2=rotors.torque_factor_n_m_s2,
        speed_squared_per_command_rad2_s2=rotors.speed_squared_per_command_rad2_s2,
        command_min=rotors.command_min,
        command_max=rotors.command_max,
        mixer=rotors.mixer,
    )


NOMINAL: Final = vehicle_toml.preset(vehicle_toml.DEFAULT)
"""The drone that flies where none is named."""
MAMBO: Final = airframe_of(NOMINAL)
