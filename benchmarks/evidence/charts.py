"""Charts of pages whose commands draw no picture: drawn from the figures of a stamp, without a flight."""

from collections.abc import Sequence
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from benchmarks.evidence.item import Figures
from mambo_sil.results.style import BLUE, GRID, ORANGE, PAGE_INCHES, QUIET, add_headline

SHOWN: Final = {
    "mambo": "mambo, this MPC",
    "pid-feedforward": "PID with feed-forward",
    "pd-feedforward": "PD with feed-forward",
    "table1": "table1, the paper's NMPC",
    "pd": "PD of the paper",
}
"""The controllers of the opponents' chart, best first, with their titles."""
_BAR: Final = 0.38
"""Thickness of one of two bars of a row."""


def opponents_chart(figures: Figures) -> Figure:
    """Return bars of the median distance of random drones and the crashes of light ones, by controller."""
    figure = Figure(figsize=(PAGE_INCHES, 2.6), layout="constrained")
    distance, crashes = figure.subplots(1, 2, sharey=True)
    of = {campaign: figures[campaign]["controllers"] for campaign in figures if campaign != "improvements"}
    names = list(SHOWN)
    bars(
        distance,
        {"": [of["drawn"][name]["quantiles"]["seen_iae_m_s"]["0.5"] for name in names]},
        "median distance as estimated, cm (left is better)",
    )
    curves = {"eight, 0.5 rad/s": "slow-motors", "circle, 1.5 rad/s": "slow-motors-circle"}
    bars(
        crashes,
        {title: [of[one][name]["crashed"]["count"] for name in names] for title, one in curves.items()},
        "crashes of 300 (left is better)",
    )
    distance.set_yticks(range(len(names)), list(SHOWN.values()))
    distance.invert_yaxis()
    crashes.legend(loc="upper right")
    add_headline(
        figure,
        "This MPC is the closest, and crashes least",
        "Parrot Mambo; left 1000 random drones in gusts, right 300 light ones with slow motors",
    )
    return figure


def peers_chart(figures: Figures) -> Figure:
    """Return bars of a step's instructions by solver, on a logarithmic axis."""
    rows = figures["rows"]
    means = [_thousands(row["near, mean (most)"]) for row in rows]
    figure = Figure(figsize=(PAGE_INCHES, 2.4), layout="constrained")
    axes = figure.subplots()
    bars(axes, {"": means}, "instructions per step near the target, mean, logarithmic (left is better)")
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:,.0f}")
    axes.set_yticks(range(len(rows)), [row["solver"] for row in rows])
    axes.invert_yaxis()
    add_headline(
        figure,
        f"This MPC solves a step in {means[0]:.0f} instructions, the next solver in {sorted(means)[1]:,.0f}",
        "Crazyflie's Cortex-M4F, -O2, the problem of preset mambo, 20 states each, counted in an emulator",
    )
    return figure


def _thousands(cell: str) -> int:
    """Return the first number of a cell, with commas between thousands."""
    return int(cell.split(maxsplit=1)[0].replace(",", ""))


def boards_chart(figures: Figures) -> Figure:
    """Return bars of a step's instructions and of the flash of preset `mambo`, by board and scalar type."""
    types = {"float32": figures["mambo"], "fixed point": figures["mambo --scalar fixed"]}
    figure = Figure(figsize=(PAGE_INCHES, 3.2), layout="constrained")
    instructions, flash = figure.subplots(1, 2, sharey=True)
    bars(
        instructions,
        {title: [one["instructions"]["mean"] for one in boards] for title, boards in types.items()},
        "instructions per step, mean",
    )
    bars(
        flash,
        {title: [one["flash_bytes"] / 1000 for one in boards] for title, boards in types.items()},
        "flash, KB",
    )
    instructions.xaxis.set_major_locator(MaxNLocator(4))
    instructions.set_yticks(range(len(figures["mambo"])), [one["name"] for one in figures["mambo"]])
    instructions.invert_yaxis()
    flash.legend(loc="upper right")
    add_headline(
        figure,
        "Without an FPU fixed point saves most of a step's instructions, except on the Mega",
        "Preset mambo, -O2, counted in emulators over 300 ticks of a flight",
    )
    return figure


def bars(axes: Axes, rows: dict[str, Sequence[float]], label: str) -> None:
    """Draw horizontal bars, one or two per row, each with its value."""
    looks: list[dict[str, Any]] = [{"color": BLUE}, {"color": ORANGE, "hatch": "///", "edgecolor": "white"}]
    for number, (title, values) in enumerate(rows.items()):
        places = [index + (number - (len(rows) - 1) / 2) * _BAR for index in range(len(values))]
        bars = axes.barh(places, values, height=_BAR, label=title, linewidth=0.0, **looks[number])
        axes.bar_label(bars, [f"{one:,.3g}" if one < 100 else f"{one:,.0f}" for one in values], padding=2)
    axes.margins(x=0.18)
    axes.set_xlabel(label)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0.0)
    axes.spines["left"].set_color(GRID)
    axes.spines["bottom"].set_color(QUIET)
