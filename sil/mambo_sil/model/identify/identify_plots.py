"""The picture of an identification: command, measured and modelled tilt, and the half that was held out."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.checks import NAMES
from mambo_sil.model.identify.curves import read_curves
from mambo_sil.model.identify.signals import DEGREE
from mambo_sil.results.pictures import inline, save
from mambo_sil.results.style import BROAD, COLUMN_INCHES, COMMAND, FLOWN, GRID, INK, TARGET, style

SHOWN_S: Final = 6.0
"""Time shown before and after the split."""


def draw_fit(curves: Path, split_s: float, verdicts: Mapping[str, str], stem: Path) -> tuple[Path, Path]:
    """Draw the curves of a fit.csv, with the verdict on each axis; write stem.png and stem.svg.

    The model was fitted up to `split_s`. Raises ResultsError.
    """
    with style():
        return save(_figure(read_curves(curves), split_s, verdicts, 2.4 * COLUMN_INCHES), stem)


def fit_panel(curves: Path, split_s: float, verdicts: Mapping[str, str]) -> Markup:
    """Return the same picture for a page; raises ResultsError."""
    with style():
        return inline(
            _figure(read_curves(curves), split_s, verdicts, 2.0 * COLUMN_INCHES),
            "Roll and pitch over time: commanded, measured and modelled, on fitted and on held-out samples",
        )


def _figure(
    curves: dict[str, FloatArray], split_s: float, verdicts: Mapping[str, str], width: float
) -> Figure:
    figure = Figure(figsize=(width, 4.6), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    time_s = curves["time_s"]
    shown = np.abs(time_s - split_s) <= SHOWN_S
    for axes, name in zip(panels, NAMES, strict=True):
        _draw_axis(axes, {key: values[shown] for key, values in curves.items()}, name, split_s)
        axes.set_title(f"{name}: {verdicts[name]}", loc="left", parse_math=False)
    panels[-1].set_xlabel("time, s")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))
    return figure


def _draw_axis(axes: Axes, curves: dict[str, FloatArray], name: str, split_s: float) -> None:
    """Draw one axis in degrees; the model is dashed where its samples were fitted, dotted where held out."""
    time_s = curves["time_s"]
    command, tilt, model = (
        curves[f"{name}{part}"] / DEGREE for part in ("_command_rad", "_rad", "_model_rad")
    )
    held_out = time_s > split_s
    axes.axvspan(split_s, max(time_s[-1], split_s), color=GRID, alpha=0.5, linewidth=0)
    axes.plot(time_s, command, color=TARGET, linewidth=BROAD, label="command")
    axes.plot(time_s, tilt, color=FLOWN, label="measured")
    axes.plot(
        time_s, np.where(held_out, np.nan, model), color=COMMAND, linestyle="dashed", label="model, fitted"
    )
    axes.plot(
        time_s, np.where(held_out, model, np.nan), color=INK, linestyle="dotted", label="model, held out"
    )
    axes.set_ylabel("degrees")
