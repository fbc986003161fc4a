"""The minimum of one control step on a Crazyflie's core: ours beside solvers of others, on the same problem.

The problem is that of preset mambo: two free moves along each of two axes, within the tilt limit. All get the
same states and compute the gradient from them. `python -m benchmarks.peers.control_step` prints the table of
docs/evidence/peers.md: bytes of the linked programs, and instructions counted by emulation. The peers are
those of `make bench-peers`; their C needs newlib.
"""

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.markdown import table
from benchmarks.peers.programs import NotHereError, Program, run_tool
from benchmarks.peers.quadratic_times import SETTINGS, Array, contenders, state_sets
from mambo_codegen import boards
from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_sil.board.emulation.machine import start
from mambo_sil.board.firmware.elf import FootprintError, Image, load
from mambo_sil.board.firmware.firmware_build import ENTRY, Builder, builder
from mambo_sil.board.firmware.gate import find_forbidden
from mambo_sil.board.firmware.sizes import measure_added
from mambo_sil.board.firmware.stack import bound_stack

_BOARD: Final = "crazyflie"
_NEWLIB: Final = (
    "-static",
    "-nostartfiles",
    "--specs=nano.specs",
    "--specs=nosys.specs",
    "-Wl,--gc-sections",
    "-Wl,--build-id=none",
)
"""The C library as the Crazyflie's firmware links it, without start-up code."""
_EMPTY: Final = "void run(void);\n\nvoid run(void)\n{\n}\n"
_SETS: Final = {"far": "W", "near": "T", "flight": "C"}
"""Columns of the table, and the sets of states in docs/evidence/benchmarks.md."""
_COUNT: Final = 20
_TIME_LIMIT_S: Final = 10.0
"""Of one call, on this machine."""


@dataclass(frozen=True, eq=False)
class Measured:
    """One contender. Instructions (n,) and moves (n, 2) in m/step^2 are by column of the table."""

    title: str
    flash: int
    ram: int
    stack: str
    heap: bool
    instructions: dict[str, Array]
    moves: dict[str, Array]


def _link(program: Program, found: Builder, folder: Path, work: Path) -> tuple[Path, Path]:
    """Link programs with and without the contender."""
    compiler = [found.toolchain.command[0], *COMPILE_FLAGS[1:], *found.board.compiler.flags]
    line = [*compiler, "-ffunction-sections", "-fdata-sections", "-fno-pie"]
    objects = program.compile(line, folder, work)
    empty, with_it, without = work / "empty.c", work / "program.elf", work / "empty.elf"
    empty.write_text(_EMPTY, "utf-8")
    tail = [*_NEWLIB, f"-Wl,-e,{ENTRY},-u,{ENTRY}", "-lm", "-o"]
    run_tool([*line, *objects, *tail, str(with_it)])
    run_tool([*line, str(empty), *tail, str(without)])
    return with_it, without


def _stack(image: Image) -> str:
    """Return the stack bound in bytes, or that there is none."""
    try:
        return f"{bound_stack(image, ENTRY).bytes:,}"
    except FootprintError:
        return "no bound"


def _count(elf: Path, states: Array) -> tuple[Array, Array]:
    """Return the instructions (n,) of a call for each of `states` (n, 16), and the moves (n, 2).

    A call before them sets the solver up.
    """
    machine = start(elf, "cortex-m4", _TIME_LIMIT_S, counting=True)
    given, found = machine.arena.allocate(64), machine.arena.allocate(8)
    counts, moves = [], []
    for state in (states[0], *states):
        machine.write(given, state.tobytes())
        machine.take_executed()
        machine.call(ENTRY, given, found)
        counts.append(machine.take_executed().times.total())
        moves.append(np.frombuffer(machine.read(found, 8), np.float32))
    return np.array(counts[1:]), np.array(moves[1:])


def measure(program: Program, found: Builder, folder: Path, sets: dict[str, Array]) -> Measured:
    """Link a contender whose C is in `folder` and count `sets`, states (n, 2, 8) by column."""
    work = folder.with_name(f"{folder.name}-arm")
    work.mkdir()
    elf, empty = _link(program, found, folder, work)
    added, image = measure_added(elf, empty, program.name), load(elf)
    counted = {name: _count(elf, states.reshape(-1, 16)) for name, states in sets.items()}
    return Measured(
        program.title,
        added.flash.total,
        added.ram.total,
        _stack(image),
        any(one.kind == "heap" for one in find_forbidden(image, "float32")),
        {name: counts for name, (counts, _) in counted.items()},
        {name: moves for name, (_, moves) in counted.items()},
    )


def _row(one: Measured, ours: Measured) -> dict[str, str]:
    limits = Quadratic(SETTINGS).attitude.command_limit_m_step2
    ratios = [one.instructions[name].mean() / ours.instructions[name].mean() for name in _SETS]
    apart = max(np.abs((one.moves[name] - ours.moves[name]) / limits).max() for name in _SETS)
    return {
        "solver": one.title,
        "flash": f"{one.flash:,}",
        "RAM": f"{one.ram:,}",
        "stack": one.stack,
        "heap": "yes" if one.heap else "no",
        **{f"{name}, mean (most)": f"{n.mean():,.0f} ({n.max():,})" for name, n in one.instructions.items()},
        "over ours": "1" if one is ours else f"{min(ratios):,.0f} to {max(ratios):,.0f}",
        "apart": "-" if one is ours else f"{apart:.0e}",
    }


def main() -> None:
    """Measure ours and every peer, and print the table."""
    found = builder(boards.load(_BOARD), "-O2")
    drawn = state_sets()
    sets = {name: drawn[one][:_COUNT] for name, one in _SETS.items()}
    with tempfile.TemporaryDirectory(prefix="mambo-nmpc-") as place:
        try:
            programs = contenders(Path(place))
            measured = [measure(program, found, folder, sets) for program, folder in programs.values()]
        except NotHereError as error:
            sys.exit(str(error))
    ours = measured[0]
    print(table([_row(one, ours) for one in measured]))


if __name__ == "__main__":
    main()
