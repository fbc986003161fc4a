"""Cycles of the instructions of a program, as the manuals of two cores give them, both without wait states.

Cortex-M4F: ARM DDI 0439D, tables 3-1 and 7-1, and section 3.3.2 on neighbouring loads and stores; Cortex-M0+:
ARM DDI 0484C, table 3-1.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from capstone import arm_const as arm

from mambo_sil.board.firmware.arm import ALWAYS
from mambo_sil.board.firmware.disassembly import decode_arm
from mambo_sil.board.firmware.elf import Image


class Cycles(NamedTuple):
    """Cycles without wait states: the fewest and the most that a manual allows, and what its table says."""

    fewest: int
    usual: int
    most: int

    def plus(self, other: "Cycles") -> "Cycles":
        """Return the sum."""
        return Cycles(self.fewest + other.fewest, self.usual + other.usual, self.most + other.most)


def exactly(cycles: int) -> Cycles:
    """Return the cycles of what the manual gives one number for."""
    return Cycles(cycles, cycles, cycles)


NONE: Final = exactly(0)


@dataclass(frozen=True)
class Timing:
    """Cycles of one instruction, with the delay of the one behind it; `taken` is added each time it jumps."""

    cycles: Cycles
    taken: Cycles


_LOADS: Final = {
    arm.ARM_INS_LDR,
    arm.ARM_INS_LDRB,
    arm.ARM_INS_LDRH,
    arm.ARM_INS_LDRSB,
    arm.ARM_INS_LDRSH,
    arm.ARM_INS_VLDR,
}
_STORES: Final = {arm.ARM_INS_STR, arm.ARM_INS_STRB, arm.ARM_INS_STRH, arm.ARM_INS_VSTR}
_DOUBLE: Final = {arm.ARM_INS_LDRD, arm.ARM_INS_STRD}
_ON_STACK: Final = {arm.ARM_INS_PUSH, arm.ARM_INS_POP, arm.ARM_INS_VPUSH, arm.ARM_INS_VPOP}
_MULTIPLE: Final = {
    arm.ARM_INS_LDM,
    arm.ARM_INS_LDMDB,
    arm.ARM_INS_STM,
    arm.ARM_INS_STMDB,
    arm.ARM_INS_VLDMIA,
    arm.ARM_INS_VLDMDB,
    arm.ARM_INS_VSTMIA,
    arm.ARM_INS_VSTMDB,
}
_MEMORY: Final = _LOADS | _STORES | _DOUBLE | _ON_STACK | _MULTIPLE

_MULTIPLY_ADD: Final = {
    arm.ARM_INS_VMLA,
    arm.ARM_INS_VMLS,
    arm.ARM_INS_VNMLA,
    arm.ARM_INS_VNMLS,
    arm.ARM_INS_VFMA,
    arm.ARM_INS_VFMS,
    arm.ARM_INS_VFNMA,
    arm.ARM_INS_VFNMS,
}
_LONG: Final = {arm.ARM_INS_VDIV, arm.ARM_INS_VSQRT}
_STALLING: Final = (
    _MULTIPLY_ADD
    | _LONG
    | {arm.ARM_INS_VADD, arm.ARM_INS_VSUB, arm.ARM_INS_VMUL, arm.ARM_INS_VNMUL}
    | {arm.ARM_INS_VCVT, arm.ARM_INS_VCVTR}
)
"""Floating-point arithmetic whose result is there a cycle later for the instruction behind it."""

_REFILL: Final = Cycles(1, 2, 3)
"""P of the Cortex-M4: cycles to refill the pipeline, 1 to 3 by width and alignment of the target."""
_FIXED_M4: Final[dict[int, Cycles]] = {
    **dict.fromkeys(_MULTIPLY_ADD, exactly(3)),
    **dict.fromkeys(_LONG, exactly(14)),
    **dict.fromkeys((arm.ARM_INS_SDIV, arm.ARM_INS_UDIV), Cycles(2, 7, 12)),
    **dict.fromkeys((arm.ARM_INS_TBB, arm.ARM_INS_TBH), exactly(2)),
    arm.ARM_INS_IT: Cycles(0, 1, 1),
}
"""Instructions with other than one cycle, besides loads, stores and moves between the register files."""


def cortex_m4(image: Image) -> dict[int, Timing]:
    """Return the timing of every instruction of a program on a Cortex-M4F, by address."""
    return dict(_timings(image, _cycles_m4, lambda _: _REFILL))


def cortex_m0plus(image: Image) -> dict[int, Timing]:
    """Return the timing of every instruction on a Cortex-M0+ whose multiplier takes one cycle, by address."""
    return dict(_timings(image, _cycles_m0plus, _taken_m0plus))


def _timings(
    image: Image, cycles: Callable[[Any, Any], Cycles], taken: Callable[[Any], Cycles]
) -> Iterator[tuple[int, Timing]]:
    """Yield address and timing; `cycles` gets each instruction and the one behind it, or None."""
    insns = list(decode_arm(image, lambda insn: insn, lambda insn: insn))
    for insn, after in zip(insns, [*insns[1:], None], strict=True):
        adjoins = after is not None and after.address == insn.address + insn.size
        yield insn.address, Timing(cycles(insn, after if adjoins else None), taken(insn))


def _cycles_m4(insn: Any, after: Any) -> Cycles:
    own = _own_cycles_m4(insn)
    if insn.cc not in ALWAYS:
        own = own._replace(fewest=min(1, own.fewest))  # it may be skipped
    return own if after is None else own.plus(_delay_m4(insn, after))


def _own_cycles_m4(insn: Any) -> Cycles:
    """Return the cycles of an instruction alone; a jump as if not taken."""
    if insn.id in _FIXED_M4:
        return _FIXED_M4[insn.id]
    if insn.id in _STORES:
        words = _words(insn.operands[:1])
        return Cycles(words, 1 + words, 1 + words)
    if insn.id in _LOADS:
        cycles = 1 + _words(insn.operands[:1])
        near = insn.operands[1].mem.base == arm.ARM_REG_PC  # "might add a cycle because of contention"
        return Cycles(cycles, cycles, cycles + near)
    if insn.id in _MEMORY:
        return exactly(1 + _words(_transferred(insn)))
    if insn.id == arm.ARM_INS_VMOV and any(_is_core(insn, operand) for operand in insn.operands):
        return exactly(2)
    return exactly(1)


def _delay_m4(insn: Any, after: Any) -> Cycles:
    """Return by how much `insn` delays the instruction behind it; negative if they overlap."""
    written = _names(insn, insn.regs_access()[1])
    if insn.id in _STALLING:
        factors = after.id in _MULTIPLY_ADD  # the addend is wanted a cycle later
        read = [operand.reg for operand in after.operands[1:]] if factors else after.regs_access()[0]
        return exactly(1) if written & _names(after, read) else NONE
    if after.id not in _MEMORY:
        return NONE
    depends = bool(written & _address_registers(after))
    if insn.id in _LOADS and after.id in _LOADS | _STORES:
        return NONE if depends else Cycles(-1, 0, 0)
    return exactly(1) if depends and insn.id not in _MEMORY else NONE


def _transferred(insn: Any) -> list[Any]:
    """Return the register operands that a multiple or double transfer loads or stores."""
    if insn.id in _DOUBLE:
        return list(insn.operands[:2])
    return list(insn.operands) if insn.id in _ON_STACK else list(insn.operands[1:])


def _words(operands: list[Any]) -> int:
    """Return the words in register operands: two in each of d0..d31."""
    return sum(2 if arm.ARM_REG_D0 <= operand.reg <= arm.ARM_REG_D31 else 1 for operand in operands)


def _is_core(insn: Any, operand: Any) -> bool:
    """Return whether an operand is a register of the core."""
    return operand.type == arm.ARM_OP_REG and insn.reg_name(operand.reg)[0] not in "sdq"


def _address_registers(insn: Any) -> set[str]:
    """Return the registers from which a load or store computes its address."""
    if insn.id in _ON_STACK:
        return {"sp"}
    if insn.id in _MULTIPLE:
        return {insn.reg_name(insn.operands[0].reg)}
    memory = next(operand.mem for operand in insn.operands if operand.type == arm.ARM_OP_MEM)
    return {insn.reg_name(register) for register in (memory.base, memory.index) if register}


def _names(insn: Any, registers: list[int]) -> set[str]:
    """Return the names of registers, a double register as the two single ones that it consists of."""
    names: set[str] = set()
    for register in registers:
        if arm.ARM_REG_D0 <= register < arm.ARM_REG_D0 + 16:
            first = 2 * (register - arm.ARM_REG_D0)
            names |= {f"s{first}", f"s{first + 1}"}
        else:
            names.add(insn.reg_name(register))
    return names


def _cycles_m0plus(insn: Any, _after: Any) -> Cycles:
    if insn.id in _LOADS | _STORES or insn.id == arm.ARM_INS_BL:
        return exactly(2)
    if insn.id in _MEMORY:
        return exactly(1 + _words(_transferred(insn)))
    return exactly(1)


def _taken_m0plus(insn: Any) -> Cycles:
    return exactly(2 if insn.id == arm.ARM_INS_POP else 1)
