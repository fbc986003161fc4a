"""The errors of a replay by axis: its worst second and its trends, and what is tolerated of them."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.identify.signals import TILTS
from mambo_sil.model.replay.input_errors import LATE
from mambo_sil.model.replay.log_replay import LARGEST, LoggedAxis, LogReplay

Axes = tuple[float, float, float]

KNOWN: Final[Axes] = (3e-6, 3e-6, 6e-5)
"""Largest median error of a second, of roll, pitch and thrust in rad, rad and m/s^2, where the log has all
that the command depends on. Right logs: 0; with another type of float 1.2e-6 and 2.8e-5. Of faults the least
are a velocity noise, a drag or a delay that is off by 10 to 20 %: .015, .02 and .09 mrad in a hover."""
FIXED_POINT: Final[Axes] = (7e-5, 7e-5, 2e-3)
"""The same in fixed point, whose commands are multiples of 15 microradians and .6 mm/s^2, where the log lacks
something, if only the digits beyond single precision: right logs differ by up to four of them for good."""
CAPPED: Final[Axes] = (0.004, 0.004, 0.1)
"""Allowed in addition behind a thrust that a mixer may have capped; it fades with `CAPPED_FADES_S`."""
CAPPED_FADES_S: Final[Axes] = (2.0, 2.0, 1.0)
ESTIMATED: Final[Axes] = (1e-4, 1e-4, 0.0)
"""Allowed in addition behind a lost row: what an estimate by slopes of small changes leaves."""
SPREADS: Final = 5.0
"""How many standard deviations, by what is drawn, a right log may be off."""
LEAST_TRENDS: Final = {"gain": 5e-4, "offset": 2e-5, "delay": 5e-4}
"""Trends that are no fault: a gain, an offset in rad (of the thrust 100 times that), and a delay in s."""
SECOND_S: Final = 1.0
MOMENT_FACTOR: Final = 50.0
"""What is tolerated of one update, over that of a second: last digits are off by up to half of that, and a
limit that acts by much more."""
_LEAST_JUDGED, _LEAST_FREE = 0.8, 0.1
"""Least shares of a second's updates that can be judged, and that are not at the tilt limit."""
CALM_RAD: Final = 1e-3
"""Standard deviation of a command up to which an axis is at rest, and says nothing."""
_CALM_M_S2: Final = 0.05
_LEAST_SHAPE: Final = 1e-9


@dataclass(frozen=True)
class Trend:
    """What a whole log has of one kind of error, a gain, an offset or a delay, and what is tolerated.

    open: what is tolerated because of few digits and lost rows, without an unknown beginning.
    """

    kind: str
    value: float
    tolerated: float
    open: float

    @property
    def is_off(self) -> bool:
        """Whether it is more than tolerated."""
        return abs(self.value) > self.tolerated


@dataclass(frozen=True)
class AxisErrors:
    """How a replay differs from a log along one axis, at the updates that are judged.

    worst:    the largest median error of a second, over what is tolerated there 1 or more is too much.
    from_s, until_s: times since the beginning of the log: of the seconds around the worst that are too far
              off, or of the worst alone.
    expected: the median error by what is drawn, of the whole flight.
    spread:   standard deviation of the logged command.
    trends:   of the whole log; none of one that lacks nothing.
    """

    axis: LoggedAxis
    worst: float
    tolerated: float
    from_s: float
    until_s: float
    expected: float
    spread: float
    trends: tuple[Trend, ...]

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

    def trend_text(self, trend: Trend) -> str:
        """Return a trend in words."""
        if trend.kind == "offset":
            return f"{self.text(abs(trend.value))} off in the mean, {self.text(trend.tolerated)} allowed"
        if trend.kind == "delay":
            way = "late" if trend.value > 0.0 else "early"
            return f"{1e3 * abs(trend.value):.2g} ms {way}, {1e3 * trend.tolerated:.2g} ms allowed"
        way = "larger" if trend.value > 0.0 else "less"
        return f"{100.0 * abs(trend.value):.2g} % {way}, {100.0 * trend.tolerated:.2g} % allowed"


def known_of(replay: LogReplay, k: int) -> float:
    """Return what is tolerated of an axis besides what is drawn."""
    has_all = replay.input_errors is None and not replay.is_single
    return KNOWN[k] if has_all or replay.settings.code.scalar != "fixed" else FIXED_POINT[k]


def errors_of(replay: LogReplay) -> tuple[AxisErrors, ...]:
    """Return the errors of roll, pitch and, where the log has it, thrust; NaN if none can be judged."""
    return tuple(_axis(replay, k) for k in range(len(replay.axes)))


def _axis(replay: LogReplay, k: int) -> AxisErrors:
    """Return the errors of one axis."""
    settled, logged = replay.settled, replay.logged[:, k]
    error = replay.replayed[:, k] - logged
    draws = replay.input_errors
    drawn = draws.drawn[:, :, k] if draws is not None else np.zeros((1, len(error)))
    worst, tolerated, from_s, until_s = _worst(replay, k, np.abs(error), np.abs(drawn))
    none = not settled.any()
    return AxisErrors(
        axis=replay.axes[k],
        worst=worst,
        tolerated=tolerated,
        from_s=from_s,
        until_s=until_s,
        expected=0.0 if none else _open(np.abs(drawn[:, settled])),
        spread=0.0 if none else float(logged[settled].std()),
        trends=() if none or draws is None else _trends(replay, k, error, drawn),
    )


def _open(drawn: FloatArray) -> float:
    """Return the root mean square, over draws, of median errors (draws, k)."""
    return float(np.sqrt((np.median(drawn, axis=1) ** 2).mean()))


def _trends(replay: LogReplay, k: int, error: FloatArray, drawn: FloatArray) -> tuple[Trend, ...]:
    """Return the trends of an error (k,) of an axis, and what those (draws, k) that are drawn allow.

    A draw is a log that may have been: its commands are those of the replay without the error.
    """
    rows = replay.settled & ~_limited(replay, k)
    if not rows.any():
        return ()
    shapes = _shapes(replay, k, rows, error)
    others = [(_shapes(replay, k, rows, one), one) for one in drawn]
    trends = []
    for kind, shape in shapes.items():
        least = LEAST_TRENDS[kind] * (100.0 if kind == "offset" and k >= len(TILTS) else 1.0)
        known = known_of(replay, k) / max(float(np.sqrt(np.square(shape).mean())), _LEAST_SHAPE)
        squares = np.square([_share(one[rows], each[kind]) for each, one in others])
        tolerated, left = (least + known + SPREADS * math.sqrt(s.mean()) for s in (squares, squares[LATE:]))
        trends.append(Trend(kind, -_share(error[rows], shape), tolerated, left))
    return tuple(trends)


def _shapes(replay: LogReplay, k: int, rows: NDArray[np.bool_], error: FloatArray) -> dict[str, FloatArray]:
    """Return what an offset, a gain and a delay of 1 take from the commands of a log with an error (k,).

    A log at rest has no gain and no delay; all are at `rows`.
    """
    logged = replay.replayed[:, k] - error
    shapes = {"offset": np.ones(int(rows.sum()))}
    if replay.logged[rows, k].std() >= (CALM_RAD if k < len(TILTS) else _CALM_M_S2):
        shapes["gain"] = logged[rows] - logged[rows].mean()
        shapes["delay"] = -np.gradient(logged, replay.time_s)[rows]
    return shapes


def _share(error: FloatArray, shape: FloatArray) -> float:
    """Return how much of a shape (k,) an error (k,) has: half of the shape has less; 0 of one that is 0."""
    there = shape != 0.0
    if not there.any():
        return 0.0
    weight, values = np.abs(shape[there]), error[there] / shape[there]
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])


def _worst(
    replay: LogReplay, k: int, error: FloatArray, drawn: FloatArray
) -> tuple[float, float, float, float]:
    """Return median error and tolerance of the second that is farthest off, and from when to when.

    Of a log that lacks nothing, likewise of one update where that is off by more than last digits.
    """
    free = replay.settled & ~_limited(replay, k)
    lacks = replay.input_errors is not None or np.isfinite(replay.capped_s).any()
    at = int(np.argmax(np.where(free, error, 0.0)))
    most = MOMENT_FACTOR * known_of(replay, k)
    worst = _worst_second(replay, k, error, drawn)
    if lacks or error[at] <= most or worst[0] > worst[1]:
        return worst
    at_s = float(replay.time_s[at] - replay.time_s[0])
    return float(error[at]), most, at_s, at_s


def _worst_second(
    replay: LogReplay, k: int, error: FloatArray, drawn: FloatArray
) -> tuple[float, float, float, float]:
    """Return the same of seconds alone."""
    length, known = round(SECOND_S / replay.update_period_s), known_of(replay, k)
    free = replay.settled & ~_limited(replay, k)
    found = []
    for first in range(0, max(len(error) - length // 2, 1), max(length // 2, 1)):
        rows = slice(first, first + length)
        judged = free[rows]
        if replay.settled[rows].sum() < _LEAST_JUDGED * length or judged.sum() < _LEAST_FREE * length:
            continue
        since_s = float(replay.capped_s[rows][judged].min())
        capped = CAPPED[k] * math.exp(-since_s / CAPPED_FADES_S[k])
        estimated = ESTIMATED[k] if np.isfinite(replay.complete_s[rows]).any() else 0.0
        tolerated = known + capped + estimated + SPREADS * _open(drawn[:, rows][:, judged])
        found.append((float(np.median(error[rows][judged])), tolerated, first))
    if not found:
        return np.nan, np.nan, np.nan, np.nan
    off = [median / tolerated for median, tolerated, _ in found]
    begin = end = at = int(np.argmax(off))
    while begin > 0 and off[begin - 1] > 1.0 and off[at] > 1.0:
        begin -= 1
    while end + 1 < len(off) and off[end + 1] > 1.0 and off[at] > 1.0:
        end += 1
    since = replay.time_s - replay.time_s[0]
    until = min(found[end][2] + length, len(since)) - 1
    return found[at][0], found[at][1], float(since[found[begin][2]]), float(since[until])


def _limited(replay: LogReplay, k: int) -> NDArray[np.bool_]:
    """Return whether a tilt of log and controller is the limit (k,), which is that of others, too."""
    logged, most = replay.logged[:, k], replay.settings.limits.tilt_rad
    is_largest = np.abs(logged) >= LARGEST * most if k < len(TILTS) else np.zeros(len(logged), bool)
    return np.asarray(is_largest & (replay.replayed[:, k] == logged))
