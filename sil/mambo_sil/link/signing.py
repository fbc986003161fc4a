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


def sign(mav: Any, key: bytes) -> None:
    """Let pymavlink's MAVLink object `mav` sign what it sends, and accept nothing else."""
    mav.signing.secret_key = key
    mav.signing.sign_outgoing = True
    mav.signing.timestamp = int(UNITS_1_S * max(time.time() - BEGAN_S, 0.0))
