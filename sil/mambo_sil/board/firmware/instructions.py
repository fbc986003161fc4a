"""Processor-independent effects of instructions on registers, stack and control flow, for the stack analysis.

The program counter is the register `pc`: jumps and calls assign their target to it. Registers without an
effect keep their value.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

PC: Final = "pc"
SP: Final = "sp"
WORD_BYTES: Final = 4


@dataclass(frozen=True)
class Assign:
    """register = base + offset; the constant `offset` if `base` is None."""

    register: str
    base: str | None
    offset: int


@dataclass(frozen=True)
class Add:
    """register = left + sign * right."""

    register: str
    left: str
    right: str
    sign: Literal[1, -1]


@dataclass(frozen=True)
class Load:
    """register = memory[base + offset]; memory[offset] if `base` is None."""

    register: str
    base: str | None
    offset: int


@dataclass(frozen=True)
class Store:
    """memory[base + offset] = register; an unknown value if `register` is None."""

    register: str | None
    base: str
    offset: int


@dataclass(frozen=True)
class JoinHalves:
    """register = the 16-bit value whose halves are in `first` and `second`; unknown if these differ."""

    register: str
    first: str
    second: str


@dataclass(frozen=True)
class CopySaved:
    """register = source if `source` holds what a preserved register held at entry; else unknown.

    So a byte may wait in the other half of a pair, where a part of a larger value would mean another one.
    """

    register: str
    source: str


@dataclass(frozen=True)
class Clobber:
    """The value of the register becomes unknown."""

    register: str


Effect = Assign | Add | Load | Store | JoinHalves | CopySaved | Clobber
Flow = Literal["next", "jump", "call", "stop"]
"""After the effects: continue, jump to `pc`, call `pc` and continue, or stop."""


@dataclass(frozen=True)
class Instruction:
    """One machine instruction; a conditional one may also be skipped, with all effects."""

    address: int
    size_bytes: int
    text: str
    effects: tuple[Effect, ...]
    flow: Flow = "next"
    conditional: bool = False

    @property
    def target(self) -> int | None:
        """Target address of a direct jump or call, else None."""
        for effect in self.effects:
            if isinstance(effect, Assign) and effect.register == PC and effect.base is None:
                return effect.offset
        return None


@dataclass(frozen=True)
class Convention:
    """Calling convention: the register `link` receives the return address, callees restore `preserved`.

    If a call pushes the return address, it takes `return_bytes`, and `link` is a pseudo-register that holds
    it. Registers are saved in stack slots of `word_bytes`. `exceptions` lists functions that change some of
    `preserved`, and which.
    """

    link: str
    preserved: frozenset[str]
    word_bytes: int = WORD_BYTES
    return_bytes: int = 0
    exceptions: Mapping[str, frozenset[str]] = field(default_factory=dict)
