"""Pictures of flights with faults."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mambo_sil.experiment.faults.fault_flights import COURSES, ONSETS_S, STRAY_M, End, Verdict
from mambo_sil.results.pictures import PlainLogFormatter, save
from mambo_sil.results.style import LOOKS, ORANGE, PAGE_INCHES, QUIET, THIN, VERMILION, add_headline, style

_LEAST_M: Final = 1e-2
"""Smaller errors are drawn at the left edge."""
_LOOKS: Final = dict(zip(COURSES, (LOOKS[0], LOOKS[3]), strict=True))
_ENDS: Final = {End.CRASHED: VERMILION, End.NOT_RECOVERED: ORANGE}
"""Colours of flights that did not recover, behind their row and of their word."""


def draw_faults(verdicts: Sequence[Verdict], message: str, drone: str, stem: Path) -> tuple[Path, Path]:
    """Draw largest error and recovery time, one row per fault, one marker per course.

    Writes stem.png and stem.svg. Where a flight does not recover, the row is coloured, and says how it ended.
    """
    faults = list(dict.fromkeys(verdict.fault for verdict in verdicts))
    with style():
        figure = Figure(figsize=(PAGE_INCHES, 1.2 + 0.17 * len(faults)), layout="constrained")
        about = f"{drone}, no wind; of {len(ONSETS_S)} onsets for each fault and course the worst"
        add_headline(figure, message, about)
        errors, times = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
        for course, look in _LOOKS.items():
            chosen = [verdict for verdict in verdicts if verdict.course == course]
            rows = [faults.index(verdict.fault) for verdict in chosen]
            shown_m = [max(verdict.largest_error_m, _LEAST_M) for verdict in chosen]
            errors.plot(shown_m, rows, label=course, clip_on=False, **look.dots)
            times.plot([verdict.recovery_s for verdict in chosen], rows, clip_on=False, **look.dots)
        errors.axvline(STRAY_M, color=QUIET, linewidth=THIN)
        better = "\N{LEFTWARDS ARROW} better"
        errors.set(xscale="log", xlabel=f"{better}: largest error, m (line: {STRAY_M:g} m)")
        errors.set_yticks(range(len(faults)))
        errors.set_xlim(left=_LEAST_M)
        errors.xaxis.set_major_formatter(PlainLogFormatter(_LEAST_M))
        errors.set_yticklabels(faults, parse_math=False)
        errors.set_ylim(len(faults) - 0.5, -0.5)
        times.set(xlabel=f"{better}: recovered after, s", xlim=(0.0, None))
        _mark_ends((errors, times), faults, verdicts)
        figure.legend(loc="outside lower center", ncols=len(COURSES))
        return save(figure, stem)


def _mark_ends(panels: tuple[Axes, Axes], faults: Sequence[str], verdicts: Sequence[Verdict]) -> None:
    """Colour the rows of faults that ended badly, and say which course did, and how."""
    errors, times = panels
    words: dict[str, list[Verdict]] = {}
    for verdict in verdicts:
        if verdict.end in _ENDS:
            words.setdefault(verdict.fault, []).append(verdict)
    for fault, ended in words.items():
        row = faults.index(fault)
        worst = End.CRASHED if any(one.end is End.CRASHED for one in ended) else End.NOT_RECOVERED
        for axes in panels:
            axes.axhspan(row - 0.45, row + 0.45, color=_ENDS[worst], alpha=0.2, linewidth=0)
        said = ", ".join(f"{one.course}: {'CRASHED' if one.end is End.CRASHED else 'never'}" for one in ended)
        look: dict[str, Any] = {"va": "center", "ha": "right", "fontweight": "bold"}
        times.text(0.99, row, said, transform=times.get_yaxis_transform(), **look)
        errors.get_yticklabels()[row].set_fontweight("bold")
