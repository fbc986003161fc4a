"""A board whose clock stands still until the desk has sent its inputs, on a line whose faults are chosen."""

import os
import select
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mambo_codegen.settings.model import Settings
from mambo_extensions.pil.protocol import DELIMITER, REPLY, Kind, Receiver, decode, split
from mambo_extensions.pil.serial_port import READ_S
from tests.extensions.pil.support.serial_line import build_firmware

PERIOD: Final = 3 * DELIMITER
"""Lets a period of a lockstep board pass; a frame with another one after it has two delimiters in a row."""

BOARD_C: Final = r"""
#include <stdio.h>

#include "pil.h"

const char pil_board_name[] = "lockstep";
const uint32_t pil_board_cycle_mask = 0x3FFUL;

static uint32_t now = 0x3F8UL; /* comes round in the first period */
static uint32_t periods;
static int zeros;

uint32_t pil_board_init(void)
{
    return 1000UL;
}

int pil_board_read(uint32_t cycles)
{
    int byte = PIL_NOTHING;

    (void)cycles;
    if (zeros == 3) {
        zeros = 0;
        periods++;
        now += (uint32_t)CYCLES;
    } else {
        (void)fflush(stdout);
        byte = getchar();
        zeros = (byte == 0) ? (zeros + 1) : 0;
        byte = (byte == EOF) ? PIL_END : byte;
    }
    return byte;
}

void pil_board_write(uint8_t byte)
{
    (void)putchar((int)byte);
}

uint32_t pil_board_cycles(void)
{
    return now & pil_board_cycle_mask;
}
"""


def build_lockstep(
    settings: Settings,
    folder: Path,
    change: Callable[[dict[str, str]], None] | None = None,
    cycles: str = "10UL",
) -> Path:
    """Build firmware for a process whose clock, of 1000 Hz, moves with each PERIOD that it reads only.

    `cycles` says in C, with `periods` so far, how many cycles pass then.
    """

    def make(files: dict[str, str]) -> None:
        files["board_host.c"] = BOARD_C.replace("CYCLES", f"({cycles})")
        if change is not None:
            change(files)

    return build_firmware(settings, "host", folder, make)


def keep(_number: int, frame: bytes) -> bytes:
    """Return a frame as it is."""
    return frame


@dataclass(frozen=True)
class TimedFaults:
    """What happens to each frame of inputs and to each reply of a board in lockstep, by its number.

    None in place of a reply silences the board. In place of a reply in `restarted` the board is restarted, in
    place of one in `unplugged` the port is gone.
    """

    inputs: Callable[[int, bytes], bytes] = keep
    reply: Callable[[int, bytes], bytes | None] = keep
    restarted: frozenset[int] = frozenset()
    unplugged: frozenset[int] = frozenset()


class LockstepPort:
    """The port of a board of `build_lockstep`; inputs of the desk, and each lost reply, end a period."""

    def __init__(self, elf: Path, faults: TimedFaults) -> None:
        self._elf, self._faults = elf, faults
        self._arrived, self._rest, self._silent, self._gone = b"", b"", False, False
        self._start()

    def _start(self) -> None:
        self._process = subprocess.Popen(
            [self._elf], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0
        )

    def _send(self, data: bytes) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(data)

    @property
    def in_waiting(self) -> int:
        """Bytes that have arrived."""
        return len(self._arrived)

    def write(self, data: bytes) -> None:
        """Send a frame."""
        kind, number, _ = split(decode(data[1:-1]) or b"")
        if self._gone:
            raise OSError(5, "gone")
        if kind in (Kind.START, Kind.INPUTS):
            self._send(self._faults.inputs(number, data) + PERIOD)
        else:
            self._send(data)

    def read(self, size: int) -> bytes:
        """Return bytes from the board."""
        if not self._arrived:
            self._receive()
        data, self._arrived = self._arrived[:size], self._arrived[size:]
        return data

    def close(self) -> None:
        """End the board."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()

    def _receive(self) -> None:
        assert self._process.stdout is not None
        descriptor = self._process.stdout.fileno()
        if self._gone:
            raise OSError(5, "gone")
        if not select.select([descriptor], [], [], READ_S)[0]:
            return
        *complete, self._rest = (self._rest + os.read(descriptor, 4096)).split(DELIMITER)
        for frame in filter(None, complete):
            self._carry(DELIMITER + frame + DELIMITER)

    def _carry(self, frame: bytes) -> None:
        """Carry a frame from the board to the desk."""
        kind, number, _ = split(decode(frame[1:-1]) or b"")
        if kind != Kind.START | REPLY:
            self._arrived += frame
            return
        changed = self._faults.reply(number, frame)
        self._silent |= changed is None
        self._gone |= number in self._faults.unplugged
        if number in self._faults.restarted:
            self.close()
            self._start()
        elif not (changed is None or self._silent or self._gone):
            self._arrived += changed
            if not any(Receiver().feed(changed)):
                self._send(PERIOD)
