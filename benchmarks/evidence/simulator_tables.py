"""Tables of the flights in crazyflow and RotorPy."""

import json
import statistics
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from benchmarks.evidence.item import Figures
from benchmarks.evidence.tables import Row
from benchmarks.markdown import table
from benchmarks.simulators.missions import MISSIONS
from mambo_sil.results.number_format import three_digits

SIMULATORS: Final = ("crazyflow", "rotorpy")
LARGEST_IS_BEST: Final = ("heading", "payload")
"""Missions whose score is a height."""
UNREST_IN: Final = "eight"
"""The mission of which a table shows how much the command changes."""
L250: Final = ("cf2x_L250, first principles", "cf2x_L250, fitted")
PRESET: Final = "ours, preset `crazyflie`"
NEAREST: Final = "ours, `design` of the nearest drone"
BOUNDLESS: Final = "the same without limits"
FOUND: Final = "ours, `identify`, then `design`"
FOUND_BOUNDLESS: Final = "identified, without limits"
OURS: Final = (PRESET, "ours, `design crazyflie`", NEAREST, FOUND)
"""The four ways to make the C, as a user does."""
VARIANTS: Final = ("ours", "the same", "identified")
"""How the titles of ours begin, with those that show what a part is worth."""
AIMS: Final = (
    ("eight: RMSE, mm; `design crazyflie-l250`", "eight", NEAREST, ("6", "10")),
    ("eight; identified", "eight", FOUND, ("2.0", "1.8")),
    ("circle: RMSE, mm; `design crazyflie-l250`", "circle", NEAREST, ("15", "20")),
    ("circle; identified", "circle", FOUND, ("4.0", "4.4")),
    (
        "step of 1 m: within 5 cm, s; `design crazyflie-l250` without limits",
        "step",
        BOUNDLESS,
        ("1.0", "1.0"),
    ),
    ("step; identified, without limits", "step", FOUND_BOUNDLESS, ("1.0", "1.0")),
    ("step; identified, with limits", "step", FOUND, ("1.05", "1.05")),
    (
        "eight, heading by 2 rad: least height, m; `design crazyflie-l250`",
        "heading",
        NEAREST,
        ("0.85", "0.85"),
    ),
)
"""Title, mission, controller, and the aim from first principles and fitted."""
Cell = Mapping[str, Any]


def read_simulators(results: Path) -> Figures:
    """Return the scores by simulated drone, controller and mission; the unrest of one mission only."""
    found: Figures = {}
    for name in SIMULATORS:
        found |= json.loads((results / name / "figures.json").read_text("utf-8"))
    for challengers in found.values():
        for cells in challengers.values():
            for mission, cell in cells.items():
                if mission != UNREST_IN:
                    del cell["unrest_rad"]
    return found


def median(cell: Cell) -> float | None:
    """Return the median over the seeds; None if half of them or more crashed or never arrived."""
    scores = [float("inf") if score is None else score for score in cell["noise"]]
    found = statistics.median(scores)
    return found if found < float("inf") else None


def through_noise(figures: Figures) -> str:
    """Return medians over the seeds, and the least and the largest."""
    return _by_drone(figures, median, _spread)


def with_truth(figures: Figures) -> str:
    """Return the scores with true states."""
    return _by_drone(figures, lambda cell: cell["truth"], lambda cell: _number(cell["truth"]))


def _by_drone(figures: Figures, key: Callable[[Cell], float | None], text: Callable[[Cell], str]) -> str:
    """Return a row for each controller, below one with the name of the drone; the best are bold."""
    rows: list[Row] = []
    for drone, challengers in figures.items():
        rows.append({"": f"**{drone}**"} | dict.fromkeys((each.title for each in MISSIONS.values()), ""))
        best = {name: _best(name, [key(cells[name]) for cells in challengers.values()]) for name in MISSIONS}
        for title, cells in challengers.items():
            row = {"": title}
            for name, mission in MISSIONS.items():
                cell = text(cells[name])
                row[mission.title] = f"**{cell}**" if key(cells[name]) == best[name] else cell
            rows.append(row)
    return table(rows)


def _best(mission: str, scores: Sequence[float | None]) -> float | None:
    known = [score for score in scores if score is not None]
    choose = max if mission in LARGEST_IS_BEST else min
    return choose(known) if known else -1.0


def _number(score: float | None) -> str:
    return "lost" if score is None else three_digits(score)


def _spread(cell: Cell) -> str:
    """Return median, least and largest; how many were lost, if any."""
    known = [score for score in cell["noise"] if score is not None]
    if not known:
        return "lost"
    lost = len(cell["noise"]) - len(known)
    ends = f"{three_digits(min(known))}..{three_digits(max(known))}" + (f", {lost} lost" if lost else "")
    return f"{_number(median(cell))} ({ends})"


def unrest(figures: Figures) -> str:
    """Return the mean change of a command of roll or pitch in one step, through noise on the eight."""
    titles = list(dict.fromkeys(title for challengers in figures.values() for title in challengers))
    rows = []
    for title in titles:
        row = {"change of a command in 10 ms, mrad": title}
        for drone, challengers in figures.items():
            cells = challengers.get(title)
            row[drone] = three_digits(1e3 * cells[UNREST_IN]["unrest_rad"]) if cells else "-"
        rows.append(row)
    return table(rows)


def aims(figures: Figures) -> str:
    """Return the figures of cf2x_L250 that were aimed at, through noise, beside the aims."""
    rows: list[Row] = []
    for title, mission, challenger, aimed in AIMS:
        row = {"cf2x_L250, through noise": title}
        for drone, aim in zip(L250, aimed, strict=True):
            model = drone.partition(", ")[2]
            row |= {f"{model}: aim": aim, model: _number(median(figures[drone][challenger][mission]))}
        rows.append(row)
    return table(rows)


def summary(figures: Figures) -> str:
    """Return the best of the others, and the best and the worst of ours: medians through noise."""
    rows: list[Row] = []
    for drone, challengers in figures.items():
        others = [title for title in challengers if not title.startswith(VARIANTS)]
        row = {"the best of the others; ours, from best to worst": drone}
        for name, mission in MISSIONS.items():
            theirs, ours = (
                [median(challengers[title][name]) for title in titles] for titles in (others, OURS)
            )
            best, worst = (_end(name, ours, is_best=is_best) for is_best in (True, False))
            row[mission.title] = f"{_end(name, theirs, is_best=True)}; {best}..{worst}"
        rows.append(row)
    return table(rows)


def _end(mission: str, scores: Sequence[float | None], *, is_best: bool) -> str:
    """Return the best or the worst of several scores; one that was lost is the worst."""
    known = [score for score in scores if score is not None]
    if not known or not (is_best or len(known) == len(scores)):
        return _number(None)
    return _number(max(known) if (mission in LARGEST_IS_BEST) == is_best else min(known))
