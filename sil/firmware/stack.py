"""Bound the stack of a function: the deepest way down the call graph of the linked program.

Every path through a function is followed from its first instruction, with the stack pointer and the registers
as far as they are known. What cannot be followed - recursion, a call or a jump to a place that only run time
knows, a stack pointer that depends on data - is refused, never guessed. One thing is taken on trust: nobody
writes through a pointer over a register that the function has saved on its stack.
"""

from collections import defaultdict
from dataclasses import dataclass
from typing import Final, NoReturn

from mambo_nmpc.sil.firmware.disassembly import Disassembly, disassemble
from mambo_nmpc.sil.firmware.elf import Image
from mambo_nmpc.sil.firmware.instructions import SP, Instruction, Put
from mambo_nmpc.sil.firmware.knowledge import Knowledge, Value

_MOST_DEPTHS: Final = 32
"""Depths of the stack at one instruction, from which on a loop is taken to grow it."""


@dataclass(frozen=True)
class Frame:
    """The bytes that a function holds while the next one runs; of the last function, all it ever holds."""

    function: str
    bytes: int


@dataclass(frozen=True)
class StackReport:
    """The worst case of `entry`: `bytes` below the stack pointer that it is called with.

    Its own frame counts, and in that its return address: where it saves it on ARM and RISC-V, whose calls
    leave it in a register; always on AVR, whose calls push it. Interrupts come on top.

    `path` is a way down to `bytes`, its frames add up to it. `frames` has the most that each reachable
    function ever holds itself, `depths` the same with all that it calls.
    """

    entry: str
    bytes: int
    path: tuple[Frame, ...]
    frames: dict[str, int]
    depths: dict[str, int]


def worst_case(image: Image, entry: str) -> StackReport:
    """Bound the stack of the function `entry`.

    Raises FootprintError, naming function and instruction, for what has no provable bound.
    """
    walks = _reachable(image, disassemble(image), image.symbol(entry).address)
    depths: dict[int, int] = {}
    for address in _callees_first(image, walks):
        walk = walks[address]
        depths[address] = max([walk.frame, *(held + depths[callee] for callee, held in walk.calls.items())])
    start = next(iter(walks))
    return StackReport(
        entry=image.name_of(start),
        bytes=depths[start],
        path=_deepest(image, walks, depths, start),
        frames={image.name_of(address): walk.frame for address, walk in walks.items()},
        depths={image.name_of(address): depths[address] for address in walks},
    )


def direct_callers(image: Image) -> dict[str, tuple[str, ...]]:
    """Name, for each function, those that call it or jump to it by its address, in order of address."""
    callers: dict[str, dict[str, None]] = defaultdict(dict)
    for instruction in disassemble(image).instructions.values():
        if instruction.target is not None:
            caller = image.name_of(instruction.address).partition("+")[0]
            callers[image.name_of(instruction.target)][caller] = None
    return {callee: tuple(sites) for callee, sites in callers.items()}


@dataclass(frozen=True)
class _Walk:
    """The most bytes that a function holds, and the most it holds at its calls, by address of the callee."""

    frame: int
    calls: dict[int, int]


def _reachable(image: Image, code: Disassembly, entry: int) -> dict[int, _Walk]:
    walks: dict[int, _Walk] = {}
    waiting = [entry]
    while waiting:
        address = waiting.pop()
        if address not in walks:
            walks[address] = _Walker(image, code, address).walked()
            waiting += walks[address].calls
    return walks


def _callees_first(image: Image, walks: dict[int, _Walk]) -> list[int]:
    """Order functions so that each comes after all it calls; refuses recursion."""
    order: list[int] = []
    active: list[int] = []

    def visit(address: int) -> None:
        if address in active:
            cycle = [*active[active.index(address) :], address]
            names = " -> ".join(image.name_of(function) for function in cycle)
            raise image.error(f"{names} is recursive: its stack has no bound; use a loop")
        if address not in order:
            active.append(address)
            for callee in walks[address].calls:
                visit(callee)
            active.pop()
            order.append(address)

    visit(next(iter(walks)))
    return order


def _deepest(
    image: Image, walks: dict[int, _Walk], depths: dict[int, int], address: int
) -> tuple[Frame, ...]:
    name, walk = image.name_of(address), walks[address]
    for callee, held in walk.calls.items():
        if held + depths[callee] == depths[address]:
            return (Frame(name, held), *_deepest(image, walks, depths, callee))
    return (Frame(name, walk.frame),)


class _Walker:
    """Follows every path through one function, and through the code of others that it jumps into."""

    def __init__(self, image: Image, code: Disassembly, function: int) -> None:
        self._image, self._code, self._function = image, code, function
        self._functions = {symbol.address for symbol in image.symbols if symbol.kind == "function"}
        self._preserved = self._preserved_by(function)
        self._known: dict[int, dict[int, Knowledge]] = defaultdict(dict)
        self._waiting: list[tuple[int, int]] = []
        self._frame = code.convention.return_bytes
        self._calls: dict[int, int] = {}

    def walked(self) -> _Walk:
        """Return what the function holds, itself and at its calls."""
        self._arrive(self._function, Knowledge.on_entry(self._code.convention))
        while self._waiting:
            address, depth = self._waiting.pop()
            self._step(self._at(address), self._known[address][depth])
        return _Walk(self._frame, self._calls)

    def _at(self, address: int) -> Instruction:
        instruction = self._code.instructions.get(address)
        if instruction is None:
            function, place = self._image.name_of(self._function), self._image.name_of(address)
            raise self._image.error(f"{function} runs into {place}, where no instruction can be read")
        return instruction

    def _arrive(self, address: int, knowledge: Knowledge) -> None:
        """Follow a path on to `address`, unless nothing new is known there; depths are kept apart."""
        here, depth = self._known[address], knowledge.depth
        before = here.get(depth)
        here[depth] = before.common(knowledge) if before else knowledge
        if here[depth] != before:
            self._waiting.append((address, depth))
        if len(here) > _MOST_DEPTHS:
            self._refuse(
                self._at(address), "is reached with ever more stack: a loop that grows it has no bound"
            )

    def _step(self, instruction: Instruction, before: Knowledge) -> None:
        following = instruction.address + instruction.size_bytes
        if instruction.conditional:
            self._arrive(following, before)
        after = before
        for effect in instruction.effects:
            after = after.after(effect, self._image)
            if not after.knows_depth:
                self._refuse(
                    instruction,
                    "moves the stack pointer to where only run time knows; "
                    "alloca and arrays of variable length have no bound",
                )
            self._frame = max(self._frame, after.depth)
        target, after = after.departed()
        if instruction.flow == "jump":
            self._jump(instruction, target, after)
        elif instruction.flow == "call":
            self._call(self._place(instruction, target), following, after)
        elif instruction.flow == "next":
            self._arrive(following, after)

    def _jump(self, instruction: Instruction, target: Value | None, after: Knowledge) -> None:
        """Return, call a function as the last act, or go on elsewhere."""
        convention = self._code.convention
        finished = after.unchanged(SP, *self._preserved)
        if target == Value(convention.link, 0):
            if not finished:
                self._refuse(instruction, "returns without the stack pointer and registers that it came with")
            return
        place = self._place(instruction, target)
        other = place in self._functions - {self._function} and self._preserved <= self._preserved_by(place)
        if finished and after.unchanged(convention.link) and other:
            self._note(place, 0)
        else:
            self._arrive(place, after)

    def _call(self, place: int, following: int, after: Knowledge) -> None:
        """Call a function; a call into the midst of one is a jump, for what is there may not come back."""
        convention = self._code.convention
        if place in self._functions:
            self._note(place, after.depth)
            self._arrive(following, after.after_call(self._preserved_by(place)))
        else:
            for effect in (Put(convention.link, None, following), Put(SP, SP, -convention.return_bytes)):
                after = after.after(effect, self._image)
            self._arrive(place, after)

    def _preserved_by(self, function: int) -> frozenset[str]:
        return self._code.convention.preserved_by(self._image.name_of(function))

    def _note(self, callee: int, held: int) -> None:
        self._calls[callee] = max(held, self._calls.get(callee, 0))

    def _place(self, instruction: Instruction, target: Value | None) -> int:
        """Return the address of a target that is known before run time."""
        if target is None or target.register is not None:
            self._refuse(
                instruction,
                "goes to where only run time knows; "
                "call functions by name, and compile with -fno-jump-tables",
            )
        return target.offset % 2**32 & ~1

    def _refuse(self, instruction: Instruction, reason: str) -> NoReturn:
        function = self._image.name_of(self._function)
        raise self._image.error(f"{function}: `{instruction.text}` at {instruction.address:#x} {reason}")
