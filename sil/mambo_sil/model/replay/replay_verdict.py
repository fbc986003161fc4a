"""Whether a log is one of a controller: its worst second against what the log leaves open."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.signals import THRUST, TILTS
from mambo_sil.model.replay.log_replay import Axis, LogReplay

Axes = tuple[float, float, float]


@dataclass(frozen=True)
class Tolerance:
    """Largest median error of a second, of roll, pitch and thrust: in rad, rad and m/s^2.

    known:   where the log has all that the command depends on.
    begun:   in addition behind a beginning in a state that the log does not have.
    lost:    likewise behind a row that the log has lost; the larger one counts.
    begun_fades_s, lost_fades_s: time constants with which the controller forgets it.
    """

    known: Axes
    begun: Axes
    begun_fades_s: Axes
    lost: Axes
    lost_fades_s: Axes

    def at(self, axis: int, begun_s: float, complete_s: float) -> float:
        """Return the tolerance of an axis at times since a beginning, and since a lost row."""
        begun, lost = (
            largest[axis] * math.exp(-since_s / fades_s[axis]) if since_s < _NEVER_S else 0.0
            for largest, fades_s, since_s in (
                (self.begun, self.begun_fades_s, begun_s),
                (self.lost, self.lost_fades_s, complete_s),
            )
        )
        return self.known[axis] + max(begun, lost)


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
SAME: Final = 0.008
"""Largest miss of the controller that flew between lost rows: half of the motion misses less of it."""
OTHER: Final = 0.013
"""Least miss of another controller there."""
TELLS: Final = 0.03
"""Largest error that rounding and lost rows may make, over the standard deviation of the command, with which
a log tells controllers apart that differ by a few percent."""
TELLS_ONE_NORM: Final = 0.4
TELLS_M_S2: Final = 0.1
"""The same of the thrust, absolute: 1 % of the weight."""
FAR: Final = 0.5
"""Least error of another controller, over the command's standard deviation, where the log does not say which
inputs a step read."""
CALM_RAD: Final = 1e-3
"""Standard deviation of a command up to which an axis is at rest, and says nothing."""
LEAST_UPDATES: Final = 150
"""Least number of updates to judge by."""
MOST_FILLED: Final = 0.3
"""Largest share of filled updates among which the others tell controllers apart."""
SECOND_S: Final = 1.0
_LARGEST: Final = 0.999
_LEAST_JUDGED, _LEAST_FREE = 0.8, 0.1
"""Least shares of a second's updates that can be judged, and that are not at the tilt limit."""


class ReplayVerdict(StrEnum):
    """Whether a log is one of a controller."""

    YES = "yes"
    NO = "no"
    CANNOT_TELL = "cannot tell"


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

    axis: Axis
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
    return QUADRATIC if settings.cost.norm == "quadratic" else ONE_NORM


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
    found = []
    for first in range(0, max(len(error) - length // 2, 1), max(length // 2, 1)):
        rows = slice(first, first + length)
        judged = free[rows]
        if replay.settled[rows].sum() < _LEAST_JUDGED * length or judged.sum() < _LEAST_FREE * length:
            continue
        begun_s, complete_s = (float(one[rows][judged].min()) for one in (replay.begun_s, replay.complete_s))
        open_by_draws = FILLED * float(np.median(drawn[:, rows][:, judged], axis=1).max())
        tolerated = tolerance_of(replay.settings).at(k, begun_s, complete_s) + open_by_draws
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


@dataclass(frozen=True)
class Evidence:
    """What the branches of a verdict read."""

    replay: LogReplay
    axes: tuple[AxisErrors, ...]

    @property
    def judged(self) -> int:
        """Updates that can be judged."""
        return int(self.replay.settled.sum())

    @property
    def is_short(self) -> bool:
        """Whether too few updates can be judged."""
        return self.judged < LEAST_UPDATES or any(np.isnan(one.worst) for one in self.axes)

    @property
    def is_rare(self) -> bool:
        """Whether the log lacks most updates."""
        return self.replay.resampled or self.replay.share_filled > MOST_FILLED

    @property
    def is_equal(self) -> bool:
        """Whether all commands are equal in every bit."""
        return bool((self.replay.replayed == self.replay.logged).all())

    @property
    def moves(self) -> bool:
        """Whether roll or pitch move."""
        return any(one.moves for one in self.axes) or bool(
            self.replay.logged_rad.std(axis=0).max() > CALM_RAD
        )

    @property
    def is_off(self) -> bool:
        """Whether a second is farther off than tolerated."""
        return any(one.worst > one.tolerated for one in self.axes)

    @property
    def is_far(self) -> bool:
        """Whether commands are far off, whichever inputs a step read."""
        return any(one.moves and one.worst >= FAR * one.spread for one in self.axes)

    @property
    def misses(self) -> bool:
        """Whether it counts what is missed between lost rows."""
        return self.replay.filled > 0 and self.replay.settings.cost.norm == "quadratic"

    @property
    def blurred(self) -> AxisErrors | None:
        """The first axis of which rounding and lost rows leave too much open, if there is one."""
        quadratic = self.replay.settings.cost.norm == "quadratic"
        share = TELLS if quadratic else TELLS_ONE_NORM
        for one in self.axes:
            most = share * one.spread if one.is_tilt else TELLS_M_S2
            if (one.moves or not one.is_tilt) and one.expected > most:
                return one
        return None


def _missed(evidence: Evidence, least: float) -> AxisErrors | None:
    """Return an axis that misses `least` of its motion or more, and more than rounding and lost rows do."""
    if not evidence.misses:
        return None
    tilts = [one for one in evidence.axes if one.moves]
    return next((one for one in tilts if one.miss >= max(least, 1.5 * one.expected_miss)), None)


def _farthest(evidence: Evidence) -> AxisErrors:
    """Return the axis that is farthest off, by what is tolerated."""
    return max(evidence.axes, key=lambda axis: axis.worst / axis.tolerated)


def _near(evidence: Evidence) -> str:
    """Say how near the log comes to the controller."""
    one = _farthest(evidence)
    return (
        f"{one.axis.name} is {one.text(one.worst)} off in the worst second, {one.text(one.tolerated)} allowed"
    )


def _off(evidence: Evidence) -> str:
    """Say from when to when the axis that is farthest off is."""
    one = _farthest(evidence)
    return (
        f"from {one.from_s:.1f} to {one.until_s:.1f} s {one.axis.name} is {one.text(one.worst)} off "
        f"in the worst second, more than the {one.text(one.tolerated)} allowed"
    )


def _missing(evidence: Evidence, least: float) -> str:
    """Say how much of its motion an axis misses."""
    one = _missed(evidence, least)
    return "" if one is None else f"{one.axis.name} misses {100.0 * one.miss:.2g} % of its motion"


def _blur(evidence: Evidence) -> str:
    """Say which column has too few digits, or that the lost rows leave too much open."""
    one, errors = evidence.blurred, evidence.replay.input_errors
    if one is None or errors is None:
        return ""
    k, settled = evidence.axes.index(one), evidence.replay.settled
    alone = {name: float(np.median(np.abs(each[settled, k]))) for name, each in errors.alone.items()}
    name = max(alone, key=lambda each: alone[each], default="")
    if not name or alone[name] < 0.3 * one.expected:
        return (
            f"the rows that are lost leave {one.axis.name} open by {one.text(one.expected)}: log more of them"
        )
    most = TELLS * one.spread if one.is_tilt else TELLS_M_S2
    resolution = errors.resolutions[name]
    column = "thrust" if name == THRUST else name
    return f"{column} has {resolution.text}, log {resolution.finer(one.expected / most)}"


def _begins_otherwise(evidence: Evidence) -> bool:
    """Return whether a 1-norm's log that lacks nothing begins with another command.

    Such a controller is known by its bits alone.
    """
    replay = evidence.replay
    lacks = replay.filled or replay.gaps or replay.input_errors is not None or not replay.is_exact
    is_other = bool((replay.replayed[0] != replay.logged[0]).any())
    return replay.settings.cost.norm != "quadratic" and replay.from_start and not lacks and is_other


Branch = tuple[ReplayVerdict, Callable[[Evidence], bool], Callable[[Evidence], str]]
BRANCHES: Final[tuple[Branch, ...]] = (
    (ReplayVerdict.YES, lambda e: e.is_equal and e.moves, lambda _: "no bit differs"),
    (
        ReplayVerdict.CANNOT_TELL,
        lambda e: e.is_short,
        lambda e: f"{e.judged} updates can be judged, and {LEAST_UPDATES} must: log longer",
    ),
    (
        ReplayVerdict.NO,
        lambda e: e.is_far if e.is_rare or not e.replay.is_exact else e.is_off,
        _off,
    ),
    (ReplayVerdict.NO, _begins_otherwise, lambda _: "its first command is another one"),
    (
        ReplayVerdict.CANNOT_TELL,
        lambda e: e.is_rare,
        lambda _: "the log lacks most updates: log every one",
    ),
    (
        ReplayVerdict.CANNOT_TELL,
        lambda e: not e.moves,
        lambda _: "the commands hardly move: log a flight along a curve",
    ),
    (
        ReplayVerdict.CANNOT_TELL,
        lambda e: e.is_off,  # of a log that is not exact: exact ones were judged above
        lambda _: "which inputs a step read is not in its row: log those of the step",
    ),
    (ReplayVerdict.CANNOT_TELL, lambda e: e.blurred is not None, _blur),
    (
        ReplayVerdict.NO,
        lambda e: _missed(e, OTHER) is not None,
        lambda e: f"{_missing(e, OTHER)}, more than the {100.0 * OTHER:g} % that lost rows may cost",
    ),
    (
        ReplayVerdict.CANNOT_TELL,
        lambda e: _missed(e, SAME) is not None,
        lambda e: f"{_missing(e, SAME)}, and lost rows may cost that: log more of them, or a faster curve",
    ),
    (ReplayVerdict.YES, lambda _: True, _near),
)
"""Verdict, whether it holds, and its reason; the first that holds is that of a log."""


def judge(replay: LogReplay, axes: tuple[AxisErrors, ...]) -> tuple[ReplayVerdict, str]:
    """Return the verdict, and its reason in words."""
    evidence = Evidence(replay, axes)
    return next((verdict, reason(evidence)) for verdict, holds, reason in BRANCHES if holds(evidence))
