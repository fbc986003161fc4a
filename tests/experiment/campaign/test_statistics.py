"""Statistics of a campaign and their picture: tables, intervals, crashes, which indices are compared."""

import contextlib
import math
from itertools import product
from pathlib import Path
from statistics import median
from xml.etree import ElementTree

import numpy as np
import pytest

from mambo_sil.errors import ResultsError
from mambo_sil.experiment.campaign.campaign_flights import INDICES, SEEN_INDICES
from mambo_sil.experiment.campaign.campaign_plots import draw_campaign
from mambo_sil.experiment.campaign.statistics import (
    COMPARED,
    distributions,
    improvement,
    improvements,
    proportion,
    quantiles,
    read_table,
    worst_flights,
)
from mambo_sil.experiment.campaign.store import DATABASE, FlightStore
from mambo_sil.flight.metrics import HEIGHT_METRICS
from mambo_sil.results.metric_names import SEEN

COLUMNS = ("trajectory", "mass_kg", "pd_trace_sha256")


def test_a_table_is_read_by_column(tmp_path: Path) -> None:
    """Columns of numbers only, in the order of the flights."""
    with contextlib.closing(FlightStore(tmp_path, COLUMNS, "")) as store:
        assert read_table(tmp_path / DATABASE) == {}
        store.add({1: dict(zip(COLUMNS, ("hover", math.nan, "cd"), strict=True))})
        store.add({0: dict(zip(COLUMNS, ("circle", 0.07, "ab"), strict=True))})
        found = read_table(tmp_path / DATABASE)
    assert list(found) == ["flight", "mass_kg"]
    assert found["flight"].tolist() == [0.0, 1.0]
    np.testing.assert_array_equal(found["mass_kg"], [0.07, math.nan])


def test_what_cannot_be_read_is_no_database(tmp_path: Path) -> None:
    """A folder, a missing file, a file without flights, and text."""
    (tmp_path / "text").write_text("flight,mass_kg\n" * 100)
    (tmp_path / "empty").touch()
    for name in (".", "absent", "empty", "text"):
        with pytest.raises(
            ResultsError, match=r"cannot be read as the database of a campaign: .*; run campaign again"
        ):
            read_table(tmp_path / name)


def test_quantiles_are_named_by_their_shares() -> None:
    """Extremes, 90 %, quartiles and median."""
    assert list(quantiles(np.arange(3.0))) == ["0", "0.05", "0.25", "0.5", "0.75", "0.95", "1"]


def table(**columns: list[float]) -> dict[str, np.ndarray]:
    """Return a table of controllers a and b with the given columns; by default nothing crashes."""
    n = len(next(iter(columns.values())))
    healthy = {f"{name}_crashed": [0.0] * n for name in "ab"}
    return {name: np.array(values, np.float64) for name, values in (healthy | columns).items()}


def compared(ratios: list[float]) -> tuple[float, float]:
    """Return the interval of the median of ratios."""
    found = improvement(table(a_iae_m_s=ratios, b_iae_m_s=[1.0] * len(ratios)), "a", "b", "iae_m_s")
    assert found is not None
    return float(found.low), float(found.high)


@pytest.mark.parametrize("n", [9, 10, 40, 41])
def test_the_interval_of_the_median_of_two_values_follows_from_the_binomial_distribution(n: int) -> None:
    """A resample's number of small values is binomial: they are its median if there are more than n / 2."""
    judged = 0
    for small in range(1, n):
        chances = [math.comb(n, k) * (small / n) ** k * (1 - small / n) ** (n - k) for k in range(n + 1)]
        at_most_1 = sum(chance for k, chance in enumerate(chances) if 2 * k > n)
        at_most_2 = sum(
            chance for k, chance in enumerate(chances) if 2 * k >= n
        )  # half the values: mean of both
        if min(abs(at - end) for at in (at_most_1, at_most_2) for end in (0.025, 0.975)) < 0.004:
            continue  # within the spread of the drawn resamples
        judged += 1
        expected = [1.0 if at_most_1 >= end else 2.0 if at_most_2 >= end else 3.0 for end in (0.025, 0.975)]
        assert list(compared([1.0] * small + [3.0] * (n - small))) == expected
    assert judged > n / 2


def test_an_index_of_0_is_infinitely_better() -> None:
    """A ratio to it is no error and no warning."""
    found = improvement(table(a_iae_m_s=[1.0] * 3, b_iae_m_s=[0.0] * 3), "a", "b", "iae_m_s")
    assert found is not None
    assert (found.median, found.better.count) == (math.inf, 3)


def test_a_single_ratio_has_no_interval() -> None:
    """One flight says nothing of the spread; two flights have one."""
    assert all(map(math.isnan, compared([2.0])))
    assert compared([1.0, 2.0]) == (1.0, 2.0)


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("sensed", [False, True])
def test_all_controllers_are_compared_with_the_first(sensed: bool, spatial: bool) -> None:
    """By the indices of Table II, then by those of the estimated error; where all crash, by none."""
    shown = [index for index in INDICES if spatial or index not in HEIGHT_METRICS]
    indices = [*shown, *(SEEN + index for index in SEEN_INDICES if index in shown)]
    table = {
        f"{name}_{index}": np.full(4, value)
        for name, value in zip("abc", (6.0, 2.0, 3.0), strict=True)
        for index in indices
    }
    table |= {f"{name}_{key}": np.zeros(4) for name in "abc" for key in ("crashed", "refused_updates")}
    table["b_crashed"][1], table["c_refused_updates"][:3] = 1.0, 7.0
    found = improvements(table, "abc", sensed=sensed)
    names = [*COMPARED, *(SEEN + index for index in COMPARED if sensed)]
    assert [(one.controller, one.index) for one in found] == [
        (name, index) for name in "bc" for index in names
    ]
    assert [one.median for one in found] == [3.0] * len(names) + [2.0] * len(names)
    assert [one.better.count for one in found] == [3] * len(names) + [4] * len(names)
    spread = distributions(table, "abc", sensed=sensed, spatial=spatial)
    assert [(one.crashed.count, one.refused_an_input.count) for one in spread.values()] == [
        (0, 0),
        (1, 0),
        (0, 3),
    ]
    assert list(spread["b"].quantiles) == (indices if sensed else shown)
    assert spread["b"].quantiles["iae_m_s"]["1"] == math.inf
    hopeless = table | {f"{name}_crashed": np.ones(4) for name in "ab"}
    assert {one.controller for one in improvements(hopeless, "abc", sensed=sensed)} == {"c"}


def test_a_proportion_has_the_interval_of_clopper_and_pearson() -> None:
    """For 0 of 10 the upper limit solves (1 - p)^10 = 2.5 %; the interval for 10 of 10 mirrors it."""
    none, every = proportion(0, 10), proportion(10, 10)
    limit = 1.0 - 0.025 ** (1 / 10)
    assert [none.low, none.high] == pytest.approx([0.0, limit])
    assert [every.low, every.high] == pytest.approx([1.0 - limit, 1.0])
    assert proportion(3, 12).share == 0.25


@pytest.mark.parametrize(("count", "flights"), [(1, 2), (3, 12), (40, 41), (7, 500)])
def test_the_limits_of_a_proportion_leave_two_and_a_half_percent_on_each_side(
    count: int, flights: int
) -> None:
    """With the lower limit as probability, `count` or more have that chance; with the upper one, no more."""

    def chance(counts: range, share: float) -> float:
        return sum(math.comb(flights, k) * share**k * (1.0 - share) ** (flights - k) for k in counts)

    found = proportion(count, flights)
    assert chance(range(count, flights + 1), found.low) == pytest.approx(0.025, rel=1e-9)
    assert chance(range(count + 1), found.high) == pytest.approx(0.025, rel=1e-9)


def test_quantiles_are_values_of_the_sample() -> None:
    """Quantiles are not interpolated, so an infinite value affects only quantiles that select it."""
    values = np.array([4.0, math.inf, 1.0, 3.0, 2.0])
    found = quantiles(values)
    assert (found["0"], found["0.25"], found["0.5"], found["0.75"]) == (1.0, 2.0, 3.0, 4.0)
    assert (found["0.95"], found["1"]) == (math.inf, math.inf)


def test_improvement_is_the_median_of_the_ratios() -> None:
    """Median and share of better flights are those of the ratios flight by flight."""
    found = improvement(
        table(a_iae_m_s=[2.0, 9.0, 4.0, 1.0, 8.0], b_iae_m_s=[1.0, 3.0, 1.0, 2.0, 8.0]), "a", "b", "iae_m_s"
    )
    assert found is not None
    assert found.median == 2.0  # of 2, 3, 4, 0.5, 1
    assert (found.better.count, found.better.flights) == (3, 5)
    assert 0.5 <= found.low <= 2.0 <= found.high <= 4.0


def test_the_interval_of_the_median_covers_it_and_narrows() -> None:
    """For lognormal ratios the interval contains exp(mu) and has about the asymptotic width."""
    ratios = np.exp(np.random.default_rng(1).normal(math.log(3.0), 0.5, 1000))
    low, high = compared(ratios.tolist())
    assert low < 3.0 < high
    width = 2.0 * 1.96 * 3.0 * 0.5 * math.sqrt(math.pi / 2.0 / 1000)
    assert high - low == pytest.approx(width, rel=0.25)


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6])
def test_the_interval_of_the_median_is_that_of_all_resamples(n: int) -> None:
    """Its ends are quantiles of the medians of all n^n resamples, each equally probable."""
    ratios = [float(2**k) for k in range(n)]
    medians = sorted(median(resample) for resample in product(ratios, repeat=n))
    assert list(compared(ratios)) == [medians[math.ceil(tail * len(medians)) - 1] for tail in (0.025, 0.975)]


def test_a_crash_is_infinitely_bad() -> None:
    """A controller that crashes is worse in that flight; flights in which both crash are left out."""
    columns = table(
        a_iae_m_s=[1.0, 1.0, 1.0, 1.0],
        b_iae_m_s=[0.5, 0.5, 0.5, 0.5],
        a_crashed=[0.0, 1.0, 0.0, 1.0],
        b_crashed=[0.0, 0.0, 1.0, 1.0],
    )
    found = improvement(columns, "a", "b", "iae_m_s")
    assert found is not None
    assert found.flights == 3
    assert found.median == 2.0  # of 2, infinite, 0
    assert found.better.count == 2
    hopeless = table(a_iae_m_s=[1.0], b_iae_m_s=[1.0], a_crashed=[1.0], b_crashed=[1.0])
    assert improvement(hopeless, "a", "b", "iae_m_s") is None


def test_the_worst_flights_are_crashes_then_the_largest_iae() -> None:
    """At most five flights are returned; a lost flight, whose IAE is NaN, is among the crashes."""
    columns = table(a_iae_m_s=[1.0, 7.0, math.nan, 3.0, 2.0, 9.0], a_crashed=[0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    assert worst_flights(columns, "a") == [2, 3, 5, 1, 4]


def test_statistics_are_reproducible() -> None:
    """The same table gives the same statistics, bootstrap intervals included."""
    rng = np.random.default_rng(2)
    columns = {f"{name}_{index}": rng.uniform(1.0, 2.0, 20) for name in "ab" for index in INDICES}
    columns |= {f"{name}_{key}": np.zeros(20) for name in "ab" for key in ("crashed", "refused_updates")}
    assert improvements(columns, "ab", sensed=False) == improvements(columns, "ab", sensed=False)


def test_few_very_large_values_leave_the_others_wide(tmp_path: Path) -> None:
    """One flight of a hundred that gets lost does not squeeze the curves: its value has no tick."""
    values = np.geomspace(10.0, 40.0, 100)
    table = {
        f"{name}_{index}": values * factor
        for name, factor in (("pd", 2.0), ("mambo", 1.0))
        for index in (*COMPARED, "max_error_m", "command_variation_rad")
    }
    table |= {f"{name}_crashed": np.zeros(100) for name in ("pd", "mambo")}
    for index in COMPARED:
        table[f"mambo_{index}"] = np.append(values[:-1], 1e7)
    _, svg = draw_campaign(table, ["pd", "mambo"], "near", "mambo", tmp_path / "campaign")
    texts = [element.text or "" for element in ElementTree.parse(svg).iter() if element.tag.endswith("text")]
    assert {"10", "30"} <= set(texts)
    assert "1e+06" not in texts
    assert any("better: IAE, m s" in text for text in texts)
    assert any(text.startswith("times closer than pd") for text in texts)
    assert {"near", "mambo"} <= set(texts)
