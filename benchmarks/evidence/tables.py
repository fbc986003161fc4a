"""Tables of Table II and of suites: figures out of results, and Markdown out of figures."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

from benchmarks.evidence.item import Figures
from benchmarks.markdown import table
from mambo_sil.experiment.table2.table2 import CASES, INDICES, PRINTED_IMPROVEMENT, PRINTED_NMPC, PRINTED_PD
from mambo_sil.flight.names import PD, PD_NAMES, PD_TITLES
from mambo_sil.results.number_format import digits, three_digits
from mambo_sil.results.summary import Number

Row = dict[str, str]

CONTROLLERS: Final = ("pd", "pd-feedforward", "mambo", "mambo-1norm", "table1")


def title(name: str) -> str:
    """Return how tables name a controller: presets as code, laws without a model in words."""
    names = {
        "pd": "PD",
        "pd-feedforward": "PD with feed-forward",
        "pid-feedforward": "PID with feed-forward",
    }
    names |= {PD_TITLES[pd]: names[pd] for pd in PD_NAMES}
    return names.get(name, f"`{name}`")


def summary(folder: Path) -> Figures:
    """Return the record of a command."""
    found: Figures = json.loads((folder / "summary.json").read_text("utf-8"))
    return found


def read_figures(*folders: str) -> Callable[[Path], Figures]:
    """Return what reads the figures.json that a measurement wrote in each of `folders`, as one."""
    return lambda results: {
        name: found
        for folder in folders
        for name, found in json.loads((results / folder / "figures.json").read_text("utf-8")).items()
    }


def three(value: Number | None) -> str:
    """Format a value with three digits; null is what a lost flight has."""
    return "crashed" if value is None else three_digits(value)


def slashed(values: Iterable[Number]) -> str:
    """Format values with three digits, separated by slashes."""
    return " / ".join(map(three_digits, values))


# Table II


def read_table2(results: Path) -> Figures:
    """Return the rows of Table II by case."""
    rows = summary(results / "table2")["rows"]
    return {case: [row for row in rows if row["case"] == case] for case in CASES}


def table2(figures: Figures) -> str:
    """Return the Table II case: what the paper prints, and what flies."""
    (case, *_), ratios, varied = CASES, "improvement", "variation, rad"
    first = f"{case.replace(' 0.5', ', 0.5')}"
    printed: list[Row] = []
    for name, values, factors in (("PD", PRINTED_PD, ()), ("NMPC", PRINTED_NMPC, PRINTED_IMPROVEMENT)):
        cells = dict(zip(INDICES, map(digits, values), strict=True))
        over = " / ".join(map(str, factors))
        printed.append({first: f"{name}, printed", **cells, ratios: over, varied: ""})
    flown: list[Row] = []
    for row in figures[case]:
        number = digits if row["controller"] == PD else three_digits
        cells = dict(zip(INDICES, map(number, row["measured"]), strict=True))
        over, variation = slashed(row["improvement"] or ()), f"{row['command_variation_rad']:.4f}"
        flown.append({first: f"{title(row['controller'])}, flown", **cells, ratios: over, varied: variation})
    pds = len(PD_NAMES)
    return table([printed[0], *flown[:pds], printed[1], *flown[pds:]])


def table2_quarter(figures: Figures) -> str:
    """Return the cases that the paper's text may mean."""
    rows = [
        {"controller": title(row["controller"]), "curve": case.split()[0]}
        | dict(zip(INDICES, map(three_digits, row["measured"]), strict=True))
        for case, found in list(figures.items())[1:]
        for row in found
        if row["controller"] != "table1-printed"
    ]
    return table(sorted(rows, key=lambda row: [one["controller"] for one in rows].index(row["controller"])))


# The Table II case through sensors


def read_printed(results: Path) -> Figures:
    """Return the Markdown table that the only command prints, its columns by title."""
    lines = (results / "printed-0.txt").read_text("utf-8").splitlines()
    cells = [
        [cell.strip() for cell in line.strip("| ").split(" | ")] for line in lines if line.startswith("|")
    ]
    head, _, *rows = cells
    return {"rows": [dict(zip(head, row, strict=True)) for row in rows]}


def printed(figures: Figures) -> str:
    """Return a table that was printed."""
    return table(figures["rows"])


def read_sensors(results: Path) -> Figures:
    """Return the rows of `table2 --sensors`."""
    return {"rows": summary(results / "sensors")["rows"]}


def sensors(figures: Figures) -> str:
    """Return the rows of the Table II case with sensors."""
    return table(
        [
            {
                "controller": title(row["controller"]),
                "sees": row["view"],
                "flights": str(row["flights"]) + (f", {row['lost']} lost" if row["lost"] else ""),
                **dict(zip(INDICES, map(digits, row["tracked"]), strict=True)),
                "worst IAE": digits(row["worst_iae_m_s"]),
                "IAE as estimated": digits(row["seen"][0]),
                "drift, m": digits(row["drift_m"]),
            }
            for row in figures["rows"]
        ]
    )


# The Table II case under other conditions

_CONDITIONS: Final = {
    "table2": "Table II case",
    "yaw": "yaw 0.8 rad",
    "push-x": "push 0.5 m/s^2 along x",
    "push-y": "push 0.5 m/s^2 along y",
    "motor-lag": "motor lag 0.03 s",
    "circle": "circle of 1 m at 1 rad/s",
    "fast-circle": "circle of 1 m at 1.5 rad/s",
    "step-2m": "step of 2 m, 20 s",
    "sensors": "Table II case through sensors",
}


def read_suite(names: Sequence[str]) -> Callable[[Path], Figures]:
    """Return what reads the flights of `regress`, whose results are in the folders `names`."""
    return lambda results: {
        name: [_flight(flight) for flight in summary(results / name)["flights"]] for name in names
    }


def _flight(flight: Figures) -> Figures:
    """Return what tables show of a flight of a suite."""
    return {
        "group": flight["group"],
        "failed": not all(check["holds"] for check in flight["checks"]),
        "iae_m_s": flight["metrics"]["iae_m_s"],
        "command_variation_rad": flight["metrics"]["command_variation_rad"],
    }


def conditions(titles: Mapping[str, str]) -> Callable[[Figures], str]:
    """Return what makes the table of IAE and variation of each flight, of the controllers with `titles`."""

    def make(figures: Figures) -> str:
        rows: list[Row] = []
        for group, words in _CONDITIONS.items():
            row = {"IAE, m s (variation, rad)": words}
            for name, head in titles.items():
                flight = next(flight for flight in figures[name] if flight["group"] == group)
                row[head] = f"{three(flight['iae_m_s'])} ({flight['command_variation_rad']:.4f})"
            rows.append(row)
        return table(rows)

    return make


def vehicles(figures: Figures) -> str:
    """Return IAE and command variation with each drone, seen truly and through its sensors, by controller."""
    rows: list[Row] = []
    for group in dict.fromkeys(flight["group"] for flight in next(iter(figures.values()))):
        drone = group.removesuffix("-sensors")
        row = {"vehicle": f"`{drone}`", "sees": "the truth" if group == drone else "its sensors"}
        for name, flights in figures.items():
            flight = next(flight for flight in flights if flight["group"] == group)
            row[title(name)] = f"{three(flight['iae_m_s'])} ({flight['command_variation_rad']:.4f})"
        rows.append(row)
    return table(rows)


def spread(figures: Figures) -> str:
    """Return median and range of the IAE in float32 from twelve starts."""
    rows: list[Row] = []
    for found in figures["rows"]:
        chosen = {key: cell for key, cell in found.items() if not key.endswith((" float64", " fixed"))}
        rows.append(
            {
                key if key == "IAE, m s" else title(key.removesuffix(" float32")): cell
                for key, cell in chosen.items()
            }
        )
    return table(rows)


# The suite envelope


def read_envelope(results: Path) -> Figures:
    """Return by controller and group how many flights there are, and how many exceed a bound."""
    return {
        name: {
            group: {"flights": len(found), "failed": sum(flight["failed"] for flight in found)}
            for group, found in _by_group(flights).items()
        }
        for name, flights in read_suite(CONTROLLERS)(results).items()
    }


def _by_group(flights: Sequence[Figures]) -> dict[str, list[Figures]]:
    groups: dict[str, list[Figures]] = {}
    for flight in flights:
        groups.setdefault(flight["group"], []).append(flight)
    return groups


def envelope(figures: Figures) -> str:
    """Return how many flights of each group exceed a bound, by controller."""
    head = "flights that exceed a bound"
    rows: list[Row] = [{head: group} for group in next(iter(figures.values()))] + [{head: "all"}]
    for name, groups in figures.items():
        whole = {key: sum(group[key] for group in groups.values()) for key in ("flights", "failed")}
        for row, group in zip(rows, (*groups.values(), whole), strict=True):
            row[title(name)] = f"{group['failed']} of {group['flights']}"
    return table(rows)
