"""The table of the presets' margins on the shipped drones."""

import json
from pathlib import Path
from typing import Any, Final

from benchmarks.evidence.item import Figures
from benchmarks.evidence.tables import Row, title
from benchmarks.markdown import table
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.names import DEFAULT_SENSORS
from mambo_sil.results.number_format import three_digits

PRESETS: Final = ("mambo", "crazyflie")
DRONES: Final = (
    *("crazyflie", "crazyflie-brushless", "crazyflie-flown", "crazyflie-l250"),
    *("generic", "mambo"),
)
"""Drones that are real, and `generic`; not those that only a simulator has."""
_KEYS: Final = ("gain_up", "gain_down", "phase_deg", "delay_s", "sensitivity")
_ALIKE: Final = 5e-3
"""Axes whose figures differ by a smaller share are one row."""


def _cases() -> list[tuple[str, str, str]]:
    """Return preset, drone and sensors of each command: the true state, and the sensors of a campaign."""
    found: list[tuple[str, str, str]] = []
    for drone in DRONES:
        sensors = DEFAULT_SENSORS[vehicle_toml.preset(drone).sensors.kind]
        found += [(preset, drone, seen) for preset in PRESETS for seen in dict.fromkeys(("true", sensors))]
    return found


def margin_commands() -> tuple[str, ...]:
    """Return the commands that measure the presets on every drone."""
    return tuple(
        f"mambo-nmpc margins {preset} --vehicle {drone} --sensors {sensors} --json"
        for preset, drone, sensors in _cases()
    )


def read_margins(results: Path) -> Figures:
    """Return the margins of both axes by command."""
    found = {}
    for number, (preset, drone, sensors) in enumerate(_cases()):
        axes = json.loads((results / f"printed-{number}.txt").read_text("utf-8"))["axes"]
        found[f"{preset} on {drone}, {sensors}"] = [_kept(axis) for axis in axes]
    return found


def _kept(axis: dict[str, Any]) -> dict[str, Any]:
    """Return the figures of an axis that tables have."""
    loops = {
        place: None if axis[place] is None else {key: axis[place][key] for key in _KEYS}
        for place in ("command", "motors")
    }
    return {"axis": axis["axis"], "stable": axis["stable"], **loops}


def presets_on_drones(figures: Figures) -> str:
    """Return a row for each axis of a preset on a drone; one for both if they are alike."""
    rows: list[Row] = []
    for name, axes in figures.items():
        pair, sensors = name.split(", ")
        preset, drone = pair.split(" on ")
        shown = axes[:1] if _alike(*axes) else axes
        for axis in shown:
            first = {
                "settings on drone": f"{title(preset)} on {title(drone)}",
                "state": sensors,
                "axis": "both" if len(shown) == 1 else axis["axis"],
            }
            rows.append(first | _cells("command", axis["command"]) | _cells("torque", axis["motors"]))
            if not axis["stable"]:
                rows[-1]["command: gain"] = "unstable"
    return table(rows)


def _cells(place: str, loop: dict[str, Any] | None) -> Row:
    heads = ("gain", "phase, deg", "delay, ms", "Ms")
    if loop is None:
        return {f"{place}: {head}": "" for head in heads}
    gain = three_digits(loop["gain_up"])
    if place == "torque":
        gain = f"{three_digits(loop['gain_down'])} .. {gain}"
    values = (loop["phase_deg"], 1e3 * loop["delay_s"], loop["sensitivity"])
    cells = (gain, *(three_digits(value) for value in values))
    return {f"{place}: {head}": cell for head, cell in zip(heads, cells, strict=True)}


def _alike(roll: dict[str, Any], pitch: dict[str, Any]) -> bool:
    """Return whether both axes have the same figures in a table."""
    if roll["command"] is None or pitch["command"] is None:
        return bool(roll["command"] == pitch["command"])
    return all(
        abs(roll["command"][key] - pitch["command"][key]) <= _ALIKE * pitch["command"][key] for key in _KEYS
    )
