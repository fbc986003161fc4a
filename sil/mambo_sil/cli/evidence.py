"""The commands of the panel Evidence: verify, regress, table2, report."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_codegen.errors import InvalidSettingsError, echo
from mambo_sil.cli.options import (
    AsJson,
    Drone,
    Results,
    Scalar,
    Source,
    load,
    output_option,
    show,
    show_result,
)
from mambo_sil.cli.progress import Bar, counting_bar, progress_bar
from mambo_sil.flight.names import PD_NAMES, PD_TITLES
from mambo_sil.results.build_folders import check_tmpdir
from mambo_sil.results.folders import SUMMARY, digests, new_results
from mambo_sil.verify.check import CHECKS, CheckOutcome, Entry, Subject

if TYPE_CHECKING:
    from mambo_codegen.settings.model import Settings
    from mambo_sil.experiment.campaign.campaign_flights import Row
    from mambo_sil.experiment.inputs import Entrant
    from mambo_sil.experiment.regress.suite_file import FlightSuite
    from mambo_sil.verify.verify_report import Verified


CONTROLLER, REPORTS = "controller/", "checks/"
CHECK_NAMES = ", ".join(entry.name for entry in CHECKS)
VERIFY_EXIT_CODES = (
    "Exit codes: 0 passed; 1 failed, or incomplete because a tool is missing; 2 bad input or a system error."
)


def verify(
    source: Source = "mambo",
    *,
    only: Annotated[
        str | None, typer.Option(help=f"Run only these of {CHECK_NAMES}.", metavar="NAME,NAME")
    ] = None,
    output: Results = Path("verification"),
    scalar: Scalar = None,
    as_sarif: Annotated[
        bool, typer.Option("--sarif", help="Write verify.sarif too, for source hosts and editors.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Generate the C of a controller, prove and test it, and keep the evidence.

    Before a release, or for somebody who must be shown that the C has no run-time error.
    """
    from mambo_codegen.bundle import bundle
    from mambo_codegen.bundle.render import render
    from mambo_sil.results.html_page import results_page
    from mambo_sil.verify.sarif import SARIF, sarif
    from mambo_sil.verify.verify_report import PAGE, VerifySummary, summarise

    settings = load(source, scalar)
    chosen = _chosen_checks(only)
    check_tmpdir()
    with (
        new_results(output, VerifySummary.command, (CONTROLLER, REPORTS, PAGE, SARIF)) as place,
        counting_bar("generating the C", "checks", len(chosen), alike=False) as bar,
    ):
        folder = place.resolve()
        bundle.write(render(settings), folder / CONTROLLER)
        found = _run_checks(chosen, settings, folder, bar)
        summary = summarise(found, source, settings)
        (folder / PAGE).write_text(
            results_page([(str(output), summary.result(folder))], [summary.generator]), "utf-8"
        )
        if as_sarif:
            (folder / SARIF).write_text(sarif(summary, output / CONTROLLER), "utf-8")
        summary = summary.model_copy(update={"files": digests(folder)})
        summary.write(folder)
    written = (PAGE, SUMMARY, *((SARIF,) if as_sarif else ()), CONTROLLER, REPORTS)
    show_result(summary, output, written, as_json=as_json)
    if summary.verdict is not CheckOutcome.PASSED:
        raise typer.Exit(1)


def _chosen_checks(only: str | None) -> Sequence[Entry]:
    """Return the checks that `only` names, in the registry's order; raises InvalidSettingsError."""
    if only is None:
        return CHECKS
    names = only.split(",")
    for name in names:
        if name not in {entry.name for entry in CHECKS}:
            raise InvalidSettingsError(
                (f"--only {echo(only)}: {echo(name)} is not a check; the checks are {CHECK_NAMES}",)
            )
    return [entry for entry in CHECKS if entry.name in names]


def _run_checks(chosen: Sequence[Entry], settings: "Settings", folder: Path, bar: Bar) -> "list[Verified]":
    """Run the checks one after the other, each in its own folder."""
    from mambo_sil.verify.tools import versions
    from mambo_sil.verify.verify_report import Verified

    found: list[Verified] = []
    bar(0)
    for entry in chosen:
        bar.stage(f"verifying: {entry.name}")
        own = folder / REPORTS / entry.name
        own.mkdir(parents=True)
        result = entry.check(Subject(settings, folder / CONTROLLER, own))
        evidence = result.evidence.replace(f"{folder}/", "")
        tools = versions(entry.tools) | dict(result.tools)
        found.append(Verified(entry.name, entry.about, result.outcome, evidence, result.figures, tools))
        bar(len(found))
    return found


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
    vehicle: Drone = None,
    output: Results = Path("regress"),
    update: Annotated[
        bool, typer.Option("--update", help="Record the metrics as the baseline of later runs.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Fly a suite of flights as a regression test; exit 1 if a flight exceeds a bound or its baseline.

    After every change of settings, and in a CI: whether everything flies that flew before.
    """
    from mambo_sil.drone.vehicles import vehicle_toml
    from mambo_sil.experiment.inputs import load_entrant
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
        write_records,
    )
    from mambo_sil.experiment.regress.suite_file import load_suite
    from mambo_sil.experiment.regress.suite_flights import demand_flyable

    place = f"--controller {echo(controller)}"
    entrant = load_entrant(controller, Path(), place)
    of_settings = None if entrant.kind in PD_NAMES else vehicle_toml.of_settings(controller)
    chosen = load_suite(suite, vehicle, of_settings)
    demand_flyable(chosen, entrant, place)
    path = baseline_path(chosen, entrant.name)
    if update:
        demand_replaceable(path)
    baseline = None if update else read_baseline(chosen, entrant.name)
    with new_results(output, RegressSummary.command, (*PICTURES, JUNIT, f"{RECORDS}/")) as folder:
        rows = _fly_suite(chosen, entrant)
        summary = judge(chosen, entrant, rows, baseline, path)
        write_records(summary, chosen, entrant, rows, folder)
        (folder / JUNIT).write_bytes(junit_xml(summary))
        draw_regress(summary.flights, folder / "regress")
        summary = summary.model_copy(update={"files": digests(folder)})
        summary.write(folder)
    show_result(summary, output, as_json=as_json)
    if update:
        record_baseline(chosen, entrant, rows)
        typer.echo(f"{echo(str(path))}: recorded {len(rows)} flights", err=True)
    typer.echo(f"{echo(str(output))}: {SUMMARY}, {JUNIT}, {', '.join(PICTURES)}, {RECORDS}/", err=True)
    if summary.failed:
        raise typer.Exit(1)


def _fly_suite(suite: "FlightSuite", entrant: "Entrant") -> "list[Row]":
    """Fly the suite on all processors; show the progress."""
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


TABLE2_PICTURES = ("figure3.png", "figure3.svg")
SENSED_TABLE = "sensors.md"


def table2(
    *,
    output: Results = Path("table2"),
    sensors: Annotated[
        bool,
        typer.Option(
            "--sensors", help="Fly the Table II case with the Mambo's sensors and estimators instead."
        ),
    ] = False,
    scalar: Scalar = None,
    as_json: AsJson = False,
) -> None:
    """Fly Table II of the paper with both PDs and the presets for the Mambo, and check the paper's claims.

    For readers of the paper; nothing else needs it.
    """
    from mambo_sil.experiment.table2.table2 import PRESETS, Table2Summary, fly_table2, judge_table2
    from mambo_sil.experiment.table2.table2_plots import DRAWN, draw_figure3
    from mambo_sil.flight.traces import write_npz

    if sensors:
        _fly_with_sensors(output, scalar, as_json=as_json)
        return
    settings = {name: load(name, scalar) for name in PRESETS}
    files = {name: f"{name.lower()}.npz" for name in (*PD_TITLES.values(), *settings)}
    with new_results(output, Table2Summary.command, (*files.values(), *TABLE2_PICTURES)) as folder:
        with progress_bar("flying Table II") as progress:
            traces = fly_table2(settings, progress)
        for name, trace in traces.items():
            write_npz(trace, folder / files[name])
        draw_figure3({name: traces[name] for name in DRAWN}, folder / "figure3")
        summary = judge_table2(traces, scalar)
        summary.write(folder)
    show_result(summary, output, as_json=as_json)
    typer.echo(f"{echo(str(output))}: {', '.join(TABLE2_PICTURES)} and the traces", err=True)


def _fly_with_sensors(output: Path, scalar: str | None, *, as_json: bool) -> None:
    from mambo_sil.experiment.table2.sensed import PRESETS, SensedSummary, fly_sensed, sensed_markdown

    settings = {name: load(name, scalar) for name in PRESETS}
    with new_results(output, SensedSummary.command, (SENSED_TABLE,)) as folder:
        with progress_bar("flying Table II with sensors") as progress:
            summary = SensedSummary(scalar=scalar, rows=fly_sensed(settings, progress))
        (folder / SENSED_TABLE).write_text(sensed_markdown(summary.rows) + "\n", "utf-8")
        summary.write(folder)
    show_result(summary, output, (SENSED_TABLE,), as_json=as_json)


def report(
    folders: Annotated[
        list[Path], typer.Argument(help="Result folders of other commands.", metavar="DIR...")
    ],
    *,
    output: Annotated[
        Path,
        output_option("HTML file; an earlier report there is overwritten."),
    ] = Path("report.html"),
    as_json: AsJson = False,
) -> None:
    """Collect results on one HTML page that needs no network and no other file.

    To show results to somebody, or to keep them.
    """
    from mambo_sil.report.report_page import ReportSummary, report_page
    from mambo_sil.results.html_page import new_page

    with new_page(output, "report") as write, counting_bar("drawing", "folders", len(folders)) as bar:
        text, results = report_page(folders, bar)
        size = write(text)
    summary = ReportSummary(page=str(output), bytes=size, results=results)
    show(summary, f"{echo(str(output))}: {size / 1000:.0f} kB", as_json=as_json)
