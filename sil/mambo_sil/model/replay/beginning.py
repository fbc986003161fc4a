"""Whether a log begins with the first update of its controller."""

from typing import Final

import numpy as np

from mambo_sil.model.identify.signals import COMMANDS, UPDATE, VELOCITY, FlightLog

_OF_TRACE: Final = (*COMMANDS, *VELOCITY, *(f"seen_{name}" for name in VELOCITY))
"""Columns of a trace.csv, by which it is told from logs of others."""


def is_from_start(log: FlightLog, period_s: float) -> bool:
    """Return whether a log certainly begins with the first update of its controller.

    It counts the updates, or is one of a simulation.
    """
    if UPDATE in log.signals:
        return bool(log.signals[UPDATE].value[0] <= 1.0)
    return is_simulated(log, period_s)


def is_simulated(log: FlightLog, period_s: float) -> bool:
    """Return whether a log is the trace.csv of a whole simulated flight, whose floor is at a height of 0.

    That begins at rest, and the time of each row is a multiple of the period in every bit. The clock of a log
    that was cut, and set to 0, is not.
    """
    time_s = log.signals[COMMANDS[0]].time_s
    velocities = [log.signals[name] for name in VELOCITY]
    return bool(
        time_s[0] == 0.0
        and np.array_equal(time_s, np.round(time_s / period_s) * period_s)
        and all(log.signals[name].column in _OF_TRACE for name in (*COMMANDS, *VELOCITY))
        and all(one.value[0] == 0.0 and one.resolution is None for one in velocities)
    )
