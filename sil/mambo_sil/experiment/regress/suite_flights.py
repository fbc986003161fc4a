"""Fly a suite: its flights in batches, each batch in a worker process."""

from collections.abc import Callable, Iterator

from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.methods import method_of
from mambo_sil.errors import FlightError, WorkerError
from mambo_sil.experiment.campaign.campaign_flights import MOST_TOGETHER, OF_LIMITS, Row, fly_scenarios
from mambo_sil.experiment.campaign.executors import Pool
from mambo_sil.experiment.inputs import Entrant
from mambo_sil.experiment.regress.suite_file import FlightSuite
from mambo_sil.flight.scenario import SHARED_KEYS, flight_of

_LONGEST_BATCH_S = 10_000.0
"""Sum of the durations in a batch: their traces take 200 MB."""


def demand_flyable(suite: FlightSuite, entrant: Entrant, place: str) -> None:
    """Raise InvalidSettingsError, which begins with `place`, if a flight cannot be simulated or judged."""
    if entrant.kind != "nmpc" or method_of(entrant.settings).limiting is None:
        for flight in suite.flights:
            wanted = [key for key in ("fence_m",) if getattr(flight.scenario, key)]
            wanted += [name for name in OF_LIMITS if name in flight.bounds]
            if wanted:
                raise InvalidSettingsError(
                    (
                        f"{place}: flights.{flight.group}.{wanted[0]}: wants a controller with limits; "
                        "give it limits.speed_m_s, limits.braking_m_s2 or limits.fence",
                    )
                )
    kinds = {tuple(getattr(flight.scenario, key) for key in SHARED_KEYS): flight for flight in suite.flights}
    for one in kinds.values():
        try:
            flight_of([one.scenario], entrant.settings.horizon.update_period_s)
        except FlightError as error:
            raise InvalidSettingsError((f"{place}: flights.{one.group}: {error}",)) from None


def fly_suite(
    suite: FlightSuite,
    entrant: Entrant,
    pool: Pool,
    progress: Callable[[int], None],
) -> list[Row]:
    """Fly all flights of a suite and return their results by metric, in order.

    Calls `progress` with the number of finished flights. Raises WorkerError if a worker fails, BuildError if
    there is no compiler.
    """
    batches = list(_batches(suite, pool.workers))
    tasks = [([entrant], [suite.flights[number].scenario for number in batch]) for batch in batches]
    rows: dict[int, Row] = {}
    progress(0)
    try:
        for task, found in pool.run(fly_scenarios, tasks):
            rows |= dict(zip(batches[task], found, strict=True))
            progress(len(rows))
    except WorkerError:
        raise WorkerError("a worker process has died; nothing was written, run the command again") from None
    prefix = f"{entrant.name}_"
    return [
        {key.removeprefix(prefix): value for key, value in rows[number].items()} for number in sorted(rows)
    ]


def _batches(suite: FlightSuite, workers: int) -> Iterator[list[int]]:
    """Yield the numbers of flights that are simulated together."""
    alike: dict[tuple[object, ...], list[int]] = {}
    for number, flight in enumerate(suite.flights):
        shared = tuple(getattr(flight.scenario, key) for key in SHARED_KEYS)
        alike.setdefault(shared, []).append(number)
    for numbers in alike.values():
        longest = int(_LONGEST_BATCH_S / suite.flights[numbers[0]].scenario.duration_s)
        size = min(MOST_TOGETHER, -(-len(numbers) // workers), longest)
        yield from (numbers[first : first + size] for first in range(0, len(numbers), size))
