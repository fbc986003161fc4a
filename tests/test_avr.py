"""Eight bits: self-test and digest on an ATmega2560, whose float library has the bits of the reference."""

import subprocess
from pathlib import Path
from threading import Timer

import pytest

from codegen import boards, presets
from codegen.flags import COMPILE_FLAGS
from codegen.frozen import frozen_digest
from codegen.render import render
from tests.support.tools import require

MAIN = Path(__file__).parent / "support" / "avr.c"
LONGEST_S = 60.0
"""A guard against a program that prints nothing; the tests take a second or two."""
EPISODES = 2
"""Frozen episodes that the program runs."""
EFFORT = "return (weights->tracking * distance_m) + (weights->effort * variation_rad);"
HARMED = (
    "return (weights->effort * variation_rad) + (weights->tracking * (distance_m + (nmpc_real_t)0.001f));"
)


def linked(files: dict[str, str], folder: Path) -> Path:
    """Build a bundle with the program that runs its self-test."""
    board = boards.load("mega")
    compiler = require(board.compiler.candidates[0], " and ".join(board.compiler.packages))
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, "utf-8")
    sources = sorted(path for path in files if path.startswith("src/") and path.endswith(".c"))
    command = [
        compiler,
        *board.compiler.flags,
        *COMPILE_FLAGS,
        "-Iinclude",
        *sources,
        str(MAIN),
        *board.compiler.libraries,
        "-o",
        "program.elf",
    ]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "program.elf"


def printed(program: Path) -> str:
    """Return what a program prints before `>`; the emulator never ends by itself."""
    emulator = require("qemu-system-avr", "qemu-system-misc")
    options = ["-M", "mega2560", "-nographic", "-monitor", "none", "-serial", "stdio", "-bios", str(program)]
    with subprocess.Popen(
        [emulator, *options], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as running:
        guard = Timer(LONGEST_S, running.kill)
        guard.start()
        try:
            pipe = running.stdout
            assert pipe is not None
            text = b"".join(iter(lambda: pipe.read(1).strip(b">"), b""))
        finally:
            guard.cancel()
            running.kill()
    return text.decode()


@pytest.mark.parametrize("preset", ["mambo", "table1"])
def test_eight_bits_have_the_bits_of_the_reference(preset: str, tmp_path: Path) -> None:
    """No first difference in the self-test, and the digest of the same steps."""
    settings = presets.load(preset)
    expected = f"0000 {frozen_digest(settings, EPISODES):08X}"
    assert printed(linked(render(settings, with_digest=False), tmp_path)) == expected


def test_a_harmed_controller_shows_on_eight_bits(tmp_path: Path) -> None:
    """A cost with a millimetre too much differs in the first step, and in the digest."""
    settings = presets.load("mambo")
    files = render(settings, with_digest=False)
    assert files["src/nmpc_cost.c"].count(EFFORT) == 1
    harmed = files | {"src/nmpc_cost.c": files["src/nmpc_cost.c"].replace(EFFORT, HARMED)}
    first, digest = printed(linked(harmed, tmp_path)).split()
    assert first == "0001"
    assert int(digest, 16) != frozen_digest(settings, EPISODES)
