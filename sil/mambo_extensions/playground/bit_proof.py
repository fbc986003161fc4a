"""The flight that proves the bits: the engine of this machine flies it, and every page when it loads."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from mambo_extensions.playground.page_controllers import PageController, period_s
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.randomness import Purpose, generators
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.sensors import mocap
from mambo_sil.drone.sensors.mocap import MotionCapture
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors
from mambo_sil.flight.altitude_loops import AltitudeLaw
from mambo_sil.flight.engine.records import Record, flight_records, simulation_record
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.height_profiles import Swing
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.trajectories import Bernoulli, InSpace

DURATION_S: Final = 4.0
HALF_WIDTH_M: Final = 2.0
RATE_RAD_S: Final = 0.5
"""The eight of Table II."""
SWING_M: Final = 0.3
SWING_RAD_S: Final = 1.5
"""The height of the proof's target, where a controller of the page commands the thrust."""
_SEED: Final = 0
_WIND: Final = Disturbances(
    wind_speed_m_s=4.0, wind_direction_rad=1.0, impulse_n_s=(0.02, -0.03, 0.0), impulse_time_s=1.5
)


@dataclass(frozen=True, eq=False)
class ProofInputs:
    """What the engine reads for one flight, besides its records."""

    targets: FloatArray
    """(updates, 6), with heights (updates, 9)."""
    sensors: FloatArray
    """Random numbers (ticks, 6)."""
    gusts: FloatArray
    """Random numbers (ticks + 1, 3)."""


def motion_capture(drone: VehicleFile) -> MotionCapture:
    """Return the motion capture of a drone; one without has the crazyflie's."""
    sensors = drone.sensors
    if not isinstance(sensors, MocapSensors):
        sensors = vehicle_toml.preset("crazyflie").sensors
        assert isinstance(sensors, MocapSensors)
    return MotionCapture(sensors)


def proof_flight(drone: VehicleFile, found: Sequence[PageController]) -> Flight:
    """Return an eight in gusts, with an impulse and motion capture; raises FlightError.

    If one of the controllers commands the thrust, the height of the eight swings for all of them, and
    the drones of the others follow it by the tuned altitude loop `pid`, not by the stock one.
    """
    eight, spatial = Bernoulli(HALF_WIDTH_M, RATE_RAD_S), any(one.commands_thrust for one in found)
    return Flight(
        InSpace(eight, Swing(SWING_M, SWING_RAD_S)) if spatial else eight,
        duration_s=DURATION_S,
        vehicle=Vehicle.of(drone),
        update_period_s=period_s(found),
        seeds=(_SEED,),
        disturbances=_WIND,
        sensors=motion_capture(drone),
        altitude=AltitudeLaw("pid" if spatial else "stock"),
    )


def records(flight: Flight) -> tuple[Record, Record]:
    """Return the engine's records of the simulation and of its one flight."""
    return simulation_record(flight, flight.times_s()), flight_records(flight, flight.given_targets[0])


def inputs(flight: Flight) -> ProofInputs:
    """Return what the engine reads besides the records."""
    targets = flight.given_targets[:, 0]
    ticks = len(targets) * flight.ticks_per_update
    sensors, gusts = (generators((_SEED,), purpose)[0] for purpose in (Purpose.SENSORS, Purpose.GUSTS))
    return ProofInputs(
        np.ascontiguousarray(targets),
        sensors.standard_normal((ticks, mocap.NOISES)),
        gusts.standard_normal((ticks + 1, 3)),
    )


def calm(flight: Flight) -> Flight:
    """Return the same flight without wind, impulse and noise, from which the page starts."""
    assert isinstance(flight.sensors, MotionCapture)
    quiet = replace(flight.sensors, noise_scale=0.0)
    return replace(flight, disturbances=Disturbances(), sensors=quiet)


def native_digest(flight: Flight, one: PageController) -> str:
    """Return the SHA-256 of the trace on this machine; raises BuildError, CacheError."""
    return fly(flight, one.controller(flight)).digest()
