"""Frames over a stream of bytes that may lose, change or repeat some; the counterpart of pil_frame.c.

A frame is 0x00, COBS(payload, CRC-32 of the payload, lowest byte first), 0x00. COBS: Cheshire and Baker,
IEEE/ACM Transactions on Networking 7(2), 1999.
"""

import zlib
from typing import Final

DELIMITER: Final = b"\0"
CRC_BYTES: Final = 4
LONGEST_PAYLOAD: Final = 192
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
