"""Instruction counts are exact and repeatable; the search never returns less than its initial inputs."""

import json
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import unicorn

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.reference import ReferenceController
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.sil.controllers.emulated import GUEST, EmulatedController, build_guest
from mambo_nmpc.sil.controllers.library import batch_source
from mambo_nmpc.sil.controllers.pd import PdController
from mambo_nmpc.sil.emulation.unicorn import UnicornMachine
from mambo_nmpc.sil.firmware.disassembly import disassemble
from mambo_nmpc.sil.firmware.elf import Image, load
from mambo_nmpc.sil.flight.loop import Flight, fly
from mambo_nmpc.sil.flight.trajectories import Bernoulli
from mambo_nmpc.sil.footprint.counts import (
    HARNESS,
    CountingController,
    InputSequence,
    count_instructions,
    draw_inputs,
    sample_flight,
)
from tests.support.cases import settings_case
from tests.support.tools import CORES, board_builder

IN_PROCESS = [name for name in CORES if name != "mega"]
"""Boards emulated by Unicorn, which can report every instruction."""
MAMBO = presets.load("mambo")

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


def costs(elf: Path, inputs: InputSequence) -> list[int]:
    """Count consecutive steps of one controller on the Cortex-M4."""
    controller = CountingController(MAMBO, elf, "cortex-m4")
    rows = zip(inputs.state, inputs.target, inputs.thrust, strict=True)
    return [controller.step(state, target, float(thrust))[1].total() for state, target, thrust in rows]


@pytest.mark.parametrize("name", CORES)
def test_a_function_counted_by_hand_is_counted_right(name: str, tmp_path: Path) -> None:
    """The count of a known function is exact: loop, long block, jump over data, conditional instructions."""
    skipped = SKIPPED.get(name, ())
    assembly = ASSEMBLY.format(**WORDS.get(name, THUMB), skipped="\n".join(skipped))
    declared = (
        '#include "nmpc.h"\nnmpc_status_t nmpc_known(nmpc_t *self, const nmpc_state_t *state,'
        "const nmpc_target_t *target, nmpc_real_t thrust, nmpc_command_t *command);\n"
        f"__asm({json.dumps(assembly)});\n"
    )
    glue = batch_source()
    assert glue.count("nmpc_step(") == 1
    elf = board_builder(name).guest(
        render(MAMBO, with_digest=False),
        declared + glue.replace("nmpc_step(", "nmpc_known("),
        GUEST,
        tmp_path,
    )
    controller = CountingController(MAMBO, elf, CORES[name])
    for _ in range(2):
        assert controller.step(np.zeros(7), np.zeros(4), 9.81) == (
            0,
            Counter({"nmpc_known": KNOWN + len(skipped)}),
        )


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
    inputs = draw_inputs(MAMBO, 2)
    for state, target, thrust in zip(inputs.state, inputs.target, inputs.thrust, strict=True):
        seen.clear()
        single.step(state[None], target[None], [thrust])
        for first, others in blocks.items():
            seen.update({address: seen[first] - seen[address] for address in others})
        by_function: Counter[str] = Counter()
        for address, times in seen.items():
            by_function[image.name_of(address).partition("+")[0]] += times
        expected = sum(times for function, times in by_function.items() if function not in HARNESS)
        status, counted = runs.step(state, target, float(thrust))
        assert (status, counted.total()) == (0, expected)
        assert counted.keys() <= by_function.keys() - set(HARNESS)
        assert counted["nmpc_step"] == by_function["nmpc_step"] > 50


def test_the_same_inputs_have_the_same_counts(crazyflie: Path) -> None:
    """Two measurements of the same inputs are equal."""
    inputs = draw_inputs(MAMBO, 20)
    first, second = (count_instructions(MAMBO, crazyflie, "cortex-m4", inputs, 20) for _ in range(2))
    assert first == second
    assert first.least < first.most


def test_the_figures_are_those_of_the_steps(crazyflie: Path) -> None:
    """Number, least, mean and most are those of the steps; the functions add up to the mean."""
    inputs = draw_inputs(MAMBO, 20)
    each = costs(crazyflie, inputs)
    counts = count_instructions(MAMBO, crazyflie, "cortex-m4", inputs, 0)
    assert (counts.steps, counts.least, counts.most) == (20, min(each), max(each))
    assert counts.mean == pytest.approx(sum(each) / 20)
    assert sum(counts.by_function.values()) == pytest.approx(counts.mean)
    assert list(counts.by_function.values()) == sorted(counts.by_function.values(), reverse=True)


def test_the_search_never_returns_less_than_it_was_given(crazyflie: Path) -> None:
    """A longer search finds at least as much, and more than an initial input at rest."""
    inputs = draw_inputs(MAMBO, 10)
    given = max(costs(crazyflie, inputs))
    found = [count_instructions(MAMBO, crazyflie, "cortex-m4", inputs, steps).most for steps in (0, 10, 40)]
    assert given == found[0] <= found[1] <= found[2]
    calm = InputSequence(np.zeros((1, 7)), np.zeros((1, 4)), np.array([9.81]))
    before, after = (count_instructions(MAMBO, crazyflie, "cortex-m4", calm, steps).most for steps in (0, 60))
    assert before < after


def test_refused_inputs_are_not_counted(crazyflie: Path) -> None:
    """Refused inputs return early and would reduce least and mean."""
    inputs = draw_inputs(MAMBO, 12)
    state = inputs.state.copy()
    state[3::4, 0] = np.nan
    refused = replace(inputs, state=state)
    kept = np.isfinite(state[:, 0])
    good = InputSequence(inputs.state[kept], inputs.target[kept], inputs.thrust[kept])
    alone, among = (count_instructions(MAMBO, crazyflie, "cortex-m4", i, 10) for i in (good, refused))
    assert alone == among
    assert alone.steps < 12 + 10


@pytest.mark.parametrize("index", range(8))
def test_spread_inputs_are_all_accepted(index: int) -> None:
    """Errors range from millimetres to the input ranges, and no input is refused."""
    settings = settings_case(index, "float32")
    inputs = draw_inputs(settings, 200)
    steps = ReferenceController(Design(settings), 200).step(inputs.state, inputs.target, inputs.thrust)
    assert not np.any(steps.status)
    errors = np.abs(inputs.state[:, :4] - inputs.target).max(axis=1)
    assert errors.min() < 0.02
    assert errors.max() > settings.ranges.velocity_m_s / 2


def test_flight_inputs_are_those_of_the_flight() -> None:
    """Every seventh input equals what the controller received: state, target, thrust."""
    given: list[tuple[Any, ...]] = []

    class Spy(PdController):
        def step(self, *arguments: Any) -> Any:
            given.append(tuple(np.array(argument[0]) for argument in arguments))
            return super().step(*arguments)

    trace = fly(Flight(Bernoulli(2.0, 0.5), duration_s=1.0), Spy())
    inputs = sample_flight(trace, every=7)
    assert len(inputs.thrust) == len(given[::7]) == 15
    for row, (state, target, thrust) in enumerate(given[::7]):
        np.testing.assert_array_equal(inputs.state[row], state)
        np.testing.assert_array_equal(inputs.target[row], target)
        assert inputs.thrust[row] == thrust
