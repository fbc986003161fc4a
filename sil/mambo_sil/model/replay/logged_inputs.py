"""Read a flight log for a replay: what it says of each update of the controller, with lost rows filled."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.errors import echo
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray, IntArray
from mambo_sil.errors import LogError
from mambo_sil.model.identify.columns import KNOWN, Column
from mambo_sil.model.identify.csv_log import read_csv
from mambo_sil.model.identify.signals import (
    COMMANDS,
    DEGREE,
    GROUNDED,
    HEIGHT,
    JUMP,
    JUMPS,
    LEVELLED,
    SHIFT,
    START_THRUST,
    START_TILTS,
    TAKE_OVERS,
    TARGET,
    TARGET_ACCELERATION,
    THRUST,
    UPDATE,
    UPDATES,
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
APP_GROUP: Final = "nmpc."
"""The group of the app's logs, if the prefix of its names is that by default."""
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
    UPDATE: Column("nmpc.step"),
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
    **{
        name: (Column(name),) for name in (TAKE_OVERS, UPDATE, START_THRUST, GROUNDED, LEVELLED, JUMPS, *JUMP)
    },
}
SIGNALS: Final[dict[str, tuple[Column, ...]]] = {
    name: (
        *(column for column in columns if "." not in column.name),
        *((_APP[name],) if name in _APP else ()),
        *(column for column in columns if "." in column.name and column != _APP.get(name)),
    )
    for name, columns in _OTHER.items()
}
"""Known columns of each signal, the first one that a file has is read: of trace.csv, of the app's
steps, and of the Crazyflie, whose y has the other sign. The commands are the controller's own."""

LONGEST_FILLED_S: Final = 0.25
"""Longest gap of a log that is filled; behind a longer one the controller begins anew."""
_SAME_PERIOD: Final = 0.1
"""Share by which a log's period may differ from a multiple of the update period: its rows are updates."""
_MOST_BETWEEN: Final = 2
"""Largest such multiple."""
_FLOOR_M, _CLIMB_M = 0.05, 0.3
"""Heights over the lowest that may be the floor, and what a log must climb for them to be it."""
_OF_ROWS: Final = 0.5
_SOON_S: Final = 1e-9
"""Time by which a sample may be late and still be of an update at that time: what rounding may cost."""
_PAUSE_UPDATES: Final = 5
"""Updates by which the clock must outrun the count of the updates to mean that the controller paused."""


@dataclass(frozen=True, eq=False)
class LoggedInputs:
    """What a log says of each of k updates; what it has lost is interpolated, or held from before."""

    name: str
    time_s: FloatArray
    is_logged: NDArray[np.bool_]
    """Whether the log has all inputs and the commands of an update (k,)."""
    state: FloatArray
    """Measured state (k, 7), or with a height (k, 10)."""
    target: FloatArray
    thrust_m_s2: FloatArray
    start_rad: FloatArray
    """Roll and pitch (k, 2) at which the controller begins: of the log, or as measured."""
    start_m_s2: FloatArray
    """Thrust over mass (k,) at which it does."""
    shift: FloatArray
    """Jumps of the frame before each update (k, 7), as `ReferenceController.shift` takes them."""
    levelled: NDArray[np.bool_]
    """Whether its caller flew level instead (k,)."""
    begins: NDArray[np.bool_]
    """Whether the controller begins anew (k,): at a take-over or behind a long gap."""
    jump: FloatArray
    """By what the frame has jumped before an update (k, 7): position, velocity, z down, and heading."""
    gaps: int
    """Gaps that are too long to fill."""
    may_lie: NDArray[np.bool_]
    """Whether the drone may lie on the floor (k,), which a controller of the height is told, not the log."""
    is_exact: bool
    """Whether inputs and commands of an update are of one row, or of the same count of updates."""
    command_rad: FloatArray
    """Roll and pitch (k, 2)."""
    resampled: bool
    """Whether the rows of the log are not the updates: inputs are interpolated, commands held."""
    remarks: tuple[str, ...]


def read_inputs(path: Path, columns: Mapping[str, Column], settings: Settings) -> LoggedInputs:
    """Read the log at `path`; `columns` has those that the user named.

    A row is of the update that the log counts, or of the one at its time; where the rows of several blocks
    have times of their own, each is of the nearest update. Raises LogError.
    """
    is_given, commands_thrust = settings.target.acceleration == "given", settings.height is not None
    if settings.target.acceleration == "preview":
        raise LogError(
            ('target.acceleration = "preview" cannot be replayed: no log has what came; write "given"',)
        )
    wanted: tuple[str, ...] = (*TARGET, *TARGET_ACCELERATION) if is_given else TARGET
    wanted += (TARGET_HEIGHT if is_given else TARGET_HEIGHT[:2]) if commands_thrust else ()
    measured = (*STATE, *HEIGHT_STATE) if commands_thrust else STATE
    log = _read(path, columns, (*measured, *wanted), settings.code.prefix)
    period_s = settings.horizon.update_period_s
    time_s, at = _updates(log, period_s)
    if len(time_s) < 2:
        raise LogError((f"{log.name}: has no two updates of {period_s:g} s",))
    needed = (*measured, *wanted, *COMMANDS)
    if at is None:
        found = _interpolated(log, needed[:-2], time_s)
        found = np.column_stack([found, _held(log, COMMANDS, time_s)])
    else:
        found = np.stack([_placed(log, name, at, len(time_s)) for name in needed], axis=1)
    is_logged: NDArray[np.bool_] = np.isfinite(np.sum(found, axis=1))
    if is_logged.sum() < 2:
        raise LogError((f"{log.name}: has no two updates with all inputs and commands",))
    filled = np.stack([_filled(name, found[:, k]) for k, name in enumerate(needed)], axis=1)
    state, target, command_rad = np.split(filled, [len(measured), len(measured) + len(wanted)], axis=1)
    if commands_thrust:
        own = -state[:, len(STATE) :]
        state = np.column_stack([state[:, : len(STATE)], own, _held_or(log, GROUNDED, time_s, 0.0)])
    thrust_m_s2 = _held_or(log, THRUST, time_s, GRAVITY_M_S2)
    starts = [_held_or(log, name, time_s, state[:, 4 + axis]) for axis, name in enumerate(START_TILTS)]
    start_m_s2 = _held_or(log, START_THRUST, time_s, thrust_m_s2)
    levelled = commands_thrust & (_held_or(log, LEVELLED, time_s, 0.0) != 0.0)
    behind = _behind_gaps(is_logged, round(LONGEST_FILLED_S / period_s))
    begins = _take_overs(log, time_s) | behind
    begins |= np.diff(time_s, prepend=time_s[0]) > _PAUSE_UPDATES * period_s
    return LoggedInputs(
        name=log.name,
        time_s=time_s,
        is_logged=is_logged,
        state=state,
        target=target,
        thrust_m_s2=thrust_m_s2,
        start_rad=np.stack(starts, axis=1),
        start_m_s2=start_m_s2,
        shift=np.stack([_held_or(log, f"{SHIFT}_{axis}", time_s, 0.0) for axis in range(7)], axis=1),
        levelled=levelled,
        begins=begins,
        jump=_jumps(log, time_s),
        gaps=int(behind.sum()),
        may_lie=_near_floor(state[:, -3])
        if commands_thrust and GROUNDED not in log.signals
        else np.zeros_like(begins),
        is_exact=at is not None and _is_of_rows(log, needed),
        command_rad=command_rad,
        resampled=at is None,
        remarks=log.remarks,
    )


def _own(name: str, prefix: str) -> str:
    """Return the name of a column of an app whose names have `prefix`."""
    return f"{prefix}.{name.removeprefix(APP_GROUP)}" if name.startswith(APP_GROUP) else name


def _read(path: Path, columns: Mapping[str, Column], wanted: tuple[str, ...], prefix: str) -> FlightLog:
    """Return the log, which has the signals `wanted`; raises LogError."""
    is_ulog = path.suffix.lower() == ".ulg"
    if is_ulog and columns:
        raise LogError((f"{echo(str(path))}: --columns is for CSV files; a ULog needs none",))
    known = {
        name: tuple(replace(one, name=_own(one.name, prefix)) for one in each)
        for name, each in SIGNALS.items()
        if name in wanted or name not in _ASKED
    }
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
        names = ", ".join(column.name for column in known[missing[0]])
        raise LogError(
            (f"{log.name}: has no column for {missing[0]} ({names}); name it: --columns {missing[0]}=COLUMN",)
        )
    return log


def _updates(log: FlightLog, period_s: float) -> tuple[FloatArray, Callable[[FloatArray], IntArray] | None]:
    """Return the times of the updates, and what finds the number of an update by its time.

    That is None if the rows of the commands are not the updates.
    """
    row_s = log.signals[COMMANDS[0]].time_s
    between = float(np.median(np.diff(row_s))) / period_s
    nearest = round(between)
    if not 1 <= nearest <= _MOST_BETWEEN or abs(between - nearest) > _SAME_PERIOD * nearest:
        begin_s = max(log.signals[name].time_s[0] for name in (*COMMANDS, *STATE, *TARGET))
        end_s = min(log.signals[name].time_s[-1] for name in (*COMMANDS, *STATE, *TARGET))
        return begin_s + period_s * np.arange(1 + max(int((end_s - begin_s) / period_s), -1)), None
    if UPDATE in log.signals:
        counted = log.signals[UPDATE]
        counts = np.append(0, np.cumsum(np.diff(counted.value) % UPDATES)).astype(np.int64)
        first = np.diff(counts, prepend=-1) > 0

        def counted_at(time_s: FloatArray) -> IntArray:
            """Return the numbers of the updates counted last before times, -1 before the first."""
            place = np.searchsorted(counted.time_s, time_s, side="right") - 1
            return np.where(place < 0, -1, counts[place])

        return np.interp(np.arange(counts[-1] + 1), counts[first], counted.time_s[first]), counted_at
    number = np.append(0.0, np.cumsum(np.maximum(np.round(np.diff(row_s) / period_s), 1.0)))

    def at(time_s: FloatArray) -> IntArray:
        """Return the numbers of the updates nearest to times."""
        inside = np.interp(time_s, row_s, number)
        beyond = np.minimum(time_s - row_s[0], 0.0) + np.maximum(time_s - row_s[-1], 0.0)
        return np.asarray(np.round(inside + beyond / period_s), np.int64)

    return np.interp(np.arange(number[-1] + 1.0), number, row_s), at


def _placed(log: FlightLog, name: str, at: Callable[[FloatArray], IntArray], count: int) -> FloatArray:
    """Return a signal at the updates (count,), NaN where the log has none."""
    signal, found = log.signals[name], np.full(count, np.nan)
    number = at(signal.time_s)
    inside = (number >= 0) & (number < count)
    found[number[inside]] = signal.value[inside]
    return found


def _filled(name: str, value: FloatArray) -> FloatArray:
    """Return a signal (k,) with what is NaN interpolated."""
    number, there = np.arange(len(value)), np.isfinite(value)
    known = np.unwrap(value[there]) if name == YAW and not there.all() else value[there]
    return np.where(there, value, np.interp(number, number[there], known))


def _near_floor(height_m: FloatArray) -> NDArray[np.bool_]:
    """Return whether heights (k,) are the lowest of a log that has a take-off or a landing."""
    over_m = height_m - height_m.min()
    return np.asarray(over_m < (_FLOOR_M if over_m.max() > _CLIMB_M else 0.0))


def _is_of_rows(log: FlightLog, names: tuple[str, ...]) -> bool:
    """Return whether most commands have the inputs in their own row."""
    if UPDATE in log.signals and len(log.signals[UPDATE].time_s) > len(log.signals[COMMANDS[0]].time_s):
        return True
    row_s = log.signals[COMMANDS[0]].time_s
    return all(float(np.isin(row_s, log.signals[name].time_s).mean()) > _OF_ROWS for name in names)


def _take_overs(log: FlightLog, time_s: FloatArray) -> NDArray[np.bool_]:
    """Return whether the log counts a take-over at times (k,)."""
    if TAKE_OVERS not in log.signals:
        return np.zeros(len(time_s), bool)
    begins: NDArray[np.bool_] = np.diff(_held(log, (TAKE_OVERS,), time_s)[:, 0], prepend=np.nan) != 0.0
    return begins


def _jumps(log: FlightLog, time_s: FloatArray) -> FloatArray:
    """Return by what the frame has jumped before updates (k, 7), zeros where it has not."""
    if any(name not in log.signals for name in (JUMPS, *JUMP)):
        return np.zeros((len(time_s), len(JUMP)))
    counts = _held(log, (JUMPS,), time_s)
    has_jumped = np.diff(counts, prepend=counts[:1], axis=0) > 0.0
    return np.where(has_jumped, _held(log, JUMP, time_s), 0.0)


def _behind_gaps(is_logged: NDArray[np.bool_], longest: int) -> NDArray[np.bool_]:
    """Return whether an update (k,) is the first that the log has behind more than `longest` lost ones."""
    there, begins = np.flatnonzero(is_logged), np.zeros(len(is_logged), bool)
    begins[there[1:][np.diff(there) > longest + 1]] = True
    return begins


def _held(log: FlightLog, names: tuple[str, ...], time_s: FloatArray) -> FloatArray:
    """Return signals at times (k,), each held from one sample to the next: (k, signals)."""
    signals = [log.signals[name] for name in names]
    places = [np.searchsorted(each.time_s, time_s + _SOON_S, side="right") - 1 for each in signals]
    return np.stack([each.value[np.maximum(at, 0)] for each, at in zip(signals, places, strict=True)], axis=1)


def _held_or(log: FlightLog, name: str, time_s: FloatArray, other: float | FloatArray) -> FloatArray:
    """Return a signal at times (k,), held, or `other` where the log has none."""
    if name in log.signals:
        return _held(log, (name,), time_s)[:, 0]
    return np.broadcast_to(other, (len(time_s),))


def _interpolated(log: FlightLog, names: tuple[str, ...], time_s: FloatArray) -> FloatArray:
    """Return signals at times (k,), between two samples on a straight line: (k, signals)."""
    columns = []
    for name in names:
        signal = log.signals[name]
        value = np.unwrap(signal.value) if name == YAW else signal.value
        columns.append(np.interp(time_s, signal.time_s, value))
    return np.stack(columns, axis=1)
