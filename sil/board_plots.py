"""Pictures of footprints and sweeps."""

from collections.abc import Sequence
from itertools import product
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from codegen.boards import Board
from sil.footprint import Footprint
from sil.plots import COMMAND, FLOWN, style
from sil.sweep import Point


def draw_footprints(footprints: Sequence[Footprint], stem: Path) -> tuple[Path, Path]:
    """Draw each limit as a bar per board, as a share of its budget; write stem.png and stem.svg."""
    with style(), mpl.rc_context({"text.parse_math": False}):  # a board's name is no formula
        figure = Figure(figsize=(7.2, 1.2 + 1.0 * len(footprints)), layout="constrained")
        axes = figure.subplots()
        labels, shares, colours, texts = [], [], [], []
        for footprint in reversed(footprints):
            for limit in reversed(footprint.limits):
                labels.append(f"{footprint.board.name}  {limit.name}")
                shares.append(100 * limit.share)
                colours.append(FLOWN if limit.share <= 1 else COMMAND)
                texts.append(f" {_spelled(limit.value)} of {_spelled(limit.budget)} {limit.unit}")
        bars = axes.barh(labels, shares, color=colours, zorder=2)
        axes.bar_label(bars, texts, fontsize=7)
        axes.axvline(100, color="#444444", linewidth=0.8)
        axes.set(
            xlabel="share of the budget, %",
            xlim=(0, 1.35 * max(100, *shares)),
            ylim=(-0.8, len(labels) - 0.2),
        )
        return save(figure, stem)


def _spelled(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def save(figure: Figure, stem: Path) -> tuple[Path, Path]:
    """Write a figure as PNG and SVG."""
    png, svg = stem.with_suffix(".png"), stem.with_suffix(".svg")
    figure.savefig(png, dpi=160, metadata={"Software": None})
    figure.savefig(svg, metadata={"Date": None, "Creator": None})
    return png, svg


def draw_sweep(
    points: Sequence[Point], board: Board, update_period_s: float, stem: Path
) -> tuple[Path, Path]:
    """Draw flash, RAM, time and tracking against the prediction horizon; write stem.png and stem.svg.

    A colour for each control horizon, a line style for each number of iterations; filled dots fit the budget,
    which is the dashed line.
    """
    budget = board.budget
    panels = (
        ("flash, B", "flash_bytes", budget.flash_bytes),
        ("RAM, B", "ram_bytes", budget.ram_bytes),
        ("time of a step, ms (upper estimate)", "time_ms", 1000 * update_period_s * budget.period_share),
        ("IAE, m s", "iae_m_s", None),
    )
    controls = sorted({point.control for point in points})
    iterations = sorted({point.iterations for point in points})
    with style():
        figure = Figure(figsize=(9.0, 7.0), layout="constrained")
        for axes, (label, name, limit) in zip(figure.subplots(2, 2).flat, panels, strict=True):
            for (row, control), (column, count) in product(enumerate(controls), enumerate(iterations)):
                line = [p for p in points if (p.control, p.iterations) == (control, count)]
                x, y = [p.prediction for p in line], [getattr(p, name) for p in line]
                colour, dashes = f"C{row}", ("-", "--", "-.", ":")[column % 4]
                axes.plot(x, y, color=colour, linestyle=dashes, label=f"{control} moves, {count} iterations")
                fits = [(p.prediction, getattr(p, name)) for p in line if p.fits]
                axes.plot(*zip(*fits, strict=True) if fits else ([], []), "o", color=colour, markersize=3.5)
            if limit is not None and limit < 3 * max(getattr(p, name) for p in points):
                axes.axhline(limit, color="#444444", linestyle=(0, (6, 3)), linewidth=0.9)
            axes.set(xlabel="prediction horizon", ylabel=label)
            axes.set_yscale("log" if name in ("iae_m_s", "time_ms") else "linear")
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=min(4, len(labels)), fontsize=8)
        figure.suptitle(board.title, parse_math=False)
        return save(figure, stem)
