"""Verdicts of `replay` on logs that lack something: of the controller that flew, and of one 2 % off."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from mambo_codegen.settings import controller_toml, presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.model.derive.derived_settings import controller_text
from mambo_sil.model.replay.log_replay import LARGEST
from tests.support.damaged_flights import (
    PITCH,
    ROLL,
    THRUST,
    Columns,
    Damage,
    cut,
    flown,
    gained,
    judged,
    lossy,
    rounded,
    same,
    twice,
    without_eights,
)

CRAZYFLIE: Final = ("--vehicle", "crazyflie", "--sensors", "mocap")
EIGHT: Final = ("--trajectory", "bernoulli", "--size-m", "1", "--rate-rad-s", "0.9", "--duration-s", "20")
HOVER: Final = ("--trajectory", "hover", "--wind", "gusts", "--duration-s", "8")
GERONO: Final = ("--trajectory", "gerono", "--size-m", "1", "--rate-rad-s", "0.7", "--duration-s", "20")
RATTLING: Final = ("--sensors", "mambo", "--trajectory", "bernoulli", "--wind", "gusts", "--duration-s", "12")


Fly = Callable[[str], tuple[Columns, Settings]]


@pytest.fixture(scope="module")
def fly(tmp_path_factory: pytest.TempPathFactory) -> Fly:
    """Return a function that flies one of the flights, once, and returns its log and its settings."""
    made: dict[str, tuple[Columns, Settings]] = {}

    def log(name: str) -> tuple[Columns, Settings]:
        if name not in made:
            folder = tmp_path_factory.mktemp("flight")
            source = folder / "controller.toml"
            source.write_text(controller_text(vehicle_toml.load("crazyflie"), "crazyflie"), "utf-8")
            height = controller_toml.read(source)
            options, settings = {
                "eight": ((str(source), *CRAZYFLIE, *EIGHT), height),
                "float64": (
                    (str(source), "--scalar", "float64", *CRAZYFLIE, *EIGHT),
                    with_option(height, "code.scalar", "float64"),
                ),
                "fixed": (
                    (str(source), "--scalar", "fixed", *CRAZYFLIE, *EIGHT[:-1], "8"),
                    with_option(height, "code.scalar", "fixed"),
                ),
                "hover": ((str(source), *CRAZYFLIE, *HOVER), height),
                "preset": (("crazyflie", *CRAZYFLIE, *GERONO), presets.preset("crazyflie")),
                "rattling": (("mambo", *RATTLING), presets.preset("mambo")),
                "1-norm": (
                    ("mambo-1norm", "--sensors", "mambo", *EIGHT[:2], "--duration-s", "12"),
                    presets.preset("mambo-1norm"),
                ),
            }[name]
            made[name] = flown(folder, *options), settings
        return made[name]

    return log


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("damage", [lossy, without_eights, rounded(lambda value: np.round(value, 5))])
@pytest.mark.parametrize("name", ["eight", "float64", "preset"])
def test_a_gain_of_two_percent_is_told_in_a_bad_log(
    name: str, damage: Damage, fly: Fly, tmp_path: Path
) -> None:
    """And the log of the right controller is as bad, and its own."""
    columns, settings = fly(name)
    right = judged(damage(columns), settings, tmp_path)
    assert right.verdict == "yes", right.reason
    wrong = judged(damage(gained(columns)), settings, tmp_path)
    assert wrong.verdict == "no", wrong.reason


def test_what_the_whole_log_shows_is_told_where_no_second_does(fly: Fly, tmp_path: Path) -> None:
    """A fifth of the rows lost: what estimates of their states leave of a gain is allowed in every second."""
    columns, settings = fly("float64")
    kept = np.random.default_rng(3).random(len(columns[ROLL])) > 0.2
    summary = judged({name: value[kept] for name, value in gained(columns).items()}, settings, tmp_path)
    assert summary.verdict == "no"
    assert summary.reason.startswith("in the whole log roll is 0.")
    assert all(worst < most for worst, most in zip(summary.worst, summary.tolerated, strict=True))


def test_a_one_norm_that_finds_back_is_told_from_one_with_another_gain(fly: Fly, tmp_path: Path) -> None:
    """Its beginning is not known: its first velocity is noise; all later beginnings find the same moves."""
    columns, settings = fly("1-norm")
    assert judged(gained(columns), settings, tmp_path).verdict == "no"
    assert judged(lossy(columns), settings, tmp_path).verdict != "no"
    assert judged(lossy(gained(columns)), settings, tmp_path).verdict == "no"


def test_inputs_that_the_controller_refuses_are_the_reason(fly: Fly, tmp_path: Path) -> None:
    """A thrust of 0, without a yes to the beginning either."""
    columns, settings = fly("1-norm")
    summary = judged(columns | {THRUST: 0.0 * columns[THRUST]}, settings, tmp_path)
    assert (summary.verdict, summary.reason) == (
        *("no", "the controller refuses 100 % of the inputs of the log"),
    )


def test_a_beginning_at_the_tilt_limit_is_not_known(fly: Fly, tmp_path: Path) -> None:
    """Any controller has the first command of a log that begins there."""
    columns, settings = fly("rattling")
    first = int(np.flatnonzero(np.abs(columns[ROLL][300:]) >= LARGEST * settings.limits.tilt_rad)[0]) + 300
    later = {name: value[first:] for name, value in columns.items()}
    assert judged(later, settings, tmp_path).verdict == "yes"


def test_a_flight_that_begins_where_the_last_one_ended_is_another_one(fly: Fly, tmp_path: Path) -> None:
    """A hover, twice: its estimates begin at rest."""
    columns, settings = fly("hover")
    summary = judged(twice(columns), settings, tmp_path)
    assert summary.verdict == "yes", summary.reason
    assert summary.judged == 2 * len(columns[ROLL]) - 200


def test_rows_in_another_order_are_sorted(fly: Fly, tmp_path: Path) -> None:
    """By their times, and the result says so."""
    columns, settings = fly("hover")
    order = np.random.default_rng(1).permutation(len(columns[ROLL]))
    summary = judged({name: value[order] for name, value in columns.items()}, settings, tmp_path)
    assert (summary.verdict, summary.equal_steps) == ("yes", summary.steps)
    assert "in another order than their times: sorted" in summary.remarks[0]


def test_a_count_in_half_precision_is_left_out(fly: Fly, tmp_path: Path) -> None:
    """It tells every second update only; the clock tells all."""
    columns, settings = fly("hover")
    count = (3000.0 + np.arange(len(columns[ROLL]))).astype(np.float16).astype(np.float64)
    summary = judged(columns | {"update": count}, settings, tmp_path)
    assert (summary.verdict, summary.lost) == ("yes", 0)


def test_one_command_of_another_controller_is_told(fly: Fly, tmp_path: Path) -> None:
    """Where the log lacks nothing: a limit may act in a single update."""
    columns, settings = fly("hover")
    edited = columns[ROLL].copy()
    edited[500] += 0.002
    summary = judged(columns | {ROLL: edited}, settings, tmp_path)
    assert (summary.verdict, summary.reason) == (
        *("no", "from 5.0 to 5.0 s roll is 2 mrad off, more than the 0.15 mrad allowed"),
    )


@pytest.mark.parametrize("damage", [same, lossy, cut, rounded(lambda value: value.astype(np.float32))])
def test_fixed_point_has_a_tolerance_where_the_log_lacks_something(
    damage: Damage, fly: Fly, tmp_path: Path
) -> None:
    """Single precision lacks digits for it, too."""
    columns, settings = fly("fixed")
    summary = judged(damage(columns), settings, tmp_path)
    assert summary.verdict == "yes", summary.reason


def apart(columns: Columns) -> Columns:
    """Return a log that has the commands in rows of their own, 2 ms behind the inputs."""
    commands = (ROLL, PITCH, THRUST)
    table = {}
    for name, value in columns.items():
        own, other = value, np.full(len(value), np.nan)
        rows = (other, own) if name in commands else (own, other)
        table[name] = np.stack((value, value + 0.002) if name == "time_s" else rows, axis=1).reshape(-1)
    return table


def every_second(columns: Columns) -> Columns:
    """Return a log with every second row."""
    return {name: value[::2] for name, value in columns.items()}


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda columns: apart(gained(columns)), "which inputs a step read is not in its row"),
        (every_second, "the log lacks most updates: log every one"),
        (lambda columns: lossy(rounded(lambda value: np.round(value, 2))(columns)), " has 2 decimals, log "),
    ],
    ids=["apart", "rare", "coarse"],
)
def test_what_a_log_lacks_is_the_reason_that_replay_cannot_tell(
    damage: Damage, reason: str, fly: Fly, tmp_path: Path
) -> None:
    """Each with its own."""
    columns, settings = fly("eight")
    summary = judged(damage(columns), settings, tmp_path)
    assert summary.verdict == "cannot tell", summary.reason
    assert reason in summary.reason
