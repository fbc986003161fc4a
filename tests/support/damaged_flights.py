"""Flight logs as columns, and what a file, a radio or another controller makes of them."""

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.model import Settings
from mambo_sil.model.replay.log_replay import replay_log
from mambo_sil.model.replay.replay_report import LogReplaySummary, summarise
from tests.support.command import run

Columns = dict[str, NDArray[np.float64]]
Damage = Callable[[Columns], Columns]
ROLL, PITCH, THRUST = "roll_command_rad", "pitch_command_rad", "thrust_acceleration_m_s2"
COURSE: Final = ("--trajectory", "circle", "--size-m", "1")


def judged(columns: Columns, settings: Settings, folder: Path) -> LogReplaySummary:
    """Write a log, and return what its replay says."""
    log = folder / "log.csv"
    with log.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(np.stack(list(columns.values()), axis=1).tolist())
    return summarise(replay_log(log, {}, settings), "log.csv", "settings", settings.digest)


def flown(folder: Path, *options: str) -> Columns:
    """Fly, and return the columns of the trace with the estimates in place of the true state."""
    course = () if "--trajectory" in options else COURSE
    run("fly", *options, *course, "--no-pictures", "-o", str(folder / "flight"))
    header, *rows = csv.reader((folder / "flight" / "trace.csv").read_text("utf-8").splitlines())
    table = np.array(rows, np.float64)
    seen = {name.removeprefix("seen_"): name for name in header if name.startswith("seen_")}
    return {name: table[:, header.index(seen.get(name, name))] for name in header if name[:5] != "seen_"}


def scaled(name: str, factor: float, first: int = 0, end: int | None = None) -> Damage:
    """Return a damage that scales a column between two rows."""

    def damage(columns: Columns) -> Columns:
        value = columns[name].copy()
        value[first:end] *= factor
        return columns | {name: value}

    return damage


def late(rows: int) -> Damage:
    """Return a damage that makes the commands of the tilt late."""
    return lambda columns: (
        columns
        | {name: np.concatenate([columns[name][:rows], columns[name][:-rows]]) for name in (ROLL, PITCH)}
    )


def rounded(round_to: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> Damage:
    """Return a damage that rounds all columns but the clock."""
    return lambda columns: {
        name: value if name == "time_s" else round_to(value) for name, value in columns.items()
    }


def jittering(columns: Columns) -> Columns:
    """Return a log whose time stamps are up to 3 ms off."""
    noise_s = np.random.default_rng(1).uniform(-0.003, 0.003, len(columns["time_s"]))
    return columns | {"time_s": columns["time_s"] + noise_s}


def twice(columns: Columns) -> Columns:
    """Return two flights one behind the other, with the clock going on."""
    passed_s = columns["time_s"][-1] - columns["time_s"][0] + 0.01
    later = columns | {"time_s": columns["time_s"] + passed_s}
    return {name: np.concatenate([columns[name], later[name]]) for name in columns}


def lossy(columns: Columns) -> Columns:
    """Return a log without a tenth of its rows."""
    kept = np.random.default_rng(2).random(len(columns["time_s"])) > 0.1
    return {name: value[kept] for name, value in columns.items()}


def cut(columns: Columns) -> Columns:
    """Return 10 s of a flight, whose clock is set to 0 where they begin."""
    later = {name: value[300:1300] for name, value in columns.items()}
    return later | {"time_s": later["time_s"] - later["time_s"][0]}


def same(columns: Columns) -> Columns:
    """Return the log itself."""
    return columns


def without_eights(columns: Columns) -> Columns:
    """Return a log that has lost eight rows at once, again and again."""
    kept = np.ones(len(columns["time_s"]), bool)
    for first in np.flatnonzero(np.random.default_rng(3).random(len(kept)) < 0.01).tolist():
        kept[first : first + 8] = False
    kept[[0, -1]] = True
    return {name: value[kept] for name, value in columns.items()}


def gained(columns: Columns) -> Columns:
    """Return a log of a controller whose roll and pitch are 2 % larger."""
    return scaled(PITCH, 1.02)(scaled(ROLL, 1.02)(columns))
