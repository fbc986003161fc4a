"""The protocol of a board that pil.h describes: frames, the counterpart of pil_frame.c, requests and replies.

Frames go over a stream of bytes that may lose, change or repeat some. A frame is 0x00, COBS(payload, CRC-32
of the payload, lowest byte first), 0x00. COBS: Cheshire and Baker, IEEE/ACM Transactions on Networking 7(2),
1999.
"""

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum
from typing import Final, Self

DELIMITER: Final = b"\0"
CRC_BYTES: Final = 4
LONGEST_PAYLOAD: Final = 200
"""Of any firmware; most take 128 bytes."""
LONGEST_STUFFED: Final = LONGEST_PAYLOAD + CRC_BYTES + 1
"""Shorter than 255 bytes, so that stuffing always adds one byte."""


def frame_bytes(payload_bytes: int) -> int:
    """Return the length of a frame with both delimiters."""
    return payload_bytes + CRC_BYTES + 3


def encode(payload: bytes) -> bytes:
    """Return the frame of `payload`, which has at most LONGEST_PAYLOAD bytes."""
    if len(payload) > LONGEST_PAYLOAD:
        raise ValueError(f"a payload has at most {LONGEST_PAYLOAD} bytes, not {len(payload)}")
    groups = (payload + zlib.crc32(payload).to_bytes(CRC_BYTES, "little")).split(DELIMITER)
    stuffed = b"".join(bytes([len(group) + 1]) + group for group in groups)
    return DELIMITER + stuffed + DELIMITER


def decode(stuffed: bytes) -> bytes | None:
    """Return the payload between two delimiters, or None if the frame is damaged."""
    restored, place = bytearray(), 0
    while place < len(stuffed):
        following = place + stuffed[place]
        restored += stuffed[place + 1 : following] + DELIMITER
        place = following
    if place != len(stuffed) or len(restored) <= CRC_BYTES + 1:
        return None
    payload, crc = bytes(restored[: -CRC_BYTES - 1]), restored[-CRC_BYTES - 1 : -1]
    return payload if zlib.crc32(payload).to_bytes(CRC_BYTES, "little") == crc else None


class Receiver:
    """Splits a stream into frames."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, chunk: bytes) -> list[bytes | None]:
        """Return the payloads of the frames that `chunk` completes, None for each damaged one."""
        *complete, self._rest = (self._rest + chunk).split(DELIMITER)
        self._rest = self._rest[: LONGEST_STUFFED + 1]  # one byte too many marks a frame that is too long
        return [decode(frame) for frame in complete if frame]


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
