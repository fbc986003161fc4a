"""Flights for programs: the closed loop of a controller's C and a simulated vehicle."""

import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final, cast

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.key import spell
from mambo_sil.api.api_controller import Controller
from mambo_sil.arguments import (
    is_whole,
    require,
    require_choice,
    require_kind,
    require_number,
    require_per_flight,
)
from mambo_sil.drone.plant.arrays import PerFlight
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.errors import ArgumentError, TrajectoryError, UserNotice
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.own_law import Law, OwnLaws, period_of
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine import simulate
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import Metrics, measure
from mambo_sil.flight.names import SENSORS_NAMES, STARTS, CurveName, SensorsName, Start
from mambo_sil.flight.own_curve import check_curve
from mambo_sil.flight.scenario import (
    LARGEST_RATE_RAD_S,
    LARGEST_SEED,
    LARGEST_SIZE_M,
    LARGEST_WIND_M_S,
    LARGEST_YAW_RAD,
    LONGEST_S,
    choose_sensors,
)
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import CURVES, Trajectory, is_trajectory
from mambo_sil.results.number_format import distance

LARGEST_PUSH_M_S2: Final = 100.0


@dataclass(frozen=True, eq=False, repr=False)
class FlightResult:
    """n simulated flights.

    trace:   k samples of n flights, with units in the names of its arrays.
    metrics: of the true positions, each (n,), from `measured_from_s` on.
    crashed: which flights (n,) were lost, tilted too far or touched the ground.
    failures: of a law of one's own, when and why it was lost, by the number of the flight.
    """

    trace: Trace
    metrics: Metrics
    crashed: NDArray[np.bool_]
    failures: dict[int, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return how many flights there are, how close they are, and how many crashed."""
        rms_m = np.where(self.crashed, np.inf, self.metrics.rms_error_m)
        median_m, most_m = np.quantile(rms_m, (0.5, 1.0), method="inverted_cdf").tolist()
        if len(rms_m) == 1:
            return f"FlightResult({'crashed' if self.crashed[0] else f'rms error {distance(most_m)}'})"
        shown = f"rms error {distance(median_m)} in the median, {distance(most_m)} at most"
        return f"FlightResult({len(rms_m)} flights: {shown}, {int(self.crashed.sum())} crashed)"


def fly(
    controller: Controller | Law,
    vehicle: Vehicle,
    trajectory: CurveName | Trajectory = "bernoulli",
    *,
    size_m: float = 2.0,
    rate_rad_s: float = 0.5,
    duration_s: float = 100.0,
    yaw_rad: PerFlight = 0.0,
    sensors: SensorsName = "true",
    seeds: Sequence[int] = (0,),
    start: Start = "hover",
    push_m_s2: tuple[PerFlight, PerFlight] = (0.0, 0.0),
    wind_speed_m_s: PerFlight = 0.0,
    wind_direction_rad: PerFlight = 0.0,
    measured_from_s: float = 0.0,
) -> FlightResult:
    """Fly the settings of a controller, or a law of your own, on a vehicle, once for each seed.

    controller: each flight has a new one with its settings; or any object with the method `step` of `Law`,
                copied for each flight. A law that raises, or returns what is no command, loses its flight
                alone, with a warning that says why, and `FlightResult.failures`.
    trajectory: a curve of the command `fly` with half-width, radius, step or height `size_m` and angular
                rate `rate_rad_s`, or an object with its methods `target` and `acceleration`, and `vertical`
                if it has a height, which the altitude loop of the vehicle then follows. Its velocity is
                the derivative of its position.
    yaw_rad:    constant heading, one for all flights or an array (n,).
    sensors:    what controller and inner loops see: the truth ("true"), or the vehicle's sensors by name.
    seeds:      of sensor noise and gusts, one for each of n flights.
    start:      hovering at the first point, or on the ground 5 s earlier ("take-off").
    push_m_s2:  steady acceleration along x and y of the world, each one number or an array (n,).
    wind_speed_m_s, wind_direction_rad: mean wind 6 m above the ground, of which 0.65 is left at 1.1 m, with
                its gusts, and the heading towards which it blows; each one number or an array (n,).
    measured_from_s: time from which on `metrics` count: a start from rest is most of their error.

    Raises ArgumentError for a wrong argument, FlightError if they do not fit together.
    """
    has_step = callable(getattr(controller, "step", None))
    require(has_step, "controller", controller, "be a Controller or an object with the method step")
    require_kind("vehicle", vehicle, Vehicle, "a Vehicle")
    require_number("duration_s", duration_s, 0.0, LONGEST_S)
    curve = as_curve(trajectory, size_m, rate_rad_s, duration_s)
    require_number("measured_from_s", measured_from_s, 0.0, max(0.0, duration_s - period_of(controller)))
    require_choice("sensors", sensors, SENSORS_NAMES)
    require_choice("start", start, STARTS)
    given = _as_seeds(seeds)
    require_per_flight("yaw_rad", yaw_rad, -LARGEST_YAW_RAD, LARGEST_YAW_RAD, len(given))
    vehicle.require_flights(len(given))
    _require_push(push_m_s2, len(given))
    require_per_flight("wind_speed_m_s", wind_speed_m_s, 0.0, LARGEST_WIND_M_S, len(given))
    require_per_flight("wind_direction_rad", wind_direction_rad, -math.tau, math.tau, len(given))
    flight = Flight(
        curve,
        duration_s=duration_s,
        flights=len(given),
        start=start,
        yaw_rad=np.asarray(yaw_rad, np.float64),
        vehicle=vehicle,
        update_period_s=period_of(controller),
        seeds=given,
        disturbances=Disturbances(wind_speed_m_s, wind_direction_rad, push_m_s2=push_m_s2),
        sensors=choose_sensors(sensors, vehicle.drone),
    )
    if isinstance(controller, Controller):
        trace = simulate.fly(flight, CompiledController(controller.settings, flight.flights))
        return FlightResult(trace, measure(trace, measured_from_s), detect_crashes(trace, vehicle.drone))
    laws = OwnLaws(controller, flight)
    trace = simulate.fly(flight, laws)
    for number, failure in laws.failures.items():
        warnings.warn(f"flight {number}, {failure}", UserNotice, stacklevel=2)
    crashed = detect_crashes(trace, vehicle.drone)
    return FlightResult(trace, measure(trace, measured_from_s), crashed, laws.failures)


def as_curve(trajectory: object, size_m: float, rate_rad_s: float, duration_s: float) -> Trajectory:
    """Return the curve called `trajectory`, or `trajectory` itself, checked for the time of a flight.

    Raises ArgumentError for others.
    """
    require_number("size_m", size_m, -LARGEST_SIZE_M, LARGEST_SIZE_M)
    require_number("rate_rad_s", rate_rad_s, -LARGEST_RATE_RAD_S, LARGEST_RATE_RAD_S)
    for name, curve in CURVES.items():
        if isinstance(trajectory, str) and trajectory == name:
            return curve(size_m, rate_rad_s)
    rule = f"be {', '.join(map(spell, CURVES))} or an object with the methods target and acceleration"
    require(is_trajectory(trajectory), "trajectory", trajectory, rule)
    try:
        check_curve("trajectory", cast("Trajectory", trajectory), duration_s)
    except TrajectoryError as error:
        raise ArgumentError(str(error)) from error
    return cast("Trajectory", trajectory)


def _require_push(push_m_s2: object, flights: int) -> None:
    """Raise ArgumentError unless the push is one number or an array (flights,) along each axis."""
    pair = push_m_s2 if isinstance(push_m_s2, tuple) else ()
    require(len(pair) == len("xy"), "push_m_s2", push_m_s2, "be a tuple of two, along x and y")
    for axis, push in zip("xy", pair, strict=True):
        name = f"push_m_s2 along {axis}"
        require_per_flight(name, push, -LARGEST_PUSH_M_S2, LARGEST_PUSH_M_S2, flights)


def _as_seeds(seeds: object) -> tuple[int, ...]:
    """Return the seeds of the flights; raises ArgumentError."""
    given = tuple(seeds) if isinstance(seeds, Iterable) else ()
    good = len(given) > 0 and all(is_whole(seed, 0, LARGEST_SEED) for seed in given)
    require(good, "seeds", seeds, f"be whole numbers in 0..{LARGEST_SEED}, one or more in a sequence")
    return tuple(map(int, given))
