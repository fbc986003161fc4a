"""Statistics of a campaign: quantiles of the indices, crashes, improvement over the first controller.

Every index of a crashed flight is infinite: leaving such flights out would favour a controller that crashes
in difficult ones. Intervals are 95 % confidence intervals.
"""

import contextlib
import math
import sqlite3
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.errors import echo
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import ResultsError
from mambo_sil.experiment.campaign.campaign_flights import CRASHED, REFUSED, indices
from mambo_sil.experiment.campaign.store import FLIGHT, read_rows
from mambo_sil.results.metric_names import SEEN
from mambo_sil.results.summary import Number

QUANTILES: Final = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
COMPARED: Final = ("iae_m_s", "ise_m2_s", "itse_m2_s2", "itae_m_s2")
"""The indices of Table II."""

CONFIDENCE: Final = 0.95
RESAMPLES: Final = 9999
WORST: Final = 5
_SEED: Final = 0
"""Seed of the bootstrap, fixed so that the same table gives the same intervals."""

Table = Mapping[str, FloatArray]
"""Columns (n,) by name, in the order of the flights."""


def read_table(path: Path, names: Sequence[str] | None = None) -> Table:
    """Return the numeric columns of a database of flights, none if it has no flight; raises ResultsError.

    With `names` only the flights' numbers and the results of these controllers: half the memory.
    """
    columns: dict[str, array[float]] = {}
    starts = None if names is None else (FLIGHT, *(f"{name}_" for name in names))
    try:
        with contextlib.closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as database:
            for row in read_rows(database):
                if not columns:
                    wanted = [title for title in row if starts is None or title.startswith(starts)]
                    columns = {title: array("d") for title in wanted if not isinstance(row[title], str)}
                for title, column in columns.items():
                    column.append(row[title])  # type: ignore[arg-type] # a column has one type
    except sqlite3.Error as error:
        raise ResultsError(
            f"{echo(str(path))}: cannot be read as the database of a campaign: {error}; run campaign "
            "again, which also repairs what a killed run left"
        ) from error
    return {title: np.frombuffer(values) for title, values in columns.items()}


@dataclass(frozen=True)
class Proportion:
    """A share of flights with its Clopper-Pearson confidence interval."""

    count: int
    flights: int
    share: float
    low: float
    high: float


@dataclass(frozen=True)
class Distributions:
    """Results of a controller over all flights: shares, and quantiles by index and share."""

    crashed: Proportion
    refused_an_input: Proportion
    quantiles: dict[str, dict[str, Number]]


@dataclass(frozen=True)
class Improvement:
    """Ratio of an index of the first controller to another controller's, flight by flight.

    `median` is the median of the ratios, `low` and `high` its bootstrap interval, `better` the share of
    flights with a ratio above 1. Flights in which both crash have no ratio; `flights` counts the others.
    """

    controller: str
    index: str
    flights: int
    median: Number
    low: Number
    high: Number
    better: Proportion


def proportion(count: int, flights: int) -> Proportion:
    """Return the share `count` / `flights` with its Clopper-Pearson interval."""
    from scipy.special import betaincinv  # noqa: PLC0415 - takes a quarter of a second

    tail = (1.0 - CONFIDENCE) / 2.0
    low = betaincinv(count, flights - count + 1, tail) if count else 0.0
    high = betaincinv(count + 1, flights - count, 1.0 - tail) if count < flights else 1.0
    return Proportion(count, flights, count / flights, float(low), float(high))


def index_values(table: Table, name: str, index: str) -> FloatArray:
    """Return an index of a controller (n,), infinite where it crashed."""
    return np.where(table[f"{name}_{CRASHED}"] > 0.0, math.inf, table[f"{name}_{index}"])


def quantiles(values: FloatArray) -> dict[str, float]:
    """Return the `QUANTILES` of values (n,), without interpolation, because values may be infinite."""
    found = np.quantile(values, QUANTILES, method="inverted_cdf")
    return {f"{share:g}": float(value) for share, value in zip(QUANTILES, found, strict=True)}


def improvement(table: Table, first: str, name: str, index: str) -> Improvement | None:
    """Compare a controller with the first one on the same flights; None if both crash in every flight."""
    ours, theirs = index_values(table, name, index), index_values(table, first, index)
    comparable = np.isfinite(ours) | np.isfinite(theirs)
    if not comparable.any():
        return None
    with np.errstate(divide="ignore"):
        ratios = theirs[comparable] / ours[comparable]
    low, high = _median_interval(ratios)
    return Improvement(
        controller=name,
        index=index,
        flights=len(ratios),
        median=float(np.median(ratios)),
        low=low,
        high=high,
        better=proportion(int((ratios > 1.0).sum()), len(ratios)),
    )


def _median_interval(values: FloatArray) -> tuple[float, float]:
    """Return the percentile bootstrap interval of the median of values (n,); NaN for a single one.

    A resample takes n of the sorted values at random, so its two middle values stand at n times the middle
    order statistics of n uniform numbers: these are drawn instead of the resample. The k-th of n is beta
    distributed with k and n - k + 1; the next one is the least of n - k numbers between it and 1 (Arnold,
    Balakrishnan, Nagaraja: A First Course in Order Statistics, sections 2.2 and 2.4).
    """
    n = len(values)
    if n < 2:
        return math.nan, math.nan
    ordered, random, middle = np.sort(values), np.random.default_rng(_SEED), (n + 1) // 2
    lower = random.beta(middle, n - middle + 1, RESAMPLES)
    upper = lower + (1.0 - lower) * random.beta(1, n - middle, RESAMPLES) if n % 2 == 0 else lower
    ranks = [np.minimum((n * share).astype(np.int64), n - 1) for share in (lower, upper)]
    medians = 0.5 * (ordered[ranks[0]] + ordered[ranks[1]])
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.quantile(medians, (tail, 1.0 - tail), method="inverted_cdf")
    return float(low), float(high)


def worst_flights(table: Table, name: str) -> list[int]:
    """Return the rows of the `WORST` worst flights of a controller: crashes first, then by IAE."""
    order = np.lexsort((-np.nan_to_num(table[f"{name}_iae_m_s"], nan=math.inf), -table[f"{name}_{CRASHED}"]))
    return [int(position) for position in order[:WORST]]


def distributions(
    table: Table, names: Sequence[str], *, sensed: bool, spatial: bool = False
) -> dict[str, Distributions]:
    """Return crashes, rejected inputs and quantiles of each controller."""
    return {
        name: Distributions(
            crashed=_share(table[f"{name}_{CRASHED}"]),
            refused_an_input=_share(table[f"{name}_{REFUSED}"]),
            quantiles={
                index: quantiles(index_values(table, name, index))
                for index in indices(sensed=sensed, spatial=spatial)
            },
        )
        for name in names
    }


def improvements(table: Table, names: Sequence[str], *, sensed: bool) -> list[Improvement]:
    """Compare every controller with the first one."""
    compared = [*COMPARED, *(SEEN + index for index in COMPARED if sensed)]
    found = [improvement(table, names[0], name, index) for name in names[1:] for index in compared]
    return [one for one in found if one is not None]


def _share(values: NDArray[Any]) -> Proportion:
    return proportion(int((values > 0).sum()), len(values))
