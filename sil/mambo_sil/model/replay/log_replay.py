"""Feed the inputs in a flight log through the compiled controller, next to the commands of the log."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.errors import echo
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray, IntArray
from mambo_sil.errors import LogError, ResultsError
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.model.identify.columns import KNOWN, Column
from mambo_sil.model.identify.csv_log import read_csv
from mambo_sil.model.identify.signals import (
    COMMANDS,
    DEGREE,
    GROUNDED,
    HEIGHT,
    LEVELLED,
    START_THRUST,
    TAKE_OVERS,
    TARGET,
    TARGET_ACCELERATION,
    THRUST,
    YAW,
    FlightLog,
)
from mambo_sil.model.identify.ulog import MOTION, TRAJECTORY, read_ulog

STATE: Final = ("x_m", "y_m", "vx_m_s", "vy_m_s", "roll_rad", "pitch_rad", "yaw_rad")
HEIGHT_STATE: Final = (HEIGHT, "vz_m_s")
"""What a controller of the height reads besides; z points down, the signals of its target up."""
TARGET_HEIGHT: Final = ("target_height_m", "target_climb_m_s", "target_climb_acceleration_m_s2")
_ASKED: Final = (*TARGET_ACCELERATION, *TARGET_HEIGHT, "vz_m_s")
"""Signals that are read only where the controller needs them."""
_APP: Final = {
    "x_m": Column("nmpc.x"),
    "y_m": Column("nmpc.y", -1.0),
    "vx_m_s": Column("nmpc.vx"),
    "vy_m_s": Column("nmpc.vy", -1.0),
    "roll_rad": Column("nmpc.inRoll"),
    "pitch_rad": Column("nmpc.inPitch"),
    "yaw_rad": Column("nmpc.inYaw", -1.0),
    "target_x_m": Column("nmpc.targetX"),
    "target_y_m": Column("nmpc.targetY", -1.0),
    "target_vx_m_s": Column("nmpc.targetVx"),
    "target_vy_m_s": Column("nmpc.targetVy", -1.0),
    "target_ax_m_s2": Column("nmpc.targetAx"),
    "target_ay_m_s2": Column("nmpc.targetAy", -1.0),
    HEIGHT: Column("nmpc.z", -1.0),
    "vz_m_s": Column("nmpc.vz", -1.0),
    "target_height_m": Column("nmpc.targetZ"),
    "target_climb_m_s": Column("nmpc.targetVz"),
    "target_climb_acceleration_m_s2": Column("nmpc.targetAz"),
    "roll_command_rad": Column("nmpc.outRoll"),
    "pitch_command_rad": Column("nmpc.outPitch"),
    TAKE_OVERS: Column("nmpc.takeOvers"),
    START_THRUST: Column("nmpc.startThrust"),
    GROUNDED: Column("nmpc.grounded"),
    LEVELLED: Column("nmpc.level"),
}
"""What the app of the Crazyflie logs of each step."""
_OTHER: Final[dict[str, tuple[Column, ...]]] = {
    **KNOWN,
    "target_x_m": (Column("target_x_m"), Column("ctrltarget.x")),
    "target_y_m": (Column("target_y_m"), Column("ctrltarget.y", -1.0)),
    "target_vx_m_s": (Column("target_vx_m_s"), Column("ctrltarget.vx")),
    "target_vy_m_s": (Column("target_vy_m_s"), Column("ctrltarget.vy", -1.0)),
    "target_ax_m_s2": (Column("target_ax_m_s2"), Column("ctrltarget.ax")),
    "target_ay_m_s2": (Column("target_ay_m_s2"), Column("ctrltarget.ay", -1.0)),
    "vz_m_s": (Column("seen_vz_m_s"), Column("vz_m_s"), Column("stateEstimate.vz", -1.0)),
    "target_height_m": (Column("target_height_m"), Column("ctrltarget.z")),
    "target_climb_m_s": (Column("target_climb_m_s"), Column("ctrltarget.vz")),
    "target_climb_acceleration_m_s2": (Column("target_climb_acceleration_m_s2"), Column("ctrltarget.az")),
    "roll_command_rad": (Column("roll_command_rad"), Column("nmpc.roll", DEGREE)),
    "pitch_command_rad": (Column("pitch_command_rad"), Column("nmpc.pitch", DEGREE)),
    **{name: (Column(name),) for name in (TAKE_OVERS, START_THRUST, GROUNDED, LEVELLED)},
}
SIGNALS: Final[dict[str, tuple[Column, ...]]] = {
    name: (
        *(column for column in columns if "." not in column.name),
        *((_APP[name],) if name in _APP else ()),
        *(column for column in columns if "." in column.name),
    )
    for name, columns in _OTHER.items()
}
"""Known columns of each signal, the first one that a file has is read: those of trace.csv, of the app's
steps, and of the Crazyflie, whose y has the other sign. The commands are those of the controller itself."""

AXES: Final = ("roll", "pitch")
CURVE_COLUMNS: Final = ("time_s", *(f"{axis}_{kind}_rad" for kind in ("logged", "replayed") for axis in AXES))

_SAME_PERIOD: Final = 0.1
"""Share by which the period of a log may differ from the update period, and its rows be the updates."""


@dataclass(frozen=True, eq=False)
class LogReplay:
    """Commands of a log and of the compiled controller on its inputs, at the k updates."""

    time_s: FloatArray
    logged_rad: FloatArray
    """Roll and pitch (k, 2)."""
    replayed_rad: FloatArray
    status: IntArray
    """Status of each update (k,)."""
    resampled: bool
    """Whether the log has another rate than the controller: inputs are interpolated, commands held."""
    remarks: tuple[str, ...]


def replay_log(path: Path, columns: Mapping[str, Column], settings: Settings) -> LogReplay:
    """Replay the log at `path`; `columns` has those that the user named.

    The controller starts level, without an estimate, as after nmpc_init(). If the log counts take-overs, it
    is reset to the present roll and pitch at the beginning and at each of them. One of the height is in the
    air where the log does not say that it was on the floor, and is not told what a mixer made of its thrust,
    which no log shows. Raises LogError.
    """
    is_given, lifts = settings.target.acceleration == "given", settings.height is not None
    wanted: tuple[str, ...] = (*TARGET, *TARGET_ACCELERATION) if is_given else TARGET
    wanted += (TARGET_HEIGHT if is_given else TARGET_HEIGHT[:2]) if lifts else ()
    measured = (*STATE, *HEIGHT_STATE) if lifts else STATE
    log = _read(path, columns, (*measured, *wanted))
    time_s, resampled = _updates(log, settings.horizon.update_period_s)
    if len(time_s) < 2:
        raise LogError((f"{log.name}: has no two updates of {settings.horizon.update_period_s:g} s",))
    inputs = _interpolated if resampled else _held
    state, target = inputs(log, measured, time_s), inputs(log, wanted, time_s)
    if lifts:
        own = -state[:, len(STATE) :]
        state = np.column_stack([state[:, : len(STATE)], own, _held_or(log, GROUNDED, time_s, 0.0)])
    thrust_m_s2 = _held_or(log, THRUST, time_s, GRAVITY_M_S2)
    start_m_s2 = _held_or(log, START_THRUST, time_s, thrust_m_s2)
    levelled = lifts & (_held_or(log, LEVELLED, time_s, 0.0) != 0.0)
    controller = CompiledController(settings)
    begins = _take_overs(log, time_s)
    steps = []
    for k in range(len(time_s)):
        if begins[k]:
            held = state[k : k + 1, 4:6]
            controller.reset(np.column_stack([held, start_m_s2[k]]) if lifts else held)
        thrust = None if lifts else thrust_m_s2[k]
        step = controller.step(state[k : k + 1], target[k : k + 1], thrust)
        if levelled[k, 0]:
            level_rad = np.zeros_like(step.command_rad)
            controller.set_command(np.column_stack([level_rad, step.thrust_m_s2]))
            step = replace(step, command_rad=level_rad)
        steps.append(step)
    return LogReplay(
        time_s,
        _held(log, COMMANDS, time_s),
        np.concatenate([step.command_rad for step in steps]).astype(np.float64),
        np.concatenate([step.status for step in steps]),
        resampled,
        log.remarks,
    )


def _read(path: Path, columns: Mapping[str, Column], wanted: tuple[str, ...]) -> FlightLog:
    """Return the log, which has the signals `wanted`; raises LogError."""
    is_ulog = path.suffix.lower() == ".ulg"
    if is_ulog and columns:
        raise LogError((f"{echo(str(path))}: --columns is for CSV files; a ULog needs none",))
    known = {name: each for name, each in SIGNALS.items() if name in wanted or name not in _ASKED}
    log = read_ulog(path) if is_ulog else read_csv(path, columns, known)
    missing = [name for name in wanted if name not in log.signals]
    if missing and is_ulog:
        raise LogError(
            (
                f"{log.name}: has no {missing[0]}; log {MOTION} and {TRAJECTORY} (SDLOG_PROFILE, high rate), "
                "and give PX4 position and velocity of the target",
            )
        )
    if missing:
        names = ", ".join(column.name for column in SIGNALS[missing[0]])
        raise LogError(
            (f"{log.name}: has no column for {missing[0]} ({names}); name it: --columns {missing[0]}=COLUMN",)
        )
    return log


def _updates(log: FlightLog, period_s: float) -> tuple[FloatArray, bool]:
    """Return the times of the updates, and whether they are not those of the logged commands."""
    begin_s = max(signal.time_s[0] for signal in log.signals.values())
    end_s = min(signal.time_s[-1] for signal in log.signals.values())
    time_s = log.signals[COMMANDS[0]].time_s
    if abs(float(np.median(np.diff(time_s))) - period_s) <= _SAME_PERIOD * period_s:
        return time_s[(time_s >= begin_s) & (time_s <= end_s)], False
    return begin_s + period_s * np.arange(1 + int((end_s - begin_s) / period_s)), True


def _take_overs(log: FlightLog, time_s: FloatArray) -> NDArray[np.bool_]:
    """Return whether the controller begins anew at times (k,)."""
    if TAKE_OVERS not in log.signals:
        return np.zeros(len(time_s), bool)
    count = _held(log, (TAKE_OVERS,), time_s)[:, 0]
    begins: NDArray[np.bool_] = np.diff(count, prepend=np.nan) != 0.0
    return begins


def _held(log: FlightLog, names: tuple[str, ...], time_s: FloatArray) -> FloatArray:
    """Return signals at times (k,), each held from one sample to the next: (k, signals)."""
    signals = [log.signals[name] for name in names]
    places = [np.searchsorted(signal.time_s, time_s, side="right") - 1 for signal in signals]
    return np.stack([signal.value[at] for signal, at in zip(signals, places, strict=True)], axis=1)


def _held_or(log: FlightLog, name: str, time_s: FloatArray, other: float | FloatArray) -> FloatArray:
    """Return a signal at times (k,), held, or `other` where the log has none: (k, 1)."""
    if name in log.signals:
        return _held(log, (name,), time_s)
    return np.broadcast_to(other, (len(time_s), 1))


def _interpolated(log: FlightLog, names: tuple[str, ...], time_s: FloatArray) -> FloatArray:
    """Return signals at times (k,), between two samples on a straight line: (k, signals)."""
    columns = []
    for name in names:
        signal = log.signals[name]
        value = np.unwrap(signal.value) if name == YAW else signal.value
        columns.append(np.interp(time_s, signal.time_s, value))
    return np.stack(columns, axis=1)


def write_curves(replay: LogReplay, path: Path) -> None:
    """Write logged and replayed commands as CSV."""
    table = np.column_stack([replay.time_s, replay.logged_rad, replay.replayed_rad])
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(CURVE_COLUMNS)
        writer.writerows(table.tolist())


def read_curves(path: Path) -> FloatArray:
    """Return the table (k, 5) of a file of `write_curves`; raises ResultsError."""
    try:
        header, *lines = csv.reader(path.read_text("utf-8").splitlines())
        table = np.array([[float(field) for field in line] for line in lines])
        if tuple(header) != CURVE_COLUMNS or table.shape[1:] != (len(CURVE_COLUMNS),):
            raise ValueError("other columns")
    except (OSError, ValueError) as error:
        raise ResultsError(f"{path}: is not what replay writes: {error}; run replay again") from error
    return table
