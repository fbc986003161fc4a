"""The metrics of a flight against their limits: bounds, and recorded values with a tolerance."""

from dataclasses import dataclass
from typing import Final

from mambo_sil.experiment.campaign.campaign_flights import (
    CRASHED,
    DIGEST,
    INDICES,
    OF_LIMITS,
    REFUSED,
    SATURATED,
    Row,
)
from mambo_sil.experiment.regress.baseline import Recorded
from mambo_sil.experiment.regress.suite_file import FlightSuite
from mambo_sil.results.metric_names import named
from mambo_sil.results.number_format import digits
from mambo_sil.results.summary import Number

RECORDS: Final = "flights"
"""Folder of the records of failed flights."""


@dataclass(frozen=True)
class Check:
    """One metric of a flight against its limit, the smaller of bound and recorded value plus tolerance."""

    metric: str
    now: Number
    bound: float | None
    then: float | None
    """The recorded value, if it is compared."""
    limit: float
    holds: bool


@dataclass(frozen=True)
class JudgedFlight:
    """One flight of a suite; `same_bits` is None unless its trace was compared with the recorded one."""

    group: str
    name: str
    metrics: dict[str, Number]
    checks: list[Check]
    same_bits: bool | None
    record: str | None
    """File for `fly --repeat`; only of a failed flight."""

    @property
    def failures(self) -> list[str]:
        """What failed, in words."""
        found = [_explain(check) for check in self.checks if not check.holds]
        return found + (["the trace differs from the recorded one"] if self.same_bits is False else [])


def judge_flight(suite: FlightSuite, number: int, row: Row, held: Recorded) -> JudgedFlight:
    """Compare flight `number` of a suite with its bounds, and with the values recorded of it, if any."""
    flight = suite.flights[number]
    counts: dict[str, Number] = {name: int(row[name]) for name in (CRASHED, REFUSED)}
    found = (*INDICES, SATURATED, *(name for name in OF_LIMITS if name in row))
    metrics = counts | {name: float(row[name]) for name in found}
    checks = [
        _check(name, now, flight.bounds.get(name), suite.tolerances.get(name), held.get(name))
        for name, now in metrics.items()
        if name in flight.bounds or (name in suite.tolerances and held.get(name) is not None)
    ]
    same_bits = row[DIGEST] == held[DIGEST] if suite.same_bits and held else None
    failed = same_bits is False or not all(check.holds for check in checks)
    record = f"{RECORDS}/{number:04}-{flight.group}.json" if failed else None
    return JudgedFlight(flight.group, flight.name, metrics, checks, same_bits, record)


def _check(
    metric: str, now: float, bound: float | None, tolerance: float | None, held: float | str | None
) -> Check:
    """Compare a metric; one that is NaN, because the flight was lost, exceeds every limit."""
    limits, then = [] if bound is None else [bound], None
    if tolerance is not None and held is not None:
        then = float(held)
        limits.append(then * (1.0 + tolerance))
    limit = min(limits)
    return Check(metric, now, bound, then, limit, now <= limit)


def is_better(result: JudgedFlight, suite: FlightSuite) -> bool:
    """Return whether a metric of a flight is below its recorded value by more than its tolerance."""
    return any(
        check.then is not None and check.now < check.then * (1.0 - suite.tolerances[check.metric])
        for check in result.checks
    )


def _explain(check: Check) -> str:
    """Return what is wrong with a metric: its value, its bound and its recorded value."""
    if check.metric == CRASHED:
        return CRASHED
    limits = []
    if check.bound is not None:
        limits.append(f"bound {digits(check.bound)}")
    if check.then is not None:
        limits.append(f"recorded {digits(check.then)}")
    if check.limit != check.bound:
        limits[-1] += f", so at most {digits(check.limit)}"
    name, unit = named(check.metric)
    value = " ".join(filter(None, (name, digits(check.now), unit)))
    return f"{value} ({'; '.join(limits)})"
