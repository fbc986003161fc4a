"""The controller on a board, with the interface of the others, whose bits the compiled one checks."""

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods import Method, Step, method_of
from mambo_codegen.numbers.representation import COMMAND
from mambo_codegen.settings.model import Settings
from mambo_sil.board.pil.connection import Connection
from mambo_sil.board.pil.serial_messages import StepReply
from mambo_sil.drone.plant.arrays import IntArray
from mambo_sil.flight.controllers.compiled import CompiledController, as_arrays


@dataclass(frozen=True)
class BoardStep:
    """The result of one step: command_rad (1, 2) and status (1,)."""

    command_rad: NDArray[np.floating]
    status: IntArray


class BoardController:
    """One controller on a board, called as soon as the desk has the next inputs.

    `replies` holds those of all steps, `different` the numbers of the steps whose bits are not the desk's.
    """

    def __init__(self, settings: Settings, board: Connection) -> None:
        self._board, self._desk, self._method = board, CompiledController(settings), method_of(settings)
        self.replies: list[StepReply] = []
        self.different: list[int] = []

    def step(self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike) -> BoardStep:
        """Compute the next command from state (1, 7), target (1, k) and thrust_acceleration_m_s2 (1,).

        `CompiledController.step` explains k.
        Raises BoardError if the board is lost.
        """
        inputs = as_arrays(self._method, 1, state, target, thrust_acceleration_m_s2)
        reply = self._board.step(b"".join(as_bytes(values) for values in inputs))
        desk = self._desk.step(state, target, thrust_acceleration_m_s2)
        if reply.bits != desk_bits(self._method, desk):
            self.different.append(len(self.replies))
        self.replies.append(reply)
        return BoardStep(command_of(self._method, reply), np.array([reply.status]))


def command_of(method: Method, reply: StepReply) -> NDArray[np.floating]:
    """Return roll and pitch (1, 2) of a reply, in rad."""
    numbers = method.numbers
    command = np.frombuffer(reply.command, np.dtype(numbers.scalar).newbyteorder("<"))
    return numbers.to_si(command.astype(numbers.scalar)[np.newaxis], *COMMAND)


def desk_bits(method: Method, step: Step) -> tuple[int, bytes, int]:
    """Return the `StepReply.bits` of a board that has the bits of `step`."""
    counts, outcome = b"", b""
    for one in method.results:
        values = getattr(step, one.name)
        if not one.quantities:
            counts += bytes([int(values[0])])
        elif one.name != "command_rad":
            outcome += as_bytes(method.numbers.from_si(values, *one.quantities))
    command = as_bytes(method.numbers.from_si(step.command_rad, *COMMAND))
    return counts[0], command, zlib.crc32(outcome + counts[1:])


def as_bytes(values: NDArray[np.generic]) -> bytes:
    """Return numbers of the C as a board sends them, the lowest byte first."""
    return values.astype(values.dtype.newbyteorder("<")).tobytes()
