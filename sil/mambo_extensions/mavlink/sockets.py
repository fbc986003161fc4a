"""A UDP socket that speaks MAVLink, with the optional package pymavlink."""

import contextlib
import errno
import select
import socket
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from mambo_codegen.errors import echo
from mambo_extensions.mavlink.signing import SignedStreams
from mambo_sil.errors import LinkError

PILOT: Final = (245, 191)
"""System and component of the pilot: that of an onboard computer."""
LARGEST_DATAGRAM: Final = 65535


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
    """Messages from anybody, and to the address `peer`; `mav` sends them.

    What is no message is left out, and with a key also what is not signed with it.
    """

    def __init__(
        self, listen: Address, peer: tuple[str, int] | None = None, source: tuple[int, int] = PILOT
    ) -> None:
        self._dialect = dialect()
        self.mav: Any = self._dialect.MAVLink(self, *source)
        self.peer, self._streams = peer, SignedStreams()
        self.has_refused = False
        """Whether a message has come that is not signed with the key."""
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
        if self.peer is not None:
            with contextlib.suppress(OSError):  # a network that is down is a lost link
                self._socket.sendto(data, self.peer)

    def receive(self, wait_s: float) -> list[tuple[Any, tuple[str, int]]]:
        """Return the messages that have come, each with its address; wait for the first at most `wait_s`."""
        found: list[tuple[Any, tuple[str, int]]] = []
        select.select([self._socket], [], [], wait_s)
        while True:
            try:
                data, sender = self._socket.recvfrom(LARGEST_DATAGRAM)
            except BlockingIOError:
                return found
            except OSError:  # an answer of the network to what was sent
                continue
            found += [(message, sender) for message in self._parse(data)]

    def _parse(self, data: bytes) -> list[Any]:
        """Return the messages of a datagram; what is garbage in it costs none of the next one."""
        parser = self._dialect.MAVLink(None)
        parser.robust_parsing, parser.signing = True, self.mav.signing
        parser.check_signature = partial(self._streams.check, parser, first=self.peer is None)
        found = list(parser.parse_buffer(data) or ())
        self.has_refused |= any(one.get_type() == "BAD_DATA" and "signature" in one.reason for one in found)
        return [one for one in found if one.get_type() != "BAD_DATA"]


def _cannot_listen(error: OSError) -> str:
    """Return why a port cannot be listened at, and what to do."""
    if error.errno == errno.EADDRINUSE:
        return (
            "is in use: another pilot or ground station listens there; end it, or let the autopilot send to "
            "another port"
        )
    return f"cannot be listened at: {error.strerror}; name an address of this machine"
