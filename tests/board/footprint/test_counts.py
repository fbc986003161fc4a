"""Instruction counts are exact and of consecutive ticks; the search starts from the plan of its tick."""

import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import unicorn

from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import parse, with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.board.emulated import EmulatedController, build_guest
from mambo_sil.board.emulation.unicorn_machine import UnicornMachine
from mambo_sil.board.firmware.disassembly import disassemble
from mambo_sil.board.firmware.elf import Image, load
from mambo_sil.board.footprint.counts import (
    FLIGHT,
    HARNESS,
    CountingController,
    InstructionCounts,
    count_instructions,
)
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.errors import FlightError
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.model.derive.derived_flight import chosen_text
from tests.support.linking import link_step
from tests.support.one_norm import ONE_NORM
from tests.support.tools import CORES, board_builder

IN_PROCESS = [name for name in CORES if name != "mega"]
"""Boards emulated by Unicorn, which can report every instruction."""
MAMBO = ONE_NORM

STRAIGHT = 700
"""Instructions without a branch, more than one translation block holds."""
ASSEMBLY = f"""
    .text
    .balign 4
    .global nmpc_known
    .type nmpc_known, {{function}}
    {{mode}}
nmpc_known:
    {{start}}
1:  {{decrement}}
    {{again}} 1b
    .rept {STRAIGHT}
    {{move}}
    .endr
    {{skipped}}
    {{jump}} 2f
    .word {{data}}, {{data}}
2:  {{result}}
    {{leave}}
    .size nmpc_known, . - nmpc_known
"""
THUMB = {
    "function": "%function",
    "mode": ".syntax unified\n.thumb\n.thumb_func",
    "start": "movs r0, #10",
    "decrement": "subs r0, r0, #1",
    "again": "bne",
    "move": "mov r1, r1",
    "jump": "b",
    "data": "0",
    "result": "movs r0, #0",
    "leave": "bx lr",
}
RISCV = {
    "function": "@function",
    "mode": "",
    "start": "li a0, 10",
    "decrement": "addi a0, a0, -1",
    "again": "bnez a0,",
    "move": "mv a1, a1",
    "jump": "j",
    "data": "0",
    "result": "li a0, 0",
    "leave": "ret",
}
AVR = RISCV | {
    "start": "ldi r24, 10",
    "decrement": "subi r24, 1",
    "again": "brne",
    "move": "mov r26, r26",
    "jump": "rjmp",
    "data": "0xFFFF",
    "result": "ldi r24, 0",
}
WORDS = {"mambo": THUMB | {"mode": ".syntax unified\n.arm"}, "rv32": RISCV, "mega": AVR}
"""Instructions by board; the other boards have those of Thumb."""
KNOWN = 1 + 10 * 2 + STRAIGHT + 1 + 2
"""Instructions executed by each: ten iterations of the loop; the data words are skipped."""
SKIPPED = {
    "mambo": ("addne r1, r1, #1",),
    "crazyflie": ("it ne", "addne r1, r1, #1"),
    "teensy41": ("ite ne", "addne r1, r1, #1", "moveq r1, #1"),
    "mega": ("ldi r25, 0", "cpse r24, r1", "nop", "sbrc r1, 0", "call nmpc_step", "sbrs r1, 0", "rjmp ."),
}
"""Conditional instructions to insert; skipped ones are issued and count."""


@pytest.fixture
def crazyflie(tmp_path: Path) -> Path:
    """Build the preset mambo for the Cortex-M4."""
    return build_guest(MAMBO, board_builder("crazyflie"), tmp_path)


def fly_counted(elf: Path, ticks: int) -> CountingController:
    """Fly consecutive ticks of the flight on the Cortex-M4F."""
    controller = CountingController(MAMBO, elf, "cortex-m4")
    fly(Flight(FLIGHT, duration_s=0.01 * (ticks - 1)), controller)
    return controller


def counted(settings: Settings, elf: Path, ticks: int, searched: int) -> InstructionCounts:
    """Count ticks and steps of the search on the Cortex-M4F."""
    return count_instructions(settings, elf, "cortex-m4", ticks, searched)


@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", CORES)
def test_a_function_counted_by_hand_is_counted_right(name: str, tmp_path: Path) -> None:
    """The count of a known function is exact: loop, long block, jump over data, conditional instructions."""
    skipped = SKIPPED.get(name, ())
    assembly = ASSEMBLY.format(**WORDS.get(name, THUMB), skipped="\n".join(skipped))
    elf = link_step(name, assembly, tmp_path)
    controller = CountingController(MAMBO, elf, CORES[name])
    for _ in range(2):
        controller.step(np.zeros((1, 7)), np.zeros((1, 4)), np.array([9.81]))
        assert controller.steps[-1].accepted
        assert controller.steps[-1].by_function == Counter({"nmpc_known": KNOWN + len(skipped)})


PAGE_AFTER_IT = """
    .text
    .balign 1024
    .global nmpc_known
    .syntax unified
    .thumb
    .type nmpc_known, %function
    .thumb_func
nmpc_known:
    b.w 1f
3:  .word 5
    .space 1002
1:  cmp r0, r0
    ite ne
    ldrne.w r2, 3b
    ldreq.w r2, 3b
    cmp r2, #5
    bne.w 2f
    movs r0, #0
    bx lr
2:  movs r0, #1
    bx lr
    .size nmpc_known, . - nmpc_known
"""
"""The first wide branch begins a page of 1 KiB, and its basic block has loads in an IT block before that."""


def test_loads_in_an_it_block_before_a_page_are_counted_right(tmp_path: Path) -> None:
    """Unicorn passes on the conditions of the block, in which a wide branch is no valid instruction."""
    elf = link_step("crazyflie", PAGE_AFTER_IT, tmp_path)
    controller = CountingController(MAMBO, elf, "cortex-m4")
    controller.step(np.zeros((1, 7)), np.zeros((1, 4)), np.array([9.81]))
    assert controller.steps[-1].accepted
    assert controller.steps[-1].by_function == Counter({"nmpc_known": 9})


def it_blocks(image: Image) -> dict[int, list[int]]:
    """Return the instructions in each Thumb-2 IT block by the address of `it`.

    The core issues skipped ones too, but Unicorn's code hook does not report them, as it does in A32.
    """
    instructions = disassemble(image).instructions
    blocks: dict[int, list[int]] = {}
    for address, instruction in instructions.items():
        mnemonic = instruction.text.split()[0]
        if re.fullmatch("it[te]{0,3}", mnemonic):
            after = [address + instruction.size_bytes]
            for _ in mnemonic[2:]:
                after.append(after[-1] + instructions[after[-1]].size_bytes)
            blocks[address] = after
    return blocks


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", IN_PROCESS)
def test_counting_blocks_agrees_with_counting_instructions(name: str, tmp_path: Path) -> None:
    """Counting by basic block and counting every instruction give the same functions and totals."""
    elf, core = build_guest(MAMBO, board_builder(name), tmp_path), CORES[name]
    image = load(elf)
    blocks = it_blocks(image)
    seen: Counter[int] = Counter()

    def see(_engine: Any, address: int, _size: int, _data: Any) -> None:
        seen[address] += 1

    single = EmulatedController(MAMBO, elf, core)
    assert isinstance(single.machine, UnicornMachine)
    single.machine._engine.hook_add(unicorn.UC_HOOK_CODE, see)
    runs = CountingController(MAMBO, elf, core)
    target, thrust = np.zeros((1, 4)), np.array([9.81])
    for state in np.random.default_rng(0).uniform(-0.5, 0.5, (2, 1, 7)):
        seen.clear()
        single.step(state, target, thrust)
        for first, others in blocks.items():
            seen.update({address: seen[first] - seen[address] for address in others})
        by_function: Counter[str] = Counter()
        for address, times in seen.items():
            by_function[image.name_of(address).partition("+")[0]] += times
        expected = sum(times for function, times in by_function.items() if function not in HARNESS)
        runs.step(state, target, thrust)
        step = runs.steps[-1]
        assert (step.accepted, step.instructions) == (True, expected)
        assert step.by_function.keys() <= by_function.keys() - set(HARNESS)
        assert step.by_function["nmpc_step"] == by_function["nmpc_step"] > 50


@pytest.mark.long
def test_the_figures_are_those_of_consecutive_ticks(crazyflie: Path) -> None:
    """Of every tick of the flight from its start, as the same C flies it on this machine."""
    trace = fly(Flight(FLIGHT, duration_s=0.29), CompiledController(MAMBO))
    again = CountingController(MAMBO, crazyflie, "cortex-m4")
    state = np.concatenate([trace.position_m[..., :2], trace.velocity_m_s[..., :2], trace.euler_rad], axis=-1)
    for row in zip(state, trace.target, trace.thrust_acceleration_m_s2, strict=True):
        again.step(*row)
    each = [step.instructions for step in again.steps]
    counts = counted(MAMBO, crazyflie, 30, 0)
    assert (counts.ticks, counts.searched) == (30, 0)
    assert (counts.least, counts.most_met) == (min(each), max(each))
    assert counts.mean == pytest.approx(sum(each) / 30)
    assert sum(counts.by_function.values()) == pytest.approx(counts.mean)
    assert list(counts.by_function.values()) == sorted(counts.by_function.values(), reverse=True)


def test_a_tick_can_be_repeated_with_the_plan_that_it_had(crazyflie: Path) -> None:
    """Whatever was stepped since, the same state costs the same; the instance of the first tick differs."""
    controller = fly_counted(crazyflie, 20)
    first, last = controller.steps[0], controller.steps[-1]
    controller.retry(last, last.state + 0.3, last.target)
    assert controller.retry(last, last.state, last.target).by_function == last.by_function
    assert controller.retry(first, first.state, first.target).by_function == first.by_function
    assert first.before != last.before
    assert len(controller.steps) == 20


@pytest.mark.long
def test_the_search_never_returns_less_than_the_flight(crazyflie: Path) -> None:
    """A longer search finds at least as much; least and mean are those of the flight alone."""
    found = [counted(MAMBO, crazyflie, 20, steps) for steps in (0, 10, 60)]
    assert found[0].most_met <= found[1].most_met <= found[2].most_met
    assert found[0].most_met < found[2].most_met
    assert len({(one.least, one.mean) for one in found}) == 1
    assert counted(MAMBO, crazyflie, 20, 60) == found[2]


@pytest.mark.long
def test_the_search_finds_steps_in_which_a_limit_acts(tmp_path: Path) -> None:
    """They take a fifth more than any of the flight, whose target is within the limits."""
    settings = presets.load("mambo")
    elf = build_guest(settings, board_builder("crazyflie"), tmp_path)
    flight, searched = (counted(settings, elf, 30, steps) for steps in (0, 60))
    assert searched.most_met > 1.2 * flight.most_met


@pytest.mark.long
def test_what_the_harness_asks_afterwards_is_no_part_of_a_step(tmp_path: Path) -> None:
    """A step takes two arc tangents without a loop; whether it ended at the tilt limit takes eight more."""
    text = chosen_text(vehicle_toml.preset("crazyflie"), "x")
    elf = build_guest(settings := parse(text, "x"), board_builder("crazyflie"), tmp_path)
    by_function = counted(settings, elf, 20, 0).by_function
    longest = load(elf).symbol("arc_tangent").size_bytes / 2  # instructions have two bytes at least
    assert 50 < by_function["arc_tangent"] <= 2 * longest


@pytest.mark.long
def test_refused_ticks_are_not_counted(tmp_path: Path) -> None:
    """They return early and would reduce least and mean; if all are refused, there is no figure."""
    counts = []
    for velocity_m_s in (100.0, 0.6):
        settings = with_option(MAMBO, "ranges.velocity_m_s", velocity_m_s)
        elf = build_guest(settings, board_builder("crazyflie"), tmp_path)
        counts.append(counted(settings, elf, 150, 0))
    all_ticks, some = counts
    assert 10 < some.ticks < all_ticks.ticks == 150
    assert some.least >= all_ticks.least
    heavy = with_option(MAMBO, "ranges.thrust_acceleration_min_m_s2", 15.0)
    elf = build_guest(heavy, board_builder("crazyflie"), tmp_path)
    with pytest.raises(FlightError, match="refuses every tick"):
        counted(heavy, elf, 10, 5)
