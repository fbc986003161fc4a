"""Pictures of flights with faults."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from matplotlib.figure import Figure

from mambo_sil.experiment.faults.fault_flights import COURSES, STRAY_M, Verdict
from mambo_sil.results.pictures import PlainLogFormatter, save
from mambo_sil.results.style import LOOKS, PAGE_INCHES, QUIET, THIN, style

_LEAST_M: Final = 1e-3
"""Smaller errors are drawn at the left edge."""


def draw_faults(verdicts: Sequence[Verdict], stem: Path) -> tuple[Path, Path]:
    """Draw largest error and recovery time, one row per fault, one marker per course.

    Writes stem.png and stem.svg. A flight that does not recover has no dot on the right.
    """
    faults = list(dict.fromkeys(verdict.fault for verdict in verdicts))
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 0.8 + 0.17 * len(faults)), layout="constrained")
        errors, times = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
        for course, look in zip(COURSES, LOOKS[:2], strict=True):
            chosen = [verdict for verdict in verdicts if verdict.course == course]
            rows = [faults.index(verdict.fault) for verdict in chosen]
            shown_m = [max(verdict.largest_error_m, _LEAST_M) for verdict in chosen]
            errors.plot(shown_m, rows, label=course, clip_on=False, **look.dots)
            times.plot([verdict.recovery_s for verdict in chosen], rows, clip_on=False, **look.dots)
        errors.axvline(STRAY_M, color=QUIET, linewidth=THIN)
        errors.set(xscale="log", xlabel=f"largest error, m (line: {STRAY_M:g} m)", yticks=range(len(faults)))
        errors.set_xlim(left=_LEAST_M)
        errors.xaxis.set_major_formatter(PlainLogFormatter(_LEAST_M))
        errors.set_yticklabels(faults, parse_math=False)
        errors.set_ylim(len(faults) - 0.5, -0.5)
        figure.legend(loc="outside upper center", ncols=len(COURSES))
        times.set(xlabel="recovered after, s", xlim=(0.0, None))
        return save(figure, stem)
