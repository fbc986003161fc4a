"""Tables of the flights of the Crazyflie's firmware on the desk."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from benchmarks.evidence.item import Figures
from benchmarks.evidence.tables import Row, summary
from benchmarks.markdown import table
from mambo_sil.results.number_format import three_digits

TITLES: Final = {
    "crazyflie": "app, preset `crazyflie`",
    "design": "app, `design crazyflie`",
    "mellinger": "Mellinger",
    "lee": "Lee",
    "brescianini": "Brescianini",
    "pid": "PID",
    "indi": "INDI",
}


def read_firmware(results: Path) -> Figures:
    """Return the record of all flights."""
    return summary(results / "flights")


def _mean(values: Sequence[float | None]) -> str:
    """Return the mean of nine flights; null is a flight in which it never happened."""
    found = [value for value in values if value is not None]
    return three_digits(sum(found) / len(found)) if len(found) == len(values) else "never"


def _ranged(values: Sequence[float]) -> str:
    """Return mean and range."""
    return f"{_mean(values)} [{three_digits(min(values))} to {three_digits(max(values))}]"


def _crashed(flights: Figures) -> str:
    return f", {flights['crashed']} crashed" if flights["crashed"] else ""


def curves(figures: Figures) -> str:
    """Return the IAE on each curve, and measures of the step, of every controller."""
    heads = {
        "eight": "eight, 2 m, 0.5 rad/s",
        "circle": "circle, 1 m, 1.5 rad/s",
        "small circle": "circle, 0.6 m, 2.2 rad/s",
        "fast eight": "eight, 2 m, 0.8 rad/s",
    }
    rows: list[Row] = []
    for name, title in TITLES.items():
        flights = {curve: figures["curves"][curve][name] for curve in (*heads, "step")}
        step = flights["step"]
        rows.append(
            {
                "IAE, m s": title,
                **{heads[key]: _ranged(flights[key]["iae_m_s"]) + _crashed(flights[key]) for key in heads},
                "step of 1 m: IAE; settled, s; past, m": "; ".join(
                    _mean(step[key]) for key in ("iae_m_s", "settled_s", "past_m")
                ),
                "motors": _mean(flights["eight"]["busy"]),
            }
        )
    return table(rows)


def _by_row(part: str, head: str, cell: Callable[[Figures], str]) -> Callable[[Figures], str]:
    """Return what makes a table with a row a flight and a column a controller."""

    def make(figures: Figures) -> str:
        return table(
            [
                {head: title} | {TITLES.get(name, name): cell(flights) for name, flights in found.items()}
                for title, found in figures[part].items()
            ]
        )

    return make


set_points: Final = _by_row(
    "set_points",
    "largest error, m (motors)",
    lambda flights: f"{_mean(flights['largest_m'])} ({_mean(flights['busy'])})" + _crashed(flights),
)
conditions: Final = _by_row(
    "conditions", "IAE, m s", lambda flights: _ranged(flights["iae_m_s"]) + _crashed(flights)
)
clocks: Final = _by_row("clocks", "IAE, m s", lambda flights: _ranged(flights["iae_m_s"]))

_EVENTS: Final = (
    *(
        (f"fence at 3 m, target at {s:g} m/s: largest x, m", f"wall {s:.1f}", "largest_x_m")
        for s in (1, 2, 3)
    ),
    ("fence switched on at its wall, at 2 m/s: largest x, m", "fence switched on", "largest_x_m"),
    ("set-point 10 m away: speed, m/s", "far", "speed_m_s"),
    ("- past it, m", "far", "past_m"),
    ("- with `nmpc.braking` = 3: past it, m", "far, braking 3", "past_m"),
    ("camera lost on the circle: told after, s", "camera", "told_s"),
    ("- 12 s later: moved, m", "camera", "moved_m"),
    ("- height, m", "camera", "height_m"),
    ("radio lost on the circle: moved until the motors stop, m", "radio", "moved_m"),
    ("on the floor, set-point 2 m to the side: angle, degrees", "aside", "floor_deg"),
    ("height of a set-point is not a number, 0.3 s: lowest, m", "not a number", "lowest_m"),
    ("`go_to` of 2.2 m in 3 s: largest error, m", "go to", "largest_m"),
    ("turns of 90 degrees on the circle: largest error, m", "turns", "largest_m"),
)
_HEIGHTS: Final = (
    ("take-off to 1.1 m in 2 s: behind by, m", "heights", "late_m"),
    ("from `go_to` to full-state set-points and back: sag, m", "heights", "sag_m"),
    ("height that swings by 0.3 m at 1 rad/s: rms, m", "heights", "swing_rms_m"),
)


def _met(rows: Sequence[tuple[str, str, str]]) -> Callable[[Figures], str]:
    """Return what makes a table of measures of events."""

    def make(figures: Figures) -> str:
        made: list[Row] = []
        for title, event, measure in rows:
            found = figures["events"][event]
            made.append({"": title} | {TITLES[name]: _mean(one[measure]) for name, one in found.items()})
        return table(made)

    return make


met: Final = _met(_EVENTS)
heights: Final = _met(_HEIGHTS)


def replays(figures: Figures) -> str:
    """Return how many commands of a log a replay repeats."""
    return table(
        [
            {"": TITLES[name], "equal in every bit": f"{found['equal']} of {found['steps']} commands"}
            for name, found in figures["replay"].items()
        ]
    )
