"""The controller on a board: requests, repeated until they are answered, over a link that may fail.

A step is sent with its number, so the board runs it once however often it is repeated. If the board was
restarted, the steps so far are sent again, and it must answer them with the same bits.
"""

import contextlib
import os
import socket
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from mambo_codegen import __version__
from mambo_codegen.bundle.bundle import GENERATOR
from mambo_codegen.errors import echo
from mambo_codegen.methods import Method, method_of
from mambo_codegen.settings.model import Settings
from mambo_extensions.pil.protocol import (
    DAMAGED,
    HEAD_BYTES,
    OUT_OF_STEP,
    PROTOCOL,
    REPLY,
    Greeting,
    Kind,
    Receiver,
    StepReply,
    encode,
    frame_bytes,
    request,
    split,
    step_reply_bytes,
)
from mambo_extensions.pil.serial_port import Port
from mambo_sil.errors import BoardError

NO_FLIGHT: Final = "a flight in real time cannot be repeated, so none is written"
_MOST_RESTARTS: Final = 10
_MOST_RETURNS: Final = 100
_REOPEN_PAUSE_S: Final = 0.1


@dataclass(frozen=True)
class Patience:
    """How long to wait for a board, in s."""

    reply_s: float = 0.25
    """For a reply, before the request is repeated; every board answers a step sooner."""
    test_s: float = 4.0
    """The same for a self-test or an episode of the digest, of 100 steps: 1.5 s with a 1-norm on a Mega."""
    silence_s: float = 8.0
    """For a reply to any repetition; a board with a boot loader takes 2 s until it answers."""
    return_s: float = 30.0
    """For a port that was closed, such as the port of an unplugged board."""


class _RestartedError(BoardError):
    """The board expects another step than the next one."""


class Connection:
    """A board behind a port, whose firmware must be made from `settings`.

    `faults` counts what went wrong on the link and was made good. `say` tells the user of it.
    """

    def __init__(
        self,
        name: str,
        open_port: Callable[[], Port],
        settings: Settings,
        *,
        say: Callable[[str], None],
        patience: Patience | None = None,
    ) -> None:
        self.name, self._open, self._settings, self._say = echo(name), open_port, settings, say
        self._command_bytes = command_bytes(method_of(settings))
        self.patience = patience or Patience()
        self.faults = Counter[str]()
        self.round_trips_s: list[float] = []
        self._flown: list[tuple[bytes, StepReply]] = []
        self._numbers = self._received_bytes = 0
        self._timed = False
        try:
            self._port, self._receiver = open_port(), Receiver()
        except OSError as error:
            raise BoardError(f"--port {self.name}: cannot be opened: {_reason(error)}") from error
        try:
            self.greeting = self._greet()
        except OSError as error:
            self._port.close()
            raise BoardError(f"--port {self.name}: closed without an answer: {_reason(error)}") from error
        self.faults.clear()  # a board that starts when its port is opened misses the first requests
        self._ask_anew(Kind.RESET)

    def close(self) -> None:
        """Release the port; a board whose clock calls the step is asked to stop it."""
        if self._timed:
            with contextlib.suppress(OSError):
                self._port.write(encode(request(Kind.RESET, 0)))
        self._port.close()

    @property
    def period_s(self) -> float:
        """The update period by the board's clock."""
        return self.greeting.period_cycles / self.greeting.clock_hz

    def tell(self, kind: Kind, number: int, body: bytes) -> None:
        """Send a request that has no reply of its own; raises BoardError."""
        self._timed = True
        try:
            self._port.write(encode(request(kind, number, body)))
        except OSError as error:
            raise self._gone(error) from error

    def hear(self) -> list[tuple[int, int, bytes]]:
        """Return kind, number and body of the frames that the next bytes complete; raises BoardError."""
        try:
            chunk = self._port.read(max(1, self._port.in_waiting))
        except OSError as error:
            raise self._gone(error) from error
        return [split(payload or b"") for payload in self._receiver.feed(chunk)]

    def _gone(self, error: OSError) -> BoardError:
        self._timed = False
        return BoardError(f"--port {self.name}: lost: {_reason(error)}; {NO_FLIGHT}")

    def test(self) -> int:
        """Run the self-test, and reset; returns 0, or the number of the first step with other bits."""
        return int.from_bytes(self._ask_anew(Kind.TEST), "little", signed=True)

    def digest(self, episodes: int, progress: Callable[[float], None] | None = None) -> int:
        """Run the first episodes of the self-test digest, and reset; returns their digest.

        Calls `progress` with the share done after each.
        """
        digest = b"\0\0\0\0"
        for episode in range(episodes):
            digest = self._ask(Kind.DIGEST, episode, digest, HEAD_BYTES + len(digest))
            if progress is not None:
                progress((episode + 1) / episodes)
        return int.from_bytes(digest, "little")

    def step(self, inputs: bytes) -> StepReply:
        """Run the next step on the board, once; raises BoardError if the board cannot be made to."""
        restarted = False
        while True:
            try:
                if restarted:
                    self._fly_again()
                reply = self._ask_step(len(self._flown), inputs)
            except _RestartedError:
                restarted = True
                self._count_restart()
            else:
                self._flown.append((inputs, reply))
                return reply

    def _count_restart(self) -> None:
        self.faults["restarts"] += 1
        if self.faults["restarts"] > _MOST_RESTARTS:
            raise BoardError(f"--port {self.name}: the board restarts again and again; check its supply")
        self._say(f"{self.name}: the board was restarted; it flies its {len(self._flown)} steps again")

    def _fly_again(self) -> None:
        """Bring a board that was restarted to where it was."""
        self._ask_anew(Kind.RESET)
        for number, (inputs, before) in enumerate(self._flown):
            if self._ask_step(number, inputs).bits != before.bits:
                raise BoardError(
                    f"--port {self.name}: after a restart the board answers step {number} with other bits "
                    "than before; check its supply and its memory"
                )

    def _ask_step(self, number: int, inputs: bytes) -> StepReply:
        started, repeated = time.perf_counter(), self.faults["repeated"]
        expected = step_reply_bytes(self._command_bytes)
        reply = StepReply.parse(self._ask(Kind.STEP, number, inputs, expected), self._command_bytes)
        if reply is None:
            raise BoardError(f"--port {self.name}: the board answers a step with numbers of another size")
        if repeated == self.faults["repeated"]:
            self.round_trips_s.append(time.perf_counter() - started)
        return reply

    def _greet(self) -> Greeting:
        """Return the greeting; raises BoardError unless the board runs the firmware of the settings."""
        greeting = Greeting.parse(self._ask_anew(Kind.GREET))
        settings, ours = self._settings.short_digest, f"{GENERATOR} {__version__}"
        if greeting is None or greeting.protocol != PROTOCOL:
            found = "another protocol" if greeting is None else f"version {greeting.protocol} of the protocol"
            fault = f"speaks {found}, and this is version {PROTOCOL}"
        elif greeting.settings != settings:
            fault = f"is that of settings {echo(greeting.settings)}, and this flight that of {settings}"
        elif greeting.generator != ours:
            fault = f"was generated by {echo(greeting.generator)}, and this is {ours}"
        elif greeting.scalar != self._settings.code.scalar:
            fault = f"computes in {echo(greeting.scalar)}, and this flight in {self._settings.code.scalar}"
        elif not greeting.has_period(self._settings.horizon.update_period_s):
            fault = (
                f"calls {greeting.period_cycles} cycles of {greeting.clock_hz} Hz its update period, "
                f"and that is {self._settings.horizon.update_period_s:g} s"
            )
        else:
            return greeting
        raise BoardError(
            f"--port {self.name}: the firmware on the board {fault}; "
            "generate it from these settings with mambo-nmpc generate --for pil, build and flash it"
        )

    def _ask_anew(self, kind: Kind) -> bytes:
        """Send a request that the board may run twice, with a number of its own; returns the reply's body."""
        self._numbers += 1
        return self._ask(kind, self._numbers, b"", HEAD_BYTES)

    def _ask(self, kind: Kind, number: int, body: bytes, expected: int) -> bytes:
        """Repeat a request until it is answered; returns the body of the reply.

        `expected` is the length of its payload, which saves time but need not be right. Raises BoardError if
        the board stays silent, _RestartedError for a step that it does not expect, and OSError if the port
        fails while the board is greeted.
        """
        frame, patience = encode(request(kind, number, body)), self.patience
        wait_s = patience.test_s if kind in (Kind.TEST, Kind.DIGEST) else patience.reply_s
        deadline = time.monotonic() + patience.silence_s
        while time.monotonic() < deadline:
            try:
                self._port.write(frame)
                reply = self._await(kind, number, wait_s, frame_bytes(expected))
            except OSError as error:
                if kind == Kind.GREET:
                    raise
                self._reconnect(error)
                deadline = time.monotonic() + patience.silence_s
                continue
            if reply is not None:
                return reply
            self.faults["repeated"] += 1
        arrived = (
            f"{self._received_bytes} B arrived, but no answer" if self._received_bytes else "nothing came"
        )
        raise BoardError(
            f"--port {self.name}: the board does not answer, {arrived}; check its supply, its wires, "
            "--baud, and that it has the firmware of mambo-nmpc generate --for pil"
        )

    def _await(self, kind: Kind, number: int, wait_s: float, size: int) -> bytes | None:
        """Return the body of the reply; None if none came, or if a frame was damaged on either way."""
        deadline = time.monotonic() + wait_s
        while time.monotonic() < deadline:
            chunk = self._port.read(size)
            self._received_bytes += len(chunk)
            for payload in self._receiver.feed(chunk):
                found, replied, body = split(payload or b"")
                if (found, replied) == (kind | REPLY, number):
                    return body
                if found == OUT_OF_STEP and kind == Kind.STEP:
                    raise _RestartedError
                if found == DAMAGED:
                    self.faults["damaged"] += 1
                    self._drain(deadline)
                    return None
            size = max(1, self._port.in_waiting)
        return None

    def _drain(self, deadline: float) -> None:
        """Drop what is still on its way, so that each fault is answered by one repetition."""
        while self._port.read(1) and time.monotonic() < deadline:
            pass
        self._receiver = Receiver()

    def _reconnect(self, error: OSError) -> None:
        """Wait until the port is back, with the same firmware behind it; raises BoardError."""
        self.faults["reconnected"] += 1
        if self.faults["reconnected"] > _MOST_RETURNS:
            raise BoardError(f"--port {self.name}: is lost again and again; check plug and cable")
        self._say(f"{self.name}: lost: {_reason(error)}; waiting {self.patience.return_s:g} s for it")
        deadline = time.monotonic() + self.patience.return_s
        while True:
            with contextlib.suppress(OSError):
                self._port.close()
            try:
                self._port, self._receiver = self._open(), Receiver()
                self.greeting = self._greet()
            except OSError as again:
                if time.monotonic() > deadline:
                    raise BoardError(
                        f"--port {self.name}: did not come back: {_reason(again)}; no flight is written"
                    ) from again
                time.sleep(_REOPEN_PAUSE_S)
            else:
                return


def command_bytes(method: Method) -> int:
    """Return the length of a command on the line."""
    number_bytes, _ = method.numbers.bytes
    return len(method.command) * number_bytes


def _reason(error: OSError) -> str:
    """Return why a port failed; pyserial's own words repeat the name of the port."""
    cause = error.__context__ if isinstance(error.__context__, OSError) else error
    if isinstance(cause, socket.gaierror):  # its numbers are not the system's
        return str(cause.strerror)
    return os.strerror(cause.errno) if cause.errno else echo(str(cause))
