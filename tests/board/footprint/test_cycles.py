"""Modelled cycles are those of the manuals: functions counted by hand, and what each class adds."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_codegen import boards
from mambo_codegen.boards import MODELLED, FlashWait
from mambo_codegen.settings import presets
from mambo_sil.board.emulation.core import Executed
from mambo_sil.board.firmware.elf import load
from mambo_sil.board.footprint import timing
from mambo_sil.board.footprint.counts import CountingController
from mambo_sil.board.footprint.cycles import MODELS, CycleModel, ModelledCycles
from mambo_sil.board.footprint.measure import measure_footprint
from mambo_sil.board.footprint.timing import NONE, Cycles
from tests.support.linking import link_step
from tests.support.one_norm import ONE_NORM
from tests.support.tools import CORES, board_builder

BOTH = (".text", ".balign 16", ".global nmpc_known")
ARM = (*BOTH, ".syntax unified", ".thumb", ".type nmpc_known, %function", ".thumb_func")
AVR = (*BOTH, ".type nmpc_known, @function")
Row = tuple[str, int, tuple[int, int, int]]
"""An instruction, how often it is executed, and its fewest, usual and most cycles in all."""


def same(cycles: int) -> tuple[int, int, int]:
    """Return the cycles of what takes one number of cycles."""
    return cycles, cycles, cycles


CORTEX_M4: tuple[Row, ...] = (
    ("push {r4, lr}", 1, same(1 + 2)),
    ("movs r0, #10", 1, same(1)),
    ("1: subs r0, #1", 10, same(10)),
    ("bne 1b", 10, (10 + 9 * 1, 10 + 9 * 2, 10 + 9 * 3)),
    ("vmov s0, r0", 1, same(2)),
    ("vmul.f32 s1, s0, s0", 1, same(1 + 1)),  # used by the next instruction
    ("vadd.f32 s2, s1, s1", 1, same(1)),  # used as addend only
    ("vmla.f32 s2, s0, s0", 1, same(3)),
    ("mov r1, sp", 1, same(1 + 1)),  # an address of the next instruction
    ("ldr r2, [r1]", 1, (1, 2, 2)),  # overlaps the next load
    ("ldr r3, [r1, #4]", 1, (1, 2, 2)),  # overlaps the next store
    ("str r3, [r1, #4]", 1, (1, 2, 2)),
    ("ldr r2, 2f", 1, (2, 2, 3)),
    ("cmp r2, r2", 1, same(1)),
    ("it ne", 1, (0, 1, 1)),
    ("movne r2, #1", 1, same(1)),
    ("movs r0, #0", 1, same(1)),
    ("pop {r4, pc}", 1, (3 + 1, 3 + 2, 3 + 3)),
    (".balign 4", 0, same(0)),
    ("2: .word 0", 0, same(0)),
)
CORTEX_M0: tuple[Row, ...] = (
    ("push {r4, lr}", 1, same(1 + 2)),
    ("movs r0, #10", 1, same(1)),
    ("1: subs r0, #1", 10, same(10)),
    ("bne 1b", 10, same(10 + 9)),
    ("bl 3f", 1, same(3)),
    ("mov r1, sp", 1, same(1)),
    ("ldr r2, [r1]", 1, same(2)),
    ("str r2, [r1]", 1, same(2)),
    ("ldr r2, 2f", 1, same(2)),
    ("muls r2, r2, r2", 1, same(1)),
    ("movs r0, #0", 1, same(1)),
    ("pop {r4, pc}", 1, same(3 + 2)),
    ("3: bx lr", 1, same(2)),
    (".balign 4", 0, same(0)),
    ("2: .word 0", 0, same(0)),
)
ATMEGA: tuple[Row, ...] = (
    ("ldi r24, 10", 1, same(1)),
    ("1: subi r24, 1", 10, same(10)),
    ("brne 1b", 10, same(10 + 9)),
    ("push r24", 1, same(2)),
    ("pop r25", 1, same(2)),
    ("mul r24, r25", 1, same(2)),
    ("clr r1", 1, same(1)),
    ("lds r25, 0x200", 1, same(2)),
    ("rcall 3f", 1, same(4)),
    ("rcall .", 1, same(4)),
    ("pop r25", 1, same(2)),
    ("pop r25", 1, same(2)),
    ("pop r25", 1, same(2)),
    ("cpse r1, r1", 1, same(1)),
    ("jmp 1b", 1, same(2)),  # skipped, two words
    ("sbrc r1, 0", 1, same(1)),
    ("rjmp 1b", 1, same(1)),  # skipped, one word
    ("rjmp 2f", 1, same(2)),
    ("nop", 0, same(0)),
    ("2: ldi r24, 0", 1, same(1)),
    ("ret", 1, same(5)),
    ("3: ret", 1, same(5)),
)
KNOWN = {"crazyflie": (ARM, CORTEX_M4), "rp2040": (ARM, CORTEX_M0), "mega": (AVR, ATMEGA)}
WAIT = FlashWait(
    cycles_per_line=5, line_bytes=16, code_lines=64, data_lines=8, source="a test", confidence="high"
)


def build_known(name: str, folder: Path) -> Path:
    """Build a program whose control step is the function of `KNOWN`."""
    head, rows = KNOWN[name]
    body = (text for text, *_ in rows)
    assembly = "\n".join([*head, "nmpc_known:", *body, ".size nmpc_known, . - nmpc_known", ""])
    return link_step(name, assembly, folder)


def step_known(name: str, elf: Path, flash: FlashWait | None = None) -> tuple[Counter[str], ModelledCycles]:
    """Execute the function once; returns its instructions and cycles."""
    controller = CountingController(ONE_NORM, elf, CORES[name], modelled=True, flash=flash)
    controller.step(np.zeros((1, 7)), np.zeros((1, 4)), np.array([9.81]))
    (step,) = controller.steps
    assert step.cycles is not None
    return step.by_function, step.cycles


@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", KNOWN)
def test_a_function_takes_the_cycles_counted_by_hand(name: str, tmp_path: Path) -> None:
    """Loops, branches taken and not, loads that overlap, results that are waited for, skipped jumps."""
    by_function, cycles = step_known(name, build_known(name, tmp_path))
    rows = KNOWN[name][1]
    assert by_function == Counter({"nmpc_known": sum(times for _, times, _ in rows)})
    assert tuple(cycles.without_wait) == tuple(map(sum, zip(*(row[2] for row in rows), strict=True)))
    assert (cycles.wait, cycles.most) == (0, cycles.without_wait.most)


def test_wait_states_are_those_of_the_lines_fetched(tmp_path: Path) -> None:
    """Every line once if the cache holds them all; the loop, at the beginning, stays in its line."""
    elf = build_known("crazyflie", tmp_path)
    size = load(elf).symbol("nmpc_known").size_bytes
    code = -(-(size - 4) // 16)  # the last word is data
    waits = [
        step_known("crazyflie", elf, WAIT.model_copy(update=update))[1].wait
        for update in ({}, {"cycles_per_line": 1}, {"code_lines": 1}, {"line_bytes": 4096})
    ]
    assert waits == [5 * (code + 1), code + 1, 5 * (code + 1), 5 * 2]


def test_a_line_that_was_replaced_is_fetched_again() -> None:
    """The cache replaces the line used longest ago; a block may span lines."""
    blocks = [(0, 4), (16, 4), (0, 4), (32, 4), (0, 4), (16, 20), (0, 2)]
    waits = []
    for lines in (1, 2, 3):
        model = object.__new__(CycleModel)
        model._timings, model._flash = {}, WAIT.model_copy(update={"code_lines": lines})
        waits.append(model.cycles(Executed(blocks=blocks)).wait)
    assert waits == [5 * 8, 5 * 6, 5 * 3]


CLASSES: dict[str, Any] = {
    "_LOADS": frozenset(),
    "_STORES": frozenset(),
    "_MEMORY": frozenset(),
    "_MULTIPLY_ADD": frozenset(),
    "_STALLING": frozenset(),
    "_FIXED_M4": {},
    "_REFILL": NONE,
}
"""Mutants of the model of the Cortex-M4: a table and what is left of it."""


@pytest.mark.first_is_quick
@pytest.mark.parametrize("table", CLASSES)
def test_a_class_that_is_missing_changes_the_sum(
    table: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No table of the model can be lost unnoticed."""
    elf = build_known("crazyflie", tmp_path)
    _, right = step_known("crazyflie", elf)
    monkeypatch.setattr(timing, table, CLASSES[table])
    _, wrong = step_known("crazyflie", elf)
    assert wrong.without_wait != right.without_wait


def test_every_model_has_its_core() -> None:
    """What a board's file may leave out is what there is a model for, and each names its source."""
    assert set(MODELS) == set(MODELLED)
    assert all(model.source for model in MODELS.values())


@pytest.mark.long
def test_the_crazyflie_takes_the_modelled_cycles() -> None:
    """Bounds around the usual ones; an estimate of the user's own replaces the model."""
    board_builder("crazyflie")
    crazyflie, teensy = boards.load("crazyflie"), boards.load("teensy41")
    footprint = measure_footprint(presets.load("mambo"), crazyflie, counted_ticks=20)
    assert footprint.counts is not None
    cycles = footprint.counts.cycles
    assert cycles is not None
    assert footprint.counts.least < cycles.least <= cycles.mean <= cycles.most_met < cycles.most_with_wait
    assert footprint.counts.most_met < cycles.fewest < cycles.most_met
    assert footprint.cycles == (cycles.fewest, cycles.most_with_wait)
    assert footprint.time_s == pytest.approx((cycles.fewest / 168e6, cycles.most_with_wait / 168e6))
    assert footprint.cycles_source == "model: Cortex-M4 TRM, ARM DDI 0439D"
    own = crazyflie.model_copy(update={"cycles": teensy.cycles})
    estimated = measure_footprint(presets.load("mambo"), own, counted_ticks=20)
    assert estimated.counts is not None
    assert estimated.counts.cycles is None
    assert estimated.cycles == pytest.approx([share * estimated.counts.most_met for share in (0.6, 1.4)])
    assert estimated.cycles_source == "estimate: 1 per instruction, +/- 40 %"


def test_cycles_add_up() -> None:
    """Each of the three numbers by itself."""
    assert Cycles(1, 2, 3).plus(Cycles(0, 1, 4)) == (1, 3, 7)
