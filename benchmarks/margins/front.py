"""Settings around preset mambo: what they fly, and what they stand.

    python -m benchmarks.margins.front FOLDER

writes flights and margins into the folder, with the picture of the manual; 20 min on a core. Seeds are of no
other campaign. It continues where it was stopped.
"""

import json
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from benchmarks.margins.flights import BATCH, FREQUENCIES, campaigns, settings_of
from benchmarks.margins.report import RINGING_RAD
from benchmarks.markdown import table
from mambo_codegen.settings.model import Settings
from mambo_sil.experiment.campaign.campaign_file import Campaign, scenario
from mambo_sil.experiment.campaign.campaign_flights import fly_scenarios
from mambo_sil.experiment.inputs import Entrant
from mambo_sil.experiment.margins.axis_margins import measure_loops
from mambo_sil.experiment.margins.hover_loop import hover_loops
from mambo_sil.experiment.margins.margins_run import MarginSubject, axes_on
from mambo_sil.flight.scenario import flight_of
from mambo_sil.results.pictures import save
from mambo_sil.results.style import BLUE, PAGE_INCHES, SMALL, VERMILION, add_headline, style

FILE: Final = "front.jsonl"
SEEDS: Final = {"default": 70_001, "slow": 70_002}
FLIGHTS: Final = {"default": 150, "slow": 100}
MEASURED: Final = {"default": 30, "slow": 30}
"""Drones whose margins are measured."""

RESPONSE, WEIGHT = "cost.response_time_s", "cost.velocity_weight_s"
ROLL, PITCH = "damping.roll_rate_feedback_s", "damping.pitch_rate_feedback_s"
ACCELERATION, VELOCITY = "observer.acceleration_noise", "observer.velocity_noise"
CHANGES: Final[tuple[dict[str, float], ...]] = (
    {},
    {VELOCITY: 0.08, ROLL: 0.06},
    {ACCELERATION: 0.15, ROLL: 0.06},
    {VELOCITY: 0.065, ROLL: 0.06},
    {VELOCITY: 0.065},
    {VELOCITY: 0.08},
    {VELOCITY: 0.08, RESPONSE: 0.185},
    {VELOCITY: 0.065, RESPONSE: 0.2},
    {RESPONSE: 0.23},
    {ROLL: 0.0},
    {WEIGHT: 0.4, ROLL: 0.03},
    {PITCH: 0.02},
    {VELOCITY: 0.08, RESPONSE: 0.2},
)
"""Settings that differ from those of preset mambo."""


def own_campaigns() -> dict[str, Campaign]:
    """Return the default campaign and that of slow motors, with seeds of their own."""
    return {
        name: replace(one, file=one.file.model_copy(update={"seed": SEEDS[name]}))
        for name, one in campaigns().items()
    }


def measure(folder: Path) -> None:
    """Fly and measure the settings that are not in the folder's file yet."""
    folder.mkdir(parents=True, exist_ok=True)
    done = [row["change"] for row in read(folder)]
    drawn = own_campaigns()
    for change in (one for one in CHANGES if one not in done):
        row = {"change": change} | {
            name: _judge(settings_of(change), one, FLIGHTS[name], MEASURED[name])
            for name, one in drawn.items()
        }
        nominal = axes_on(MarginSubject("", settings_of(change), drawn["default"].drone))
        row["nominal"] = [axis.model_dump(mode="json") for axis in nominal or ()]
        with (folder / FILE).open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        print(change, row["default"], row["slow"], flush=True)


def read(folder: Path) -> list[dict[str, Any]]:
    """Return what was flown and measured."""
    file = folder / FILE
    lines = file.read_text("utf-8").splitlines() if file.exists() else []
    return [json.loads(line) for line in lines]


def _judge(settings: Settings, campaign: Campaign, flights: int, measured: int) -> dict[str, Any]:
    """Return what drawn drones fly with settings, and what their loops through the sensors stand."""
    rows: list[dict[str, Any]] = []
    damping: list[float] = []
    for first in range(0, flights, BATCH):
        scenarios = [scenario(campaign.flight, campaign.draw(n)) for n in range(first, first + BATCH)]
        rows += fly_scenarios([Entrant("c", "nmpc", settings)], scenarios)
        if first < measured:
            flight = flight_of(scenarios, settings.horizon.update_period_s)
            for loops in hover_loops(settings, flight):
                axes = measure_loops(loops, flight, count=FREQUENCIES)
                damping.append(min(axis.poles.least_damping for axis in axes))
    crashed = np.array([row["c_crashed"] for row in rows]) > 0
    variation, seen = (
        np.where(crashed, np.inf, np.array([row[f"c_{key}"] for row in rows], np.float64))
        for key in ("command_variation_rad", "seen_iae_m_s")
    )
    return {
        "crashed": int(crashed.sum()),
        "ring": int((variation > RINGING_RAD).sum()),
        "seen_median_m_s": _quantile(seen, 0.5),
        "seen_95_m_s": _quantile(seen, 0.95),
        "variation_median_rad": _quantile(variation, 0.5),
        "variation_95_rad": _quantile(variation, 0.95),
        "unstable": int(np.sum(np.array(damping) < 0.0)),
        "damping_median": float(np.median(damping)),
        "damping_worst_tenth": _quantile(np.array(damping), 0.1),
    }


def _quantile(values: Any, share: float) -> float:
    return float(np.quantile(np.minimum(values, 1e9), share, method="inverted_cdf"))


def name_of(change: dict[str, float]) -> str:
    """Return how tables name settings."""
    return (
        ", ".join(f"{key.partition('.')[2]} {value:g}" for key, value in change.items()) or "preset `mambo`"
    )


def front_table(figures: Mapping[str, Any]) -> str:
    """Return a row for each of the settings."""
    found = []
    for number, row in enumerate(figures["rows"]):
        default, slow, (roll, pitch) = row["default"], row["slow"], row["nominal"]
        found.append(
            {
                "number, changed": f"{number}, {name_of(row['change'])}",
                "estimated error, m s: median, 95 %": _pair(default, "seen_{}_m_s", ".3g"),
                "variation, rad: median, 95 %": _pair(default, "variation_{}_rad", ".2g"),
                "ring": str(default["ring"]),
                "slow motors: estimated error": _pair(slow, "seen_{}_m_s", ".3g"),
                "slow: crashed, ring": f"{slow['crashed']}, {slow['ring']}",
                "slow: least damping, median, worst tenth": f"{slow['damping_median']:.3f}, "
                f"{slow['damping_worst_tenth']:.3f}",
                "true state, Ms at the command": f"{roll['command']['sensitivity']:.2f}, "
                f"{pitch['command']['sensitivity']:.2f}",
            }
        )
    return table(found)


def _pair(found: dict[str, Any], key: str, form: str) -> str:
    values = (found[key.format(share)] for share in ("median", "95"))
    return ", ".join("crashed" if value >= 1e9 else format(value, form) for value in values)


def draw(rows: list[dict[str, Any]], stem: Path) -> None:
    """Draw damping and ringing of drones with slow motors over the error and the variation of the others."""
    panels = (
        ("seen_median_m_s", "estimated error, median, m s", "damping_worst_tenth"),
        ("variation_95_rad", "command variation, 95 %, rad", "ring"),
    )
    names = (
        "slow motors: least damping\nof the worst tenth, through the sensors",
        "slow motors: drones of 100 that ring",
    )
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 3.4), layout="constrained")
        for axes, (key, label, slow), name in zip(figure.subplots(1, 2), panels, names, strict=True):
            for number, row in enumerate(rows):
                shipped = not row["change"]
                x, y = row["default"][key], row["slow"][slow]
                look = (VERMILION, "D") if shipped else (BLUE, "o")
                axes.plot([x], [y], color=look[0], marker=look[1], linestyle="none")
                text = "mambo" if shipped else str(number)
                beside = (-32, 3) if shipped else (3, 3)
                axes.annotate(text, (x, y), beside, textcoords="offset points", fontsize=SMALL)
            axes.set(xlabel=label, ylabel=name)
            if key.startswith("variation"):
                axes.set_xscale("log")
                axes.set_xticks([0.003, 0.01, 0.03], ["0.003", "0.01", "0.03"])
                axes.xaxis.set_minor_locator(NullLocator())
        add_headline(
            figure,
            "Less error costs damping where motors are slow",
            "150 random drones of the default campaign, 100 with slow motors; numbers: rows of the table. "
            "Better: above left, below left",
        )
        save(figure, stem)


def main(folder: Path) -> None:
    """Fly, measure, and draw."""
    measure(folder)
    draw(read(folder), folder / "margin-front")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
