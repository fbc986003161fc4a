"""Which messages of a link count: by system, component and address of the autopilot, and by its key."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import common as mavlink

from mambo_extensions.mavlink.autopilot_source import AutopilotSource
from mambo_extensions.mavlink.links import UdpLink
from mambo_extensions.mavlink.messages import send_record
from mambo_extensions.mavlink.signing import read_key, sign
from mambo_extensions.mavlink.sockets import Address, MavlinkSocket
from mambo_sil.errors import LinkError
from mambo_sil.life.records import COMPANION, PX4, Battery, Heartbeat, Parameter, Record

HERE, MOVED, ELSEWHERE = ("10.0.0.1", 14550), ("10.0.0.1", 40000), ("10.0.0.2", 14550)
KEY, OTHER = bytes(range(32)), bytes(32)


def message(system: int, component: int, vehicle: int | None = None) -> Any:
    """Return a heartbeat of a kind of vehicle, or a parameter."""
    mav = mavlink.MAVLink(None, system, component)
    one = mav.param_value_encode(b"X", 1.0, 9, 1, 0)
    if vehicle is not None:
        one = mav.heartbeat_encode(vehicle, 12, 1, 0, 4)
    one.pack(mav)
    return one


def connected() -> AutopilotSource:
    """Return the peer that is system 1 at HERE, heard at 10 s."""
    peer = AutopilotSource()
    assert peer.counts(message(1, 1, 2), HERE, 10.0)
    return peer


def test_nothing_counts_before_the_heartbeat_of_an_autopilot() -> None:
    """No parameter, nor the heartbeat of a camera or a ground station, decides who is flown."""
    peer = AutopilotSource()
    for one in (message(1, 1), message(1, 100, 30), message(255, 190, 6)):
        assert not peer.counts(one, HERE, 0.0)
    assert peer.address is None
    assert peer.counts(message(1, 1, 2), HERE, 0.0)


@pytest.mark.parametrize("vehicle", [None, 2], ids=["parameter", "heartbeat"])
@pytest.mark.parametrize(
    ("system", "component", "address", "counts"),
    [
        (1, 1, HERE, True),
        (2, 1, HERE, False),
        (1, 197, HERE, False),
        (1, 1, ELSEWHERE, False),
        (1, 1, MOVED, False),
    ],
    ids=["own", "another-drone", "vision", "another-host", "another-port"],
)
def test_only_messages_of_the_autopilot_count(
    vehicle: int | None, system: int, component: int, address: tuple[str, int], counts: bool
) -> None:
    """By system, component, host and port."""
    peer = connected()
    assert peer.counts(message(system, component, vehicle), address, 10.5) is counts
    assert peer.address == HERE


def test_a_restarted_peer_is_heard_at_its_new_port_after_a_second_of_silence() -> None:
    """Of the same host only; messages of others do not end the silence."""
    peer = connected()
    assert not peer.counts(message(2, 1), HERE, 10.9)
    assert not peer.counts(message(1, 1), MOVED, 10.95)
    assert not peer.counts(message(1, 1), ELSEWHERE, 11.1)
    assert peer.counts(message(1, 1), MOVED, 11.1)
    assert peer.address == MOVED
    assert not peer.counts(message(1, 1), HERE, 11.2)


@pytest.mark.parametrize(("component", "counts"), [(191, True), (197, False)], ids=["computer", "vision"])
def test_the_heartbeat_of_another_pilot_counts(component: int, counts: bool) -> None:
    """By the way of the autopilot; that of a vision computer says nothing of set-points."""
    other = message(9, component, COMPANION)
    assert connected().counts(other, HERE, 10.5) is counts
    assert not connected().counts(other, ELSEWHERE, 10.5)


@pytest.fixture
def sides() -> Iterator[tuple[Callable[[bytes | None], UdpLink], Callable[[bytes | None], MavlinkSocket]]]:
    """Open links, and sockets of an autopilot that send to the last one, with and without keys."""
    links, sockets = list[UdpLink](), list[MavlinkSocket]()

    def pilot(key: bytes | None) -> UdpLink:
        links.append(UdpLink(Address("127.0.0.1", 0), key))
        return links[-1]

    def autopilot(key: bytes | None) -> MavlinkSocket:
        to = ("127.0.0.1", links[-1].socket.port)
        sockets.append(MavlinkSocket(Address("127.0.0.1", 0), to, source=(1, 1)))
        if key is not None:
            sign(sockets[-1].mav, key)
        return sockets[-1]

    yield pilot, autopilot
    for link in links:
        link.close()
    for socket in sockets:
        socket.close()


RECORDS: list[Record] = [Heartbeat(1, 1, PX4.ident, 2, armed=False, mode=0), Battery(0.5)]


@pytest.mark.parametrize(
    ("ours", "theirs", "heard"),
    [
        (None, None, True),
        (KEY, KEY, True),
        (KEY, OTHER, False),
        (KEY, None, False),
        (None, KEY, True),
    ],
    ids=["neither", "same", "another-key", "unsigned", "we-have-none"],
)
def test_a_link_with_a_key_hears_only_what_is_signed_with_it(
    sides: Any, ours: bytes | None, theirs: bytes | None, heard: bool
) -> None:
    """And signs what it sends, which the autopilot accepts."""
    pilot, autopilot = sides[0](ours), sides[1](theirs)
    for record in RECORDS:
        send_record(autopilot.mav, record)
    assert pilot.receive() == (RECORDS if heard else [])
    assert pilot.hint == ("" if heard else "; messages come that are not signed with the key")
    if heard and ours is theirs:
        pilot.mav.param_request_read_send(1, 1, b"X", -1)
        ((asked, _),) = autopilot.receive(1.0)
        assert (asked.get_type(), asked.get_signed()) == ("PARAM_REQUEST_READ", ours is not None)


def test_signed_messages_count_once_and_in_any_order(sides: Any) -> None:
    """Who records them and sends them again is not heard, though the ids and the signature are right."""
    pilot, autopilot = sides[0](KEY), sides[1](KEY)
    records = [*RECORDS, Parameter("X", 1.0), Parameter("Y", 2.0)]
    sent = signed(autopilot, records)
    for place in (0, 3, 1, 2, 0, 1, 3):
        autopilot.write(sent[place])
    assert pilot.receive() == [records[place] for place in (0, 3, 1, 2)]


def test_a_forged_time_stamp_far_ahead_does_not_silence_the_autopilot(sides: Any) -> None:
    """It is not signed with the key, so it says nothing."""
    pilot, autopilot = sides[0](KEY), sides[1](KEY)
    sent = signed(autopilot, RECORDS)
    forged = bytearray(sent[0])
    forged[-12:-6] = (2**48 - 1).to_bytes(6, "little")
    for data in (sent[0], bytes(forged), sent[1]):
        autopilot.write(data)
    assert pilot.receive() == RECORDS


def test_an_autopilot_without_a_clock_gets_that_of_the_pilot(sides: Any) -> None:
    """Its first heartbeat may be of any time; from the answer on it signs with the pilot's."""
    pilot, autopilot = sides[0](KEY), sides[1](KEY)
    autopilot.mav.signing.timestamp = 1000
    send_record(autopilot.mav, RECORDS[0])
    send_record(autopilot.mav, RECORDS[1])
    assert pilot.receive() == RECORDS
    send_record(autopilot.mav, RECORDS[1])
    assert pilot.receive() == []
    pilot.mav.param_request_read_send(1, 1, b"X", -1)
    assert autopilot.receive(1.0)
    send_record(autopilot.mav, RECORDS[1])
    assert pilot.receive() == [RECORDS[1]]


def signed(autopilot: MavlinkSocket, records: list[Record]) -> list[bytes]:
    """Return the signed messages of records, which are not sent."""
    sent = list[bytes]()
    autopilot.mav.file = type("Tape", (), {"write": lambda _, data: sent.append(bytes(data))})()
    for record in records:
        send_record(autopilot.mav, record)
    return sent


def write_key(path: Path, text: str, mode: int = 0o600) -> Path:
    """Write a file with a mode."""
    path.write_text(text, "utf-8")
    path.chmod(mode)
    return path


def test_a_key_is_read_from_a_file_for_its_owner_alone(tmp_path: Path) -> None:
    """Of 64 hexadecimal digits, in either case, with or without a newline."""
    assert read_key(write_key(tmp_path / "key", KEY.hex().upper() + "\n")) == KEY


@pytest.mark.skipif(os.name != "posix", reason="modes of files are POSIX's")
@pytest.mark.parametrize(
    ("text", "mode", "words"),
    [
        (KEY.hex(), 0o640, r"others may read it, or write to it \(chmod 600 lets only you\)"),
        (KEY.hex()[:-1], 0o600, "must have 64 hexadecimal digits"),
        ("ß" * 32, 0o600, "must have 64 hexadecimal digits"),
        (KEY.hex() * 100, 0o600, "must have 64 hexadecimal digits"),
        ("", 0o600, "must have 64 hexadecimal digits"),
    ],
    ids=["mode", "short", "letters", "long", "empty"],
)
def test_what_is_no_key_is_refused(tmp_path: Path, text: str, mode: int, words: str) -> None:
    """With the file, and the rule; no digit of the key is shown."""
    with pytest.raises(LinkError, match=words) as caught:
        read_key(write_key(tmp_path / "key", text, mode))
    assert "key" in str(caught.value)
    assert KEY.hex()[:8] not in str(caught.value)


def test_a_missing_key_is_a_sentence(tmp_path: Path) -> None:
    """As is a folder."""
    for path in (tmp_path / "none", tmp_path):
        with pytest.raises(LinkError, match="cannot be read"):
            read_key(path)
