"""Cycles and stack of a controller on the board at a port, over the flight that `footprint` counts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mambo_codegen import boards
from mambo_codegen.boards import Board
from mambo_codegen.errors import echo
from mambo_codegen.settings.model import Settings
from mambo_extensions.pil.board_controller import BoardController
from mambo_extensions.pil.connection import Connection
from mambo_extensions.pil.pil_report import Spread
from mambo_sil.board.footprint.counts import counted_flight
from mambo_sil.errors import BoardError, FlightError
from mambo_sil.flight.engine.simulate import fly


@dataclass(frozen=True)
class BoardMeasurement:
    """What a board measured in the steps of a flight that its controller accepted."""

    port: str
    board_says: str
    """The name of the board in its firmware."""
    clock_hz: int
    ticks: int
    cycles: Spread
    """Of `nmpc_step`, at `clock_hz`."""
    mean_cycles: float
    stack_bytes: int
    different_steps: int
    """Steps with other bits than on this machine."""
    link_faults: dict[str, int]
    """What went wrong on the link and was made good."""

    @property
    def sentence(self) -> str:
        """What was flown on which board, and whether its bits are those of this machine."""
        bits = (
            f"{self.different_steps} STEPS HAVE OTHER BITS THAN ON THIS MACHINE"
            if self.different_steps
            else "all bits equal those of this machine"
        )
        clock = f"{self.clock_hz / 1e6:g} MHz"
        return f"{self.board_says} at {clock}, {self.port}: {self.ticks} steps of the counted flight, {bits}"


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
