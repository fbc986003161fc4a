"""Results of a campaign: summary, text, and section of the report."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel

from mambo_codegen.atomic import put
from mambo_codegen.errors import echo
from mambo_sil.errors import ResultsError
from mambo_sil.experiment.campaign.campaign_file import Campaign, FlightSection
from mambo_sil.experiment.campaign.campaign_flights import CRASHED
from mambo_sil.experiment.campaign.campaign_records import record_name, write_records
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
from mambo_sil.experiment.campaign.store import DATABASE, FLIGHT, TABLE, FlightStore, convert_os_errors
from mambo_sil.flight.names import PD_TITLES
from mambo_sil.results.folders import SUMMARY
from mambo_sil.results.metric_names import SEEN, named, titled
from mambo_sil.results.number_format import digits, distance
from mambo_sil.results.summary import Number, ReportedSummary, Section
from mambo_sil.results.terminal import sentence, table

PICTURE: Final = "campaign"
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

    @property
    def title(self) -> str:
        """The title of the campaign's section of the report."""
        return f"Campaign, {self.flight.trajectory.text()}"


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

    def section(self, folder: Path) -> Section:
        """Return the section of the report; raises ResultsError for flights that cannot be read."""
        found = self.controllers
        content = {
            **_content(folder, self.campaign, _flights(folder, self.campaign)),
            "summary": self,
            "indices": {
                name: [(*named(index), values) for index, values in one.quantiles.items()]
                for name, one in found.items()
            },
            "improvements": [(named(one.index)[0], one) for one in self.improvements],
        }
        crashes = ", ".join(f"{one.crashed.count} with {name}" for name, one in found.items())
        finding = f"{self.flights} flights; crashed: {crashes}"
        crashed = any(one.crashed.count for name, one in found.items() if name not in PD_TITLES)
        good = False if crashed else None
        return Section("campaign", self.campaign.title, good, finding, content, _missing(folder))


class UnfinishedCampaign(Drawn, ReportedSummary):
    """The summary of a campaign that is not finished."""

    command = "campaign"

    def section(self, folder: Path) -> Section:
        """Return the section of the report; raises ResultsError for flights that cannot be read."""
        flights = _flights(folder, self)
        so_far = len(next(iter(flights.values()), ()))
        finding = f"not finished, {so_far} flights so far; the same command resumes it"
        nothing: dict[str, Any] = {"summary": None, "indices": {}, "improvements": []}
        content = _content(folder, self, flights) | nothing
        return Section("campaign", self.title, None, finding, content, _missing(folder))


def _missing(folder: Path) -> list[str]:
    return [] if (folder / DATABASE).is_file() else [DATABASE]


def _flights(folder: Path, drawn: Drawn) -> Table:
    """Read the flights in `folder`, none if there is no database; raises ResultsError."""
    if not _missing(folder):
        return read_table(folder / DATABASE, [controller.name for controller in drawn.controllers])
    if (folder / TABLE).is_file():
        raise ResultsError(
            f"{echo(str(folder))}: has {TABLE} without {DATABASE}, as mambo-nmpc 0.1 wrote it; "
            "report it with that version, or run campaign again in another folder"
        )
    return {}


def _content(folder: Path, drawn: Drawn, flights: Table) -> dict[str, Any]:
    """Return what the page shows of every campaign: its parameters, and pictures of its flights."""
    from mambo_sil.experiment.campaign.campaign_plots import distribution_panels  # noqa: PLC0415 - loaded when drawing

    pictures = distribution_panels(flights, [controller.name for controller in drawn.controllers])
    return {"drawn": drawn, "folder": str(folder), "pictures": pictures}


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
        draw_campaign(table, [entrant.name for entrant in campaign.entrants], store.folder / PICTURE)
        put(store.folder / SUMMARY, summary.text().encode())
    return summary


def campaign_text(summary: CampaignSummary, folder: str) -> str:
    """Return a summary as text: the answer, statistics, improvements, commands to repeat the worst."""
    lines = [_answer(summary, name) for name in reversed(summary.controllers)]
    for name, found in summary.controllers.items():
        rows = [
            (titled(index), *(digits(quantiles[share]) for share in _SHOWN))
            for index, quantiles in found.quantiles.items()
        ]
        lines += ["", *table((name, *_SHOWN.values()), rows)]
        lines.append(f"crashed: {_spelled(found.crashed)}")
        if found.refused_an_input.count:
            lines.append(f"rejected an input: {_spelled(found.refused_an_input)}")
    if any(key.startswith(SEEN) for found in summary.controllers.values() for key in found.quantiles):
        lines += ["", sentence("as estimated: error of the estimated position, which the controller knows")]
    if summary.improvements:
        first = next(iter(summary.controllers))
        lines += ["", f"improvement on {first}: its index divided by that of the other, flight by flight"]
        lines += table(
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
                for one in summary.improvements
            ],
            (0, 1),
        )
    lines += ["", "worst flights by IAE; these commands repeat them"]
    for name, flights in summary.worst.items():
        for flight in flights:
            what = "crashed" if flight.crashed else f"{digits(flight.iae_m_s)} m s"
            lines.append(f"{name}, {what}: mambo-nmpc fly --repeat {echo(folder)}/{flight.record}")
    return "\n".join(lines)


def _answer(summary: CampaignSummary, name: str) -> str:
    """Return how close a controller flies, by the median of the flights, and how many crashed."""
    found = summary.controllers[name]
    mean_m = found.quantiles["iae_m_s"]["0.5"] / summary.campaign.flight.duration_s
    crashed = f"{found.crashed.count} of {found.crashed.flights} crashed"
    return sentence(f"{name}: {distance(mean_m)} in the mean, {crashed}")


def _interval(one: Proportion) -> str:
    return f"{100 * one.low:.3g} .. {100 * one.high:.3g} %"


def _spelled(one: Proportion) -> str:
    return f"{one.count} of {one.flights} flights, {100 * one.share:.3g} % (95 % interval {_interval(one)})"
