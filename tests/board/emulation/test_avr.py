"""AVR: self-test on an emulated ATmega2560, faults of programs, stack analysis of AVR code."""

import itertools
import os
from dataclasses import replace
from pathlib import Path

import pytest

from mambo_codegen import boards
from mambo_codegen.bundle.digest import self_test_digest
from mambo_codegen.bundle.render import render
from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.board.emulated import GUEST, EmulatedController, build_guest, digest_emulated
from mambo_sil.board.emulation.avr_machine import Long
from mambo_sil.board.emulation.machine import start
from mambo_sil.board.firmware.elf import FootprintError, load
from mambo_sil.board.firmware.firmware_build import Builder
from mambo_sil.board.firmware.stack import StackReport, bound_stack
from mambo_sil.errors import EmulationError, EmulatorError
from mambo_sil.flight.controllers.controller_library import batch_source
from tests.support.cases import settings_case
from tests.support.linking import link
from tests.support.one_norm import ONE_NORM
from tests.support.tools import board_builder

SELF_TEST = """
#include "nmpc_self_test.h"
static nmpc_t scratch;
long run(void);
long run(void) { return nmpc_self_test(&scratch); }
"""
EFFORT = "return (weight.tracking * distance_m) + (weight.effort * variation_rad);"
WRONG = "return (weight.effort * variation_rad) + (weight.tracking * (distance_m + (nmpc_real_t)0.001f));"


@pytest.fixture
def mega() -> Builder:
    """Return the builder for the Mega, or skip."""
    return board_builder("mega")


@pytest.fixture
def one(mega: Builder, tmp_path: Path) -> Path:
    """Build a program whose run() returns 1."""
    return mega.guest({}, "long run(void); long run(void) { return 1; }", ("run",), tmp_path)


@pytest.mark.long
def test_the_self_test_detects_a_wrong_controller_on_eight_bits(mega: Builder, tmp_path: Path) -> None:
    """The self-test returns 0; an error of a millimetre in the cost is found in the first step."""
    files = render(presets.load("table1"), with_digest=False)
    assert files["nmpc.c"].count(EFFORT) == 1
    wrong = files | {"nmpc.c": files["nmpc.c"].replace(EFFORT, WRONG)}
    for bundle, first_wrong_step in ((files, 0), (wrong, 1)):
        machine = start(mega.guest(bundle, SELF_TEST, ("run",), tmp_path), "avr")
        assert machine.call("run") == first_wrong_step


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("preset", "scalar"), [("mambo", "float32"), ("table1", "float32"), ("mambo", "fixed")]
)
def test_self_test_steps_have_their_digest_on_eight_bits(
    preset: str, scalar: str, mega: Builder, tmp_path: Path
) -> None:
    """The digest of two episodes equals that of the reference."""
    settings = with_option(presets.load(preset), "code.scalar", scalar)
    elf = build_guest(settings, mega, tmp_path)
    assert digest_emulated(settings, elf, "avr", 2) == self_test_digest(method_of(settings), 2)


def test_memory_holds_what_is_written(mega: Builder, tmp_path: Path) -> None:
    """Data larger than a packet reads back, and initialised variables have their values."""
    elf = mega.guest({}, "long seen = 3; long run(void); long run(void) { return seen; }", ("run",), tmp_path)
    machine = start(elf, "avr")
    content = bytes(range(256)) * 12
    address = machine.arena.allocate(len(content))
    machine.write(address, content)
    assert machine.read(address, len(content)) == content
    assert machine.call("run") == 3


def test_long_arguments_arrive_whole(mega: Builder, tmp_path: Path) -> None:
    """Between ints, in registers and on the stack, a long has 32 bits."""
    text = """
unsigned long run(int a, unsigned long b, int c, unsigned long d, unsigned long e, unsigned long f);
unsigned long run(int a, unsigned long b, int c, unsigned long d, unsigned long e, unsigned long f)
{
    return a + (3 * b) + (5 * c) + (7 * d) + (11 * e) + (13 * f);
}
"""
    machine = start(mega.guest({}, text, ("run",), tmp_path), "avr")
    b, d, e, f = (Long(number) for number in (70_001, 4_000_000_000, 123_456_789, 987_654_321))
    expected = (2 + 3 * b + 5 * 4 + 7 * d + 11 * e + 13 * f) % 2**32
    assert machine.call("run", 2, b, 4, d, e, f) == expected


def test_a_stack_overflow_is_reported(mega: Builder, tmp_path: Path) -> None:
    """A call that overwrites the guard below the stack raises an error."""
    text = """
long run(void);
long run(void)
{
    volatile char room[3200];
    int i;
    for (i = 0; i < 3200; i++) { room[i] = 1; }
    return room[7];
}
"""
    machine = start(mega.guest({}, text, ("run",), tmp_path), "avr")
    with pytest.raises(EmulationError, match="run overflowed its stack of 3072 B"):
        machine.call("run")


@pytest.mark.parametrize(
    ("compiler", "message"),
    [
        ("gcc -nostdinc", "simavr, .* cannot be built here \\(Debian: libsimavr-dev\\): .*simavr/sim_avr.h"),
        ("", "no C"),
    ],
    ids=["simavr", "compiler"],
)
def test_what_is_missing_is_named(
    compiler: str, message: str, one: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The message names library and Debian package, or the compilers that were looked for."""
    monkeypatch.setenv("PATH", os.environ["PATH"] if compiler else str(one.parent))
    monkeypatch.setenv("CC", compiler)
    with pytest.raises(EmulatorError, match=f"(?s){message}"):
        start(one, "avr")


def test_a_missing_disassembler_is_named(one: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names tool and Debian package."""
    image = load(one)
    monkeypatch.setenv("PATH", str(one.parent))
    with pytest.raises(FootprintError, match=r"avr-objdump, .*is missing \(Debian: binutils-avr\)"):
        bound_stack(image, "run")


def test_a_controller_too_large_for_the_ram_is_refused(mega: Builder, tmp_path: Path) -> None:
    """The message has the size of the data and of the RAM."""
    settings = settings_case(4, "float32")
    assert (settings.horizon.prediction, settings.horizon.control) == (50, 50)
    with pytest.raises(EmulatorError, match=r"^\d{5} B of data and 3072 B of stack do not fit the 8192 B of"):
        EmulatedController(settings, build_guest(settings, mega, tmp_path), "avr")


def test_a_guest_that_leaves_no_room_is_refused(mega: Builder, tmp_path: Path) -> None:
    """A controller with inputs and outputs must fit between data and stack."""
    settings = ONE_NORM
    glue = batch_source() + "char nmpc_ballast[4726] = {1};"
    elf = mega.guest(render(settings, with_digest=False), glue, (*GUEST, "nmpc_ballast"), tmp_path)
    with pytest.raises(EmulatorError, match=r"^a controller .* takes \d{3} B, but .* has only \d+ B free$"):
        EmulatedController(settings, elf, "avr")


def test_a_program_for_another_part_is_refused(tmp_path: Path) -> None:
    """A program for an ATmega328 has a stack bound (return addresses of 2 B), but is not emulated."""
    board = boards.load("mega")
    smaller = board.compiler.model_copy(update={"flags": ("-mmcu=atmega328p",)})
    uno = replace(board_builder("mega"), board=board.model_copy(update={"compiler": smaller}))
    elf = uno.guest({}, "long run(void); long run(void) { return 1; }", ("run",), tmp_path)
    assert bound_stack(load(elf), "run").bytes == 2
    with pytest.raises(EmulatorError, match=r"program\.elf: not built for an ATmega2560"):
        start(elf, "avr")


SKIPPING = """
__attribute__((naked)) unsigned long {name}(void)
{{
    __asm volatile ("ldi r22, 7\\n ldi r23, 0\\n ldi r24, 1\\n ldi r25, 1\\n" "{skip}\\n {skipped}\\n"
                    "ldi r22, 42\\n ldi r24, 0\\n ldi r25, 0\\n ret");
}}
"""
"""A function that returns 42 if the instruction `skip`, whose condition holds, skips `skipped`."""


def test_what_is_skipped_is_not_executed(mega: Builder, tmp_path: Path) -> None:
    """Of a return or an indirect call QEMU 7.2 does otherwise, of some adiw and sbiw simavr 1.6 itself."""
    skips = ("sbrs r24, 0", "sbrc r24, 1", "cpse r24, r25", "sbic 0x1e, 1")
    words = (
        "ret",
        "icall",
        "push r24",
        "rjmp .+8",
        "adiw r24, 12",
        "sbiw r24, 63",
        "call run0",
        "lds r22, 512",
    )
    functions = {f"run{i}": pair for i, pair in enumerate(itertools.product(skips, words))}
    text = "".join(SKIPPING.format(name=name, skip=a, skipped=b) for name, (a, b) in functions.items())
    machine = start(mega.guest({}, text, tuple(functions), tmp_path), "avr")
    assert [pair for name, pair in functions.items() if machine.call(name) != 42] == []


def test_an_instruction_that_the_part_lacks_is_reported(mega: Builder, tmp_path: Path) -> None:
    """Erased flash, and words without a meaning, with their place."""
    words = {"run0": "0xFFFF", "run1": "0x0001", "run2": "0x9404"}
    line = 'long {}(void) {{ __asm volatile (".word {}"); return 1; }}\n'
    text = "".join(line.format(*item) for item in words.items())
    machine = start(mega.guest({}, text, tuple(words), tmp_path), "avr")
    for name in words:
        with pytest.raises(EmulationError, match=rf"{name} faulted at address 0x\w+: illegal instruction"):
            machine.call(name)


def bound_assembly(assembly: str, folder: Path) -> StackReport:
    """Link run() written in assembly, with a function other(), and bound its stack."""
    lines = assembly.replace(";", "\\n")
    text = (
        "__attribute__((noinline)) int other(int of) { volatile int a = of; return a; }"
        f'__attribute__((naked)) int run(void) {{ __asm volatile ("{lines}"); }}'
    )
    return bound_stack(load(link("mega", text, folder)), "run")


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("assembly", "held"),
    [
        ("ret", 3),
        ("push r0; push r24; pop r24; pop r0; ret", 5),
        ("rcall .+0; pop r0; pop r0; pop r0; ret", 6),
        ("sbrc r24, 0; rjmp 1f; push r24; push r24; pop r24; pop r24; 1: ret", 5),
        ("cpse r24, r25; jmp 1f; push r24; pop r24; 1: ret", 4),
        (
            "push r28; push r29; in r28, 0x3d; in r29, 0x3e; subi r28, 100; sbc r29, r1; out 0x3e, r29;"
            "out 0x3d, r28; std Y+1, r24; subi r28, 156; sbci r29, 255; out 0x3e, r29; out 0x3d, r28;"
            "pop r29; pop r28; ret",
            105,
        ),
        (
            "in r30, 0x3d; in r31, 0x3e; sbiw r30, 2; out 0x3e, r31; out 0x3d, r30; std Z+1, r16;"
            "ldi r16, 1; ldd r16, Z+1; adiw r30, 2; out 0x3e, r31; out 0x3d, r30; ret",
            5,
        ),
        ("push r28; push r29; call __muldi3_6; pop r29; pop r28; ret", 11),
    ],
    ids=[
        *("none", "pushes", "call to the next", "skip", "skip of four bytes", "frame", "saved by a store"),
        "saved from a helper",
    ],
)
def test_changes_of_the_stack_pointer_are_followed(assembly: str, held: int, tmp_path: Path) -> None:
    """The bound is the largest depth, including the return address of 3 bytes."""
    assert bound_assembly(assembly, tmp_path).bytes == held


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("assembly", "message"),
    [
        ("push r0; ret", "`ret` .* returns without restoring the stack pointer"),
        ("push r28; pop r29; ret", "`ret` .* returns without restoring the stack pointer"),
        ("ldi r16, 1; ret", "`ret` .* returns without restoring the stack pointer and saved registers"),
        ("push r16; std Y+1, r0; ldi r16, 0; pop r17; ret", "`ret` .* returns without"),
        ("call __muldi3_6; ret", "run: `ret` .* returns without restoring the stack pointer and saved"),
        ("jmp __muldi3_6", "run: `ret` .* returns without restoring the stack pointer and saved registers"),
        ("1: push r0; rjmp 1b", "growing stack"),
        ("in r28, 0x3d; in r29, 0x3e; out 0x3d, r28; ret", "`out 0x3d, r28` .* known only at run time"),
        ("in r28, 0x3d; push r0; in r29, 0x3e; out 0x3e, r29; out 0x3d, r28", "known only at run time"),
        ("in r29, 0x3d; in r28, 0x3e; out 0x3e, r28; out 0x3d, r29", "known only at run time"),
        ("in r30, 0x3d; in r31, 0x3e; add r30, r24; out 0x3e, r31; out 0x3d, r30", "known only at run time"),
        ("sts 0x5d, r24", "`sts 0x005D, r24` .* known only at run time"),
        ("eicall", "`eicall` .* call functions directly"),
        ("ijmp", "`ijmp` .* call functions directly"),
        (".word 0xFFFF", "no instruction can be decoded"),
        ("rjmp 1f; subi r24, 1; 1: sbci r25, 0; ret", "no instruction can be decoded"),
    ],
)
def test_code_without_a_bound_is_refused(assembly: str, message: str, tmp_path: Path) -> None:
    """The error names the instruction."""
    with pytest.raises(FootprintError, match=message):
        bound_assembly(assembly, tmp_path)


def test_a_tail_call_adds_nothing(tmp_path: Path) -> None:
    """The callee of a tail call reuses the return address."""
    report = bound_assembly("jmp other", tmp_path)
    assert [frame.function for frame in report.path] == ["run", "other"]
    assert report.bytes == report.frames["other"] == sum(frame.bytes for frame in report.path)
