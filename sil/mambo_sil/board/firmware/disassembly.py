"""Disassemble the code of a linked program."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, TypeVar

import capstone

from mambo_sil.board.firmware import arm, avr, riscv
from mambo_sil.board.firmware.elf import ElfSection, Image
from mambo_sil.board.firmware.instructions import Convention, Instruction

T = TypeVar("T")

_A32: Final = capstone.Cs(capstone.CS_ARCH_ARM, capstone.CS_MODE_ARM)
_THUMB: Final = capstone.Cs(capstone.CS_ARCH_ARM, capstone.CS_MODE_THUMB | capstone.CS_MODE_MCLASS)
_RISCV: Final = capstone.Cs(capstone.CS_ARCH_RISCV, capstone.CS_MODE_RISCV32 | capstone.CS_MODE_RISCVC)


@dataclass(frozen=True)
class Disassembly:
    """Instructions of a program by address, and its calling convention."""

    instructions: dict[int, Instruction]
    convention: Convention


def is_readable(image: Image) -> bool:
    """Say whether `disassemble` supports the processor of a program: ARM, AVR or 32-bit RISC-V."""
    return image.machine in {"EM_ARM", "EM_AVR", "EM_RISCV"} and image.address_bits == 32


def disassemble(image: Image) -> Disassembly:
    """Disassemble an ARM, AVR or 32-bit RISC-V program; raises FootprintError for other processors."""
    if not is_readable(image):
        name = image.machine.removeprefix("EM_")
        raise image.error(
            f"cannot disassemble code for {name}, only ARM, AVR and 32-bit RISC-V; measure its sizes only"
        )
    if image.machine == "EM_AVR":
        return Disassembly(*avr.disassemble(image))
    if image.machine == "EM_ARM":
        meanings = (partial(arm.model_instruction, thumb=thumb) for thumb in (False, True))
        decoded, convention = decode_arm(image, *meanings), arm.CONVENTION
    else:
        decoded, convention = _decode_riscv(image), riscv.CONVENTION
    return Disassembly({instruction.address: instruction for instruction in decoded}, convention)


def decode_arm(image: Image, a32: Callable[[Any], T], thumb: Callable[[Any], T]) -> Iterator[T]:
    """Yield what `a32` or `thumb` returns for each of Capstone's instructions, by rising address.

    Decodes between mapping symbols, which mark A32, Thumb and data (AAELF 2020Q2, 5.5.5).
    """
    decoders = {"a": (_A32, a32), "t": (_THUMB, thumb)}
    for section in image.sections:
        if section.executable:
            modes = [(at, mode) for at, mode in image.modes if 0 <= at - section.address < section.size_bytes]
            ends = [at for at, _ in modes[1:]] + [section.address + section.size_bytes]
            for (start, mode), end in zip(modes, ends, strict=True):
                if mode in decoders:
                    yield from _decode(*decoders[mode], section, start, end)


def _decode_riscv(image: Image) -> Iterator[Instruction]:
    """Restart the decoder at every symbol, since data between functions can misalign it."""
    for section in image.sections:
        if section.executable:
            inside = {s.address for s in image.symbols if s.section == section.name}
            bounds = sorted(inside | {section.address, section.address + section.size_bytes})
            for start, end in itertools.pairwise(bounds):
                yield from _decode(_RISCV, riscv.model_instruction, section, start, end)


def _decode(
    decoder: capstone.Cs, meaning: Callable[[Any], T], section: ElfSection, start: int, end: int
) -> Iterator[T]:
    """Decode from `start` to `end`, skipping halfwords that are no instruction."""
    decoder.detail = True
    at = start
    while at < end:
        for insn in decoder.disasm(section.contents[at - section.address : end - section.address], at):
            yield meaning(insn)
            at = insn.address + insn.size
        at += 2
