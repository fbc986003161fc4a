"""Serial ports and sockets as streams of bytes, with the optional package pyserial."""

import os
import socket
from typing import Final, Protocol
from urllib.parse import urlsplit

from mambo_codegen.errors import echo
from mambo_sil.errors import BoardError

READ_S: Final = 0.01
"""How long a read waits for bytes."""


class Port(Protocol):
    """A stream of bytes; all of it raises OSError once the other end is gone."""

    @property
    def in_waiting(self) -> int:
        """Bytes that have arrived, or 1 if some have."""
        ...

    def read(self, size: int) -> bytes:
        """Return `size` bytes, or those that arrived within READ_S."""
        ...

    def write(self, data: bytes) -> int | None:
        """Send bytes."""
        ...

    def close(self) -> None:
        """Release the port."""
        ...


def open_port(name: str, baud: int) -> Port:
    """Open a device, such as /dev/ttyACM0, a pseudo terminal, or socket://HOST:PORT.

    Raises OSError if it cannot be opened now, BoardError if it never can.
    """
    try:
        import serial  # noqa: PLC0415 - an optional package
    except ImportError:
        raise BoardError(
            '--port needs pyserial, which is missing: pip install pyserial (the extra "serial")'
        ) from None
    _refuse_other_urls(name)
    port = serial.serial_for_url(name, baudrate=baud, timeout=READ_S)
    if name.startswith("socket://"):
        _send_at_once(port.fileno())
    opened: Port = port
    return opened


def _refuse_other_urls(name: str) -> None:
    """Raise BoardError for a URL but socket://HOST:PORT: others of pyserial's write files, say."""
    try:
        url = urlsplit(name)
        whole = bool(url.hostname and url.port) and name == f"socket://{url.netloc}"
    except ValueError as error:
        raise BoardError(f"--port {echo(name)} must be socket://HOST:PORT: {error}") from None
    if not name or ("://" in name and not whole):
        raise BoardError(
            f"--port {echo(name)} must be a device, such as /dev/ttyACM0, or socket://HOST:PORT, such as "
            "socket://localhost:5000"
        )


def _send_at_once(descriptor: int) -> None:
    """Let a socket send a frame even if the one before is not yet acknowledged (RFC 896)."""
    with socket.socket(fileno=os.dup(descriptor)) as same:
        same.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
