"""Effects of A32 and Thumb instructions, decoded by Capstone (ARM DDI 0406C, A8; AAPCS, 6.1)."""

from typing import Any, Final

import capstone
from capstone import arm_const as arm

from mambo_sil.board.firmware.instructions import (
    PC,
    SP,
    WORD_BYTES,
    Add,
    Assign,
    Clobber,
    Convention,
    Effect,
    Flow,
    Instruction,
    Load,
    Store,
)

CONVENTION: Final = Convention("lr", frozenset({"r4", "r5", "r6", "r7", "r8", "sb", "sl", "fp"}))
_MULTIPLE: Final[dict[int, tuple[type[Load | Store], int, bool]]] = {
    arm.ARM_INS_LDM: (Load, 1, False),
    arm.ARM_INS_LDMIB: (Load, 1, True),
    arm.ARM_INS_LDMDB: (Load, -1, True),
    arm.ARM_INS_LDMDA: (Load, -1, False),
    arm.ARM_INS_STM: (Store, 1, False),
    arm.ARM_INS_STMIB: (Store, 1, True),
    arm.ARM_INS_STMDB: (Store, -1, True),
    arm.ARM_INS_STMDA: (Store, -1, False),
    arm.ARM_INS_POP: (Load, 1, False),
    arm.ARM_INS_PUSH: (Store, -1, True),
}
"""Multiple loads and stores: effect, sign of the address step, whether it precedes each access."""
ALWAYS: Final = {arm.ARM_CC_AL, arm.ARM_CC_INVALID}
"""Conditions of an instruction that is never skipped."""
_CALLS: Final = {arm.ARM_INS_BL, arm.ARM_INS_BLX}
_ENDS: Final = {arm.ARM_INS_UDF, arm.ARM_INS_BKPT}


def model_instruction(insn: Any, *, thumb: bool) -> Instruction:
    """Return the effects of Capstone's `insn`; registers written in a way not modelled are clobbered."""
    effects = _effects(insn, ahead=4 if thumb else 8)
    written = {effect.register for effect in effects if not isinstance(effect, Store)}
    unknown = {insn.reg_name(register) for register in insn.regs_access()[1]} - written
    effects = (*effects, *(Clobber(register) for register in sorted(unknown)))
    jumps = PC in written | unknown or insn.group(capstone.CS_GRP_JUMP)
    flow: Flow = "jump" if jumps else "next"
    if insn.id in _CALLS:
        flow = "call"
    elif insn.id in _ENDS:
        flow = "stop"
    return Instruction(
        address=insn.address,
        size_bytes=insn.size,
        text=f"{insn.mnemonic} {insn.op_str}".strip(),
        effects=effects,
        flow=flow,
        conditional=insn.cc not in ALWAYS or insn.id in {arm.ARM_INS_CBZ, arm.ARM_INS_CBNZ},
    )


def _effects(insn: Any, ahead: int) -> tuple[Effect, ...]:
    """Model changes of the stack pointer, saves of registers, and the computation of addresses of code."""
    here = insn.address + ahead
    if insn.id in _MULTIPLE:
        return _multiple(insn)
    if insn.mnemonic.startswith(("vpush", "vpop", "vldm", "vstm")):
        return _vector(insn)
    if any(operand.type == arm.ARM_OP_MEM for operand in insn.operands):
        return _transfer(insn, here)
    if insn.group(capstone.CS_GRP_JUMP):
        target = insn.operands[-1]
        if target.type == arm.ARM_OP_IMM:
            return (Assign(PC, None, target.imm),)
        register = insn.reg_name(target.reg)
        return (Assign(PC, None, here & ~3) if register == PC else Assign(PC, register, 0),)
    return _arithmetic(insn, here)


def _arithmetic(insn: Any, here: int) -> tuple[Effect, ...]:  # noqa: PLR0911 - one table
    operands = [
        operand.imm
        if operand.type == arm.ARM_OP_IMM
        else insn.reg_name(operand.reg)
        if operand.type == arm.ARM_OP_REG and operand.shift.type == arm.ARM_SFT_INVALID
        else None
        for operand in insn.operands
    ]
    sign: Any = {arm.ARM_INS_ADD: 1, arm.ARM_INS_SUB: -1}.get(insn.id)
    match operands:
        case [str(register), int(value)] if insn.id == arm.ARM_INS_MOV:
            return (Assign(register, None, value),)
        case [str(register), str(base)] if insn.id == arm.ARM_INS_MOV and base != PC:
            return (Assign(register, base, 0),)
        case [str(register), int(offset)] if insn.id == arm.ARM_INS_ADR:
            return (Assign(register, None, (here & ~3) + offset),)
        case [str(register), int(offset)] if sign:
            return (Assign(register, register, sign * offset),)
        case [str(register), str(base), int(offset)] if sign and base != PC:
            return (Assign(register, base, sign * offset),)
        case [str(register), str(right)] if sign and PC not in {register, right}:
            return (Add(register, register, right, sign),)
        case [str(register), str(left), str(right)] if sign and PC not in {left, right}:
            return (Add(register, left, right, sign),)
    return ()


def _transfer(insn: Any, here: int) -> tuple[Effect, ...]:
    """Model a load or store of one or two registers, with pre- or post-indexed base."""
    place = next(index for index, operand in enumerate(insn.operands) if operand.type == arm.ARM_OP_MEM)
    memory, step = insn.operands[place].mem, insn.operands[place + 1 :]
    if memory.index or (step and step[0].type != arm.ARM_OP_IMM):
        return ()
    base, offset = insn.reg_name(memory.base), memory.disp
    before: tuple[Effect, ...] = ()
    after: tuple[Effect, ...] = ()
    if step:
        after = (Assign(base, base, -step[0].imm if step[0].subtracted else step[0].imm),)
    elif insn.writeback:
        before, offset = (Assign(base, base, offset),), 0
    registers = [insn.reg_name(operand.reg) for operand in insn.operands[:place]]
    moved: tuple[Effect, ...] = ()
    if insn.id in {arm.ARM_INS_LDR, arm.ARM_INS_LDRD}:
        source, start = (None, (here & ~3) + offset) if base == PC else (base, offset)
        moved = tuple(Load(name, source, start + WORD_BYTES * i) for i, name in enumerate(registers))
    elif insn.id in {arm.ARM_INS_STR, arm.ARM_INS_STRD}:
        moved = tuple(Store(name, base, offset + WORD_BYTES * i) for i, name in enumerate(registers))
    elif insn.mnemonic.startswith(("str", "vstr")):
        words = 2 if registers[0].startswith("d") else 1
        moved = tuple(Store(None, base, offset + WORD_BYTES * index) for index in range(words))
    return (*before, *moved, *after)


def _multiple(insn: Any) -> tuple[Effect, ...]:
    """Model multiple loads and stores, push and pop included."""
    access, growth, first = _MULTIPLE[insn.id]
    names = [insn.reg_name(operand.reg) for operand in insn.operands]
    stack = insn.id in {arm.ARM_INS_PUSH, arm.ARM_INS_POP}
    base, registers = (SP, names) if stack else (names[0], names[1:])
    size = WORD_BYTES * len(registers)
    low = (WORD_BYTES if first else 0) if growth > 0 else -size + (0 if first else WORD_BYTES)
    start = "base of the move"
    moved = (access(register, start, low + WORD_BYTES * index) for index, register in enumerate(registers))
    moves_base = stack or insn.writeback
    return (Assign(start, base, 0), *([Assign(base, base, growth * size)] if moves_base else []), *moved)


def _vector(insn: Any) -> tuple[Effect, ...]:
    """Model the base register of floating-point multiple loads and stores.

    Capstone does not list the base among the registers that these write.
    """
    if insn.id not in {arm.ARM_INS_VPUSH, arm.ARM_INS_VPOP}:
        return (Clobber(insn.reg_name(insn.operands[0].reg)),) if "!" in insn.op_str else ()
    size = sum(8 if insn.reg_name(operand.reg).startswith("d") else 4 for operand in insn.operands)
    return (Assign(SP, SP, -size if insn.id == arm.ARM_INS_VPUSH else size),)
