"""A UDP socket that speaks MAVLink, with the optional package pymavlink."""

import contextlib
import errno
import select
import socket
from dataclasses import dataclass
from typing import Any, Final

from mambo_codegen.errors import echo
from mambo_sil.errors import LinkError

PILOT: Final = (245, 191)
"""System and component of the pilot: that of an onboard computer."""
LARGEST_DATAGRAM: Final = 65535
_HALF: Final = 128
_NEW_AFTER: Final = 50
"""Messages in a row that are behind in sequence after which the sender has begun anew."""


@dataclass(frozen=True)
class Address:
    """Where to listen."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"udp:{self.host}:{self.port}"


def parse_link(text: str) -> Address:
    """Return the address in udp:HOST:PORT; raises LinkError."""
    kind, _, rest = text.partition(":")
    host, _, port = rest.rpartition(":")
    if kind != "udp" or not host or not port.isascii() or not port.isdigit() or not 0 < int(port) < 2**16:
        raise LinkError(
            f"--link {echo(text)} must be udp:HOST:PORT with a port in 1..65535, such as "
            "udp:127.0.0.1:14540, to which PX4 sends, or udp:0.0.0.0:14550 for all networks of this machine"
        )
    return Address(host, int(port))


def dialect() -> Any:
    """Return pymavlink's module of MAVLink 2; raises LinkError if it is missing."""
    try:
        from pymavlink.dialects.v20 import common  # noqa: PLC0415 - an optional package
    except ImportError:
        raise LinkError(
            'MAVLink needs pymavlink, which is missing: pip install pymavlink (the extra "mavlink")'
        ) from None
    return common


class MavlinkSocket:
    """Messages to and from one peer; `mav` sends them.

    The peer is the first from which a message comes, unless it is given. A message that arrives late or twice
    is left out, and so is what is no message.
    """

    def __init__(
        self, listen: Address, peer: tuple[str, int] | None, source: tuple[int, int] = PILOT
    ) -> None:
        self._dialect = dialect()
        self.mav: Any = self._dialect.MAVLink(self, *source)
        self._peer, self._newest = peer, dict[tuple[int, int], tuple[int, int]]()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((listen.host, listen.port))
        except OSError as error:
            self._socket.close()
            raise LinkError(f"{listen}: {_cannot_listen(error)}") from error
        self._socket.setblocking(False)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    @property
    def port(self) -> int:
        """The port at which it listens."""
        return int(self._socket.getsockname()[1])

    def write(self, data: bytes) -> None:
        """Send a message to the peer, if there is one yet; `mav` calls it."""
        if self._peer is not None:
            with contextlib.suppress(OSError):  # a network that is down is a lost link
                self._socket.sendto(data, self._peer)

    def receive(self, wait_s: float) -> list[Any]:
        """Return the messages that have come; wait for the first at most `wait_s`."""
        found: list[Any] = []
        select.select([self._socket], [], [], wait_s)
        while True:
            try:
                data, sender = self._socket.recvfrom(LARGEST_DATAGRAM)
            except BlockingIOError:
                return found
            except OSError:  # an answer of the network to what was sent
                continue
            for message in self._parse(data):
                self._peer = self._peer or sender
                if self._is_next(message):
                    found.append(message)

    def _parse(self, data: bytes) -> list[Any]:
        """Return the messages of a datagram; what is garbage in it costs none of the next one."""
        parser = self._dialect.MAVLink(None)
        parser.robust_parsing = True
        return [one for one in parser.parse_buffer(data) or () if one.get_type() != "BAD_DATA"]

    def _is_next(self, message: Any) -> bool:
        """Return whether a message is newer than all of its sender by its sequence number."""
        source = message.get_srcSystem(), message.get_srcComponent()
        number = message.get_seq()
        newest, behind = self._newest.get(source, (number - 1, 0))
        is_next = bool(0 < (number - newest) % 256 < _HALF) or behind >= _NEW_AFTER
        self._newest[source] = (number, 0) if is_next else (newest, behind + 1)
        return is_next


def _cannot_listen(error: OSError) -> str:
    """Return why a port cannot be listened at, and what to do."""
    if error.errno == errno.EADDRINUSE:
        return (
            "is in use: another pilot or ground station listens there; end it, or let the autopilot send to "
            "another port"
        )
    return f"cannot be listened at: {error.strerror}; name an address of this machine"
