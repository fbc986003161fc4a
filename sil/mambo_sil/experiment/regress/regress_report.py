"""Results of a suite: summary, result, JUnit XML, and records to repeat flights."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Final
from xml.etree import ElementTree

from markupsafe import Markup
from pydantic import Field

from mambo_codegen.errors import echo
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.experiment.campaign.campaign_flights import CRASHED, DIGEST, SATURATED, Row
from mambo_sil.experiment.inputs import Entrant
from mambo_sil.experiment.regress.baseline import Baseline
from mambo_sil.experiment.regress.flight_limits import RECORDS, JudgedFlight, is_better, judge_flight
from mambo_sil.experiment.regress.suite_file import FlightSuite
from mambo_sil.flight.scenario import Record, write_record
from mambo_sil.results.blocks import CommandResult, Commands, Facts, Picture, ResultTable, Sentence
from mambo_sil.results.metric_names import titled
from mambo_sil.results.number_format import digits
from mambo_sil.results.summary import ReportedSummary

JUNIT: Final = "junit.xml"
PICTURES: Final = ("regress.png", "regress.svg")
MOST_SHOWN: Final = 10
"""Failed flights that are listed; the summary has all."""
CAPTION: Final = (
    "Each flight's metrics divided by their limits, one row per group and metric; what lies outside the axis "
    "is drawn at its end. A metric fails above its limit: its bound, or the recorded value with tolerance."
)
_HEADS: Final = ("group", "metric", "bound", "median", "worst", "over recorded", "at limit", "failed")


class RegressSummary(ReportedSummary):
    """The results of `regress`; `files` has the SHA-256 of every file in the folder."""

    command = "regress"

    suite: str
    vehicles: list[str] = Field(default_factory=lambda: [NOMINAL.name])
    """The drones of its flights."""
    controller: str
    settings: str
    baseline: str | None
    """The file of the recorded metrics with which these were compared."""
    settings_then: str | None
    """Settings digest of that file."""
    better: int
    """Flights with a metric that is better than recorded by more than its tolerance."""
    flights: list[JudgedFlight]
    files: dict[str, str] = Field(default_factory=dict)

    @property
    def failed(self) -> list[JudgedFlight]:
        """The flights that failed."""
        return [flight for flight in self.flights if flight.failures]

    def result(self, folder: Path, /) -> CommandResult:
        """Return the result: a row per group and metric, then the failed flights."""

        def picture() -> list[Markup]:
            from mambo_sil.experiment.regress.regress_plots import limits_panel  # noqa: PLC0415 - loaded when drawing

            return [limits_panel(self.flights)]

        shown, more = self.failed[:MOST_SHOWN], len(self.failed) - MOST_SHOWN
        no_ratio = (5,) if self.baseline is None else ()
        commands = [
            (
                f"{one.name}: {'; '.join(one.failures)}",
                f"mambo-nmpc fly --repeat {echo(str(folder))}/{one.record}",
            )
            for one in shown
        ]
        return CommandResult(
            f"Regression tests, {self.suite} with {self.controller}",
            not self.failed,
            [_finding(self)],
            [
                *map(Sentence, _remarks(self)),
                Facts({"settings": self.settings[:16]}),
                Picture(picture, CAPTION),
                ResultTable(_HEADS, list(map(_cells, group_rows(self))), (0, 1), no_ratio),
                Commands("", commands),
                *([Sentence(f"and {more} more failed flights, all in {JUNIT}")] if more > 0 else []),
            ],
            f"{echo(self.suite)} with {self.controller} on {' and '.join(map(echo, self.vehicles))}",
        )


def judge(
    suite: FlightSuite, entrant: Entrant, rows: Sequence[Row], baseline: Baseline | None, path: Path
) -> RegressSummary:
    """Compare the results of a suite with its bounds, and with the baseline at `path` if there is one."""
    held = baseline.flights if baseline is not None else {}
    results = [
        judge_flight(suite, number, row, held.get(flight.name, {}))
        for number, (flight, row) in enumerate(zip(suite.flights, rows, strict=True))
    ]
    return RegressSummary(
        suite=suite.name,
        vehicles=list(dict.fromkeys(flight.scenario.vehicle.name for flight in suite.flights)),
        controller=entrant.name,
        settings=entrant.settings.digest,
        baseline=str(path) if baseline is not None else None,
        settings_then=baseline.settings if baseline is not None else None,
        better=sum(is_better(result, suite) for result in results),
        flights=results,
    )


def write_records(
    summary: RegressSummary, suite: FlightSuite, entrant: Entrant, rows: Sequence[Row], folder: Path
) -> None:
    """Write a record of each failed flight for `fly --repeat` into the folder `RECORDS` in `folder`."""
    (folder / RECORDS).mkdir()
    for flight, row, result in zip(suite.flights, rows, summary.flights, strict=True):
        if result.record is not None:
            record = Record(
                scenario=flight.scenario,
                controller=entrant.kind,
                settings=entrant.settings,
                trace_sha256=str(row[DIGEST]),
            )
            write_record(record, folder / result.record)


@dataclass(frozen=True)
class GroupRow:
    """One metric over the flights of a group.

    `over_recorded` is the largest ratio to the recorded value, `saturated_share` the largest share of a
    flight's commands at the tilt limit.
    """

    group: str
    metric: str
    bound: float | None
    middle: float
    worst: float
    over_recorded: float | None
    saturated_share: float
    failed: int
    flights: int


def group_rows(summary: RegressSummary) -> Iterator[GroupRow]:
    """Yield a row for each metric that is checked in a group; for `crashed` only if it failed or is alone."""
    for group in dict.fromkeys(flight.group for flight in summary.flights):
        flights = [flight for flight in summary.flights if flight.group == group]
        for metric in dict.fromkeys(check.metric for flight in flights for check in flight.checks):
            checks = [check for flight in flights for check in flight.checks if check.metric == metric]
            failed = sum(not check.holds for check in checks)
            if metric == CRASHED and not failed and any(len(flight.checks) > 1 for flight in flights):
                continue
            values = [math.inf if math.isnan(check.now) else check.now for check in checks]
            ratios = [value / check.then for value, check in zip(values, checks, strict=True) if check.then]
            yield GroupRow(
                group,
                metric,
                checks[0].bound,
                median(values),
                max(values),
                max(ratios, default=None),
                max(flight.metrics[SATURATED] for flight in flights),
                failed,
                len(checks),
            )


def _finding(summary: RegressSummary) -> str:
    """Return the result in one line."""
    failed, flights = len(summary.failed), len(summary.flights)
    return f"{flights - failed} of {flights} flights passed" + (f", {failed} failed" if failed else "")


def _remarks(summary: RegressSummary) -> list[str]:
    """Return what a reader should know of the baseline."""
    if summary.baseline is None:
        return ["compared with the bounds only; --update records this run for later ones"]
    found = [f"compared with the bounds and with {echo(summary.baseline)}"]
    if summary.settings_then != summary.settings:
        found.append("the controller's settings have changed since the metrics were recorded")
    if summary.better:
        found.append(
            f"{summary.better} flights are better than recorded by more than the tolerance; --update "
            "records them"
        )
    return found


def _cells(row: GroupRow) -> tuple[str, ...]:
    numbers = (
        "-" if one is None else digits(one) for one in (row.bound, row.middle, row.worst, row.over_recorded)
    )
    at_limit, failed = f"{100.0 * row.saturated_share:.1f} %", f"{row.failed} of {row.flights}"
    return (row.group, titled(row.metric), *numbers, at_limit, failed)


def junit_xml(summary: RegressSummary) -> bytes:
    """Return a summary as JUnit XML, which CI servers read: each flight is a test case of its group."""
    name = echo(f"{summary.suite}.{summary.controller}")
    counts = {"tests": str(len(summary.flights)), "failures": str(len(summary.failed)), "errors": "0"}
    root = ElementTree.Element("testsuites", counts)
    suite = ElementTree.SubElement(root, "testsuite", {"name": name, **counts, "skipped": "0"})
    for flight in summary.flights:
        case = ElementTree.SubElement(
            suite, "testcase", {"classname": f"{name}.{flight.group}", "name": flight.name}
        )
        if flight.failures:
            failure = ElementTree.SubElement(case, "failure", {"message": "; ".join(flight.failures)})
            failure.text = f"repeat it: mambo-nmpc fly --repeat {flight.record}, in the result folder"
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)) + b"\n"
