"""What the flights of `benchmarks.margins.flights` say of margins: tables, and the picture of the manual."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from scipy.stats import spearmanr

from benchmarks.evidence.item import PICTURES
from benchmarks.markdown import table
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.results.pictures import save
from mambo_sil.results.style import BLUE, DOT, PAGE_INCHES, QUIET, THIN, VERMILION, style

RINGING_RAD: Final = 0.015
"""A larger command variation is ringing: five times the median of the default campaign."""
LARGEST: Final = 1e9
"""Stands for infinity in ranks."""

FIGURES: Final[dict[str, tuple[str, str, str]]] = {
    "true state, command: gain margin": ("true", "command", "gain_up"),
    "true state, command: phase margin": ("true", "command", "phase_deg"),
    "true state, command: delay margin": ("true", "command", "delay_s"),
    "true state, command: largest sensitivity": ("true", "command", "sensitivity"),
    "true state, torque: phase margin": ("true", "motors", "phase_deg"),
    "true state, torque: delay margin": ("true", "motors", "delay_s"),
    "true state, torque: largest sensitivity": ("true", "motors", "sensitivity"),
    "true state: least damping": ("true", "poles", "least_damping"),
    "sensors, command: gain margin": ("sensed", "command", "gain_up"),
    "sensors, command: delay margin": ("sensed", "command", "delay_s"),
    "sensors, command: largest sensitivity": ("sensed", "command", "sensitivity"),
    "sensors, torque: phase margin": ("sensed", "motors", "phase_deg"),
    "sensors, torque: largest sensitivity": ("sensed", "motors", "sensitivity"),
    "sensors: least damping": ("sensed", "poles", "least_damping"),
    "sensors: growth of the quickest pole": ("sensed", "poles", "growth_1_s"),
    "sensors: change of the command by their noise": ("sensed", "axis", "sensed_variation_rad"),
}
"""Figures by what tables call them: state, place and key. Of two axes the worse counts."""
LARGER_IS_WORSE: Final = ("sensitivity", "growth_1_s", "sensed_variation_rad")


@dataclass(frozen=True, eq=False)
class DrawnDrones:
    """The drones of one campaign with one controller."""

    rows: list[dict[str, Any]]

    @property
    def crashed(self) -> FloatArray:
        """1 for a drone that crashed."""
        return np.array([row["results"]["crashed"] for row in self.rows], np.float64)

    @property
    def variation_rad(self) -> FloatArray:
        """The command variation; infinity for a drone that crashed."""
        values = [row["results"]["command_variation_rad"] for row in self.rows]
        return np.where(self.crashed > 0, np.inf, np.array(values, np.float64))

    @property
    def seen_m_s(self) -> FloatArray:
        """The IAE as the estimators see it; infinity for a drone that crashed."""
        values = np.array([row["results"]["seen_iae_m_s"] for row in self.rows], np.float64)
        return np.where(self.crashed > 0, np.inf, values)

    @property
    def unstable(self) -> FloatArray:
        """1 for a drone whose linear loop through the sensors is unstable."""
        return np.array([self._stable(row) for row in self.rows], np.float64)

    @staticmethod
    def _stable(row: dict[str, Any]) -> bool:
        return not all(axis["stable"] for axis in row["margins"]["sensed"])

    def draw(self, key: str) -> FloatArray:
        """Return what was drawn of a parameter."""
        return np.array([row["draws"][key] for row in self.rows], np.float64)

    def badness(self, state: str, place: str, key: str) -> FloatArray:
        """Return a figure of the worse axis of each drone, with the sign by which more is worse."""
        sign = 1.0 if key in LARGER_IS_WORSE else -1.0

        def of_an_axis(axis: dict[str, Any]) -> float:
            if place == "poles":
                return sign * float(axis["poles"][key])
            found = axis if place == "axis" else axis[place]
            if found is None:
                return np.inf
            value = found[key]
            return sign * (np.inf if value is None else float(value))

        worse = [max(map(of_an_axis, row["margins"][state])) for row in self.rows]
        return np.asarray(np.clip(worse, -LARGEST, LARGEST))


def read(folder: Path, campaign: str, controller: str) -> DrawnDrones:
    """Return the drones of a file of `benchmarks.margins.flights`."""
    lines = (folder / f"{campaign}-{controller}.jsonl").read_text("utf-8").splitlines()
    return DrawnDrones([json.loads(line) for line in lines])


def rank(first: FloatArray, second: FloatArray) -> float:
    """Return Spearman's rank correlation; NaN if one of them is the same for all."""
    values = [np.clip(one, -LARGEST, LARGEST) for one in (first, second)]
    if min(np.ptp(one) for one in values) == 0.0:
        return float("nan")
    return float(spearmanr(*values).statistic)


CASES: Final = (
    ("default", "mambo"),
    ("default", "no-feedback"),
    ("default", "textbook"),
    ("default", "crazyflie"),
    ("slow", "mambo"),
    ("slow", "no-feedback"),
    ("slow", "textbook"),
    ("slow", "crazyflie"),
)
RANKED: Final = (
    ("default", "mambo"),
    ("default", "textbook"),
    ("slow", "mambo"),
    ("slow", "no-feedback"),
    ("slow", "textbook"),
)
"""Cases in which some drones ring and some do not."""
CRASHING: Final = (("slow", "no-feedback"), ("slow", "textbook"), ("default", "crazyflie"))


def outcomes(found: dict[tuple[str, str], DrawnDrones]) -> Iterator[dict[str, str]]:
    """Yield what flew, and whether the linear loop through the sensors said so."""
    for (campaign, controller), one in found.items():
        rings = one.variation_rad > RINGING_RAD
        unstable = one.unstable > 0
        yield {
            "drones": f"{campaign}, {len(one.rows)}",
            "settings": controller,
            "variation, rad: median, 95 %": ", ".join(_variation(one, share) for share in (0.5, 0.95)),
            "crashed": f"{one.crashed.sum():.0f}",
            "ring or crash": str(int(rings.sum())),
            "linear loop unstable": str(int(unstable.sum())),
            "of these ring or crash": str(int((rings & unstable).sum())),
            "of the stable": str(int((rings & ~unstable).sum())),
        }


def _variation(one: DrawnDrones, share: float) -> str:
    value = float(np.quantile(np.minimum(one.variation_rad, LARGEST), share, method="inverted_cdf"))
    return "crashed" if value == LARGEST else f"{value:.2g}"


def ranks(found: dict[tuple[str, str], DrawnDrones]) -> Iterator[dict[str, str]]:
    """Yield the rank correlation of each figure, and of two draws alone, with the command variation."""
    of_each: dict[str, Callable[[DrawnDrones], FloatArray]] = {
        name: partial(DrawnDrones.badness, state=state, place=place, key=key)
        for name, (state, place, key) in FIGURES.items()
    }
    of_each |= {
        f"draw of {key} alone": partial(DrawnDrones.draw, key=key) for key in ("noise_scale", "motor_lag_s")
    }
    for name, of in of_each.items():
        cells = {
            f"{case[1]}, {case[0]}": _signed(rank(of(found[case]), found[case].variation_rad))
            for case in RANKED
        }
        seen = found["default", "mambo"]
        worse = rank(of(seen), seen.seen_m_s)
        yield {"worse": name, **cells, "estimated error, mambo, default": _signed(worse)}


def _signed(value: float) -> str:
    return "all alike" if np.isnan(value) else f"{value:+.2f}"


def tenths(found: dict[tuple[str, str], DrawnDrones]) -> Iterator[dict[str, str]]:
    """Yield the share of all crashes that the tenth of the drones with the worst figure holds."""
    best = {
        f"{controller}, {campaign}": f"{100 * min(1.0, len(one.rows) / 10 / one.crashed.sum()):.0f} %"
        for (campaign, controller), one in found.items()
        if (campaign, controller) in CRASHING
    }
    yield {"worst tenth by": "(the most that a tenth can hold)", **best}
    for name, where in FIGURES.items():
        cells = {}
        for campaign, controller in CRASHING:
            one = found[campaign, controller]
            worst = np.argsort(-one.badness(*where), kind="stable")[: len(one.rows) // 10]
            alike = np.ptp(one.badness(*where)) == 0.0
            held = one.crashed[worst].sum() / one.crashed.sum()
            cells[f"{controller}, {campaign}"] = "all alike" if alike else f"{100 * held:.0f} %"
        yield {"worst tenth by": name, **cells}


def draw(found: dict[tuple[str, str], DrawnDrones], stem: Path) -> None:
    """Draw the command variation over three figures of the drones of preset mambo."""
    panels = (
        ("true state, command: largest sensitivity", "true state:\nlargest sensitivity at the command", 1.0),
        ("sensors: least damping", "through the sensors:\nleast damping", -1.0),
        (
            "sensors: change of the command by their noise",
            "through the sensors:\nchange by noise, rad (unstable: 0.1)",
            1.0,
        ),
    )
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 2.7), layout="constrained")
        for axes, (name, label, sign) in zip(figure.subplots(1, 3, sharey=True), panels, strict=True):
            for (campaign, colour, marker), words in zip(
                (("default", BLUE, "o"), ("slow", VERMILION, "D")),
                ("default campaign", "slow motors"),
                strict=True,
            ):
                one = found[campaign, "mambo"]
                x = sign * one.badness(*FIGURES[name])
                if "change" in name:
                    x = np.where(x >= LARGEST, 0.1, x)
                axes.plot(
                    x, one.variation_rad, color=colour, marker=marker, linestyle="none", markersize=DOT,
                    label=words, alpha=0.6,
                )  # fmt: skip
            axes.axhline(RINGING_RAD, color=QUIET, linewidth=THIN, linestyle=(0, (1, 2)))
            if "damping" in name:
                axes.axvline(0.0, color=QUIET, linewidth=THIN)
            axes.set_yscale("log")
            axes.set_yticks([0.003, 0.01, 0.03], ["0.003", "0.01", "0.03"])
            axes.yaxis.set_minor_locator(NullLocator())
            axes.set_xlabel(label)
            if "change" in name:
                axes.set_xscale("log")
                axes.set_xticks([0.001, 0.01, 0.1], ["0.001", "0.01", "0.1"])
        figure.axes[0].set_ylabel("command variation flown, rad")
        figure.axes[0].legend(loc="upper right", markerscale=3)
        for picture in save(figure, stem)[1:]:
            picture.unlink()  # the manual shows the PNG


def write(folder: Path) -> None:
    """Print the tables of docs/evidence/margins.md and draw its picture, from the files in a folder."""
    found = {case: read(folder, *case) for case in CASES}
    for name, rows in (("outcomes", outcomes), ("ranks", ranks), ("tenths", tenths)):
        print(f"\n{name}\n\n{table(list(rows(found)))}")
    draw(found, PICTURES / "margins.png")
