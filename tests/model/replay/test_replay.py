"""The command `replay`: whether the commands in a log are those of a controller."""

import csv
import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_sil.flight import trajectories
from mambo_sil.flight.trajectories import Bernoulli
from mambo_sil.model.identify.signals import TARGET, TARGET_ACCELERATION
from tests.support.command import run
from tests.support.logs import ulog

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

FLOWN = ("fly", "--duration-s", "4", "--no-pictures")


def replayed(*arguments: str, code: int = 0) -> dict[str, Any]:
    """Replay a log; return the summary."""
    summary: dict[str, Any] = json.loads(run("replay", *arguments, "--json", code=code)[0])
    return summary


def trace_rows() -> list[dict[str, str]]:
    """Return the rows of the last flight."""
    return list(csv.DictReader(Path("flight/trace.csv").read_text("utf-8").splitlines()))


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    "options",
    [
        ["mambo"],
        ["mambo", "--scalar", "fixed"],
        ["mambo-1norm", "--scalar", "float64"],
    ],
)
def test_a_simulated_flight_is_repeated_bit_for_bit(options: list[str]) -> None:
    """Its trace is a log: with take-off, whose thrust is refused, gusts, and the states that sensors saw."""
    run(*FLOWN, *options, "--start", "take-off", "--sensors", "mambo", "--wind", "gusts")
    summary = replayed("flight/trace.csv", *options)
    assert (summary["steps"], summary["equal_steps"], summary["first_different_s"]) == (901, 901, None)
    assert summary["refused"] >= 70


@pytest.mark.long
def test_a_controller_of_the_height_is_repeated_bit_for_bit() -> None:
    """In space and on a level course, whose height is in its trace too."""
    run("design", "crazyflie", "-o", "height.toml")
    drone = ("height.toml", "--vehicle", "crazyflie", "--sensors", "mocap")
    run(*FLOWN, *drone, "--trajectory", "helix", "--size-m", "1")
    summary = replayed("flight/trace.csv", "height.toml")
    assert (summary["steps"], summary["equal_steps"]) == (401, 401)
    run(*FLOWN, *drone, "-o", "level")
    summary = replayed("level/trace.csv", "height.toml")
    assert (summary["steps"], summary["equal_steps"]) == (401, 401)


@pytest.mark.long
def test_another_controller_is_told_apart() -> None:
    """Exit 1: its commands are others; of the same one in another scalar type only the last digits are."""
    run(*FLOWN)
    said, _ = run("replay", "flight/trace.csv", "mambo-1norm", code=1)
    assert said.startswith("NOT THIS CONTROLLER, or not its inputs: from ")
    summary = replayed("flight/trace.csv", "--scalar", "float64")
    assert (summary["verdict"], summary["equal_steps"] < 10) == ("yes", True)
    assert max(summary["rms"]) < 1e-6


@pytest.mark.long
def test_where_a_log_begins_to_differ_is_told() -> None:
    """One command with another last digit."""
    run(*FLOWN)
    rows = trace_rows()
    rows[123]["roll_command_rad"] = repr(math.nextafter(float(rows[123]["roll_command_rad"]), 1.0))
    with Path("edited.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    summary = replayed("edited.csv")
    assert (summary["equal_steps"], summary["first_different_s"]) == (400, pytest.approx(1.23))
    assert summary["verdict"] == "yes"


def crazyflie_log(rows: list[dict[str, str]], commands: str) -> Iterator[list[object]]:
    """Yield a log as a Crazyflie's client writes it: its frame, degrees, ms, three blocks."""
    degrees = math.degrees(1.0)
    blocks = {
        commands: {"roll": ("roll_command_rad", degrees), "pitch": ("pitch_command_rad", degrees)},
        "ctrltarget": {
            "x": ("target_x_m", 1.0),
            "y": ("target_y_m", -1.0),
            "vx": ("target_vx_m_s", 1.0),
            "vy": ("target_vy_m_s", -1.0),
        },
        "stateEstimate": {
            "x": ("x_m", 1.0),
            "y": ("y_m", -1.0),
            "vx": ("vx_m_s", 1.0),
            "vy": ("vy_m_s", -1.0),
            "roll": ("roll_rad", degrees),
            "pitch": ("pitch_rad", degrees),
            "yaw": ("yaw_rad", -degrees),
        },
    }
    names = [f"{block}.{name}" for block, columns in blocks.items() for name in columns]
    yield ["Timestamp", *names]
    for number, row in enumerate(rows):
        for delay, (block, columns) in enumerate(blocks.items()):
            values = {f"{block}.{name}": f"{k * float(row[of]):.7g}" for name, (of, k) in columns.items()}
            yield [10 * number + delay, *(values.get(name, "") for name in names)]


@pytest.mark.first_is_quick
@pytest.mark.parametrize("commands", ["nmpc", "mine"])
def test_a_crazyflie_log_is_replayed_without_options(
    commands: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seven digits, blocks one after the other; an own prefix is named by --columns."""
    monkeypatch.setattr(trajectories, "MOST_KNOWN", 0)
    run(*FLOWN, "crazyflie", "--vehicle", "crazyflie", "--push", "0.3,0.2", "--yaw-rad", "0.4")
    with Path("flight.csv").open("w", newline="") as file:
        csv.writer(file).writerows(crazyflie_log(trace_rows(), commands))
    named = [f"{axis}_command_rad=deg*mine.{axis}" for axis in ("roll", "pitch")]
    options = ["--columns", ",".join(named)] if commands == "mine" else []
    summary = replayed("flight.csv", "crazyflie", *options)
    assert summary["verdict"] == "yes"
    assert max(summary["rms"]) < 1e-5
    assert {path.name for path in (tmp_path / "replayed").iterdir()} == {
        *("replay.csv", "replay.png", "replay.svg", "summary.json")
    }
    run("report", "replayed", "-o", "page.html")
    page = (tmp_path / "page.html").read_text("utf-8")
    assert "the commands of the log are those of this controller: " in page
    assert 'aria-label="Commands over time' in page


def trace_columns() -> dict[str, NDArray[np.float64]]:
    """Return the columns of the last flight, with the acceleration of its target, the eight."""
    rows = trace_rows()
    columns = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    acceleration = Bernoulli(2.0, 0.5).acceleration(columns["time_s"])
    return columns | {name: acceleration[:, k] for k, name in enumerate(TARGET_ACCELERATION)}


@pytest.mark.parametrize(
    ("source", "target"), [("mambo", TARGET), ("observed.toml", (*TARGET, *TARGET_ACCELERATION))]
)
def test_a_ulog_is_replayed(source: str, target: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """A quaternion costs the last digits; a target's acceleration is known if the log has it."""
    write_observed()
    monkeypatch.setattr(trajectories, "MOST_KNOWN", int(target != TARGET))
    run(*FLOWN, source, "--push", "0.3,0.2")
    Path("flight.ulg").write_bytes(ulog(trace_columns(), quaternion=False, target=target))
    summary = replayed("flight.ulg", source)
    assert (summary["steps"], summary["resampled"], summary["verdict"]) == (401, False, "yes")
    assert max(summary["rms"]) < 1e-6


def write_columns(names: Sequence[str], path: str) -> None:
    """Write these columns of the last flight."""
    columns = trace_columns()
    rows = np.stack([columns[name] for name in names], axis=1).tolist()
    Path(path).write_text("\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows)]), "utf-8")


def test_what_a_target_knows_is_read_from_a_trace() -> None:
    """Bit for bit; a log without the accelerations is one of targets that know less, and other commands."""
    write_observed()
    run(*FLOWN, "observed.toml")
    summary = replayed("flight/trace.csv", "observed.toml")
    assert summary["equal_steps"] == summary["steps"] == 401
    names = list(trace_rows()[0])
    told = [name for name in names if name.startswith("target_a") or name == "target_known"]
    assert len(told) == 5
    for left_out in (("target_known",), (*told[2:],), (*told,)):
        write_columns([name for name in names if name not in left_out], "flight.csv")
        summary = replayed("flight.csv", "observed.toml", code=0 if left_out == ("target_known",) else 1)
        assert (summary["equal_steps"] == 401) == (left_out == ("target_known",))
        assert max(summary["rms"]) < 0.05


@pytest.mark.parametrize("known", ["3", "1.5", "-1"])
def test_what_a_target_cannot_know_is_refused(known: str) -> None:
    """With its value."""
    write_observed()
    run(*FLOWN, "observed.toml")
    names = [*trace_rows()[0]]
    write_columns(names, "flight.csv")
    text = Path("flight.csv").read_text("utf-8").splitlines()
    row, column = text[40].split(","), names.index("target_known")
    text[40] = ",".join([*row[:column], known, *row[column + 1 :]])
    Path("flight.csv").write_text("\n".join(text), "utf-8")
    assert (
        f"target_known = {known} must be 0, 1 or 2" in run("replay", "flight.csv", "observed.toml", code=2)[1]
    )


@pytest.mark.parametrize(
    ("left_out", "words"),
    [
        (("target_ahead_x_m_s2",), "no column target_ahead_x_m_s2: targets count as `known` 1"),
        (
            (*TARGET_ACCELERATION, "target_known"),
            "no column target_ax_m_s2, target_ay_m_s2: targets count as `known` 0",
        ),
    ],
)
def test_columns_that_a_log_lacks_are_named(left_out: tuple[str, ...], words: str) -> None:
    """Beside those that it has: the targets then knew more than the replay."""
    write_observed()
    run(*FLOWN, "observed.toml")
    write_columns([name for name in trace_rows()[0] if name not in left_out], "flight.csv")
    assert words in " ".join(run("replay", "flight.csv", "observed.toml", code=1)[0].split())


def test_a_ulog_without_the_target_is_refused() -> None:
    """PX4 may be given a position alone; and a ULog has no columns to name."""
    run(*FLOWN)
    missing: dict[str, tuple[str, ...]] = {"target_x_m": (), "target_vx_m_s": TARGET[:2]}
    for name, target in missing.items():
        message = f"has no {name}; log vehicle_local_position and trajectory_setpoint"
        Path("flight.ulg").write_bytes(ulog(trace_columns(), quaternion=True, target=target))
        assert message in run("replay", "flight.ulg", code=2)[1]
    assert "a ULog needs none" in run("replay", "flight.ulg", "--columns", "x_m=x", code=2)[1]


def write_observed() -> None:
    """Write preset mambo with an observed target to observed.toml."""
    run("init", "-o", "observed.toml")


def test_a_log_of_another_rate_is_interpolated() -> None:
    """77 rows a second: the controller runs at its own. Such a log tells nothing, nor every second row."""
    run(*FLOWN)
    columns = trace_columns()
    time_s = np.arange(0.0, 4.0, 0.013)
    slow = np.stack([np.interp(time_s, columns["time_s"], value) for value in columns.values()], axis=1)
    rows = np.stack(list(columns.values()), axis=1)[::2]
    for table, resampled, steps in ((slow, True, 400), (rows, False, 201)):
        lines = [",".join(columns), *(",".join(map(repr, row)) for row in table.tolist())]
        Path("rare.csv").write_text("\n".join(lines), "utf-8")
        summary = replayed("rare.csv", code=2)
        assert (summary["resampled"], summary["steps"]) == (resampled, steps)
        assert max(summary["rms"]) < 0.01


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.csv"], "none.csv: there is no such file"),
        (
            ["short.csv"],
            "short.csv: has no column for target_x_m (target_x_m, nmpc.targetX, ctrltarget.x); name it",
        ),
        (["flight.ulg"], "flight.ulg: is no ULog"),
        (["flight.bin"], "flight.bin: a DataFlash log (.bin) lacks the inputs of the controller's steps"),
        (["flight.dat"], "line 1: is not UTF-8; save the log as CSV in UTF-8, or name a .ulg"),
        (["short.csv", "--columns", "targt_x_m=x"], "must begin with target_x_m"),
    ],
)
def test_a_log_that_cannot_be_replayed_is_refused(arguments: list[str], message: str, tmp_path: Path) -> None:
    """Exit 2, and nothing is written."""
    (tmp_path / "short.csv").write_text("time_s,roll_command_rad\n0,0\n", "utf-8")
    (tmp_path / "flight.ulg").write_bytes(b"ULog")
    for name in ("flight.bin", "flight.dat"):
        (tmp_path / name).write_bytes(b"\xa3\x95\x80")
    before = sorted(tmp_path.iterdir())
    assert message in run("replay", *arguments, code=2)[1]
    assert sorted(tmp_path.iterdir()) == before
