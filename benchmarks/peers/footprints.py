"""Footprint of the peers' generated C on a Crazyflie, measured like ours, for one problem.

`python -m benchmarks.peers.footprints` prints the table of docs/evidence/peers.md. The row of a peer that
cannot be generated or built states the reason. The peers are those of `make bench-peers`; their C needs
newlib.
"""

import re
import sys
import tempfile
from pathlib import Path
from typing import Final

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

from benchmarks.markdown import table
from benchmarks.peers.ours import ONE_NORM, PEERS_MODEL, Ours, bundle
from benchmarks.peers.programs import NotHereError, Program, run_tool
from benchmarks.peers.setups import DOUBLE, PEERS
from mambo_codegen import boards
from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.errors import BuildError
from mambo_sil.board.firmware.elf import FootprintError, Image, load
from mambo_sil.board.firmware.firmware_build import ENTRY, PREFIX, Builder, builder
from mambo_sil.board.firmware.gate import find_forbidden
from mambo_sil.board.firmware.sizes import measure_added, measure_sections
from mambo_sil.board.firmware.stack import bound_stack

_BOARD: Final = "crazyflie"
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


def _compiler(program: Program, found: Builder) -> list[str]:
    """Return the compiler for the language of `program`, with the flags of the board."""
    command = found.toolchain.command[0]
    if program.language == "c++":
        command = re.sub(r"gcc$", "g++", command)
    return [command, *COMPILE_FLAGS[1:], *found.board.compiler.flags]


def _link(program: Program, found: Builder, folder: Path, work: Path) -> tuple[Path, Path, set[str]]:
    """Link programs with and without the peer; returns both, and the symbols of the peer's objects."""
    compiler = _compiler(program, found)
    line = [*compiler, "-ffunction-sections", "-fdata-sections", "-fno-pie"]
    objects = program.compile(line, folder, work)
    empty, with_peer, without = work / "empty.c", work / "program.elf", work / "empty.elf"
    empty.write_text(_EMPTY, "utf-8")
    tail = [*_NEWLIB, f"-Wl,-e,{ENTRY},-u,{ENTRY}", "-lm", "-o"]
    run_tool([*line, *objects, *tail, str(with_peer)])
    run_tool([found.toolchain.command[0], *line[1:], str(empty), *tail, str(without)])
    return with_peer, without, {name for path in objects for name in _defined_symbols(Path(path))}


def _defined_symbols(path: Path) -> set[str]:
    """Return the symbols that an object file defines."""
    with path.open("rb") as stream:
        symbols = ELFFile(stream).get_section_by_name(".symtab")
        assert isinstance(symbols, SymbolTableSection)
        return {s.name for s in symbols.iter_symbols() if s.name and s["st_shndx"] != "SHN_UNDEF"}


def _sizes(program: Program, found: Builder, folder: Path, work: Path) -> tuple[Image, int, int, int]:
    """Link; returns the program, and bytes of flash, of flash in libraries and of RAM.

    Ours is linked without C library, by the minimal firmware.
    """
    if isinstance(program, Ours):
        files = render(program.settings)
        elf = found.firmware(files, work)
        added = measure_added(elf, found.firmware(files, work, empty=True), PREFIX)
        return load(elf), added.flash.total, added.flash.helpers, added.ram.total
    elf, empty, own = _link(program, found, folder, work)
    added, image = measure_added(elf, empty, program.name), load(elf)
    flash = measure_sections(image).flash
    own_bytes = sum(s.size_bytes for s in image.symbols if s.section in flash and own.intersection(s.labels))
    return image, added.flash.total, added.flash.total - own_bytes, added.ram.total


def _stack(image: Image) -> str:
    """Return the stack bound in bytes, or the function that has none."""
    try:
        return f"{bound_stack(image, ENTRY).bytes:,}"
    except FootprintError as error:
        return f"no bound: {str(error).removeprefix(f'{image.path.name}: ').partition(':')[0].split()[0]}"


def _generate(program: Program, folder: Path) -> dict[str, str]:
    """Generate the C as a user does, in a process of its own; returns the versions of the packages."""
    if not isinstance(program, Ours):
        return program.write(folder)
    settings = folder.with_name("controller.toml")
    settings.write_text(render(program.settings)["controller.toml"], "utf-8")
    run_tool([sys.executable, "-m", "mambo_nmpc", "generate", str(settings), "-o", str(folder)])
    return {}


def _measure(program: Program, found: Builder, work: Path) -> tuple[dict[str, str], dict[str, str]]:
    """Generate, build and measure; returns the row, and versions of packages."""
    row = {"generator": program.title, "cost": program.cost, "scalar": program.scalar}
    folder, versions = work / "c", {}
    try:
        versions = _generate(program, folder)
        image, flash, libraries, ram = _sizes(program, found, folder, work)
    except (NotHereError, BuildError) as error:
        return row | {"flash": f"not measured: {error}"}, versions
    kinds = [one.kind for one in find_forbidden(image, "float32")]
    row |= {
        "flash": f"{flash:,}",
        "libraries": f"{libraries:,}",
        "RAM": f"{ram:,}",
        "stack": _stack(image),
        "heap": "yes" if "heap" in kinds else "no",
        "double helpers": f"{kinds.count('double precision')}",
    }
    return row, versions


def main() -> None:
    """Measure ours and every peer, and print one table and the versions."""
    found = builder(boards.load(_BOARD), "-O2")
    programs = [
        bundle("mambo", "mambo-nmpc, mambo-1norm", ONE_NORM),
        bundle("table1", "mambo-nmpc, the peers' model", PEERS_MODEL),
        *(peer for peer in PEERS if not peer.name.endswith(DOUBLE)),
    ]
    rows = []
    with tempfile.TemporaryDirectory(prefix="mambo-nmpc-") as place:
        for program in programs:
            work = Path(place, program.name)
            work.mkdir()
            rows.append(_measure(program, found, work))
    print(f"{found.board.title}, {found.compiler}, -O2; bytes\n{table([row for row, _ in rows])}\n")
    for row, versions in rows:
        if versions:
            print(f"{row['generator']}: {', '.join(map(' '.join, versions.items()))}")


if __name__ == "__main__":
    main()
