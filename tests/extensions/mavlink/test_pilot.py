"""The command `pilot` and its link: a simulated flight with its files, and what is refused."""

import csv
import json
import socket
import sys
from pathlib import Path

import pytest

from mambo_extensions.mavlink.pilot_report import PilotSummary
from mambo_extensions.mavlink.sockets import Address, MavlinkSocket, parse_link
from mambo_sil.errors import LinkError
from mambo_sil.results.blocks import Picture
from tests.extensions.mavlink.support.results import write_folder as pilot_folder
from tests.support.command import run, unwrapped
from tests.support.links import write_drone


@pytest.fixture
def settings(in_an_empty_folder: None) -> str:  # noqa: ARG001 - where it is written
    """Derive settings for the drone of these tests, in the present folder."""
    write_drone(Path())
    return "controller.toml"


@pytest.mark.long
def test_a_simulated_flight_writes_a_log_that_replay_and_identify_read(settings: str) -> None:
    """It says how it ended, how near it stayed, and what thrust hover took."""
    line = ("--simulate", "px4", "--vehicle", "drone.toml", "--duration-s", "14", "--rate-rad-s", "1.1")
    said, talk = run("pilot", settings, *line, "-o", "piloted")
    assert said.startswith("landed: as planned\n")
    assert "; MPC_THR_HOVER says 0.500" in said
    assert "piloted: flight.csv, trace.npz, flight.png, flight.svg" in talk
    drawn = Path("piloted/flight.svg").read_text("utf-8")
    assert "landed: as planned; " in drawn
    assert "height, m" in drawn
    run("report", "piloted")
    assert "Play" in Path("report.html").read_text("utf-8")
    summary = json.loads(Path("piloted/summary.json").read_text("utf-8"))
    assert (summary["good"], summary["simulated"], summary["autopilot"]) == (True, True, "PX4")
    assert summary["horizontal_rms_m"] < 0.08
    assert summary["mean_thrust"] == pytest.approx(0.52, abs=0.02)
    rows = list(csv.DictReader(Path("piloted/flight.csv").read_text("utf-8").splitlines()))
    assert len(rows) == summary["set_points"]
    said, _ = run("replay", "piloted/flight.csv", settings)
    assert f"all {len(rows)} commands of the log are those of this controller, bit for bit" in unwrapped(said)
    said, _ = run("identify", "piloted/flight.csv", "-o", "identified")
    assert "gain 1.000" in said


def test_the_picture_says_which_angles_it_has(tmp_path: Path) -> None:
    """Not those of a drone in wind: the lean is taken off."""
    pilot_folder(tmp_path)
    summary = PilotSummary.model_validate_json((tmp_path / "summary.json").read_text("utf-8"))
    captions = [block.caption for block in summary.result(tmp_path).blocks if isinstance(block, Picture)]
    assert "angles, both less the lean" in captions[-1]


def test_a_flight_too_short_to_be_judged_says_so(tmp_path: Path) -> None:
    """In place of an error that is no number."""
    pilot_folder(tmp_path)
    summary = PilotSummary.model_validate_json((tmp_path / "summary.json").read_text("utf-8"))
    unknown = dict.fromkeys(("horizontal_rms_m", "vertical_rms_m", "command_rms_rad_s"), float("nan"))
    said = str(summary.model_copy(update=unknown).result(tmp_path).blocks)
    assert "not judged: flown for less than 5 s" in said
    assert "nan" not in said


@pytest.mark.usefixtures("settings")
@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("", "name either this, such as udp:127.0.0.1:14540, or --simulate px4"),
        ("--link udp:127.0.0.1:14540 --simulate px4", "name either this"),
        ("--link udp:127.0.0.1:14540 --vehicle drone.toml", "it is the drone of --simulate"),
        ("--simulate px4 --trajectory eight", "--trajectory eight must be bernoulli, gerono"),
        ("--simulate px4 --height-m 0", "height_m = 0.0 must"),
        ("--simulate px4 --farthest-m 0", "farthest_m = 0.0 must lie in 1..10000"),
        ("--simulate px4 --key link.key", "it signs the messages of --link: leave it out"),
        ("--link udp:127.0.0.1:14540 --key link.key", "key link.key: cannot be read"),
    ],
)
def test_what_cannot_be_flown_is_refused(line: str, words: str) -> None:
    """With what to write instead, and no folder is left."""
    _, talk = run("pilot", "controller.toml", *line.split(), code=2)
    assert words in unwrapped(talk.replace("│", ""))
    assert not Path("piloted").exists()


def test_a_second_pilot_at_the_port_is_refused(settings: str) -> None:
    """It is in use."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        link = f"udp:127.0.0.1:{other.getsockname()[1]}"
        _, talk = run("pilot", settings, "--link", link, code=2)
    assert f"{link}: is in use: another pilot or ground station listens there" in unwrapped(talk)


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


def test_an_address_of_another_machine_is_a_sentence() -> None:
    """TEST-NET-1 of RFC 5737."""
    with pytest.raises(LinkError, match="name an address of this machine"):
        MavlinkSocket(Address("192.0.2.1", 14540), None)


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the command that installs it."""
    monkeypatch.setitem(sys.modules, "pymavlink.dialects.v20", None)
    with pytest.raises(LinkError, match=r"pip install pymavlink \(the extra"):
        MavlinkSocket(Address("127.0.0.1", 0), None)
