"""The commands of the panel Board: footprint, sweep, check-bits."""

import contextlib
import difflib
import json
import math
import os
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mambo_codegen import extensions
from mambo_codegen.errors import InvalidSettingsError, echo
from mambo_sil.cli.options import (
    AsJson,
    Baud,
    Boards,
    Drone,
    OptionalResults,
    PortName,
    Results,
    Scalar,
    Source,
    complete_boards,
    demand_port,
    load,
    load_boards,
    load_drone,
    show_result,
)
from mambo_sil.cli.progress import counting_bar, progress_bar
from mambo_sil.results.folders import new_results

if TYPE_CHECKING:
    from mambo_codegen.settings.model import Settings
    from mambo_sil.board.footprint.sweep import Axis

FOOTPRINT_FILES = ("footprint.png", "footprint.svg", "footprint.html")


def footprint(
    source: Source = "mambo",
    *,
    scalar: Scalar = None,
    board: Boards = None,
    optimisation: Annotated[
        str, typer.Option(help="Optimisation flag of the compiler.", metavar="FLAG")
    ] = "-O2",
    port: PortName = None,
    baud: Baud = None,
    output: OptionalResults = None,
    as_json: AsJson = False,
) -> None:
    """Measure flash, RAM, stack and instructions on boards; exit 1 if one exceeds its budget.

    Before you choose a board, and in a CI that keeps its budget.

    With --port also cycles and stack of the same steps on the board there, by default the one that the
    firmware names; exit 1 if its bits differ.
    """
    from mambo_sil.board.footprint.footprint_report import FootprintSummary, summarise
    from mambo_sil.board.footprint.measure import measure_boards

    demand_port(port, baud)
    settings = load(source, scalar)
    chosen = load_boards(board)
    with contextlib.ExitStack() as stack:
        folder = output and stack.enter_context(
            new_results(output, FootprintSummary.command, FOOTPRINT_FILES)
        )
        on_board = None
        if port is not None:
            measure_at_port = extensions.load("port", "footprint")
            compared, on_board = measure_at_port(settings, chosen, port, baud)
            chosen = [compared]
        with progress_bar("measuring") as progress:
            measured, missing = measure_boards(settings, chosen, optimisation, progress)
        if on_board is not None:
            measured = [replace(one, on_board=on_board) for one in measured]
        summary = summarise(measured, source, settings)
        if folder is not None:
            from mambo_sil.board.footprint.footprint_plots import draw_footprints
            from mambo_sil.results.html_page import results_page

            draw_footprints(measured, folder / "footprint")
            shown = [(str(output), summary.result(folder))]
            (folder / "footprint.html").write_text(results_page(shown, [summary.generator]), "utf-8")
            summary.write(folder)
    show_result(summary, output, as_json=as_json)
    for message in missing:
        typer.echo(message, err=True)
    if not all(one.good for one in measured):
        raise typer.Exit(1)


SWEEP_FILES = ("sweep.csv", "sweep.png", "sweep.svg")
MOST_KEYS, MOST_VALUES = 2, 100


def sweep(
    source: Source = "mambo",
    *,
    scalar: Scalar = None,
    board: Annotated[
        str, typer.Option(help="Board, or its TOML file.", metavar="BOARD", autocompletion=complete_boards)
    ] = "crazyflie",
    vary: Annotated[
        list[str],
        typer.Option(
            help="A key of the settings and its values: from FIRST to LAST, COUNT of them. Once or twice.",
            metavar="KEY=FIRST:LAST:COUNT",
        ),
    ],
    fit: Annotated[
        bool,
        typer.Option("--fit", help="Print only the closest one within budget and margins."),
    ] = False,
    vehicle: Drone = None,
    output: Results = Path("sweep"),
    as_json: AsJson = False,
) -> None:
    """Vary one or two settings; measure footprint, tracking error and margins of each controller.

    When a controller does not fit its board, or to see what a setting costs.
    """
    from mambo_codegen import boards
    from mambo_sil.board.emulation.machine import demand_emulator
    from mambo_sil.board.footprint.sweep import budgets, grid, measure_grid
    from mambo_sil.board.footprint.sweep_report import SweepSummary, closest_fit, write_points
    from mambo_sil.experiment.campaign.executors import processes
    from mambo_sil.model.derive.margin_reference import margin_reference

    settings = load(source, scalar)
    chosen, drone = boards.load(board), load_drone(vehicle, source)
    demand_emulator(chosen.emulated_core.value)
    axes = _axes(vary, settings)
    budget = budgets(chosen, settings, axes)
    with (
        new_results(output, SweepSummary.command, SWEEP_FILES) as folder,
        counting_bar("sweeping", "controllers", len(grid(axes))) as bar,
    ):
        reference = margin_reference(source, settings, drone)
        with processes(os.cpu_count() or 1) as pool:
            points = measure_grid(settings, chosen, axes, pool.run, bar, reference=reference, drone=drone)
        bar.stage("drawing pictures")
        from mambo_sil.board.footprint.footprint_plots import draw_sweep

        write_points(points, folder / "sweep.csv")
        best = closest_fit(points)
        summary = SweepSummary(
            source=source,
            settings=settings.digest,
            board=chosen.name,
            vehicle=drone,
            budget=budget,
            axes=axes,
            points=points,
            closest_fit=best,
            reference=reference,
        )
        draw_sweep(points, axes, budget, summary.headline, folder / "sweep")
        summary.write(folder)
    if fit and best is not None and not as_json:
        summary = summary.model_copy(update={"points": [best]})
    show_result(summary, output, SWEEP_FILES, as_json=as_json)
    if fit and best is None:
        raise typer.Exit(1)


def _axes(vary: list[str], settings: "Settings") -> "list[Axis]":
    """Read --vary; raises InvalidSettingsError."""
    if len(vary) > MOST_KEYS:
        raise InvalidSettingsError((f"--vary: {len(vary)} keys are too many; name one or two",))
    axes = [_axis(text, settings) for text in vary]
    if len({axis.key for axis in axes}) < len(axes):
        raise InvalidSettingsError((f"--vary: {axes[0].key} is there twice; name two keys",))
    return axes


def _axis(text: str, settings: "Settings") -> "Axis":
    """Read KEY=FIRST:LAST:COUNT; whole numbers stay whole. Raises InvalidSettingsError."""
    from mambo_codegen.settings.controller_keys import KEYS
    from mambo_codegen.settings.renamed_keys import OF_BEFORE
    from mambo_sil.board.footprint.sweep import Axis

    key, _, span = text.partition("=")
    if key in OF_BEFORE:
        raise InvalidSettingsError((f"--vary {echo(text)}: {key} {OF_BEFORE[key]}",))
    free = [path for path, one in KEYS.items() if one.low is not None and settings.uses(path)]
    if key not in free:
        near = [path for path in free if path.endswith(f".{key}")]
        near = near or difflib.get_close_matches(key, free, n=1, cutoff=0.0)
        raise InvalidSettingsError(
            (
                f"--vary {echo(text)}: {echo(key)} is not a number that settings with controller.method = "
                f'"{settings.controller.method}" use; did you mean {near[0]}?',
            )
        )
    try:
        first, last, number = span.split(":")
        low, high, count = float(first), float(last), int(number)
    except ValueError:
        low, high, count = math.nan, math.nan, 0
    if not (math.isfinite(high - low) and 1 <= count <= MOST_VALUES):
        raise InvalidSettingsError(
            (
                f"--vary {echo(text)} must be KEY=FIRST:LAST:COUNT with a COUNT in 1..{MOST_VALUES}, "
                "such as cost.response_time_s=0.1:0.5:5",
            )
        )
    step = (high - low) / max(count - 1, 1)
    values = [float(f"{low + step * index:.12g}") for index in range(count)]
    if KEYS[key].kind == "whole number":
        return Axis(key, tuple(dict.fromkeys(round(value) for value in values)))
    return Axis(key, tuple(dict.fromkeys(values)))


def check_bits(
    source: Source = "mambo",
    *,
    scalar: Scalar = None,
    board: Boards = None,
    steps: Annotated[
        int | None,
        typer.Option(
            min=100,
            metavar="N",
            help="Self-test steps, in hundreds; by default as many as the bundle's self-test digest covers.",
        ),
    ] = None,
    port: PortName = None,
    baud: Baud = None,
    as_json: AsJson = False,
) -> None:
    """Run the self-test steps in every build, or on the board at a port; exit 1 if a digest differs.

    When you change compiler, flags or board: whether the C still computes the same bits.
    """
    from mambo_codegen.bundle.digest import TICKS, episode_count
    from mambo_codegen.methods import method_of
    from mambo_sil.board.footprint.build_digests import (
        BuildDigest,
        builds_text,
        count_builds,
        run_everywhere,
    )

    demand_port(port, baud)
    settings = load(source, scalar)
    chosen = load_boards(board)
    count = episode_count(method_of(settings)) if steps is None else steps // TICKS
    found: list[BuildDigest] = []
    with contextlib.ExitStack() as stack:
        progress = stack.enter_context(progress_bar("comparing builds"))
        if port is None:
            results = run_everywhere(settings, chosen, count)
        else:
            run_at_port = extensions.load("port", "check-bits")
            results = run_at_port(settings, port, baud, count, progress)
        for result in results:
            found.append(result)
            if port is None:
                progress(len(found) / count_builds(chosen))
    total = count * TICKS
    same = all(one.digest in (None, found[0].digest) for one in found)
    if as_json:
        document = {"steps": total, "same": same, "builds": [asdict(one) for one in found]}
        typer.echo(json.dumps(document, indent=2))
    else:
        typer.echo(builds_text(found, source, total))
    if not same:
        raise typer.Exit(1)
