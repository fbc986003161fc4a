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
from mambo_sil.results.summary import PageTable, ReportedSummary, Section, plain_section
from mambo_sil.results.terminal import sentence, table

CONTROLLER: Final = "controller.toml"
FRONT: Final = "front"
_HEADS: Final = ("", "trial", "IAE, m s", "command variation, rad", "crashed")


class TuneSummary(ReportedSummary):
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

    def section(self, _folder: Path, /) -> Section:
        """Return the section of the report: base and chosen trial, and the trials of the front."""
        values = [f"{key} {value:g}" for key, value in self.chosen.values.items()]
        front = [_row(self, "front", one) for one in self.front]
        named = PageTable(_HEADS, [*_rows(self), *front])
        title = f"Tuning with {self.trials} trials, vehicle {self.vehicle.name}"
        said = [f"Chosen: {self.rule}.", f"Its settings: {', '.join(values)}."]
        return plain_section(title, None, _answer(self), [named], sentences=said)


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
    lines = [sentence(_answer(summary)), sentence(f"chosen: {summary.rule}"), ""]
    return "\n".join([*lines, *table(_HEADS, _rows(summary))])


def _answer(summary: TuneSummary) -> str:
    """Return how closely the chosen trial flies, and the base, if it has flown."""
    chosen, base = summary.chosen, summary.base
    answer = f"trial {chosen.number} of {summary.trials}: {distance(chosen.iae_m_s / summary.duration_s)}"
    answer += " in the mean"
    answer += f", the base {distance(base.iae_m_s / summary.duration_s)}" if base is not None else ""
    return f"{answer}; {chosen.crashed} of {summary.flights} flights crashed"


def _rows(summary: TuneSummary) -> list[tuple[str, ...]]:
    named = {"base": summary.base, "chosen": summary.chosen}
    return [_row(summary, name, one) for name, one in named.items() if one is not None]


def _row(summary: TuneSummary, name: str, one: FinishedTrial) -> tuple[str, ...]:
    return (
        name,
        str(one.number),
        digits(one.iae_m_s),
        digits(one.command_variation_rad),
        f"{one.crashed} of {summary.flights}",
    )


def _rounded(trial: FinishedTrial) -> FinishedTrial:
    return replace(trial, values={path: round_value(value) for path, value in trial.values.items()})
