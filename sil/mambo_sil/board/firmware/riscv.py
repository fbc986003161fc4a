"""Effects of RISC-V instructions, decoded by Capstone (ISA manual 20191213; psABI 1.0, 1.1)."""

from typing import Any, Final

from capstone import riscv_const as riscv

from mambo_sil.board.firmware.instructions import (
    PC,
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

CONVENTION: Final = Convention("ra", frozenset(f"s{index}" for index in range(12)))
_BRANCHES: Final = frozenset(
    {"beq", "bne", "blt", "bge", "bltu", "bgeu", "beqz", "bnez", "blez", "bgez", "bltz", "bgtz"}
)
_STORES: Final = frozenset({"sb", "sh", "sw", "fsw", "fsd", "swsp", "fswsp", "fsdsp"})
_JUMPS: Final = frozenset({"j", "jr", "ret"})
_ENDS: Final = frozenset({"unimp", "ebreak"})


def model_instruction(insn: Any) -> Instruction:
    """Return the effects of Capstone's `insn`; a register written in a way not modelled is clobbered."""
    mnemonic = insn.mnemonic.removeprefix("c.")
    flow: Flow = "next"
    if mnemonic in _BRANCHES | _JUMPS or (mnemonic in {"jal", "jalr"} and _link(insn) == "zero"):
        flow = "jump"
    elif mnemonic in {"jal", "jalr"}:
        flow = "call"
    elif mnemonic in _ENDS:
        flow = "stop"
    return Instruction(
        address=insn.address,
        size_bytes=insn.size,
        text=f"{insn.mnemonic} {insn.op_str}".strip(),
        effects=_effects(insn, mnemonic),
        flow=flow,
        conditional=mnemonic in _BRANCHES,
    )


def _operands(insn: Any) -> list[str | int]:
    """Return the operands: registers by name, immediates, and memory as offset then base."""
    operands: list[str | int] = []
    for operand in insn.operands:
        if operand.type == riscv.RISCV_OP_REG:
            operands.append(insn.reg_name(operand.reg))
        elif operand.type == riscv.RISCV_OP_IMM:
            operands.append(operand.imm)
        else:
            operands += [operand.mem.disp, insn.reg_name(operand.mem.base)]
    return operands


def _link(insn: Any) -> str:
    """Return the link register of a jal or jalr, ra if the operands do not state it."""
    match _operands(insn):
        case [str(register), _, *_]:
            return register
    return CONVENTION.link


def _effects(insn: Any, mnemonic: str) -> tuple[Effect, ...]:  # noqa: C901, PLR0911, PLR0912 - one table
    """Model changes of the stack pointer, saves of registers, and the computation of addresses of code."""
    operands = _operands(insn)
    match mnemonic, operands:
        case "ret", []:
            return (Assign(PC, CONVENTION.link, 0),)
        case (("jr" | "jalr"), [str(base)]):
            return (Assign(PC, base, 0),)
        case "jalr", [str(link), str(base), int(offset)]:
            return (Assign(PC, base, offset), Clobber(link))
        case "jal", [str(link), int(offset)] if link != CONVENTION.link:
            return (Clobber(PC), Clobber(link))
        case _, [*_, int(offset)] if mnemonic in _BRANCHES | {"j", "jal"}:
            return (Assign(PC, None, insn.address + offset),)
        case (("addi" | "addi16sp" | "addi4spn"), [str(register), *base, int(offset)]):
            return (_put(register, str(base[0]) if base else register, offset),)
        case "li", [str(register), int(value)]:
            return (Assign(register, None, value),)
        case "mv", [str(register), str(base)]:
            return (_put(register, base, 0),)
        case "lui", [str(register), int(upper)]:
            return (Assign(register, None, upper << 12),)
        case "auipc", [str(register), int(upper)]:
            return (Assign(register, None, insn.address + (upper << 12)),)
        case (("add" | "sub"), [str(register), *left, str(right)]):
            first = str(left[0]) if left else register
            return (Add(register, first, right, 1 if mnemonic == "add" else -1),)
        case (("lw" | "lwsp"), [str(register), int(offset), str(base)]):
            return (Load(register, base, offset),)
        case (("sw" | "swsp"), [str(register), int(offset), str(base)]):
            return (Store(register, base, offset),)
        case (("fsd" | "fsdsp"), [str(), int(offset), str(base)]):
            return (Store(None, base, offset), Store(None, base, offset + WORD_BYTES))
        case _, [str(), int(offset), str(base)] if mnemonic in _STORES:
            return (Store(None, base, offset),)
        case _, [str(register), *_] if mnemonic not in _STORES | _BRANCHES:
            return (Clobber(register),)
    return ()


def _put(register: str, base: str, offset: int) -> Assign:
    return Assign(register, None if base == "zero" else base, offset)
