"""What an instruction does to the stack pointer and to where the program goes, whatever the processor.

The program counter is a register like any other, `pc`: an instruction that jumps or calls puts its target
there. Registers that no effect names keep their value.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

PC: Final = "pc"
SP: Final = "sp"
WORD_BYTES: Final = 4


@dataclass(frozen=True)
class Put:
    """Register becomes base plus offset; without a base, the offset is a constant."""

    register: str
    base: str | None
    offset: int


@dataclass(frozen=True)
class Sum:
    """Register becomes left plus right, or left minus right where `sign` is -1."""

    register: str
    left: str
    right: str
    sign: Literal[1, -1]


@dataclass(frozen=True)
class Load:
    """Register becomes the word at base plus offset; without a base, the offset is the address."""

    register: str
    base: str | None
    offset: int


@dataclass(frozen=True)
class Store:
    """The word at base plus offset becomes what the register holds; without a register, anything."""

    register: str | None
    base: str
    offset: int


@dataclass(frozen=True)
class Same:
    """Register becomes what two others both hold, the halves of one value; anything if they differ."""

    register: str
    first: str
    second: str


@dataclass(frozen=True)
class Forget:
    """Register becomes anything."""

    register: str


Effect = Put | Sum | Load | Store | Same | Forget
Flow = Literal["next", "jump", "call", "stop"]
"""After the effects: go on, go to `pc`, call `pc` and go on, or end here."""


@dataclass(frozen=True)
class Instruction:
    """One instruction; a conditional one may also be skipped, effects and flow."""

    address: int
    size_bytes: int
    text: str
    effects: tuple[Effect, ...]
    flow: Flow = "next"
    conditional: bool = False

    @property
    def target(self) -> int | None:
        """Where it jumps to or what it calls, if it says so itself."""
        for effect in self.effects:
            if isinstance(effect, Put) and effect.register == PC and effect.base is None:
                return effect.offset
        return None


@dataclass(frozen=True)
class Convention:
    """The registers of a calling convention: where a call leaves the return address, what it preserves.

    Where a call itself pushes the return address, that takes `return_bytes`, and `link` names what is there
    as if it were a register. Registers are saved on the stack in places of `word_bytes`. `exceptions` names
    functions that change some of `preserved` all the same, and which.
    """

    link: str
    preserved: frozenset[str]
    word_bytes: int = WORD_BYTES
    return_bytes: int = 0
    exceptions: Mapping[str, frozenset[str]] = field(default_factory=dict)

    def preserved_by(self, function: str) -> frozenset[str]:
        """Return the registers that a function leaves as they were."""
        return self.preserved - self.exceptions.get(function, frozenset())
