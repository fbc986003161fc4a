"""Run a campaign: fly the flights that are missing in its folder, batch by batch."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Final

from mambo_codegen import __version__
from mambo_sil.errors import FlightError
from mambo_sil.experiment.campaign.campaign_file import Campaign
from mambo_sil.experiment.campaign.campaign_flights import columns, fly_batch
from mambo_sil.experiment.campaign.executors import Pool
from mambo_sil.experiment.campaign.parameters import PARAMETERS, Draw
from mambo_sil.experiment.campaign.store import FlightStore, open_store

MOST_IN_A_BATCH: Final = 20
"""Flights in one task: about a second with two controllers, and larger batches are hardly faster."""


def table_columns(campaign: Campaign) -> tuple[str, ...]:
    """Return the columns of the table after the flight's number: seed, draws, results."""
    names = [entrant.name for entrant in campaign.entrants]
    sensed = campaign.file.flight.sensors != "none"
    return ("seed", *PARAMETERS, *columns(names, sensed=sensed))


def open_campaign(campaign: Campaign, folder: Path) -> AbstractContextManager[FlightStore]:
    """Open and lock the folder of a campaign; raises what `open_store` raises."""
    return open_store(folder, campaign.document(), table_columns(campaign))


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
    entrants = [entrant.document() for entrant in campaign.entrants]
    section = campaign.flight
    drawn: dict[int, list[Draw]] = {}

    def tasks() -> Iterator[tuple[Any, ...]]:
        for number, flown in enumerate(batches):
            drawn[number] = [campaign.draw(flight) for flight in flown]
            yield __version__, entrants, section, drawn[number]

    progress(len(store.finished))
    for number, rows in pool.run(fly_batch, tasks(), lambda shares: running(shares * size)):
        flown = zip(batches[number], drawn.pop(number), rows, strict=True)
        store.add({flight: draws | row for flight, draws, row in flown})
        progress(len(store.finished))
