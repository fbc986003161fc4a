"""The controller on a board whose own clock calls the step: the flight goes by the clock of the board.

    end of period   board: step with inputs of   desk, upon the reply: sends inputs of  flies the drone
    k               update k - 1                 update k                               from k to k + 1
    k + 1           update k                     update k + 1                           from k + 1 to k + 2

When the reply to a step arrives, the drone has flown with the last command until the end of that period. Its
state at that time is sent at once, and it goes on with the new command. So every step has inputs of one
update before. If a reply does not arrive, the next one tells how many periods passed: the drone flew all of
them with its last command.
"""

import time
from collections import deque
from dataclasses import dataclass
from typing import Final

from numpy.typing import ArrayLike

from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings
from mambo_extensions.pil.board_controller import BoardInputs, BoardStep, ReportedThrust, desk_bits
from mambo_extensions.pil.connection import NO_FLIGHT, Connection, command_bytes
from mambo_extensions.pil.protocol import (
    DAMAGED,
    NAMED_STEPS,
    OUT_OF_STEP,
    REPLY,
    Kind,
    StepReply,
    TimedReply,
)
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.errors import BoardError
from mambo_sil.flight.controllers.compiled import CompiledController

OLDEST_INPUTS: Final = 250
"""Inputs in a row that a board may not receive before the flight ends: a reply names them modulo 256."""


@dataclass(frozen=True)
class Arrival:
    """A reply, and when it came."""

    number: int
    """Of the step."""
    reply: TimedReply
    time_s: float
    """By the clock of this machine."""

    @property
    def period(self) -> int:
        """The number of periods over when the board made the step."""
        return self.number + 1 + self.reply.overruns


class TimedController(ReportedThrust):
    """One controller on a board, called by the clock of the board.

    `arrivals` holds the replies that came, `different` the numbers of those whose bits are not the desk's.
    The desk makes every step of the board, also those whose replies were lost, with the same inputs.
    """

    def __init__(self, settings: Settings, board: Connection) -> None:
        super().__init__()
        self.settings = settings
        self._board, self._desk, self._method = board, CompiledController(settings), method_of(settings)
        self._command_bytes = command_bytes(self._method)
        self._update = 0
        self._heard = deque[tuple[int, int, bytes]]()
        self._sent: list[BoardInputs] = []
        self._last_request = (Kind.START, 0, b"")
        self._held = BoardStep.level(self._method, NOT_CALLED)
        self.arrivals: list[Arrival] = []
        self.different: list[int] = []
        self.late_inputs = self.lost_replies = 0

    @property
    def replies(self) -> list[StepReply]:
        """The results of the steps whose replies came."""
        return [arrival.reply.step for arrival in self.arrivals]

    def step(
        self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike | None = None
    ) -> BoardStep:
        """Wait for the end of the board's period; return its command, or the last one if the period has none.

        The next step gets the inputs, as of `CompiledController.step`, of one drone. The first
        call starts the clock, and returns level attitude, with a height at the thrust of hover.
        Raises BoardError if the board is lost, or if its steps can no longer be followed.
        """
        inputs = self.inputs(state, target, thrust_acceleration_m_s2)
        update, self._update = self._update, self._update + 1
        if update == 0:
            self._send(Kind.START, inputs)
            return self._held
        arrived, used = None, list[int]()
        if not self.arrivals or self.arrivals[-1].period < update:
            arrived = self._await_reply()
            used = self._inputs_used(arrived)
            self.arrivals.append(arrived)
        newest = self.arrivals[-1]
        if newest.period == update:
            self._send(Kind.INPUTS, inputs)
        if arrived is not None:
            self._follow(arrived, used)
        if newest.period > update:
            return self._held
        result = newest.reply.step
        self._held = BoardStep.of(self._method, result, NOT_CALLED)
        return BoardStep.of(self._method, result, result.status)

    def _send(self, kind: Kind, inputs: BoardInputs) -> None:
        """Send the next inputs."""
        self._last_request = (kind, len(self._sent), inputs.body(self._method))
        self._board.tell(*self._last_request)
        self._sent.append(inputs)

    def _await_reply(self) -> Arrival:
        """Return the next reply, and repeat the last request if none comes; raises BoardError."""
        patience, period_s = self._board.patience, self._board.period_s
        started = asked = time.monotonic()
        while time.monotonic() < started + patience.silence_s + period_s:
            while self._heard:
                arrival = self._reply_in(*self._heard.popleft())
                if arrival is not None:
                    return arrival
            if time.monotonic() > asked + patience.reply_s + period_s:
                self._board.tell(*self._last_request)
                asked = time.monotonic()
            self._heard.extend(self._board.hear())
        raise self._lost(f"no reply for {patience.silence_s:g} s")

    def _reply_in(self, kind: int, number: int, body: bytes) -> Arrival | None:
        """Return what a frame brings, or None if that is no new reply; raises BoardError."""
        now_s = time.perf_counter()
        if kind == DAMAGED:
            self._board.faults["damaged"] += 1
        elif kind == OUT_OF_STEP:
            raise self._lost("the board was restarted; check its supply")
        elif kind == Kind.START | REPLY:
            reply = TimedReply.parse(body, self._command_bytes)
            if reply is None:
                raise self._lost("the board replies with numbers of another size")
            if number >= self._steps:
                return Arrival(number, reply, now_s)
            self._board.faults["doubled"] += 1
        return None

    @property
    def _steps(self) -> int:
        """Steps of the board that the desk knows of."""
        return self.arrivals[-1].number + 1 if self.arrivals else 0

    def _inputs_used(self, arrived: Arrival) -> list[int]:
        """Return the numbers of the inputs of each step since the last reply, and count what went wrong."""
        lost, newest = arrived.number - self._steps, len(self._sent) - 1
        if lost >= NAMED_STEPS:
            raise self._lost(
                f"{lost} replies in a row were lost, and a reply names the inputs of {NAMED_STEPS - 1} steps "
                "before its own; check wires and --baud"
            )
        used = [newest - ((newest - byte) & 0xFF) for byte in reversed(arrived.reply.used[: lost + 1])]
        overruns = self.arrivals[-1].reply.overruns if self.arrivals else 0
        if min(used) < 0 or arrived.reply.overruns < overruns:
            raise self._lost(
                f"the reply to step {arrived.number} contradicts those before; check the memory of the board"
            )
        if newest - used[-1] > OLDEST_INPUTS:
            raise self._lost(
                f"the board did not receive the last {OLDEST_INPUTS} inputs in time; check the wire to its "
                "receiver, and what else keeps this machine busy"
            )
        self.lost_replies += lost
        self.late_inputs += used[0] < newest
        return used

    def _follow(self, arrived: Arrival, used: list[int]) -> None:
        """Make the board's steps with the inputs of these numbers, and compare the one that is known."""
        for number in used:
            desk = self._sent[number].step(self._desk)
        if arrived.reply.step.bits != desk_bits(self._method, desk):
            self.different.append(arrived.number)

    def _lost(self, reason: str) -> BoardError:
        return BoardError(f"--port {self._board.name}: {reason}; {NO_FLIGHT}")
