"""Client of GDB's remote protocol, over an emulator's standard streams (GDB manual, appendix E)."""

import os
import select
import subprocess
import tempfile
import time
import weakref
from collections.abc import Sequence
from typing import IO, Final

from mambo_sil.errors import EmulationError

TIME_LIMIT_S: Final = 10.0
"""Time limit of the emulator's start and of every request that does not run the guest."""

_MIN_WAIT_S: Final = 0.01

_MAX_PACKET_BYTES: Final = 1024
"""Largest memory access in one packet."""


class GdbStub:
    """A stopped emulator: access registers and memory, set breakpoints, run until it stops.

    The emulator is killed when this object is destroyed, and when this process ends in any way.
    """

    def __init__(self, command: Sequence[str], open_files: Sequence[int]) -> None:
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the emulator
        self._process = subprocess.Popen(
            ["setpriv", "--pdeathsig", "KILL", *command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            bufsize=0,
            pass_fds=open_files,
        )
        self._finalizer = weakref.finalize(self, _stop, self._process, self._log)
        self._received = b""
        self._request("?")

    def registers(self) -> bytes:
        """Return all registers, in the processor's order."""
        return bytes.fromhex(self._request("g"))

    def set_registers(self, content: bytes) -> None:
        """Set all registers."""
        self._command(f"G{content.hex()}")

    def set_breakpoint(self, address: int) -> None:
        """Stop before the instruction at `address`."""
        self._command(f"Z0,{address:x},2")

    def write(self, address: int, content: bytes) -> None:
        """Write memory."""
        for start in range(0, len(content), _MAX_PACKET_BYTES):
            part = content[start : start + _MAX_PACKET_BYTES]
            self._command(f"M{address + start:x},{len(part):x}:{part.hex()}")

    def read(self, address: int, size: int) -> bytes:
        """Read memory."""
        starts = range(0, size, _MAX_PACKET_BYTES)
        asked = (f"m{address + start:x},{min(_MAX_PACKET_BYTES, size - start):x}" for start in starts)
        return b"".join(bytes.fromhex(self._request(one)) for one in asked)

    def run(self, time_limit_s: float) -> bool:
        """Run until the guest stops; returns False if it reached the time limit.

        The limit is processor time, which a busy machine does not use up. A guest that uses none, such as one
        asleep, is stopped TIME_LIMIT_S after the limit has passed on the wall clock.
        """
        self._send("c")
        end_s = self._processor_time_s() + time_limit_s
        patience = time.monotonic() + time_limit_s + TIME_LIMIT_S
        while (left_s := end_s - self._processor_time_s()) > 0 and time.monotonic() < patience:
            if self._receive(max(left_s, _MIN_WAIT_S)) is not None:
                return True
        self._write_pipe(b"\x03")
        if self._receive(TIME_LIMIT_S) is None:
            raise self._fail("does not stop")
        return False

    def _processor_time_s(self) -> float:
        """Return the emulator's processor time (Linux, clock_getcpuclockid)."""
        try:
            return time.clock_gettime((~self._process.pid << 3) | 2)
        except OSError:
            raise self._fail("ended") from None

    def _command(self, text: str) -> None:
        answer = self._request(text)
        if answer != "OK":
            raise self._fail(f"answered {answer!r} to {text[:20]}")

    def _request(self, text: str) -> str:
        self._send(text)
        answer = self._receive(TIME_LIMIT_S)
        if answer is None:
            raise self._fail(f"does not answer {text[:20]}")
        return answer

    def _send(self, text: str) -> None:
        content = text.encode()
        self._write_pipe(b"$%b#%02x" % (content, sum(content) % 256))

    def _write_pipe(self, content: bytes) -> None:
        pipe = self._process.stdin
        assert pipe is not None
        try:
            pipe.write(content)
        except OSError:
            raise self._fail("ended") from None

    def _receive(self, time_limit_s: float) -> str | None:
        """Return the next packet without acknowledgements, or None if none arrives in time."""
        pipe = self._process.stdout
        assert pipe is not None
        deadline = time.monotonic() + time_limit_s
        while True:
            packet, end, rest = self._received.partition(b"#")
            if end and len(rest) >= 2:
                self._received = rest[2:]
                return packet.partition(b"$")[2].decode()
            if not select.select([pipe], [], [], max(0.0, deadline - time.monotonic()))[0]:
                return None
            chunk = os.read(pipe.fileno(), 0x10000)
            if not chunk:
                raise self._fail("ended")
            self._received += chunk

    def _fail(self, what: str) -> EmulationError:
        """Kill the emulator; returns an EmulationError with its last line of stderr."""
        self._process.kill()
        self._process.wait()
        self._log.seek(0)
        lines = self._log.read().decode(errors="replace").strip().splitlines()
        return EmulationError(": ".join([f"the emulator {what}", *lines[-1:]]))


def _stop(process: subprocess.Popen[bytes], log: IO[bytes]) -> None:
    process.kill()
    process.wait()
    for stream in (process.stdin, process.stdout, log):
        if stream is not None:
            stream.close()
