"""Sizes of linked programs: every byte has one owner, and forbidden functions are found."""

import itertools
import subprocess
from pathlib import Path

import pytest

from mambo_codegen.bundle.render import render
from mambo_sil.board.firmware.elf import FootprintError, load
from mambo_sil.board.firmware.gate import Forbidden, find_forbidden
from mambo_sil.board.firmware.sizes import Parts, measure_added, measure_sections
from tests.support.linking import link
from tests.support.one_norm import ONE_NORM
from tests.support.tools import CORES, board_builder, require

SIZES = """
const int table[10] = {1, 2, 3};
int start = 5;
char room[100];
int run(void) { room[start] = (char)table[start]; return start++; }
"""
HELPERS = {
    "crazyflie": set(),
    "nano33ble": set(),
    "stm32f103": {"__mulsf3"},
    "stm32h743": set(),
    "teensy41": set(),
    "mambo": {"__mulsf3"},
    "rp2040": {"__aeabi_fmul"},
    "rv32": {"__mulsf3"},
    "mega": {"__mulsf3"},
}
"""The helper that multiplies two floats; none with an FPU."""


@pytest.mark.first_is_quick
@pytest.mark.parametrize("board", CORES)
def test_every_byte_of_a_controller_has_one_owner(board: str, tmp_path: Path) -> None:
    """Parts add up: tables are the controller's own, arithmetic is the compiler's, RAM is the instance."""
    files = render(ONE_NORM, with_digest=False)
    build = board_builder(board)
    firmware, empty = build.firmware(files, tmp_path), build.firmware(files, tmp_path, empty=True)
    image, added = load(firmware), measure_added(firmware, empty, "nmpc")

    assert added.flash.total == sum(added.sections.flash.values()) > 0
    assert added.ram.total == sum(added.sections.ram.values()) > 0
    assert -4 < added.flash.unnamed < 300  # the empty program may have more padding
    local = {s.name for s in image.symbols if s.file and s.file.startswith("nmpc")}
    assert local | {"nmpc_step", "nmpc_controller"} <= added.own.keys()
    assert local
    assert HELPERS[board] <= added.helpers.keys()
    assert bool(HELPERS[board]) == bool(added.helpers)
    assert not any(name.startswith("__") for name in added.own)
    if board != "mega":  # where constants take RAM too
        assert sum(added.own.values()) == added.flash.own + added.ram.own
        assert sum(added.helpers.values()) == added.flash.helpers + added.ram.helpers
        assert added.ram.own == added.own["nmpc_controller"]

    # aliases, and helpers that fall through into each other, count once
    for before, after in itertools.pairwise(image.symbols):
        assert before.address + before.size_bytes <= after.address
    for section in image.sections:
        named = sum(symbol.size_bytes for symbol in image.symbols if symbol.section == section.name)
        assert named <= section.size_bytes


def test_a_program_adds_nothing_to_itself(tmp_path: Path) -> None:
    """The difference of a program and itself is empty."""
    program = link("crazyflie", SIZES, tmp_path)
    nothing = measure_added(program, program, "nmpc")
    assert nothing.flash == nothing.ram == Parts(own=0, helpers=0, grown=0, unnamed=0)
    assert not nothing.sections.flash
    assert not nothing.own


def test_initialised_variables_take_flash_and_ram(tmp_path: Path) -> None:
    """Constants count in flash, zero-initialised variables in RAM, initialised ones in both."""
    image = load(link("crazyflie", SIZES, tmp_path))
    memory = measure_sections(image)
    assert memory.ram == {".data": 4, ".bss": 100}
    assert memory.flash == {".text": memory.flash[".text"], ".rodata": 40, ".data": 4}
    assert image.symbol("room").size_bytes == 100
    assert (image.symbol("table").kind, image.symbol("table").section) == ("object", ".rodata")


def test_equal_function_names_get_their_file(tmp_path: Path) -> None:
    """If two files have a local function of the same name, the file is part of the symbol's name."""
    files = {
        f"{name}.c": "static __attribute__((noinline)) int same(volatile int *of) "
        f"{{ return *of * {len(name)}; }} int {name}(volatile int *of) {{ return same(of) + 1; }}"
        for name in ("left", "right")
    }
    text = """
int left(volatile int *);
int right(volatile int *);
volatile int seen;
int run(void) { return left(&seen) + right(&seen); }
"""
    image = load(board_builder("crazyflie").guest(files, text, ("run",), tmp_path))
    names = [symbol.name for symbol in image.symbols]
    assert len(set(names)) == len(names)
    assert {"left.c:same", "right.c:same"} <= set(names)


FORBIDDEN = {
    "heap": ("malloc", "_free_r", "_sbrk", "_Znwj"),
    "printf": ("vsnprintf", "puts"),
    "libm": ("sinf", "sqrt", "__ieee754_atan2f"),
    "double precision": ("__aeabi_cdcmple", "__aeabi_ui2d", "__floatunsidf", "__ltdf2"),
    "quadruple precision": ("__addtf3",),
}
ALLOWED = (
    *("__mulsf3", "__floatdisf", "__fixunssfdi", "__aeabi_fcmple", "__aeabi_l2f"),
    *("sine_cosine", "freeze", "cosy"),
)
"""Single precision, and names that only begin like a forbidden one."""


def test_forbidden_functions_are_found_by_name(tmp_path: Path) -> None:
    """Each has its kind and its caller; other functions are left alone."""
    kinds = {function: kind for kind, functions in FORBIDDEN.items() for function in functions}
    callers = {function: f"use{index}" for index, function in enumerate([*kinds, *ALLOWED])}
    text = "volatile int x;" + "".join(
        f"__attribute__((noinline)) int {function}(int of) {{ return of + x; }}"
        f"int {caller}(void) {{ return {function}(x) + 1; }}"
        for function, caller in callers.items()
    )
    elf = link("crazyflie", text, tmp_path, "-fno-builtin", "-fno-ipa-icf", keep=tuple(callers.values()))
    assert set(find_forbidden(load(elf), "float32")) == {
        Forbidden(function, kind, (callers[function],)) for function, kind in kinds.items()
    }


def test_programs_that_cannot_be_measured_are_refused(tmp_path: Path) -> None:
    """A missing file, no ELF file, an object that is not linked, a stripped program."""
    with pytest.raises(FootprintError, match=r"nowhere\.elf: cannot be read"):
        load(tmp_path / "nowhere.elf")
    (tmp_path / "text.elf").write_text("no program")
    with pytest.raises(FootprintError, match=r"text\.elf: not a program in ELF format"):
        load(tmp_path / "text.elf")
    stripped = link("crazyflie", SIZES, tmp_path)
    with pytest.raises(FootprintError, match=r"main\.o: not linked to fixed addresses; link with -static"):
        load(stripped.with_name("main.o"))
    subprocess.run([require("arm-none-eabi-strip", "binutils-arm-none-eabi"), stripped], check=True)
    with pytest.raises(FootprintError, match=r"program\.elf: has no symbols"):
        load(stripped)
