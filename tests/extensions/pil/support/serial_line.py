"""Boards as processes behind a serial line that can fail: a host process, or firmware in QEMU."""

import select
import shutil
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import find_target
from mambo_codegen.settings.model import Settings
from tests.support.bundles import place
from tests.support.tools import require, require_module

COMPILERS: Final = {
    "host": ("cc", "gcc"),
    "crazyflie": ("arm-none-eabi-gcc", "gcc-arm-none-eabi"),
    "mega": ("avr-gcc", "gcc-avr and avr-libc"),
}
"""Compiler of each board of the firmware, and its Debian package."""

_QUIET: Final = ("-display", "none", "-monitor", "none", "-chardev", "socket,id=line,fd={fd}")
EMULATORS: Final = {
    "crazyflie": (
        ("qemu-system-arm", "qemu-system-arm"),
        ("-M", "netduinoplus2", *_QUIET, "-serial", "null", "-serial", "chardev:line", "-kernel", "{elf}"),
    ),
    "mega": (
        ("qemu-system-avr", "qemu-system-misc"),
        ("-M", "mega2560", *_QUIET, "-serial", "chardev:line", "-bios", "{elf}"),
    ),
}
"""Emulator of each board with its Debian package, and its arguments."""

Bytes = Callable[[bytes], bytes]


_built: Final[dict[tuple[str, str], Path]] = {}
"""Folders in which firmware was built unchanged, by settings digest and board."""


def build_firmware(
    settings: Settings, board: str, folder: Path, change: Callable[[dict[str, str]], None] | None = None
) -> Path:
    """Build the firmware of `settings` with its own Makefile; a warning is an error. Returns the ELF file.

    `change` may edit the files, {path: text}, before. What has been built is not built again: unchanged
    firmware stays in the folder of its first test, and of changed firmware make builds what has changed.
    """
    compiler, package = COMPILERS[board]
    require(compiler, package)
    here = _built.get((settings.digest, board))
    if here is None or change is not None:
        files = render_target(settings, find_target("pil"), with_digest=False)
        before = dict(files)
        if change is not None:
            change(files)
        if here is not None:
            shutil.copytree(here, folder, dirs_exist_ok=True)
            files = {path: text for path, text in files.items() if text != before.get(path)}
        place(files, folder)
        line = [require("make", "make"), f"BOARD={board}", f"CC={compiler} -Werror", "FLASH=0x08000000"]
        done = subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")
        here = folder
        if change is None:
            _built[settings.digest, board] = folder
    return here / "build" / board / "pil.elf"


def edited(path: str, old: str, new: str) -> Callable[[dict[str, str]], None]:
    """Return a function that replaces `old` in the file at `path`, where it must be."""

    def edit(files: dict[str, str]) -> None:
        assert old in files[path]
        files[path] = files[path].replace(old, new)

    return edit


def command_of(elf: Path) -> list[str]:
    """Return the command that runs a firmware of `build_firmware`; {fd} stands for its end of the line."""
    board = elf.parent.name
    if board not in EMULATORS:
        return [str(elf)]
    (emulator, package), arguments = EMULATORS[board]
    return [require(emulator, package), *(word.replace("{elf}", str(elf)) for word in arguments)]


@dataclass
class Faults:
    """What happens on a line: to each chunk of bytes on either way, and to the board while it answers.

    At each number of chunks from the board in `unplugged` the port is closed; at each in `restarted` the
    board is restarted too, with the firmware `later` if that is not None.
    """

    to_board: Bytes = bytes
    from_board: Bytes = bytes
    unplugged: frozenset[int] = frozenset()
    restarted: frozenset[int] = frozenset()
    later: Path | None = None


class Line:
    """A running board; `port` is the name of the port that leads to it."""

    def __init__(self, elf: Path, faults: Faults) -> None:
        self._elf, self._faults, self._chunks = elf, faults, 0
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = f"socket://127.0.0.1:{self._server.getsockname()[1]}"
        self._start()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the board and the line."""
        self._server.shutdown(socket.SHUT_RDWR)
        self._kill()
        self._thread.join()
        self._near.close()
        self._server.close()

    def _start(self) -> None:
        self._near, far = socket.socketpair()
        with far:
            self._process = subprocess.Popen(
                [word.replace("{fd}", str(far.fileno())) for word in command_of(self._elf)],
                stdin=far.fileno(),
                stdout=far.fileno(),
                pass_fds=[far.fileno()],
            )

    def _kill(self) -> None:
        self._process.kill()
        self._process.wait()

    def _serve(self) -> None:
        """Connect one client after the other to the board."""
        with suppress(OSError):  # the line was closed
            while True:
                client, _ = self._server.accept()
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                with client, suppress(OSError):  # the client went
                    self._carry(client)

    def _carry(self, client: socket.socket) -> None:
        """Carry bytes between `client` and the board until one of them, or a fault, ends it."""
        while True:
            for end in select.select([client, self._near], [], [])[0]:
                chunk = end.recv(4096)
                if not chunk:
                    return
                if end is client:
                    self._near.sendall(self._faults.to_board(chunk))
                    continue
                self._chunks += 1
                if self._chunks in self._faults.restarted:
                    self._kill()
                    self._near.close()
                    self._elf = self._faults.later or self._elf
                    self._start()
                if self._chunks in self._faults.unplugged | self._faults.restarted:
                    return
                client.sendall(self._faults.from_board(chunk))


@contextmanager
def serial_line(elf: Path, faults: Faults | None = None) -> Iterator[Line]:
    """Run a firmware of `build_firmware` behind a line; skip without pyserial, which opens its port."""
    require_module("serial")
    line = Line(elf, faults or Faults())
    try:
        yield line
    finally:
        line.close()
