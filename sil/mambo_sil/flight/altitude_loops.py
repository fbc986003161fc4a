"""Altitude loops: the vehicle's own, and two with feed-forward.

The commands run its equal in C, `flight/engine/vehicle.h`, which has the same bits.

    stock        thrust = weight + P height error - D climb
    feedforward  the same with D (climb of the target - climb) and mass x acceleration of the target, all over
                 cos roll cos pitch, at least `LEAST_LEVEL`; the vehicle's gains
    pid          the same with gains of its own and an integral of the height error

within plus or minus the largest thrust. The integral rests where the error is large or the thrust at its
limit.
Source of the gains of `pid`: the search in benchmarks/gains/altitude.py.
"""

from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import Final

import numpy as np

from mambo_codegen.settings.toml_file import parse_document
from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.elementary import sine_cosine
from mambo_sil.drone.plant.loops import altitude_thrust
from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.names import AltitudeName

LEAST_LEVEL: Final = 0.6
"""Cosine of the tilt for which the thrust is compensated at most."""
INTEGRATED_ERROR_M: Final = 0.6
"""With an error of this size the integral rests."""
INTEGRAL_SHARE: Final = 0.5
"""Limit of the integral, over the weight."""


@dataclass(frozen=True)
class Vertical:
    """Targets of the altitude loop, each one value or (n,): z points down, climb and acceleration up."""

    z_m: PerFlight
    climb_m_s: PerFlight = 0.0
    acceleration_m_s2: PerFlight = 0.0


@dataclass(frozen=True)
class HeightGains:
    """Gains of an altitude loop, over the mass.

    height_1_s2:    acceleration per height error.
    climb_1_s:      acceleration per error of the climb.
    integral_1_s3:  acceleration per integral of the height error.
    """

    height_1_s2: float
    climb_1_s: float
    integral_1_s3: float = 0.0


@lru_cache
def pid_altitude_gains() -> dict[str, HeightGains]:
    """Return the tuned gains of `pid` by shipped drone."""
    file = resources.files("mambo_sil.flight").joinpath("data", "gains", "altitude.toml")
    gains = parse_document(file.read_text("utf-8"), file.name)
    return {drone: HeightGains(**values) for drone, values in gains.items()}


@dataclass(frozen=True)
class AltitudeLaw:
    """An altitude loop by name, and its gains if they are not the drone's."""

    name: AltitudeName = "stock"
    gains: HeightGains | None = None

    def gains_for(self, drone: VehicleFile) -> HeightGains:
        """Return the gains for a drone; `pid` has the gains of `mambo` if there are none for it."""
        if self.gains is not None:
            return self.gains
        if self.name == "pid":
            tuned = pid_altitude_gains()
            return tuned.get(drone.name, tuned[vehicle_toml.DEFAULT])
        mass_kg = drone.body.mass_kg
        return HeightGains(drone.altitude.p_n_m / mass_kg, drone.altitude.d_n_s_m / mass_kg)


class AltitudeLoop:
    """The altitude loop of n drones; its memory is the integral (n,) in N.

    `step_s` is the time between two calls, without it the tick of the drone.
    """

    def __init__(
        self, law: AltitudeLaw, drone: VehicleFile, flights: int, step_s: float | None = None
    ) -> None:
        self._law, self._drone, self._gains = law.name, drone, law.gains_for(drone)
        self._step_s = drone.step_s if step_s is None else step_s
        self.integral_n = np.zeros(flights)

    def thrust_n(self, wanted: Vertical, seen: Seen) -> FloatArray:
        """Return the demanded total thrust (n,) in N, positive upwards."""
        drone, gains = self._drone, self._gains
        if self._law == "stock":
            return altitude_thrust(drone, wanted.z_m, seen.position_m[2], seen.velocity_m_s[2])
        mass_kg, most_n = drone.body.mass_kg, drone.altitude.thrust_max_n
        error_m = seen.position_m[2] - wanted.z_m
        upwards_n = (
            drone.weight_n
            + (mass_kg * gains.height_1_s2) * error_m
            + (mass_kg * gains.climb_1_s) * (wanted.climb_m_s + seen.velocity_m_s[2])
            + mass_kg * wanted.acceleration_m_s2
            + self.integral_n
        )
        _, (cos_roll, cos_pitch) = sine_cosine(seen.euler_rad[:2])
        thrust_n = upwards_n / np.maximum(cos_roll * cos_pitch, LEAST_LEVEL)
        free = (np.abs(error_m) < INTEGRATED_ERROR_M) & (np.abs(thrust_n) < most_n)
        grown_n = self.integral_n + self._step_s * ((mass_kg * gains.integral_1_s3) * error_m)
        limit_n = INTEGRAL_SHARE * drone.weight_n
        self.integral_n = np.where(free, np.clip(grown_n, -limit_n, limit_n), self.integral_n)
        return np.asarray(np.clip(thrust_n, -most_n, most_n))
