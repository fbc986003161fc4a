"""The firmware for processor in the loop: it compiles everywhere, and flies bit for bit in QEMU."""

import json
import os
import subprocess
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_codegen import boards
from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import to_toml, with_option
from mambo_codegen.settings.model import Settings
from mambo_extensions.pil.board_controller import BoardController
from mambo_extensions.pil.connection import Connection
from mambo_extensions.pil.serial_port import open_port
from mambo_sil.board.firmware.elf import load
from mambo_sil.board.firmware.firmware_build import ENTRY, builder
from mambo_sil.board.firmware.stack import bound_stack
from tests.extensions.pil.support.serial_line import Line, build_firmware, edited, serial_line
from tests.support.command import run, unwrapped
from tests.support.height_settings import height_settings
from tests.support.tools import without_compilers_of_boards

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

CASES = [
    ("host", "mambo", "float32"),
    ("host", "mambo", "float64"),
    ("host", "mambo-1norm", "fixed"),
]
LONG_CASES = [
    ("host", "mambo-1norm", "float32"),
    ("host", "mambo-1norm", "float64"),
    ("host", "mambo", "fixed"),
    ("crazyflie", "mambo-1norm", "float32"),
    ("crazyflie", "mambo", "fixed"),
    ("crazyflie", "mambo-1norm", "fixed"),
    ("mega", "mambo", "fixed"),
    ("mega", "mambo-1norm", "fixed"),
]


def flown(line: Line, source: str, *options: str, code: int = 0) -> dict[str, Any]:
    """Fly with the board on `line`; return the summary. `test_footprint` has the flights with a count."""
    with without_compilers_of_boards():
        said, _ = run("fly", source, "--port", line.port, *options, "--no-pictures", "--json", code=code)
    summary: dict[str, Any] = json.loads(said)
    return summary


def demand_same_bits(summary: dict[str, Any], steps: int, board: str) -> None:
    """Demand a flight of `steps` on `board` that has the bits of this machine, over a line without damage.

    On a busy machine a reply may be late, and its request repeated.
    """
    assert (summary["steps"], summary["different_steps"], summary["self_test_difference"]) == (steps, 0, 0)
    assert (summary["same_digest"], summary["same_bits_as_host"]) == (True, True)
    assert summary["board_says"] == board
    assert set(summary["link_faults"]) <= {"repeated"}


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("board", "preset", "scalar"),
    [*CASES, *(pytest.param(*case, marks=pytest.mark.long) for case in LONG_CASES)],
)
def test_every_scalar_type_and_norm_flies_bit_for_bit(
    board: str, preset: str, scalar: str, tmp_path: Path
) -> None:
    """The self-test, 400 steps with good and bad inputs, a short flight; no warning of the compiler."""
    settings = with_option(presets.preset(preset), "code.scalar", scalar)
    with serial_line(build_firmware(settings, board, tmp_path / "pil")) as line:
        summary = flown(line, preset, "--scalar", scalar, "--duration-s", "0.2")
    names = {"host": "host process", "crazyflie": "STM32F405", "mega": "Arduino Mega 2560"}
    demand_same_bits(summary, 21, names[board])


@pytest.mark.sampled(2)
@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("board", "scalar"),
    [
        ("host", "float32"),
        pytest.param("host", "float64", marks=pytest.mark.long),
        pytest.param("host", "fixed", marks=pytest.mark.long),
        pytest.param("crazyflie", "float32", marks=pytest.mark.long),
        pytest.param("mega", "fixed", marks=pytest.mark.long),
    ],
)
def test_a_height_flies_bit_for_bit(board: str, scalar: str, tmp_path: Path) -> None:
    """On a course in space, from the floor."""
    settings = height_settings(scalar)
    (tmp_path / "height.toml").write_text(to_toml(settings), "utf-8")
    course = ("--trajectory", "take-off-and-landing", "--size-m", "1", "--vehicle", "crazyflie")
    with serial_line(build_firmware(settings, board, tmp_path / "pil")) as line:
        summary = flown(line, "height.toml", *course, "--yaw-rad", "1", "--duration-s", "0.4")
    names = {"host": "host process", "crazyflie": "STM32F405", "mega": "Arduino Mega 2560"}
    demand_same_bits(summary, 41, names[board])


@pytest.mark.parametrize("scalar", ["float32", pytest.param("fixed", marks=pytest.mark.long)])
def test_the_thrust_that_a_mixer_made_of_a_command_is_sent(scalar: str, tmp_path: Path) -> None:
    """It changes the next step, on the board as on the desk; without one the command stands."""
    settings = height_settings(scalar)
    replies = []
    for reported in (False, True):
        draw = np.random.default_rng(3)
        with (
            serial_line(build_firmware(settings, "host", tmp_path / "pil")) as line,
            closing(Connection("line", partial(open_port, line.port, 500000), settings, say=print)) as board,
        ):
            controller = BoardController(settings, board)
            for step in range(20):
                state, target = draw.normal(0.0, 0.3, (1, 10)), draw.normal(0.0, 0.3, (1, 13))
                state[0, 9], target[0, 12] = step % 2, step % 3
                if reported and step == 10:
                    controller.report_thrust([4.0])
                controller.step(state, target)
        assert (len(controller.replies), controller.different) == (20, [])
        replies.append([reply.bits for reply in controller.replies])
    silent, answered = replies
    assert silent[:10] == answered[:10]
    assert silent[10] != answered[10]


@pytest.mark.long
def test_the_flight_is_the_one_without_a_board(tmp_path: Path) -> None:
    """The same trace, byte for byte, and a page of it; through a pseudo terminal as through a socket."""
    elf = build_firmware(presets.preset("mambo"), "host", tmp_path / "pil")
    near, far = os.openpty()
    with subprocess.Popen([elf], stdin=near, stdout=near) as process:
        options = ["--duration-s", "1", "--push", "0.2,0.1", "-o"]
        said, _ = run("fly", "--port", os.ttyname(far), *options, "board")
        process.kill()
    os.close(near)
    os.close(far)
    assert "all bits of 101 steps equal those of this machine" in unwrapped(said)
    run("fly", *options, "desk")
    assert (tmp_path / "board" / "trace.csv").read_bytes() == (tmp_path / "desk" / "trace.csv").read_bytes()
    run("report", "board", "-o", "page.html")
    assert "host process, /dev/pts" in (tmp_path / "page.html").read_text("utf-8")


@pytest.mark.long
def test_the_whole_digest_is_computed_on_the_board(tmp_path: Path) -> None:
    """By check-bits: that of the reference, and with wrong C another one, exit 1."""
    elf = build_firmware(presets.preset("mambo"), "host", tmp_path / "pil")
    with serial_line(elf) as line:
        said, _ = run("check-bits", "--port", line.port, "--steps", "2000")
    answer, _, _, reference, board = said.splitlines()
    assert answer == "mambo: the bits of the reference in 1 of 1 builds, over 2000 self-test steps"
    assert reference.split() == ["reference", "NumPy", board.split()[-1]]
    assert board.startswith("board      host process")

    weigh_otherwise = edited("pil.c", "(int)number, get(body)", "(int)number + 1, get(body)")
    other = build_firmware(presets.preset("mambo"), "host", tmp_path / "other", weigh_otherwise)
    with serial_line(other) as line:
        said, _ = run("check-bits", "--port", line.port, "--steps", "200", code=1)
    assert said.startswith("mambo: OTHER BITS in 1 of 1 builds, over 200 self-test steps")
    assert said.count("DIFFERS") == 1


def stack_bound(settings: Settings, folder: Path) -> int:
    """Return the bound of the stack of a step on the Crazyflie."""
    board = boards.load("crazyflie")
    elf = builder(board).firmware(render(settings, with_digest=False), folder)
    return bound_stack(load(elf), ENTRY).bytes


@pytest.mark.long
def test_the_stm32_flies_and_measures(tmp_path: Path) -> None:
    """Counted cycles; a painted stack within the bound, which also has the frame of the caller."""
    settings = presets.preset("mambo")
    with serial_line(build_firmware(settings, "crazyflie", tmp_path / "pil")) as line:
        far = ("--trajectory", "step", "--size-m", "10")  # a limit acts, which takes the deepest path
        summary = flown(line, "mambo", "--duration-s", "1.5", *far)
    demand_same_bits(summary, 151, "STM32F405")
    cycles = summary["cycles"]
    assert 0 < cycles["median"] <= cycles["most"] < 2**24
    assert 0 <= cycles["least"] <= cycles["median"], "QEMU's counter now and then stands still for a step"
    bound = stack_bound(settings, tmp_path / "bound")
    assert bound - 32 <= summary["stack_bytes"]
    assert summary["stack_bytes"] <= bound or summary["link_faults"], "a repeated request interrupts a step"


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize(
    ("board", "duration_s", "name"), [("crazyflie", 13, "STM32F405"), ("mega", 4, "Arduino Mega 2560")]
)
def test_a_long_flight_has_the_bits_of_the_desk(
    board: str, duration_s: int, name: str, tmp_path: Path
) -> None:
    """A figure of eight of Table II, which takes 12.6 s, on the STM32F405; a third of it on the Mega.

    The 100 s of Table II are this figure eight times; `docs/evidence/pil.md` reports them, flown once.
    """
    with serial_line(build_firmware(presets.preset("mambo"), board, tmp_path / "pil")) as line:
        summary = flown(line, "mambo", "--duration-s", str(duration_s))
    demand_same_bits(summary, 100 * duration_s + 1, name)
