"""The record of a study: its result, and the files in its folder."""

import csv
import io
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from mambo_codegen.atomic import put
from mambo_codegen.settings import controller_toml
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.campaign.store import convert_os_errors
from mambo_sil.model.tune.study import RULE, FinishedTrial, choose, pareto_front, study_name
from mambo_sil.model.tune.tuning_file import Tuning, round_value
from mambo_sil.results.blocks import CommandResult, Details, Facts, ResultTable, Sentence
from mambo_sil.results.folders import SUMMARY
from mambo_sil.results.number_format import digits, distance
from mambo_sil.results.summary import ReportedSummary

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

    def result(self, _folder: Path, /) -> CommandResult:
        """Return the result: base, chosen trial, and on a page the trials of the front."""
        chosen, base = self.chosen, self.base
        mean = distance(chosen.iae_m_s / self.duration_s)
        answer = f"trial {chosen.number} of {self.trials}: {mean} in the mean"
        answer += f", the base {distance(base.iae_m_s / self.duration_s)}" if base is not None else ""
        answer += f"; {chosen.crashed} of {self.flights} flights crashed"
        values = ", ".join(f"{key} {value:g}" for key, value in chosen.values.items())
        named = {"base": base, "chosen": chosen}
        rows = [self._row(name, one) for name, one in named.items() if one is not None]
        front = [self._row("front", one) for one in self.front]
        return CommandResult(
            f"Tuning with {self.trials} trials, vehicle {self.vehicle.name}",
            None,
            [answer],
            [
                Sentence(f"chosen: {self.rule}"),
                Facts({"its settings": values}),
                ResultTable(_HEADS, rows),
                Details("Pareto front", [ResultTable(_HEADS, front)]),
            ],
        )

    def _row(self, name: str, one: FinishedTrial) -> tuple[str, ...]:
        figures = (digits(one.iae_m_s), digits(one.command_variation_rad))
        return (name, str(one.number), *figures, f"{one.crashed} of {self.flights}")


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


def _rounded(trial: FinishedTrial) -> FinishedTrial:
    return replace(trial, values={path: round_value(value) for path, value in trial.values.items()})


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
