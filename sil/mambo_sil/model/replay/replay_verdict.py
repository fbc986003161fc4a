"""Whether a log is one of a controller: the errors of a replay against the motion of the logged commands."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.model.replay.log_replay import LogReplay

SAME: Final = 0.008
"""Largest miss of the controller that flew: the change of its error over the change of the logged command."""
OTHER: Final = 0.013
"""Least miss of another controller."""
FAR: Final = 0.5
"""The same where the log does not say which inputs a step read, over the command's standard deviation."""
SMALL_RAD: Final = 1e-5
"""Error that counts as none, because rounding and what no log shows leave as much."""
CALM_RAD: Final = 1e-3
"""Standard deviation of a command up to which an axis is at rest, and says nothing."""
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
class AxisErrors:
    """How a replay differs from a log along one axis, at the updates that are judged.

    miss:       change of the error over the change from one command to the next; half of the motion has
                less. What the estimates of the controller lack behind a gap fades slowly, and changes little.
    error_rad:  the error; half of the motion has less.
    spread_rad: standard deviation of the logged command.
    """

    miss: float
    error_rad: float
    spread_rad: float

    @property
    def moves(self) -> bool:
        """Whether the command moves enough to say something."""
        return self.spread_rad > CALM_RAD

    @property
    def is_same(self) -> bool:
        """Whether the errors are as small as with the controller that flew."""
        return self.error_rad <= SMALL_RAD or self.miss <= SAME

    def is_other(self, *, exact: bool) -> bool:
        """Whether they are those of another one; `exact` says whether the log has the inputs of each step."""
        if not exact:
            return self.moves and self.error_rad >= FAR * self.spread_rad
        return self.error_rad > SMALL_RAD and self.miss >= OTHER


def errors_of(replay: LogReplay) -> tuple[AxisErrors, AxisErrors]:
    """Return the errors of roll and pitch; NaN, and no motion, if no update can be judged."""
    error_rad = replay.replayed_rad - replay.logged_rad
    jump_rad = np.abs(np.diff(error_rad, axis=0, prepend=np.nan))
    change_rad = np.abs(np.diff(replay.logged_rad, axis=0, prepend=np.nan))
    judged = replay.settled & np.isfinite(change_rad[:, 0])
    columns = (np.abs(error_rad), jump_rad, change_rad, replay.logged_rad)
    roll, pitch = (_axis(*(values[judged, k] for values in columns)) for k in range(2))
    return roll, pitch


def _axis(
    error_rad: FloatArray, jump_rad: FloatArray, change_rad: FloatArray, logged_rad: FloatArray
) -> AxisErrors:
    if not change_rad.any():
        return AxisErrors(np.nan, float(np.median(error_rad)) if len(error_rad) else np.nan, 0.0)
    moving = change_rad > 0.0
    weight = change_rad[moving]
    return AxisErrors(
        _median(jump_rad[moving] / weight, weight),
        _median(error_rad[moving], weight),
        float(logged_rad.std()),
    )


def _median(values: FloatArray, weight: FloatArray) -> float:
    """Return the median of values (k,), each counted with its weight."""
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])


def judge(replay: LogReplay, axes: tuple[AxisErrors, AxisErrors]) -> tuple[ReplayVerdict, str]:
    """Return the verdict, and in words what is missing for one."""
    judged, has_most = int(replay.settled.sum()), replay.share_filled <= MOST_FILLED
    exact = replay.is_exact and has_most
    is_equal = bool((replay.replayed_rad == replay.logged_rad).all())
    if is_equal and replay.logged_rad.std(axis=0).max() > CALM_RAD:
        return ReplayVerdict.YES, ""
    if judged >= LEAST_UPDATES and any(axis.is_other(exact=exact) for axis in axes):
        return ReplayVerdict.NO, ""
    moves, is_same = any(axis.moves for axis in axes), all(axis.is_same for axis in axes)
    if judged >= LEAST_UPDATES and moves and is_same and has_most:
        return ReplayVerdict.YES, ""
    reasons = (
        (judged < LEAST_UPDATES, f"{judged} updates can be judged, and {LEAST_UPDATES} must: log longer"),
        (not has_most or replay.resampled, "the log lacks most updates: log every one"),
        (not moves, "the commands hardly move: log a flight along a curve"),
        (not replay.is_exact, "which inputs a step read is not in its row: log those of the step"),
    )
    missing = "too many rows are lost for so calm a flight: log one along a curve"
    return ReplayVerdict.CANNOT_TELL, next((reason for holds, reason in reasons if holds), missing)
