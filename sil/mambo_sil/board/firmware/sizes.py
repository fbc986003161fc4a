"""Measure flash and static RAM of a program, and how much a controller adds to them."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from mambo_sil.board.firmware.elf import Image, Symbol, load

Part = Literal["own", "helpers", "grown"]
_PARTS: Final[tuple[Part, ...]] = ("own", "helpers", "grown")


@dataclass(frozen=True)
class SectionBytes:
    """Bytes by section; initialised variables count in RAM and, as initial values, in flash."""

    flash: dict[str, int]
    ram: dict[str, int]


@dataclass(frozen=True)
class Parts:
    """Bytes that a controller adds, by owner.

    `own`: the controller's symbols. `helpers`: other new symbols, such as the compiler's arithmetic.
    `grown`: change of symbols that both programs have, such as the caller. `unnamed`: bytes without a
    symbol: padding, strings, the compiler's constants.
    """

    own: int
    helpers: int
    grown: int
    unnamed: int

    @property
    def total(self) -> int:
        """Sum of the parts."""
        return self.own + self.helpers + self.grown + self.unnamed


@dataclass(frozen=True)
class Added:
    """Bytes that a controller adds to a program: by section, by owner, and by symbol."""

    sections: SectionBytes
    flash: Parts
    ram: Parts
    own: dict[str, int]
    helpers: dict[str, int]


def measure_sections(image: Image) -> SectionBytes:
    """Return the bytes of the sections in flash and in RAM.

    The section flags decide: read-only data counts as flash, wherever the linker script places it.
    """
    return SectionBytes(
        flash={section.name: section.size_bytes for section in image.sections if section.in_flash},
        ram={section.name: section.size_bytes for section in image.sections if section.in_ram},
    )


def measure_added(with_controller: Path, empty: Path, prefix: str) -> Added:
    """Compare a program with and without the controller, whose symbols and files begin with `prefix`.

    Raises FootprintError if a program cannot be read.
    """
    image, base = load(with_controller), load(empty)
    before, after = measure_sections(base), measure_sections(image)
    labels = frozenset(label for symbol in base.symbols for label in symbol.labels)
    parts = {part: [s for s in image.symbols if _classify(s, labels, prefix) == part] for part in _PARTS}
    return Added(
        sections=SectionBytes(_difference(after.flash, before.flash), _difference(after.ram, before.ram)),
        flash=_account(parts, base.symbols, before.flash, after.flash),
        ram=_account(parts, base.symbols, before.ram, after.ram),
        own={symbol.name: symbol.size_bytes for symbol in parts["own"]},
        helpers={symbol.name: symbol.size_bytes for symbol in parts["helpers"]},
    )


def _classify(symbol: Symbol, labels: frozenset[str], prefix: str) -> Part:
    """Return the owner of a symbol; a local one, such as a table, belongs to the owner of its file."""
    if labels.intersection(symbol.labels):
        return "grown"
    beginnings = (f"{prefix}_", f"{prefix}.c")
    return "own" if (symbol.file or symbol.name).startswith(beginnings) else "helpers"


def _account(
    parts: dict[Part, list[Symbol]],
    base: Iterable[Symbol],
    before: dict[str, int],
    after: dict[str, int],
) -> Parts:
    """Return the growth of one memory by owner, given its sections before and after."""
    own, helpers, shared = (_total(parts[part], after) for part in _PARTS)
    grown = shared - _total(base, before)
    difference = sum(after.values()) - sum(before.values())
    return Parts(own, helpers, grown, unnamed=difference - own - helpers - grown)


def _total(symbols: Iterable[Symbol], memory: dict[str, int]) -> int:
    return sum(symbol.size_bytes for symbol in symbols if symbol.section in memory)


def _difference(after: dict[str, int], before: dict[str, int]) -> dict[str, int]:
    """Return the difference of each section; a section absent from one program counts 0 there."""
    changes = Counter(after)
    changes.subtract(before)
    return {name: change for name, change in changes.items() if change}
