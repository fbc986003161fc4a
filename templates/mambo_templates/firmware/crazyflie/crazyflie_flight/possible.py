"""What fly.py refuses before it connects: figures that are too quick, too long, too low or too high."""

import math
from pathlib import Path

from .ends import RefusedError
from .figures import Figure, climb_s, fastest, heights_m, length_s, pieces_of
from .flying import HOP_CLIMB_S, HOP_S
from .values import VALUES

MOST_PIECES = 31
LOWEST_M, HIGHEST_M = 0.2, 5.0  # above the floor
AT_REST = 0.01  # m/s, m/s^2
LONGEST_S = 240.0
"""Of a flight; a new battery flies a Crazyflie for about 7 minutes, one of some age for less."""


def require_folder(log: Path) -> None:
    """Raise RefusedError if the log has no folder."""
    if not log.absolute().parent.is_dir():
        raise RefusedError(f"--log {log}: there is no such folder")


def require_possible(figure: Figure, *, is_streamed: bool) -> None:
    """Raise RefusedError if a figure is faster than the controller flies, or longer than a battery."""
    pieces = pieces_of(figure, (0.0, 0.0, 0.0, 0.0))
    flight_s = HOP_CLIMB_S + HOP_S + climb_s(figure.height) + length_s(pieces)
    if flight_s > LONGEST_S:
        cure = "plan a shorter lap" if figure.lap else "choose a higher --rate"
        least = f"{LONGEST_S:g} s are what a battery surely gives"
        raise RefusedError(f"the flight takes {flight_s:.0f} s, and {least}: {cure}")
    if figure.lap:
        _require_lap(figure)
    if len(pieces) > MOST_PIECES and not is_streamed:
        held = f"the drone's memory holds {MOST_PIECES}"
        raise RefusedError(
            f"the lap has {len(pieces)} pieces with its descent, and {held}: --stream sends it"
        )
    speed, acceleration = fastest(pieces)
    most_m_s2 = VALUES.lap_m_s2 if figure.lap else VALUES.flown_m_s2
    slower = min(
        math.sqrt(most_m_s2 / acceleration) if acceleration else math.inf,
        VALUES.speed_m_s / speed if speed else math.inf,
    )
    if acceleration > most_m_s2:
        needs = f"the figure needs {acceleration:.1f} m/s^2, and tilt and thrust give {most_m_s2:.1f}"
        raise RefusedError(f"{needs}: {_cure(figure, slower)}")
    if speed > VALUES.speed_m_s:
        needs = f"the figure needs {speed:.1f} m/s, and the speed limit is {VALUES.speed_m_s:g}"
        raise RefusedError(f"{needs}: {_cure(figure, slower)}")


def _cure(figure: Figure, slower: float) -> str:
    """Return what would fly, where the time of a figure must run slower."""
    if figure.lap:
        return f"plan it at {math.floor(100.0 * slower) / 100.0:g} of its present --rate"
    return f"--rate {math.floor(100.0 * figure.rate * slower) / 100.0:g} would fly, or a smaller --size"


def _require_lap(figure: Figure) -> None:
    """Raise RefusedError if a lap is in motion where it begins or ends, or too low or too high."""
    first, last = figure.lap[0], figure.lap[-1]
    ends = (*first.at(0.0)[:3], *last.at(last.duration_s)[:3])
    if any(abs(value) > AT_REST for axis in ends for value in axis[1:3]):
        cure = "plan it without --closed, and without a speed at its first and last point"
        raise RefusedError(f"the lap begins or ends in flight: {cure}")
    low, high = (round(height, 2) for height in heights_m(figure))
    if not LOWEST_M <= low <= high <= HIGHEST_M:
        allowed = f"{LOWEST_M:g} to {HIGHEST_M:g} m above the floor are allowed"
        raise RefusedError(f"the lap flies at {low:g} to {high:g} m, and {allowed}")
