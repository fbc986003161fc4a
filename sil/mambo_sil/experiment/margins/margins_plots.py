"""The pictures of a controller's loops: Bode, Nyquist with the circle of Ms = 2, |S| and |T|."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.experiment.margins.axis_margins import AXES, PLACES, AxisName, PlaceName
from mambo_sil.experiment.margins.loop_margins import open_loop
from mambo_sil.experiment.margins.response_file import Curve
from mambo_sil.results.pictures import PlainLogFormatter, inline, save
from mambo_sil.results.style import (
    BLUE,
    BROAD,
    COLUMN_INCHES,
    DOT,
    ORANGE,
    PAGE_INCHES,
    QUIET,
    SMALL,
    THIN,
    add_headline,
    style,
)

_ASKED: Final = 2.0
"""The largest sensitivity that textbooks ask for at most."""
_LOOKS: Final[dict[PlaceName, dict[str, Any]]] = {
    "command": {"color": BLUE, "linestyle": "solid"},
    "motors": {"color": ORANGE, "linestyle": (0, (4, 1.5))},
}


def draw_margins(curves: list[Curve], headline: tuple[str, str], folder: Path) -> None:
    """Write bode, nyquist and sensitivity as PNG and SVG: roll, pitch and, if there is one, the height.

    `headline`: what the margins are, and of what.
    """
    with style():
        for name in _PANELS:
            figure = _figure(curves, name)
            add_headline(figure, *headline)
            save(figure, folder / name)


def margin_panels(curves: list[Curve]) -> list[Markup]:
    """Return the same pictures for a page."""
    *first, last = _axes_of(curves)
    words = f"{', '.join(first)} and {last}"
    with style():
        return [inline(_figure(curves, name), f"{name} of {words}") for name in _PANELS]


def _axes_of(curves: list[Curve]) -> list[AxisName]:
    """Return the axes that have a curve, in their order."""
    return [axis for axis in AXES if any(curve.axis == axis for curve in curves)]


def _alike(curves: list[Curve]) -> dict[str, list[Curve]]:
    """Return the curves of each axis by its name; axes whose curves cannot be told apart are one."""
    found: dict[str, list[Curve]] = {}
    for axis in _axes_of(curves):
        own = [curve for curve in curves if curve.axis == axis]
        same = next((name for name, others in found.items() if _are_alike(own, others)), None)
        if same is None:
            found[axis] = own
        else:
            found = {f"{same} and {axis}" if name == same else name: one for name, one in found.items()}
    return found


def _are_alike(some: list[Curve], others: list[Curve]) -> bool:
    return len(some) == len(others) and all(
        len(a.rad_s) == len(b.rad_s) and np.allclose(a.sensitivity, b.sensitivity, rtol=0.01, atol=1e-3)
        for a, b in zip(some, others, strict=True)
    )


def _figure(curves: list[Curve], name: str) -> Figure:
    draw, rows, height = _PANELS[name]
    axes = _alike(curves)
    width = max(1.1 * len(axes) * COLUMN_INCHES, PAGE_INCHES)
    figure = Figure(figsize=(width, height), layout="constrained")
    panels = figure.subplots(rows, len(axes), sharex=True, sharey="row", squeeze=False)
    for (axis, own), column in zip(axes.items(), panels.T, strict=True):
        column[0].set_title(axis, loc="left")
        for curve in own:
            draw(column, curve, _LOOKS[curve.place] | {"label": f"broken at {PLACES[curve.place]}"})
    panels[0, 0].legend(loc="best")  # a tilt, which may have both curves
    return figure


def _bode(panels: Any, curve: Curve, look: dict[str, Any]) -> None:
    rad_s, s = curve.rad_s, curve.sensitivity
    loop = open_loop(s)
    magnitude, phase = panels
    magnitude.loglog(rad_s, np.abs(loop), **look)
    magnitude.axhline(1.0, color=QUIET, linewidth=THIN)
    magnitude.set_ylim(1e-2, 1e3)
    angle = np.degrees(np.unwrap(np.angle(loop)))
    crossing = int(np.argmin(np.abs(np.log(np.abs(loop)))))
    angle -= 360.0 * np.round((angle[crossing] + 180.0) / 360.0)
    phase.semilogx(rad_s, angle, **look)
    phase.axhline(-180.0, color=QUIET, linewidth=THIN)
    phase.set_ylim(-400.0, 40.0)
    phase.set_yticks(np.arange(-360.0, 1.0, 90.0))
    _mark_margins(panels, curve, angle)
    _label(panels, "|L|", "phase of L, degrees")


def _mark_margins(panels: Any, curve: Curve, angle: FloatArray) -> None:
    """Mark the least gain margin upwards and the phase margin, each with its value, by a bar to its line."""
    magnitude, phase = panels
    rad_s, size = curve.rad_s, np.abs(open_loop(curve.sensitivity))
    look: dict[str, Any] = {"color": _LOOKS[curve.place]["color"], "linewidth": BROAD, "zorder": 3}
    turns = np.flatnonzero((np.diff(np.floor((angle + 180.0) / 360.0)) != 0) & (size[:-1] < 1.0))
    words: dict[str, Any] = {"fontsize": SMALL, "fontweight": "bold", "zorder": 4}
    if len(turns):
        nearest = turns[np.argmax(size[turns])]
        magnitude.vlines(rad_s[nearest], size[nearest], 1.0, **look)
        magnitude.annotate(
            f" \N{MULTIPLICATION SIGN}{1.0 / size[nearest]:.2g}", (rad_s[nearest], 1.0), va="bottom", **words
        )
    crosses = np.flatnonzero((size[:-1] >= 1.0) & (size[1:] < 1.0))
    if len(crosses):
        least = crosses[np.argmin(np.abs(angle[crosses] + 180.0))]
        phase.vlines(rad_s[least], -180.0, angle[least], **look)
        phase.annotate(
            f" {angle[least] + 180.0:.0f}\N{DEGREE SIGN}", (rad_s[least], -180.0), va="top", **words
        )


def _nyquist(panels: Any, curve: Curve, look: dict[str, Any]) -> None:
    (panel,) = panels
    loop = open_loop(curve.sensitivity)
    panel.plot(loop.real, loop.imag, **look)
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    panel.plot(np.cos(turn) / _ASKED - 1.0, np.sin(turn) / _ASKED, color=QUIET, linewidth=THIN)
    panel.plot([-1.0], [0.0], color=QUIET, marker="+", markersize=2 * DOT)
    panel.set_aspect("equal")
    panel.set_xlim(-3.0, 1.0)
    panel.set_ylim(-2.5, 1.5)
    panel.set_xlabel("real part of L; circle: |S| = 2")
    if panel.get_subplotspec().is_first_col():
        panel.set_ylabel("imaginary part of L")


def _sensitivities(panels: Any, curve: Curve, look: dict[str, Any]) -> None:
    rad_s, s = curve.rad_s, curve.sensitivity
    for panel, values in zip(panels, (s, 1.0 - s), strict=True):
        panel.loglog(rad_s, np.abs(values), **look)
        panel.axhline(1.0, color=QUIET, linewidth=THIN)
        panel.axhline(_ASKED, color=QUIET, linewidth=THIN, linestyle=(0, (1, 2)))
        panel.set_ylim(0.02, 10.0)
    _label(panels, "|S|", "|T|")


def _label(panels: Any, *names: str) -> None:
    """Name the axes of a column of panels."""
    first: Axes = panels[0]
    if first.get_subplotspec().is_first_col():  # type: ignore[union-attr] # panels of a grid have one
        for panel, name in zip(panels, names, strict=True):
            panel.set_ylabel(name)
    panels[-1].set_xlabel("frequency, rad/s")
    panels[-1].xaxis.set_major_formatter(PlainLogFormatter())


_PANELS: Final[dict[str, tuple[Callable[[Any, Curve, dict[str, Any]], None], int, float]]] = {
    "bode": (_bode, 2, 4.2),
    "nyquist": (_nyquist, 1, 3.4),
    "sensitivity": (_sensitivities, 2, 4.2),
}
"""Of each picture: what draws a curve into a column, the rows, and the height in inches."""
