"""The command fly --app."""

import json
from pathlib import Path

import pytest

from tests.support.command import run, unwrapped


@pytest.mark.usefixtures("in_an_empty_folder")
def test_an_app_flies_an_events_file() -> None:
    """It prints measures beside bounds, and writes trace, picture and summary."""
    text, files = run("fly", "crazyflie", "--app", "crazyflie", "--events", "camera-lost")
    assert unwrapped(text).startswith("app of crazyflie on the desk, camera-lost: 3 bounds kept")
    assert files == "flight: trace.csv, flight.png, flight.svg\n"
    summary = json.loads(Path("flight/summary.json").read_text("utf-8"))
    assert summary["measures"]["told_s"] <= 0.5
    lines = Path("flight/trace.csv").read_text("utf-8").splitlines()
    assert lines[0].startswith("time_s,x_m,y_m,z_m")
    assert lines[1].startswith("-6.0,") or lines[1].startswith("-5.99")


@pytest.mark.usefixtures("in_an_empty_folder")
def test_a_broken_bound_fails() -> None:
    """The exit code is 1, and the line says so."""
    Path("high.toml").write_text("duration_s = 1.0\n[bounds]\nlowest_m = { least = 2.0 }\n", "utf-8")
    text, _ = run("fly", "crazyflie", "--app", "crazyflie", "--events", "high.toml", "--no-pictures", code=1)
    assert "1 of 1 bounds BROKEN" in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--events", "camra-lost"), "did you mean camera-lost?"),
        (("--wind", "gusts"), "leave out --wind"),
        (("--events", "camera-lost", "--trajectory", "circle"), "leave out --trajectory"),
        (("--sensors", "mambo"), "--sensors mambo must be mocap or flow-deck with --app"),
        (("--trajectory", "points.csv"), "--trajectory points.csv must be bernoulli, gerono"),
        (("--events", "wrong.toml"), "heigt_m is not a key of this file; did you mean height_m?"),
        (("--events", "late.toml"), "nmpc.tild is not a parameter of this app"),
    ],
)
@pytest.mark.usefixtures("in_an_empty_folder")
def test_what_cannot_be_flown_is_named(arguments: tuple[str, ...], message: str) -> None:
    """In one line."""
    Path("wrong.toml").write_text("heigt_m = 1.0\n", "utf-8")
    Path("late.toml").write_text('[[event]]\nat_s = 0.5\ndo = "set"\nname = "tild"\n', "utf-8")
    _, error = run("fly", "crazyflie", "--app", "crazyflie", *arguments, code=2)
    assert message in unwrapped(error)
    assert not Path("flight").exists()


def test_events_are_for_an_app() -> None:
    """Without it nothing would read them."""
    _, error = run("fly", "--events", "camera-lost", code=2)
    assert "it is for a flight with --app" in unwrapped(error)
