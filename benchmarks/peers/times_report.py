"""Table and plot of `benchmarks/peers/times.py`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from benchmarks.markdown import table
from benchmarks.peers.programs import Program
from mambo_sil.results.pictures import save
from mambo_sil.results.style import BLUE, ORANGE, PAGE_INCHES, QUIET, THIN, style

FLAGS: Final = ("-O2", "-O3 -march=native")
SETS: Final = ("W", "T", "F", "C")
COLD: Final = "C, cold"
OURS: Final = "ours"
"""The row that the others are compared with."""
_COLOURS: Final = {"ours": BLUE, "others, 1-norm": ORANGE, "others, quadratic": QUIET}
_MARKERS: Final = {"W": "o", "T": "s", "F": "^", "C": "D"}


Timing = dict[str, NDArray[Any]]
"""Time of an update in ns by set of states, and along C with cold caches: median and 99th percentile."""


@dataclass(frozen=True)
class Row:
    """Results of a contender: cells of the table of memory, and times by flags.

    `absent` is the reason if nothing was measured.
    """

    program: Program
    versions: dict[str, str] = field(default_factory=dict)
    memory: dict[str, str] = field(default_factory=dict)
    times: dict[str, Timing] = field(default_factory=dict)
    absent: str = ""

    def ratio(self, other: "Row", flags: str, name: str) -> float:
        """Return the ratio of the median times in the set `name`."""
        return float(self.times[flags][name][0] / other.times[flags][name][0])


def _range(ratios: list[float]) -> str:
    low, high = (f"{value:,.0f}" if value >= 10 else f"{value:.2g}" for value in (min(ratios), max(ratios)))
    return low if low == high else f"{low} to {high}"


def _times_table(rows: list[Row], flags: str) -> str:
    ours = next(row for row in rows if row.program.name == OURS)
    lines = []
    for row in rows:
        line = {"contender": row.program.title, "cost": row.program.cost, "scalar": row.program.scalar}
        if row.absent:
            line["W"] = f"not measured: {row.absent}"
        else:
            times = row.times[flags]
            line |= {name: f"{times[name][0]:,.0f} / {times[name][1]:,.0f}" for name in SETS}
            line[COLD] = f"{times[COLD][0]:,.0f}"
            line["times ours"] = _range([row.ratio(ours, flags, name) for name in SETS])
        lines.append(line)
    return table(lines)


def write_report(rows: list[Row], machine: str, empty: Timing, folder: Path) -> str:
    """Write times.md, times.png and times.svg into `folder`; returns the Markdown."""
    folder.mkdir(parents=True, exist_ok=True)
    parts = [machine]
    for flags in FLAGS:
        parts += [f"`{flags}`, ns per update, median / 99th percentile:", _times_table(rows, flags)]
    parts += ["Largest tilt planned, and memory (bytes, x86-64, `-O2`):"]
    parts += [table([row.memory for row in rows if row.memory])]
    versions: dict[str, str] = {}
    for row in rows:
        versions |= row.versions
    parts += [
        "Clock and call, subtracted: "
        f"{empty['C'][0]:.0f} ns, cold {empty[COLD][0]:.0f} ns. "
        f"Versions: {', '.join(f'{name} {version}' for name, version in versions.items())}."
    ]
    text = "\n\n".join(parts)
    (folder / "times.md").write_text(f"{text}\n", "utf-8")
    _draw([row for row in rows if row.times], folder / "times")
    return text


def _draw(rows: list[Row], stem: Path) -> None:
    """Draw a panel for each build: a row for each contender, a marker for each set, a common time axis."""
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 0.24 * len(rows) + 1.3), layout="constrained")
        panels = figure.subplots(1, len(FLAGS), sharey=True, sharex=True)
        for axes, flags in zip(panels, FLAGS, strict=True):
            _draw_panel(axes, rows, flags)
            axes.set_title(flags)
        panels[0].set_yticks(range(len(rows)), [row.program.title for row in rows])
        panels[0].invert_yaxis()
        handles, _ = panels[0].get_legend_handles_labels()
        patches = [Patch(color=colour, label=kind) for kind, colour in _COLOURS.items()]
        figure.legend(handles=[*patches, *handles], loc="outside lower center", ncols=4)
        save(figure, stem)


def _draw_panel(axes: Axes, rows: list[Row], flags: str) -> None:
    for place, row in enumerate(rows):
        group = row.program.cost.partition(",")[0]
        kind = "ours" if row.program.name.startswith(OURS) else f"others, {group}"
        colour, times = _COLOURS[kind], row.times[flags]
        for name, marker in _MARKERS.items():
            median, most = times[name]
            axes.plot([median, most], [place, place], color=colour, linewidth=THIN, alpha=0.5)
            label = f"set {name}" if place == 0 else None
            axes.plot(median, place, marker, color=colour, linestyle="none", label=label)
        label = "C, cold caches" if place == 0 else None
        axes.plot(times[COLD][0], place, "x", color=colour, linestyle="none", label=label)
    axes.set_xscale("log")
    axes.set_xlabel("ns per update: median, and line to the 99th percentile")
