"""RISC-V instructions, as capstone decodes them, by their effects (ISA manual 20191213; psABI 1.0, 1.1)."""

from typing import Any, Final

from capstone import riscv_const as riscv

from mambo_nmpc.sil.firmware.instructions import (
    PC,
    WORD_BYTES,
    Convention,
    Effect,
    Flow,
    Forget,
    Instruction,
    Load,
    Put,
    Store,
    Sum,
)

CONVENTION: Final = Convention("ra", frozenset(f"s{index}" for index in range(12)))
_BRANCHES: Final = frozenset(
    {"beq", "bne", "blt", "bge", "bltu", "bgeu", "beqz", "bnez", "blez", "bgez", "bltz", "bgtz"}
)
_STORES: Final = frozenset({"sb", "sh", "sw", "fsw", "fsd", "swsp", "fswsp", "fsdsp"})
_JUMPS: Final = frozenset({"j", "jr", "ret"})
_ENDS: Final = frozenset({"unimp", "ebreak"})


def instruction(insn: Any) -> Instruction:
    """Return what capstone's `insn` does; an effect that is not modelled makes its register anything."""
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
    """Return registers by name, constants as they are, a place in memory as offset and base."""
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
    """Name the register that a jal or jalr leaves its return address in; ra where it goes without saying."""
    match _operands(insn):
        case [str(register), _, *_]:
            return register
    return CONVENTION.link


def _effects(insn: Any, mnemonic: str) -> tuple[Effect, ...]:  # noqa: C901, PLR0911, PLR0912 - one table
    """Model what can move the stack pointer, save a register on the stack, or name a place in the program."""
    operands = _operands(insn)
    match mnemonic, operands:
        case "ret", []:
            return (Put(PC, CONVENTION.link, 0),)
        case (("jr" | "jalr"), [str(base)]):
            return (Put(PC, base, 0),)
        case "jalr", [str(link), str(base), int(offset)]:
            return (Put(PC, base, offset), Forget(link))
        case "jal", [str(link), int(offset)] if link != CONVENTION.link:
            return (Forget(PC), Forget(link))
        case _, [*_, int(offset)] if mnemonic in _BRANCHES | {"j", "jal"}:
            return (Put(PC, None, insn.address + offset),)
        case (("addi" | "addi16sp" | "addi4spn"), [str(register), *base, int(offset)]):
            return (_put(register, str(base[0]) if base else register, offset),)
        case "li", [str(register), int(value)]:
            return (Put(register, None, value),)
        case "mv", [str(register), str(base)]:
            return (_put(register, base, 0),)
        case "lui", [str(register), int(upper)]:
            return (Put(register, None, upper << 12),)
        case "auipc", [str(register), int(upper)]:
            return (Put(register, None, insn.address + (upper << 12)),)
        case (("add" | "sub"), [str(register), *left, str(right)]):
            first = str(left[0]) if left else register
            return (Sum(register, first, right, 1 if mnemonic == "add" else -1),)
        case (("lw" | "lwsp"), [str(register), int(offset), str(base)]):
            return (Load(register, base, offset),)
        case (("sw" | "swsp"), [str(register), int(offset), str(base)]):
            return (Store(register, base, offset),)
        case (("fsd" | "fsdsp"), [str(), int(offset), str(base)]):
            return (Store(None, base, offset), Store(None, base, offset + WORD_BYTES))
        case _, [str(), int(offset), str(base)] if mnemonic in _STORES:
            return (Store(None, base, offset),)
        case _, [str(register), *_] if mnemonic not in _STORES | _BRANCHES:
            return (Forget(register),)
    return ()


def _put(register: str, base: str, offset: int) -> Put:
    return Put(register, None if base == "zero" else base, offset)
