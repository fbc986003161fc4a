"""Read a flight log for a replay: what it says of each update of the controller, with lost rows filled."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.errors import echo
from mambo_codegen.methods import method_of
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import LogError
from mambo_sil.model.identify.columns import Column
from mambo_sil.model.identify.csv_log import read_csv
from mambo_sil.model.identify.resolution import Resolution
from mambo_sil.model.identify.signals import (
    COMMANDS,
    GROUNDED,
    HEIGHT,
    JUMP,
    JUMPS,
    LEVELLED,
    PARAMETER,
    SHIFT,
    START_THRUST,
    START_TILTS,
    TAKE_OVERS,
    TARGET,
    TARGET_ACCELERATION,
    TARGET_AHEAD,
    TARGET_HEIGHT,
    TARGET_KNOWN,
    THRUST,
    UPDATE,
    VELOCITY,
    YAW,
    FlightLog,
)
from mambo_sil.model.identify.ulog import MOTION, TRAJECTORY, read_ulog
from mambo_sil.model.replay.beginning import is_from_start, is_simulated
from mambo_sil.model.replay.flown_limits import Limits, flown_limits
from mambo_sil.model.replay.interpolation import fill
from mambo_sil.model.replay.logged_columns import (
    APP_GROUP,
    ASKED,
    DOWNWARD,
    SIGNALS,
    signals_of,
)
from mambo_sil.model.replay.update_clock import UpdateClock, read_clock

ULOG, _DATAFLASH = ".ulg", ".bin"
_BY_KNOWN: Final = ((*TARGET_ACCELERATION, TARGET_HEIGHT[2]), (*TARGET_AHEAD, TARGET_HEIGHT[3]))
"""The signals that a target has which knows its acceleration, and the one ahead."""
LONGEST_FILLED_S: Final = 0.25
"""Longest gap of a log that is filled; behind a longer one the controller begins anew."""
_FLOOR_M, _CLIMB_M = 0.05, 0.3
"""Heights over the lowest that may be the floor, and what a log must climb for them to be it."""
_ELSEWHERE_M, _UNUSUAL = 0.1, 20.0
"""Distance from where the velocity brought the drone that means another flight, and how many times the
median one it must be."""
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
    known: FloatArray
    """What each target knows (k, 1), 0 to 2; (k, 0) where the controller does not ask."""
    thrust_m_s2: FloatArray
    """Thrust over mass (k,): commanded with a height, else what the controller is given."""
    has_thrust: bool
    """Whether the log has the commanded thrust, and the settings command one."""
    start_rad: FloatArray
    """Roll and pitch (k, 2) at which the controller begins: of the log, or as measured."""
    start_m_s2: FloatArray
    """Thrust over mass (k,) at which it does."""
    shift: FloatArray
    """Jumps of the frame before each update (k, 7), as `ReferenceController.frame_jumped` takes them."""
    levelled: NDArray[np.bool_]
    """Whether its caller flew level instead (k,)."""
    begins: NDArray[np.bool_]
    """Whether the controller begins anew (k,): at a take-over, behind a long gap, or where it restarts."""
    restarts: NDArray[np.bool_]
    """Whether another flight begins (k,): the count of the updates does, or the drone is elsewhere."""
    jump: FloatArray
    """By what the frame has jumped before an update (k, 7): position, velocity, z down, and heading."""
    from_start: bool
    """Whether the log certainly begins with the first update of the controller."""
    gaps: int
    """Gaps that are too long to fill."""
    may_lie: NDArray[np.bool_]
    """Whether the drone may lie on the floor (k,), which a controller of the height is told, not the log."""
    is_exact: bool
    """Whether inputs and commands of an update are of one row, or of the same count of updates."""
    command: FloatArray
    """Roll and pitch (k, 2), and the thrust over mass (k, 3) where `has_thrust`."""
    resampled: bool
    """Whether the rows of the log are not the updates: inputs are interpolated, commands held."""
    limits: Limits
    """The limits that are set before an update."""
    changes: tuple[int, ...]
    """Updates at about which they change in flight."""
    names: tuple[str, ...]
    """Signals of the columns of state, target and command, in this order."""
    spread: FloatArray
    """Standard deviations (k, columns) of what is filled of them, 0 where it is logged."""
    resolutions: Mapping[str, Resolution]
    """How signals are rounded, by name; one with all digits is left out."""
    remarks: tuple[str, ...]

    @property
    def command_rad(self) -> FloatArray:
        """Roll and pitch (k, 2)."""
        return self.command[:, :2]


def read_inputs(path: Path, columns: Mapping[str, Column], settings: Settings) -> LoggedInputs:
    """Read the log at `path`; `columns` has those that the user named.

    A row is of the update that the log counts, or of the one at its time; where the rows of several blocks
    have times of their own, each is of the nearest update. Raises LogError.
    """
    port, commands_thrust = method_of(settings).port, settings.height is not None
    measured, wanted = signals_of(port, "state"), signals_of(port, "target")
    optional = (*TARGET_ACCELERATION, *TARGET_AHEAD, *TARGET_HEIGHT[2:]) if port.wholes("target") else ()
    log = _read(path, columns, (*measured, *wanted), optional, settings.code.prefix)
    asks = bool(port.wholes("target"))
    most_known, missing = _most_known(log, wanted)
    log = _with_zeros(log, tuple(name for name in optional if name in wanted))
    period_s = settings.horizon.update_period_s
    clock = read_clock(log, period_s)
    time_s = clock.time_s
    if len(time_s) < 2:
        raise LogError((f"{log.name}: has no two updates of {period_s:g} s",))
    has_thrust = commands_thrust and _has_commanded_thrust(log, path)
    inputs, commands = (*measured, *wanted), (*COMMANDS, THRUST) if has_thrust else COMMANDS
    needed = (*inputs, *commands)
    if clock.resampled:
        found = np.column_stack([_interpolated(log, inputs, time_s), _held(log, commands, time_s)])
    else:
        found = np.stack([_placed(log, name, clock) for name in needed], axis=1)
    is_logged: NDArray[np.bool_] = np.isfinite(np.sum(found, axis=1))
    if is_logged.sum() < 2:
        raise LogError((f"{log.name}: has no two updates with all inputs and commands",))
    filled, spread = _filled(needed, found)
    state, target, command = np.split(filled, [len(measured), len(inputs)], axis=1)
    state = state * [-1.0 if name in DOWNWARD else 1.0 for name in measured]
    contacts = [_held_or(log, one.member, time_s, 0.0) for one in port.wholes("state")]
    state = np.column_stack([state, *contacts])
    thrust_m_s2 = command[:, 2] if has_thrust else _held_or(log, THRUST, time_s, GRAVITY_M_S2)
    starts = [_held_or(log, name, time_s, state[:, 4 + axis]) for axis, name in enumerate(START_TILTS)]
    start_m_s2 = _held_or(log, START_THRUST, time_s, thrust_m_s2)
    levelled = commands_thrust & (_held_or(log, LEVELLED, time_s, 0.0) != 0.0)
    behind = _behind_gaps(is_logged, round(LONGEST_FILLED_S / period_s))
    jump = _jumps(log, time_s)
    begins = _take_overs(log, time_s) | behind
    shift = np.stack([_held_or(log, f"{SHIFT}_{axis}", time_s, 0.0) for axis in range(7)], axis=1)
    is_steady = ~(jump.any(axis=1) | shift.any(axis=1))
    restarts = clock.restarts | _elsewhere(state, is_logged & is_steady, time_s)
    if not clock.counted and all(log.signals[name].resolution is None for name in VELOCITY):
        restarts |= _at_rest(state)
    begins |= restarts
    begins |= np.diff(time_s, prepend=time_s[0]) > _PAUSE_UPDATES * period_s
    return LoggedInputs(
        name=log.name,
        time_s=time_s,
        is_logged=is_logged,
        state=state,
        target=target,
        known=_known(log, time_s, most_known) if asks else np.zeros((len(time_s), 0)),
        thrust_m_s2=thrust_m_s2,
        has_thrust=has_thrust,
        start_rad=np.stack(starts, axis=1),
        start_m_s2=start_m_s2,
        shift=shift,
        levelled=levelled,
        begins=begins,
        restarts=restarts,
        jump=jump,
        from_start=is_from_start(log, period_s),
        gaps=int(behind.sum()),
        may_lie=_near_floor(
            state[:, measured.index(HEIGHT)], 0.0 if is_simulated(log, period_s) else math.inf
        )
        if commands_thrust and GROUNDED not in log.signals
        else np.zeros_like(begins),
        is_exact=not clock.resampled and _is_of_rows(log, needed),
        command=command,
        resampled=clock.resampled,
        limits=_limits(log, settings, time_s, begins),
        changes=tuple(_changes(log, time_s)),
        names=needed,
        spread=spread,
        resolutions={
            name: signal.resolution for name, signal in log.signals.items() if signal.resolution is not None
        },
        remarks=(*log.remarks, *(missing if asks else ())),
    )


def _own(name: str, prefix: str) -> str:
    """Return the name of a column of an app whose names have `prefix`."""
    return f"{prefix}.{name.removeprefix(APP_GROUP)}" if name.startswith(APP_GROUP) else name


def _most_known(log: FlightLog, wanted: tuple[str, ...]) -> tuple[int, tuple[str, ...]]:
    """Return the most that targets can know by a log, and remarks on columns that it lacks beside others."""
    groups = [[name for name in wanted if name in names] for names in _BY_KNOWN]
    missing = [[name for name in names if name not in log.signals] for names in groups]
    most = 2 if not any(missing) else int(not missing[0])
    told = log.signals.get(TARGET_KNOWN)
    claimed = 0.0 if told is None else np.nanmax(told.value, initial=0.0)
    has = [len(lacking) < len(names) for lacking, names in zip(missing, groups, strict=True)]
    return most, tuple(
        f"no column {', '.join(lacking)}: targets count as `known` {most}"
        for known, lacking in enumerate(missing, 1)
        if lacking and most < known and (claimed >= known or any(has[known - 1 :]))
    )


def _known(log: FlightLog, time_s: FloatArray, most: int) -> FloatArray:
    """Return what each target knows (k, 1), at most `most`; raises LogError if it is not 0, 1 or 2."""
    told = _held_or(log, TARGET_KNOWN, time_s, float(most))
    wrong = told[~np.isin(told, (0.0, 1.0, 2.0))]
    if wrong.size:
        raise LogError((f"{log.name}: {TARGET_KNOWN} = {wrong[0]:g} must be 0, 1 or 2",))
    return np.minimum(told, most)[:, np.newaxis]


def _with_zeros(log: FlightLog, optional: tuple[str, ...]) -> FlightLog:
    """Return a log with zeros for the optional signals that it has not."""
    like = log.signals[TARGET[0]]
    zeros = replace(like, value=np.zeros_like(like.value), resolution=None)
    missing = {name: zeros for name in optional if name not in log.signals}
    return replace(log, signals={**log.signals, **missing})


def _read(
    path: Path,
    columns: Mapping[str, Column],
    wanted: tuple[str, ...],
    optional: tuple[str, ...],
    prefix: str,
) -> FlightLog:
    """Return the log, which has the signals `wanted` less the `optional` ones; raises LogError."""
    is_ulog = path.suffix.lower() == ULOG
    if is_ulog and columns:
        raise LogError((f"{echo(str(path))}: --columns is for CSV files; a ULog needs none",))
    if path.suffix.lower() == _DATAFLASH:
        raise LogError(
            (
                f"{echo(str(path))}: a DataFlash log (.bin) lacks the inputs of the controller's steps; "
                "replay the flight.csv of pilot",
            )
        )
    known = {
        name: tuple(replace(one, name=_own(one.name, prefix)) for one in each)
        for name, each in SIGNALS.items()
        if name in wanted or name not in ASKED
    }
    known |= {name: (Column(name),) for name in wanted if name not in SIGNALS}
    log = read_ulog(path) if is_ulog else read_csv(path, columns, known, binary=ULOG)
    missing = [name for name in wanted if name not in log.signals and name not in optional]
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


def _has_commanded_thrust(log: FlightLog, path: Path) -> bool:
    """Return whether `THRUST` is the command: always in a table, in a ULog only of our own flight mode."""
    return THRUST in log.signals and (path.suffix.lower() != ULOG or START_THRUST in log.signals)


def _placed(log: FlightLog, name: str, clock: UpdateClock) -> FloatArray:
    """Return a signal at the updates (k,), NaN where the log has none."""
    signal, found = log.signals[name], np.full(len(clock.time_s), np.nan)
    number = clock.update_of(signal.time_s)
    inside = (number >= 0) & (number < len(found))
    found[number[inside]] = signal.value[inside]
    return found


def _filled(names: tuple[str, ...], found: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return signals (k, n) with what is NaN filled, and the standard deviations (k, n) of that."""
    columns = []
    for name, value in zip(names, found.T, strict=True):
        there = np.isfinite(value)
        if there.all():
            columns.append((value, np.zeros(len(value))))
            continue
        known = value.copy()
        known[there] = np.unwrap(value[there]) if name == YAW else value[there]
        columns.append(fill(known, there))
    filled, spread = (np.stack(each, axis=1) for each in zip(*columns, strict=True))
    return filled, spread


def _changes(log: FlightLog, time_s: FloatArray) -> list[int]:
    """Return the updates at which parameters of our own flight mode change."""
    times_s = {at_s for name in _parameters(log) for at_s in log.signals[name].time_s[1:].tolist()}
    return [int(np.searchsorted(time_s, at_s)) for at_s in sorted(times_s) if time_s[0] < at_s < time_s[-1]]


def _parameters(log: FlightLog) -> list[str]:
    """Return the signals of parameters."""
    return [name for name in log.signals if name.startswith(PARAMETER)]


def _limits(log: FlightLog, settings: Settings, time_s: FloatArray, begins: NDArray[np.bool_]) -> Limits:
    """Return the limits by the parameters of our own flight mode: at beginnings, and where they change."""
    names, found = _parameters(log), {}
    for k in sorted({0, *_changes(log, time_s), *np.flatnonzero(begins).tolist()}) if names else ():
        values = _held(log, tuple(names), time_s[k : k + 1])[0].tolist()
        written = dict(zip((name.removeprefix(PARAMETER) for name in names), values, strict=True))
        limits = flown_limits(settings, written)
        if limits is not None:
            found[k] = limits
    return found


def _near_floor(height_m: FloatArray, floor_m: float) -> NDArray[np.bool_]:
    """Return whether heights (k,) are the lowest of a log that has a take-off or a landing.

    The floor is at `floor_m` or below; where it may be anywhere that is infinite.
    """
    over_m = height_m - min(float(height_m.min()), floor_m)
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


def _elsewhere(state: FloatArray, is_told: NDArray[np.bool_], time_s: FloatArray) -> NDArray[np.bool_]:
    """Return whether the drone is elsewhere than its velocity brought it (k,), as where a flight is appended.

    `is_told` says where the state is logged, and no jump of the estimate is.
    """
    passed_s = np.diff(time_s)
    moved = np.diff(state[:, :2], axis=0) - state[:-1, 2:4] * passed_s[:, np.newaxis]
    off_m = np.append(0.0, np.hypot(*moved.T))
    pair = is_told & np.append(False, is_told[:-1])
    usual_m = float(np.median(off_m[pair])) if pair.any() else 0.0
    return np.asarray(pair & (off_m > max(_ELSEWHERE_M, _UNUSUAL * usual_m)))


def _at_rest(state: FloatArray) -> NDArray[np.bool_]:
    """Return whether both velocities are 0 in every bit and were not before (k,): a flight begins."""
    moves = np.asarray(state[:, 2:4].any(axis=1))
    return np.asarray(~moves & np.append([False], moves[:-1]))


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
