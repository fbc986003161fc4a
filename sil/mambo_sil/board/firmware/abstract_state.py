"""Symbolic values of registers and stack slots before an instruction, relative to function entry."""

from dataclasses import dataclass, replace
from typing import TypeVar

from mambo_sil.board.firmware.elf import Image
from mambo_sil.board.firmware.instructions import (
    PC,
    SP,
    Add,
    Assign,
    Clobber,
    Convention,
    CopySaved,
    Effect,
    JoinHalves,
    Load,
    Store,
)

_Key = TypeVar("_Key", int, str)


@dataclass(frozen=True)
class SymbolicValue:
    """Value of a register at function entry plus `offset`; a constant if `register` is None."""

    register: str | None
    offset: int

    def add(self, offset: int) -> "SymbolicValue":
        """Add `offset` in two's complement of 32 bits."""
        return SymbolicValue(self.register, (self.offset + offset + 2**31) % 2**32 - 2**31)


@dataclass(frozen=True)
class AbstractState:
    """Known values of registers by name, and of stack slots by byte offset from the entry stack pointer."""

    convention: Convention
    registers: dict[str, SymbolicValue]
    slots: dict[int, SymbolicValue]

    @classmethod
    def at_entry(cls, convention: Convention) -> "AbstractState":
        """Return the state at function entry: stack pointer, link and preserved registers are unchanged."""
        names = (SP, convention.link, *convention.preserved)
        return cls(convention, {name: SymbolicValue(name, 0) for name in names}, {})

    @property
    def knows_depth(self) -> bool:
        """Say whether the stack pointer is its entry value plus a constant."""
        pointer = self.registers.get(SP)
        return pointer is not None and pointer.register == SP

    @property
    def depth(self) -> int:
        """Bytes on the stack, including the return address if calls push it."""
        return self.convention.return_bytes - self.registers[SP].offset

    def holds_entry_values(self, *names: str) -> bool:
        """Say whether all named registers hold their entry values."""
        return all(self.registers.get(name) == SymbolicValue(name, 0) for name in names)

    def join(self, other: "AbstractState") -> "AbstractState":
        """Return what holds in both states, where two paths meet."""
        return AbstractState(
            self.convention,
            dict(self.registers.items() & other.registers.items()),
            dict(self.slots.items() & other.slots.items()),
        )

    def apply_call(self, preserved: frozenset[str]) -> "AbstractState":
        """Return the state after a call that preserves the registers `preserved`."""
        kept = preserved | {SP}
        return replace(self, registers={name: self.registers[name] for name in self.registers.keys() & kept})

    def split_target(self) -> tuple[SymbolicValue | None, "AbstractState"]:
        """Return the value assigned to the program counter, None if unknown, and the state without it."""
        return self.registers.get(PC), replace(self, registers=_with(self.registers, PC, None))

    def apply(self, effect: Effect, image: Image) -> "AbstractState":
        """Return the state after one effect of an instruction."""
        match effect:
            case Store(source, base, offset):
                place = self._stack_offset(base, offset)
                saved = self.registers.get(source) if source else None
                return self if place is None else replace(self, slots=_with(self.slots, place, saved))
            case Assign(register, base, offset):
                origin = self._base_value(base)
                value = origin.add(offset) if origin else None
            case Add(register, left, right, sign):
                value = self._add(left, right, sign)
            case Load(register, base, offset):
                value = self._load(base, offset, image)
            case JoinHalves(register, first, second):
                one = self.registers.get(first)
                value = one if one == self.registers.get(second) else None
            case CopySaved(register, source):
                held = self.registers.get(source)
                is_saved = held and held.offset == 0 and held.register in self.convention.preserved
                value = held if is_saved else None
            case Clobber(register):
                value = None
        return replace(self, registers=_with(self.registers, register, value))

    def _base_value(self, base: str | None) -> SymbolicValue | None:
        return SymbolicValue(None, 0) if base is None else self.registers.get(base)

    def _add(self, left: str, right: str, sign: int) -> SymbolicValue | None:
        """Add or subtract; one of both must be a constant, otherwise the result is unknown."""
        first, second = self.registers.get(left), self.registers.get(right)
        if first and second and second.register is None:
            return first.add(sign * second.offset)
        if first and second and first.register is None and sign > 0:
            return second.add(first.offset)
        return None

    def _load(self, base: str | None, offset: int, image: Image) -> SymbolicValue | None:
        """Return the value of a stack slot or of constant memory, None if unknown."""
        origin = self._base_value(base)
        if origin is None:
            return None
        if origin.register is None:
            constant = image.constant((origin.offset + offset) % 2**32)
            return None if constant is None else SymbolicValue(None, 0).add(constant)
        place = None if base is None else self._stack_offset(base, offset)
        return None if place is None else self.slots.get(place)

    def _stack_offset(self, base: str, offset: int) -> int | None:
        """Return the slot at base plus offset, in bytes from the entry stack pointer; None if not there."""
        value = self.registers.get(base)
        if value is None or value.register != SP:
            return None
        place = value.offset + offset
        return place - place % self.convention.word_bytes


def _with(
    known: dict[_Key, SymbolicValue], key: _Key, value: SymbolicValue | None
) -> dict[_Key, SymbolicValue]:
    """Return a copy of `known` with `key` set to `value`, or removed if that is None."""
    others = {name: held for name, held in known.items() if name != key}
    return others if value is None else others | {key: value}
