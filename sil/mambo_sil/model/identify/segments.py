"""Stretches of flight on a regular grid: commands as they were held, tilts interpolated, tumbles cut out."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.signals import (
    COMMANDS,
    HEIGHT,
    POSITION,
    START_THRUST,
    THRUST,
    THRUST_COMMAND,
    TILTS,
    VELOCITY,
    YAW,
    FlightLog,
    Signal,
)

PERIOD_S: Final = 0.01
"""Period of the grid."""

SETTLE_S: Final = 2.0
"""Beginning of each stretch that fits and judgements leave out, because the model does not know its past."""

LONGEST_HELD_S: Final = 0.025
"""Median time between two samples of a command up to which it is taken as held."""
LONGEST_GAP_S: Final = 0.2
LARGEST_TILT_RAD: Final = math.radians(45.0)
TUMBLE_MARGIN_S: Final = 0.5
LOWEST_FLIGHT_M: Final = 0.3
GROUND_MARGIN_S: Final = 1.5
SHORTEST_S: Final = SETTLE_S + 2.0
"""A shorter stretch is left out."""

_VELOCITY_SPAN_S: Final = 0.1
"""Time over which positions are differentiated where a log has no velocities."""


@dataclass(frozen=True, eq=False)
class HeldCommand:
    """A command that is held from each of its times (k,) to the next; its integral is exact.

    Of a rarely logged one nobody knows what happened between two samples. It is taken as moving on evenly; if
    it was held instead, a response to it is quicker than it seems, by half the period.
    """

    time_s: FloatArray
    integral: FloatArray
    """Integral of the command (k,) from the first time on, in rad s."""
    unknown_s: float = 0.0
    """A quarter of the period of a rarely logged one: a response may be quicker by 0 to twice that."""

    @classmethod
    def of(cls, signal: Signal) -> "HeldCommand":
        """Return the command of a signal; the last value is held for ten more seconds."""
        if is_rare(signal):
            return replace(cls.of(_interpolate(signal)), unknown_s=0.25 * _mean_gap_s(signal))
        time_s = np.append(signal.time_s, signal.time_s[-1] + 10.0)
        steps = np.concatenate([[0.0], np.cumsum(np.diff(time_s) * signal.value)])
        first = signal.value[0]
        return cls(np.concatenate([[time_s[0] - 10.0], time_s]), np.concatenate([[-10.0 * first], steps]))

    def means(self, time_s: FloatArray) -> FloatArray:
        """Return the mean (m,) over the grid period that ends at each time (m,)."""
        ends = np.interp(np.append(time_s[0] - PERIOD_S, time_s), self.time_s, self.integral)
        return np.asarray(np.diff(ends) / PERIOD_S)


def is_rare(signal: Signal) -> bool:
    """Return whether a signal may change between its samples by more than its use can leave out."""
    gaps_s = np.diff(signal.time_s)
    return len(gaps_s) > 0 and LONGEST_HELD_S < float(np.median(gaps_s)) <= LONGEST_GAP_S


def _mean_gap_s(signal: Signal) -> float:
    """Return the mean length of the gap in which a time lies; gaps that no stretch spans do not count."""
    gaps_s = np.diff(signal.time_s)
    gaps_s = gaps_s[gaps_s <= LONGEST_GAP_S]
    return float(gaps_s @ gaps_s / gaps_s.sum())


def _interpolate(signal: Signal) -> Signal:
    """Return values every 5 ms or less, each in the middle of its step, on cubics (Catmull and Rom 1974).

    A gap that no stretch spans has one value, that before it.
    """
    knots_s, values = signal.time_s, signal.value
    gaps_s, rises, slopes = np.diff(knots_s), np.diff(values), np.gradient(values, knots_s)
    spanned = gaps_s <= LONGEST_GAP_S
    counts = np.where(spanned, np.ceil(2.0 * gaps_s / PERIOD_S), 1.0).astype(np.int64)
    at = np.repeat(np.arange(len(gaps_s)), counts)
    step = np.arange(len(at)) - np.repeat(np.cumsum(counts) - counts, counts)
    x = np.where(spanned[at], (step + 0.5) / counts[at], 0.0)
    bend = (1.0 - x) * (gaps_s * slopes[:-1] - rises)[at] - x * (gaps_s * slopes[1:] - rises)[at]
    middle = values[at] + x * (rises[at] + (1.0 - x) * bend)
    time_s = np.append(knots_s[at] + step / counts[at] * gaps_s[at], knots_s[-1])
    return Signal(time_s, np.append(middle, values[-1]), signal.column)


@dataclass(frozen=True, eq=False)
class Segment:
    """One stretch of flight on the grid; pairs are roll and pitch, or x and y."""

    log: str
    time_s: FloatArray
    """(m,)."""
    command: tuple[HeldCommand, HeldCommand]
    tilt_rad: FloatArray
    """(2, m)."""
    yaw_rad: FloatArray
    """(m,); 0 where the log has none."""
    velocity_m_s: FloatArray | None
    """(2, m); None where the log has neither velocity nor position."""
    thrust_m_s2: FloatArray | None
    """Thrust over mass (m,); None where the log has none."""
    height_m: FloatArray | None = None
    """(m,), up positive; None where the log has none."""
    thrust: HeldCommand | None = None
    """The commanded thrust, at least 0: rotors do not pull down; None where the log has none."""
    thrust_in_m_s2: bool = False
    """Whether `thrust` is over mass; else it has a unit of its own."""
    begun_s: float = 0.0
    """Time at which the log begins."""
    tilt_times_s: tuple[FloatArray, FloatArray] | None = None
    """Times at which rarely logged tilts were measured; None if that was often."""

    def command_means(self, axis: int, delay_s: float = 0.0) -> FloatArray:
        """Return the command (m,) of an axis, as the grid's period means, `delay_s` late."""
        return self.command[axis].means(self.time_s - delay_s)

    def as_measured(self, axis: int, tilt_rad: FloatArray) -> FloatArray:
        """Return a modelled tilt (m,) as a log would have it: interpolated where tilts are rarely logged."""
        if self.tilt_times_s is None:
            return tilt_rad
        times_s = self.tilt_times_s[axis]
        return np.interp(self.time_s, times_s, np.interp(times_s, self.time_s, tilt_rad))

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Which samples (m,) count: those after `SETTLE_S`."""
        return np.asarray(self.time_s >= self.time_s[0] + SETTLE_S)

    @property
    def first_half(self) -> NDArray[np.bool_]:
        """Which of all samples (m,) belong to the first half of the counted ones."""
        start_s, end_s = self.time_s[0] + SETTLE_S, self.time_s[-1]
        return np.asarray(self.time_s < 0.5 * (start_s + end_s))


def cut(log: FlightLog) -> list[Segment]:
    """Return the stretches of a log without gap, tumble or ground contact, each of `SHORTEST_S` or more."""
    moves = next((names for names in (VELOCITY, POSITION) if all(name in log.signals for name in names)), ())
    names = (*COMMANDS, *TILTS, *moves, *(name for name in (YAW,) if name in log.signals))
    commands = HeldCommand.of(log.signals[COMMANDS[0]]), HeldCommand.of(log.signals[COMMANDS[1]])
    found = []
    for start_s, end_s in _gapless([log.signals[name] for name in names]):
        if end_s - start_s >= SHORTEST_S:
            time_s = start_s + PERIOD_S * np.arange(int((end_s - start_s) / PERIOD_S) + 1, dtype=np.float64)
            found += _cut_stretch(log, commands, time_s)
    return found


def _cut_stretch(
    log: FlightLog, commands: tuple[HeldCommand, HeldCommand], time_s: FloatArray
) -> list[Segment]:
    """Return the stretches of a part (m,) without gaps that have neither tumble nor ground contact."""
    tilt_rad = np.stack([_onto(time_s, log.signals[name]) for name in TILTS])
    times_s = log.signals[TILTS[0]].time_s, log.signals[TILTS[1]].time_s
    tilt_times_s = times_s if any(is_rare(log.signals[name]) for name in TILTS) else None
    tumbling = np.asarray((np.abs(tilt_rad) > LARGEST_TILT_RAD).any(axis=0))
    flown = ~_widen(tumbling, TUMBLE_MARGIN_S)
    grounded = _grounded(log, time_s)
    if not grounded.all():
        flown &= ~_widen(grounded, GROUND_MARGIN_S)
    velocity = _velocity(log, time_s)
    yaw = _onto(time_s, log.signals[YAW], turn=True) if YAW in log.signals else np.zeros_like(time_s)
    thrust = log.signals.get(THRUST)
    is_measured = thrust is not None and START_THRUST not in log.signals
    thrust_m_s2 = _onto(time_s, thrust) if thrust is not None and is_measured else None
    height_m = -_onto(time_s, log.signals[HEIGHT]) if HEIGHT in log.signals else None
    sent = log.signals.get(THRUST_COMMAND, thrust)
    thrust_command = None
    if sent is not None:
        thrust_command = HeldCommand.of(replace(sent, value=np.maximum(sent.value, 0.0)))
    return [
        Segment(
            log.name,
            time_s[a:b],
            commands,
            tilt_rad[:, a:b],
            yaw[a:b],
            None if velocity is None else velocity[:, a:b],
            None if thrust_m_s2 is None else thrust_m_s2[a:b],
            None if height_m is None else height_m[a:b],
            thrust_command,
            THRUST_COMMAND not in log.signals,
            float(log.signals[COMMANDS[0]].time_s[0]),
            tilt_times_s,
        )
        for a, b in _runs(flown)
        if (b - a) * PERIOD_S >= SHORTEST_S
    ]


def tumbled(log: FlightLog) -> float:
    """Return the share of the samples of either tilt that are beyond 45 degrees, whichever has more."""
    return max(float(np.mean(np.abs(log.signals[name].value) > LARGEST_TILT_RAD)) for name in TILTS)


def duration_s(segments: Sequence[Segment]) -> float:
    """Return the time that all stretches take together."""
    return sum(len(segment.time_s) for segment in segments) * PERIOD_S


def _onto(time_s: FloatArray, signal: Signal, *, turn: bool = False) -> FloatArray:
    """Interpolate a signal; `turn` is for an angle that may jump by a whole turn."""
    value = np.unwrap(signal.value) if turn else signal.value
    return np.interp(time_s, signal.time_s, value)


def _gapless(signals: Sequence[Signal]) -> list[tuple[float, float]]:
    """Return begin and end of every time in which no signal has a gap of more than `LONGEST_GAP_S`."""
    gaps = []
    for signal in signals:
        wide = np.flatnonzero(np.diff(signal.time_s) > LONGEST_GAP_S)
        gaps += list(zip(signal.time_s[wide].tolist(), signal.time_s[wide + 1].tolist(), strict=True))
    begin_s = max(float(signal.time_s[0]) for signal in signals)
    end_s = min(float(signal.time_s[-1]) for signal in signals)
    found = []
    for gap_begin_s, gap_end_s in sorted(gaps):
        found.append((begin_s, min(gap_begin_s, end_s)))
        begin_s = max(begin_s, gap_end_s)
    return [*found, (begin_s, end_s)]


def _grounded(log: FlightLog, time_s: FloatArray) -> NDArray[np.bool_]:
    """Return when (m,) the drone is near the ground, or without a height its thrust too small to fly."""
    grounded = np.zeros(len(time_s), np.bool_)
    if HEIGHT in log.signals:
        grounded |= _onto(time_s, log.signals[HEIGHT]) > -LOWEST_FLIGHT_M
    elif THRUST in log.signals:
        grounded |= _onto(time_s, log.signals[THRUST]) < 0.3 * GRAVITY_M_S2
    return grounded


def _velocity(log: FlightLog, time_s: FloatArray) -> FloatArray | None:
    """Return the velocity (2, m) as logged, else from positions, else None."""
    if all(name in log.signals for name in VELOCITY):
        return np.stack([_onto(time_s, log.signals[name]) for name in VELOCITY])
    if not all(name in log.signals for name in POSITION):
        return None
    half = 0.5 * _VELOCITY_SPAN_S
    return np.stack(
        [
            (_onto(time_s + half, log.signals[name]) - _onto(time_s - half, log.signals[name]))
            / _VELOCITY_SPAN_S
            for name in POSITION
        ]
    )


def _widen(marked: NDArray[np.bool_], margin_s: float) -> NDArray[np.bool_]:
    """Return the marks (m,) with `margin_s` before and after each."""
    reach = 2 * round(margin_s / PERIOD_S) + 1
    return np.asarray(np.convolve(marked, np.ones(reach), mode="full")[reach // 2 :][: len(marked)] > 0.5)


def _runs(marked: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return begin and end of every run of marks."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
