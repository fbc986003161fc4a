"""The command `campaign`: many random flights and their statistics."""

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.sil.cli.options import AsJson, Workers, output_option, show

if TYPE_CHECKING:
    from mambo_nmpc.sil.campaign.executors import Pool
    from mambo_nmpc.sil.campaign.file import Campaign
    from mambo_nmpc.sil.campaign.store import FlightStore


def campaign(
    source: Annotated[
        Path | None, typer.Argument(help="A campaign.toml; the default campaign if none is named.")
    ] = None,
    *,
    output: Annotated[
        Path,
        output_option("Folder for the results; a campaign started there is continued."),
    ] = Path("campaign"),
    flights: Annotated[int, typer.Option(help="Total number of flights.", min=1, max=100_000)] = 1000,
    workers: Workers = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Address of a running Dask scheduler; its workers fly, not this machine."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Fly many random flights with several controllers and compare them; continue an interrupted campaign."""
    if workers is not None and scheduler is not None:
        raise typer.BadParameter("it has its own workers: leave out --workers", param_hint="--scheduler")
    from mambo_nmpc.sil.campaign import file
    from mambo_nmpc.sil.campaign.executors import cluster, processes
    from mambo_nmpc.sil.campaign.report import PICTURE, RECORDS, campaign_text, finish
    from mambo_nmpc.sil.campaign.run import missing_flights, open_campaign
    from mambo_nmpc.sil.campaign.store import TABLE
    from mambo_nmpc.sil.files.folders import SUMMARY

    chosen = file.default() if source is None else file.read(source)
    pool = cluster(scheduler) if scheduler is not None else processes(workers or os.cpu_count() or 1)
    with pool as open_pool, open_campaign(chosen, output) as store:
        if missing_flights(store, flights):
            _fly(chosen, store, flights, open_pool)
        summary = finish(chosen, store)
    show(summary, campaign_text(summary, str(output)), as_json=as_json)
    typer.echo(f"{echo(str(output))}: {TABLE}, {SUMMARY}, {PICTURE}.png, {PICTURE}.svg, {RECORDS}/", err=True)


def _fly(chosen: "Campaign", store: "FlightStore", flights: int, pool: "Pool") -> None:
    """Fly the missing flights; on Ctrl-C print how many are finished."""
    from mambo_nmpc.sil.campaign.run import fly_missing
    from mambo_nmpc.sil.cli.progress import counting_bar

    try:
        with counting_bar("flying", "flights", flights) as progress:
            fly_missing(chosen, store, flights, pool, progress)
    except KeyboardInterrupt:
        with contextlib.suppress(OSError):
            typer.echo(
                f"{echo(str(store.folder))}: stopped with {len(store.lines)} of {flights} flights finished; "
                "the same command continues from there",
                err=True,
            )
        raise
