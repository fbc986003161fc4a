"""Results of a campaign: summary and result."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from markupsafe import Markup
from pydantic import BaseModel

from mambo_codegen.atomic import put
from mambo_codegen.errors import echo
from mambo_sil.experiment.campaign.campaign_file import Campaign, FlightSection
from mambo_sil.experiment.campaign.campaign_file import distributions as distributions_of
from mambo_sil.experiment.campaign.campaign_flights import CRASHED
from mambo_sil.experiment.campaign.campaign_records import record_name, write_records
from mambo_sil.experiment.campaign.drawn_curves import chosen_curves
from mambo_sil.experiment.campaign.statistics import (
    Distributions,
    Improvement,
    Proportion,
    Table,
    distributions,
    improvements,
    read_table,
    worst_flights,
)
from mambo_sil.experiment.campaign.store import DATABASE, FLIGHT, FlightStore, convert_os_errors
from mambo_sil.flight.names import PD_TITLES
from mambo_sil.flight.own_curve import is_curve_file
from mambo_sil.results.blocks import (
    Block,
    CommandResult,
    Commands,
    Details,
    Facts,
    Picture,
    ResultTable,
    Sentence,
)
from mambo_sil.results.folders import SUMMARY
from mambo_sil.results.metric_names import AS_ESTIMATED, SEEN, named, titled
from mambo_sil.results.number_format import digits, distance
from mambo_sil.results.summary import Number, ReportedSummary

PICTURE: Final = "campaign"
CAPTION: Final = (
    "Cumulative distributions over the flights: a curve further left is better. The value of a crashed "
    "flight is infinite, so the curve of a controller that crashes ends below 100 %."
)
MAIN_INDICES: Final = ("iae_m_s", "max_error_m", "command_variation_rad")
"""What the console shows of each controller."""
_SHOWN: Final = {"0.05": "5 %", "0.5": "median", "0.95": "95 %", "1": "worst"}


class NamedController(BaseModel, extra="allow", frozen=True):
    """A controller of a campaign; the summary keeps all its keys."""

    name: str


class Drawn(BaseModel, extra="allow", frozen=True):
    """Parameters of a campaign; the other controllers are compared with the first one.

    A page shows these keys, the summary keeps all others too.
    """

    seed: int
    flight: FlightSection
    controllers: list[NamedController]

    def shown(
        self, folder: Path, good: bool | None, answer: list[str], blocks: Sequence[Block]
    ) -> CommandResult:
        """Return a result with what a page shows of every campaign: its parameters and distributions."""
        flight = self.flight
        facts = {
            "trajectory": _course(flight),
            "vehicle": str(flight.vehicle),
            "sensors": str(flight.sensors),
            "seed": str(self.seed),
        }

        def panels() -> list[Markup]:
            from mambo_sil.experiment.campaign.campaign_plots import distribution_panels  # noqa: PLC0415 - loaded when drawing

            return distribution_panels(self.flights_in(folder), [one.name for one in self.controllers])

        pictures = Picture(panels, CAPTION, [folder / DATABASE])
        title = f"Campaign, {flight.trajectory.text()}"
        return CommandResult(title, good, answer, [Facts(facts), pictures, *blocks])

    def flights_in(self, folder: Path) -> Table:
        """Read the flights in `folder`, none if there is no database; raises ResultsError."""
        if not (folder / DATABASE).is_file():
            return {}
        return read_table(folder / DATABASE, [one.name for one in self.controllers])


@dataclass(frozen=True)
class WorstFlight:
    """One of the worst flights, with the record that repeats it."""

    flight: int
    crashed: bool
    iae_m_s: Number
    max_error_m: Number
    record: str


class CampaignSummary(ReportedSummary):
    """A finished campaign."""

    command = "campaign"

    campaign: Drawn
    flights: int
    controllers: dict[str, Distributions]
    improvements: list[Improvement]
    worst: dict[str, list[WorstFlight]]

    def result(self, folder: Path, /) -> CommandResult:
        """Return the result: how close each controller flies, the rest folded."""
        found = self.controllers
        crashed = any(one.crashed.count for name, one in found.items() if name not in PD_TITLES)
        blocks = [_compared(found), *_failed(found)]
        blocks.append(self._improvement(["iae_m_s"]))
        first = {name: flights[:1] for name, flights in self.worst.items()}
        blocks.append(_repeated("worst flight by IAE of each; this command repeats it", folder, first))
        everything = [_statistics(name, one) for name, one in found.items()]
        if any(key.startswith(SEEN) for one in found.values() for key in one.quantiles):
            everything.append(Sentence(AS_ESTIMATED))
        indices = list(dict.fromkeys(one.index for one in self.improvements))
        everything += [self._improvement(indices), _repeated("worst flights by IAE", folder, self.worst)]
        answer = [_answer(self, name) for name in reversed(found)]
        shown = [*blocks, Details("All indices, and the worst flights of each controller", everything)]
        return self.campaign.shown(folder, False if crashed else None, answer, shown)

    def _improvement(self, indices: Sequence[str]) -> Block:
        """Return how much better each controller is than the first one, by some indices."""
        first = next(iter(self.controllers))
        return ResultTable(
            ("the other", "index", "median", "95 % interval", "better in", "95 % interval"),
            [
                (
                    one.controller,
                    named(one.index)[0],
                    digits(one.median),
                    f"{digits(one.low)} .. {digits(one.high)}",
                    f"{one.better.count} of {one.better.flights}",
                    _interval(one.better),
                )
                for one in self.improvements
                if one.index in indices
            ],
            (0, 1),
            title=f"improvement on {first}: its index divided by the other's, flight by flight",
        )


class UnfinishedCampaign(Drawn, ReportedSummary):
    """The summary of a campaign that is not finished."""

    command = "campaign"

    def result(self, folder: Path, /) -> CommandResult:
        """Return the result so far; raises ResultsError for flights that cannot be read."""
        so_far = len(next(iter(self.flights_in(folder).values()), ()))
        return self.shown(
            folder, None, [f"not finished, {so_far} flights so far; the same command resumes it"], []
        )


def summarise(campaign: Campaign, table: Table) -> CampaignSummary:
    """Return statistics of a finished campaign, and the worst flights with the names of their records."""
    names = [entrant.name for entrant in campaign.entrants]
    sensed = campaign.file.flight.sensors != "true"
    return CampaignSummary(
        campaign=Drawn.model_validate(campaign.document()),
        flights=len(table[FLIGHT]),
        controllers=distributions(table, names, sensed=sensed, spatial=campaign.spatial),
        improvements=improvements(table, names, sensed=sensed),
        worst={name: [_worst(table, name, row) for row in worst_flights(table, name)] for name in names},
    )


def _worst(table: Table, name: str, row: int) -> WorstFlight:
    flight = int(table[FLIGHT][row])
    return WorstFlight(
        flight=flight,
        crashed=bool(table[f"{name}_{CRASHED}"][row]),
        iae_m_s=float(table[f"{name}_iae_m_s"][row]),
        max_error_m=float(table[f"{name}_max_error_m"][row]),
        record=record_name(flight, name),
    )


def finish(campaign: Campaign, store: FlightStore, stage: Callable[[str], None]) -> CampaignSummary:
    """Write the CSV, records of the worst flights, pictures and, last, the summary; raises UnwritableError.

    Calls `stage` with the name of each step before it.
    """
    stage("writing the table")
    store.export()
    stage("computing statistics")
    table = read_table(store.folder / DATABASE, [entrant.name for entrant in campaign.entrants])
    summary = summarise(campaign, table)
    worst = {name: [one.flight for one in flights] for name, flights in summary.worst.items()}
    write_records(campaign, store, worst)
    stage("drawing pictures")
    from mambo_sil.experiment.campaign.campaign_plots import draw_campaign  # noqa: PLC0415 - loaded when drawing

    with convert_os_errors(store.folder):
        names = [entrant.name for entrant in campaign.entrants]
        message = "; ".join(_answer(summary, name) for name in reversed(names))
        draw_campaign(table, names, message, _about(campaign, summary.flights), store.folder / PICTURE)
        put(store.folder / SUMMARY, summary.text().encode())
    return summary


def _about(campaign: Campaign, flights: int) -> str:
    """Return what was flown, how often and where, for a picture."""
    flight = campaign.file.flight
    wind = distributions_of(flight, campaign.file.draws)["wind_speed_m_s"]
    return (
        f"{flights} random flights on drone {campaign.drone.name}, sensors {flight.sensors}: "
        f"{_course(flight)}, wind {wind.text()} m/s"
    )


def _course(flight: FlightSection) -> str:
    """Return what is followed, and how long; curves of files have neither size nor rate."""
    own = all(map(is_curve_file, chosen_curves(flight.trajectory)))
    shape = "" if own else f", {flight.size_m.text()} m, {flight.rate_rad_s.text()} rad/s"
    return f"{flight.trajectory.text()}{shape}, {flight.duration_s:g} s"


def _compared(found: Mapping[str, Distributions]) -> Block:
    """Return the quantiles of the main metrics, of one controller below the other."""
    rows = [
        (titled(index), name, *(digits(one.quantiles[index][share]) for share in _SHOWN))
        for index in MAIN_INDICES
        for name, one in found.items()
        if index in one.quantiles
    ]
    return ResultTable(("index", "controller", *_SHOWN.values()), rows, (0, 1))


def _failed(found: Mapping[str, Distributions]) -> list[Block]:
    """Return how many flights crashed, and in how many an input was rejected, if any."""
    rows = [
        (name, word, f"{one.count} of {one.flights}", _interval(one))
        for name, each in found.items()
        for word, one in (("crashed", each.crashed), ("rejected an input", each.refused_an_input))
        if one.count
    ]
    if rows:
        return [ResultTable(("controller", "", "flights", "95 % interval"), rows, (0, 1))]
    one = next(iter(found.values())).crashed
    return [Sentence(f"crashed: none of {one.flights} (95 % interval of each {_interval(one)})")]


def _repeated(title: str, folder: Path, worst: Mapping[str, Sequence[WorstFlight]]) -> Block:
    """Return the commands that repeat flights."""
    rows = [
        (f"{name}, {_end(flight)}", f"mambo-nmpc fly --repeat {echo(str(folder))}/{flight.record}")
        for name, flights in worst.items()
        for flight in flights
    ]
    return Commands(title, rows)


def _statistics(name: str, found: Distributions) -> Block:
    """Return the quantiles of all metrics of a controller."""
    rows = [
        (titled(index), *(digits(quantiles[share]) for share in _SHOWN))
        for index, quantiles in found.quantiles.items()
    ]
    return ResultTable((name, *_SHOWN.values()), rows)


def _answer(summary: CampaignSummary, name: str) -> str:
    """Return how close a controller flies, by the median of the flights, and how many crashed."""
    found = summary.controllers[name]
    mean_m = found.quantiles["iae_m_s"]["0.5"] / summary.campaign.flight.duration_s
    return f"{name}: {distance(mean_m)} in the mean, {found.crashed.count} of {found.crashed.flights} crashed"


def _end(flight: WorstFlight) -> str:
    return "crashed" if flight.crashed else f"{digits(flight.iae_m_s)} m s"


def _interval(one: Proportion) -> str:
    return f"{100 * one.low:.3g} .. {100 * one.high:.3g} %"
