"""The command `pilot`: a simulated flight with its files, and what it refuses."""

import csv
import json
import socket
from pathlib import Path

import pytest

from tests.support.command import run, unwrapped
from tests.support.links import write_drone


@pytest.fixture
def settings() -> str:
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
    assert "piloted: flight.csv" in talk
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


@pytest.mark.usefixtures("settings")
@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("", "name either this, such as udp:127.0.0.1:14540, or --simulate px4"),
        ("--link udp:127.0.0.1:14540 --simulate px4", "name either this"),
        ("--link udp:127.0.0.1:14540 --vehicle drone.toml", "it is the drone of --simulate"),
        ("--link 14540", "--link 14540 must be udp:HOST:PORT"),
        ("--simulate px4 --trajectory eight", "--trajectory eight must be bernoulli, gerono"),
        ("--simulate px4 --height-m 0", "height_m = 0.0 must"),
    ],
)
def test_what_cannot_be_flown_is_refused(line: str, words: str) -> None:
    """With what to write instead, and no folder is left."""
    _, talk = run("pilot", "controller.toml", *line.split(), code=2)
    assert words in unwrapped(talk.replace("│", ""))
    assert not Path("piloted").exists()


def test_settings_without_a_height_are_refused() -> None:
    """The autopilot wants the thrust too."""
    _, talk = run("pilot", "mambo", "--simulate", "px4", code=2)
    assert "the settings have no [height]" in unwrapped(talk)


def test_a_second_pilot_at_the_port_is_refused(settings: str) -> None:
    """It is in use."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        link = f"udp:127.0.0.1:{other.getsockname()[1]}"
        _, talk = run("pilot", settings, "--link", link, code=2)
    assert f"{link}: is in use: another pilot or ground station listens there" in unwrapped(talk)
