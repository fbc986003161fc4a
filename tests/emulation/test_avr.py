"""Eight bits: the self-test on an emulated ATmega2560, an emulator that leaves nothing behind, odd stacks."""

import os
import select
import subprocess
import sys
from importlib import resources
from pathlib import Path

import pytest

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.digest import self_test_digest
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.settings.controller_toml import with_option
from mambo_nmpc.sil.controllers.emulated import GUEST, EmulatedController, build_guest, emulated_digest
from mambo_nmpc.sil.emulation.avr import AvrMachine, Long
from mambo_nmpc.sil.emulation.machine import Machine, start
from mambo_nmpc.sil.errors import EmulationError, EmulatorError
from mambo_nmpc.sil.firmware.build import Builder
from mambo_nmpc.sil.firmware.elf import FootprintError, load
from mambo_nmpc.sil.firmware.stack import StackReport, worst_case
from tests.support.cases import settings_case
from tests.support.linking import BOARDS, Board, linked
from tests.support.tools import board_builder, only

AVR = BOARDS["avr"]
SELF_TEST = """
#include "nmpc_self_test.h"
static nmpc_t scratch;
long run(void);
long run(void) { return nmpc_self_test(&scratch); }
"""
EFFORT = (
    "return nmpc_tracking_cost(weight.tracking, distance_m) + nmpc_effort_cost(weight.effort, variation_rad);"
)
HARMED = "return (weight.effort * variation_rad) + (weight.tracking * (distance_m + (nmpc_real_t)0.001f));"
ABANDONED = """
import sys
from importlib import resources
from pathlib import Path
from mambo_nmpc.sil.emulation.machine import start
machine = start(Path(sys.argv[1]), "avr")
print(machine._stub._process.pid, flush=True)
sys.stdin.read()
"""
"""A program that holds an emulator until it is ended."""


def self_test(files: dict[str, str], folder: Path) -> Machine:
    """Put a bundle with its self-test on the core."""
    return start(board_builder("mega").guest(files, SELF_TEST, ("run",), folder), "avr")


@pytest.fixture
def mega() -> Builder:
    """Return the builder for the Mega, or skip."""
    return board_builder("mega")


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
@pytest.mark.parametrize("preset", ["mambo", "table1"])
def test_the_self_test_passes_on_eight_bits(preset: str, scalar: str, tmp_path: Path) -> None:
    """Every step of it has the bits of the reference: zero, no first difference."""
    settings = with_option(presets.load(preset), "code.scalar", scalar, "test")
    assert self_test(render(settings, with_digest=False), tmp_path).call("run") == 0


def test_the_self_test_sees_a_harmed_controller_on_eight_bits(tmp_path: Path) -> None:
    """A cost with a millimetre too much differs in the first step."""
    files = render(presets.load("mambo"), with_digest=False)
    assert files["src/nmpc_cost.c"].count(EFFORT) == 1
    harmed = files | {"src/nmpc_cost.c": files["src/nmpc_cost.c"].replace(EFFORT, HARMED)}
    assert self_test(harmed, tmp_path).call("run") == 1


@pytest.mark.parametrize(
    ("preset", "scalar"), [("mambo", "float32"), ("table1", "float32"), ("mambo", "fixed")]
)
def test_frozen_steps_have_their_digest_on_eight_bits(
    preset: str, scalar: str, mega: Builder, tmp_path: Path
) -> None:
    """Two episodes of it, as the reference has them."""
    settings = with_option(presets.load(preset), "code.scalar", scalar, "test")
    elf = build_guest(settings, mega, tmp_path)
    assert emulated_digest(settings, elf, "avr", 2) == self_test_digest(Design(settings), 2)


def test_memory_holds_what_is_written(mega: Builder, tmp_path: Path) -> None:
    """More than one packet of it, beside the program's own variables, which start as they were linked."""
    elf = mega.guest({}, "long seen = 3; long run(void); long run(void) { return seen; }", ("run",), tmp_path)
    machine = start(elf, "avr")
    content = bytes(range(256)) * 12
    address = machine.allocate(len(content))
    machine.write(address, content)
    assert machine.read(address, len(content)) == content
    assert machine.call("run") == 3


def test_long_arguments_arrive_whole(mega: Builder, tmp_path: Path) -> None:
    """Among ints, in registers and on the stack: each has its 32 bits."""
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


def test_a_stack_that_runs_into_the_data_is_said_to(mega: Builder, tmp_path: Path) -> None:
    """A function that fills more than there is does not return as if nothing had happened."""
    text = """
long run(void);
long run(void)
{
    volatile char room[2100];
    int i;
    for (i = 0; i < 2100; i++) { room[i] = 1; }
    return room[7];
}
"""
    machine = start(mega.guest({}, text, ("run",), tmp_path), "avr")
    with pytest.raises(EmulationError, match="run took more than the 2048 B of stack"):
        machine.call("run")


def test_an_emulator_that_ends_is_said_to(mega: Builder, tmp_path: Path) -> None:
    """Whoever kills it, the next call is an error, not a wait."""
    machine = start(mega.guest({}, "long run(void); long run(void) { return 1; }", ("run",), tmp_path), "avr")
    assert isinstance(machine, AvrMachine)
    machine._stub._process.kill()
    machine._stub._process.wait()
    with pytest.raises(EmulationError, match="the emulator ended"):
        machine.call("run")


def test_the_emulator_dies_with_its_owner(mega: Builder, tmp_path: Path) -> None:
    """Killed without warning, a process leaves no emulator behind."""
    elf = mega.guest({}, "long run(void); long run(void) { return 1; }", ("run",), tmp_path)
    with subprocess.Popen(
        [sys.executable, "-c", ABANDONED, str(elf)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as owner:
        assert owner.stdout is not None
        emulator = os.pidfd_open(int(owner.stdout.readline()))
        assert not select.select([emulator], [], [], 0)[0]
        owner.kill()
        assert select.select([emulator], [], [], 10)[0]
    os.close(emulator)


@pytest.mark.parametrize(
    ("here", "tool", "package"),
    [("setpriv", "qemu-system-avr", "qemu-system-misc"), ("qemu-system-avr", "setpriv", "util-linux")],
)
def test_a_missing_tool_is_named(
    here: str, tool: str, package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the package that brings it."""
    program = "long run(void); long run(void) { return 1; }"
    elf = board_builder("mega").guest({}, program, ("run",), tmp_path / "guest")
    (tmp_path / "bin").mkdir()
    monkeypatch.setenv("PATH", only(tmp_path / "bin", here))
    with pytest.raises(EmulatorError, match=f"no {tool} found .* Debian's {package} brings it"):
        start(elf, "avr")


def test_a_missing_disassembler_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the package that brings it."""
    image = load(linked(AVR, "int run(void) { return 1; }", tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(
        FootprintError, match=r"guest\.elf: no avr-objdump .* Debian's binutils-avr brings it"
    ):
        worst_case(image, "run")


def test_a_controller_too_large_for_the_ram_is_refused(mega: Builder, tmp_path: Path) -> None:
    """Fifty moves over fifty steps: how much it takes, and how much there is."""
    settings = settings_case(4, "float32")
    assert (settings.horizon.prediction, settings.horizon.control) == (50, 50)
    with pytest.raises(EmulatorError, match=r"^\d{5} B of data and 2048 B of stack do not fit the 8192 B of"):
        EmulatedController(settings, build_guest(settings, mega, tmp_path), "avr")


def test_a_guest_that_leaves_no_room_is_refused(mega: Builder, tmp_path: Path) -> None:
    """What a controller takes with its inputs and its outcome must not run into the stack."""
    settings = presets.load("mambo")
    glue = (
        resources.files("mambo_nmpc.sil.controllers").joinpath("batch.c").read_text("utf-8")
        + "char nmpc_ballast[5750] = {1};"
    )
    elf = mega.guest(render(settings, with_digest=False), glue, (*GUEST, "nmpc_ballast"), tmp_path)
    with pytest.raises(EmulatorError, match=r"^a controller .* take \d{3} B, of which .* has \d+ B free$"):
        EmulatedController(settings, elf, "avr")


def test_a_program_for_another_part_is_refused(tmp_path: Path) -> None:
    """An ATmega328 has return addresses of two bytes: its stack is bounded, but nothing here emulates it."""
    board_builder("mega")
    text = "volatile int seen; long run(void) { return seen; }"
    elf = linked(Board("uno", AVR.compiler, AVR.package, ("-mmcu=atmega328p",)), text, tmp_path)
    assert worst_case(load(elf), "run").bytes == 2
    with pytest.raises(EmulatorError, match=r"guest\.elf: not built for an ATmega2560"):
        start(elf, "avr")


def bound_of(assembly: str, folder: Path) -> StackReport:
    """Link a run() of instructions alone, between other() and its end, and bound its stack."""
    lines = assembly.replace(";", "\\n")
    text = (
        "__attribute__((noinline)) int other(int of) { volatile int a = of; return a; }"
        f'__attribute__((naked)) int run(void) {{ __asm volatile ("{lines}"); }}'
    )
    return worst_case(load(linked(AVR, text, folder)), "run")


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
def test_what_the_stack_pointer_goes_through_is_followed(assembly: str, held: int, tmp_path: Path) -> None:
    """The most bytes at any time, the return address of three bytes included."""
    assert bound_of(assembly, tmp_path).bytes == held


@pytest.mark.parametrize(
    ("assembly", "message"),
    [
        ("push r0; ret", "`ret` .* returns without the stack pointer"),
        ("push r28; pop r29; ret", "`ret` .* returns without the stack pointer"),
        ("ldi r16, 1; ret", "`ret` .* returns without the stack pointer and registers"),
        ("push r16; std Y+1, r0; ldi r16, 0; pop r17; ret", "`ret` .* returns without"),
        ("call __muldi3_6; ret", "run: `ret` .* returns without the stack pointer and registers"),
        ("jmp __muldi3_6", "run: `ret` .* returns without the stack pointer and registers"),
        ("1: push r0; rjmp 1b", "ever more stack"),
        ("in r28, 0x3d; in r29, 0x3e; out 0x3d, r28; ret", "`out 0x3d, r28` .* only run time knows"),
        ("in r28, 0x3d; push r0; in r29, 0x3e; out 0x3e, r29; out 0x3d, r28", "only run time knows"),
        ("in r29, 0x3d; in r28, 0x3e; out 0x3e, r28; out 0x3d, r29", "only run time knows"),
        ("in r30, 0x3d; in r31, 0x3e; add r30, r24; out 0x3e, r31; out 0x3d, r30", "only run time knows"),
        ("sts 0x5d, r24", "`sts 0x005D, r24` .* only run time knows"),
        ("eicall", "`eicall` .* call functions by name"),
        ("ijmp", "`ijmp` .* call functions by name"),
        (".word 0xFFFF", "no instruction can be read"),
        ("rjmp 1f; subi r24, 1; 1: sbci r25, 0; ret", "no instruction can be read"),
    ],
)
def test_what_has_no_bound_is_refused(assembly: str, message: str, tmp_path: Path) -> None:
    """Named with the instruction, never guessed."""
    with pytest.raises(FootprintError, match=message):
        bound_of(assembly, tmp_path)


def test_a_tail_call_adds_nothing(tmp_path: Path) -> None:
    """What is jumped to has the return address of who jumps."""
    report = bound_of("jmp other", tmp_path)
    assert [frame.function for frame in report.path] == ["run", "other"]
    assert report.bytes == report.frames["other"] == sum(frame.bytes for frame in report.path)
