"""Disturbances of a flight: push, wind, gusts, battery sag, payload, impulse, ground effect.

The commands run its equal in C, `flight/engine/world.h`, which has the same bits.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.ground import ground_effect
from mambo_sil.drone.plant.gusts import Gusts
from mambo_sil.drone.plant.rigid_body import POSITION
from mambo_sil.drone.plant.vehicle import Moment, Vehicle, VehicleState


@dataclass(frozen=True, eq=False)
class Disturbances:
    """Disturbances of n flights; all are off by default.

    Every field is one value for all flights or an array (n,). Event times are on the trajectory's clock.
    """

    wind_speed_m_s: PerFlight = 0.0
    """Mean wind 20 ft above the ground (W20 of `gusts`); 0 is still air."""
    wind_direction_rad: PerFlight = 0.0
    """Heading towards which the air moves: 0 north, pi/2 east."""
    push_m_s2: tuple[PerFlight, PerFlight] = (0.0, 0.0)
    """Steady acceleration along x and y of the world."""
    battery_sag_1_s: PerFlight = 0.0
    """Share of the fresh battery's thrust lost per second since the start of the flight."""
    payload_kg: PerFlight = 0.0
    """Mass added at the centre of the drone at `payload_time_s`; a negative mass is dropped."""
    payload_time_s: PerFlight = 0.0
    impulse_n_s: tuple[PerFlight, PerFlight, PerFlight] = (0.0, 0.0, 0.0)
    """Impulse in the world frame (NED), applied in one instant at `impulse_time_s`."""
    impulse_time_s: PerFlight = 0.0
    vertical_gust_m_s2: PerFlight = 0.0
    """Acceleration upwards from `vertical_gust_time_s` on."""
    vertical_gust_time_s: PerFlight = 0.0
    ground_effect_radius_m: PerFlight = 0.0
    """Radius of the rotor of `ground.ground_effect`; 0 for none."""

    @property
    def windy(self) -> bool:
        """Whether any flight has wind."""
        return bool(np.any(self.wind_speed_m_s))

    @cached_property
    def struck(self) -> bool:
        """Whether any flight has an impulse."""
        return any(bool(np.any(component)) for component in self.impulse_n_s)

    @cached_property
    def near_ground(self) -> bool:
        """Whether any flight has ground effect."""
        return bool(np.any(self.ground_effect_radius_m))

    @cached_property
    def any(self) -> bool:
        """Whether any disturbance is on in any flight."""
        vertical = self.vertical_gust_m_s2, self.ground_effect_radius_m
        steady = *self.push_m_s2, self.battery_sag_1_s, self.payload_kg, *vertical
        return self.windy or self.struck or any(bool(np.any(one)) for one in steady)


class World:
    """Evaluates the disturbances of n flights, one tick after the other, in NumPy."""

    def __init__(
        self, disturbances: Disturbances, vehicle: Vehicle, seeds: Sequence[int], height_m: float
    ) -> None:
        self._disturbances, self._vehicle = disturbances, vehicle
        self._step_s = vehicle.drone.step_s
        self._ticks = 0
        self._gusts = None
        if disturbances.windy:
            self._gusts = Gusts(
                disturbances.wind_speed_m_s,
                disturbances.wind_direction_rad,
                seeds,
                height_m=height_m,
                step_s=self._step_s,
            )

    def tick(self, state: VehicleState, time_s: float) -> tuple[VehicleState, Moment | None]:
        """Return the state after any impulse due at `time_s`, and the other disturbances of this tick.

        `time_s` is on the trajectory's clock. Without disturbances the second value is None.
        """
        disturbances = self._disturbances
        if not disturbances.any:
            return state, None
        step_s = self._step_s
        flown_s, now = step_s * self._ticks, round(time_s / step_s)
        self._ticks += 1
        loaded = np.rint(np.asarray(disturbances.payload_time_s) / step_s) <= now
        payload_kg: FloatArray = np.asarray(disturbances.payload_kg, np.float64) * loaded
        risen = np.rint(np.asarray(disturbances.vertical_gust_time_s) / step_s) <= now
        due = np.rint(np.asarray(disturbances.impulse_time_s) / step_s) == now
        if disturbances.struck and due.any():
            flights = state.body.shape[1]
            impulse_n_s = np.stack(
                [np.broadcast_to(component * due, flights) for component in disturbances.impulse_n_s]
            )
            state = self._vehicle.apply_impulse(state, impulse_n_s, payload_kg)
        thrust_share = np.maximum(1.0 - disturbances.battery_sag_1_s * flown_s, 0.0)
        if disturbances.near_ground:
            height_m = -state.body[POSITION][2]
            thrust_share = thrust_share * ground_effect(height_m, disturbances.ground_effect_radius_m)
        moment = Moment(
            thrust_share=thrust_share,
            payload_kg=payload_kg,
            air_m_s=None if self._gusts is None else self._gusts.next(),
            push_m_s2=disturbances.push_m_s2,
            lift_m_s2=np.asarray(disturbances.vertical_gust_m_s2, np.float64) * risen,
        )
        return state, moment
