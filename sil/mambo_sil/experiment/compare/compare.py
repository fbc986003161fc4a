"""Compare two controllers: their settings, their laws, and what they fly."""

import contextlib
from collections.abc import Callable
from pathlib import Path

from mambo_codegen.errors import echo
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.errors import FlightError
from mambo_sil.experiment.compare.compared_flights import Answers, answers
from mambo_sil.experiment.compare.diff_plots import draw_steps
from mambo_sil.experiment.compare.diff_report import PICTURES, DiffSummary, differences, figures
from mambo_sil.results.folders import new_results

Side = tuple[str, Settings]
"""The name of a source and its settings."""


def compare(
    a: Side,
    b: Side,
    drone: VehicleFile,
    folder: Path | None,
    progress: Callable[[float], None],
) -> DiffSummary:
    """Return the comparison of two controllers on a drone; write it and its picture to `folder`.

    The same controller does not fly. Raises FlightError, and the errors of building the C and of writing.
    """
    summary = DiffSummary(
        a=a[0],
        b=b[0],
        settings_a=a[1].digest,
        settings_b=b[1].digest,
        vehicle=drone,
        differences=differences(a[1], b[1]),
    )
    with contextlib.ExitStack() as stack:
        place = folder and stack.enter_context(new_results(folder, DiffSummary.command, PICTURES))
        if not summary.same:
            first = _answers(a, drone)
            progress(0.5)
            second = _answers(b, drone)
            found = {"figures_a": figures(a[1], drone, first), "figures_b": figures(b[1], drone, second)}
            summary = summary.model_copy(update=found)
            if place is not None:
                draw_steps(first.steps, second.steps, (echo(a[0]), echo(b[0])), place / "step")
        if place is not None:
            summary.write(place)
    return summary


def _answers(side: Side, drone: VehicleFile) -> Answers:
    try:
        return answers(side[1], drone)
    except FlightError as error:
        raise FlightError(f"{echo(side[0])}: {error}") from error
