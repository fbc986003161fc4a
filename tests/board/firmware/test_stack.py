"""Worst-case stack: bounds against gcc's frame sizes and painted stacks; programs without a bound."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.toolchain import Toolchain
from mambo_sil.board.emulation.machine import Machine, start
from mambo_sil.board.firmware.elf import FootprintError, Image, load
from mambo_sil.board.firmware.stack import Frame, bound_stack, find_callers
from tests.support.linking import link, link_controller
from tests.support.tools import CORES, require

OPTIMISATIONS = ("-O0", "-O1", "-O2", "-O3", "-Os")
QUICK = {("mambo", "-O2"), ("crazyflie", "-O2"), ("rp2040", "-Os"), ("rv32", "-O0"), ("mega", "-O2")}
PAINT = b"\xa5"
UNTOUCHED_BYTES = 16
"""Largest difference of bound and high-water mark: paths not taken, unwritten ends of frames."""


def start_painted(board: str, image: Image) -> Machine:
    """Start a program on an emulated core and paint its stack."""
    machine = start(image.path, CORES[board])
    machine.write(machine.stack.start, PAINT * len(machine.stack))
    return machine


def high_water_bytes(machine: Machine) -> int:
    """Return the depth to which the paint is overwritten."""
    return len(machine.read(machine.stack.start, len(machine.stack)).lstrip(PAINT))


def fly(machine: Machine, image: Image, steps: int) -> None:
    """Step with plausible inputs of all magnitudes, and with random bits."""
    rng = np.random.default_rng(7)
    for _ in range(steps):
        inputs = rng.normal(0, 10.0 ** rng.uniform(-4, 1), 12).astype("<f4")
        inputs[-1] = 9.81 + rng.normal()
        content = inputs.tobytes() if rng.random() < 0.9 else rng.bytes(48)
        for variable in ("state", "target", "thrust"):
            symbol = image.symbol(variable)
            machine.write(symbol.address, content[: symbol.size_bytes])
            content = content[symbol.size_bytes :]
        assert not content
        machine.call("fly")


def gcc_frames(folder: Path) -> dict[str, int]:
    """Return the frame sizes that gcc's -fstack-usage has written."""
    rows = [line.split("\t") for path in folder.rglob("*.su") for line in path.read_text().splitlines()]
    assert {kind for _, _, kind in rows} == {"static"}
    return {place.rpartition(":")[2]: int(size) for place, size, _ in rows}


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("board", "optimisation"),
    [
        pytest.param(*case, marks=[] if case in QUICK else pytest.mark.long)
        for case in itertools.product(CORES, OPTIMISATIONS)
    ],
)
def test_the_bound_holds_and_is_tight(board: str, optimisation: str, tmp_path: Path) -> None:
    """The high-water mark is at most the bound and close to it; frames equal gcc's."""
    image = load(link_controller(board, tmp_path, optimisation))
    report, step = bound_stack(image, "run"), bound_stack(image, "fly")

    machine = start_painted(board, image)
    assert machine.call("run") == 0
    seen = high_water_bytes(machine)
    assert seen <= report.bytes
    returns_early = any(frame.function == "fold_nulls" for frame in report.path)  # what it calls does
    assert returns_early or report.bytes <= seen + UNTOUCHED_BYTES

    machine = start_painted(board, image)
    fly(machine, image, 60)
    seen = high_water_bytes(machine)
    assert seen <= step.bytes <= seen + UNTOUCHED_BYTES

    known = gcc_frames(tmp_path)
    frames = {name.rpartition(":")[2]: size for name, size in report.frames.items()}
    assert len(frames.keys() & known.keys()) >= 4
    assert all(known.get(name, size) == size for name, size in frames.items())


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("board", "scalar"),
    [
        pytest.param(*case, marks=[] if case == ("crazyflie", "float64") else pytest.mark.long)
        for case in itertools.product(CORES, ("float64", "fixed"))
        if case != ("mega", "float64")  # avr-gcc's double has 32 bits
    ],
)
def test_other_scalar_types_have_a_bound(board: str, scalar: str, tmp_path: Path) -> None:
    """The analysis covers the compiler's helpers, including those with their own calling convention."""
    image = load(link_controller(board, tmp_path, scalar=scalar))
    machine = start_painted(board, image)
    assert machine.call("run") == 0
    assert 0 <= bound_stack(image, "run").bytes - high_water_bytes(machine) <= UNTOUCHED_BYTES


SHAPES = """
#define NOINLINE __attribute__((noinline))
volatile int seen;
int leaf(void) { return seen; }
NOINLINE int last(int *of) { volatile int a[10]; a[seen] = *of; return a[1] + seen; }
NOINLINE int thin(int of) { volatile int a[2]; a[seen] = of; of = last(&of); return a[1] + of; }
NOINLINE int thick(int of) { volatile int a[40]; a[seen] = of; of = last(&of); return a[2] + of; }
int chain(void) { return thick(3) + seen; }
int diamond(void) { return thin(1) + thick(2) + seen; }
NOINLINE int deep(int of) { volatile int a[50]; a[seen] = of; return a[1]; }
int tail(void) { volatile int a[5]; a[seen] = 2; return deep(a[1]); }
int wide(void) { volatile long a[3000]; a[seen] = 3; return a[seen + 1]; }
"""
"""Basic shapes of call graphs, and a frame too large for an immediate."""
SWITCH = "".join(f"case {n}: seen = {n * n * 7 % 13}; return {n * n % 11};" for n in range(20))
UNBOUNDED = f"""
#define NOINLINE __attribute__((noinline))
volatile int seen;
int (*volatile hook)(void);
int array(void) {{ volatile int a[seen]; a[0] = 1; return a[seen]; }}
int recursion(void);
NOINLINE int other(int n) {{ seen = n; return n ? recursion() * n : 1; }}
NOINLINE int recursion(void) {{ return other(seen) + 1; }}
int pointer(void) {{ return hook() + 1; }}
int tail(void) {{ return hook(); }}
int table(void) {{ switch (seen) {{ {SWITCH} }} return seen; }}
"""
REFUSALS = {
    "array": r"program\.elf: array: `(.*sp.*|out 0x3d, r\d+)` at 0x1.* known only at run time; alloca",
    "recursion": r"recursion -> other -> recursion is recursive",
    "pointer": r"pointer: `.*((jalr|blx) .*|eicall)` at 0x1.* only at run time; call functions directly",
    "tail": r"tail: `.*((jr|bx|blx) .*|eijmp)` at 0x1.* only at run time; call functions directly",
    "table": r"(table|__tablejump2__): `.*` at 0x1.* compile with -fno-jump-tables",
}
"""Functions of UNBOUNDED, and what the error says: function, instruction and remedy."""


@pytest.mark.first_is_quick
@pytest.mark.parametrize("board", CORES)
def test_the_bound_of_a_small_program_follows_its_call_graph(board: str, tmp_path: Path) -> None:
    """Paths and frames are those of the source, and frames equal gcc's."""
    entries = ("leaf", "chain", "diamond", "tail", "wide")
    image = load(link(board, SHAPES, tmp_path, "-fstack-usage", keep=entries))
    known = gcc_frames(tmp_path)
    leaf, chain, diamond, tail, wide = (bound_stack(image, entry) for entry in entries)

    assert leaf.bytes == (3 if board == "mega" else 0)  # AVR's return address
    assert chain.path == tuple(Frame(name, known[name]) for name in ("chain", "thick", "last"))
    assert chain.bytes == sum(frame.bytes for frame in chain.path) == chain.depths["chain"]
    # of two paths to the same function the deeper one counts; the other has its depth
    assert [frame.function for frame in diamond.path] == ["diamond", "thick", "last"]
    assert diamond.depths["thin"] == diamond.frames["thin"] + diamond.frames["last"]
    assert diamond.bytes == diamond.frames["diamond"] + diamond.depths["thick"]
    # constants are propagated through registers to the stack pointer
    assert wide.bytes == known["wide"] >= 12000
    if board not in {"rp2040", "mega"}:  # where gcc makes no tail calls
        assert tail.path == (Frame("tail", 0), Frame("deep", tail.frames["deep"]))
        assert tail.bytes == tail.frames["deep"] > tail.frames["tail"] > 0


@pytest.mark.parametrize("board", CORES)
def test_a_program_without_a_bound_is_refused(board: str, tmp_path: Path) -> None:
    """The error names the function, the instruction and a remedy."""
    image = load(link(board, UNBOUNDED, tmp_path, "-fno-tree-switch-conversion", keep=tuple(REFUSALS)))
    for entry, message in REFUSALS.items():
        with pytest.raises(FootprintError, match=message):
            bound_stack(image, entry)


@pytest.mark.parametrize(
    ("board", "assembly", "message"),
    [
        ("crazyflie", "1: push {r0}; b 1b", r"run: `.*` at 0x.* growing stack: a loop"),
        ("crazyflie", "push {r4, lr}; bx lr", r"run: `bx lr` at 0x.* returns without restoring the stack"),
        ("mambo", "mov r4, lr; mov lr, pc; b other; mov pc, r4", r"run: `bx lr` at 0x1.* known only at run"),
        ("mega", "mov r0, r16 $ mov r17, r0 $ ret", r"run: `ret` at 0x.* returns without restoring"),
    ],
    ids=[
        "a loop that pushes",
        "a return to another place",
        "a jump with a changed link register",
        "a register that holds what another held",
    ],
)
def test_assembly_without_a_bound_is_refused(board: str, assembly: str, message: str, tmp_path: Path) -> None:
    """The error names function, instruction and reason."""
    text = f"""
__attribute__((noinline)) int other(int of) {{ return of * 3; }}
__attribute__((naked)) int run(void) {{ __asm("{assembly}"); }}
"""
    with pytest.raises(FootprintError, match=message):
        bound_stack(load(link(board, text, tmp_path)), "run")


def test_a_byte_may_wait_in_the_other_half_of_a_pair(tmp_path: Path) -> None:
    """Without optimisation avr-gcc keeps r17 in r0 while it counts a shift in it."""
    text = '__attribute__((naked)) int run(void) { __asm("mov r0, r17 $ ldi r17, 3 $ mov r17, r0 $ ret"); }'
    assert bound_stack(load(link("mega", text, tmp_path)), "run").bytes == 3


def test_thumb_code_calls_a32_helpers_through_veneers(tmp_path: Path) -> None:
    """`bx pc` switches to A32 at a known address."""
    image = load(link_controller("mambo", tmp_path, "-mthumb"))
    assert "____aeabi_fcmplt_from_thumb" in bound_stack(image, "run").frames


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
    report = bound_stack(load(link("rp2040", text, tmp_path)), "run")
    assert report.frames["first"] == 8 + 24
    assert report.frames["second"] == 8 + 24


def test_callers_are_named(tmp_path: Path) -> None:
    """Every direct caller of a function is listed, tail calls included."""
    image = load(link("crazyflie", SHAPES, tmp_path, keep=("chain", "diamond", "tail")))
    callers = find_callers(image)
    assert callers["last"] == ("thin", "thick")
    assert set(callers["thick"]) == {"chain", "diamond"}
    assert callers["deep"] == ("tail",)


def test_other_processors_are_refused(tmp_path: Path) -> None:
    """The code of an x86-64 program cannot be disassembled, so its stack has no bound."""
    require("gcc", "gcc")
    (tmp_path / "host.c").write_text("int run(void) { return 1; }")
    Toolchain(("gcc",)).run(["-static", "-nostdlib", "-Wl,-e,run", "host.c", "-o", "host.elf"], tmp_path)
    with pytest.raises(FootprintError, match=r"host\.elf: cannot disassemble code for .*, only ARM, AVR and"):
        bound_stack(load(tmp_path / "host.elf"), "run")


def test_an_unknown_entry_is_refused(tmp_path: Path) -> None:
    """The error names the missing function."""
    image = load(link("crazyflie", "int run(void) { return 1; }", tmp_path))
    with pytest.raises(FootprintError, match="no function or object nmpc_step"):
        bound_stack(image, "nmpc_step")
