"""Units, signs, axes and clocks of a log, recognised by size, correlation and motion.

A fault is an error whose text names the option that mends it. What a log cannot show is said, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product, starmap
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.motion import (
    AS_LOGGED,
    TURNED_RAD,
    Hypothesis,
    explained,
    fit_motion,
    heading_range_rad,
)
from mambo_sil.model.identify.segments import LARGEST_TILT_RAD, PERIOD_S, Segment
from mambo_sil.model.identify.signals import (
    COMMANDS,
    DEGREE,
    POSITION,
    REQUIRED,
    TILTS,
    VELOCITY,
    YAW,
    FlightLog,
)

NAMES: Final = ("roll", "pitch")
NO_COMMAND_RAD: Final = 0.1 * DEGREE
EXCITED_RAD: Final = 1.0 * DEGREE
"""Standard deviation of a command or tilt below which its sign is not judged."""

_OFTEN, _SELDOM = 0.05, 0.01
_HALF_TURN_RAD: Final = 1.01 * np.pi
"""Share of the samples beyond a limit from which on the angle is in degrees."""

_LAGS: Final = range(-30, 41)
"""Delays of the tilt behind the command that are tried, in grid periods."""

_LEAD: Final = -2
_CORRELATED, _RELATED, _MARGIN = 0.8, 0.5, 0.2
_EXPLAINED, _CLEARLY = 0.5, 0.3
"""Share of the motion that a reading of the signs must explain, and its lead over the log's own reading."""

_CLOCK_S: Final = 0.08
_SHIFTS_S: Final = tuple(0.02 * step for step in range(-15, 16))


@dataclass(frozen=True)
class Checked:
    """The outcome for a log: faults, each with its fix; remarks; whether tilt and velocity share a clock."""

    faults: tuple[str, ...]
    remarks: tuple[str, ...]
    one_clock: bool = True


def check_units(log: FlightLog) -> tuple[str, ...]:
    """Return a fault that names the angles that are in degrees.

    A measured angle of a tumble is beyond 45 degrees too, but never beyond half a turn; a command that is
    often beyond 45 degrees is not in radians. A column with a factor is in the unit that this says.
    """

    def often_beyond(name: str, limit_rad: float, share: float) -> bool:
        size = np.abs(log.signals[name].value)
        return "*" not in log.signals[name].column and float(np.mean(size > limit_rad)) > share

    commands = [name for name in COMMANDS if often_beyond(name, LARGEST_TILT_RAD, _OFTEN)]
    turned = [name for name in TILTS if often_beyond(name, _HALF_TURN_RAD, _SELDOM)]
    if not commands and not turned:
        return ()
    often = [name for name in REQUIRED if often_beyond(name, LARGEST_TILT_RAD, _OFTEN)]
    found = [name for name in REQUIRED if name in often or name in turned]
    fixes = ",".join(_in_degrees(log, name) for name in found)
    share = "more than 5 % of the samples of {} are beyond 0.79 rad (45 degrees), as no tumble is"
    spikes = "more than 1 % of the samples of {} are beyond half a turn"
    return (
        f"{log.name}: {(share if often else spikes).format(', '.join(found))}; are they in degrees? "
        f"Then write --columns {fixes}",
    )


def check_log(log: FlightLog, segments: Sequence[Segment]) -> Checked:
    """Check signs, axes, units and clocks of the stretches of a log."""
    longest = max(segments, key=lambda each: len(each.time_s))
    reading, why = _read_motion(segments)
    remarks = []
    if reading is None:
        remarks.append(f"{log.name}: signs not checked against the motion: {why}")
    elif reading == AS_LOGGED:
        remarks.append(f"{log.name}: units, signs and axes agree with the motion")
    if longest.velocity_m_s is not None:
        remarks += _yaw_remarks(log, segments)
    shift_s = _clock_shift_s(segments) if reading == AS_LOGGED else 0.0
    faults = []
    swapped = _swapped(longest)
    if swapped or (reading and reading.swapped):
        faults.append(_swap_fault(log, reading, swapped=swapped))
    else:
        for axis in range(2):
            faults += _axis_faults(log, longest, axis, reading)
    if reading is not None and reading.yaw < 0.0:
        faults.append(f"{log.name}: yaw turns the wrong way: --columns {_negated(log, YAW)}")
    if not faults and reading is not None:
        faults += _share_faults(log, segments)
    if abs(shift_s) > _CLOCK_S:
        remarks.append(
            f"{log.name}: measured tilt and velocity are {abs(shift_s):.2f} s apart, as if of two clocks; "
            "log commands, angles and velocity on one clock"
        )
    return Checked(tuple(faults), tuple(remarks), abs(shift_s) <= _CLOCK_S)


def _axis_faults(log: FlightLog, segment: Segment, axis: int, tilt: Hypothesis | None) -> list[str]:
    """Return the faults of sign, clock and unit of one axis."""
    command, angle = segment.command_means(axis), segment.tilt_rad[axis]
    name = NAMES[axis]
    negated = [_negated(log, each) for each in (COMMANDS[axis], TILTS[axis])]
    wrong_tilt = tilt is not None and (tilt.roll, tilt.pitch)[axis] < 0.0
    if min(command.std(), angle.std()) < 0.5 * EXCITED_RAD:
        return [_frame_fault(log, axis, negated)] if wrong_tilt else []
    lag, correlation, least = _best_lag(command, angle)
    if least < -max(_RELATED, correlation + _MARGIN):
        if tilt is None:
            fix = f"one of them has the wrong sign: --columns {negated[0]} or --columns {negated[1]}"
        elif wrong_tilt:
            fix = f"by the motion the measured one has the wrong sign: --columns {negated[1]}"
        else:
            fix = f"by the motion the commanded one has the wrong sign: --columns {negated[0]}"
        return [f"{log.name}: {name}: commanded and measured angle move against each other; {fix}"]
    faults = [_frame_fault(log, axis, negated)] if wrong_tilt else []
    if correlation > _RELATED and lag <= _LEAD:
        faults.append(
            f"{log.name}: {name}: the measured angle leads the commanded one by {-lag * PERIOD_S:.2f} s: "
            "they are of two clocks; log both on one clock"
        )
    ratio = abs(correlation) * float(angle.std() / command.std())
    for one, factor in ((COMMANDS[axis], 1.0 / ratio), (TILTS[axis], ratio)):
        if correlation > _RELATED and 0.3 / DEGREE < factor < 2.0 / DEGREE:
            fix = f"is {one} in degrees? Then write --columns {_in_degrees(log, one)}"
            if "*" in log.signals[one].column:
                columns = " and ".join(log.signals[each].column for each in (COMMANDS[axis], TILTS[axis]))
                fix = f"they are read as {columns}: one of these units is wrong"
            faults.append(f"{log.name}: {name}: measured over commanded angle is {ratio:.3g}; {fix}")
    return faults


def _frame_fault(log: FlightLog, axis: int, negated: Sequence[str]) -> str:
    """Say that both angles of an axis contradict the motion."""
    along, rule = (
        ("y", "roll is positive to the right, y points to the right of x, z down"),
        ("x", "pitch is positive with the nose up, x points ahead"),
    )[axis]
    place = 1 - axis
    others = [_negated(log, each[place]) for each in (POSITION, VELOCITY) if each[place] in log.signals]
    return (
        f"{log.name}: {NAMES[axis]}: tilt and motion along {along} contradict each other ({rule}); write "
        f"--columns {','.join(negated)} if the angles are wrong, or --columns {','.join(others)}"
    )


def _swap_fault(log: FlightLog, tilt: Hypothesis | None, *, swapped: bool) -> str:
    """Say which of commanded and measured angles are swapped, as far as known."""
    signals = log.signals

    def fix(names: tuple[str, str]) -> str:
        first, second = names
        return f"--columns {first}={signals[second].column},{second}={signals[first].column}"

    start = f"{log.name}: roll and pitch are swapped"
    if not swapped:
        return (
            f"{start}, or x and y: roll moves the drone along x and pitch along y; for the angles write "
            f"{fix(COMMANDS)},{fix(TILTS).partition(' ')[2]}, else swap x and y, or correct yaw by 90 degrees"
        )
    if tilt is None:
        return f"{start} in command or measurement: {fix(COMMANDS)} or {fix(TILTS)}"
    which, names = ("measured", TILTS) if tilt.swapped else ("commanded", COMMANDS)
    return f"{start}: by the motion the {which} angles: {fix(names)}"


def _read_motion(segments: Sequence[Segment]) -> tuple[Hypothesis | None, str]:
    """Return how angles and yaw must be read to explain the motion, or None and why it does not show that."""
    moved = [each for each in segments if each.velocity_m_s is not None]
    if not moved:
        return None, "the log has neither velocity nor position"
    if (np.concatenate([each.tilt_rad for each in moved], axis=1).std(axis=1) < EXCITED_RAD).any():
        return None, "roll or pitch moves by less than 1 degree"
    senses = (1.0, -1.0) if heading_range_rad(moved) >= TURNED_RAD else (1.0,)
    found = {
        each: explained(moved, each)
        for each in starmap(Hypothesis, product((False, True), (1.0, -1.0), (1.0, -1.0), senses))
    }
    best = max(found, key=lambda each: found[each])
    if found[best] < _EXPLAINED:
        share = f"{max(found[AS_LOGGED], 0.0):.0%}"
        return None, f"tilt explains only {share} of it; check velocity, position and yaw"
    return (best if found[best] > found[AS_LOGGED] + _CLEARLY else AS_LOGGED), ""


def _share_faults(log: FlightLog, segments: Sequence[Segment]) -> list[str]:
    """Return a fault if all angles are so large for the motion that they must be in degrees."""
    share = fit_motion(segments).acceleration_per_tilt.value
    if 0.4 <= share <= 1.5 or not 0.3 < share / DEGREE < 2.0:
        return []
    fixes = ",".join(_in_degrees(log, name) for name in REQUIRED)
    return [
        f"{log.name}: the drone accelerates by {share:.3g} g per radian; are the angles in degrees? Then "
        f"write --columns {fixes}"
    ]


def _yaw_remarks(log: FlightLog, segments: Sequence[Segment]) -> list[str]:
    """Return what is not known of yaw."""
    if YAW not in log.signals:
        return [f"{log.name}: no yaw: taken as 0 throughout"]
    if heading_range_rad(segments) < TURNED_RAD:
        return [f"{log.name}: sense of yaw not checked: the heading moves by less than 20 degrees"]
    return []


def _clock_shift_s(segments: Sequence[Segment]) -> float:
    """Return how much later than the velocity the tilt is logged."""
    found = [explained(segments, Hypothesis(late_s=shift)) for shift in _SHIFTS_S]
    best = int(np.argmax(found))
    here = found[len(_SHIFTS_S) // 2]
    return _SHIFTS_S[best] if found[best] > here + 0.02 else 0.0


def _swapped(segment: Segment) -> bool:
    """Return whether each command moves the angle of the other axis instead of its own."""
    commands = [segment.command_means(axis) for axis in range(2)]
    if min(each.std() for each in (*commands, *segment.tilt_rad)) < 0.5 * EXCITED_RAD:
        return False
    own = [_most(commands[axis], segment.tilt_rad[axis]) for axis in range(2)]
    other = [_most(commands[axis], segment.tilt_rad[1 - axis]) for axis in range(2)]
    return all(theirs > max(_CORRELATED, mine + _MARGIN) for theirs, mine in zip(other, own, strict=True))


def _most(command: FloatArray, angle: FloatArray) -> float:
    """Return the largest size of their correlation."""
    _, largest, least = _best_lag(command, angle)
    return max(largest, -least)


def _best_lag(command: FloatArray, angle: FloatArray) -> tuple[int, float, float]:
    """Return the delay, in grid periods, at which the correlation is largest, that one, and the least."""
    found = {}
    for lag in _LAGS:
        early = command[max(0, -lag) : len(command) - max(0, lag)]
        late = angle[max(0, lag) : len(angle) - max(0, -lag)]
        early, late = early - early.mean(), late - late.mean()
        found[lag] = float(early @ late / max(np.sqrt((early @ early) * (late @ late)), 1e-300))
    best = max(found, key=lambda lag: found[lag])
    return best, found[best], min(found.values())


def _negated(log: FlightLog, signal: str) -> str:
    """Return the entry of --columns that negates a signal."""
    column = log.signals[signal].column
    return f"{signal}={column[1:] if column.startswith('-') else f'-{column}'}"


def _in_degrees(log: FlightLog, signal: str) -> str:
    """Return the entry of --columns that reads a signal's column as degrees."""
    column = log.signals[signal].column
    sign = "-" if column.startswith("-") else ""
    return f"{signal}={sign}deg*{column.removeprefix('-').rpartition('*')[2]}"
