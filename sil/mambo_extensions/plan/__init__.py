"""Plan laps: from points to polynomial pieces that a drone and its controller can follow."""

from typing import Final

LEAST_RATE: Final = 0.05
"""Least speed over that of the quickest plan."""
COMMANDER_PIECES: Final = 30
"""Pieces of 132 bytes in the 4 KB of the Crazyflie's high-level commander, beside `fly.py`'s descent."""
MOST_DRONES: Final = 1000
"""Drawn ones that fly a plan."""
