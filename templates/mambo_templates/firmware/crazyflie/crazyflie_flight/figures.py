"""The figures of fly.py as polynomials of degree 7 or less.

The frame is the Crazyflie's: x ahead, y left, z up, yaw to the left.
"""

import csv
import itertools
import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

PIECES = 28  # of an eight or a circle; the drone's memory holds 31, of which the descent is one
HOVER_S, PAUSE_S = 10.0, 1.0
SAMPLED_S = 0.02

Polynomial = list[float]
"""Coefficients, lowest first."""
Motion = list[float]
"""A value with its first three derivatives."""
Spot = tuple[float, float, float, float]
"""Where a figure begins: x, y, height of the floor, and heading."""


@dataclass(frozen=True)
class Piece:
    """A part of a figure: x, y, z and yaw as polynomials of time."""

    duration_s: float
    x: Polynomial
    y: Polynomial
    z: Polynomial
    yaw: Polynomial

    @property
    def polynomials(self) -> tuple[Polynomial, ...]:
        """All four."""
        return self.x, self.y, self.z, self.yaw

    def at(self, time_s: float) -> list[Motion]:
        """Return the motions of x, y, z and yaw."""
        return [derivatives(polynomial, time_s) for polynomial in self.polynomials]

    def pack(self) -> bytes:
        """Return the bytes that the firmware keeps of it."""
        padded = [each + [0.0] * (8 - len(each)) for each in self.polynomials]
        return struct.pack("<33f", *(value for each in padded for value in each), self.duration_s)


@dataclass(frozen=True)
class Figure:
    """What to fly, in m, rad/s and laps at full size."""

    name: str
    size: float
    height: float
    rate: float
    laps: int
    lap: tuple[Piece, ...] = ()
    """The pieces of a file of `mambo-nmpc plan`; without them the figure has a name."""


def derivatives(polynomial: Polynomial, time_s: float) -> Motion:
    """Return value and first three derivatives of a polynomial."""
    value = first = second = third = 0.0
    for coefficient in reversed(polynomial):
        third = third * time_s + 3.0 * second
        second = second * time_s + 2.0 * first
        first = first * time_s + value
        value = value * time_s + coefficient
    return [value, first, second, third]


def join(duration_s: float, start: Sequence[float], end: Sequence[float]) -> Polynomial:
    """Return the polynomial from a motion to another."""
    low = [start[0], start[1], start[2] / 2.0, start[3] / 6.0]
    reached = derivatives(low, duration_s)
    p, v, a, j = ((end[k] - reached[k]) * duration_s**k for k in range(4))
    high = (
        35.0 * p - 15.0 * v + 2.5 * a - j / 6.0,
        -84.0 * p + 39.0 * v - 7.0 * a + j / 2.0,
        70.0 * p - 34.0 * v + 6.5 * a - j / 2.0,
        -20.0 * p + 10.0 * v - 2.0 * a + j / 6.0,
    )
    return [*low, *(value / duration_s ** (4 + k) for k, value in enumerate(high))]


def move(duration_s: float, start: float, end: float) -> Polynomial:
    """Return the polynomial from rest at `start` to rest at `end`."""
    return join(duration_s, (start, 0.0, 0.0, 0.0), (end, 0.0, 0.0, 0.0))


def curve(figure: Figure, time_s: float) -> tuple[Motion, Motion]:
    """Return the motions along x and y of an eight or a circle about (0, 0)."""
    lap_s = 2.0 * math.pi / figure.rate
    left_s = (figure.laps + 2) * lap_s - time_s
    near_s, sign = (time_s, 1.0) if time_s < left_s else (left_s, -1.0)
    growing = derivatives(move(lap_s, 0.0, 1.0), min(max(near_s, 0.0), lap_s))
    growth = [value * sign**k for k, value in enumerate(growing)]

    def wave(size_m: float, rate: float, phase: float) -> Motion:
        sine = [size_m * rate**k * math.sin(rate * time_s + phase + k * math.pi / 2.0) for k in range(4)]
        return [sum(math.comb(n, k) * growth[k] * sine[n - k] for k in range(n + 1)) for n in range(4)]

    size, rate = figure.size, figure.rate
    if figure.name == "eight":
        return wave(size, rate, 0.0), wave(size / 2.0, 2.0 * rate, 0.0)
    return wave(size, rate, math.pi / 2.0), wave(size, rate, 0.0)


def slow_down(pieces: Sequence[Piece], number: int, share: float) -> list[Piece]:
    """Return a figure's pieces, whose time runs slower by `share` from the end of a piece on.

    In that piece it slows down. The path stays, and the last piece, the descent, is as it was.
    """
    piece = pieces[number]
    before, after = piece.at(0.0), piece.at(piece.duration_s)
    slowing_s = piece.duration_s * 2.0 / (1.0 + share)
    slowed = (
        join(slowing_s, start, [value * share**k for k, value in enumerate(end)])
        for start, end in zip(before, after, strict=True)
    )
    slower = [
        Piece(
            one.duration_s / share,
            *([value * share**k for k, value in enumerate(each)] for each in one.polynomials),
        )
        for one in pieces[number + 1 : -1]
    ]
    return [*pieces[:number], Piece(slowing_s, *slowed), *slower, pieces[-1]]


def leg_s(figure: Figure) -> float:
    """Return the duration of a leg of goto, whose top speed is size times rate."""
    return 2.1875 / figure.rate


def climb_s(height_m: float) -> float:
    """Return the duration of a climb or a descent, at 0.9 m/s or less."""
    return max(2.0, 2.5 * height_m)


def read_lap(path: str) -> tuple[Piece, ...]:
    """Return the pieces of a file of `mambo-nmpc plan`; raise ValueError if it is none."""
    with Path(path).open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.reader(file) if row]
    if (
        len(rows) < 2
        or rows[0][0] != "duration"
        or len(rows[0]) < 33
        or any(len(row) != len(rows[0]) for row in rows)
    ):
        raise ValueError("a lap has rows of a duration and 8 coefficients of x, y, z and yaw")
    numbers = [[float(field) for field in row[:33]] for row in rows[1:]]
    if any(row[0] <= 0.0 or not all(map(math.isfinite, row)) for row in numbers):
        raise ValueError("a lap has finite numbers, and durations above 0")
    return tuple(Piece(row[0], *(row[k : k + 8] for k in (1, 9, 17, 25))) for row in numbers)


def moved(pieces: Sequence[Piece], *shift: float) -> list[Piece]:
    """Return pieces with something added to x, y, z and yaw."""
    return [
        Piece(
            piece.duration_s,
            *([each[0] + more, *each[1:]] for each, more in zip(piece.polynomials, shift, strict=True)),
        )
        for piece in pieces
    ]


def pieces_of(figure: Figure, spot: Spot) -> list[Piece]:
    """Return the pieces of a figure from a spot on, and of a descent at its end."""
    found = _flown(figure, spot)
    x, y, floor, heading = spot
    height = floor + figure.height
    if figure.lap:
        x, y, height, heading = (motion[0] for motion in at(found, length_s(found)))
    descent_s = climb_s(height - floor)
    return [*found, Piece(descent_s, [x], [y], move(descent_s, height, floor), [heading])]


def _flown(figure: Figure, spot: Spot) -> list[Piece]:
    """Return the pieces of a figure without its descent."""
    x, y, floor, heading = spot
    height = floor + figure.height
    if figure.lap:
        start = [each[0] for each in figure.lap[0].polynomials]
        return moved(figure.lap, x - start[0], y - start[1], floor, heading - start[3])
    if figure.name == "hover":
        return [Piece(HOVER_S, [x], [y], [height], [heading])]
    if figure.name == "goto":
        way_s, there = leg_s(figure), x + figure.size
        return [
            Piece(way_s, move(way_s, x, there), [y], [height], [heading]),
            Piece(PAUSE_S, [there], [y], [height], [heading]),
            Piece(way_s, move(way_s, there, x), [y], [height], [heading]),
        ]
    piece_s = (figure.laps + 2) * 2.0 * math.pi / figure.rate / PIECES
    found = []
    for before, after in itertools.pairwise(curve(figure, k * piece_s) for k in range(PIECES + 1)):
        along_x, along_y = (join(piece_s, before[axis], after[axis]) for axis in range(2))
        along_x[0] += x
        along_y[0] += y
        found.append(Piece(piece_s, along_x, along_y, [height], [heading]))
    return found


def at(pieces: Sequence[Piece], time_s: float) -> list[Motion]:
    """Return the motions of x, y, z and yaw at a time; after the end those of the end."""
    for piece in pieces:
        if time_s <= piece.duration_s:
            return piece.at(time_s)
        time_s -= piece.duration_s
    return pieces[-1].at(pieces[-1].duration_s)


def length_s(pieces: Sequence[Piece]) -> float:
    """Return the duration of a figure."""
    return sum(piece.duration_s for piece in pieces)


def sampled(pieces: Sequence[Piece]) -> list[list[Motion]]:
    """Return the motions of x, y, z and yaw, every 0.02 s."""
    return [at(pieces, SAMPLED_S * k) for k in range(int(length_s(pieces) / SAMPLED_S) + 1)]


def fastest(pieces: Sequence[Piece]) -> tuple[float, float]:
    """Return the largest horizontal speed and acceleration of a figure."""
    motions = sampled(pieces)
    speed, acceleration = (max(math.hypot(x[k], y[k]) for x, y, _, _ in motions) for k in (1, 2))
    return speed, acceleration


def heights_m(figure: Figure) -> tuple[float, float]:
    """Return the least and the largest height of a figure above the floor."""
    heights = [z[0] for _, _, z, _ in sampled(figure.lap)] if figure.lap else [figure.height]
    return min(heights), max(heights)
