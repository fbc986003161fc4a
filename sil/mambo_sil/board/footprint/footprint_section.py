"""Footprints and sweeps on a page."""

from pathlib import Path

from mambo_sil.board.footprint.footprint_plots import sweep_panels
from mambo_sil.board.footprint.footprint_report import FootprintSummary
from mambo_sil.board.footprint.sweep import SweepSummary
from mambo_sil.results.section import Section


def footprint_section(_folder: Path, summary: FootprintSummary) -> Section:
    """Return the section of footprints on boards."""
    fits = sum(board.fits for board in summary.boards)
    finding = f"fits {fits} of {len(summary.boards)} boards"
    measured = [board.on_board for board in summary.boards if board.on_board is not None]
    different = [one.board_says for one in measured if one.different_steps]
    if different:
        finding += f"; other bits on {different[0]}"
    title = f"Footprint of {summary.source}"
    good = fits == len(summary.boards) and not different
    return Section("footprint", title, good, finding, summary)


def sweep_section(_folder: Path, summary: SweepSummary) -> Section:
    """Return the section of a sweep."""
    best = summary.closest_fit
    finding = (
        "nothing fits"
        if best is None
        else f"closest tracking that fits: prediction {best.prediction}, {best.control} moves, "
        f"{best.iterations} iterations"
    )
    pictures = sweep_panels(summary.points, summary.budget) if summary.points else []
    title = f"Sweep of {summary.source} on {summary.board}, vehicle {summary.vehicle.name}"
    return Section("sweep", title, best is not None, finding, {"summary": summary, "pictures": pictures})
