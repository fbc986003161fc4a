"""The emulated controller: the reference's bits on every core, and errors of the emulated program."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen import boards
from mambo_codegen.bundle.render import render
from mambo_codegen.methods.one_norm.controller import OneNormController
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.settings.model import Settings
from mambo_sil.board.emulated import GUEST, EmulatedController, build_guest
from mambo_sil.board.emulation.machine import AVR, Machine, start
from mambo_sil.board.emulation.unicorn_machine import MODELS
from mambo_sil.errors import EmulationError
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import batch_source
from mambo_sil.verify.step_inputs import StepInputs
from tests.support.cases import CORNER_HORIZONS, settings_case
from tests.support.one_norm import ONE_NORM
from tests.support.parity import Run, differences, inputs_of_steps
from tests.support.tools import CORES, board_builder

SCALARS = {board: ("float32", "fixed", *(("float64",) if board != "mega" else ())) for board in CORES}
"""Scalar types of each board; avr-gcc's double has 32 bits."""
QUICK = {
    ("mambo", "float32", 0),
    ("rp2040", "fixed", 6),
    ("rp2040", "float32", 1),
    ("crazyflie", "float32", 3),
    ("crazyflie", "fixed", 2),
    ("teensy41", "float64", 5),
    ("rv32", "float64", 6),
    ("mega", "float32", 0),
    ("mega", "fixed", 6),
}
"""Quick cases: every board, every scalar type, extreme and random horizons."""
CASES = [
    (board, scalar, index)
    for turn, (board, chosen) in enumerate(SCALARS.items())
    for index in range(12)
    for scalar in (chosen if index >= len(CORNER_HORIZONS) else [chosen[(index + turn) % len(chosen)]])
    if (board, index) != ("mega", 4)  # too large
    and (index < len(CORNER_HORIZONS) or (index + turn) % 3 == 0)
]
CASES += sorted(QUICK.difference(CASES))
"""Every corner of the horizon on every board and, by turns, in every scalar type; the random settings on two
boards each, by turns, in all scalar types."""

N = 30
"""Controllers of a case."""

BAD_GUEST = """
#ifdef __AVR__
#define DIE __asm volatile (".word 0xFFFF")
#define NOWHERE 0x6000
#else
#define DIE (void)*(volatile int *)0x40000000
#define NOWHERE 0x60000000
#endif
long fine(void) { return 70007; }
long die(void) { DIE; return 1; }
long stray(void) { return ((long (*)(void))NOWHERE)(); }
long spin(void) { for (;;) { __asm volatile (""); } }
long weigh(int a, int b, int c, int d, int e, int f, int g, int h, int i, int j)
{
    return a + 2 * b + 3 * c + 4 * d + 5 * e + 6 * f + 7 * g + 8 * h + 9 * i + 10 * j;
}
"""
"""Functions that return, fault on data (AVR: illegal instruction), fault on code, and never return."""


def start_emulated(name: str, settings: Settings, folder: Path, n: int) -> EmulatedController:
    """Build n controllers for a board and start them on its core."""
    elf = build_guest(settings, board_builder(name), folder)
    return EmulatedController(settings, elf, boards.load(name).emulated_core.value, n)


@pytest.fixture(params=CORES)
def bad_guest(request: pytest.FixtureRequest, tmp_path: Path) -> Machine:
    """Start the faulty functions on a core."""
    keep = ("fine", "die", "stray", "spin", "weigh")
    elf = board_builder(request.param).guest({}, BAD_GUEST, keep, tmp_path)
    return start(elf, CORES[request.param], 0.2)


def test_every_board_has_a_core() -> None:
    """CORES has the core of every board, and every emulated core but the M33, which no board has."""
    assert {name: boards.load(name).emulated_core.value for name in boards.names()} == CORES
    assert {*MODELS, AVR} - {"cortex-m33"} == set(CORES.values())


@cache
def reference_run(index: int, scalar: str) -> tuple[list[StepInputs], Run]:
    """Return the inputs of four steps of N controllers, some not finite, and the answers of the reference."""
    settings = settings_case(index, scalar)
    inputs = inputs_of_steps(settings, N, 4, seed=index)
    inputs[2].state[::7, index % 7] = np.nan
    reference = OneNormController(OneNorm(settings), N)
    return inputs, Run([], [reference.step(case.state, case.target, case.thrust) for case in inputs])


@pytest.mark.sampled(6)
@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("name", "scalar", "index"),
    [pytest.param(*case, marks=[] if case in QUICK else pytest.mark.long) for case in CASES],
)
def test_every_core_has_the_bits_of_the_reference(name: str, scalar: str, index: int, tmp_path: Path) -> None:
    """Bits are equal over consecutive steps with random, extreme and refused inputs, for random settings."""
    inputs, theirs = reference_run(index, scalar)
    controller = start_emulated(name, settings_case(index, scalar), tmp_path, N)
    ours = Run([], [controller.step(case.state, case.target, case.thrust) for case in inputs])
    assert not differences(ours, theirs)
    assert np.all(ours.steps[2].status[::7] != 0)
    assert np.mean([step.status == 0 for step in ours.steps]) > 0.5


def test_memory_is_dirty_before_init(tmp_path: Path) -> None:
    """Without nmpc_init a refused input returns the command in the instance's memory, which is not zero."""
    settings = ONE_NORM
    glue = batch_source()
    assert glue.count("nmpc_init(&controllers[i]);") == 1
    idle = glue.replace("nmpc_init(&controllers[i]);", "(void)controllers[i];")
    elf = board_builder("crazyflie").guest(render(settings, with_digest=False), idle, GUEST, tmp_path)
    step = EmulatedController(settings, elf, "cortex-m4", 3).step(
        np.full((3, 7), np.nan), np.zeros((3, 4)), np.full(3, 9.81)
    )
    assert step.command_rad.tobytes() == b"\xa5" * step.command_rad.nbytes


def test_another_shape_is_refused(tmp_path: Path) -> None:
    """An array of a wrong shape would be read beyond its end, or written beyond the inputs of the core."""
    settings = ONE_NORM
    for controller in (CompiledController(settings, 2), start_emulated("crazyflie", settings, tmp_path, 2)):
        for state, target, thrust in (
            ((1, 7), (2, 4), (2,)),
            ((3, 7), (2, 4), (2,)),
            ((2, 6), (2, 4), (2,)),
            ((2, 7), (4, 2), (2,)),
            ((2, 7), (2, 4), (2, 1)),
        ):
            with pytest.raises(ValueError, match=r"expected an array of shape \(2,"):
                controller.step(np.zeros(state), np.zeros(target), np.zeros(thrust))


@pytest.mark.first_is_quick
def test_arguments_beyond_the_registers_arrive(bad_guest: Machine) -> None:
    """Ten words, of which an ARM core takes four in registers, a RISC-V core eight, an AVR nine."""
    words = [3, 1, 4, 1, 5, 9, 2, 6, 5, 3]
    assert bad_guest.call("weigh", *words) == sum(place * word for place, word in enumerate(words, 1))


@pytest.mark.first_is_quick
@pytest.mark.parametrize("function", ["die", "stray"])
def test_a_guest_that_dies_is_named(function: str, bad_guest: Machine) -> None:
    """A fault is reported with function, address and cause; the machine stays usable."""
    with pytest.raises(
        EmulationError,
        match=rf"^{function} faulted at address 0x[0-9a-f]+: .*(UC_ERR_\w+|illegal instruction)",
    ):
        bad_guest.call(function)
    assert bad_guest.call("fine") == 70007


@pytest.mark.first_is_quick
def test_a_guest_that_never_returns_is_named(bad_guest: Machine) -> None:
    """An endless loop is reported with function, time limit and address; the machine stays usable."""
    with pytest.raises(
        EmulationError, match=r"^spin did not return within 0\.2 s, at address 0x1[0-9a-f]{4}"
    ):
        bad_guest.call("spin")
    assert bad_guest.call("fine") == 70007


@pytest.mark.long
@pytest.mark.thorough
def test_the_longest_step_has_its_time(tmp_path: Path) -> None:
    """The time limit suffices for 50 moves, 50 predicted steps and 100 iterations in soft float64."""
    document = settings_case(4, "float64").model_dump()
    document["optimizer"] |= {"iterations": 100, "tolerance": 0.0}
    settings = Settings.model_validate(document)
    inputs = inputs_of_steps(settings, 1, 1, seed=0)[0]
    step = start_emulated("rp2040", settings, tmp_path, 1).step(inputs.state, inputs.target, inputs.thrust)
    assert (step.status[0], step.iterations[0]) == (0, 100)
