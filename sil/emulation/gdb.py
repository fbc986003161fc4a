"""The remote protocol of GDB, spoken to an emulator over its standard streams (GDB manual, appendix E)."""

import os
import select
import subprocess
import tempfile
import time
import weakref
from collections.abc import Sequence
from typing import IO, Final

from mambo_nmpc.sil.errors import EmulationError

PATIENCE_S: Final = 10.0
"""Time that the emulator gets to start, and to answer whatever does not run the guest."""

_SHORT_S: Final = 0.01

_MOST_BYTES: Final = 1024
"""Bytes of memory in one packet."""


class GdbStub:
    """A stopped emulator that obeys: registers, memory, breakpoints, run until it stops again.

    The emulator dies with this object and with this process, however that ends.
    """

    def __init__(self, command: Sequence[str], open_files: Sequence[int]) -> None:
        self._talk = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the emulator
        self._process = subprocess.Popen(
            ["setpriv", "--pdeathsig", "KILL", *command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._talk,
            bufsize=0,
            pass_fds=open_files,
        )
        self._end = weakref.finalize(self, _end, self._process, self._talk)
        self._heard = b""
        self._ask("?")

    def registers(self) -> bytes:
        """Return all registers, in the processor's own order."""
        return bytes.fromhex(self._ask("g"))

    def set_registers(self, content: bytes) -> None:
        """Set all registers."""
        self._command(f"G{content.hex()}")

    def break_at(self, address: int) -> None:
        """Stop before the instruction at `address`."""
        self._command(f"Z0,{address:x},2")

    def write(self, address: int, content: bytes) -> None:
        """Write memory."""
        for start in range(0, len(content), _MOST_BYTES):
            part = content[start : start + _MOST_BYTES]
            self._command(f"M{address + start:x},{len(part):x}:{part.hex()}")

    def read(self, address: int, size: int) -> bytes:
        """Read memory."""
        starts = range(0, size, _MOST_BYTES)
        asked = (f"m{address + start:x},{min(_MOST_BYTES, size - start):x}" for start in starts)
        return b"".join(bytes.fromhex(self._ask(one)) for one in asked)

    def run(self, time_limit_s: float) -> bool:
        """Run until it stops; returns False if it had to be stopped.

        The limit is of processor time: on a busy machine other processes take none of it away. A guest that
        takes none either, as asleep, is given PATIENCE_S more.
        """
        self._send("c")
        end_s = self._processor_time_s() + time_limit_s
        patience = time.monotonic() + time_limit_s + PATIENCE_S
        while (left_s := end_s - self._processor_time_s()) > 0 and time.monotonic() < patience:
            if self._reply(max(left_s, _SHORT_S)) is not None:
                return True
        self._put(b"\x03")
        if self._reply(PATIENCE_S) is None:
            raise self._dead("does not stop")
        return False

    def _processor_time_s(self) -> float:
        """Return what the emulator has taken of a processor (Linux, clock_getcpuclockid)."""
        try:
            return time.clock_gettime((~self._process.pid << 3) | 2)
        except OSError:
            raise self._dead("ended") from None

    def _command(self, text: str) -> None:
        said = self._ask(text)
        if said != "OK":
            raise self._dead(f"answered {said!r} to {text[:20]}")

    def _ask(self, text: str) -> str:
        self._send(text)
        said = self._reply(PATIENCE_S)
        if said is None:
            raise self._dead(f"does not answer {text[:20]}")
        return said

    def _send(self, text: str) -> None:
        content = text.encode()
        self._put(b"$%b#%02x" % (content, sum(content) % 256))

    def _put(self, content: bytes) -> None:
        pipe = self._process.stdin
        assert pipe is not None
        try:
            pipe.write(content)
        except OSError:
            raise self._dead("ended") from None

    def _reply(self, time_limit_s: float) -> str | None:
        """Return the next packet, or None if none comes in time; acknowledgements are passed over."""
        pipe = self._process.stdout
        assert pipe is not None
        deadline = time.monotonic() + time_limit_s
        while True:
            packet, end, rest = self._heard.partition(b"#")
            if end and len(rest) >= 2:
                self._heard = rest[2:]
                return packet.partition(b"$")[2].decode()
            if not select.select([pipe], [], [], max(0.0, deadline - time.monotonic()))[0]:
                return None
            heard = os.read(pipe.fileno(), 0x10000)
            if not heard:
                raise self._dead("ended")
            self._heard += heard

    def _dead(self, what: str) -> EmulationError:
        """End the emulator; returns the error that has its last words."""
        self._process.kill()
        self._process.wait()
        self._talk.seek(0)
        said = self._talk.read().decode(errors="replace").strip().splitlines()
        return EmulationError(f"the emulator {what}{': ' if said else ''}{said[-1] if said else ''}")


def _end(process: subprocess.Popen[bytes], talk: IO[bytes]) -> None:
    process.kill()
    process.wait()
    for stream in (process.stdin, process.stdout, talk):
        if stream is not None:
            stream.close()
