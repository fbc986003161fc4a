"""Drones at the ends of the intervals that a log has shown: the section [uncertainty] of a vehicle.toml."""

import itertools
from collections.abc import Iterator, Mapping
from typing import Any, Final

from mambo_codegen.errors import InvalidSettingsError, echo
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import FlightError

Ends = Mapping[str, int]
"""Of each property with an interval: -1 for its lower end, 1 for its upper end, 0 for the value itself."""

_KEYS: Final = {
    "gain": (
        "attitude.roll.gain",
        "attitude.pitch.gain",
        "attitude.acceleration_per_tilt_g",
        "thrust.gain",
    ),
    "lag_s": ("attitude.roll.lag_s", "attitude.pitch.lag_s", "thrust.lag_s"),
    "dead_time_s": ("attitude.roll.dead_time_s", "attitude.pitch.dead_time_s"),
    "drag_1_s": ("body.drag_1_s",),
}
"""Keys of a vehicle.toml on which margins depend, by the property of the loop that they set.

Keys of one property go to the same end: the keys of one axis multiply, and the axes do not act on each other.
"""
_SPLIT: Final = "split_s"
_SPLITS: Final = {"lag_s": (f"attitude.roll.{_SPLIT}", f"attitude.pitch.{_SPLIT}")}
"""Of no key of the file: a longer lag with a shorter dead time, or the reverse, at the same sum."""
_RANGES: Final = {"lag_s": (0.001, 2.0), "dead_time_s": (0.0, 0.2), "drag_1_s": (0.0, 100.0)}
_RANGE: Final = (0.1, 3.0)


def uncertain(drone: VehicleFile, *, height: bool) -> VehicleFile:
    """Return a drone with the intervals on which margins depend: the thrust's only with a height."""
    if drone.uncertainty is None or height:
        return drone
    known = drone.uncertainty.model_copy(update={"thrust_gain": None, "thrust_lag_s": None})
    return drone.model_copy(update={"uncertainty": known})


def intervals(drone: VehicleFile) -> dict[str, list[tuple[str, float]]]:
    """Return keys and half-widths of each property with an interval.

    Raises InvalidSettingsError for a drone without the section [uncertainty].
    """
    if drone.uncertainty is None:
        raise InvalidSettingsError(
            (f"vehicle {echo(drone.name)}: has no section [uncertainty]; `identify` writes it from a log",)
        )
    widths = drone.uncertainty.model_dump(exclude_none=True)
    document = drone.model_dump(exclude_none=True)
    found = {
        name: [(key, widths.get(_width_of(key), 0.0)) for key in keys if _has(document, key)]
        + [(key, widths[_width_of(key)]) for key in _SPLITS.get(name, ()) if widths.get(_width_of(key))]
        for name, keys in _KEYS.items()
    }
    return {name: keys for name, keys in found.items() if any(width for _, width in keys)}


def corners(drone: VehicleFile) -> Iterator[Ends]:
    """Yield all combinations of ends; raises as `intervals`."""
    known = intervals(drone)
    for ends in itertools.product((-1, 1), repeat=len(known)):
        yield dict(zip(known, ends, strict=True))


def at_ends(drone: VehicleFile, ends: Ends) -> VehicleFile:
    """Return a drone with its properties at ends of their intervals, within the ranges of a vehicle.toml.

    Raises FlightError if its thrust does not lift it there.
    """
    document = drone.model_dump(exclude_none=True)
    for name, keys in intervals(drone).items():
        for key, width in keys:
            section, last = _section(document, key), key.rpartition(".")[2]
            if last == _SPLIT:
                _split(section, ends[name] * width)
                continue
            low, high = _RANGES.get(last, _RANGE)
            section[last] = min(max(section[last] + ends[name] * width, low), high)
    if "thrust" in document:
        gain, most_n = document["thrust"]["gain"], drone.altitude.thrust_max_n
        if gain * most_n <= drone.weight_n:
            raise FlightError(
                f"vehicle {echo(drone.name)}: altitude.thrust_max_n = {most_n:g} does not lift it with "
                f"thrust.gain = {gain:g}, an end of the interval in [uncertainty]"
            )
    return VehicleFile.model_validate(document)


def in_words(ends: Ends) -> dict[str, float | str]:
    """Return the ends as words."""
    return {name: ("low", "middle", "high")[end + 1] for name, end in ends.items()}


def _width_of(key: str) -> str:
    """Return the key in [uncertainty] of a key of the file."""
    return key.removeprefix("body.").removeprefix("attitude.").replace(".", "_")


def _section(document: dict[str, Any], key: str) -> dict[str, Any]:
    for name in key.split(".")[:-1]:
        document = document.get(name, {})
    return document


def _has(document: dict[str, Any], key: str) -> bool:
    return key.rpartition(".")[2] in _section(document, key)


def _split(axis: dict[str, Any], longer_s: float) -> None:
    """Make the lag of an axis longer and its dead time shorter by the same time, as far as both may go."""
    lag_s, dead_time_s = axis["lag_s"], axis["dead_time_s"]
    (shortest_s, _), (least_s, longest_s) = _RANGES["lag_s"], _RANGES["dead_time_s"]
    moved_s = min(max(longer_s, shortest_s - lag_s, dead_time_s - longest_s), dead_time_s - least_s)
    axis["lag_s"], axis["dead_time_s"] = lag_s + moved_s, dead_time_s - moved_s
