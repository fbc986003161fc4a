"""Results of a study: Pareto front, chosen point and its controller.toml."""

import csv
import io
from collections.abc import Sequence
from typing import Final

from mambo_codegen.settings import controller_toml
from mambo_sil.model.tune.study import FinishedTrial, study_name
from mambo_sil.model.tune.tuning_file import Tuning, round_value

IAE_ALLOWANCE: Final = 1.1
"""Bound on the IAE of the chosen point, relative to the least IAE found."""

RULE: Final = "the least command variation with an IAE within 10 % of the least found"
"""How the point is chosen; stands in controller.toml."""


def pareto_front(trials: Sequence[FinishedTrial]) -> list[FinishedTrial]:
    """Return the Pareto-optimal trials in IAE and command variation, sorted by IAE."""
    front: list[FinishedTrial] = []
    for trial in sorted(trials, key=lambda one: (one.iae_m_s, one.command_variation_rad, one.number)):
        if not front or trial.command_variation_rad < front[-1].command_variation_rad:
            front.append(trial)
    return front


def choose(front: Sequence[FinishedTrial]) -> FinishedTrial:
    """Return the point of a front, which is sorted by IAE, according to `RULE`."""
    return [one for one in front if one.iae_m_s <= IAE_ALLOWANCE * front[0].iae_m_s][-1]


def front_csv(front: Sequence[FinishedTrial]) -> str:
    """Return the front as CSV, one line per trial; `chosen` is 1 for the chosen one."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    keys = list(front[0].values)
    writer.writerow(["trial", "chosen", "iae_m_s", "command_variation_rad", "crashed", *keys])
    best = choose(front)
    for one in front:
        found = (one.number, int(one is best), one.iae_m_s, one.command_variation_rad, one.crashed)
        writer.writerow([*found, *(round_value(one.values[key]) for key in keys)])
    return text.getvalue()


def controller_text(tuning: Tuning, trials: Sequence[FinishedTrial]) -> str:
    """Return the controller.toml of the chosen trial; its head names study, trial and result."""
    best, flight = choose(pareto_front(trials)), tuning.file.flight
    title = (
        f"Found by mambo-nmpc tune: trial {best.number} of {len(trials)} in study {study_name(tuning)}, seed "
        f"{tuning.file.seed}: {RULE}. Over {tuning.file.flights} random flights of {flight.duration_s:g} s "
        f"on {flight.trajectory.text()}, sensors {flight.sensors}: mean IAE {best.iae_m_s:.4g} m s, command "
        f"variation {best.command_variation_rad:.4g} rad an update, {best.crashed} crashed."
    )
    return controller_toml.to_toml(tuning.settings(best.values), title)
