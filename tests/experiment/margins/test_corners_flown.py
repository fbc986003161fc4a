"""Drones at the ends of their intervals: those that margins call unstable swing in flight, others do not."""

from typing import Any

import numpy as np
import pytest

from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import FlightError
from mambo_sil.experiment.margins.corners import at_ends, corners, uncertain
from mambo_sil.experiment.margins.hover_margins import hover_loops, measure_loops
from mambo_sil.experiment.margins.many_drones import hovering_flight
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight, Offset
from mambo_sil.flight.names import SENSORS_OF
from mambo_sil.flight.scenario import choose_sensors
from mambo_sil.flight.trajectories import Hover
from tests.support.derived import settings_for

DRONES = range(100, 150)
"""Seeds of the drones; others than those by which this test was made."""


def drawn(seed: int) -> VehicleFile:
    """Return a drone that a log has shown well or badly, with sensors without noise, or the true state."""
    rng = np.random.default_rng(seed)

    def axis() -> dict[str, float]:
        return {
            "gain": rng.uniform(0.75, 1.1),
            "lag_s": 10.0 ** rng.uniform(-1.7, -0.8),
            "dead_time_s": rng.uniform(0.001, 0.08),
        }

    wide, gain, lag_s = 10.0 ** rng.uniform(-0.5, 0.6), rng.uniform(0.4, 1.6), 10.0 ** rng.uniform(-1.7, -0.7)
    document: dict[str, Any] = {
        "name": f"drawn-{seed}",
        "body": {"mass_kg": 0.1, "drag_1_s": rng.uniform(0.05, 0.5)},
        "attitude": {"kind": "first_order", "roll": axis(), "pitch": axis()},
        "thrust": {"gain": gain, "lag_s": lag_s, "dead_time_s": rng.choice([0.0, 0.02])},
        "uncertainty": {
            **{f"{axis}_gain": 0.05 * wide for axis in ("roll", "pitch")},
            **{f"{axis}_lag_s": 0.035 * wide for axis in ("roll", "pitch")},
            **{f"{axis}_dead_time_s": 0.035 * wide for axis in ("roll", "pitch")},
            "drag_1_s": 0.03 * wide,
            "thrust_gain": 0.1 * wide * gain,
            "thrust_lag_s": 0.04 * wide,
        },
    }
    if rng.random() < 0.6:
        document["sensors"] = {
            "kind": "mocap",
            "position_noise_m": 0.0,
            "position_delay_s": rng.uniform(0.0, 0.03),
            "velocity_filter_s": rng.uniform(0.0, 0.05),
            "attitude_noise_rad": 0.0,
        }
    return VehicleFile.model_validate(document)


def swings(settings: Settings, drone: VehicleFile) -> bool:
    """Return whether a drone falls, or moves at the end of four minutes at least half as much as before.

    It starts a millimetre off; a thrust that is still to be learnt moves it by centimetres at first. Between
    the times that are compared a swing that falls e-fold in 200 s halves.
    """
    flight = Flight(
        Hover(),
        duration_s=240.0,
        vehicle=Vehicle.of(drone),
        update_period_s=settings.horizon.update_period_s,
        offset=Offset((1e-3, 1e-3, -1e-3)),
        sensors=choose_sensors(SENSORS_OF[drone.sensors.kind][-1], drone),
    )
    trace = fly(flight, CompiledController(settings))
    if detect_crashes(trace, drone).any():
        return True
    early_m, late_m = (
        np.ptp(trace.position_m[(trace.time_s >= begin_s) & (trace.time_s < begin_s + 10.0), 0], axis=0)
        for begin_s in (80.0, 230.0)
    )
    return bool(((late_m > 0.5 * early_m) & (late_m > 1e-6)).any())


def unstable(settings: Settings, drone: VehicleFile) -> bool:
    """Return whether margins call one of the axes unstable, or say that the height is not held."""
    sensors = SENSORS_OF[drone.sensors.kind][-1]
    flight = hovering_flight(drone, sensors, settings.horizon.update_period_s)
    try:
        (loops,) = hover_loops(settings, flight)
    except FlightError:
        return True
    return not all(axis.stable for axis in measure_loops(loops, flight, count=30))


@pytest.mark.sampled(17)
@pytest.mark.long
@pytest.mark.parametrize("seed", DRONES)
def test_what_is_called_unstable_swings_and_nothing_else(seed: int) -> None:
    """At every corner of the intervals, flown with the settings that are derived for the drone itself."""
    drone = drawn(seed)
    settings = with_option(settings_for(drone), "code.scalar", "float64")
    certain = uncertain(drone, height=settings.height is not None)
    at = {str(ends): at_ends(certain, ends) for ends in corners(certain)}
    called = {ends: unstable(settings, one) for ends, one in at.items()}
    assert called == {ends: swings(settings, one) for ends, one in at.items()}
