"""`fly --controller FILE.py:CLASS`: a class of a file flies."""

import json
from pathlib import Path

import pytest

from tests.support.command import run, unwrapped

LAWS = """
from gains import POSITION, VELOCITY


class Pd:
    update_period_s = 0.02

    def step(self, state, target):
        error_m, error_m_s = target.position_m - state.position_m, target.velocity_m_s - state.velocity_m_s
        x, y, _ = target.acceleration_m_s2 + POSITION * error_m + VELOCITY * error_m_s
        return y / 9.81, -x / 9.81


class Ending(Pd):
    steps = 0

    def step(self, state, target):
        self.steps += 1
        if self.steps > 50:
            raise RuntimeError("no more")
        return super().step(state, target)


class Needing:
    def __init__(self, gain):
        pass


class Idle:
    pass


class Odd(Pd):
    update_period_s = 0.0071
"""
LINE = ("--vehicle", "crazyflie", "--duration-s", "4", "--no-pictures")


@pytest.fixture(autouse=True)
def _laws() -> None:
    Path("laws.py").write_text(LAWS, "utf-8")
    Path("gains.py").write_text("POSITION, VELOCITY = 6.0, 4.0\n", "utf-8")


def test_a_class_of_a_file_flies() -> None:
    """At its own period, with what lies beside it; table and summary name it, and no settings."""
    said, _ = run("fly", "--controller", "laws.py:Pd", *LINE)
    assert said.startswith("laws.py:Pd on crazyflie: ")
    summary = json.loads(Path("flight/summary.json").read_text("utf-8"))
    assert summary["controller"] == "laws.py:Pd"
    assert summary["source"] is summary["settings"] is None
    assert summary["update_period_s"] == 0.02
    assert summary["metrics"]["rms_error_m"] < 0.15


def test_a_law_that_raises_loses_the_drone() -> None:
    """With the sentence that says why."""
    said, why = run("fly", "--controller", "laws.py:Ending", *LINE, code=1)
    assert "LOST: the drone diverged" in said
    assert "flight 0, 1 s: law.step: RuntimeError: no more" in unwrapped(why)


@pytest.mark.parametrize(
    ("named", "words"),
    [
        ("gone.py:Pd", "gone.py:Pd: there is no file gone.py"),
        ("laws.py:Gone", "laws.py:Gone: AttributeError: module 'law_laws' has no attribute 'Gone'"),
        ("laws.py:Needing", "laws.py:Needing: TypeError: Needing.__init__() missing 1"),
        ("laws.py:Idle", "laws.py:Idle: Idle has no method step(state, target)"),
        ("laws.py:Odd", "laws.py:Odd: update_period_s = 0.0071 must be a whole multiple"),
        ("nmcp", "nmcp is none of nmpc, pd, pd-feedforward, pid-feedforward, reference, FILE.py:CLASS"),
    ],
)
def test_what_is_no_law_is_refused(named: str, words: str) -> None:
    """In a sentence."""
    _, said = run("fly", "--controller", named, *LINE, code=2)
    assert words in unwrapped(said.replace("\u2502", ""))


def test_a_law_takes_no_module_s_place() -> None:
    """Whatever its file is called; and it flies on no board."""
    Path("json.py").write_text(LAWS, "utf-8")
    run("fly", "--controller", "json.py:Pd", *LINE)
    _, said = run("fly", "--controller", "laws.py:Pd", "--on", "crazyflie", *LINE, code=2)
    assert "--on crazyflie runs the C: use it with --controller nmpc only" in unwrapped(said)


def test_settings_beside_a_law_are_refused() -> None:
    """It has none."""
    _, said = run("fly", "mambo", "--controller", "laws.py:Pd", code=2)
    assert "mambo: --controller laws.py:Pd has no settings; leave it out" in unwrapped(said)
