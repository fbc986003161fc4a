"""`fly --trajectory FILE.py:CLASS` and the same in campaign.toml: a class of a file is flown."""

import json
from pathlib import Path

import pytest

from tests.support.command import run, unwrapped

CURVES = """
import numpy as np


class Ellipse:
    SIGN = 1.0

    def target(self, time_s):
        t = np.asarray(time_s)
        x, y = np.sin(t), 0.5 * np.cos(t)
        return np.stack([x, y, np.cos(t), -0.5 * self.SIGN * np.sin(t)], axis=-1)

    def acceleration(self, time_s):
        t = np.asarray(time_s)
        return np.stack([-np.sin(t), -0.5 * np.cos(t)], axis=-1)


class Rising(Ellipse):
    def vertical(self, time_s):
        t = np.asarray(time_s)
        return np.stack([1.0 + 0.05 * t, np.full_like(t, 0.05), np.zeros_like(t)], axis=-1)


class Wrong(Ellipse):
    SIGN = -1.0
"""
LINE = ("--vehicle", "crazyflie", "--duration-s", "4", "--no-pictures")
CAMPAIGN = """
controllers = ["crazyflie"]

[flight]
vehicle = "crazyflie"
trajectory = {{ choice = ["curves.py:Ellipse", "points.csv", "circle"] }}
duration_s = 3.0
{more}
"""


@pytest.fixture(autouse=True)
def _curves() -> None:
    Path("curves.py").write_text(CURVES, "utf-8")
    Path("points.csv").write_text("time_s,x_m,y_m\n0,0,0\n2,0.5,0.5\n", "utf-8")


def test_a_class_of_a_file_is_flown() -> None:
    """With a height if it has one; the summary names it, and the hash of its file."""
    run("fly", "crazyflie", "--trajectory", "curves.py:Rising", *LINE)
    summary = json.loads(Path("flight/summary.json").read_text("utf-8"))
    assert summary["trajectory"] == "curves.py:Rising"
    assert len(summary["trajectory_sha256"]) == 64
    assert summary["size_m"] is None
    assert summary["metrics"]["rms_height_error_m"] < 0.1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ("curves.py:Wrong",),
            "curves.py:Wrong: at 1.57 s its velocity along y is 0.5 m/s, but its position changes by "
            "-0.5 m/s: give the derivative of the position",
        ),
        (("curves.py:Oval",), "curves.py:Oval: the file has no Oval"),
        (("curve.py:Ellipse",), "curve.py:Ellipse: there is no file curve.py"),
        (("curves.py",), "--trajectory curves.py must be bernoulli, "),
        (("curves.py:Ellipse", "--size-m", "2"), "--size-m = 2: --trajectory curves.py:Ellipse has none"),
    ],
)
def test_what_is_no_curve_is_refused(arguments: tuple[str, ...], words: str) -> None:
    """In one sentence, before anything flies."""
    _, said = run("fly", "crazyflie", "--trajectory", *arguments, *LINE, code=2)
    assert words in unwrapped(said)


def test_a_campaign_draws_curves_of_files() -> None:
    """Beside others; a flight is repeated bit for bit, and another file is another campaign."""
    Path("campaign.toml").write_text(CAMPAIGN.format(more=""), "utf-8")
    run("campaign", "campaign.toml", "--flights", "6", "--workers", "1")
    rows = Path("campaign/flights.csv").read_text("utf-8").splitlines()
    column = rows[0].split(",").index("trajectory")
    flown = {Path(row.split(",")[column]).name for row in rows[1:]}
    assert flown >= {"curves.py:Ellipse", "points.csv"}
    number = next(k for k, row in enumerate(rows[1:]) if "curves.py:Ellipse" in row)
    record = f"campaign/flights/{number:06}-crazyflie.json"
    said, _ = run("fly", "--repeat", record, "--no-pictures")
    assert "repetition: the trace equals the recorded one, bit for bit" in said
    Path("curves.py").write_text(CURVES + "\n", "utf-8")
    _, said = run("campaign", "campaign.toml", "--flights", "7", "--workers", "1", code=2)
    assert "holds another campaign, with curves." in unwrapped(said)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("curves.py:Wrong", "campaign.toml: flight.trajectory: "),
        ("curves.py:Wrong", " s its velocity along y is -0.5 m/s, but its position changes by 0.5 m/s"),
        ("curves.py:Ellipze", "the file has no Ellipze"),
        ("point.csv", "point.csv: cannot be read: No such file or directory"),
        ("oval", "must be one of bernoulli, "),
    ],
)
def test_a_campaign_names_a_bad_one(text: str, words: str) -> None:
    """Before anything flies."""
    Path("campaign.toml").write_text(f'[flight]\nvehicle = "crazyflie"\ntrajectory = "{text}"\n', "utf-8")
    _, said = run("campaign", "campaign.toml", "--flights", "1", code=2)
    assert words in unwrapped(said)
