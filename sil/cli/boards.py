"""The commands about boards: footprint, same-bits, sweep and doctor."""

import contextlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from mambo_nmpc.codegen import boards
from mambo_nmpc.codegen import cli as generating
from mambo_nmpc.codegen.boards import Board
from mambo_nmpc.codegen.digest import TICKS, episode_count
from mambo_nmpc.codegen.errors import BuildError, InvalidSettingsError, echo
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.cli.progress import progress_bar
from mambo_nmpc.sil.files.folders import SUMMARY, new_results, summary_text
from mambo_nmpc.sil.firmware.doctor import doctor_text, examine
from mambo_nmpc.sil.footprint import report
from mambo_nmpc.sil.footprint.measure import Footprint, measure_footprint
from mambo_nmpc.sil.footprint.same_bits import REFERENCE, BuildDigest, builds, same_bits
from mambo_nmpc.sil.footprint.sweep import Grid, Point, budgets, largest_fit, sweep, write_points

FOOTPRINT_FILES = ("footprint.png", "footprint.svg", "footprint.html")
SWEEP_FILES = ("sweep.csv", "sweep.png", "sweep.svg")

Source = Annotated[str, typer.Argument(help="A preset or a controller.toml.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON.", metavar="")]
Results = Annotated[
    Path | None,
    typer.Option("--output", "-o", help="Folder for the results; earlier ones there are overwritten."),
]


def register(app: typer.Typer) -> None:
    """Add the commands of this module to `app`."""
    app.command(
        epilog=generating.examples(
            "mambo-nmpc footprint",
            "mambo-nmpc footprint controller.toml --board crazyflie -o footprint",
            "mambo-nmpc footprint --board my-board.toml --json",
        )
    )(footprint)
    app.command(
        "same-bits", epilog=generating.examples("mambo-nmpc same-bits mambo --boards mambo,crazyflie")
    )(same_bits_command)
    app.command(
        "sweep",
        epilog=generating.examples(
            "mambo-nmpc sweep --prediction 5:30:5 --control 1:3 --iterations 3,5,10 -o sweep",
            "mambo-nmpc sweep --board rp2040 --fit",
        ),
    )(sweep_command)
    app.command()(doctor)


def footprint(
    source: Source = "mambo",
    *,
    scalar: generating.Scalar = None,
    board: Annotated[
        str, typer.Option(help=f"{', '.join(boards.names())}, all, or a board's TOML file.")
    ] = "all",
    optimisation: Annotated[str, typer.Option(help="Optimisation of the compiler.")] = "-O2",
    output: Results = None,
    as_json: AsJson = False,
) -> None:
    """Measure flash, RAM, stack and instructions on a board, and hold them against its budget."""
    settings = generating.load(source, scalar)
    chosen = _boards(board)
    with contextlib.ExitStack() as stack:
        folder = output and stack.enter_context(new_results(output, "footprint", FOOTPRINT_FILES))
        measured, missing = _measured(settings, chosen, optimisation)
        summary = report.summary(measured, source, settings)
        if folder is not None:
            from mambo_nmpc.sil.footprint.plots import draw_footprints  # noqa: PLC0415 - loaded when drawing

            draw_footprints(measured, folder / "footprint")
            (folder / "footprint.html").write_text(report.page(summary), "utf-8")
            (folder / SUMMARY).write_text(summary_text("footprint", summary), "utf-8")
    typer.echo(summary_text("footprint", summary) if as_json else report.text(measured), nl=not as_json)
    for message in missing:
        typer.echo(message, err=True)
    if not all(one.fits for one in measured):
        raise typer.Exit(1)


def same_bits_command(
    source: Source = "mambo",
    *,
    scalar: generating.Scalar = None,
    board: Annotated[
        str, typer.Option("--boards", help="Boards, separated by commas, or all.", metavar="NAME,NAME")
    ] = "all",
    steps: Annotated[
        int | None,
        typer.Option(
            min=TICKS,
            help="Frozen steps, a hundred at a time; those of the bundle's own digest if none are named.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run the same frozen steps in every build at hand; exit 1 unless all digests are one."""
    settings = generating.load(source, scalar)
    chosen = [one for name in board.split(",") for one in _boards(name)]
    count = episode_count(settings) if steps is None else steps // TICKS
    found: list[BuildDigest] = []
    with progress_bar("comparing builds") as progress:
        for result in same_bits(settings, chosen, count):
            found.append(result)
            progress(len(found) / builds(chosen))
            if not as_json:
                typer.echo(_digest_line(result))
    total = count * TICKS
    reference = next(result.digest for result in found if result.where == REFERENCE)
    ran = [result for result in found if result.digest is not None]
    others = [result for result in ran if result.digest != reference]
    if as_json:
        typer.echo(
            json.dumps({"steps": total, "same": not others, "builds": [asdict(r) for r in found]}, indent=2)
        )
    else:
        typer.echo(
            f"{len(ran) - len(others)} of {len(ran)} have the bits of the reference over {total} steps; "
            f"{len(found) - len(ran)} not run"
        )
    if others:
        raise typer.Exit(1)


def sweep_command(
    source: Source = "mambo",
    *,
    scalar: generating.Scalar = None,
    board: Annotated[str, typer.Option(help="Board, or its TOML file.")] = "crazyflie",
    prediction: Annotated[
        str, typer.Option(help="Prediction horizons.", metavar="FIRST:LAST[:STEP]")
    ] = "5:30:5",
    control: Annotated[str, typer.Option(help="Control horizons.", metavar="FIRST:LAST")] = "1:3",
    iterations: Annotated[str, typer.Option(help="Iterations.", metavar="N,N")] = "3,5,10",
    fit: Annotated[
        bool,
        typer.Option("--fit", help="Answer with the largest horizon within the board's budget.", metavar=""),
    ] = False,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Folder for the results; earlier ones there are overwritten."),
    ] = Path("sweep"),
    as_json: AsJson = False,
) -> None:
    """Measure footprint and tracking over a grid of horizons and iterations."""
    settings = generating.load(source, scalar)
    chosen = boards.load(board)
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
    points: list[Point] = []
    with new_results(output, "sweep", SWEEP_FILES) as folder:
        with progress_bar(f"sweeping {total} controllers") as progress:
            for point in sweep(settings, chosen, grid):
                points.append(point)
                progress(len(points) / total)
        from mambo_nmpc.sil.footprint.plots import draw_sweep  # noqa: PLC0415 - loaded when drawing

        write_points(points, folder / "sweep.csv")
        draw_sweep(points, chosen, settings.horizon.update_period_s, folder / "sweep")
        best = largest_fit(points)
        summary = {
            "source": source,
            "settings": settings.digest,
            "board": chosen.name,
            "budget": budgets(chosen, settings.horizon.update_period_s),
            "points": [asdict(point) for point in points],
            "largest_fit": None if best is None else asdict(best),
        }
        (folder / SUMMARY).write_text(summary_text("sweep", summary), "utf-8")
    if as_json:
        typer.echo(summary_text("sweep", summary), nl=False)
    else:
        shown = ([] if best is None else [best]) if fit else points
        typer.echo("\n".join(map(_point_line, shown)) or f"nothing fits {chosen.title}")
    typer.echo(f"{echo(str(output))}: {', '.join(SWEEP_FILES)}", err=True)
    if fit and best is None:
        raise typer.Exit(1)


def doctor(*, as_json: AsJson = False) -> None:
    """Say which compilers, emulators and analysers are here, and what a missing one would bring."""
    findings = examine()
    typer.echo(
        json.dumps([asdict(found) for found in findings], indent=2) if as_json else doctor_text(findings)
    )


def _measured(
    settings: Settings, chosen: Sequence[Board], optimisation: str
) -> tuple[list[Footprint], list[str]]:
    """Measure on every board that has a compiler here; returns footprints, and what is missing for others.

    Raises BuildError if there is no compiler for any.
    """
    measured: list[Footprint] = []
    missing: list[str] = []
    with progress_bar("measuring") as progress:
        for index, one in enumerate(chosen):
            try:
                measured.append(measure_footprint(settings, one, optimisation))
            except BuildError as error:
                missing.append(str(error))
            progress((index + 1) / len(chosen))
    if not measured:
        raise BuildError("\n".join(missing))
    return measured, missing


def _boards(name: str) -> Sequence[Board]:
    return [boards.load(one) for one in (boards.names() if name == "all" else (name,))]


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
            (f"{option} {echo(text)} must be numbers in 1..{most}, as 5:30, 5:30:5 or 1,3,5",)
        )
    return numbers


def _digest_line(result: BuildDigest) -> str:
    what = result.reason if result.digest is None else result.digest
    return f"{result.where:12}{result.compiler:26}{result.optimisation:5}{what}"


def _point_line(point: Point) -> str:
    return (
        f"prediction {point.prediction:2}  control {point.control:2}  iterations {point.iterations:3}  "
        f"flash {point.flash_bytes} B  RAM {point.ram_bytes} B  stack {point.stack_bytes:g} B  "
        f"instructions {point.instructions:g}  IAE {point.iae_m_s:.4g} m s  "
        f"{'fits' if point.fits else 'not shown to fit'}"
    )
