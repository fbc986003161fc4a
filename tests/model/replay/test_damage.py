"""Verdicts of `replay` on damaged logs: what a file or a radio loses, and what another controller did."""

from pathlib import Path
from typing import Final

import numpy as np
import pytest

from mambo_codegen.settings import controller_toml, presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.model.derive.derived_settings import controller_text
from tests.support.damaged_flights import (
    PITCH,
    ROLL,
    THRUST,
    Columns,
    Damage,
    cut,
    flown,
    gained,
    jittering,
    judged,
    late,
    lossy,
    rounded,
    same,
    scaled,
    twice,
)


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> tuple[Columns, Settings]:
    """Return the log of 18 s on a circle, and the settings that flew, which command the thrust."""
    folder = tmp_path_factory.mktemp("flight")
    source = folder / "controller.toml"
    source.write_text(controller_text(vehicle_toml.load("crazyflie"), "crazyflie"), "utf-8")
    columns = flown(folder, str(source), "--vehicle", "crazyflie", "--sensors", "mocap", "--duration-s", "18")
    return columns, controller_toml.read(source)


RIGHT: Final[dict[str, tuple[Damage, str]]] = {
    "as it is": (same, "no bit differs"),
    "4 decimals": (rounded(lambda value: np.round(value, 4)), "allowed"),
    "6 digits": (rounded(lambda value: np.array([float(f"{one:.6g}") for one in value])), "allowed"),
    "a clock that jitters": (jittering, "no bit differs"),
    "two flights": (twice, ""),
    "lost rows": (lossy, "allowed"),
    "without its first seconds": (lambda columns: {k: v[300:] for k, v in columns.items()}, "allowed"),
    "cut, with its clock set to 0": (cut, "allowed"),
}
WRONG: Final[dict[str, tuple[Damage, str]]] = {
    "sign of roll for 1 s": (scaled(ROLL, -1.0, 420, 520), " s roll is"),
    "sign of pitch for 45 %": (scaled(PITCH, -1.0, 300, 840), " s pitch is"),
    "roll 5 mrad off": (lambda columns: columns | {ROLL: columns[ROLL] + 0.005}, " s roll is"),
    "roll 2 % larger": (scaled(ROLL, 1.02), " s roll is"),
    "clamped": (lambda columns: columns | {ROLL: np.clip(columns[ROLL], -0.03, 0.03)}, " s roll is"),
    "10 ms late": (late(1), "from 0.0 to"),
    "thrust of 0": (scaled(THRUST, 0.0), " s thrust is"),
    "thrust of 0 for 1 s": (scaled(THRUST, 0.0, 420, 520), " s thrust is"),
    "thrust 1.3 times": (scaled(THRUST, 1.3), " s thrust is"),
}
OTHERS: Final = {
    "lag": ("model.roll_lag_s", 1.03),
    "drag": ("model.drag_1_s", 1.1),
    "lag of the thrust": ("height.lag_s", 1.3),
}


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", RIGHT)
def test_what_a_file_or_a_radio_loses_is_no_other_controller(
    name: str, flight: tuple[Columns, Settings], tmp_path: Path
) -> None:
    """Yes, with roll, pitch and thrust compared."""
    damage, words = RIGHT[name]
    summary = judged(damage(flight[0]), flight[1], tmp_path)
    assert (summary.verdict, summary.axes) == ("yes", ["roll", "pitch", "thrust"]), summary.reason
    assert words in summary.reason


@pytest.mark.parametrize("name", WRONG)
def test_commands_of_another_controller_are_told(
    name: str, flight: tuple[Columns, Settings], tmp_path: Path
) -> None:
    """No, with the axis, and from when to when."""
    damage, words = WRONG[name]
    summary = judged(damage(flight[0]), flight[1], tmp_path)
    assert summary.verdict == "no"
    assert words in summary.reason


@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", OTHERS)
def test_a_controller_with_another_setting_is_told(
    name: str, flight: tuple[Columns, Settings], tmp_path: Path
) -> None:
    """No: some percent of one setting, in a log that lacks nothing."""
    key, factor = OTHERS[name]
    section, field = key.split(".")
    value = getattr(getattr(flight[1], section), field)
    other = with_option(flight[1], key, round(factor * value, 6))
    assert judged(flight[0], other, tmp_path).verdict == "no"


def test_a_cut_log_tells_what_fades_from_another_setting(
    flight: tuple[Columns, Settings], tmp_path: Path
) -> None:
    """No: errors of an unknown beginning fade, those of a drag that is 10 % off stay."""
    other = with_option(flight[1], "model.drag_1_s", round(1.1 * flight[1].model.drag_1_s, 6))
    assert judged(cut(flight[0]), other, tmp_path).verdict == "no"


def test_a_limit_that_acts_only_at_the_beginning_is_told(
    flight: tuple[Columns, Settings], tmp_path: Path
) -> None:
    """No: the log begins with the controller, and so does the judgement."""
    tilt_rad = np.abs(np.stack([flight[0][ROLL], flight[0][PITCH]])).max(axis=0)
    later_rad = float(tilt_rad[100:].max())
    assert tilt_rad[:100].max() > later_rad
    slow = with_option(flight[1], "limits.braking_m_s2", 0.5)
    other = with_option(slow, "limits.tilt_rad", round(later_rad + 0.001, 6))
    summary = judged(flight[0], other, tmp_path)
    assert (summary.verdict, summary.from_s[0]) == ("no", 0.0)


def test_a_thrust_that_the_mixer_caps_is_no_other_controller(
    flight: tuple[Columns, Settings], tmp_path: Path
) -> None:
    """The controller is told, the log is not: its own log of a fast circle has other bits, and is its own."""
    source = tmp_path / "controller.toml"
    source.write_text(controller_text(vehicle_toml.load("crazyflie"), "crazyflie"), "utf-8")
    fast = ("--rate-rad-s", "2", "--sensors", "mocap", "--duration-s", "6")
    summary = judged(flown(tmp_path, str(source), "--vehicle", "crazyflie", *fast), flight[1], tmp_path)
    assert summary.verdict == "yes", summary.reason
    assert summary.equal_steps < summary.steps


def test_the_column_with_too_few_digits_is_named(flight: tuple[Columns, Settings], tmp_path: Path) -> None:
    """2 decimals tell nothing."""
    summary = judged(rounded(lambda value: np.round(value, 2))(flight[0]), flight[1], tmp_path)
    assert summary.verdict == "cannot tell"
    assert " has 2 decimals, log " in summary.reason


def test_a_log_without_the_thrust_says_so(flight: tuple[Columns, Settings], tmp_path: Path) -> None:
    """Only roll and pitch are judged."""
    columns = {name: value for name, value in flight[0].items() if name != THRUST}
    summary = judged(columns, flight[1], tmp_path)
    assert (summary.verdict, summary.axes, summary.lacks_thrust) == ("yes", ["roll", "pitch"], True)


@pytest.fixture(scope="module")
def one_norm(tmp_path_factory: pytest.TempPathFactory) -> tuple[Columns, Settings]:
    """Return the log of 8 s of a 1-norm, and its settings."""
    columns = flown(tmp_path_factory.mktemp("one-norm"), "mambo-1norm", "--duration-s", "8")
    return columns, presets.preset("mambo-1norm")


@pytest.mark.parametrize(
    ("damage", "verdict"),
    [
        (same, "yes"),
        (jittering, "yes"),
        (twice, "yes"),
        (lossy, "cannot tell"),
        (cut, "yes"),
        (rounded(lambda value: np.round(value, 4)), "cannot tell"),
        (late(1), "no"),
        (scaled(ROLL, 1.02), "no"),
        (lambda columns: lossy(gained(columns)), "no"),
        (scaled(ROLL, -1.0, 420, 520), "no"),
        (lambda columns: columns | {ROLL: columns[ROLL] + 0.05}, "no"),
    ],
)
def test_a_one_norm_is_judged_by_its_bits(
    damage: Damage, verdict: str, one_norm: tuple[Columns, Settings], tmp_path: Path
) -> None:
    """Where the log lacks something its search may go elsewhere, and never forgets it."""
    assert judged(damage(one_norm[0]), one_norm[1], tmp_path).verdict == verdict
