"""The command `footprint`: flash, RAM, stack and instructions of a controller on a board."""

import contextlib
from typing import Annotated

import typer

from mambo_nmpc.sil.cli.options import (
    BOARD_NAMES,
    AsJson,
    OptionalResults,
    Scalar,
    Source,
    complete_boards,
    load,
    load_boards,
    show,
)

FILES = ("footprint.png", "footprint.svg", "footprint.html")


def footprint(
    source: Source = "mambo",
    *,
    scalar: Scalar = None,
    board: Annotated[
        str,
        typer.Option(
            help=f"{', '.join(BOARD_NAMES)}, all, or a board's TOML file.", autocompletion=complete_boards
        ),
    ] = "all",
    optimisation: Annotated[str, typer.Option(help="Optimisation flag of the compiler.")] = "-O2",
    output: OptionalResults = None,
    as_json: AsJson = False,
) -> None:
    """Measure flash, RAM, stack and instructions on boards; exit 1 if one exceeds its budget."""
    from mambo_nmpc.sil.cli.progress import progress_bar
    from mambo_nmpc.sil.files.folders import new_results
    from mambo_nmpc.sil.footprint.measure import measure_boards
    from mambo_nmpc.sil.footprint.report import FootprintSummary, page, summarise, text

    settings = load(source, scalar)
    chosen = load_boards(board)
    with contextlib.ExitStack() as stack:
        folder = output and stack.enter_context(new_results(output, FootprintSummary.command, FILES))
        with progress_bar("measuring") as progress:
            measured, missing = measure_boards(settings, chosen, optimisation, progress)
        summary = summarise(measured, source, settings)
        if folder is not None:
            from mambo_nmpc.sil.footprint.plots import draw_footprints

            draw_footprints(measured, folder / "footprint")
            (folder / "footprint.html").write_text(page(summary), "utf-8")
            summary.write(folder)
    show(summary, text(measured), as_json=as_json)
    for message in missing:
        typer.echo(message, err=True)
    if not all(one.fits for one in measured):
        raise typer.Exit(1)
