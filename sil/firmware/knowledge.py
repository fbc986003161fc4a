"""What is known of registers and stack before an instruction, in terms of what they were on entry."""

from dataclasses import dataclass, replace
from typing import TypeVar

from mambo_nmpc.sil.firmware.elf import Image
from mambo_nmpc.sil.firmware.instructions import (
    PC,
    SP,
    Convention,
    Effect,
    Forget,
    Load,
    Put,
    Same,
    Store,
    Sum,
)

_Key = TypeVar("_Key", int, str)


@dataclass(frozen=True)
class Value:
    """What a register held when the function was entered, plus an offset; without a register, a constant."""

    register: str | None
    offset: int

    def plus(self, offset: int) -> "Value":
        """Add modulo 2^32, with a sign."""
        return Value(self.register, (self.offset + offset + 2**31) % 2**32 - 2**31)


@dataclass(frozen=True)
class Knowledge:
    """Registers by name, and words of the stack by their offset in bytes to the stack pointer on entry."""

    convention: Convention
    registers: dict[str, Value]
    words: dict[int, Value]

    @classmethod
    def on_entry(cls, convention: Convention) -> "Knowledge":
        """Every register that matters holds what it held on entry."""
        names = (SP, convention.link, *convention.preserved)
        return cls(convention, {name: Value(name, 0) for name in names}, {})

    @property
    def knows_depth(self) -> bool:
        """Say whether the stack pointer is a known distance from where it was on entry."""
        pointer = self.registers.get(SP)
        return pointer is not None and pointer.register == SP

    @property
    def depth(self) -> int:
        """Return the bytes held on the stack, the return address included where a call pushes it."""
        return self.convention.return_bytes - self.registers[SP].offset

    def unchanged(self, *names: str) -> bool:
        """Say whether registers hold what they held on entry."""
        return all(self.registers.get(name) == Value(name, 0) for name in names)

    def common(self, other: "Knowledge") -> "Knowledge":
        """Keep what holds on both of two paths."""
        return Knowledge(
            self.convention,
            dict(self.registers.items() & other.registers.items()),
            dict(self.words.items() & other.words.items()),
        )

    def after_call(self, preserved: frozenset[str]) -> "Knowledge":
        """Keep what a call preserves."""
        kept = preserved | {SP}
        return replace(self, registers={name: self.registers[name] for name in self.registers.keys() & kept})

    def departed(self) -> tuple[Value | None, "Knowledge"]:
        """Take out the program counter, where an instruction has put something there."""
        return self.registers.get(PC), replace(self, registers=_with(self.registers, PC, None))

    def after(self, effect: Effect, image: Image) -> "Knowledge":
        """Apply one effect."""
        match effect:
            case Store(source, base, offset):
                place = self._on_stack(base, offset)
                saved = self.registers.get(source) if source else None
                return self if place is None else replace(self, words=_with(self.words, place, saved))
            case Put(register, base, offset):
                origin = self._origin(base)
                value = origin.plus(offset) if origin else None
            case Sum(register, left, right, sign):
                value = self._sum(left, right, sign)
            case Load(register, base, offset):
                value = self._loaded(base, offset, image)
            case Same(register, first, second):
                one = self.registers.get(first)
                value = one if one == self.registers.get(second) else None
            case Forget(register):
                value = None
        return replace(self, registers=_with(self.registers, register, value))

    def _origin(self, base: str | None) -> Value | None:
        return Value(None, 0) if base is None else self.registers.get(base)

    def _sum(self, left: str, right: str, sign: int) -> Value | None:
        """Add or subtract a constant; the sum of two unknowns is unknown."""
        first, second = self.registers.get(left), self.registers.get(right)
        if first and second and second.register is None:
            return first.plus(sign * second.offset)
        if first and second and first.register is None and sign > 0:
            return second.plus(first.offset)
        return None

    def _loaded(self, base: str | None, offset: int, image: Image) -> Value | None:
        """Read a word of the stack, or of memory that nothing writes."""
        origin = self._origin(base)
        if origin is None:
            return None
        if origin.register is None:
            constant = image.constant((origin.offset + offset) % 2**32)
            return None if constant is None else Value(None, 0).plus(constant)
        place = None if base is None else self._on_stack(base, offset)
        return None if place is None else self.words.get(place)

    def _on_stack(self, base: str, offset: int) -> int | None:
        """Return where the word at base plus offset begins on the stack, if it is there."""
        value = self.registers.get(base)
        if value is None or value.register != SP:
            return None
        place = value.offset + offset
        return place - place % self.convention.word_bytes


def _with(known: dict[_Key, Value], key: _Key, value: Value | None) -> dict[_Key, Value]:
    """Return `known` with a value replaced, or removed where it is None."""
    others = {name: held for name, held in known.items() if name != key}
    return others if value is None else others | {key: value}
