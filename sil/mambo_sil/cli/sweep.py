"""The command `sweep`: footprint and tracking error over a grid of horizons and iterations."""

import os
from pathlib import Path
from typing import Annotated

import typer

from mambo_codegen.errors import InvalidSettingsError, echo
from mambo_sil.cli.options import AsJson, Drone, Results, Scalar, Source, complete_boards, load, show

FILES = ("sweep.csv", "sweep.png", "sweep.svg")


def sweep(
    source: Source = "mambo-1norm",
    *,
    scalar: Scalar = None,
    board: Annotated[
        str, typer.Option(help="Board, or its TOML file.", autocompletion=complete_boards)
    ] = "crazyflie",
    prediction: Annotated[
        str, typer.Option(help="Prediction horizons.", metavar="FIRST:LAST[:STEP]")
    ] = "5:30:5",
    control: Annotated[str, typer.Option(help="Control horizons.", metavar="FIRST:LAST")] = "1:3",
    iterations: Annotated[str, typer.Option(help="Iterations.", metavar="N,N")] = "3,5,10",
    fit: Annotated[
        bool,
        typer.Option("--fit", help="Print only the closest-tracking one within the budget.", metavar=""),
    ] = False,
    vehicle: Drone = "mambo",
    output: Results = Path("sweep"),
    as_json: AsJson = False,
) -> None:
    """Measure footprint and tracking error over a grid of horizons and iterations."""
    from mambo_codegen import boards
    from mambo_codegen.methods import method_of
    from mambo_sil.board.footprint.sweep import Grid, budgets, measure_grid
    from mambo_sil.board.footprint.sweep_report import SweepSummary, closest_fit, point_text, write_points
    from mambo_sil.cli.progress import counting_bar
    from mambo_sil.drone.vehicles import vehicle_toml
    from mambo_sil.experiment.campaign.executors import processes
    from mambo_sil.results.folders import new_results

    settings = load(source, scalar)
    if not method_of(settings).iterates:
        raise InvalidSettingsError(
            (
                f'{echo(source)}: cost.norm = "quadratic" must be "1-norm" for a sweep: with a quadratic '
                "cost there are no horizons and iterations to vary; `mambo-nmpc tune` searches its settings",
            )
        )
    chosen, drone = boards.load(board), vehicle_toml.load(vehicle)
    grid = Grid(
        _numbers("--prediction", prediction, 50),
        _numbers("--control", control, 50),
        _numbers("--iterations", iterations, 100),
    )
    total = len(grid.points())
    if total == 0:
        raise InvalidSettingsError(
            (f"--control {echo(control)} must be at most --prediction {echo(prediction)}",)
        )
    with (
        new_results(output, SweepSummary.command, FILES) as folder,
        counting_bar("sweeping", "controllers", total) as bar,
    ):
        with processes(os.cpu_count() or 1) as pool:
            points = measure_grid(settings, chosen, grid, pool.run, bar, drone=drone)
        bar.stage("drawing pictures")
        from mambo_sil.board.footprint.footprint_plots import draw_sweep

        write_points(points, folder / "sweep.csv")
        draw_sweep(points, chosen, settings.horizon.update_period_s, folder / "sweep")
        best = closest_fit(points)
        summary = SweepSummary(
            source=source,
            settings=settings.digest,
            board=chosen.name,
            vehicle=drone,
            budget=budgets(chosen, settings.horizon.update_period_s),
            points=points,
            closest_fit=best,
        )
        summary.write(folder)
    shown = ([] if best is None else [best]) if fit else points
    text = "\n".join(map(point_text, shown)) or f"nothing fits {chosen.title}"
    show(summary, text, as_json=as_json)
    typer.echo(f"{echo(str(output))}: {', '.join(FILES)}", err=True)
    if fit and best is None:
        raise typer.Exit(1)


def _numbers(option: str, text: str, most: int) -> tuple[int, ...]:
    """Read 5:30, 5:30:5 or 1,3,5; raises InvalidSettingsError."""
    try:
        if ":" in text:
            first, last, *step = (int(word) for word in text.split(":"))
            (each,) = step or (1,)
            numbers = tuple(range(first, min(last, most + 1) + 1, each)) if first > 0 else ()
        else:
            numbers = tuple(int(word) for word in text.split(","))
    except ValueError:
        numbers = ()
    if not numbers or min(numbers) < 1 or max(numbers) > most:
        raise InvalidSettingsError(
            (f"{option} {echo(text)} must be numbers in 1..{most}, such as 5:30, 5:30:5 or 1,3,5",)
        )
    return numbers
