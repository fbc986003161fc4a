"""The command `footprint`: flash, RAM, stack and instructions of a controller on a board."""

import contextlib
from dataclasses import replace
from typing import Annotated

import typer

from mambo_sil.cli.options import (
    BAUD,
    BOARD_NAMES,
    AsJson,
    Baud,
    OptionalResults,
    PortName,
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
            help=f"{', '.join(BOARD_NAMES)}, all, or a board's TOML file; with --port by default the one "
            "that the firmware names.",
            autocompletion=complete_boards,
        ),
    ] = "all",
    optimisation: Annotated[str, typer.Option(help="Optimisation flag of the compiler.")] = "-O2",
    port: PortName = None,
    baud: Baud = BAUD,
    output: OptionalResults = None,
    as_json: AsJson = False,
) -> None:
    """Measure flash, RAM, stack and instructions on boards; exit 1 if one exceeds its budget.

    With --port also cycles and stack of the same steps on the board there; exit 1 if its bits differ.
    """
    from mambo_sil.board.footprint.footprint_report import FootprintSummary, page, summarise, text
    from mambo_sil.board.footprint.measure import measure_boards
    from mambo_sil.cli.progress import progress_bar
    from mambo_sil.results.folders import new_results

    settings = load(source, scalar)
    chosen = load_boards(board)
    with contextlib.ExitStack() as stack:
        folder = output and stack.enter_context(new_results(output, FootprintSummary.command, FILES))
        on_board = None
        if port is not None:
            from mambo_sil.board.footprint.measure import usual_ticks
            from mambo_sil.board.footprint.on_board import choose_board, measure_on_board
            from mambo_sil.cli.port import connect

            with connect(port, baud, settings) as connection:
                chosen = [choose_board(chosen, port, connection.greeting.board)]
                with progress_bar("flying") as progress:
                    on_board = measure_on_board(settings, connection, port, usual_ticks(settings), progress)
        with progress_bar("measuring") as progress:
            measured, missing = measure_boards(settings, chosen, optimisation, progress)
        if on_board is not None:
            measured = [replace(one, on_board=on_board) for one in measured]
        summary = summarise(measured, source, settings)
        if folder is not None:
            from mambo_sil.board.footprint.footprint_plots import draw_footprints

            draw_footprints(measured, folder / "footprint")
            (folder / "footprint.html").write_text(page(summary), "utf-8")
            summary.write(folder)
    show(summary, text(measured), as_json=as_json)
    for message in missing:
        typer.echo(message, err=True)
    if not all(one.good for one in measured):
        raise typer.Exit(1)
