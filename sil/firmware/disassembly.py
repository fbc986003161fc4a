"""Take the code of a program apart, instruction by instruction."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import capstone

from mambo_nmpc.sil.firmware import arm, avr, riscv
from mambo_nmpc.sil.firmware.elf import ElfSection, Image
from mambo_nmpc.sil.firmware.instructions import Convention, Instruction

_A32: Final = capstone.Cs(capstone.CS_ARCH_ARM, capstone.CS_MODE_ARM)
_THUMB: Final = capstone.Cs(capstone.CS_ARCH_ARM, capstone.CS_MODE_THUMB | capstone.CS_MODE_MCLASS)
_RISCV: Final = capstone.Cs(capstone.CS_ARCH_RISCV, capstone.CS_MODE_RISCV32 | capstone.CS_MODE_RISCVC)


@dataclass(frozen=True)
class Disassembly:
    """Every instruction of a program by its address, and the convention of its calls."""

    instructions: dict[int, Instruction]
    convention: Convention


def is_readable(image: Image) -> bool:
    """Say whether the code of a program can be taken apart here: ARM, AVR or 32-bit RISC-V."""
    return image.machine in {"EM_ARM", "EM_AVR", "EM_RISCV"} and image.address_bits == 32


def disassemble(image: Image) -> Disassembly:
    """Return the code of an ARM, AVR or 32-bit RISC-V program; raises FootprintError for other processors."""
    if not is_readable(image):
        name = image.machine.removeprefix("EM_")
        raise image.error(
            f"code for {name} cannot be read here, only ARM, AVR and 32-bit RISC-V; measure its sizes"
        )
    if image.machine == "EM_AVR":
        return Disassembly(*avr.disassembled(image))
    if image.machine == "EM_ARM":
        return Disassembly({instruction.address: instruction for instruction in _arm(image)}, arm.CONVENTION)
    return Disassembly({instruction.address: instruction for instruction in _riscv(image)}, riscv.CONVENTION)


def _arm(image: Image) -> Iterator[Instruction]:
    """Follow the mapping symbols, between which code is A32, Thumb or data (AAELF 2020Q2, 5.5.5)."""
    decoders = {
        "a": (_A32, partial(arm.instruction, thumb=False)),
        "t": (_THUMB, partial(arm.instruction, thumb=True)),
    }
    for section in image.sections:
        if section.executable:
            modes = [(at, mode) for at, mode in image.modes if 0 <= at - section.address < section.size_bytes]
            ends = [at for at, _ in modes[1:]] + [section.address + section.size_bytes]
            for (start, mode), end in zip(modes, ends, strict=True):
                if mode in decoders:
                    yield from _decoded(*decoders[mode], section, start, end)


def _riscv(image: Image) -> Iterator[Instruction]:
    """Start afresh at every symbol, so that data between functions cannot put the decoder out of step."""
    for section in image.sections:
        if section.executable:
            inside = {s.address for s in image.symbols if s.section == section.name}
            bounds = sorted(inside | {section.address, section.address + section.size_bytes})
            for start, end in itertools.pairwise(bounds):
                yield from _decoded(_RISCV, riscv.instruction, section, start, end)


def _decoded(
    decoder: capstone.Cs, meaning: Callable[[Any], Instruction], section: ElfSection, start: int, end: int
) -> Iterator[Instruction]:
    """Decode from `start` to `end`; halfwords that are no instruction are left out."""
    decoder.detail = True
    at = start
    while at < end:
        for insn in decoder.disasm(section.contents[at - section.address : end - section.address], at):
            yield meaning(insn)
            at = insn.address + insn.size
        at += 2
