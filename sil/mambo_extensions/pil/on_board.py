"""Cycles and stack of a controller on the board at a port, over the flight that `footprint` counts."""

from collections.abc import Callable, Sequence

import numpy as np

from mambo_codegen import boards
from mambo_codegen.boards import Board
from mambo_codegen.errors import echo
from mambo_codegen.settings.model import Settings
from mambo_extensions.pil.board_controller import BoardController
from mambo_extensions.pil.connection import Connection
from mambo_sil.board.footprint.counts import counted_flight
from mambo_sil.board.footprint.on_board import BoardMeasurement, Spread
from mambo_sil.errors import BoardError, FlightError
from mambo_sil.flight.engine.simulate import fly


def choose_board(candidates: Sequence[Board], port: str, says: str) -> Board:
    """Return the board to compare with: the only candidate, or the one that the firmware names.

    Raises BoardError if it names none of them, or several, or another than the only candidate.
    """
    if len(candidates) == 1:
        (board,) = candidates
        named = boards.called(says)
        if named and not board.is_called(says):
            raise BoardError(
                f"--board {echo(board.name)} is not the board at {echo(port)}, whose firmware is that of "
                f"{echo(says)}: give --board {named[0].name}, or no --board"
            )
        return board
    meant = [one for one in candidates if one.is_called(says)]
    if len(meant) != 1:
        named_here = ", ".join(echo(one.name) for one in candidates)
        raise BoardError(
            f"--port {echo(port)}: the firmware is that of {echo(says)}, which names none of {named_here}; "
            "say with one --board which to compare it with"
        )
    return meant[0]


def measure_on_board(
    settings: Settings, board: Connection, port: str, ticks: int, progress: Callable[[float], None]
) -> BoardMeasurement:
    """Fly the `counted_flight` with the controller on a board; a refused tick does not count.

    Raises BoardError if the board is lost, FlightError if the controller refuses every tick.
    """
    controller = BoardController(settings, board)
    fly(counted_flight(settings, ticks), controller, progress)
    accepted = [reply for reply in controller.replies if reply.status == 0]
    if not accepted:
        raise FlightError("the controller refuses every tick of the flight, which is beyond its [ranges]")
    cycles = [reply.cycles for reply in accepted]
    return BoardMeasurement(
        port=echo(port),
        board_says=echo(board.greeting.board),
        clock_hz=board.greeting.clock_hz,
        ticks=len(accepted),
        cycles=Spread.of(cycles),
        mean_cycles=float(np.mean(cycles)),
        stack_bytes=max(reply.stack_bytes for reply in accepted),
        different_steps=len(controller.different),
        link_faults=dict(board.faults),
    )
