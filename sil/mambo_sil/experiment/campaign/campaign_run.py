"""Run a campaign: fly the flights that are missing in its folder, batch by batch."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from itertools import islice
from pathlib import Path
from typing import Any, Final

from mambo_codegen import __version__
from mambo_sil.errors import FlightError
from mambo_sil.experiment.campaign.campaign_file import Campaign
from mambo_sil.experiment.campaign.campaign_flights import FAILURE, columns, fly_batch
from mambo_sil.experiment.campaign.executors import Pool
from mambo_sil.experiment.campaign.parameters import PARAMETERS, Draw
from mambo_sil.experiment.campaign.store import FlightStore, open_store

FIRST_BATCH: Final = 20
"""Flights in one of the first tasks: half a second with three controllers."""

LARGEST_BATCH: Final = 320
"""Flights in a task of a long campaign: some 8 s. A task costs a scheduler about a millisecond."""

_TASKS_PER_SIZE: Final = 4
"""Tasks of each worker after which they double, and in how many the flights that are left shall fit."""


def table_columns(campaign: Campaign) -> tuple[str, ...]:
    """Return the columns of the table after the flight's number: seed, draws, results."""
    names, sensed = [entrant.name for entrant in campaign.entrants], campaign.file.flight.sensors != "true"
    return ("seed", *PARAMETERS, *columns(names, sensed=sensed, spatial=campaign.spatial))


def open_campaign(campaign: Campaign, folder: Path) -> AbstractContextManager[FlightStore]:
    """Open and lock the folder of a campaign; raises what `open_store` raises."""
    return open_store(folder, campaign.document(), table_columns(campaign), campaign.places())


def missing_flights(store: FlightStore, flights: int) -> list[int]:
    """Return the numbers of the flights that are not in the store.

    Raises FlightError if the store has more than `flights`.
    """
    last = max(store.finished, default=-1)
    if last >= flights:
        raise FlightError(
            f"{store.folder}: already has flight {last}; --flights must be {last + 1} or more, "
            "or name another folder with -o"
        )
    return [flight for flight in range(flights) if flight not in store.finished]


def batch_sizes(flights: int, workers: int, first: int) -> Iterator[int]:
    """Yield the flights of each task: `first` in the beginning, then more, and fewer towards the end."""
    number, least = 0, min(first, -(-flights // workers))
    while flights > 0:
        grown = min(first << min(number // (_TASKS_PER_SIZE * workers), 20), max(LARGEST_BATCH, first))
        share = -(-flights // (_TASKS_PER_SIZE * workers))
        size = min(max(min(grown, share), least), flights)
        yield size
        flights -= size
        number += 1


def fly_missing(
    campaign: Campaign,
    store: FlightStore,
    flights: int,
    pool: Pool,
    progress: Callable[[int], None],
    *,
    running: Callable[[float], None] = lambda _: None,
    failed: Callable[[str, int, str], None] = lambda *_: None,
    batch: int = FIRST_BATCH,
) -> None:
    """Fly the missing flights and store them.

    Calls `progress` with the number of finished flights, `running` with what the unfinished amount to,
    `failed` with name, flight and reason of each law of the user's own that failed.
    """
    left = missing_flights(store, flights)
    sizes = list(batch_sizes(len(left), pool.workers, batch))
    batches = iter(left)
    entrants = [entrant.document() for entrant in campaign.entrants]
    section = campaign.flight
    drawn: dict[int, dict[int, Draw]] = {}

    def tasks() -> Iterator[tuple[Any, ...]]:
        for number, size in enumerate(sizes):
            drawn[number] = {flight: campaign.draw(flight) for flight in islice(batches, size)}
            yield __version__, entrants, section, list(drawn[number].values())

    def report(shares: float) -> None:
        if drawn:
            running(shares * sum(map(len, drawn.values())) / len(drawn))

    progress(len(store.finished))
    for number, rows in pool.run(fly_batch, tasks(), report):
        flown = list(zip(drawn.pop(number).items(), rows, strict=True))
        store.add({flight: draws | row for (flight, draws), row in flown})
        for (flight, _), row in flown:
            for entrant in campaign.entrants:
                if failure := row.get(f"{entrant.name}_{FAILURE}"):
                    failed(entrant.name, flight, str(failure))
        progress(len(store.finished))
