"""What a plan is and how it was flown: its CSV file, its summary, and the sentences of the console."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_extensions.plan import COMMANDER_PIECES
from mambo_extensions.plan.planning import Planned, shares_of
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.polynomials import COLUMNS, POINT_COLUMNS
from mambo_sil.results.blocks import Block, CommandResult, ResultTable, Sentence
from mambo_sil.results.number_format import distance
from mambo_sil.results.summary import Number, Summary

BINDS: Final = 0.98
"""A limit of which a leg takes that share at least decides how quick it is."""
MOST_ROWS: Final = 15
"""Legs that the console lists one by one."""


class LegSummary(Summary):
    """What is flown from one point to the next: a polynomial piece, or two."""

    command = "plan-leg"

    number: int
    duration_s: Number
    binding: str
    share: Number
    allowed: Number
    """Largest share of tilt and of the weakest drone's spare thrust that counts as the whole limit."""


class PlanSummary(Summary):
    """A plan, and its flights."""

    command = "plan"

    vehicle: str
    points: int
    time_s: Number
    good: bool
    flown: int
    passed: int
    largest_miss_m: Number
    missed_most: int
    allowed_there_m: Number
    height_judged: bool
    headings: bool
    largest_error_m: Number
    largest_tilt_rad: Number
    largest_thrust_weights: Number
    legs: list[LegSummary]

    @property
    def title(self) -> str:
        """What its picture says."""
        return f"{self.vehicle}: {self._lap}; {self._verdict}"

    @property
    def _lap(self) -> str:
        return f"{self.time_s:.2f} s through {self.points} points"

    @property
    def _verdict(self) -> str:
        return f"{self.passed} of {self.flown} drones fly it through all points"

    def result(self) -> CommandResult:
        """Return what the console shows."""
        miss = (
            f"farthest {distance(self.largest_miss_m)} at point {self.missed_most}, where "
            f"{distance(self.allowed_there_m)} are allowed"
        )
        used = (
            f"farthest from the plan {distance(self.largest_error_m)}, "
            f"largest tilt {self.largest_tilt_rad:.2f} rad, "
            f"largest thrust {self.largest_thrust_weights:.2f} weights"
        )
        blocks: list[Block] = [Sentence(used), *self._binding(), *self._memory(), *self._headings()]
        if not self.height_judged:
            blocks.insert(1, Sentence("heights are not judged: the settings have no [height]"))
        return CommandResult(
            "Plan",
            self.good,
            (self._lap, self._verdict, miss),
            blocks,
            self.vehicle,
        )

    def _binding(self) -> list[Block]:
        """Return which limit binds where."""
        if len(self.legs) <= MOST_ROWS:
            rows = [
                (
                    f"{leg.number} to {leg.number % self.points + 1}",
                    f"{leg.duration_s:.2f}",
                    leg.binding,
                    f"{100 * leg.share:.0f} %",
                )
                for leg in self.legs
            ]
            return [ResultTable(("points", "s", "most of", "limit"), rows, (0, 2))]
        counted: dict[str, int] = {}
        for leg in self.legs:
            if leg.share >= BINDS:
                counted[leg.binding] = counted.get(leg.binding, 0) + 1
        words = ", ".join(f"{name} in {count}" for name, count in counted.items()) or "none"
        return [Sentence(f"limits that bind, of {len(self.legs)} legs: {words}")]

    def _headings(self) -> list[Block]:
        if not self.headings:
            return []
        return [
            Sentence(
                "the pieces have headings, which a Crazyflie's fly.py flies; `fly` and `pilot` refuse them: "
                "leave yaw out for these"
            )
        ]

    def _memory(self) -> list[Block]:
        if len(self.legs) <= COMMANDER_PIECES:
            return []
        return [
            Sentence(
                f"{len(self.legs)} pieces: a Crazyflie's commander holds {COMMANDER_PIECES} and the "
                "descent of fly.py; fly it by --stream, or in parts"
            )
        ]


def summary_of(planned: Planned, drone: VehicleFile) -> PlanSummary:
    """Return the summary of a plan."""
    flown, course = planned.flown, planned.course
    begins = course.choice.points[:-1]
    shares = np.maximum.reduceat(shares_of(course, planned.limits).max(axis=2), begins, axis=1)
    allowed = np.maximum.reduceat(course.choice.allowed, begins)
    over_m = flown.off_m.max(axis=0) / planned.reach_m
    worst = int(np.nanargmax(over_m))
    names = [limit.name for limit in planned.limits]
    misses = flown.misses(planned.reach_m)
    weights = flown.thrust_m_s2 * drone.thrust_gain / GRAVITY_M_S2
    return PlanSummary(
        vehicle=drone.name,
        points=len(planned.points),
        time_s=course.time_s,
        good=planned.good,
        flown=len(misses),
        passed=int((~misses).sum()),
        largest_miss_m=float(flown.off_m[:, worst].max()),
        missed_most=course.choice.point_of(course.choice.points[1 + worst]),
        allowed_there_m=float(planned.reach_m[worst]),
        height_judged=planned.height_judged,
        headings=bool(planned.yaw.any()),
        largest_error_m=float(flown.error_m.max()),
        largest_tilt_rad=float(flown.tilt_rad.max()),
        largest_thrust_weights=float(weights.max()),
        legs=[
            LegSummary(
                number=leg + 1,
                duration_s=float(leg_s),
                binding=names[int(shares[:, leg].argmax())],
                share=float(shares[:, leg].max()),
                allowed=float(allowed[leg]),
            )
            for leg, leg_s in enumerate(course.leg_s)
        ],
    )


def csv_text(planned: Planned) -> str:
    """Return the pieces as a CSV file: `COLUMNS`, and `POINT_COLUMNS` of the point at the end of a leg."""
    lines = [",".join((*COLUMNS, *POINT_COLUMNS))]
    curve = planned.curve
    for piece, yaw, point in zip(curve.pieces, planned.yaw, curve.points, strict=True):
        left = [0.0 - one for one in piece.east]
        polynomials = _row([piece.duration_s, *piece.north, *left, *piece.height, *yaw.tolist()])
        if point is None:
            lines.append(polynomials + "," * len(POINT_COLUMNS))
            continue
        place, normal = _row([*point.place_m, point.reach_m]), _row(point.normal or ()) or ",,"
        lines.append(f"{polynomials},{point.number},{place},{normal}")
    return "\n".join(lines) + "\n"


def _row(numbers: Sequence[float]) -> str:
    """Return numbers that read back to the same bits."""
    return ",".join(repr(float(number)) for number in numbers)
