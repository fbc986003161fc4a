"""Sizes of linked programs: every byte has one owner, and forbidden functions are found."""

import subprocess
from pathlib import Path

import pytest

from mambo_nmpc.sil.firmware.elf import FootprintError, load
from mambo_nmpc.sil.firmware.gate import Forbidden, find_forbidden
from mambo_nmpc.sil.firmware.sizes import Added, Parts, measure_added, measure_sections
from tests.support.linking import BOARDS, link, link_controller
from tests.support.tools import require

IN_FLASH = [name for name in BOARDS if name != "avr"]
"""Boards that read constants from flash; on AVR tables take RAM too."""
EMPTY = "int run(void) { return 0; } int fly(void) { return 0; }"
SIZES = """
const int table[10] = {1, 2, 3};
int start = 5;
char room[100];
int run(void) { room[start] = (char)table[start]; return start++; }
"""
HELPERS = {
    "m4f": set(),
    "m7": set(),
    "arm926": {"__mulsf3"},
    "m0plus": {"__aeabi_fmul"},
    "rv32imac": {"__mulsf3"},
}
"""The helper that multiplies two floats; none with an FPU."""


def difference(board: str, folder: Path) -> Added:
    """Measure the bytes that the controller adds to an empty program."""
    return measure_added(
        link_controller(BOARDS[board], folder), link(BOARDS[board], EMPTY, folder, name="empty"), "nmpc"
    )


@pytest.mark.parametrize("board", IN_FLASH)
def test_the_parts_of_a_controller_add_up(board: str, tmp_path: Path) -> None:
    """Own, helper, grown and unnamed bytes add up to the difference of the sections."""
    result = difference(board, tmp_path)
    assert result.flash.total == sum(result.sections.flash.values())
    assert result.ram.total == sum(result.sections.ram.values())
    assert sum(result.own.values()) == result.flash.own + result.ram.own
    assert result.flash.helpers + result.ram.helpers == sum(result.helpers.values())


@pytest.mark.parametrize("board", IN_FLASH)
def test_each_symbol_has_the_right_owner(board: str, tmp_path: Path) -> None:
    """Local tables are the controller's own, arithmetic is the compiler's, RAM is the instance."""
    result = difference(board, tmp_path)
    assert {"nmpc_step", "nmpc_instance"} <= result.own.keys()
    local = {s.name for s in load(tmp_path / "guest.elf").symbols if s.file and s.file.startswith("nmpc")}
    assert local
    assert local <= result.own.keys()
    assert HELPERS[board] <= result.helpers.keys()
    assert not any(name.startswith("__") for name in result.own)
    assert result.ram.own == result.own["nmpc_instance"]
    assert 0 <= result.flash.unnamed < 300
    if board in {"m4f", "m7"}:
        assert result.helpers.keys() <= {"state", "target", "thrust", "command"}


def test_a_program_adds_nothing_to_itself(tmp_path: Path) -> None:
    """The difference of a program and itself is empty."""
    program = link(BOARDS["m4f"], SIZES, tmp_path)
    nothing = measure_added(program, program, "nmpc")
    assert nothing.flash == nothing.ram == Parts(own=0, helpers=0, grown=0, unnamed=0)
    assert not nothing.sections.flash
    assert not nothing.own


def test_initialised_variables_take_flash_and_ram(tmp_path: Path) -> None:
    """Constants count in flash, zero-initialised variables in RAM, initialised ones in both."""
    image = load(link(BOARDS["m4f"], SIZES, tmp_path))
    memory = measure_sections(image)
    assert memory.ram == {".data": 4, ".bss": 100}
    assert memory.flash == {".text": memory.flash[".text"], ".rodata": 40, ".data": 4}
    assert image.symbol("room").size_bytes == 100
    assert (image.symbol("table").kind, image.symbol("table").section) == ("object", ".rodata")


@pytest.mark.parametrize("board", IN_FLASH)
def test_no_byte_has_two_owners(board: str, tmp_path: Path) -> None:
    """Aliases, and helpers that fall through into each other, count once."""
    image = load(link_controller(BOARDS[board], tmp_path))
    for before, after in zip(image.symbols, image.symbols[1:], strict=False):
        assert before.address + before.size_bytes <= after.address
    for section in image.sections:
        named = sum(symbol.size_bytes for symbol in image.symbols if symbol.section == section.name)
        assert named <= section.size_bytes


def test_equal_function_names_get_their_file(tmp_path: Path) -> None:
    """If two files have a local function of the same name, the file is part of the symbol's name."""
    for name in ("left", "right"):
        (tmp_path / f"{name}.c").write_text(
            f"static __attribute__((noinline)) int same(volatile int *of) {{ return *of * {len(name)}; }}"
            f"int {name}(volatile int *of) {{ return same(of) + 1; }}"
        )
    text = """
int left(volatile int *);
int right(volatile int *);
volatile int seen;
int run(void) { return left(&seen) + right(&seen); }
"""
    image = load(link(BOARDS["m4f"], text, tmp_path, "left.c", "right.c"))
    names = [symbol.name for symbol in image.symbols]
    assert len(set(names)) == len(names)
    assert {"left.c:same", "right.c:same"} <= set(names)


@pytest.mark.parametrize("board", IN_FLASH)
def test_a_float32_controller_links_nothing_forbidden(board: str, tmp_path: Path) -> None:
    """No heap, no printf, no libm, no double precision."""
    assert find_forbidden(load(link_controller(BOARDS[board], tmp_path)), "float32") == ()


@pytest.mark.parametrize("board", ["arm926", "m4f", "m0plus", "rv32imac"])
def test_double_arithmetic_is_reported_with_its_caller(board: str, tmp_path: Path) -> None:
    """One unsuffixed literal links the compiler's double arithmetic, which only float64 may use."""
    text = """
volatile float x;
__attribute__((noinline)) float half(float of) { return (float)(of * 0.1); }
int run(void) { x = half(x); return 0; }
"""
    image = load(link(BOARDS[board], text, tmp_path))
    found = find_forbidden(image, "float32")
    widened = {"__extendsfdf2", "__aeabi_f2d"}
    callers = {name: one.callers for one in found for name in image.symbol(one.symbol).labels}
    assert all(one.kind == "double precision" for one in found)
    assert all(callers[name] == ("half",) for name in widened & callers.keys())
    assert widened & callers.keys()
    assert find_forbidden(image, "float64") == ()


@pytest.mark.parametrize(
    ("function", "kind"),
    [
        ("malloc", "heap"),
        ("_free_r", "heap"),
        ("_sbrk", "heap"),
        ("_Znwj", "heap"),
        ("vsnprintf", "printf"),
        ("puts", "printf"),
        ("sinf", "libm"),
        ("sqrt", "libm"),
        ("__ieee754_atan2f", "libm"),
        ("__aeabi_cdcmple", "double precision"),
        ("__aeabi_ui2d", "double precision"),
        ("__floatunsidf", "double precision"),
        ("__ltdf2", "double precision"),
        ("__addtf3", "quadruple precision"),
    ],
)
def test_a_library_function_is_found(function: str, kind: str, tmp_path: Path) -> None:
    """A forbidden function is recognised by its name."""
    text = (
        f"volatile int x; __attribute__((noinline)) int {function}(int of) {{ return of + x; }}"
        f"int run(void) {{ return {function}(x) + 1; }}"
    )
    image = load(link(BOARDS["m4f"], text, tmp_path, "-fno-builtin"))
    assert find_forbidden(image, "float32") == (Forbidden(function, kind, ("run",)),)


@pytest.mark.parametrize(
    "function",
    [
        "__mulsf3",
        "__floatdisf",
        "__fixunssfdi",
        "__aeabi_fcmple",
        "__aeabi_l2f",
        "nmpc_sine_cosine",
        "freeze",
        "cosy",
    ],
)
def test_other_functions_are_left_alone(function: str, tmp_path: Path) -> None:
    """Single precision is allowed, and names that only begin like a forbidden one."""
    text = f"int {function}(int of) {{ return of; }} int run(void) {{ return {function}(1); }}"
    assert find_forbidden(load(link(BOARDS["m4f"], text, tmp_path, "-fno-inline")), "float32") == ()


def test_programs_that_cannot_be_measured_are_refused(tmp_path: Path) -> None:
    """A missing file, no ELF file, an object that is not linked, a stripped program."""
    with pytest.raises(FootprintError, match=r"nowhere\.elf: cannot be read"):
        load(tmp_path / "nowhere.elf")
    (tmp_path / "text.elf").write_text("no program")
    with pytest.raises(FootprintError, match=r"text\.elf: not a program in ELF format"):
        load(tmp_path / "text.elf")
    with pytest.raises(FootprintError, match=r"guest\.elf: not linked to fixed addresses; link with -static"):
        load(link(BOARDS["m4f"], SIZES, tmp_path, "-r"))
    stripped = link(BOARDS["m4f"], SIZES, tmp_path)
    subprocess.run([require("arm-none-eabi-strip", "binutils-arm-none-eabi"), stripped], check=True)
    with pytest.raises(FootprintError, match=r"guest\.elf: has no symbols"):
        load(stripped)
