"""Read sections and symbols of a linked program (ELF); no byte belongs to two symbols."""

import bisect
import itertools
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, Literal

from elftools.common.exceptions import ELFError
from elftools.elf.constants import SH_FLAGS
from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

from mambo_codegen.errors import MamboNmpcError

_ARM: Final = "EM_ARM"
_KINDS: Final[dict[str, Literal["function", "object"]]] = {"STT_FUNC": "function", "STT_OBJECT": "object"}


class FootprintError(MamboNmpcError):
    """A program cannot be measured, or its stack bound cannot be proven."""


@dataclass(frozen=True)
class ElfSection:
    """An allocated section; `contents` is empty if it is zero-initialised."""

    name: str
    address: int
    size_bytes: int
    in_flash: bool
    in_ram: bool
    executable: bool
    contents: bytes = field(repr=False)


@dataclass(frozen=True)
class Symbol:
    """A function or object; its bytes end where the next symbol begins.

    `name` is unique in its program; `aliases` are the other labels at the same address. `file` is the source
    file of a local symbol, None for a global one.
    """

    name: str
    aliases: tuple[str, ...]
    address: int
    size_bytes: int
    section: str
    kind: Literal["function", "object"]
    file: str | None

    @property
    def labels(self) -> tuple[str, ...]:
        """Name and aliases."""
        return (self.name, *self.aliases)


@dataclass(frozen=True)
class Image:
    """A linked program; `machine` is e_machine of its ELF header.

    `modes` are the ARM mapping symbols: addresses where A32 (a), Thumb (t) or data (d) begins.
    """

    path: Path
    machine: str
    address_bits: int
    sections: tuple[ElfSection, ...]
    symbols: tuple[Symbol, ...]
    modes: tuple[tuple[int, str], ...]

    def error(self, problem: str) -> FootprintError:
        """Return a FootprintError that names this program."""
        return FootprintError(f"{self.path.name}: {problem}")

    def symbol(self, label: str) -> Symbol:
        """Return the symbol named `label`; raises FootprintError if there is none."""
        for symbol in self.symbols:
            if label in symbol.labels:
                return symbol
        raise self.error(f"no function or object {label}; not linked, or removed by --gc-sections?")

    def name_of(self, address: int) -> str:
        """Return an address of code as function, or as function+offset."""
        index = bisect.bisect(self.symbols, address, key=lambda symbol: symbol.address) - 1
        if index < 0:
            return f"{address:#x}"
        symbol = self.symbols[index]
        return symbol.name if symbol.address == address else f"{symbol.name}+{address - symbol.address:#x}"

    def constant(self, address: int) -> int | None:
        """Return the little-endian 32-bit word at `address` in read-only memory; None elsewhere."""
        for section in self.sections:
            start = address - section.address
            if not section.in_ram and 0 <= start <= len(section.contents) - 4:
                return int.from_bytes(section.contents[start : start + 4], "little")
        return None


def load(path: Path) -> Image:
    """Read a little-endian program, statically linked to fixed addresses, not stripped.

    Raises FootprintError for any other file.
    """
    try:
        with path.open("rb") as stream:
            return _read_image(path, ELFFile(stream))
    except OSError as error:
        raise FootprintError(f"{path}: cannot be read: {error.strerror}") from error
    except ELFError as error:
        raise FootprintError(f"{path.name}: not a program in ELF format: {error}") from error


def _read_image(path: Path, elf: ELFFile) -> Image:
    if elf.header["e_type"] != "ET_EXEC" or elf.get_section_by_name(".dynamic"):
        raise FootprintError(f"{path.name}: not linked to fixed addresses; link with -static -no-pie")
    if not elf.little_endian:
        raise FootprintError(f"{path.name}: big-endian programs cannot be measured")
    table = elf.get_section_by_name(".symtab")
    if not isinstance(table, SymbolTableSection):
        raise FootprintError(f"{path.name}: has no symbols; measure it before it is stripped")
    machine = str(elf.header["e_machine"])
    sections = {
        index: ElfSection(
            name=section.name,
            address=section["sh_addr"],
            size_bytes=section["sh_size"],
            in_flash=section["sh_type"] != "SHT_NOBITS",
            in_ram=bool(section["sh_flags"] & SH_FLAGS.SHF_WRITE),
            executable=bool(section["sh_flags"] & SH_FLAGS.SHF_EXECINSTR),
            contents=b"" if section["sh_type"] == "SHT_NOBITS" else section.data(),
        )
        for index, section in enumerate(elf.iter_sections())
        if section["sh_flags"] & SH_FLAGS.SHF_ALLOC and section["sh_size"]
    }
    symbols = [
        symbol
        for index, section in sections.items()
        for symbol in _merge_labels(_labels(table, section, index, machine), section)
    ]
    modes = {
        (symbol["st_value"], symbol.name[1])
        for symbol in table.iter_symbols()
        if machine == _ARM and symbol.name[:2] in {"$a", "$t", "$d"} and symbol["st_shndx"] in sections
    }
    return Image(
        path=path,
        machine=machine,
        address_bits=elf.elfclass,
        sections=tuple(sections.values()),
        symbols=_make_names_unique(symbols),
        modes=tuple(sorted(modes)),
    )


def _labels(table: SymbolTableSection, section: ElfSection, index: int, machine: str) -> Iterator[Symbol]:
    """Yield functions, objects, and untyped labels in code, which hand-written assembly has."""
    file = None
    for symbol in table.iter_symbols():
        kind = symbol["st_info"]["type"]
        if kind == "STT_FILE":
            file = symbol.name
        if kind == "STT_NOTYPE" and section.executable:
            kind = "STT_FUNC"
        if symbol["st_shndx"] == index and kind in _KINDS and not symbol.name.startswith("$"):
            thumb = machine == _ARM and kind == "STT_FUNC"
            yield Symbol(
                name=symbol.name,
                aliases=(),
                address=symbol["st_value"] & ~1 if thumb else symbol["st_value"],
                size_bytes=symbol["st_size"],
                section=section.name,
                kind=_KINDS[kind],
                file=file if symbol["st_info"]["bind"] == "STB_LOCAL" else None,
            )


def _merge_labels(labels: Iterable[Symbol], section: ElfSection) -> Iterator[Symbol]:
    """Yield one symbol for each address; it ends at the next label, or before, where all stated sizes end."""
    places: dict[int, list[Symbol]] = defaultdict(list)
    for label in labels:
        places[label.address].append(label)
    covered = 0
    section_end = section.address + section.size_bytes
    starts = sorted(start for start in places if start < section_end)
    for start, end in itertools.pairwise([*starts, section_end]):
        here = sorted(places[start], key=lambda label: (label.file is not None, len(label.name), label.name))
        stated = max(label.size_bytes for label in here)
        covered = max(covered, start + stated if stated else end)
        aliases = tuple(label.name for label in here[1:])
        yield replace(here[0], aliases=aliases, size_bytes=min(covered, end) - start)


def _make_names_unique(symbols: list[Symbol]) -> tuple[Symbol, ...]:
    """Return the symbols by address; names used twice get their file as prefix, or else their address."""
    by_address = sorted(symbols, key=lambda symbol: symbol.address)
    used = Counter(symbol.name for symbol in by_address)
    in_files = [replace(s, name=f"{s.file}:{s.name}") if used[s.name] > 1 else s for s in by_address]
    used = Counter(symbol.name for symbol in in_files)
    return tuple(replace(s, name=f"{s.name}@{s.address:#x}") if used[s.name] > 1 else s for s in in_files)
