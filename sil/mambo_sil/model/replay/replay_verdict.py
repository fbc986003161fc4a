"""Whether a log is one of a controller: the branches of the verdict, each with its reason."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from mambo_sil.model.identify.signals import THRUST, TILTS
from mambo_sil.model.replay.log_replay import LogReplay
from mambo_sil.model.replay.replay_errors import CALM_RAD, AxisErrors

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
LAST_DIGITS_RAD: Final = 2e-6
"""Largest error of a tilt that is one of the last digits of single precision."""
LEAST_UPDATES: Final = 150
"""Least number of updates to judge by."""
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


def _has_other_bits(evidence: Evidence) -> bool:
    """Return whether the bits of a log that lacks nothing are those of another controller.

    That is known where the log begins with the controller: if no command is equal, and not only the last
    digits differ as in another type of float; of a 1-norm if the first one is not equal.
    """
    replay = evidence.replay
    if replay.filled or replay.gaps or replay.input_errors is not None:
        return False
    known = np.isinf(replay.begun_s)
    if not (replay.from_start and replay.is_exact and known[0]):
        return False
    error = np.abs((replay.replayed - replay.logged)[known])
    differs = np.asarray(error.max(axis=1) > 0.0)
    if replay.settings.cost.norm != "quadratic":
        return bool(differs[0])
    is_more = replay.settings.code.scalar == "fixed" or error[:, : len(TILTS)].max() > LAST_DIGITS_RAD
    return bool(differs.all() and is_more)


Branch = tuple[ReplayVerdict, Callable[[Evidence], bool], Callable[[Evidence], str]]
BRANCHES: Final[tuple[Branch, ...]] = (
    (ReplayVerdict.YES, lambda e: e.is_equal and e.moves, lambda _: "no bit differs"),
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
        ReplayVerdict.NO,
        _has_other_bits,
        lambda _: "the log has all digits from its start on, and the bits are others",
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
