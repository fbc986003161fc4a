"""What the world does to a flight beside gravity: moving air with gusts, a tiring battery, payload, push."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mambo_nmpc.sil.plant.arrays import FloatArray, PerFlight
from mambo_nmpc.sil.plant.gusts import Gusts
from mambo_nmpc.sil.plant.vehicle import STEP_S, Moment, Vehicle, VehicleState


@dataclass(frozen=True, eq=False)
class Disturbances:
    """Disturbances of n flights; times are those of the trajectory's clock. The default disturbs nothing.

    Every field is one value for all flights or one for each (n,).
    """

    wind_speed_m_s: PerFlight = 0.0
    """Mean wind 20 ft above the ground, as `sil.gusts` wants it; 0 is still air."""
    wind_direction_rad: PerFlight = 0.0
    """Heading towards which the air moves: 0 north, pi/2 east."""
    battery_sag_1_s: PerFlight = 0.0
    """Share of the thrust that is lost in each second from the start of the flight on."""
    payload_kg: PerFlight = 0.0
    """Mass that the vehicle takes up at its centre or, negative, lets go."""
    payload_time_s: PerFlight = 0.0
    push_n_s: tuple[PerFlight, PerFlight, PerFlight] = (0.0, 0.0, 0.0)
    """Impulse of a push in the world frame (NED), all at once."""
    push_time_s: PerFlight = 0.0

    @property
    def windy(self) -> bool:
        """Whether the air moves in any flight."""
        return bool(np.any(self.wind_speed_m_s))

    @cached_property
    def pushing(self) -> bool:
        """Whether any flight is pushed."""
        return any(bool(np.any(part)) for part in self.push_n_s)

    @cached_property
    def any(self) -> bool:
        """Whether any flight is disturbed at all."""
        return (
            self.windy or self.pushing or bool(np.any(self.battery_sag_1_s)) or bool(np.any(self.payload_kg))
        )


class World:
    """The disturbances of n flights as they unfold, a tick at a time."""

    def __init__(
        self, disturbances: Disturbances, vehicle: Vehicle, seeds: Sequence[int], height_m: float
    ) -> None:
        self._disturbances, self._vehicle = disturbances, vehicle
        self._ticks = 0
        self._gusts = None
        if disturbances.windy:
            self._gusts = Gusts(
                disturbances.wind_speed_m_s,
                disturbances.wind_direction_rad,
                seeds,
                height_m=height_m,
                step_s=STEP_S,
            )

    def tick(self, state: VehicleState, time_s: float) -> tuple[VehicleState, Moment | None]:
        """Return the state after the pushes due now, and what is special until the next tick."""
        chosen = self._disturbances
        if not chosen.any:
            return state, None
        flown_s, now = STEP_S * self._ticks, round(time_s / STEP_S)
        self._ticks += 1
        carried = np.rint(np.asarray(chosen.payload_time_s) / STEP_S) <= now
        payload_kg: FloatArray = np.asarray(chosen.payload_kg, np.float64) * carried
        pushed = np.rint(np.asarray(chosen.push_time_s) / STEP_S) == now
        if chosen.pushing and pushed.any():
            flights = state.body.shape[1]
            impulse_n_s = np.stack([np.broadcast_to(part * pushed, flights) for part in chosen.push_n_s])
            state = self._vehicle.pushed(state, impulse_n_s, payload_kg)
        moment = Moment(
            thrust_share=np.maximum(1.0 - chosen.battery_sag_1_s * flown_s, 0.0),
            payload_kg=payload_kg,
            air_m_s=None if self._gusts is None else self._gusts.next(),
        )
        return state, moment
