"""Measure flash and static RAM, and what a controller adds to a program without one."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from mambo_nmpc.sil.firmware.elf import Image, Symbol, load

Part = Literal["own", "helpers", "grown"]
_PARTS: Final[tuple[Part, ...]] = ("own", "helpers", "grown")


@dataclass(frozen=True)
class SectionBytes:
    """Bytes by section. Initialised variables are in both: in RAM, and in flash to start from."""

    flash: dict[str, int]
    ram: dict[str, int]


@dataclass(frozen=True)
class Parts:
    """What an addition is made of, in bytes.

    `own` is the controller's; `helpers` whatever else was not there before, such as the compiler's
    arithmetic; `grown` what the rest gained or lost, such as the caller; `unnamed` belongs to no symbol:
    padding, strings and constants of the compiler.
    """

    own: int
    helpers: int
    grown: int
    unnamed: int

    @property
    def total(self) -> int:
        """All of it."""
        return self.own + self.helpers + self.grown + self.unnamed


@dataclass(frozen=True)
class Added:
    """What a controller adds to a program: by section, by part, and the bytes of each symbol by name."""

    sections: SectionBytes
    flash: Parts
    ram: Parts
    own: dict[str, int]
    helpers: dict[str, int]


def sections(image: Image) -> SectionBytes:
    """Return the sections of a program that take flash, and those that take RAM whenever it runs.

    The flags of a section decide: read-only data is flash, wherever a linker script may put it.
    """
    return SectionBytes(
        flash={section.name: section.size_bytes for section in image.sections if section.in_flash},
        ram={section.name: section.size_bytes for section in image.sections if section.in_ram},
    )


def added(with_controller: Path, empty: Path, prefix: str) -> Added:
    """Compare a program with the same without the controller, whose symbols and files begin with `prefix`.

    Raises FootprintError if one of them cannot be read.
    """
    image, base = load(with_controller), load(empty)
    before, after = sections(base), sections(image)
    labels = frozenset(label for symbol in base.symbols for label in symbol.labels)
    parts = {part: [s for s in image.symbols if _part(s, labels, prefix) == part] for part in _PARTS}
    return Added(
        sections=SectionBytes(_difference(after.flash, before.flash), _difference(after.ram, before.ram)),
        flash=_parts(parts, base.symbols, before.flash, after.flash),
        ram=_parts(parts, base.symbols, before.ram, after.ram),
        own={symbol.name: symbol.size_bytes for symbol in parts["own"]},
        helpers={symbol.name: symbol.size_bytes for symbol in parts["helpers"]},
    )


def _part(symbol: Symbol, labels: frozenset[str], prefix: str) -> Part:
    """Say whose a symbol is; what is local to a file, such as a table, belongs to the file."""
    if labels.intersection(symbol.labels):
        return "grown"
    beginnings = (f"{prefix}_", f"{prefix}.c")
    return "own" if (symbol.file or symbol.name).startswith(beginnings) else "helpers"


def _parts(
    parts: dict[Part, list[Symbol]],
    base: Iterable[Symbol],
    before: dict[str, int],
    after: dict[str, int],
) -> Parts:
    """Account for the difference of one memory, given its sections before and after."""
    own, helpers, shared = (_total(parts[part], after) for part in _PARTS)
    grown = shared - _total(base, before)
    difference = sum(after.values()) - sum(before.values())
    return Parts(own, helpers, grown, unnamed=difference - own - helpers - grown)


def _total(symbols: Iterable[Symbol], memory: dict[str, int]) -> int:
    return sum(symbol.size_bytes for symbol in symbols if symbol.section in memory)


def _difference(after: dict[str, int], before: dict[str, int]) -> dict[str, int]:
    """Subtract section by section, those included that only one program has; equal ones are left out."""
    names = dict.fromkeys([*after, *before])
    changes = {name: after.get(name, 0) - before.get(name, 0) for name in names}
    return {name: change for name, change in changes.items() if change}
