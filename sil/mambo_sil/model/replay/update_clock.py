"""Which update of the controller a row of a log is of: by the count that the log has, or by its clock."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray, IntArray
from mambo_sil.model.identify.signals import (
    COMMANDS,
    POSITION,
    TARGET,
    TILTS,
    UPDATE,
    UPDATES,
    VELOCITY,
    YAW,
    FlightLog,
    Signal,
)

_READ: Final = (*POSITION, *VELOCITY, *TILTS, YAW, *TARGET)
"""Signals that every controller reads."""
_SAME_PERIOD: Final = 0.1
"""Share by which a log's period may differ from a multiple of the update period: its rows are updates."""
_MOST_BETWEEN: Final = 2
"""Largest such multiple."""
_LEARNS: Final = 0.1
"""Share of a row's delay by which the clock of the updates follows: it drifts, but does not jitter."""
_MOST_ALIKE: Final = 0.1
"""Largest share of rows with the count of the row before of a count that tells the updates apart."""
_FIRST_ROWS, _ALL_THERE = 5, 1.7
"""Rows by which that clock begins, if no two of them are more than these periods apart."""


@dataclass(frozen=True, eq=False)
class UpdateClock:
    """The k updates of a log.

    time_s:   their times (k,).
    restarts: whether the count of the updates begins again (k,): another flight, or another start.
    row_s:    times (n,) of rows, and the updates that they are of, `number` (n,); both None if the rows of
              the commands are not the updates.
    counted:  whether the log counts the updates.
    """

    time_s: FloatArray
    restarts: NDArray[np.bool_]
    row_s: FloatArray | None = None
    number: IntArray | None = None
    counted: bool = False

    @property
    def resampled(self) -> bool:
        """Whether the rows of the log are not the updates."""
        return self.row_s is None

    def update_of(self, time_s: FloatArray) -> IntArray:
        """Return the numbers of the updates at times (m,): the one counted last, or the nearest.

        They are below 0, or k or more, for times that are of no update.
        """
        if self.row_s is None or self.number is None:
            raise ValueError("the rows are not the updates")
        if self.counted:
            place = np.searchsorted(self.row_s, time_s, side="right") - 1
            return np.where(place < 0, -1, self.number[place])
        period_s = (self.row_s[-1] - self.row_s[0]) / max(int(self.number[-1]), 1)
        inside = np.interp(time_s, self.row_s, self.number.astype(np.float64))
        beyond = np.minimum(time_s - self.row_s[0], 0.0) + np.maximum(time_s - self.row_s[-1], 0.0)
        return np.asarray(np.round(inside + beyond / period_s), np.int64)


def read_clock(log: FlightLog, period_s: float) -> UpdateClock:
    """Return the updates of a log of a controller with this period."""
    row_s = log.signals[COMMANDS[0]].time_s
    between = float(np.median(np.diff(row_s))) / period_s
    nearest = round(between)
    if not 1 <= nearest <= _MOST_BETWEEN or abs(between - nearest) > _SAME_PERIOD * nearest:
        begin_s = max(log.signals[name].time_s[0] for name in (*COMMANDS, *_READ))
        end_s = min(log.signals[name].time_s[-1] for name in (*COMMANDS, *_READ))
        time_s = begin_s + period_s * np.arange(1 + max(int((end_s - begin_s) / period_s), -1))
        return UpdateClock(time_s, np.zeros(len(time_s), bool))
    if UPDATE in log.signals and _counts_each(log.signals[UPDATE]):
        return _counted(log.signals[UPDATE], period_s)
    number = _numbers(row_s, period_s)
    time_s = np.interp(np.arange(number[-1] + 1), number, row_s)
    return UpdateClock(time_s, np.zeros(len(time_s), bool), row_s, number)


def _counts_each(count: Signal) -> bool:
    """Return whether a count tells the updates apart: one of half precision does not."""
    return bool((np.diff(count.value) == 0.0).mean() < _MOST_ALIKE)


def _counted(count: Signal, period_s: float) -> UpdateClock:
    """Return the updates of a log that counts them; a count that falls begins again, as the clock says."""
    steps = np.diff(count.value) % UPDATES
    falls = steps > UPDATES / 2
    passed = np.maximum(np.round(np.diff(count.time_s) / period_s), 1.0)
    number = np.append(0, np.cumsum(np.where(falls, passed, steps))).astype(np.int64)
    first = np.diff(number, prepend=-1) > 0
    time_s = np.interp(np.arange(number[-1] + 1), number[first], count.time_s[first])
    restarts = np.zeros(len(time_s), bool)
    restarts[number[1:][falls]] = True
    return UpdateClock(time_s, restarts, count.time_s, number, counted=True)


def _numbers(row_s: FloatArray, period_s: float) -> IntArray:
    """Return the number of the update of each row at `row_s` (n,), whose times may jitter."""
    first_s = row_s[:_FIRST_ROWS]
    all_there = (np.diff(first_s) < _ALL_THERE * period_s).all()
    clock_s = float(np.median(first_s - period_s * np.arange(len(first_s)))) if all_there else row_s[0]
    numbers = [0]
    for time_s in row_s[1:].tolist():
        steps = max(round((time_s - clock_s) / period_s), 1)
        clock_s += steps * period_s
        clock_s += _LEARNS * (time_s - clock_s)
        numbers.append(numbers[-1] + steps)
    return np.array(numbers)
