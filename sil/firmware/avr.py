"""AVR instructions, as avr-objdump spells them, by their effects (DS40002198; avr-gcc, calling convention).

A pair of registers holds a value of 16 bits, the even one its lower byte. What is known of a byte is the
value that it belongs to: two bytes make a stack pointer only if they belong to the same one.
"""

import itertools
import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from mambo_nmpc.sil.firmware.elf import Image
from mambo_nmpc.sil.firmware.instructions import (
    PC,
    SP,
    Convention,
    Effect,
    Flow,
    Forget,
    Instruction,
    Load,
    Put,
    Same,
    Store,
)

_DISASSEMBLER: Final = "avr-objdump"
_RETURN: Final = "return address"
_EXCEPTIONS: Final = {"__muldi3_6": frozenset({"r28", "r29"})}
"""A part of libgcc's product of 64 bits, which adds into registers of its caller (lib1funcs.S)."""
_SP_HIGH: Final = "sp, upper byte"

_WIDE: Final = {"6", "106", "107"}
"""Architectures of GCC with more than 128 KiB of flash: there a return address takes three bytes."""

_ARCHITECTURE: Final = re.compile(r"^architecture: avr:(\d+)", re.MULTILINE)
_LINE: Final = re.compile(r"^ *([0-9a-f]+):\t((?:[0-9a-f]{2} )+) *\t(\S+)(?:\t([^;\n]*))?", re.MULTILINE)
_PLACE: Final = re.compile(r"(-?)([XYZ])(\+?)(\d*)")

_POINTERS: Final = {"X": 26, "Y": 28, "Z": 30}
_SKIPS: Final = frozenset({"cpse", "sbrc", "sbrs", "sbic", "sbis"})
_BRANCH: Final = re.compile(r"br\w\w")
_QUIET: Final = re.compile(r"cp|cpc|cpi|(cl|se)[cnzvshti]|bst|sts|sbi|cbi|nop|break|wdr|sleep")
"""They change no register: comparisons, flags, stores to fixed addresses."""
_WRITING: Final = frozenset(
    {"adc", "add", "and", "andi", "asr", "bld", "com", "dec", "eor", "in", "inc", "ldi", "lds", "lsr", "neg"}
    | {"or", "ori", "ror", "sbc", "sbci", "sub", "subi", "swap"}
)
"""They change their first register, to nothing that matters here."""


@dataclass(frozen=True)
class _Line:
    address: int
    size_bytes: int
    mnemonic: str
    operands: tuple[str, ...]

    @property
    def text(self) -> str:
        return f"{self.mnemonic} {', '.join(self.operands)}".strip()

    @property
    def following(self) -> int:
        return self.address + self.size_bytes


def disassembled(image: Image) -> tuple[dict[int, Instruction], Convention]:
    """Return the instructions of a program by address, and the convention of its calls.

    Raises FootprintError, naming the package, if there is no avr-objdump.
    """
    text = _objdump(image)
    architecture = _ARCHITECTURE.search(text)
    return_bytes = 3 if architecture and architecture[1] in _WIDE else 2
    lines = [
        _Line(int(address, 16), len(code.split()), mnemonic, _operands(operands))
        for address, code, mnemonic, operands in _LINE.findall(text)
    ]
    instructions = {one.address: one for one in _instructions(lines, return_bytes)}
    preserved = {_RETURN, *(f"r{index}" for index in (*range(2, 18), 28, 29))}
    convention = Convention(_RETURN, frozenset(preserved), 1, return_bytes, _EXCEPTIONS)
    return instructions, convention


def _objdump(image: Image) -> str:
    command = shutil.which(_DISASSEMBLER)
    if command is None:
        raise image.error(f"no {_DISASSEMBLER} to read its code; Debian's binutils-avr brings it")
    done = subprocess.run(
        [command, "-f", "-d", "-z", str(image.path)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        env=os.environ | {"LC_ALL": "C"},
        check=False,
    )
    if done.returncode != 0:
        raise image.error(f"{_DISASSEMBLER} cannot read its code: {done.stderr.strip()}")
    return done.stdout


def _operands(text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(",") if word.strip())


def _instructions(lines: list[_Line], return_bytes: int) -> Iterator[Instruction]:
    """Yield what the lines do; a subtraction from a pair is one, so that nothing jumps in between."""
    merged = False
    for line, beyond in itertools.zip_longest(lines, lines[1:]):
        after = beyond if beyond and beyond.address == line.following else None
        if merged:
            merged = False
            continue
        if after and (subtracted := _subtracted(line, after)):
            low, value = subtracted
            text, size = f"{line.text}; {after.text}", line.size_bytes + after.size_bytes
            yield Instruction(line.address, size, text, _moved(low, -value))
            merged = True
            continue
        effects = _effects(line, return_bytes)
        flow: Flow = "next"
        conditional = line.mnemonic in _SKIPS or _BRANCH.fullmatch(line.mnemonic) is not None
        if line.mnemonic in _SKIPS:
            effects, flow = ((Put(PC, None, after.following),) if after else (Forget(PC),)), "jump"
        elif conditional or line.mnemonic in {"rjmp", "jmp", "ijmp", "eijmp", "ret"}:
            flow = "jump"
        elif line.mnemonic in {"rcall", "call", "icall", "eicall"} and line.operands != (".+0",):
            flow = "call"
        if effects is not None:
            yield Instruction(line.address, line.size_bytes, line.text, effects, flow, conditional)


def _subtracted(line: _Line, after: _Line) -> tuple[int, int] | None:
    """Return the lower register and the value, with a sign, that two lines subtract from a pair.

    GCC keeps zero in r1 wherever it subtracts that.
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


def _effects(line: _Line, return_bytes: int) -> tuple[Effect, ...] | None:  # noqa: C901, PLR0911, PLR0912 - one table
    """Model what moves the stack pointer, saves a register or names a place; None for anything else."""
    mnemonic, operands = line.mnemonic, line.operands
    match mnemonic, operands:
        case "ret", _:
            return (Put(PC, _RETURN, 0),)
        case (("ijmp" | "eijmp" | "icall" | "eicall"), _):
            return (Forget(PC),)
        case "rcall", (".+0",):  # how gcc makes room for a return address or less
            return (Put(SP, SP, -return_bytes), *(Store(None, SP, 1 + i) for i in range(return_bytes)))
        case (("rcall" | "rjmp"), (target,)):
            return (Put(PC, None, line.following + int(target[1:])),)
        case (("call" | "jmp"), (target,)):
            return (Put(PC, None, int(target, 16)),)
        case _, (target,) if _BRANCH.fullmatch(mnemonic):
            return (Put(PC, None, line.following + int(target[1:])),)
        case "push", (register,):
            return (Put(SP, SP, -1), Store(register, SP, 1))
        case "pop", (register,):
            return (Load(register, SP, 1), Put(SP, SP, 1))
        case "in", (register, (("0x3d" | "0x3e") as port)):  # SPL, SPH
            return (Put(register, SP, 0) if _is_half(register, port) else Forget(register),)
        case "out", ("0x3e", register):
            return (Put(_SP_HIGH, register, 0) if _is_half(register, "0x3e") else Forget(_SP_HIGH),)
        case "out", ("0x3d", register):
            moved = Same(SP, _SP_HIGH, register) if _is_half(register, "0x3d") else Forget(SP)
            return (moved, Forget(_SP_HIGH))
        case "movw", (register, source):
            low, base = _number(register), _number(source)
            return (Put(f"r{low}", f"r{base}", 0), Put(f"r{low + 1}", f"r{base + 1}", 0))
        case "mov", (register, source):
            same_half = _number(register) % 2 == _number(source) % 2
            return (Put(register, source, 0) if same_half else Forget(register),)
        case (("adiw" | "sbiw"), (register, value)):
            return _moved(_number(register), int(value, 0) if mnemonic == "adiw" else -int(value, 0))
        case (("ld" | "ldd"), (register, place)):
            return _through(place, register, load=True)
        case (("st" | "std"), (place, register)):
            return _through(place, register, load=False)
        case "sts", (place, _) if int(place, 16) in {0x5D, 0x5E}:  # SPL, SPH once more
            return (Forget(SP),)
        case (("lpm" | "elpm"), _):
            register, place = operands or ("r0", "Z")
            return (Forget(register), *(_moved(_POINTERS["Z"], 1) if place == "Z+" else ()))
        case _, (register, *_) if mnemonic in _WRITING:
            return (Forget(register),)
        case _, _ if "mul" in mnemonic:
            return (Forget("r0"), Forget("r1"))
    return () if _QUIET.fullmatch(mnemonic) or mnemonic == "out" else None


def _number(register: str) -> int:
    return int(register[1:])


def _moved(low: int, value: int) -> tuple[Effect, ...]:
    """Add to a pair."""
    return tuple(Put(f"r{index}", f"r{index}", value) for index in (low, low + 1))


def _is_half(register: str, port: str) -> bool:
    """Say whether a register is in the place of the half of the stack pointer that `port` is."""
    return _number(register) % 2 == (0 if port == "0x3d" else 1)


def _through(place: str, register: str, *, load: bool) -> tuple[Effect, ...]:
    """Move a byte from or to where a pair points, which moves on before or after."""
    match = _PLACE.fullmatch(place)
    assert match is not None, place
    before, pair, plus, digits = match.groups()
    low, offset = _POINTERS[pair], int(digits or "0")
    access = Load(register, f"r{low}", offset) if load else Store(register, f"r{low}", offset)
    first = _moved(low, -1) if before else ()
    last = _moved(low, 1) if plus and not digits else ()
    return (*first, access, *last)
