"""The socket of a link: what is no address, a port in use, a missing package."""

import socket
import sys

import pytest

from mambo_sil.errors import LinkError
from mambo_sil.link.sockets import Address, MavlinkSocket, parse_link


@pytest.mark.parametrize(
    "text",
    [
        "",
        "udp",
        "udp:14540",
        "udp:127.0.0.1:",
        "udp:127.0.0.1:0",
        "udp:127.0.0.1:99999",
        "tcp:1.2.3.4:5",
        "/dev/x",
    ],
)
def test_what_is_no_link_is_refused(text: str) -> None:
    """With the form that is wanted."""
    with pytest.raises(LinkError, match=r"must be udp:HOST:PORT .*, such as udp:127\.0\.0\.1:14540"):
        parse_link(text)


def test_a_link_is_host_and_port() -> None:
    """Of this machine."""
    assert parse_link("udp:0.0.0.0:14550") == Address("0.0.0.0", 14550)


def test_a_port_in_use_is_a_sentence() -> None:
    """Another pilot listens there."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        with pytest.raises(LinkError, match=f"udp:127.0.0.1:{port}: is in use: another pilot"):
            MavlinkSocket(Address("127.0.0.1", port), None)


def test_an_address_of_another_machine_is_a_sentence() -> None:
    """TEST-NET-1 of RFC 5737."""
    with pytest.raises(LinkError, match="name an address of this machine"):
        MavlinkSocket(Address("192.0.2.1", 14540), None)


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the command that installs it."""
    monkeypatch.setitem(sys.modules, "pymavlink.dialects.v20", None)
    with pytest.raises(LinkError, match=r"pip install pymavlink \(the extra"):
        MavlinkSocket(Address("127.0.0.1", 0), None)
