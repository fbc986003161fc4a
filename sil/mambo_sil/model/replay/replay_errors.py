"""The errors of a replay by axis: its worst second, and what is tolerated there."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.signals import TILTS
from mambo_sil.model.replay.log_replay import SETTLING_S, LoggedAxis, LogReplay

Axes = tuple[float, float, float]


@dataclass(frozen=True)
class Tolerance:
    """Largest median error of a second, of roll, pitch and thrust: in rad, rad and m/s^2.

    known:   where the log has all that the command depends on.
    begun:   in addition behind a beginning in a state that the log does not have.
    lost:    likewise behind a row that the log has lost; the larger one counts.
    capped:  likewise behind a thrust that a mixer may have capped.
    begun_fades_s, lost_fades_s: time constants with which the controller forgets it.
    for_good: what it never forgets of either.
    """

    known: Axes
    begun: Axes
    begun_fades_s: Axes
    lost: Axes
    lost_fades_s: Axes
    capped: Axes = (0.004, 0.004, 0.1)
    for_good: Axes = (0.0, 0.0, 0.0)

    def at(self, axis: int, begun_s: float, capped_s: float, complete_s: float) -> float:
        """Return the tolerance of an axis at times since a beginning, a capped thrust, and a lost row."""
        added = (
            largest[axis] * math.exp(-since_s / fades_s[axis]) if since_s < _NEVER_S else 0.0
            for largest, fades_s, since_s in (
                (self.begun, self.begun_fades_s, begun_s),
                (self.capped, self.begun_fades_s, capped_s),
                (self.lost, self.lost_fades_s, complete_s),
            )
        )
        for_good = self.for_good[axis] if min(begun_s, capped_s, complete_s) < _NEVER_S else 0.0
        return self.known[axis] + max(added) + for_good


_NEVER_S: Final = 1e6
QUADRATIC: Final = Tolerance(
    known=(8e-6, 8e-6, 2e-4),
    begun=(0.01, 0.01, 0.1),
    begun_fades_s=(2.0, 2.0, 1.0),
    lost=(4e-4, 4e-4, 0.1),
    lost_fades_s=(3.0, 3.0, 1.0),
)
"""Right logs: 0 where all is known. Behind a beginning in flight with wind 2.9 mrad after 1.25 s, which falls
with a time constant of 2.0 s; the thrust .04 mm/s^2 after 2 s. Between lost rows .13 mrad and .05 m/s^2.
Of faults the least are a velocity noise, a drag or a delay that is off by 10 to 20 %: .015, .02 and .09 mrad
in a hover; in curves a gain off by 2 %: .6 mrad."""
FIXED: Final = replace(QUADRATIC, known=(4e-5, 4e-5, 2e-3), for_good=(3e-5, 3e-5, 0.0))
"""In fixed point commands are multiples of 15 microradians and .6 mm/s^2. Right logs differ by up to four of
them for good behind a beginning in flight; faults as above by four or more."""
ONE_NORM: Final = Tolerance(
    known=(8e-6, 8e-6, 2e-4),
    begun=(0.045, 0.045, 0.1),
    begun_fades_s=(math.inf, math.inf, math.inf),
    lost=(0.045, 0.045, 0.1),
    lost_fades_s=(math.inf, math.inf, math.inf),
)
"""Its search never forgets: after one other bit right logs are up to 33 mrad off, for good."""
FILLED: Final = 2.0
"""How many times the largest of what is drawn for a second its error may be."""
SECOND_S: Final = 1.0
BEGUN: Final = 2.0
"""How many times what is left of a beginning an error may be, by those of the first second that is judged:
in right logs without rounding it fades by that time constant, and by nothing else."""
_LARGEST: Final = 0.999
_LEAST_JUDGED, _LEAST_FREE = 0.8, 0.1
"""Least shares of a second's updates that can be judged, and that are not at the tilt limit."""
CALM_RAD: Final = 1e-3
"""Standard deviation of a command up to which an axis is at rest, and says nothing."""


@dataclass(frozen=True)
class AxisErrors:
    """How a replay differs from a log along one axis, at the updates that are judged.

    worst:    the largest median error of a second, over what is tolerated there 1 or more is too much.
    from_s, until_s: times since the beginning of the log: of the seconds around the worst that are too far
              off, or of the worst alone.
    expected: the largest median error by what is drawn, of the whole flight.
    spread:   standard deviation of the logged command.
    miss:     change of the error over the change from one command to the next; half of the motion has less.
    expected_miss: the largest of what is drawn.
    """

    axis: LoggedAxis
    worst: float
    tolerated: float
    from_s: float
    until_s: float
    expected: float
    spread: float
    miss: float
    expected_miss: float

    @property
    def is_tilt(self) -> bool:
        """Whether it is roll or pitch."""
        return self.axis.unit == "rad"

    @property
    def moves(self) -> bool:
        """Whether the command of a tilt moves enough to say something."""
        return self.is_tilt and self.spread > CALM_RAD

    def text(self, value: float) -> str:
        """Return a value of the command in words."""
        return f"{1e3 * value:.2g} mrad" if self.is_tilt else f"{value:.2g} {self.axis.unit}"


def tolerance_of(settings: Settings) -> Tolerance:
    """Return the tolerance for controllers of these settings."""
    if settings.cost.norm != "quadratic":
        return ONE_NORM
    return FIXED if settings.code.scalar == "fixed" else QUADRATIC


def errors_of(replay: LogReplay) -> tuple[AxisErrors, ...]:
    """Return the errors of roll, pitch and, where the log has it, thrust; NaN if none can be judged."""
    return tuple(_axis(replay, k) for k in range(len(replay.axes)))


def _axis(replay: LogReplay, k: int) -> AxisErrors:
    """Return the errors of one axis."""
    settled, logged = replay.settled, replay.logged[:, k]
    error = np.abs(replay.replayed[:, k] - logged)
    draws = replay.input_errors
    drawn = np.abs(draws.drawn[:, :, k]) if draws is not None else np.zeros((1, len(error)))
    worst, tolerated, from_s, until_s = _worst_second(replay, k, error, drawn)
    none = not settled.any()
    misses = [_miss(one, logged, settled) for one in (replay.replayed[:, k] - logged, *_signed(replay, k))]
    return AxisErrors(
        axis=replay.axes[k],
        worst=worst,
        tolerated=tolerated,
        from_s=from_s,
        until_s=until_s,
        expected=0.0 if none else float(np.median(drawn[:, settled], axis=1).max()),
        spread=0.0 if none else float(logged[settled].std()),
        miss=misses[0],
        expected_miss=max(misses[1:], default=0.0),
    )


def _signed(replay: LogReplay, k: int) -> FloatArray:
    """Return the drawn errors (draws, k) of an axis with their sign."""
    return np.zeros((0, 0)) if replay.input_errors is None else replay.input_errors.drawn[:, :, k]


def _worst_second(
    replay: LogReplay, k: int, error: FloatArray, drawn: FloatArray
) -> tuple[float, float, float, float]:
    """Return median error and tolerance of the second that is farthest off, and from when to when."""
    length = round(SECOND_S / replay.update_period_s)
    free = replay.settled & ~_limited(replay, k)
    tolerance = _tolerance(replay, k, free)
    found = []
    for first in range(0, max(len(error) - length // 2, 1), max(length // 2, 1)):
        rows = slice(first, first + length)
        judged = free[rows]
        if replay.settled[rows].sum() < _LEAST_JUDGED * length or judged.sum() < _LEAST_FREE * length:
            continue
        begun_s, capped_s, complete_s = (
            float(one[rows][judged].min()) for one in (replay.begun_s, replay.capped_s, replay.complete_s)
        )
        open_by_draws = FILLED * float(np.median(drawn[:, rows][:, judged], axis=1).max())
        tolerated = max(tolerance.at(k, begun_s, capped_s, complete_s), open_by_draws)
        found.append((float(np.median(error[rows][judged])), tolerated, first))
    if not found:
        return np.nan, np.nan, np.nan, np.nan
    off = [median / tolerated for median, tolerated, _ in found]
    begin = end = at = int(np.argmax(off))
    while begin > 0 and off[begin - 1] > 1.0 and off[at] > 1.0:
        begin -= 1
    while end + 1 < len(off) and off[end + 1] > 1.0 and off[at] > 1.0:
        end += 1
    since_s = replay.time_s - replay.time_s[0]
    until = min(found[end][2] + length, len(since_s)) - 1
    return found[at][0], found[at][1], float(since_s[found[begin][2]]), float(since_s[until])


def _tolerance(replay: LogReplay, k: int, free: NDArray[np.bool_]) -> Tolerance:
    """Return the tolerance of an axis, whose updates in `free` (k,) are judged.

    Of a log that lacks nothing but its beginning, the first second that is judged says how large the errors
    may be: the largest tenth of them is left out. That of roll and pitch is one, as a heading mixes them.
    """
    tolerance, since_s = tolerance_of(replay.settings), replay.time_s - replay.time_s[0]
    fades_s = tolerance.begun_fades_s[k]
    is_capped_later = (since_s - replay.capped_s).max() >= SETTLING_S
    lacks_more = replay.input_errors is not None or is_capped_later
    first = free & (since_s < SETTLING_S + SECOND_S)
    if lacks_more or math.isinf(fades_s) or not first.any() or (replay.begun_s != since_s).any():
        return tolerance
    errors = np.abs(replay.replayed - replay.logged)
    largest = errors[:, :2].max(axis=1) if k < len(TILTS) else errors[:, k]
    grown = largest * np.exp(since_s / fades_s)
    left = min(tolerance.begun[k], BEGUN * float(np.quantile(grown[first], 0.9)))
    return replace(tolerance, begun=(left, left, left), capped=(left, left, left))


def _limited(replay: LogReplay, k: int) -> NDArray[np.bool_]:
    """Return whether a tilt of log and controller is the limit (k,), which is that of others, too."""
    logged, most = replay.logged[:, k], replay.settings.limits.tilt_rad
    is_largest = np.abs(logged) >= _LARGEST * most if k < len(TILTS) else np.zeros(len(logged), bool)
    return np.asarray(is_largest & (replay.replayed[:, k] == logged))


def _miss(error: FloatArray, logged: FloatArray, settled: NDArray[np.bool_]) -> float:
    """Return the change of an error over the change of the logged command: half of the motion has less."""
    change, jump = (np.abs(np.diff(one, prepend=np.nan)) for one in (logged, error))
    moving = settled & (change > 0.0)
    if not moving.any():
        return 0.0
    weight, values = change[moving], jump[moving] / change[moving]
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])
