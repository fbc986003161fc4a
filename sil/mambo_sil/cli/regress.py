"""The command `regress`: fly a suite, and compare its metrics with bounds and with recorded ones."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_codegen.errors import echo
from mambo_sil.cli.options import AsJson, OtherDrone, Results, show

if TYPE_CHECKING:
    from mambo_sil.experiment.campaign.campaign_file import Entrant
    from mambo_sil.experiment.campaign.campaign_flights import Row
    from mambo_sil.experiment.regress.suite_file import FlightSuite

_WORTH_A_WORKER_S = 4000.0
"""Simulated time that the engine flies while a worker process starts, about half a second."""


def regress(
    suite: Annotated[str, typer.Argument(help="A shipped suite or a TOML file.")] = "envelope",
    *,
    controller: Annotated[
        str,
        typer.Option(
            help="A preset, a controller.toml, pd, pd-feedforward, or pid-feedforward.", metavar="SOURCE"
        ),
    ] = "mambo",
    vehicle: OtherDrone = None,
    output: Results = Path("regress"),
    update: Annotated[
        bool, typer.Option("--update", help="Record the metrics as the baseline of later runs.", metavar="")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Fly a suite of flights as a regression test; exit 1 if a flight exceeds a bound or its baseline."""
    from mambo_sil.experiment.campaign.campaign_file import load_entrant
    from mambo_sil.experiment.regress.baseline import (
        baseline_path,
        demand_replaceable,
        read_baseline,
        record_baseline,
    )
    from mambo_sil.experiment.regress.flight_limits import RECORDS
    from mambo_sil.experiment.regress.regress_plots import draw_regress
    from mambo_sil.experiment.regress.regress_report import (
        JUNIT,
        PICTURES,
        RegressSummary,
        judge,
        junit_xml,
        regress_text,
        write_records,
    )
    from mambo_sil.experiment.regress.suite_file import load_suite
    from mambo_sil.experiment.regress.suite_flights import demand_flyable
    from mambo_sil.results.folders import SUMMARY, digests, new_results

    chosen, place = load_suite(suite, vehicle), f"--controller {echo(controller)}"
    entrant = load_entrant(controller, Path(), place)
    demand_flyable(chosen, entrant, place)
    path = baseline_path(chosen, entrant.name)
    if update:
        demand_replaceable(path)
    baseline = None if update else read_baseline(chosen, entrant.name)
    with new_results(output, RegressSummary.command, (*PICTURES, JUNIT, f"{RECORDS}/")) as folder:
        rows = _fly(chosen, entrant)
        summary = judge(chosen, entrant, rows, baseline, path)
        write_records(summary, chosen, entrant, rows, folder)
        (folder / JUNIT).write_bytes(junit_xml(summary))
        draw_regress(summary.flights, folder / "regress")
        summary = summary.model_copy(update={"files": digests(folder)})
        summary.write(folder)
    show(summary, regress_text(summary, str(output)), as_json=as_json)
    if update:
        record_baseline(chosen, entrant, rows)
        typer.echo(f"{echo(str(path))}: recorded {len(rows)} flights", err=True)
    typer.echo(f"{echo(str(output))}: {SUMMARY}, {JUNIT}, {', '.join(PICTURES)}, {RECORDS}/", err=True)
    if summary.failed:
        raise typer.Exit(1)


def _fly(suite: "FlightSuite", entrant: "Entrant") -> "list[Row]":
    """Fly the suite on all processors; show the progress."""
    from mambo_sil.cli.progress import counting_bar
    from mambo_sil.experiment.campaign.executors import processes
    from mambo_sil.experiment.regress.suite_flights import fly_suite
    from mambo_sil.flight.engine.engine_library import chosen_engine

    workers = os.cpu_count() or 1
    if chosen_engine() == "c":
        flown_s = sum(flight.scenario.duration_s for flight in suite.flights)
        workers = min(workers, 1 + int(flown_s / _WORTH_A_WORKER_S))
    with (
        counting_bar("flying", "flights", len(suite.flights)) as progress,
        processes(workers) as pool,
    ):
        return fly_suite(suite, entrant, pool, progress)
