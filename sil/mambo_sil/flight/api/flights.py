"""Flights for programs: the closed loop of a controller's C and a simulated vehicle."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import PerFlight
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.flight.api.controller import Controller
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine import simulate
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import Metrics, measure
from mambo_sil.flight.names import CurveName, SensorsName, Start
from mambo_sil.flight.scenario import choose_sensors
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import CURVES, Trajectory


@dataclass(frozen=True, eq=False)
class Flown:
    """n simulated flights.

    trace:   k samples of n flights, with units in the names of its arrays.
    metrics: of the true positions, each (n,).
    crashed: which flights (n,) were lost, tilted too far or touched the ground.
    """

    trace: Trace
    metrics: Metrics
    crashed: NDArray[np.bool_]


def fly(
    controller: Controller,
    vehicle: Vehicle,
    trajectory: CurveName | Trajectory = "bernoulli",
    *,
    size_m: float = 2.0,
    rate_rad_s: float = 0.5,
    duration_s: float = 100.0,
    yaw_rad: PerFlight = 0.0,
    sensors: SensorsName = "none",
    seeds: Sequence[int] = (0,),
    start: Start = "hover",
) -> Flown:
    """Fly the settings of a controller on a vehicle, once for each seed, with new controllers.

    trajectory: a curve of the command `fly` with half-width, radius or step `size_m` and angular rate
                `rate_rad_s`, or an object with its methods `target` and `acceleration`.
    yaw_rad:    constant heading, one for all flights or an array (n,).
    sensors:    what controller and inner loops see: the truth ("none"), or the vehicle's sensors by name.
    seeds:      of sensor noise, one for each of n flights.
    start:      hovering at the first point, or on the ground 5 s earlier ("take-off").

    Raises FlightError if these do not fit together.
    """
    flight = Flight(
        CURVES[trajectory](size_m, rate_rad_s) if isinstance(trajectory, str) else trajectory,
        duration_s=duration_s,
        flights=len(seeds),
        start=start,
        yaw_rad=yaw_rad,
        vehicle=vehicle,
        update_period_s=controller.update_period_s,
        seeds=tuple(seeds),
        sensors=choose_sensors(sensors, vehicle.drone),
    )
    trace = simulate.fly(flight, CompiledController(controller.settings, flight.flights))
    return Flown(trace, measure(trace), detect_crashes(trace, vehicle.drone))
