"""Drones at the ends of intervals: which keys move how far, and which of the drones swing in flight."""

import itertools
from typing import Any, Final

import numpy as np
import pytest

from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import VEHICLES, vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import FlightError
from mambo_sil.experiment.margins.axis_margins import measure_loops
from mambo_sil.experiment.margins.corners import at_ends, corners, in_words, intervals, uncertain
from mambo_sil.experiment.margins.hover_loop import hover_loops
from mambo_sil.experiment.margins.many_drones import hovering_flight
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight, Offset
from mambo_sil.flight.names import DEFAULT_SENSORS
from mambo_sil.flight.scenario import choose_sensors
from mambo_sil.flight.trajectories import Hover
from tests.support.derived import settings_for

WIDTHS: Final = {
    "attitude.roll.gain": 0.11,
    "attitude.pitch.gain": 0.12,
    "attitude.acceleration_per_tilt_g": 0.13,
    "thrust.gain": 0.14,
    "attitude.roll.lag_s": 0.011,
    "attitude.pitch.lag_s": 0.012,
    "thrust.lag_s": 0.013,
    "attitude.roll.dead_time_s": 0.021,
    "attitude.pitch.dead_time_s": 0.022,
    "body.drag_1_s": 0.05,
}
PROPERTY: Final = {"gain": "gain", "acceleration_per_tilt_g": "gain"} | {
    name: name for name in ("lag_s", "dead_time_s", "drag_1_s")
}
"""Of the last part of each key, the property of the loop that it sets."""


def uncertain_drone(factor: float = 1.0) -> VehicleFile:
    """Return a drone with intervals of a factor times WIDTHS, which flies with a tenth of its thrust."""
    lines = ["", "[thrust]", "lag_s = 0.06", "gain = 0.95", "", "[uncertainty]"]
    for key, width in WIDTHS.items():
        name = key.removeprefix("attitude.").removeprefix("body.").replace(".", "_")
        lines.append(f"{name} = {factor * width!r}")
    strong = VEHICLES.text("crazyflie-flown").replace("thrust_max_n = 0.575", "thrust_max_n = 8.0")
    return vehicle_toml.parse(strong + "\n".join(lines) + "\n", "mine", "mine.toml")


def value_of(drone: VehicleFile, key: str) -> Any:
    """Return the value of a key of the file."""
    value: Any = drone
    for name in key.split("."):
        value = getattr(value, name)
    return value


def test_keys_of_one_property_move_to_the_same_end() -> None:
    """In all sixteen corners each value is that of the file plus or minus its width, and no other changes."""
    drone = uncertain_drone()
    found = list(corners(drone))
    names = ("gain", "lag_s", "dead_time_s", "drag_1_s")
    assert [tuple(ends.values()) for ends in found] == list(itertools.product((-1, 1), repeat=4))
    assert all(tuple(ends) == names for ends in found)
    for ends in found:
        moved = at_ends(drone, ends)
        for key, width in WIDTHS.items():
            end = ends[PROPERTY[key.rpartition(".")[2]]]
            assert value_of(moved, key) == pytest.approx(value_of(drone, key) + end * width, rel=1e-12)
            assert value_of(moved, key) != value_of(drone, key)
        rest = {"attitude", "thrust", "body"}
        assert moved.model_dump(exclude=rest) == drone.model_dump(exclude=rest)
    words = [set(in_words(ends).values()) for ends in (found[0], found[-1], dict.fromkeys(names, 0))]
    assert words == [{"low"}, {"high"}, {"middle"}]


def test_intervals_are_those_of_the_file() -> None:
    """Of each key with a width; a key of the same property without one stays."""
    found = intervals(uncertain_drone())
    assert dict(itertools.chain.from_iterable(found.values())) == WIDTHS
    only = VEHICLES.text("crazyflie-flown") + "\n[uncertainty]\nroll_gain = 0.1\ndrag_1_s = 0.0\n"
    drone = vehicle_toml.parse(only, "mine", "mine.toml")
    assert intervals(drone).keys() == {"gain"}
    assert dict(intervals(drone)["gain"])["attitude.roll.gain"] == 0.1
    high = at_ends(drone, {"gain": 1})
    assert value_of(high, "attitude.roll.gain") == pytest.approx(value_of(drone, "attitude.roll.gain") + 0.1)
    assert value_of(high, "attitude.pitch.gain") == value_of(drone, "attitude.pitch.gain")


@pytest.mark.parametrize("split_s", [0.02, 1.0])
def test_a_split_moves_lag_and_dead_time_at_the_same_sum(split_s: float) -> None:
    """Of one axis, as far as both may go; the other axis moves by its lag."""
    widths = f"\n[uncertainty]\nroll_split_s = {split_s}\npitch_lag_s = 0.01\n"
    drone = vehicle_toml.parse(VEHICLES.text("crazyflie-flown") + widths, "mine", "mine.toml")
    lag_s, dead_time_s, pitch_s = (
        value_of(drone, f"attitude.{key}") for key in ("roll.lag_s", "roll.dead_time_s", "pitch.lag_s")
    )
    low, high = (at_ends(drone, ends) for ends in corners(drone))
    shorter_s, longer_s = min(split_s, lag_s - 0.001), min(split_s, dead_time_s)
    for moved, by_s, end in ((low, -shorter_s, -1), (high, longer_s, 1)):
        assert value_of(moved, "attitude.roll.lag_s") == pytest.approx(lag_s + by_s)
        assert value_of(moved, "attitude.roll.dead_time_s") == pytest.approx(dead_time_s - by_s, abs=1e-12)
        assert value_of(moved, "attitude.pitch.lag_s") == pytest.approx(pitch_s + end * 0.01)


def test_no_end_lies_outside_of_the_ranges_of_a_file() -> None:
    """Where the interval is wider than the range the drone is at its end, which the file's schema takes."""
    drone = uncertain_drone(factor=3000.0)
    low, high = (at_ends(drone, dict.fromkeys(PROPERTY.values(), end)) for end in (-1, 1))
    expected = {"gain": (0.1, 3.0), "lag_s": (0.001, 2.0), "dead_time_s": (0.0, 0.2)}
    for key in WIDTHS:
        name = PROPERTY[key.rpartition(".")[2]]
        if name in expected:
            assert (value_of(low, key), value_of(high, key)) == expected[name], key
    assert (value_of(low, "body.drag_1_s"), value_of(high, "body.drag_1_s")) == (0.0, 100.0)


def test_intervals_of_the_thrust_stay_with_a_height_only() -> None:
    """And a drone without intervals stays as it is."""
    drone = uncertain_drone()
    assert uncertain(drone, height=True) == drone
    without = intervals(uncertain(drone, height=False))
    assert not any(key.startswith("thrust") and width for keys in without.values() for key, width in keys)
    certain = vehicle_toml.preset("crazyflie-flown")
    assert uncertain(certain, height=False) == uncertain(certain, height=True) == certain


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
    """Return whether a drone falls, or moves at the end of four minutes nearly as much as before.

    It starts a millimetre off; a thrust that is still to be learnt moves it by centimetres at first. Between
    the times that are compared a swing that falls e-fold in 500 s loses a quarter; one drone takes 249 s.
    """
    flight = Flight(
        Hover(),
        duration_s=240.0,
        vehicle=Vehicle.of(drone),
        update_period_s=settings.horizon.update_period_s,
        offset=Offset((1e-3, 1e-3, -1e-3)),
        sensors=choose_sensors(DEFAULT_SENSORS[drone.sensors.kind], drone),
    )
    trace = fly(flight, CompiledController(settings))
    if detect_crashes(trace, drone).any():
        return True
    early_m, late_m = (
        np.ptp(trace.position_m[(trace.time_s >= begin_s) & (trace.time_s < begin_s + 10.0), 0], axis=0)
        for begin_s in (80.0, 230.0)
    )
    return bool(((late_m > 0.75 * early_m) & (late_m > 1e-6)).any())


def unstable(settings: Settings, drone: VehicleFile) -> bool:
    """Return whether margins call one of the axes unstable, or say that the height is not held."""
    sensors = DEFAULT_SENSORS[drone.sensors.kind]
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
