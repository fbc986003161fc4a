"""The command `campaign`: many random flights and their statistics."""

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_codegen.errors import UnwritableError, echo
from mambo_sil.cli.options import AsJson, OtherDrone, Workers, output_option, show

if TYPE_CHECKING:
    from mambo_sil.cli.progress import Bar
    from mambo_sil.experiment.campaign.campaign_report import CampaignSummary


def campaign(
    source: Annotated[
        Path | None, typer.Argument(help="A campaign.toml; the default campaign if none is named.")
    ] = None,
    *,
    output: Annotated[
        Path,
        output_option("Folder for the results; a campaign started there is continued."),
    ] = Path("campaign"),
    vehicle: OtherDrone = None,
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
    from mambo_sil.cli.progress import counting_bar

    with counting_bar("starting", "flights", flights) as bar:
        summary = _run(source, vehicle, output, flights, bar, workers=workers, scheduler=scheduler)
    from mambo_sil.experiment.campaign.campaign_report import PICTURE, RECORDS, campaign_text
    from mambo_sil.experiment.campaign.store import TABLE
    from mambo_sil.results.folders import SUMMARY

    show(summary, campaign_text(summary, str(output)), as_json=as_json)
    typer.echo(f"{echo(str(output))}: {TABLE}, {SUMMARY}, {PICTURE}.png, {PICTURE}.svg, {RECORDS}/", err=True)


def _run(
    source: Path | None,
    vehicle: str | None,
    output: Path,
    flights: int,
    bar: "Bar",
    *,
    workers: int | None,
    scheduler: str | None,
) -> "CampaignSummary":
    """Fly the missing flights and write the results; if interrupted print how many are finished."""
    from mambo_sil.experiment.campaign import campaign_file
    from mambo_sil.experiment.campaign.campaign_report import finish
    from mambo_sil.experiment.campaign.campaign_run import fly_missing, missing_flights, open_campaign
    from mambo_sil.experiment.campaign.executors import cluster, processes

    chosen = campaign_file.default(vehicle) if source is None else campaign_file.read(source, vehicle)
    with open_campaign(chosen, output) as store:
        bar(len(store.finished))
        try:
            if missing_flights(store, flights):
                pool = processes(workers or os.cpu_count() or 1) if scheduler is None else cluster(scheduler)
                with pool as open_pool:
                    bar.stage("flying")
                    fly_missing(chosen, store, flights, open_pool, bar, running=bar.running)
            return finish(chosen, store, bar.stage)
        except KeyboardInterrupt:
            with contextlib.suppress(UnwritableError):
                store.export()
            with contextlib.suppress(OSError):
                typer.echo(
                    f"{echo(str(output))}: stopped with {len(store.finished)} of {flights} flights finished; "
                    "the same command continues from there",
                    err=True,
                )
            raise
