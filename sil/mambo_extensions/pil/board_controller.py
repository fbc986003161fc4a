"""The controller on a board, with the interface of the others, whose bits the compiled one checks."""

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods import Method, Step, method_of
from mambo_codegen.numbers.gravity import hover_thrust
from mambo_codegen.numbers.representation import COMMAND, THRUST
from mambo_codegen.settings.model import Settings
from mambo_extensions.pil.connection import Connection
from mambo_extensions.pil.protocol import StepReply
from mambo_sil.drone.plant.arrays import IntArray
from mambo_sil.flight.controllers.compiled import CompiledController, as_array, as_arrays


@dataclass(frozen=True)
class BoardStep:
    """The result of one step: command_rad (1, 2), status (1,), and with a height thrust_m_s2 (1,)."""

    command_rad: NDArray[np.floating]
    status: IntArray
    thrust_m_s2: NDArray[np.floating] | None = None

    @classmethod
    def of(cls, method: Method, reply: StepReply, status: int) -> "BoardStep":
        """Return the command of a reply with a status."""
        numbers, count = method.numbers, len(COMMAND)
        sent = np.frombuffer(reply.command, np.dtype(numbers.scalar).newbyteorder("<"))
        command = sent.astype(numbers.scalar)[np.newaxis]
        return cls(
            numbers.to_si(command[:, :count], *COMMAND),
            np.array([status]),
            numbers.to_si(command[:, count], *THRUST) if method.has_height else None,
        )

    @classmethod
    def level(cls, method: Method, status: int) -> "BoardStep":
        """Return level attitude, with a height at the thrust of hover."""
        thrust_m_s2 = np.array([hover_thrust(method.settings)]) if method.has_height else None
        return cls(np.zeros((1, 2)), np.array([status]), thrust_m_s2)


@dataclass(frozen=True, eq=False)
class BoardInputs:
    """The inputs of one step: state (1, k), target (1, m), and thrust_m_s2 (1,).

    With a height that is what the drone got in place of the last command, NaN for the command itself.
    """

    state: ArrayLike
    target: ArrayLike
    thrust_m_s2: ArrayLike

    def body(self, method: Method) -> bytes:
        """Return what is sent to a board."""
        thrust = None if method.has_height else self.thrust_m_s2
        numbers = as_arrays(method, 1, self.state, self.target, thrust)
        if method.has_height:
            numbers.append(as_array(method.numbers, self.thrust_m_s2, THRUST, (1,)))
        return b"".join(as_bytes(values) for values in numbers)

    def step(self, controller: CompiledController) -> Step:
        """Return the step of a controller on the desk."""
        if controller.settings.height is None:
            step: Step = controller.step(self.state, self.target, self.thrust_m_s2)
        else:
            controller.report_thrust(self.thrust_m_s2)
            step = controller.step(self.state, self.target)
        return step


class ReportedThrust:
    """The thrust of a board's next step: the one of the call, or with a height the reported one."""

    def __init__(self) -> None:
        self._reported: ArrayLike = np.array([np.nan])

    def report_thrust(self, thrust_m_s2: ArrayLike) -> None:
        """Tell which thrust over mass (1,) the drone got in place of the last command."""
        self._reported = thrust_m_s2

    def inputs(self, state: ArrayLike, target: ArrayLike, thrust_m_s2: ArrayLike | None) -> BoardInputs:
        """Return the inputs of the next step, whose thrust is None with a height."""
        reported, self._reported = self._reported, np.array([np.nan])
        return BoardInputs(state, target, reported if thrust_m_s2 is None else thrust_m_s2)


class BoardController(ReportedThrust):
    """One controller on a board, called as soon as the desk has the next inputs.

    `replies` holds one for each step, `different` the numbers of the steps whose bits are not the desk's.
    """

    def __init__(self, settings: Settings, board: Connection) -> None:
        super().__init__()
        self.settings = settings
        self._board, self._desk, self._method = board, CompiledController(settings), method_of(settings)
        self.replies: list[StepReply] = []
        self.different: list[int] = []

    def step(
        self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike | None = None
    ) -> BoardStep:
        """Compute the next command; the inputs are as of `CompiledController.step`, of one drone.

        Raises BoardError if the board is lost.
        """
        inputs = self.inputs(state, target, thrust_acceleration_m_s2)
        reply = self._board.step(inputs.body(self._method))
        desk = inputs.step(self._desk)
        if reply.bits != desk_bits(self._method, desk):
            self.different.append(len(self.replies))
        self.replies.append(reply)
        return BoardStep.of(self._method, reply, reply.status)


def desk_bits(method: Method, step: Step) -> tuple[int, bytes, int]:
    """Return the `StepReply.bits` of a board that has the bits of `step`."""
    counts, outcome, command = b"", b"", b""
    for one in method.results:
        values = getattr(step, one.name)
        if not one.quantities:
            counts += bytes([int(values[0])])
        elif one.name in ("command_rad", "thrust_m_s2"):
            command += as_bytes(method.numbers.from_si(values, *one.quantities))
        else:
            outcome += as_bytes(method.numbers.from_si(values, *one.quantities))
    return counts[0], command, zlib.crc32(outcome + counts[1:])


def as_bytes(values: NDArray[np.generic]) -> bytes:
    """Return numbers of the C as a board sends them, the lowest byte first."""
    return values.astype(values.dtype.newbyteorder("<")).tobytes()
