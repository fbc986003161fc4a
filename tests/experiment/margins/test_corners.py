"""Drones at the ends of intervals: every key of the file moves by its width, within its range."""

import itertools
from typing import Any, Final

import pytest

from mambo_sil.drone.vehicles import VEHICLES, vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.margins.corners import at_ends, corners, in_words, intervals, uncertain

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
