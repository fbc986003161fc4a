"""Effects of AVR instructions, decoded by avr-objdump (DS40002198; avr-gcc, calling convention).

A register pair holds a 16-bit value, the even register its lower byte. The analysis stores the 16-bit value
for each register; two bytes form a known stack pointer only if they are halves of the same value.
"""

import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from mambo_sil.board.firmware.elf import Image
from mambo_sil.board.firmware.instructions import (
    PC,
    SP,
    Assign,
    Clobber,
    Convention,
    CopySaved,
    Effect,
    Flow,
    Instruction,
    JoinHalves,
    Load,
    Store,
)

DISASSEMBLER: Final = "avr-objdump"
_RETURN: Final = "return address"
_EXCEPTIONS: Final = {"__muldi3_6": frozenset({"r28", "r29"})}
"""Subroutine of libgcc's 64-bit multiplication, which writes registers of its caller (lib1funcs.S)."""
_SP_HIGH: Final = "sp, upper byte"

_THREE_BYTE_PC: Final = {"6", "106", "107"}
"""GCC's AVR architectures with more than 128 KiB of flash, whose return addresses have three bytes."""

_ARCHITECTURE: Final = re.compile(r"^architecture: avr:(\d+)", re.MULTILINE)
_LINE: Final = re.compile(r"^ *([0-9a-f]+):\t((?:[0-9a-f]{2} )+) *\t(\S+)(?:\t([^;\n]*))?", re.MULTILINE)
_PLACE: Final = re.compile(r"(-?)([XYZ])(\+?)(\d*)")

_POINTERS: Final = {"X": 26, "Y": 28, "Z": 30}
_SKIPS: Final = frozenset({"cpse", "sbrc", "sbrs", "sbic", "sbis"})
_BRANCH: Final = re.compile(r"br\w\w")
_NO_EFFECT: Final = re.compile(r"cp|cpc|cpi|(cl|se)[cnzvshti]|bst|sts|sbi|cbi|nop|break|wdr|sleep")
"""Instructions that change no register: comparisons, flags, stores to fixed addresses."""
_CLOBBERING: Final = frozenset(
    {"adc", "add", "and", "andi", "asr", "bld", "com", "dec", "eor", "in", "inc", "ldi", "lds", "lsr", "neg"}
    | {"or", "ori", "ror", "sbc", "sbci", "sub", "subi", "swap"}
)
"""Instructions that write a value unknown to the analysis into their first operand."""


@dataclass(frozen=True)
class Line:
    """One instruction as avr-objdump prints it."""

    address: int
    size_bytes: int
    mnemonic: str
    operands: tuple[str, ...]

    @property
    def text(self) -> str:
        """Mnemonic and operands."""
        return f"{self.mnemonic} {', '.join(self.operands)}".strip()

    @property
    def next_address(self) -> int:
        """Address of the instruction behind it."""
        return self.address + self.size_bytes


def disassemble(image: Image) -> tuple[dict[int, Instruction], Convention]:
    """Return the instructions of a program by address, and its calling convention.

    Raises FootprintError, which names the Debian package, if avr-objdump is missing.
    """
    text = _objdump(image)
    architecture = _ARCHITECTURE.search(text)
    return_bytes = 3 if architecture and architecture[1] in _THREE_BYTE_PC else 2
    lines = _lines(text)
    instructions = {one.address: one for one in _instructions(lines, return_bytes)}
    preserved = {_RETURN, *(f"r{index}" for index in (*range(2, 18), 28, 29))}
    convention = Convention(_RETURN, frozenset(preserved), 1, return_bytes, _EXCEPTIONS)
    return instructions, convention


def _lines(text: str) -> list[Line]:
    return [
        Line(int(address, 16), len(code.split()), mnemonic, _operands(operands))
        for address, code, mnemonic, operands in _LINE.findall(text)
    ]


def _objdump(image: Image) -> str:
    command = shutil.which(DISASSEMBLER)
    if command is None:
        raise image.error(f"{DISASSEMBLER}, which decodes AVR code, is missing (Debian: binutils-avr)")
    done = subprocess.run(
        [command, "-f", "-d", "-z", str(image.path)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        env=os.environ | {"LC_ALL": "C"},
        check=False,
    )
    if done.returncode != 0:
        raise image.error(f"{DISASSEMBLER} cannot decode its code: {done.stderr.strip()}")
    return done.stdout


def _operands(text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(",") if word.strip())


def _instructions(lines: list[Line], return_bytes: int) -> Iterator[Instruction]:
    """Yield the instructions; a 16-bit subtraction (subi, sbci) becomes one, so no jump can split it."""
    at = {line.address: line for line in lines}
    merged = None
    for line in lines:
        after = at.get(line.next_address)
        if line is merged:
            continue
        if after and (subtracted := _match_subtraction(line, after)):
            low, value = subtracted
            text, size = f"{line.text}; {after.text}", line.size_bytes + after.size_bytes
            yield Instruction(line.address, size, text, _add_to_pair(low, -value))
            merged = after
            continue
        effects = _effects(line, return_bytes)
        flow: Flow = "next"
        conditional = line.mnemonic in _SKIPS or _BRANCH.fullmatch(line.mnemonic) is not None
        if line.mnemonic in _SKIPS:
            effects, flow = ((Assign(PC, None, after.next_address),) if after else (Clobber(PC),)), "jump"
        elif conditional or line.mnemonic in {"rjmp", "jmp", "ijmp", "eijmp", "ret"}:
            flow = "jump"
        elif line.mnemonic in {"rcall", "call", "icall", "eicall"} and line.operands != (".+0",):
            flow = "call"
        if effects is not None:
            yield Instruction(line.address, line.size_bytes, line.text, effects, flow, conditional)


def _match_subtraction(line: Line, after: Line) -> tuple[int, int] | None:
    """Return lower register and signed value if two lines subtract a 16-bit constant from a pair.

    GCC keeps zero in r1 where `sbc` uses it.
    """
    match line.mnemonic, after.mnemonic, after.operands:
        case "subi", "sbci", (register, upper):
            value = int(line.operands[1], 0) + 256 * int(upper, 0)
        case "subi", "sbc", (register, "r1"):
            value = int(line.operands[1], 0)
        case _:
            return None
    low, high = _number(line.operands[0]), _number(register)
    return (low, (value + 2**15) % 2**16 - 2**15) if low % 2 == 0 and high == low + 1 else None


def _effects(line: Line, return_bytes: int) -> tuple[Effect, ...] | None:  # noqa: C901, PLR0911, PLR0912 - one table
    """Model changes of stack pointer, registers and program counter; None if the mnemonic is unknown."""
    mnemonic, operands = line.mnemonic, line.operands
    match mnemonic, operands:
        case "ret", _:
            return (Assign(PC, _RETURN, 0),)
        case (("ijmp" | "eijmp" | "icall" | "eicall"), _):
            return (Clobber(PC),)
        case "rcall", (".+0",):  # GCC allocates a small frame this way
            return (Assign(SP, SP, -return_bytes), *(Store(None, SP, 1 + i) for i in range(return_bytes)))
        case (("rcall" | "rjmp"), (target,)):
            return (Assign(PC, None, line.next_address + int(target[1:])),)
        case (("call" | "jmp"), (target,)):
            return (Assign(PC, None, int(target, 16)),)
        case _, (target,) if _BRANCH.fullmatch(mnemonic):
            return (Assign(PC, None, line.next_address + int(target[1:])),)
        case "push", (register,):
            return (Assign(SP, SP, -1), Store(register, SP, 1))
        case "pop", (register,):
            return (Load(register, SP, 1), Assign(SP, SP, 1))
        case "in", (register, (("0x3d" | "0x3e") as port)):  # SPL, SPH
            return (Assign(register, SP, 0) if _is_half(register, port) else Clobber(register),)
        case "out", ("0x3e", register):
            return (Assign(_SP_HIGH, register, 0) if _is_half(register, "0x3e") else Clobber(_SP_HIGH),)
        case "out", ("0x3d", register):
            moved = JoinHalves(SP, _SP_HIGH, register) if _is_half(register, "0x3d") else Clobber(SP)
            return (moved, Clobber(_SP_HIGH))
        case "movw", (register, source):
            low, base = _number(register), _number(source)
            return (Assign(f"r{low}", f"r{base}", 0), Assign(f"r{low + 1}", f"r{base + 1}", 0))
        case "mov", (register, source):
            same_half = _number(register) % 2 == _number(source) % 2
            return (Assign(register, source, 0) if same_half else CopySaved(register, source),)
        case (("adiw" | "sbiw"), (register, value)):
            return _add_to_pair(_number(register), int(value, 0) if mnemonic == "adiw" else -int(value, 0))
        case (("ld" | "ldd"), (register, place)):
            return _access_indirect(Load, place, register)
        case (("st" | "std"), (place, register)):
            return _access_indirect(Store, place, register)
        case "sts", (place, _) if int(place, 16) in {0x5D, 0x5E}:  # SPL, SPH in data space
            return (Clobber(SP),)
        case (("lpm" | "elpm"), _):
            register, place = operands or ("r0", "Z")
            return (Clobber(register), *(_add_to_pair(_POINTERS["Z"], 1) if place == "Z+" else ()))
        case _, (register, *_) if mnemonic in _CLOBBERING:
            return (Clobber(register),)
        case _, _ if "mul" in mnemonic:
            return (Clobber("r0"), Clobber("r1"))
    return () if _NO_EFFECT.fullmatch(mnemonic) or mnemonic == "out" else None


def _number(register: str) -> int:
    return int(register[1:])


def _add_to_pair(low: int, value: int) -> tuple[Effect, ...]:
    """Add a constant to a register pair."""
    return tuple(Assign(f"r{index}", f"r{index}", value) for index in (low, low + 1))


def _is_half(register: str, port: str) -> bool:
    """Say whether a register has the parity of the half of the stack pointer at `port`."""
    return _number(register) % 2 == (0 if port == "0x3d" else 1)


def _access_indirect(access: type[Load | Store], place: str, register: str) -> tuple[Effect, ...]:
    """Model an indirect load or store through X, Y or Z, with pre-decrement or post-increment."""
    match = _PLACE.fullmatch(place)
    assert match is not None, place
    before, pair, plus, digits = match.groups()
    low = _POINTERS[pair]
    first = _add_to_pair(low, -1) if before else ()
    last = _add_to_pair(low, 1) if plus and not digits else ()
    return (*first, access(register, f"r{low}", int(digits or "0")), *last)
