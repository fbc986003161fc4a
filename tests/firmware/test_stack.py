"""Worst-case stack: bounds against gcc's frame sizes and painted stacks; programs without a bound."""

from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from mambo_nmpc.sil.emulation.machine import start
from mambo_nmpc.sil.firmware.elf import FootprintError, Image, load
from mambo_nmpc.sil.firmware.stack import Frame, StackReport, bound_stack, find_callers
from tests.support.linking import BOARDS, Board, link, link_controller
from tests.support.tools import require

OPTIMISATIONS = ("-O0", "-O1", "-O2", "-O3", "-Os")
GRID = [(board, optimisation) for board in BOARDS for optimisation in OPTIMISATIONS]
QUICK = {("arm926", "-O2"), ("m4f", "-O2"), ("m0plus", "-Os"), ("rv32imac", "-O0"), ("avr", "-O2")}
CORES = {
    "arm926": "arm926",
    "m4f": "cortex-m4",
    "m7": "cortex-m7",
    "m0plus": "cortex-m0",
    "rv32imac": "rv32",
    "avr": "avr",
}
NOT_BUILT = ("avr", "float64")
"""avr-gcc's double has 32 bits."""
PAINT = b"\xa5"
UNTOUCHED_BYTES = 16
"""Largest difference of bound and high-water mark: paths not taken, unwritten ends of frames."""


class PaintedStack:
    """A program on an emulated core with a painted stack."""

    def __init__(self, board: Board, image: Image) -> None:
        if board.name == "avr":
            require("qemu-system-avr", "qemu-system-misc")
        self._image = image
        self._machine = start(image.path, CORES[board.name])
        self._stack = self._machine.stack
        self._machine.write(self._stack.start, PAINT * len(self._stack))

    def call(self, function: str) -> int:
        """Call a function without arguments; returns its result."""
        return self._machine.call(function)

    def write(self, variable: str, content: bytes) -> None:
        """Write all bytes of a variable."""
        symbol = self._image.symbol(variable)
        assert symbol.size_bytes == len(content)
        self._machine.write(symbol.address, content)

    def high_water_bytes(self) -> int:
        """Return the depth to which the paint is overwritten."""
        return len(self._machine.read(self._stack.start, len(self._stack)).lstrip(PAINT))


def fly(emulator: PaintedStack, steps: int) -> None:
    """Step with plausible inputs of all magnitudes, and with random bits."""
    rng = np.random.default_rng(7)
    for _ in range(steps):
        inputs = rng.normal(0, 10.0 ** rng.uniform(-4, 1), 12).astype("<f4")
        inputs[-1] = 9.81 + rng.normal()
        content = inputs.tobytes() if rng.random() < 0.9 else rng.bytes(48)
        emulator.write("state", content[:28])
        emulator.write("target", content[28:44])
        emulator.write("thrust", content[44:])
        emulator.call("fly")


def gcc_frames(folder: Path) -> dict[str, int]:
    """Return the frame sizes that gcc's -fstack-usage has written."""
    rows = [line.split("\t") for path in folder.glob("*.su") for line in path.read_text().splitlines()]
    assert {kind for _, _, kind in rows} == {"static"}
    return {place.rpartition(":")[2]: int(size) for place, size, _ in rows}


def grid() -> list[object]:
    """Return boards and optimisations; most are marked long."""
    return [
        pytest.param(*case, marks=[] if case in QUICK else pytest.mark.long, id=" ".join(case))
        for case in GRID
    ]


@pytest.mark.parametrize(("board", "optimisation"), grid())
def test_the_bound_holds_and_is_tight(board: str, optimisation: str, tmp_path: Path) -> None:
    """The high-water mark is at most the bound and close to it; frames equal gcc's."""
    image = load(link_controller(BOARDS[board], tmp_path, optimisation))
    report, step = bound_stack(image, "run"), bound_stack(image, "fly")

    emulator = PaintedStack(BOARDS[board], image)
    assert emulator.call("run") == 0
    seen = emulator.high_water_bytes()
    assert seen <= report.bytes <= seen + UNTOUCHED_BYTES

    emulator = PaintedStack(BOARDS[board], image)
    fly(emulator, 60)
    seen = emulator.high_water_bytes()
    assert seen <= step.bytes <= seen + UNTOUCHED_BYTES

    known = gcc_frames(tmp_path)
    frames = {name.rpartition(":")[2]: size for name, size in report.frames.items()}
    assert len(frames.keys() & known.keys()) > 5
    assert all(known.get(name, size) == size for name, size in frames.items())


@pytest.mark.parametrize(
    ("board", "scalar"),
    [(board, scalar) for board in BOARDS for scalar in ("float64", "fixed") if (board, scalar) != NOT_BUILT],
)
def test_other_scalar_types_have_a_bound(
    board: str, scalar: Literal["float64", "fixed"], tmp_path: Path
) -> None:
    """The analysis covers the compiler's helpers, including those with their own calling convention."""
    image = load(link_controller(BOARDS[board], tmp_path, scalar=scalar))
    emulator = PaintedStack(BOARDS[board], image)
    assert emulator.call("run") == 0
    assert 0 <= bound_stack(image, "run").bytes - emulator.high_water_bytes() <= UNTOUCHED_BYTES


def report_of(board: str, text: str, folder: Path, *flags: str) -> StackReport:
    """Link a program and bound the stack of run()."""
    return bound_stack(load(link(BOARDS[board], text, folder, *flags)), "run")


LEAF = "int run(void); volatile int seen; int run(void) { return seen; }"
CHAIN = """
#define NOINLINE __attribute__((noinline))
volatile int seen;
NOINLINE int last(int *of) { volatile int a[10]; a[seen] = *of; return a[1] + seen; }
NOINLINE int middle(int of) { volatile int a[20]; a[seen] = of; of = last(&of); return a[2] + of; }
int run(void) { return middle(3) + seen; }
"""
DIAMOND = """
#define NOINLINE __attribute__((noinline))
volatile int seen;
NOINLINE int last(int of) { volatile int a[10]; a[seen] = of; return a[1]; }
NOINLINE int thin(int of) { volatile int a[2]; a[seen] = of; of = last(of); return a[1] + of; }
NOINLINE int thick(int of) { volatile int a[40]; a[seen] = of; of = last(of); return a[1] + of; }
int run(void) { return thin(1) + thick(2) + seen; }
"""
TAIL = """
#define NOINLINE __attribute__((noinline))
volatile int seen;
NOINLINE int deep(int of) { volatile int a[50]; a[seen] = of; return a[1]; }
int run(void) { volatile int a[5]; a[seen] = 2; return deep(a[1]); }
"""
WIDE = "volatile int seen; int run(void) { volatile long a[3000]; a[seen] = 3; return a[seen + 1]; }"


@pytest.mark.parametrize("board", BOARDS)
class TestSmallPrograms:
    """Basic shapes of call graphs."""

    def test_a_leaf_needs_only_its_return_address(self, board: str, tmp_path: Path) -> None:
        """A leaf function without a frame needs no stack, except AVR's return address of 3 bytes."""
        assert report_of(board, LEAF, tmp_path).bytes == (3 if board == "avr" else 0)

    def test_a_chain_adds_up(self, board: str, tmp_path: Path) -> None:
        """The path has every function with its frame as in gcc's -fstack-usage."""
        report = report_of(board, CHAIN, tmp_path, "-fstack-usage")
        known = gcc_frames(tmp_path)
        assert report.path == tuple(Frame(name, known[name]) for name in ("run", "middle", "last"))
        assert report.bytes == sum(frame.bytes for frame in report.path) == report.depths["run"]

    def test_a_diamond_takes_its_deeper_side(self, board: str, tmp_path: Path) -> None:
        """Of two paths to the same function the deeper one counts; the other is reported with its depth."""
        report = report_of(board, DIAMOND, tmp_path)
        assert [frame.function for frame in report.path] == ["run", "thick", "last"]
        assert report.depths["thin"] == report.frames["thin"] + report.frames["last"]
        assert report.bytes == report.frames["run"] + report.depths["thick"]

    def test_a_frame_too_large_for_an_immediate_is_known(self, board: str, tmp_path: Path) -> None:
        """Constants are propagated through registers to the stack pointer."""
        report = report_of(board, WIDE, tmp_path, "-fstack-usage")
        assert report.bytes == gcc_frames(tmp_path)["run"] >= 12000

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            (
                "volatile int seen; int run(void) { volatile int a[seen]; a[0] = 1; return a[seen]; }",
                r"guest\.elf: run: `(.*sp.*|out 0x3d, r\d+)` at 0x1.* known only at run time; alloca",
            ),
            (
                "int run(void); volatile int seen;"
                "__attribute__((noinline)) int other(int n) { seen = n; return n ? run() * n : 1; }"
                "__attribute__((noinline)) int run(void) { return other(seen) + 1; }",
                r"run -> other -> run is recursive",
            ),
            (
                "int (*volatile hook)(void); int run(void) { return hook() + 1; }",
                r"run: `.*((jalr|blx) .*|eicall)` at 0x1.* known only at run time; call functions directly",
            ),
            (
                "int (*volatile hook)(void); int run(void) { return hook(); }",
                r"run: `.*((jr|bx|blx) .*|eijmp)` at 0x1.* known only at run time; call functions directly",
            ),
            (
                "volatile int seen; int run(void) { switch (seen) {"
                + "".join(f"case {n}: seen = {n * n * 7 % 13}; return {n * n % 11};" for n in range(20))
                + "} return seen; }",
                r"(run|__tablejump2__): `.*` at 0x1.* compile with -fno-jump-tables",
            ),
        ],
        ids=["variable array", "recursion", "function pointer", "tail call of a pointer", "jump table"],
    )
    def test_a_program_without_a_bound_is_refused(
        self, board: str, text: str, message: str, tmp_path: Path
    ) -> None:
        """The error names the function, the instruction and a remedy."""
        with pytest.raises(FootprintError, match=message):
            report_of(board, text, tmp_path, "-fno-tree-switch-conversion")


@pytest.mark.parametrize("board", [name for name in BOARDS if name not in {"m0plus", "avr"}])
def test_a_tail_call_replaces_the_frame(board: str, tmp_path: Path) -> None:
    """The caller frees its frame before the jump; on the other boards gcc makes no tail calls."""
    report = report_of(board, TAIL, tmp_path)
    assert report.path == (Frame("run", 0), Frame("deep", report.frames["deep"]))
    assert report.bytes == report.frames["deep"] > report.frames["run"] > 0


def test_a_loop_that_pushes_is_refused(tmp_path: Path) -> None:
    """A loop that pushes in every iteration has no bound."""
    text = 'volatile int seen; __attribute__((naked)) int run(void) { __asm("1: push {r0}; b 1b"); }'
    with pytest.raises(FootprintError, match=r"run: `.*` at 0x.* growing stack: a loop"):
        report_of("m4f", text, tmp_path)


def test_a_return_to_another_place_is_refused(tmp_path: Path) -> None:
    """A return must restore the stack pointer and the saved registers."""
    text = '__attribute__((naked)) int run(void) { __asm("push {r4, lr}; bx lr"); }'
    with pytest.raises(
        FootprintError, match=r"run: `bx lr` at 0x.* returns without restoring the stack pointer"
    ):
        report_of("m4f", text, tmp_path)


def test_a_call_in_disguise_is_refused(tmp_path: Path) -> None:
    """A jump with a changed link register is not a tail call."""
    text = """
__attribute__((noinline)) int other(int of) { return of * 3; }
__attribute__((naked)) int run(void) { __asm("mov r4, lr; mov lr, pc; b other; mov pc, r4"); }
"""
    with pytest.raises(FootprintError, match=r"run: `bx lr` at 0x1.* known only at run time"):
        report_of("arm926", text, tmp_path)


def test_thumb_code_calls_a32_helpers_through_veneers(tmp_path: Path) -> None:
    """`bx pc` switches to A32 at a known address."""
    board = Board(
        "arm926 in Thumb", "arm-none-eabi-gcc", "gcc-arm-none-eabi", ("-mcpu=arm926ej-s", "-mthumb")
    )
    report = bound_stack(load(link_controller(board, tmp_path)), "run")
    assert "____aeabi_fcmplt_from_thumb" in report.frames


def test_shared_tails_and_fall_through_count_where_they_run(tmp_path: Path) -> None:
    """Code shared by several functions counts in the frame of each."""
    text = """
__asm(".syntax unified; .text; .thumb; .global first, second; .thumb_func;"
      "first: push {r4, lr}; b 1f; .thumb_func; second: push {r0, r1, r4, lr}; add sp, #8;"
      "1: sub sp, #24; beq 2f; add sp, #24; pop {r4, pc}; 2: add sp, #24; pop {r4, pc}");
int first(void); int second(void);
volatile int seen;
int run(void) { return first() + second() + seen; }
"""
    report = report_of("m0plus", text, tmp_path)
    assert report.frames["first"] == 8 + 24
    assert report.frames["second"] == 8 + 24


def test_callers_are_named(tmp_path: Path) -> None:
    """Every direct caller of a function is listed, tail calls included."""
    image = load(link(BOARDS["m4f"], DIAMOND, tmp_path))
    callers = find_callers(image)
    assert callers["last"] == ("thin", "thick")
    assert set(callers["thick"]) == set(callers["thin"]) == {"run"}


def test_other_processors_are_refused(tmp_path: Path) -> None:
    """The code of an x86-64 program cannot be disassembled, so its stack has no bound."""
    image = load(link(Board("host", "gcc", "gcc", ()), "int run(void) { return 1; }", tmp_path))
    with pytest.raises(
        FootprintError, match=r"guest\.elf: cannot disassemble code for .*, only ARM, AVR and"
    ):
        bound_stack(image, "run")


def test_an_unknown_entry_is_refused(tmp_path: Path) -> None:
    """The error names the missing function."""
    with pytest.raises(FootprintError, match="no function or object nmpc_step"):
        bound_stack(load(link(BOARDS["m4f"], LEAF, tmp_path)), "nmpc_step")
