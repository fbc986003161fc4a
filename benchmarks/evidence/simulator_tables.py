"""Tables of the flights in simulators of others."""

import statistics
from collections.abc import Sequence
from typing import Final

from benchmarks.evidence.item import Figures
from benchmarks.evidence.tables import Row
from benchmarks.markdown import table
from benchmarks.simulators.missions import MISSIONS, Score
from mambo_sil.results.number_format import three_digits

SIMULATORS: Final = ("crazyflow", "rotorpy", "pybullet")
"""Those that one Python can hold; PyFlyt wants NumPy 1."""
PAGE: Final = "ours, by the page"
TITLES: Final = {name: mission.title for name, mission in MISSIONS.items()} | {"wind": "eight in wind, mm"}


def median(scores: Sequence[Score]) -> Score:
    """Return the median over the seeds; None if half of them or more crashed or never arrived."""
    found = statistics.median(float("inf") if score is None else score for score in scores)
    return found if found < float("inf") else None


def summary(figures: Figures) -> str:
    """Return a row for each simulated drone: their controller as shipped, tuned, and ours by the page."""
    rows: list[Row] = []
    for drone, controllers in figures.items():
        shipped, tuned = list(controllers)[:2]
        row = {"theirs as shipped; tuned; **ours**": f"{drone}: {shipped}"}
        for name, head in TITLES.items():
            if name in controllers[PAGE]:
                theirs, better, ours = (
                    _number(median(controllers[who][name])) for who in (shipped, tuned, PAGE)
                )
                row[head] = f"{theirs}; {better}; **{ours}**"
            else:
                row[head] = "-"
        rows.append(row)
    return table(rows)


def quick(figures: Figures) -> str:
    """Return a row for each controller on each drone, medians over the seeds."""
    return table(
        [
            {"": f"{drone}: {who}"}
            | {f"{name} rad/s, mm": _number(median(scores)) for name, scores in missions.items()}
            for drone, controllers in figures.items()
            for who, missions in controllers.items()
        ]
    )


def every_controller(figures: Figures) -> str:
    """Return medians, least and largest of each controller, below the name of the drone; best are bold."""
    rows: list[Row] = []
    for drone, controllers in figures.items():
        rows.append({"": f"**{drone}**"} | dict.fromkeys(TITLES.values(), ""))
        for who, missions in controllers.items():
            row = {"": who} | dict.fromkeys(TITLES.values(), "-")
            for name, scores in missions.items():
                known = [found for each in controllers.values() if (found := median(each[name])) is not None]
                best = bool(known) and median(scores) == min(known)
                row[TITLES[name]] = f"**{_spread(scores)}**" if best else _spread(scores)
            rows.append(row)
    return table(rows)


def one_flight(figures: Figures) -> str:
    """Return a row for each controller on each drone, of one flight without noise."""
    return table(
        [
            {"": f"{drone}: {who}"}
            | {TITLES[name]: _number(median(scores)) for name, scores in missions.items()}
            for drone, controllers in figures.items()
            for who, missions in controllers.items()
        ]
    )


def _number(score: Score) -> str:
    return "lost" if score is None else three_digits(score)


def _spread(scores: Sequence[Score]) -> str:
    """Return median, least and largest; how many were lost, if any."""
    known = [score for score in scores if score is not None]
    if not known:
        return "lost"
    lost = len(scores) - len(known)
    ends = f"{three_digits(min(known))}..{three_digits(max(known))}" + (f", {lost} lost" if lost else "")
    return f"{_number(median(scores))} ({ends})"
