"""Places of a mission that QGroundControl has saved (.plan), in metres from its first one."""

import json
import math
from typing import Any, Final

from mambo_sil.errors import TrajectoryError

MISSION: Final = ".plan"
METRES_PER_DEGREE: Final = 111_194.9
"""Of latitude, on a sphere of 6371 km; that of longitude is as much times the cosine of the latitude."""
ABOVE_HOME: Final = (3, 6)
"""MAVLink frames with heights above the place of take-off."""


WAYPOINT, SPLINE, TAKE_OFF = 16, 82, 22
"""MAVLink commands whose place is flown to; others are left out."""
REACHED_M: Final = 1.0
"""Tolerance of a place without a radius of acceptance."""


def places_of(text: str) -> dict[str, tuple[float, float, float, float]]:
    """Return x north, y west, z up in m of each place, and its tolerance, by the number of its item.

    x and y are from the first place, z is above the place of take-off.

    Raises `TrajectoryError`, which names the item and the rule.
    """
    try:
        document: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise TrajectoryError(f"cannot be read as JSON: {error}; save the mission again") from None
    mission = document.get("mission") if isinstance(document, dict) else None
    items = mission.get("items") if isinstance(mission, dict) else None
    if not isinstance(items, list):
        raise TrajectoryError("has no mission.items: it is no mission of QGroundControl")
    numbered = {f"item {number}": item for number, item in enumerate(items, start=1)}
    found = {name: _place(name, item) for name, item in numbered.items() if _is_place(item)}
    if not found:
        raise TrajectoryError("has no waypoint in mission.items")
    (latitude_deg, longitude_deg, *_), *_ = found.values()
    narrower = math.cos(math.radians(latitude_deg))
    return {
        name: (
            METRES_PER_DEGREE * (latitude - latitude_deg),
            -METRES_PER_DEGREE * narrower * (longitude - longitude_deg),
            height_m,
            tolerance_m,
        )
        for name, (latitude, longitude, height_m, tolerance_m) in found.items()
    }


def _is_place(item: object) -> bool:
    """Return whether an item is flown to: a take-off may have no latitude and longitude, or zeros."""
    if not isinstance(item, dict) or item.get("command") not in (WAYPOINT, SPLINE, TAKE_OFF):
        return False
    numbers = item.get("params")
    nowhere = isinstance(numbers, list) and len(numbers) == 7 and not any(numbers[4:6])
    return not (item["command"] == TAKE_OFF and nowhere)


def _place(name: str, item: dict[str, Any]) -> tuple[float, float, float, float]:
    """Return latitude and longitude in degrees, height and tolerance in m."""
    frame, numbers = item.get("frame"), item.get("params")
    if frame not in ABOVE_HOME:
        raise TrajectoryError(f"{name}: frame = {frame} must be one of {ABOVE_HOME}: heights above take-off")
    good = isinstance(numbers, list) and len(numbers) == 7
    place = numbers[4:] if isinstance(numbers, list) and good else []
    if not good or not all(isinstance(one, int | float) and math.isfinite(one) for one in place):
        raise TrajectoryError(f"{name}: params must end with latitude, longitude and height")
    latitude_deg, longitude_deg, height_m = map(float, place)
    if not (abs(latitude_deg) < 90.0 and abs(longitude_deg) <= 180.0):
        raise TrajectoryError(f"{name}: latitude and longitude must lie in -90..90 and -180..180 degrees")
    radius_m = numbers[1] if item["command"] == WAYPOINT and isinstance(numbers, list) else None
    tolerance_m = float(radius_m) if isinstance(radius_m, int | float) and radius_m > 0.0 else REACHED_M
    return latitude_deg, longitude_deg, height_m, tolerance_m
