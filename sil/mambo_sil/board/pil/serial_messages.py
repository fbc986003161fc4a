"""Requests to a board and its replies: the protocol that pil.h describes."""

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Final, Self

PROTOCOL: Final = 2
REPLY: Final = 0x80
OUT_OF_STEP: Final = 0xFE
DAMAGED: Final = 0xFF
_HEAD: Final = struct.Struct("<BI")
HEAD_BYTES: Final = _HEAD.size


class Kind(IntEnum):
    """What a request asks for."""

    GREET = 1
    RESET = 2
    STEP = 3
    TEST = 4
    DIGEST = 5
    START = 6
    INPUTS = 7


def request(kind: Kind, number: int, body: bytes = b"") -> bytes:
    """Return the payload of a request."""
    return _HEAD.pack(kind, number) + body


def split(payload: bytes) -> tuple[int, int, bytes]:
    """Return kind, number and body of a reply; a payload too short for them is a damaged one."""
    if len(payload) < HEAD_BYTES:
        return DAMAGED, 0, b""
    return (*_HEAD.unpack_from(payload), payload[HEAD_BYTES:])


@dataclass(frozen=True)
class Greeting:
    """What a board says of itself."""

    protocol: int
    clock_hz: int
    """Frequency of its cycle counter."""
    period_cycles: int
    """The update period, by that counter."""
    steps: int
    """Steps since its reset."""
    generator: str
    settings: str
    """The first digits of the settings digest."""
    scalar: str
    board: str

    _NUMBERS = struct.Struct("<BIII")

    @classmethod
    def parse(cls, body: bytes) -> Self | None:
        """Return the greeting in the body of a reply; None if it is none."""
        if len(body) < cls._NUMBERS.size:
            return None
        words = body[cls._NUMBERS.size :].decode("ascii", "replace").split("\n")
        return cls(*cls._NUMBERS.unpack_from(body), *words) if len(words) == 4 else None

    def has_period(self, update_period_s: float) -> bool:
        """Return whether its clock runs and its period is this one, to the next cycle or the one before."""
        if self.clock_hz == 0 or self.period_cycles == 0:
            return False
        return abs(self.period_cycles - update_period_s * self.clock_hz) <= 1.0


@dataclass(frozen=True)
class StepReply:
    """The result of a step on a board."""

    status: int
    command: bytes
    """Roll and pitch, with a height the thrust too, as the C holds them."""
    outcome_crc: int
    """CRC-32 of every bit that the step left in the controller."""
    cycles: int
    stack_bytes: int

    @classmethod
    def parse(cls, body: bytes, command_bytes: int) -> Self | None:
        """Return the result in the body of a reply, with a command of that length; None if it is none."""
        shape = struct.Struct(f"<B{command_bytes}sIIH")
        return cls(*shape.unpack(body)) if len(body) == shape.size else None

    @property
    def bits(self) -> tuple[int, bytes, int]:
        """All that must be equal wherever the step is run."""
        return self.status, self.command, self.outcome_crc


NAMED_STEPS: Final = 8
"""Steps whose inputs a `TimedReply` names."""


@dataclass(frozen=True)
class TimedReply:
    """The result of a step that the board's clock called."""

    step: StepReply
    overruns: int
    """Periods without a step since the start."""
    delay_cycles: int
    """From the end of the period to the call."""
    used: bytes
    """Lowest bytes of the numbers of the inputs of this step, and of the NAMED_STEPS - 1 before it."""

    @classmethod
    def parse(cls, body: bytes, command_bytes: int) -> Self | None:
        """Return the result in the body of a reply, with a command of that length; None if it is none."""
        shape = struct.Struct(f"<II{NAMED_STEPS}s")
        step = StepReply.parse(body[: -shape.size], command_bytes)
        return None if step is None else cls(step, *shape.unpack(body[-shape.size :]))


def step_reply_bytes(command_bytes: int) -> int:
    """Return the length of the payload that answers a step, with a command of that length."""
    return HEAD_BYTES + 1 + command_bytes + 10
