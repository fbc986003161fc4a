"""Bound the worst-case stack of a function: the deepest path through the call graph of the linked program.

An abstract interpretation of the machine code follows every path through a function and keeps the symbolic
values of stack pointer and registers. Recursion, calls and jumps to addresses known only at run time, and a
stack pointer that depends on data raise FootprintError; nothing is estimated. The analysis assumes that no
store through a pointer overwrites a register saved on the stack.
"""

from collections import defaultdict
from dataclasses import dataclass
from typing import Final, NoReturn

from mambo_sil.board.firmware.abstract_state import AbstractState, SymbolicValue
from mambo_sil.board.firmware.disassembly import Disassembly, disassemble
from mambo_sil.board.firmware.elf import Image
from mambo_sil.board.firmware.instructions import SP, Assign, Instruction

_MAX_DEPTHS: Final = 32
"""Distinct stack depths at one instruction; more than these mean that a loop grows the stack."""


@dataclass(frozen=True)
class Frame:
    """Bytes that a function holds while it calls the next on the path; for the last, its largest frame."""

    function: str
    bytes: int


@dataclass(frozen=True)
class StackReport:
    """Worst-case stack of a function: `bytes` below its stack pointer at the call, without interrupts.

    The return address counts where it is stored: on ARM and RISC-V if a function saves its link register, on
    AVR always, since calls push it. The frames of `path`, one deepest call path, add up to `bytes`. By
    function, `frames` has its own largest frame in bytes and `depths` that frame with everything it calls.
    """

    bytes: int
    path: tuple[Frame, ...]
    frames: dict[str, int]
    depths: dict[str, int]


def bound_stack(image: Image, entry: str) -> StackReport:
    """Bound the stack of the function `entry`.

    Raises FootprintError, which names function and instruction, if no bound can be proven.
    """
    code = disassemble(image)
    uses: dict[int, _FunctionAnalysis] = {}
    depths: dict[int, int] = {}
    active: list[int] = []

    def depth_of(function: int) -> int:
        if function in active:
            cycle = [*active[active.index(function) :], function]
            names = " -> ".join(image.name_of(address) for address in cycle)
            raise image.error(f"{names} is recursive and has no stack bound; use a loop")
        if function not in depths:
            active.append(function)
            use = uses[function] = _FunctionAnalysis(image, code, function)
            use.analyse()
            calls = (held + depth_of(callee) for callee, held in use.calls.items())
            depths[function] = max([use.frame, *calls])
            active.pop()
        return depths[function]

    start = image.symbol(entry).address
    return StackReport(
        bytes=depth_of(start),
        path=_find_deepest_path(image, uses, depths, start),
        frames={image.name_of(address): use.frame for address, use in uses.items()},
        depths={image.name_of(address): depths[address] for address in uses},
    )


def find_callers(image: Image) -> dict[str, tuple[str, ...]]:
    """Return the functions that call or jump to each function directly, in order of address."""
    callers: dict[str, dict[str, None]] = defaultdict(dict)
    for instruction in disassemble(image).instructions.values():
        if instruction.target is not None:
            caller = image.name_of(instruction.address).partition("+")[0]
            callers[image.name_of(instruction.target)][caller] = None
    return {callee: tuple(sites) for callee, sites in callers.items()}


def _find_deepest_path(
    image: Image, uses: dict[int, "_FunctionAnalysis"], depths: dict[int, int], address: int
) -> tuple[Frame, ...]:
    name, use = image.name_of(address), uses[address]
    for callee, held in use.calls.items():
        if held + depths[callee] == depths[address]:
            return (Frame(name, held), *_find_deepest_path(image, uses, depths, callee))
    return (Frame(name, use.frame),)


class _FunctionAnalysis:
    """Abstract interpretation of one function, and of shared code that it jumps into.

    `frame` is the largest frame in bytes; `calls` the bytes held at calls, by address of the callee.
    """

    def __init__(self, image: Image, code: Disassembly, function: int) -> None:
        self._image, self._code, self._function = image, code, function
        self._functions = {symbol.address for symbol in image.symbols if symbol.kind == "function"}
        self._preserved = self._find_preserved(function)
        self._states: dict[int, dict[int, AbstractState]] = defaultdict(dict)
        self._waiting: list[tuple[int, int]] = []
        self.frame = code.convention.return_bytes
        self.calls: dict[int, int] = {}

    def analyse(self) -> None:
        """Propagate states along every path until a fixed point."""
        self._propagate(self._function, AbstractState.at_entry(self._code.convention))
        while self._waiting:
            address, depth = self._waiting.pop()
            self._execute(self._instruction_at(address), self._states[address][depth])

    def _instruction_at(self, address: int) -> Instruction:
        instruction = self._code.instructions.get(address)
        if instruction is None:
            function, place = self._image.name_of(self._function), self._image.name_of(address)
            raise self._image.error(f"{function} runs into {place}, where no instruction can be decoded")
        return instruction

    def _propagate(self, address: int, state: AbstractState) -> None:
        """Join `state` into those at `address`, one for each stack depth; queue the address if it changed."""
        here, depth = self._states[address], state.depth
        before = here.get(depth)
        here[depth] = before.join(state) if before else state
        if here[depth] != before:
            self._waiting.append((address, depth))
        if len(here) > _MAX_DEPTHS:
            self._refuse(
                self._instruction_at(address),
                "is reached with a growing stack: a loop that pushes has no bound",
            )

    def _execute(self, instruction: Instruction, before: AbstractState) -> None:
        following = instruction.address + instruction.size_bytes
        if instruction.conditional:
            self._propagate(following, before)
        after = before
        for effect in instruction.effects:
            after = after.apply(effect, self._image)
            if not after.knows_depth:
                self._refuse(
                    instruction,
                    "sets the stack pointer to a value known only at run time; "
                    "alloca and variable-length arrays have no bound",
                )
            self.frame = max(self.frame, after.depth)
        target, after = after.split_target()
        if instruction.flow == "jump":
            self._jump(instruction, target, after)
        elif instruction.flow == "call":
            self._call(self._resolve(instruction, target), following, after)
        elif instruction.flow == "next":
            self._propagate(following, after)

    def _jump(self, instruction: Instruction, target: SymbolicValue | None, after: AbstractState) -> None:
        """Handle a jump: a return, a tail call, or a branch."""
        convention = self._code.convention
        finished = after.holds_entry_values(SP, *self._preserved)
        if target == SymbolicValue(convention.link, 0):
            if not finished:
                self._refuse(instruction, "returns without restoring the stack pointer and saved registers")
            return
        target_address = self._resolve(instruction, target)
        is_other = target_address in self._functions - {self._function}
        if (
            is_other
            and finished
            and after.holds_entry_values(convention.link)
            and self._preserved <= self._find_preserved(target_address)
        ):
            self._record_call(target_address, 0)
        else:
            self._propagate(target_address, after)

    def _call(self, target_address: int, following: int, after: AbstractState) -> None:
        """Handle a call. A target inside a function is treated as a jump, since it need not return."""
        convention = self._code.convention
        if target_address in self._functions:
            self._record_call(target_address, after.depth)
            self._propagate(following, after.apply_call(self._find_preserved(target_address)))
        else:
            for effect in (
                Assign(convention.link, None, following),
                Assign(SP, SP, -convention.return_bytes),
            ):
                after = after.apply(effect, self._image)
            self._propagate(target_address, after)

    def _find_preserved(self, function: int) -> frozenset[str]:
        """Return the registers that a function restores."""
        convention = self._code.convention
        return convention.preserved - convention.exceptions.get(self._image.name_of(function), frozenset())

    def _record_call(self, callee: int, held: int) -> None:
        self.calls[callee] = max(held, self.calls.get(callee, 0))

    def _resolve(self, instruction: Instruction, target: SymbolicValue | None) -> int:
        """Return the address of a jump or call target; raises FootprintError if it is not constant."""
        if target is None or target.register is not None:
            self._refuse(
                instruction,
                "jumps to an address known only at run time; "
                "call functions directly, and compile with -fno-jump-tables",
            )
        return target.offset % 2**32 & ~1

    def _refuse(self, instruction: Instruction, reason: str) -> NoReturn:
        function = self._image.name_of(self._function)
        raise self._image.error(f"{function}: `{instruction.text}` at {instruction.address:#x} {reason}")
