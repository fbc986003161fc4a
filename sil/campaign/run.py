"""Run a campaign: fly the flights that are missing in its folder, batch by batch.

A task is one batch with one controller, so that several workers share a batch and finish it early.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Final

from mambo_nmpc.codegen import __version__
from mambo_nmpc.sil.campaign.executors import Pool
from mambo_nmpc.sil.campaign.file import Campaign
from mambo_nmpc.sil.campaign.flights import Row, columns, fly_batch
from mambo_nmpc.sil.campaign.parameters import PARAMETERS
from mambo_nmpc.sil.campaign.store import FlightStore, open_store
from mambo_nmpc.sil.errors import FlightError

MOST_IN_A_BATCH: Final = 100
"""Flights in one simulation: a trace of 100 s takes 2 MB, and larger batches are hardly faster."""


def table_columns(campaign: Campaign) -> tuple[str, ...]:
    """Return the columns of the table after the flight's number: seed, draws, results."""
    names = [entrant.name for entrant in campaign.entrants]
    sensed = campaign.file.flight.sensors != "none"
    return ("seed", *PARAMETERS, *columns(names, sensed=sensed))


def open_campaign(campaign: Campaign, folder: Path) -> AbstractContextManager[FlightStore]:
    """Open and lock the folder of a campaign; raises what `open_store` raises."""
    return open_store(folder, campaign.document(), table_columns(campaign), campaign.draw)


def missing_flights(store: FlightStore, flights: int) -> list[int]:
    """Return the numbers of the flights that are not in the table.

    Raises FlightError if the table has more than `flights`.
    """
    last = max(store.lines, default=-1)
    if last >= flights:
        raise FlightError(
            f"{store.folder}: already has flight {last}; --flights must be {last + 1} or more, "
            "or name another folder with -o"
        )
    return [flight for flight in range(flights) if flight not in store.lines]


def fly_missing(
    campaign: Campaign,
    store: FlightStore,
    flights: int,
    pool: Pool,
    progress: Callable[[int], None],
    *,
    running: Callable[[float], None] = lambda _: None,
    batch: int = MOST_IN_A_BATCH,
) -> None:
    """Fly the missing flights and store them.

    Calls `progress` with the number of finished flights, `running` with what the unfinished amount to.
    """
    left = missing_flights(store, flights)
    size = max(1, min(batch, -(-len(left) // pool.workers)))
    batches = [left[first : first + size] for first in range(0, len(left), size)]
    drawn = {flight: campaign.draw(flight) for flight in left}
    section, count = campaign.file.flight.model_dump(), len(campaign.entrants)
    tasks = [
        (__version__, [entrant.document()], section, [drawn[flight] for flight in numbers])
        for numbers in batches
        for entrant in campaign.entrants
    ]
    parts: dict[int, list[list[Row]]] = {number: [] for number in range(len(batches))}
    progress(len(store.lines))

    def look(shares: float) -> None:
        waiting = sum(len(found) for found in parts.values())
        running((shares + waiting) * size / count)

    for task, rows in pool.run(fly_batch, tasks, look):
        number = task // count
        parts[number].append(rows)
        if len(parts[number]) == count:
            whole = [reduce(or_, of_one_flight) for of_one_flight in zip(*parts.pop(number), strict=True)]
            flown = zip(batches[number], whole, strict=True)
            store.add({flight: drawn[flight] | row for flight, row in flown})
            progress(len(store.lines))
