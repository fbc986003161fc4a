"""Whether a log is one of a controller: the branches of the verdict, each with its reason."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from mambo_sil.model.identify.signals import THRUST
from mambo_sil.model.replay.log_replay import LogReplay
from mambo_sil.model.replay.replay_errors import CALM_RAD, AxisErrors, Trend

TELLS: Final = 0.02
"""Gain of another controller that a log with few digits or lost rows must tell from 1."""
TELLS_ONE_NORM: Final = 0.2
"""The same of a 1-norm, whose search never forgets."""
TELLS_M_S2: Final = 0.1
"""Least offset of another controller's thrust that a log must tell: 1 % of the weight."""
FAR: Final = 0.5
"""Least error of another controller, over the command's standard deviation, where the log does not say which
inputs a step read."""
LEAST_UPDATES: Final = 150
"""Least number of updates to judge by."""
MOST_REFUSED: Final = 0.5
"""Largest share of updates whose inputs the controller refuses, of one that flew."""
MOST_FILLED: Final = 0.3
"""Largest share of filled updates among which the others tell controllers apart."""


class ReplayVerdict(StrEnum):
    """Whether a log is one of a controller."""

    YES = "yes"
    NO = "no"
    CANNOT_TELL = "cannot tell"


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
    def has_no_second(self) -> bool:
        """Whether there is an axis of which no second can be judged."""
        return any(math.isnan(one.worst) for one in self.axes)

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
    def refused(self) -> float:
        """Share of updates whose inputs the controller refuses."""
        return float((self.replay.status != 0).mean())

    @property
    def is_off(self) -> bool:
        """Whether a second is farther off than tolerated."""
        return any(one.worst > one.tolerated for one in self.axes)

    @property
    def is_far(self) -> bool:
        """Whether commands are far off, whichever inputs a step read."""
        return any(one.moves and one.worst >= FAR * one.spread for one in self.axes)

    @property
    def trend(self) -> tuple[AxisErrors, Trend] | None:
        """An axis, and the trend of its errors that is farthest beyond what is tolerated, if there is one."""
        off = [(one, trend) for one in self.axes for trend in one.trends if trend.is_off]
        return max(off, key=lambda each: abs(each[1].value) / each[1].tolerated, default=None)

    @property
    def blurred(self) -> tuple[AxisErrors, float] | None:
        """The first axis that few digits or lost rows tell too little of, and how many times too little."""
        errors = self.replay.input_errors
        if errors is None or not (errors.resolutions or self.replay.lost):
            return None
        tells = TELLS if self.replay.settings.controller.method == "quadratic" else TELLS_ONE_NORM
        for one in self.axes:
            for trend in one.trends:
                kind, most = ("gain", tells) if one.is_tilt else ("offset", TELLS_M_S2)
                if trend.kind == kind and trend.open > most:
                    return one, trend.open / most
        return None


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
        f"from {one.from_s:.1f} to {one.until_s:.1f} s {one.axis.name} is {one.text(one.worst)} off, "
        f"more than the {one.text(one.tolerated)} allowed"
    )


def _trend(evidence: Evidence) -> str:
    """Say which trend the errors of the whole log have."""
    if evidence.trend is None:
        return ""
    one, trend = evidence.trend
    return f"in the whole log {one.axis.name} is {one.trend_text(trend)}"


def _blur(evidence: Evidence) -> str:
    """Say which column has too few digits, or that lost rows leave too much open."""
    errors = evidence.replay.input_errors
    if evidence.blurred is None or errors is None:
        return ""
    one, times = evidence.blurred
    k, settled = evidence.axes.index(one), evidence.replay.settled
    alone = {name: float(np.median(np.abs(each[settled, k]))) for name, each in errors.alone.items()}
    name = max(alone, key=lambda each: alone[each], default="")
    if name and alone[name] >= 0.3 * one.expected:
        resolution = errors.resolutions[name]
        column = "thrust" if name == THRUST else name
        return f"{column} has {resolution.text}, log {resolution.finer(times)}"
    return f"the rows that are lost leave too much of {one.axis.name} open: log more of them"


Branch = tuple[ReplayVerdict, Callable[[Evidence], bool], Callable[[Evidence], str]]
BRANCHES: Final[tuple[Branch, ...]] = (
    (ReplayVerdict.YES, lambda e: e.is_equal and e.moves, lambda _: "no bit differs"),
    (
        ReplayVerdict.NO,
        lambda e: e.refused > MOST_REFUSED and e.moves,
        lambda e: f"the controller refuses {100.0 * e.refused:.0f} % of the inputs of the log",
    ),
    (
        ReplayVerdict.CANNOT_TELL,
        lambda e: e.judged < LEAST_UPDATES,
        lambda e: f"{e.judged} updates can be judged, and {LEAST_UPDATES} must: log longer",
    ),
    (
        ReplayVerdict.CANNOT_TELL,
        lambda e: e.has_no_second,
        lambda _: (
            "no whole second is between long gaps and off the tilt limit: log a calmer flight, every row"
        ),
    ),
    (
        ReplayVerdict.NO,
        lambda e: e.is_far if e.is_rare or not e.replay.is_exact else e.is_off,
        _off,
    ),
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
    (ReplayVerdict.NO, lambda e: e.trend is not None, _trend),
    (ReplayVerdict.YES, lambda _: True, _near),
)
"""Verdict, whether it holds, and its reason; the first that holds is that of a log."""


def judge(replay: LogReplay, axes: tuple[AxisErrors, ...]) -> tuple[ReplayVerdict, str]:
    """Return the verdict, and its reason in words."""
    evidence = Evidence(replay, axes)
    return next((verdict, reason(evidence)) for verdict, holds, reason in BRANCHES if holds(evidence))
