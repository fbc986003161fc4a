"""Picture of a plan: its path from above and over time in height, coloured by the share of the limits."""

from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from mambo_extensions.plan.hermite import motion
from mambo_extensions.plan.planning import DENSE, Planned, shares_of
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.results.pictures import save
from mambo_sil.results.style import BROAD, INK, PAGE_INCHES, QUIET, THIN, style

COLOURS: Final = "viridis"


def draw_plan(planned: Planned, title: str, stem: Path) -> tuple[Path, Path]:
    """Draw where a plan goes and what it takes of its limits; writes stem.png and stem.svg."""
    course = planned.course
    position_m = motion(course.knots, course.duration_s, DENSE)[0]
    share = np.clip(shares_of(course, planned.limits).max(axis=0), 0.0, 1.0)
    since_s = np.concatenate([[0.0], np.cumsum(course.duration_s)])
    time_s = since_s[:-1, np.newaxis] + course.duration_s[:, np.newaxis] * DENSE
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 0.5 * PAGE_INCHES), layout="constrained")
        plan, height = figure.subplots(1, 2)
        lines = _coloured(plan, position_m[..., 1], position_m[..., 0], share)
        _coloured(height, time_s, position_m[..., 2], share)
        for knot in course.choice.points:
            number = course.choice.point_of(knot)
            point = planned.points[number - 1]
            _mark(plan, point, number)
            height.plot(since_s[knot], point.z_m, "o", color=INK)
        plan.set(xlabel="y (to the left), m", ylabel="x (ahead), m", aspect="equal", adjustable="datalim")
        height.set(xlabel="time, s", ylabel="height, m")
        for axes in (plan, height):
            axes.autoscale_view()
        plan.invert_xaxis()  # x ahead is up, y to the left is left: as seen by who stands behind the start
        figure.suptitle(title, parse_math=False)
        figure.colorbar(lines, ax=height, label="largest share of a limit")
        return save(figure, stem)


def _coloured(axes: Any, x: FloatArray, y: FloatArray, share: FloatArray) -> LineCollection:
    """Draw lines (n, s) in the colours of a share."""
    ends = np.stack([x, y], axis=-1)
    parts = np.stack([ends[:, :-1], ends[:, 1:]], axis=2).reshape(-1, 2, 2)
    lines = LineCollection(list(parts), cmap=COLOURS, linewidth=BROAD)
    lines.set_array((0.5 * (share[:, :-1] + share[:, 1:])).ravel())
    lines.set_clim(0.0, 1.0)
    axes.add_collection(lines)
    return lines


def _mark(axes: Any, point: Any, number: int) -> None:
    """Draw a point from above: its number, and its sphere or gate."""
    if point.normal is None:
        turn = np.linspace(0.0, 2.0 * np.pi, 40)
        axes.plot(
            point.y_m + point.tolerance_m * np.cos(turn),
            point.x_m + point.tolerance_m * np.sin(turn),
            color=QUIET,
            linewidth=THIN,
        )
    else:
        along = np.array([point.normal[0], point.normal[1]])
        along = np.array([1.0, 0.0]) if not along.any() else along / np.linalg.norm(along)
        half = 0.5 * (point.width_m or 0.0)
        ends = np.array([[point.x_m, point.y_m]] * 2) + np.outer([-half, half], [-along[1], along[0]])
        axes.plot(ends[:, 1], ends[:, 0], color=QUIET, linewidth=2.0 * THIN)
    axes.annotate(str(number), (point.y_m, point.x_m), xytext=(4, 4), textcoords="offset points")
