"""Flying a suite: batches, their order, and what cannot be flown."""

from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from pathlib import Path

import pytest

from mambo_codegen.errors import InvalidSettingsError
from mambo_sil.experiment.campaign.campaign_flights import fly_scenarios
from mambo_sil.experiment.campaign.executors import Pool
from mambo_sil.experiment.inputs import Entrant, load_entrant
from mambo_sil.experiment.regress.suite_file import FlightSuite, load_suite
from mambo_sil.experiment.regress.suite_flights import _batches, demand_flyable, fly_suite


def suite(folder: Path, text: str) -> FlightSuite:
    """Write and load a suite."""
    path = folder / "mine.toml"
    path.write_text(text, "utf-8")
    return load_suite(str(path))


def controller(folder: Path, period_s: float) -> Entrant:
    """Return preset table1 with another update period."""
    path = folder / "slow.toml"
    path.write_text(f"horizon.update_period_s = {period_s}\n", "utf-8")
    return load_entrant("slow.toml", folder, "test")


@pytest.mark.parametrize(
    ("flights", "duration_s", "workers", "sizes"),
    [
        (1, 1.0, 1, [1]),
        (20, 1.0, 1, [20]),
        (45, 1.0, 1, [20, 20, 5]),
        (45, 1.0, 2, [20, 20, 5]),
        (45, 1.0, 4, [12, 12, 12, 9]),
        (3, 1.0, 8, [1, 1, 1]),
        (6, 2500.0, 1, [4, 2]),
        (5, 3600.0, 1, [2, 2, 1]),
    ],
)
def test_a_batch_is_a_share_of_the_flights_up_to_a_limit(
    tmp_path: Path, *, flights: int, duration_s: float, workers: int, sizes: list[int]
) -> None:
    """At most 20 flights, 10000 s of flight, and no more than leaves a batch for each worker."""
    seeds = "7" if flights == 1 else f"{{ from = 1, to = {flights}, count = {flights} }}"
    found = suite(tmp_path, f"[flights.eight]\nduration_s = {duration_s}\nseed = {seeds}")
    batches = list(_batches(found, workers))
    assert [len(batch) for batch in batches] == sizes
    assert list(chain.from_iterable(batches)) == list(range(flights))


def test_flights_are_flown_in_groups_of_one_kind_and_come_back_in_order(tmp_path: Path) -> None:
    """Durations, starts and sensors cannot be mixed in a batch; each row is that of the flight alone."""
    found = suite(
        tmp_path,
        """
        [flights.eight]
        yaw_rad = [0.0, 0.5]
        duration_s = [0.2, 0.1]
        sensors = ["true", "mambo"]
        """,
    )
    pd, finished = load_entrant("pd", tmp_path, "test"), list[int]()
    with ThreadPoolExecutor(1) as thread:
        rows = fly_suite(found, pd, Pool(thread, 1, lambda _: None), finished.append)
    assert finished == [0, 2, 4, 6, 8]
    for row, flight in zip(rows, found.flights, strict=True):
        (alone,) = fly_scenarios([pd], [flight.scenario])
        assert {f"pd_{key}": value for key, value in row.items()} == alone


def test_a_flight_that_cannot_be_simulated_is_named(tmp_path: Path) -> None:
    """Its duration against the update period, which must be a multiple of the tick."""
    found = suite(tmp_path, "[flights.eight]\nduration_s = 1.0\n[flights.brief]\nduration_s = 0.01")
    demand_flyable(found, controller(tmp_path, 0.01), "here")
    with pytest.raises(
        InvalidSettingsError,
        match=r"^here: flights\.brief: duration_s = 0\.01 must be .*update_period_s = 0\.02",
    ):
        demand_flyable(found, controller(tmp_path, 0.02), "here")
