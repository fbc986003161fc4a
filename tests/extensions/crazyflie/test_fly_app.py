"""The command fly --app."""

import json
from pathlib import Path

import pytest

from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import to_toml, with_option
from tests.support.command import run, unwrapped

HIGH = """
import numpy as np
from mambo_nmpc.curves import Circle


class High(Circle):
    def __init__(self):
        super().__init__(1.0, 0.5)

    def vertical(self, time_s):
        return np.stack([np.full(np.shape(time_s), one) for one in (12.0, 0.0, 0.0)], axis=-1)
"""


@pytest.mark.usefixtures("in_an_empty_folder")
def test_an_app_flies_an_events_file() -> None:
    """It prints measures beside bounds, and writes trace, picture and summary."""
    text, files = run("fly", "crazyflie", "--app", "crazyflie", "--events", "camera-lost")
    assert unwrapped(text).startswith("app of crazyflie on the desk's Crazyflie, camera-lost: 3 bounds kept")
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
        (("--sensors", "mambo"), "--sensors mambo must be mocap, flow-deck or lighthouse with --app"),
        (("--trajectory", "points"), "--trajectory points must be bernoulli, gerono"),
        (("--trajectory", "points.csv"), "points.csv: cannot be read"),
        (
            ("--trajectory", "high.py:High"),
            "--trajectory high.py:High: its height at 0 s, 12 m, must lie in 0.1..10 m with --app",
        ),
        (("--events", "wrung.toml"), "(did you mean wrong.toml?)"),
        (("--events", "wrong.toml"), "heigt_m is not a key of this file; did you mean height_m?"),
        (("--events", "late.toml"), "nmpc.tild is not a parameter of this app"),
    ],
)
@pytest.mark.usefixtures("in_an_empty_folder")
def test_what_cannot_be_flown_is_named(arguments: tuple[str, ...], message: str) -> None:
    """In one line."""
    Path("wrong.toml").write_text("heigt_m = 1.0\n", "utf-8")
    Path("high.py").write_text(HIGH, "utf-8")
    Path("late.toml").write_text('[[event]]\nat_s = 0.5\ndo = "set"\nname = "tild"\n', "utf-8")
    _, error = run("fly", "crazyflie", "--app", "crazyflie", *arguments, code=2)
    assert message in unwrapped(error)
    assert not Path("flight").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("duration_s = 2.0\nmeasured_from_s = 3.0", "measured_from_s = 3.0 must be less than duration_s"),
        ("height_m = 99.0", "height_m = 99.0 must lie in 0.1..10.0"),
        ('[[event]]\nat_s = -1.0\ndo = "kick"', "event.0.at_s = -1.0 must be greater than or equal to 0"),
        (
            '[[event]]\nat_s = 1.0\ndo = "nan"\nframez = 2',
            "event.0.framez is not a key of this file; did you mean",
        ),
        ("[drone]\nwind_m_s = [500.0, 0.0]", "drone.wind_m_s.0 = 500.0 must be less than or equal to 100"),
        (
            "[bounds]\noff_m = { lest = 1.0 }",
            "bounds.off_m.lest is not a key of this file; did you mean least?",
        ),
    ],
)
@pytest.mark.usefixtures("in_an_empty_folder")
def test_a_wrong_events_file_is_named_by_key_value_and_rule(text: str, message: str) -> None:
    """Also in a list."""
    Path("wrong.toml").write_text(text, "utf-8")
    _, error = run("fly", "--app", "crazyflie", "--events", "wrong.toml", code=2)
    assert message in unwrapped(error)


@pytest.mark.parametrize(
    ("option", "value"), [("--duration-s", "-1"), ("--size-m", "1000"), ("--rate-rad-s", "99")]
)
def test_a_curve_that_cannot_be_flown_is_named(option: str, value: str) -> None:
    """By option, value and rule."""
    _, error = run("fly", "--app", "crazyflie", "--trajectory", "circle", option, value, code=2)
    assert f"{option} = {float(value)} must be" in unwrapped(error)


@pytest.mark.usefixtures("in_an_empty_folder")
def test_names_with_a_prefix_are_read_and_set() -> None:
    """The app's group has the name of `code.prefix`."""
    settings = with_option(presets.preset("crazyflie"), "code.prefix", "left")
    Path("left.toml").write_text(to_toml(settings), "utf-8")
    text, _ = run("fly", "left.toml", "--app", "crazyflie", "--events", "limits-one-by-one", "--no-pictures")
    assert "1 bounds kept" in text
    assert json.loads(Path("flight/summary.json").read_text("utf-8"))["measures"]["command_rms_rad"] > 0.0


def test_events_are_for_an_app() -> None:
    """Without it nothing would read them."""
    _, error = run("fly", "--events", "camera-lost", code=2)
    assert "it is for a flight with --app" in unwrapped(error)


@pytest.mark.usefixtures("in_an_empty_folder")
def test_pieces_of_a_plan_are_flown_from_where_they_begin() -> None:
    """From the height of the first point, x ahead and y to the left, to the last point."""
    rest_to_rest = "0,0,0,0,{0},{1},{2},{3}"

    def axis(start: float, metres: float) -> str:
        numbers = (metres * factor / 3.0**power for power, factor in ((4, 35), (5, -84), (6, 70), (7, -20)))
        return f"{start}" + rest_to_rest.format(*numbers)[1:]

    header = ",".join(
        ("duration", *(f"{name}^{power}" for name in ("x", "y", "z", "yaw") for power in range(8)))
    )
    row = ",".join(("3.0", axis(0.0, 0.5), axis(0.0, 1.0), axis(0.8, 0.4), "0,0,0,0,0,0,0,0"))
    Path("lap.csv").write_text(f"{header}\n{row}\n", "utf-8")
    arguments = "--app", "crazyflie", "--trajectory", "lap.csv", "--duration-s", "5", "--no-pictures"
    run("fly", "crazyflie", *arguments)
    last = Path("flight/trace.csv").read_text("utf-8").splitlines()[-1].split(",")
    assert [float(one) for one in last[1:4]] == pytest.approx([0.5, 1.0, 1.2], abs=0.06)
