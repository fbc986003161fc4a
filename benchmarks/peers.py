"""Footprint of the peers' generated C on a Crazyflie, measured like ours, for one problem.

    python -m benchmarks.peers                          # the peers are installed beside us
    python -m benchmarks.peers --python DIR/bin/python  # the peers are installed elsewhere

Install the peers with `pip install osqp casadi cvxpygen` and `pip install --no-deps tinympc`, since below
Python 3.13 tinympc requires a SciPy that conflicts with the others and does not import it. Their C needs a C
library, newlib (Debian: libnewlib-arm-none-eabi and, for TinyMPC's C++, libstdc++-arm-none-eabi-newlib). The
row of a peer that cannot be generated or built states the reason.

`benchmarks/peers_setups.py` has the problem and the set-ups, docs/peers.md the results.
"""

import argparse
import filecmp
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

from benchmarks import peers_setups as problem
from benchmarks.markdown import table
from benchmarks.ours import bundle_program, peers_model
from benchmarks.peers_c import NotHereError, definitions, generate, run_tool, sources
from benchmarks.peers_programs import Program, programs
from mambo_nmpc.codegen import boards
from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.flags import COMPILE_FLAGS, WARNING_FLAGS
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.firmware.build import ENTRY, PREFIX, Builder, builder
from mambo_nmpc.sil.firmware.elf import FootprintError, Image, load
from mambo_nmpc.sil.firmware.gate import find_forbidden
from mambo_nmpc.sil.firmware.sizes import measure_added, measure_sections
from mambo_nmpc.sil.firmware.stack import bound_stack

_BOARD: Final = "crazyflie"
_VEHICLE: Final = "mambo"
"""The board with whose compiler and flags the C is compiled under -Wall -Werror."""
_C_ONLY: Final = ("-Wstrict-prototypes", "-Wmissing-prototypes", "-Wunsuffixed-float-constants")
_STRICT: Final = (*WARNING_FLAGS, "-Wunsuffixed-float-constants")
_NEWLIB: Final = (
    "-static",
    "-nostartfiles",
    "--specs=nano.specs",
    "--specs=nosys.specs",
    "-Wl,--gc-sections",
    "-Wl,--build-id=none",
    "-Wl,--defsym=__dso_handle=0",
)
"""The C library as the Crazyflie's firmware links it, without start-up code, whose __dso_handle C++ needs."""
_EMPTY: Final = "void run(void);\n\nvoid run(void)\n{\n}\n"
_CLOCK_S: Final = 1.1
"""Pause between two runs of a generator, so that a time of day in its output differs."""


@dataclass(frozen=True)
class _Row:
    """One row of the table; `absent` is the reason if nothing was measured."""

    title: str
    cost: str
    scalar: str
    versions: str = ""
    flash: int = 0
    flash_libraries: int = 0
    ram: int = 0
    stack: str = ""
    heap: str = ""
    double: int = 0
    libm_printf: str = ""
    vehicle: str = ""
    warnings: int = 0
    same: str = ""
    absent: str = ""


def _compiler(program: Program, command: str) -> str:
    """Return the compiler for the language of `program`, given the one for C."""
    return re.sub(r"gcc$", "g++", command) if program.language == "c++" else command


def _link(program: Program, found: Builder, folder: Path, work: Path) -> tuple[Path, Path, frozenset[str]]:
    """Link programs with and without the peer; returns both, and the symbols of the peer's objects."""
    compiler = _compiler(program, found.toolchain.command[0])
    dialect = [program.dialect, *COMPILE_FLAGS[1:]]
    suffix = "cpp" if program.language == "c++" else "c"
    flags = [*dialect, *found.board.compiler.flags, "-ffunction-sections", "-fdata-sections", "-fno-pie"]
    glue, empty = work / f"glue.{suffix}", work / "empty.c"
    glue.write_text(program.glue, "utf-8")
    empty.write_text(_EMPTY, "utf-8")
    objects: list[Path] = []
    for source in [*sources(program, folder), glue]:
        objects.append(work / f"{len(objects)}.o")
        _compile([compiler, *flags, *definitions(program, folder), "-c", str(source), "-o", str(objects[-1])])
    tail = [*_NEWLIB, f"-Wl,-e,{ENTRY},-u,{ENTRY}", "-lm", "-o"]
    with_peer, without = work / "program.elf", work / "empty.elf"
    _compile([compiler, *flags, *map(str, objects), *tail, str(with_peer)])
    _compile([found.toolchain.command[0], *flags[1:], str(empty), *tail, str(without)])
    return with_peer, without, frozenset(name for path in objects for name in _defined_symbols(path))


def _compile(line: list[str]) -> None:
    """Run the cross compiler; raises NotHereError with its first error."""
    done = subprocess.run(line, capture_output=True, text=True, errors="replace", check=False)
    if done.returncode:
        errors = [text for text in done.stderr.splitlines() if re.search("error|cannot find|undefined", text)]
        first = errors[0] if errors else done.stderr.partition("\n")[0]
        raise NotHereError(re.sub(r"^\S*/", "", first))


def _defined_symbols(path: Path) -> set[str]:
    """Return the symbols that an object file defines."""
    with path.open("rb") as stream:
        table = ELFFile(stream).get_section_by_name(".symtab")
        assert isinstance(table, SymbolTableSection)
        return {s.name for s in table.iter_symbols() if s.name and s["st_shndx"] != "SHN_UNDEF"}


def _measure_own_flash(image: Image, own: frozenset[str]) -> int:
    flash = measure_sections(image).flash
    return sum(s.size_bytes for s in image.symbols if s.section in flash and own.intersection(s.labels))


def _warnings(program: Program, compiler: str, flags: tuple[str, ...], folder: Path) -> int:
    """Count the distinct warnings under our own warning flags."""
    strict = [flag for flag in _STRICT if program.language == "c" or flag not in _C_ONLY]
    dialect = [program.dialect, *COMPILE_FLAGS[1:]]
    places = set()
    for source in sources(program, folder):
        line = [_compiler(program, compiler), *dialect, *flags, *strict, *definitions(program, folder)]
        line += ["-c", str(source), "-o", "/dev/null"]
        output = subprocess.run(line, capture_output=True, text=True, check=False).stderr
        places |= {text for text in output.splitlines() if ": warning: " in text}
    return len(places)


def _check_vehicle_flags(program: Program, folder: Path) -> str:
    """Say whether all sources compile with the Mambo's compiler and flags, -Wall and -Werror."""
    if program.language == "c++":
        return "no: C++"
    try:
        found = builder(boards.load(_VEHICLE), "-O2")
    except BuildError:
        return "no compiler here"
    refused = 0
    files = sources(program, folder)
    for source in files:
        line = [*found.toolchain.command, *found.board.compiler.flags, "-O2", "-Wall", "-Werror"]
        line += [*definitions(program, folder), "-c", str(source), "-o", "/dev/null"]
        refused += subprocess.run(line, capture_output=True, check=False).returncode != 0
    return "yes" if not refused else f"no: {refused} of {len(files)} files"


def _compare_runs(first: Path, second: Path) -> str:
    """Compare the output of two runs; count files that differ only in a time of day, and others."""
    names = sorted(
        {str(p.relative_to(folder)) for folder in (first, second) for p in folder.rglob("*") if p.is_file()}
    )
    _, unequal, missing = filecmp.cmpfiles(first, second, names, shallow=False)
    clock = [name for name in unequal if _timeless(first / name) == _timeless(second / name)]
    more = len(unequal) + len(missing) - len(clock)
    said = [f"time of day in {len(clock)}"] * bool(clock) + [f"more in {more}"] * bool(more)
    return f"no: {', '.join(said)} of {len(names)} files" if said else "yes"


def _timeless(path: Path) -> bytes:
    return re.sub(rb"\d\d:\d\d:\d\d", b"", path.read_bytes())


def _stack(image: Image) -> str:
    """Return the stack bound in bytes, or the function that has none."""
    try:
        return f"{bound_stack(image, ENTRY).bytes:,}"
    except FootprintError as error:
        return f"no bound: {str(error).removeprefix(f'{image.path.name}: ').partition(':')[0].split()[0]}"


def _measure(program: Program, python: str, found: Builder, work: Path) -> _Row:
    """Generate, build and measure one peer."""
    row = _Row(program.title, program.cost, program.scalar)
    first, folder = work / "first", work / "c"
    try:
        versions = generate(python, program, folder)
        folder.rename(first)
        time.sleep(_CLOCK_S)
        generate(python, program, folder)
        row = replace(row, versions=", ".join(f"{name} {version}" for name, version in versions.items()))
        elf, empty, own = _link(program, found, folder, work)
        sizes, image = measure_added(elf, empty, program.name), load(elf)
        return replace(
            row,
            flash=sizes.flash.total,
            flash_libraries=sizes.flash.total - _measure_own_flash(image, own),
            ram=sizes.ram.total,
            **_checks(program, image, found, first, folder),
        )
    except (NotHereError, BuildError) as error:
        return replace(row, absent=str(error))


def _checks(program: Program, image: Image, found: Builder, first: Path, folder: Path) -> dict[str, Any]:
    """Return the columns from stack to `same`, given the C of two runs in `first` and `folder`."""
    linked = find_forbidden(image, "float32")
    kinds = {one.kind for one in linked}
    return {
        "stack": _stack(image),
        "heap": "yes" if "heap" in kinds else "no",
        "double": sum(one.kind == "double precision" for one in linked),
        "libm_printf": " ".join(kind for kind in ("libm", "printf") if kind in kinds) or "-",
        "vehicle": _check_vehicle_flags(program, folder),
        "warnings": _warnings(program, found.toolchain.command[0], found.board.compiler.flags, folder),
        "same": _compare_runs(first, folder),
    }


def _ours(title: str, settings: Settings, found: Builder, work: Path) -> _Row:
    """Measure ours: the minimal firmware, and the same checks as for the peers."""
    files = render(settings)
    sizes = measure_added(found.firmware(files, work), found.firmware(files, work, empty=True), PREFIX)
    first, folder = work / "first", work / "c"
    settings_file = work / "controller.toml"
    settings_file.write_text(files["controller.toml"], "utf-8")
    line = [sys.executable, "-m", "mambo_nmpc", "generate", str(settings_file)]
    run_tool([*line, "-o", str(folder)])
    folder.rename(first)
    time.sleep(_CLOCK_S)
    run_tool([*line, "-o", str(folder)])
    program = bundle_program(title, settings)
    image = load(work / "firmware" / "program.elf")
    return _Row(
        title,
        program.cost,
        program.scalar,
        flash=sizes.flash.total,
        flash_libraries=sizes.flash.helpers,
        ram=sizes.ram.total,
        **_checks(program, image, found, first, folder),
    )


def _table(rows: list[_Row]) -> str:
    head = (
        *("generator", "cost", "scalar", "flash", "libraries", "RAM", "stack", "heap", "double helpers"),
        *("libm, printf", "Mambo's flags", "warnings", "same again"),
    )
    lines = []
    for r in rows:
        line = (r.title, r.cost, r.scalar)
        if r.absent:
            lines.append((*line, f"not measured: {r.absent}", *[""] * (len(head) - 4)))
            continue
        sizes = (f"{r.flash:,}", f"{r.flash_libraries:,}", f"{r.ram:,}", r.stack)
        checks = (r.heap, str(r.double), r.libm_printf, r.vehicle, f"{r.warnings:,}", r.same)
        lines.append((*line, *sizes, *checks))
    return table(head, lines)


def main() -> None:
    """Measure ours and every peer, and print one table and the versions."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--python", default=sys.executable, help="the Python that has the peers")
    parser.add_argument("--only", help="measure this peer alone")
    arguments = parser.parse_args()
    found = builder(boards.load(_BOARD), "-O2")
    rows = []
    with tempfile.TemporaryDirectory(prefix="mambo-nmpc-") as place:
        work = Path(place)
        every: dict[str, Callable[[Path], _Row]] = {
            "mambo": partial(_ours, "mambo-nmpc, preset mambo", presets.load("mambo"), found),
            "table1": partial(_ours, "mambo-nmpc, the peers' model", peers_model(), found),
        }
        for program in programs(*problem.literals()):
            every[program.name] = partial(_measure, program, arguments.python, found)
        for name, measure in every.items():
            if arguments.only in (None, name):
                (work / name).mkdir()
                rows.append(measure(work / name))
    print(f"{found.board.title}, {found.compiler}, -O2; bytes")
    print(_table(rows))
    print()
    for row in rows:
        if row.versions:
            print(f"{row.title}: {row.versions}")


if __name__ == "__main__":
    main()
