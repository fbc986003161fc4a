"""Tables of footprints and of faults: figures out of results, and Markdown out of figures."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from benchmarks.evidence.item import Figures
from benchmarks.evidence.tables import Row, summary
from benchmarks.markdown import table
from mambo_sil.experiment.faults.fault_flights import STATUS_NAMES

_ENDS: Final = ("recovered", "not recovered", "crashed")
"""How a flight with a fault ends, from the best to the worst."""


def read_footprints(folders: Mapping[str, str]) -> Callable[[Path], Figures]:
    """Return what reads the boards of `footprint`; `folders` are those of the results, by controller."""
    return lambda results: {
        name: [_board(board) for board in summary(results / folder)["boards"]]
        for name, folder in folders.items()
    }


def _board(board: Figures) -> Figures:
    """Return what tables show of a board."""
    counts = board["instructions"]
    return {
        "name": board["name"],
        "core": board["core"],
        "compiler": board["compiler"],
        "fits": board["fits"],
        "flash_bytes": sum(board["flash_bytes"].values()),
        "ram_bytes": sum(board["ram_bytes"].values()),
        "stack_bytes": sum(frame["bytes"] for frame in board["stack_path"]),
        "instructions": {key: counts[key] for key in ("least", "mean", "most_met")},
        "cycles": board["cycles"],
        "cycles_estimate": board["cycles_estimate"],
        "time_s": board["time_s_estimate"],
    }


def _core(board: Figures) -> str:
    """Return the first words of a board's core."""
    return re.split(r" \(|[,;]", board["core"])[0]


def footprint(controller: str) -> Callable[[Figures], str]:
    """Return what makes the table of a controller on all boards."""

    def make(figures: Figures) -> str:
        rows: list[Row] = []
        for board in figures[controller]:
            counts, time_ms = board["instructions"], [1000 * one for one in board["time_s"]]
            steps = f"{counts['least']} / {counts['mean']:.0f} / {counts['most_met']}"
            rows.append(
                {
                    "board": board["name"],
                    "core": _core(board),
                    "flash, B": str(board["flash_bytes"]),
                    "RAM, B": str(board["ram_bytes"]),
                    "stack, B": str(board["stack_bytes"]),
                    "instructions a step: least / mean / largest": steps,
                    "cycles a step": _cycles(board),
                    "ms, least to most": f"{time_ms[0]:.3g}..{time_ms[1]:.3g}",
                    "budget": "fits" if board["fits"] else "OVER",
                }
            )
        return table(rows)

    return make


def _cycles(board: Figures) -> str:
    """Return the modelled cycles, or one estimated number, as `footprint` prints them."""
    cycles = board["cycles"]
    if cycles is None:
        return f"about {sum(board['cycles_estimate']) / 2:.0f}"
    return f"{cycles['least']} / {cycles['mean']:.0f} / {cycles['most_met']}"


def footprint_scalars(figures: Figures) -> str:
    """Return the mean instructions of `mambo` in float32 and in fixed point, and the sizes of the latter."""
    rows: list[Row] = []
    for plain, fixed in zip(figures["mambo"], figures["mambo --scalar fixed"], strict=True):
        rows.append(
            {
                "board": plain["name"],
                "core": _core(plain),
                "float32": f"{plain['instructions']['mean']:,.0f}",
                "fixed": f"{fixed['instructions']['mean']:,.0f}",
                "flash of fixed, B": f"{fixed['flash_bytes']:,}",
                "RAM, B": str(fixed["ram_bytes"]),
                "stack, B": str(fixed["stack_bytes"]),
            }
        )
    return table(rows)


def compilers(figures: Figures) -> str:
    """Return the boards' compilers, a line each."""
    found = {board["compiler"]: None for boards in figures.values() for board in boards}
    return "\n".join(f"- {one}" for one in sorted(found))


_COMPARED: Final = ("course", "fault", "largest_error_m")
_SHOWN: Final = (
    *(*_COMPARED, "turning", "statuses", "largest_command_rad", "largest_tilt_rad"),
    *("band_m", "saturated_share", "recovery_s", "end"),
)


def read_faults(folders: Mapping[str, str]) -> Callable[[Path], Figures]:
    """Return what reads the flights of `faults`: of the first controller in full, of the others the errors.

    `folders` are those of the results, by controller.
    """
    return lambda results: {
        name: [
            {key: flight[key] for key in (_COMPARED if number else _SHOWN)}
            for flight in summary(results / folder)["flights"]
        ]
        for number, (name, folder) in enumerate(folders.items())
    }


def faults(controller: str) -> Callable[[Figures], str]:
    """Return what makes the table of all faults with a controller; a cell has the worse of both courses."""

    def make(figures: Figures) -> str:
        rows: list[Row] = []
        for fault, pair in _by_fault(figures[controller]).items():
            flights = list(pair.values())
            seen = {status for flight in flights for status in flight["statuses"]}
            row = {
                "fault": fault,
                "status": ", ".join(name for name in STATUS_NAMES.values() if name in seen),
                "command, rad": f"{max(flight['largest_command_rad'] for flight in flights):.2f}",
                "tilt, rad": f"{max(flight['largest_tilt_rad'] for flight in flights):.2f}",
                "at limit, %": f"{100 * max(flight['saturated_share'] for flight in flights):.1f}",
            }
            for course, flight in pair.items():
                back = flight["recovery_s"]
                row[f"{course}: error, m"] = f"{flight['largest_error_m']:.2f}"
                row[f"{course}: recovered after, s"] = "-" if back is None else f"{back:.1f}"
            rows.append(row | {"end": max((flight["end"] for flight in flights), key=_ENDS.index)})
        bands = {one["course"]: one["band_m"] for one in figures[controller] if not one["turning"]}
        within = ", ".join(f"{course} {1e3 * band:.2g} mm" for course, band in bands.items())
        return f"{table(rows)}\n\nBack means within: {within}."

    return make


def faults_compared(figures: Figures) -> str:
    """Return the largest error of each fault that all controllers can have, on both courses."""
    rows: list[Row] = []
    tables = {name: _by_fault(flights) for name, flights in figures.items()}
    every = list(dict.fromkeys(fault for found in tables.values() for fault in found))
    for fault in every:
        row = {"largest error, m": fault}
        for name, found in tables.items():
            for course, flight in found.get(fault, {}).items():
                row[f"{_TITLES[name]}: {course}"] = f"{flight['largest_error_m']:.2f}"
        if len(row) == 1 + 2 * len(tables):
            rows.append(row)
    return table(rows)


_TITLES: Final = {
    "mambo": "`mambo`",
    "mambo-1norm": "`mambo-1norm`",
    "benchmarks/evidence/one-norm.toml": "1-norm without tracker",
}


def _by_fault(flights: list[Figures]) -> dict[str, dict[str, Any]]:
    """Return the flights by fault and course."""
    found: dict[str, dict[str, Any]] = {}
    for flight in flights:
        found.setdefault(flight["fault"], {})[flight["course"]] = flight
    return found
