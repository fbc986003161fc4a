"""The flight of fly.py: take-off, hop, figure, landing, by calls that a real or a simulated drone takes."""

import itertools
import math
from bisect import bisect
from collections.abc import Sequence
from dataclasses import dataclass

from .calls import Drone
from .checks import end, land, require_heading, watch, watch_near
from .ends import RefusedError, TroubleError
from .figures import (
    PAUSE_S,
    Figure,
    Piece,
    Spot,
    at,
    climb_s,
    heights_m,
    leg_s,
    length_s,
    pieces_of,
    slow_down,
)
from .radio import CHECKS_S, GROUP

TURN_S, STREAM_PERIOD_S = 2.0, 0.02
TRAJECTORY_MEMORY, PIECE_BYTES = 0x12, 132
SLOWER, JUDGED_S = 0.8, 1.0
"""So much slower runs the time of a figure that is too quick; so long after that it is judged again."""
MOST_SLOWED = 3
HOP_HEIGHT_M, HOP_CLIMB_S, HOP_M, HOP_S = 0.3, 1.5, 0.15, 1.5
"""A longer way or a pause let a drone with a wrong heading swing farther."""
STRAY_M = 0.45
UPLOAD_S, WRITE_S = 10.0, 0.01
"""The longest that an upload takes; how often it is seen whether a piece is written."""
SPARE_S = 0.2  # before a piece that changes flies


@dataclass(frozen=True)
class Flight:
    """A figure and how it is flown."""

    figure: Figure
    heading_rad: float | None = None
    """Of the nose in the figure; None: as the drone stands."""
    is_streamed: bool = False

    @property
    def is_uploaded(self) -> bool:
        """Whether the figure is written into the drone's memory."""
        return not self.is_streamed and self.figure.name != "goto"


def fly(drone: Drone, flight: Flight, place: Spot) -> None:
    """Take off, hop, fly a figure and land; `place` is x, y, height of the floor, and heading."""
    x, y, floor, yaw = place
    figure, commander = flight.figure, drone.cf.high_level_commander
    heading = yaw if flight.heading_rad is None else flight.heading_rad
    pieces = pieces_of(figure, (x, y, floor, heading))
    commander.stop()  # what an earlier script left
    upload_s = upload(drone, pieces) if flight.is_uploaded else 0.0
    descent_s = HOP_CLIMB_S
    try:
        hop(drone, place)
        descent_s = climb_s(heights_m(figure)[1])
        rises_s = max(TURN_S, climb_s(figure.height))
        commander.go_to(x, y, floor + figure.height, heading, rises_s)
        drone.wait(rises_s + PAUSE_S)
        if flight.is_uploaded:
            commander.start_trajectory(1)
            follow(drone, pieces, 1.2 * upload_s / len(pieces))
        elif flight.is_streamed:
            stream(drone, pieces)
        else:
            for there in (x + figure.size, x):
                commander.go_to(there, y, floor + figure.height, heading, leg_s(figure))
                drone.wait(leg_s(figure) + PAUSE_S)
    except BaseException as error:
        end(drone, error, floor, descent_s)
        raise
    land(drone, floor, descent_s)


def hop(drone: Drone, place: Spot) -> None:
    """Take off and move a little along x.

    Raise TroubleError if the drone does not move where it tilts to.
    """
    x, y, floor, yaw = place
    drone.watch_by(watch_near(x, y, STRAY_M))
    drone.cf.high_level_commander.takeoff(floor + HOP_HEIGHT_M, HOP_CLIMB_S, yaw=None)
    drone.wait(HOP_CLIMB_S)
    drone.cf.high_level_commander.go_to(x + HOP_M, y, floor + HOP_HEIGHT_M, yaw, HOP_S)
    drone.wait(HOP_S)
    if drone.is_real:
        require_heading(drone, HOP_S)
    drone.watch_by(watch)


def upload(drone: Drone, pieces: Sequence[Piece]) -> float:
    """Write a figure into the memory of the high-level commander, as its trajectory 1.

    Return how long that took.
    """
    begun = drone.now()
    if not write_pieces(drone, pieces, 0, begun + UPLOAD_S):
        raise RefusedError("the figure could not be uploaded: go nearer to the drone")
    drone.cf.high_level_commander.define_trajectory(1, 0, len(pieces))
    return drone.now() - begun


def write_pieces(drone: Drone, pieces: Sequence[Piece], first: int, until_s: float) -> bool:
    """Write all pieces from the first that changed on, and return whether that was done by a time.

    The last one comes first: what is written when the link is lost flies as late as possible. cflib sends a
    piece in parts, its duration last, and the firmware may read it in between: so none that flies may change.
    """
    numbers = reversed(range(first, len(pieces)))
    return all(write_piece(drone, pieces[number], number, until_s) for number in numbers)


def write_piece(drone: Drone, piece: Piece, number: int, until_s: float) -> bool:
    """Write a piece to its place; return whether that was done by a time."""
    memory, answers = drone.cf.mem.get_mems(TRAJECTORY_MEMORY)[0], list[bool]()
    if drone.now() > until_s:
        return False
    memory.trajectory = [piece]
    memory.write_data(lambda *_: answers.append(True), lambda *_: answers.append(False), number * PIECE_BYTES)
    while not answers and drone.now() < until_s:
        drone.wait(WRITE_S)
    drone.wait(WRITE_S)  # cflib forgets the callbacks after it has called one
    return answers == [True]


def follow(drone: Drone, pieces: Sequence[Piece], write_s: float) -> None:
    """Wait for the end of a figure that was uploaded; slow it down while it is too quick for the drone.

    `write_s`: how long it may take to write one of its pieces.
    """
    begun = drone.now()
    while drone.now() - begun < length_s(pieces):
        drone.wait(CHECKS_S)
        slower = slower_if_too_quick(drone, pieces, drone.now() - begun, write_s)
        if slower is not None:
            number, pieces = slower
            if not write_pieces(drone, pieces, number, begun + length_s(pieces[:number]) - SPARE_S):
                raise TroubleError("the figure could not be slowed down in time")


def slower_if_too_quick(
    drone: Drone, pieces: Sequence[Piece], time_s: float, write_s: float
) -> tuple[int, list[Piece]] | None:
    """Return the number of the first piece that changes, and pieces whose time runs slower from it on.

    None while that is not needed. What flies until all behind it are written stays, since its place in the
    drone's memory must not change. A piece that is slowed down has to end before the figure is judged again.
    Raises TroubleError if that was done a few times and the figure is still too quick.
    """
    ends_s = list(itertools.accumulate(piece.duration_s for piece in pieces))
    left = len(pieces) - bisect(ends_s, time_s)
    number = bisect(ends_s, time_s + SPARE_S + left * write_s) + 1
    is_too_quick = bool(drone.latest.get(f"{GROUP}.tooQuick", 0))
    if not is_too_quick or number > len(pieces) - 3 or time_s < drone.slow_until_s:
        return None
    if drone.slowed == MOST_SLOWED:
        times = f"the figure was slowed down {MOST_SLOWED} times"
        raise TroubleError(f"{times}, and still the thrust limits the tilt")
    drone.slowed += 1
    slower = slow_down(pieces, number, SLOWER)
    drone.slow_until_s = sum(piece.duration_s for piece in slower[: number + 1]) + JUDGED_S
    runs = f"its time runs {1.0 / SLOWER - 1.0:.0%} slower from {ends_s[number]:.1f} s on"
    print(f"The figure is too quick for the thrust: {runs}.")
    return number, slower


def stream(drone: Drone, pieces: Sequence[Piece]) -> None:
    """Send a figure as full-state set-points; slow it down while it is too quick for the drone."""
    begun = drone.now()
    while (time_s := drone.now() - begun) < length_s(pieces):
        slower = slower_if_too_quick(drone, pieces, time_s, 0.0)
        if slower is not None:
            _, pieces = slower
        x, y, z, (yaw, *_) = at(pieces, time_s)
        position, velocity, acceleration = ([axis[order] for axis in (x, y, z)] for order in range(3))
        quaternion = [0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0)]
        drone.cf.commander.send_full_state_setpoint(
            position, velocity, acceleration, quaternion, 0.0, 0.0, 0.0
        )
        drone.wait(STREAM_PERIOD_S)
