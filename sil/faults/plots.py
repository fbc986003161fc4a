"""Pictures of flights with faults."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from mambo_nmpc.sil.faults.flights import COURSES, STRAY_M, Verdict
from mambo_nmpc.sil.show.plots import COMMAND, FLOWN, save, style


def draw_faults(verdicts: Sequence[Verdict], stem: Path) -> tuple[Path, Path]:
    """Draw largest error and recovery time, one row per fault, one colour per course.

    Writes stem.png and stem.svg. A flight that does not recover has no dot on the right.
    """
    faults = list(dict.fromkeys(verdict.fault for verdict in verdicts))
    with style():
        figure = Figure(figsize=(9.0, 1.0 + 0.22 * len(faults)), layout="constrained")
        errors, times = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
        for course, colour in zip(COURSES, (FLOWN, COMMAND), strict=True):
            chosen = [verdict for verdict in verdicts if verdict.course == course]
            rows = [faults.index(verdict.fault) for verdict in chosen]
            dots = {"marker": "o", "linestyle": "none", "markersize": 4.5, "color": colour}
            errors.plot([verdict.largest_error_m for verdict in chosen], rows, label=course, **dots)
            times.plot([verdict.recovery_s for verdict in chosen], rows, **dots)
        errors.axvline(STRAY_M, color="#444444", linewidth=0.8)
        errors.set(xscale="log", xlabel=f"largest error, m; line: {STRAY_M:g} m", yticks=range(len(faults)))
        errors.set_yticklabels(faults, parse_math=False)
        errors.set_ylim(len(faults) - 0.5, -0.5)
        errors.legend(loc="lower right", frameon=True)
        times.set_xlabel("back after, s")
        return save(figure, stem)
