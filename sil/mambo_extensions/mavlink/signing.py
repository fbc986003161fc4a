"""The key that signs the messages of a link: MAVLink 2's message signing, as pymavlink does it."""

import os
import stat
import string
import time
from pathlib import Path
from typing import Any, Final

from mambo_codegen.errors import echo
from mambo_sil.errors import LinkError

KEY_BYTES: Final = 32
LARGEST_FILE: Final = 1024
BEGAN_S: Final = 1_420_070_400
"""The beginning of MAVLink's time stamps, 1 January 2015, in Unix time; they count 10 us."""
UNITS_1_S: Final = 100_000


def read_key(path: str | Path) -> bytes:
    """Return the key in a file of 64 hexadecimal digits that only its owner can read; raises LinkError."""
    name = f"key {echo(str(path))}"
    try:
        with Path(path).open("rb") as file:
            mode, text = os.fstat(file.fileno()).st_mode, file.read(LARGEST_FILE)
    except OSError as error:
        raise LinkError(f"{name}: cannot be read: {error.strerror}") from error
    if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise LinkError(f"{name}: others may read it, or write to it (chmod 600 lets only you)")
    digits = text.strip()
    if len(digits) != 2 * KEY_BYTES or set(digits) - set(string.hexdigits.encode()):
        raise LinkError(f"{name}: must have {2 * KEY_BYTES} hexadecimal digits, the key of {KEY_BYTES} bytes")
    return bytes.fromhex(digits.decode())


LATEST: Final = UNITS_1_S // 2
"""By how much the time stamp of a message may be behind the newest one: others may have overtaken it."""


class SignedStreams:
    """Decides which signed messages count: each once, in any order within half a second.

    Pymavlink alone refuses all that is overtaken, and keeps the time stamps of forged messages too, after
    which those of the autopilot are old.
    """

    def __init__(self) -> None:
        self._newest: dict[tuple[int, int, int], int] = {}
        self._seen: dict[tuple[int, int, int], set[int]] = {}

    def check(self, parser: Any, data: bytes, system: int, component: int, *, first: bool) -> bool:
        """Return whether a message is signed with the key of `parser`, pymavlink's, and is new.

        A message may be a minute behind our clock, but the `first`, of an autopilot whose clock ours sets.
        """
        signing, ours = parser.signing, parser.signing.timestamp
        signing.stream_timestamps.clear()
        signing.timestamp = 0 if first else ours
        is_right = type(parser).check_signature(parser, data, system, component)
        signing.timestamp = max(ours, signing.timestamp)
        if not is_right:
            return False
        stream, stamp = (data[-13], system, component), int.from_bytes(data[-12:-6], "little")
        newest = max(stamp, self._newest.get(stream, 0))
        seen = self._seen.setdefault(stream, set())
        if stamp in seen or stamp <= newest - LATEST:
            return False
        if len(seen) >= 2 * LATEST:
            seen.intersection_update(range(newest - LATEST, newest + 1))
        self._newest[stream] = newest
        seen.add(stamp)
        return True


def sign(mav: Any, key: bytes) -> None:
    """Let pymavlink's MAVLink object `mav` sign what it sends, and accept nothing else."""
    mav.signing.secret_key = key
    mav.signing.sign_outgoing = True
    mav.signing.timestamp = int(UNITS_1_S * max(time.time() - BEGAN_S, 0.0))
