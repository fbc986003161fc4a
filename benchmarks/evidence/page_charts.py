"""Charts of pages of evidence whose figures have no stamp: drawn from the tables of the page itself.

`python -m benchmarks.evidence.page_charts` draws those whose tables have changed.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from benchmarks.evidence.charts import bars
from benchmarks.evidence.drawn import is_drawn_from, keep
from benchmarks.evidence.item import PICTURES, RESULTS, EvidenceError
from benchmarks.evidence.sources import ROOT
from mambo_sil.results.pictures import PlainLogFormatter, save
from mambo_sil.results.style import PAGE_INCHES, VERMILION, add_headline, looks, style

Table = Sequence[dict[str, str]]
"""Rows of a table of a page, each by the titles of the columns."""

_NAMES: Final = {
    "preset mambo": "mambo",
    "preset crazyflie": "crazyflie",
    "derived": "design",
    "PD with feed-forward": "pd-feedforward",
    "PID with feed-forward": "pid-feedforward",
}
"""The controllers of the chart of the page design.md by the titles of their columns."""


@dataclass(frozen=True)
class PageChart:
    """The chart docs/evidence/NAME.png of NAME.md, of those of its tables whose first titles are these."""

    heads: tuple[str, ...]
    draw: Callable[..., Figure]


def table_of(text: str, head: str) -> Table:
    """Return the first table of a page whose titles begin so. Raises EvidenceError."""
    for block in re.findall(r"(?m)(?:^\|.*\n)+", text):
        lines = [line.strip().strip("|").replace("`", "").split("|") for line in block.splitlines()]
        titles, _, *rows = [[cell.strip() for cell in line] for line in lines]
        if " | ".join(titles).startswith(head):
            return [dict(zip(titles, row, strict=True)) for row in rows]
    raise EvidenceError(f"no table begins with the titles {head}")


def tables_of(name: str) -> list[Table]:
    """Return the tables from which a chart is drawn."""
    text = (PICTURES / f"{name}.md").read_text("utf-8")
    return [table_of(text, head) for head in PAGE_CHARTS[name].heads]


def draw_page_charts() -> list[str]:
    """Draw the charts whose tables have changed; return their names."""
    results = ROOT / RESULTS / "pages"
    results.mkdir(parents=True, exist_ok=True)
    changed = [name for name in PAGE_CHARTS if not is_drawn_from(PICTURES / f"{name}.png", tables_of(name))]
    for name in changed:
        with style():
            png, _ = save(PAGE_CHARTS[name].draw(*tables_of(name)), results / name)
        keep(png, PICTURES / f"{name}.png", tables_of(name))
    return changed


def _number(text: str) -> float:
    """Return the first number in a cell, with commas between thousands."""
    found = re.search(r"\d[\d,]*\.?\d*", text)
    if found is None:
        raise EvidenceError(f"no number in {text!r}")
    return float(found[0].replace(",", ""))


def _logarithmic(axes: Axes) -> None:
    """Let the axis along x be logarithmic, with plain numbers."""
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(PlainLogFormatter())
    axes.xaxis.set_minor_formatter(NullFormatter())


def _rows(axes: Axes, names: Sequence[str]) -> None:
    """Name the rows, the first one at the top."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)


def settings_chart(flown: Table) -> Figure:
    """Return the median error on each vehicle by controller; who crashes has words in place of a dot."""
    figure = Figure(figsize=(PAGE_INCHES, 2.5), layout="constrained")
    axes = figure.subplots()
    for title, look in zip(_NAMES, looks(list(_NAMES.values())).values(), strict=True):
        cells = {place: row[title] for place, row in enumerate(flown) if row[title]}
        calm = {place: _number(cell.split(",")[1]) for place, cell in cells.items() if cell.startswith("0,")}
        axes.plot(list(calm.values()), list(calm), label=title, **look.dots)
        for place in cells.keys() - calm.keys():
            axes.text(0.21, place, f"{title}: {cells[place]}", va="center", color=VERMILION)
    _logarithmic(axes)
    axes.set_xlabel("median IAE of the true position, m s (left is better)")
    axes.set_xlim(0.2, 60.0)
    _rows(axes, [row["vehicle"] for row in flown])
    figure.legend(loc="outside lower center", ncols=len(_NAMES))
    add_headline(
        figure,
        "Settings by design (derived) are the closest on every drone but the Mambo",
        "100 random drones like each vehicle, flights of the default campaign, through the vehicle's sensors",
    )
    return figure


def identified_chart(found: Table) -> Figure:
    """Return the errors of what `identify` finds by flight; who is refused has that word."""
    figure = Figure(figsize=(PAGE_INCHES, 2.5), layout="constrained")
    delay, gain = figure.subplots(1, 2, sharey=True)
    known = [row for row in found if row["gain"] != "-"]
    bars(
        delay, {"": [_number(row["lag + dead time, ms"]) for row in known]}, "lag + dead time: rms error, ms"
    )
    bars(gain, {"": [100.0 * _number(row["gain"]) for row in known]}, "gain: rms error, %")
    refused = [row for row in found if row["gain"] == "-"]
    for place, row in enumerate(refused, len(known)):
        for axes in (delay, gain):
            axes.text(0.0, place, f" {row['verdicts']}", va="center", color=VERMILION)
    _rows(delay, [f"{row['flight']}; {row['lag, dead time, ms']} ms" for row in (*known, *refused)])
    add_headline(
        figure,
        "30 s of the manoeuvre find the delay to 4 to 6 ms and the gain to about 1 %; hover is refused",
        "20 simulated flights each, two axes; lag and dead time of the drone on the left; shorter is better",
    )
    return figure


def bits_chart(waiting: Table, real_time: Table) -> Figure:
    """Return the steps that were compared with the reference, and the inputs that came late in real time."""
    figure = Figure(figsize=(PAGE_INCHES, 2.2), layout="constrained")
    steps, late = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
    whole = [row for row in waiting if " of " in row["bits"]]
    rows = [*whole, *real_time]
    names = [row[next(iter(row))].partition(",")[0] for row in rows]
    kinds = [*(["waits for each step"] * len(whole)), *(["real time"] * len(real_time))]
    equal, flown = zip(*(map(_number, row["bits"].split(" of ")) for row in rows), strict=True)
    bars(steps, {"": list(equal)}, "steps with the bits of the reference (all of those flown)")
    share = [100.0 * _number(row.get("late inputs", "0")) / of for row, of in zip(rows, flown, strict=True)]
    bars(late, {"": share}, "late inputs, % (left is better)")
    _rows(steps, [f"{name}, {kind}" for name, kind in zip(names, kinds, strict=True)])
    missing = sum(flown) - sum(equal)
    add_headline(
        figure,
        f"{sum(equal):,.0f} steps, {missing:.0f} with other bits than the reference, however late the inputs",
        "Preset mambo, float32, the Table II case; firmware in QEMU, and as a process of the host",
    )
    return figure


def times_chart(flights: Table) -> Figure:
    """Return the processor time of a flight by engine."""
    figure = Figure(figsize=(PAGE_INCHES, 2.4), layout="constrained")
    axes = figure.subplots()
    title = "processor time of a flight, ms"
    times_ms = {next(iter(row.values())): _number(row[title]) for row in flights}
    bars(axes, {"": list(times_ms.values())}, f"{title}, logarithmic (left is better)")
    _logarithmic(axes)
    _rows(axes, list(times_ms))
    add_headline(
        figure,
        f"A flight of 100 s takes {times_ms['C, true state']:.0f} ms in C, "
        f"{times_ms['NumPy, true state'] / 1000.0:.1f} s in NumPy",
        "Eight of Table II, Parrot Mambo, preset mambo at 100 Hz, one core, median of 5 rounds",
    )
    return figure


PAGE_CHARTS: Final = {
    "design": PageChart(("vehicle | PD",), settings_chart),
    "identify": PageChart(("flight | lag, dead time, ms",), identified_chart),
    "pil": PageChart(("firmware, in QEMU", "firmware | flown"), bits_chart),
    "speed": PageChart((" | processor time of a flight, ms",), times_chart),
}
"""By the name of page and picture."""


if __name__ == "__main__":
    print(", ".join(draw_page_charts()) or "as new as their tables")
