"""The record of a study: its result, and the files in its folder."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from mambo_codegen.atomic import put
from mambo_codegen.settings import controller_toml
from mambo_extensions.tune.study import RULE, FinishedTrial, choose, pareto_front, study_name
from mambo_extensions.tune.tuning_file import Tuning, round_value
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.campaign.store import convert_os_errors
from mambo_sil.experiment.margins.margin_reserve import HEADS as MARGIN_HEADS
from mambo_sil.experiment.margins.margin_reserve import WORSE, MarginReference, Reserve, reserve
from mambo_sil.model.derive.margin_reference import margin_reference
from mambo_sil.results.blocks import CommandResult, Details, Facts, ResultTable, Sentence
from mambo_sil.results.folders import SUMMARY
from mambo_sil.results.number_format import digits, distance
from mambo_sil.results.summary import ReportedSummary

CONTROLLER: Final = "controller.toml"
FRONT: Final = "front"
_HEADS: Final = ("", "trial", "IAE, m s", "command variation, rad", *MARGIN_HEADS, "crashed")


@dataclass(frozen=True)
class Selection:
    """Finished trials by what they achieved, with the margins of those that were asked for.

    base:         the trial with the base's settings; None while another machine flies it.
    front:        the Pareto front by IAE, and the chosen trial.
    keeps_margins: whether the chosen trial keeps the margins of the reference.
    """

    reference: MarginReference
    base: FinishedTrial | None
    chosen: FinishedTrial
    front: list[FinishedTrial]
    keeps_margins: bool


def judge_trials(tuning: Tuning, trials: Sequence[FinishedTrial]) -> Selection:
    """Choose one of the trials of a study; raises BuildError, CacheError.

    Margins are measured of the base, of the front, and of trials that the choice asks for.
    """
    reference = margin_reference(tuning.file.base, tuning.base, tuning.drone)
    measured: dict[int, FinishedTrial] = {}

    def with_margins(one: FinishedTrial) -> FinishedTrial:
        if one.number not in measured:
            left = reserve(tuning.settings(one.values), tuning.drone, reference)
            measured[one.number] = replace(one, margins=left)
        return measured[one.number]

    def keeps(one: FinishedTrial) -> bool:
        left = with_margins(one).margins
        return left is None or left.enough

    robust = choose(trials, keeps)
    chosen = choose(trials) if robust is None else robust
    assert chosen is not None  # a study has a trial
    front = pareto_front(trials)
    front += [] if chosen in front else [chosen]
    return Selection(
        reference,
        next((with_margins(one) for one in find_base(tuning, trials)), None),
        with_margins(chosen),
        [with_margins(one) for one in sorted(front, key=lambda one: one.iae_m_s)],
        robust is not None,
    )


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
    reference: MarginReference | None = None
    keeps_margins: bool = True

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
                Sentence(f"chosen: {self.rule}{self._about_margins()}"),
                Facts({"its settings": values}),
                ResultTable(_HEADS, rows),
                Details("Pareto front", [ResultTable(_HEADS, front)]),
            ],
        )

    def _about_margins(self) -> str:
        """Return in words which margins the chosen trial keeps."""
        return "" if self.reference is None else about_margins(self.reference, keeps=self.keeps_margins)

    def _row(self, name: str, one: FinishedTrial) -> tuple[str, ...]:
        figures = (digits(one.iae_m_s), digits(one.command_variation_rad), *(one.margins or Reserve()).cells)
        return (name, str(one.number), *figures, f"{one.crashed} of {self.flights}")


def about_margins(reference: MarginReference, *, keeps: bool) -> str:
    """Return the end of a sentence that says which margins a chosen trial keeps."""
    if reference.missing is not None:
        return f"; margins are not known: {reference.missing}"
    if keeps:
        return f", of trials without {WORSE} than with {reference.whose}"
    return f"; MARGINS NOT KEPT: every trial has {WORSE} than with {reference.whose}"


def summarise(tuning: Tuning, trials: Sequence[FinishedTrial], judged: Selection) -> TuneSummary:
    """Return the record of finished trials; values are rounded as in the controller.toml of a trial."""
    return TuneSummary(
        study=study_name(tuning),
        seed=tuning.file.seed,
        flights=tuning.file.flights,
        duration_s=tuning.file.flight.duration_s,
        vehicle=tuning.drone,
        trials=len(trials),
        base=_rounded(judged.base) if judged.base else None,
        chosen=_rounded(judged.chosen),
        rule=RULE,
        front=[_rounded(one) for one in judged.front],
        reference=judged.reference,
        keeps_margins=judged.keeps_margins,
    )


def find_base(tuning: Tuning, trials: Sequence[FinishedTrial]) -> list[FinishedTrial]:
    """Return the trial with the base's settings: the first one, unless machines share the study."""
    return [one for one in trials if one.values == tuning.start][:1]


def finish(tuning: Tuning, trials: Sequence[FinishedTrial], folder: Path) -> TuneSummary:
    """Write Pareto front, picture, chosen controller and, last, the summary.

    Raises UnwritableError, BuildError, CacheError.
    """
    from mambo_extensions.tune.tuning_plots import draw_front  # noqa: PLC0415 - loaded when drawing

    judged = judge_trials(tuning, trials)
    summary = summarise(tuning, trials, judged)
    with convert_os_errors(folder):
        put(folder / f"{FRONT}.csv", front_csv(judged).encode())
        draw_front(trials, find_base(tuning, trials), judged.chosen, folder / FRONT)
        put(folder / CONTROLLER, controller_text(tuning, trials, judged).encode())
        put(folder / SUMMARY, summary.text().encode())
    return summary


def _rounded(trial: FinishedTrial) -> FinishedTrial:
    return replace(trial, values={path: round_value(value) for path, value in trial.values.items()})


def front_csv(judged: Selection) -> str:
    """Return the front as CSV, one line per trial; `chosen` is 1 for the chosen one."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    keys = list(judged.chosen.values)
    measured = ("iae_m_s", "command_variation_rad", "crashed")
    writer.writerow(["trial", "chosen", *measured, "gain_margin", "delay_margin_s", "margin_share", *keys])
    for one in judged.front:
        left, chosen = one.margins or Reserve(), int(one.number == judged.chosen.number)
        found = (one.number, chosen, one.iae_m_s, one.command_variation_rad, one.crashed)
        margins = (left.gain, left.delay_s, left.share)
        writer.writerow([*found, *margins, *(round_value(one.values[key]) for key in keys)])
    return text.getvalue()


def controller_text(tuning: Tuning, trials: Sequence[FinishedTrial], judged: Selection) -> str:
    """Return the controller.toml of the chosen trial; its head names study, trial and result."""
    best, flight = judged.chosen, tuning.file.flight
    rule = f"{RULE}{about_margins(judged.reference, keeps=judged.keeps_margins)}"
    title = (
        f"Found by mambo-nmpc tune: trial {best.number} of {len(trials)} in study {study_name(tuning)}, seed "
        f"{tuning.file.seed}: {rule}. Over {tuning.file.flights} random flights of {flight.duration_s:g} s "
        f"on {flight.trajectory.text()}, sensors {flight.sensors}: mean IAE {best.iae_m_s:.4g} m s, command "
        f"variation {best.command_variation_rad:.4g} rad an update, {best.crashed} crashed."
    )
    return controller_toml.to_toml(tuning.settings(best.values), title)
