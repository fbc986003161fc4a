"""The command `campaign`: many drawn flights, and statistics of all of them."""

import contextlib
import os
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Annotated, Any

import typer

from mambo_nmpc.codegen import cli as generating
from mambo_nmpc.codegen.atomic import put
from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.sil.campaign import file
from mambo_nmpc.sil.campaign.executors import Pool, cluster, processes
from mambo_nmpc.sil.campaign.file import Campaign
from mambo_nmpc.sil.campaign.report import RECORDS, campaign_text, numeric, summary_of, write_records
from mambo_nmpc.sil.campaign.run import fly_missing, missing, opened
from mambo_nmpc.sil.campaign.store import TABLE, Store, refusals
from mambo_nmpc.sil.cli.boards import AsJson
from mambo_nmpc.sil.cli.progress import counting_bar
from mambo_nmpc.sil.files.folders import SUMMARY, summary_text

PICTURE = "campaign"
_MOST_FLIGHTS = 100_000
_MOST_WORKERS = 1024


def register(app: typer.Typer) -> None:
    """Add the command of this module to `app`."""
    app.command(
        epilog=generating.examples(
            "mambo-nmpc campaign -o campaign",
            "mambo-nmpc campaign campaign.toml --flights 200 -o campaign",
            "mambo-nmpc campaign --scheduler tcp://10.0.0.1:8786 -o campaign",
        )
    )(campaign)


def campaign(
    source: Annotated[
        Path | None, typer.Argument(help="A campaign.toml; without one the default campaign is flown.")
    ] = None,
    *,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Folder for the results; a campaign begun there goes on."),
    ] = Path("campaign"),
    flights: Annotated[int, typer.Option(help="Flights in all.", min=1, max=_MOST_FLIGHTS)] = 1000,
    workers: Annotated[
        int | None,
        typer.Option(
            help="Processes on this machine; one for each processor by default.", min=1, max=_MOST_WORKERS
        ),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a running Dask scheduler, whose workers fly instead.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Fly many drawn flights with several controllers, and say how they compare; goes on where it stopped."""
    if workers is not None and scheduler is not None:
        raise typer.BadParameter("it names the workers: leave out --workers", param_hint="--scheduler")
    chosen = file.default() if source is None else file.read(source)
    with _pool(workers, scheduler) as pool, opened(chosen, output) as store:
        if missing(store, flights):
            _fly(chosen, store, flights, pool)
        summary = _finish(chosen, store)
    text = summary_text("campaign", summary)
    typer.echo(text if as_json else campaign_text(summary, str(output)), nl=not as_json)
    typer.echo(f"{echo(str(output))}: {TABLE}, {SUMMARY}, {PICTURE}.png, {PICTURE}.svg, {RECORDS}/", err=True)


def _pool(workers: int | None, scheduler: str | None) -> AbstractContextManager[Pool]:
    if scheduler is not None:
        return cluster(scheduler)
    return processes(workers or os.cpu_count() or 1)


def _fly(chosen: Campaign, store: Store, flights: int, pool: Pool) -> None:
    """Fly what is missing; say on Ctrl-C what is kept."""
    try:
        with counting_bar("flying", "flights", flights) as progress:
            fly_missing(chosen, store, flights, pool, progress)
    except KeyboardInterrupt:
        with contextlib.suppress(OSError):
            typer.echo(
                f"{echo(str(store.folder))}: stopped with {len(store.lines)} of {flights} flights finished; "
                "the same command goes on from there",
                err=True,
            )
        raise


def _finish(chosen: Campaign, store: Store) -> dict[str, Any]:
    """Put the table in order, and write what follows from it, the summary last."""
    from mambo_nmpc.sil.campaign.plots import draw_campaign  # noqa: PLC0415 - loaded when drawing

    store.put_in_order()
    write_records(chosen, store)
    table = numeric(store)
    summary = summary_of(chosen, table)
    with refusals(store.folder):
        draw_campaign(table, [entrant.name for entrant in chosen.entrants], store.folder / PICTURE)
        put(store.folder / SUMMARY, summary_text("campaign", summary).encode())
    return summary
