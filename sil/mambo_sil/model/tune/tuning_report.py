"""The record of a study: what the command prints, and the summary in its folder."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from mambo_codegen.atomic import put
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.campaign.store import convert_os_errors
from mambo_sil.model.tune.front import RULE, choose, controller_text, front_csv, pareto_front
from mambo_sil.model.tune.study import FinishedTrial, study_name
from mambo_sil.model.tune.tuning_file import Tuning, round_value
from mambo_sil.results.folders import SUMMARY
from mambo_sil.results.number_format import digits, distance
from mambo_sil.results.summary import Summary
from mambo_sil.results.terminal import sentence, table

CONTROLLER: Final = "controller.toml"
FRONT: Final = "front"


class TuneSummary(Summary):
    """A finished study; `base` is the trial with the base's settings, None while another machine flies it."""

    command = "tune"

    study: str
    """The study's name in its database."""
    seed: int
    flights: int
    """Flights of each trial."""
    duration_s: float
    """Duration of each flight."""
    vehicle: VehicleFile = NOMINAL
    trials: int
    base: FinishedTrial | None
    chosen: FinishedTrial
    rule: str
    front: list[FinishedTrial]


def summarise(tuning: Tuning, trials: Sequence[FinishedTrial]) -> TuneSummary:
    """Return the record of finished trials; values are rounded as in the controller.toml of a trial."""
    front = pareto_front(trials)
    base = find_base(tuning, trials)
    return TuneSummary(
        study=study_name(tuning),
        seed=tuning.file.seed,
        flights=tuning.file.flights,
        duration_s=tuning.file.flight.duration_s,
        vehicle=tuning.drone,
        trials=len(trials),
        base=_rounded(base[0]) if base else None,
        chosen=_rounded(choose(front)),
        rule=RULE,
        front=[_rounded(one) for one in front],
    )


def find_base(tuning: Tuning, trials: Sequence[FinishedTrial]) -> list[FinishedTrial]:
    """Return the trial with the base's settings: the first one, unless machines share the study."""
    return [one for one in trials if one.values == tuning.start][:1]


def finish(tuning: Tuning, trials: Sequence[FinishedTrial], folder: Path) -> TuneSummary:
    """Write Pareto front, picture, chosen controller and, last, the summary; raises UnwritableError."""
    from mambo_sil.model.tune.tuning_plots import draw_front  # noqa: PLC0415 - loaded when drawing

    summary = summarise(tuning, trials)
    with convert_os_errors(folder):
        put(folder / f"{FRONT}.csv", front_csv(pareto_front(trials)).encode())
        draw_front(trials, find_base(tuning, trials), folder / FRONT)
        put(folder / CONTROLLER, controller_text(tuning, trials).encode())
        put(folder / SUMMARY, summary.text().encode())
    return summary


def tune_text(summary: TuneSummary) -> str:
    """Return base and chosen trial as text: the answer, the rule of the choice, and a table."""
    named = {"base": summary.base, "chosen": summary.chosen}
    distances = {
        name: distance(one.iae_m_s / summary.duration_s) for name, one in named.items() if one is not None
    }
    answer = f"trial {summary.chosen.number} of {summary.trials}: {distances['chosen']} in the mean"
    answer += f", the base {distances['base']}" if summary.base is not None else ""
    crashed = f"{summary.chosen.crashed} of {summary.flights} flights crashed"
    rows = [
        (
            name,
            str(one.number),
            digits(one.iae_m_s),
            digits(one.command_variation_rad),
            f"{one.crashed} of {summary.flights}",
        )
        for name, one in named.items()
        if one is not None
    ]
    heads = ("", "trial", "IAE, m s", "command variation, rad", "crashed")
    lines = [sentence(f"{answer}; {crashed}"), sentence(f"chosen: {summary.rule}"), "", *table(heads, rows)]
    return "\n".join(lines)


def _rounded(trial: FinishedTrial) -> FinishedTrial:
    return replace(trial, values={path: round_value(value) for path, value in trial.values.items()})
