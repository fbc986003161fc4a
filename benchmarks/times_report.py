"""Table, CSV file and plot of `benchmarks/times.py`."""

import csv
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from benchmarks.host_builds import Sizes
from benchmarks.markdown import table
from mambo_nmpc.sil.show.plots import style

FLAGS: Final = {
    "portable": "-O2",
    "native": "-O3 -march=native",
}
SETS: Final = ("W", "T", "F", "C")
OURS: Final = "ours"
"""The row that the others are compared with."""
_COLOURS: Final = {"ours": "#0072B2", "others, 1-norm": "#E69F00", "others, quadratic": "#7f7f7f"}
_MARKERS: Final = {"W": "o", "T": "s", "F": "^", "C": "D"}


@dataclass(frozen=True)
class Timing:
    """Time of an update in ns: median and 99th percentile by set of states, and median with cold caches."""

    hot: dict[str, tuple[float, float]]
    cold: float

    def less(self, nothing: "Timing") -> "Timing":
        """Subtract the medians of `nothing`, an empty call."""
        return Timing(
            {
                name: (median - nothing.hot[name][0], most - nothing.hot[name][0])
                for name, (median, most) in self.hot.items()
            },
            self.cold - nothing.cold,
        )


@dataclass(frozen=True)
class Row:
    """Results of a contender; `absent` is the reason if nothing was measured.

    heap_first, heap_after: heap calls in the first update, and mean of the later ones.
    above: by set, excess of the cost over the optimum, median and 99th percentile.
    """

    name: str
    title: str
    cost: str
    scalar: str
    versions: dict[str, str] = field(default_factory=dict)
    sizes: Sizes | None = None
    heap_first: int = 0
    heap_after: float = 0.0
    above: dict[str, tuple[float, float]] = field(default_factory=dict)
    tilt_rad: float = 0.0
    times: dict[str, Timing] = field(default_factory=dict)
    absent: str = ""


def _ratios(row: Row, other: Row, flags: str, sets: tuple[str, ...] = SETS) -> list[float]:
    """Return the ratio of the median times, by set."""
    return [row.times[flags].hot[name][0] / other.times[flags].hot[name][0] for name in sets]


def _range(ratios: list[float]) -> str:
    low, high = (f"{value:,.0f}" if value >= 10 else f"{value:.2g}" for value in (min(ratios), max(ratios)))
    return low if low == high else f"{low} to {high}"


def _aims_table(rows: list[Row]) -> str:
    """Compare ratios of medians with the project's aims, over all sets unless stated otherwise."""
    measured = {row.name: row for row in rows if row.times}
    ours = measured[OURS]
    peers = [row for name, row in measured.items() if not name.startswith((OURS, "mambo", "rollout"))]
    same_cost = [row for row in peers if row.cost == "1-norm"]
    head = ("ratio of medians", "aim", *(f"`{flags}`" for flags in FLAGS.values()))
    lines: list[tuple[str, ...]] = []
    for title, aim, one, others, sets in (
        ("ours over its plain roll-out", "0.33", OURS, ("rollout",), SETS),
        ("preset mambo over its plain roll-out", "0.33", "mambo", ("rollout-mambo",), SETS),
        ("ours over DAQP in float and double, F", "at most 2", OURS, ("daqp", "daqp-float64"), ("F",)),
    ):
        rivals = [measured[name] for name in others if name in measured]
        if rivals:
            found = [
                _range([ratio for row in rivals for ratio in _ratios(measured[one], row, flags, sets)])
                for flags in FLAGS
            ]
            lines.append((title, aim, *found))
    for title, aim, group in (
        ("the fastest peer over ours", "above 1", peers),
        ("the fastest peer with the 1-norm over ours", "at least 1,000", same_cost),
    ):
        if group:
            by_row = [[_ratios(row, ours, flags) for row in group] for flags in FLAGS]
            found = [_range([min(by_set) for by_set in zip(*ratios, strict=True)]) for ratios in by_row]
            lines.append((title, aim, *found))
    return table(head, lines)


def _times_table(rows: list[Row], flags: str) -> str:
    ours = next(row for row in rows if row.name == OURS)
    head = ("contender", "cost", "scalar", *SETS, "C, cold", "times ours")
    lines: list[tuple[str, ...]] = []
    for row in rows:
        start = (row.title, row.cost, row.scalar)
        if row.absent:
            lines.append((*start, f"not measured: {row.absent}", *[""] * (len(head) - 4)))
            continue
        timing = row.times[flags]
        cells = tuple(f"{timing.hot[name][0]:,.0f} / {timing.hot[name][1]:,.0f}" for name in SETS)
        lines.append((*start, *cells, f"{timing.cold:,.0f}", _range(_ratios(row, ours, flags))))
    return table(head, lines)


def _quality_table(rows: list[Row]) -> str:
    head = ("contender", "above the optimum, W", "along C", "largest tilt", "code", "RAM", "heap")
    lines: list[tuple[str, ...]] = []
    for row in rows:
        if row.sizes is None:
            continue
        shares = (
            f"{100 * row.above[name][0]:.2f} / {100 * row.above[name][1]:.2f} %" if name in row.above else "-"
            for name in ("W", "C")
        )
        sizes = (f"{row.tilt_rad:.4f}", f"{row.sizes.code:,}", f"{row.sizes.ram:,}")
        lines.append((row.title, *shares, *sizes, _heap(row)))
    return table(head, lines)


def _heap(row: Row) -> str:
    if row.heap_after > 0:
        return f"{row.heap_after:.0f} calls per update"
    return "set-up only" if row.heap_first else "no"


def write_report(
    rows: list[Row], machine: str, agreement: dict[str, str], nothing: Timing, folder: Path
) -> str:
    """Write times.md, times.csv, times.png and times.svg into `folder`; returns the Markdown."""
    folder.mkdir(parents=True, exist_ok=True)
    parts = [machine]
    for flags, spelled in FLAGS.items():
        parts += [f"`{spelled}`, ns per update, median / 99th percentile:", _times_table(rows, flags)]
    parts += ["Aims, from the least to the most over W, T, F and C:", _aims_table(rows)]
    parts += ["Quality of the plans, and memory (bytes, x86-64, `-O2`):", _quality_table(rows)]
    same = "; ".join(f"{title}, {count} states" for title, count in agreement.items())
    versions: dict[str, str] = {}
    for row in rows:
        versions |= row.versions
    parts += [
        f"Plans of roll-out and generated C agree within 1e-6 rad: {same}. Clock and call, subtracted: "
        f"{nothing.hot['C'][0]:.0f} ns, cold {nothing.cold:.0f} ns. "
        f"Versions: {', '.join(f'{name} {version}' for name, version in versions.items())}."
    ]
    text = "\n\n".join(parts)
    (folder / "times.md").write_text(f"{text}\n", "utf-8")
    _write_csv(rows, folder / "times.csv")
    _draw([row for row in rows if row.times], folder / "times")
    return text


def _write_csv(rows: list[Row], path: Path) -> None:
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(("contender", "cost", "scalar", "flags", "set", "median_ns", "p99_ns", "cold_ns"))
        for row in rows:
            for flags, timing in row.times.items():
                for name, (median, most) in timing.hot.items():
                    start = (row.title, row.cost, row.scalar, FLAGS[flags], name)
                    writer.writerow((*start, f"{median:.1f}", f"{most:.1f}", f"{timing.cold:.1f}"))


def _draw(rows: list[Row], stem: Path) -> None:
    """Draw a panel for each build: a row for each contender, a marker for each set, a common time axis."""
    with style():
        figure = Figure(figsize=(10.5, 0.32 * len(rows) + 1.6), layout="constrained")
        panels = figure.subplots(1, len(FLAGS), sharey=True, sharex=True)
        for axes, (flags, spelled) in zip(panels, FLAGS.items(), strict=True):
            _draw_panel(axes, rows, flags)
            axes.set_title(spelled)
        panels[0].set_yticks(range(len(rows)), [row.title for row in rows])
        panels[0].invert_yaxis()
        handles, _ = panels[0].get_legend_handles_labels()
        patches = [Patch(color=colour, label=kind) for kind, colour in _COLOURS.items()]
        figure.legend(handles=[*patches, *handles], loc="outside lower center", ncols=8)
        figure.savefig(stem.with_suffix(".png"), dpi=160, metadata={"Software": None})
        figure.savefig(stem.with_suffix(".svg"), metadata={"Date": None, "Creator": None})


def _draw_panel(axes: Axes, rows: list[Row], flags: str) -> None:
    for place, row in enumerate(rows):
        mine = row.name == OURS or row.name.startswith(("ours", "mambo"))
        colour = _COLOURS["ours" if mine else f"others, {row.cost.partition(',')[0]}"]
        timing = row.times[flags]
        for name, marker in _MARKERS.items():
            median, most = timing.hot[name]
            axes.plot([median, most], [place, place], color=colour, linewidth=0.8, alpha=0.5)
            label = f"set {name}" if place == 0 else None
            axes.plot(median, place, marker, color=colour, markersize=5, linestyle="none", label=label)
        label = "C, cold caches" if place == 0 else None
        axes.plot(timing.cold, place, "x", color=colour, markersize=5, linestyle="none", label=label)
    axes.set_xscale("log")
    axes.set_xlabel("ns per update: median, and line to the 99th percentile")
