"""Find the durations and knots of least time within limits: augmented Lagrangian, Levenberg-Marquardt steps.

Each limit is held at SAMPLES times of each piece. Its multiplier grows until it holds (Nocedal and Wright,
Numerical Optimization, chapter 17.3); in between, damped Gauss-Newton steps, whose matrix is sparse: a piece
knows its two knots only.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import splu

from mambo_extensions.plan.course import FORWARD_M_S, Choice, PlannedCourse
from mambo_extensions.plan.hermite import ENDS, ORDERS, basis, ends_of, motion, per_second
from mambo_extensions.plan.limits import FlightLimit
from mambo_sil.drone.plant.arrays import FloatArray

SAMPLES: Final = 17
TAU: Final = 0.5 - 0.5 * np.cos(np.pi * np.arange(SAMPLES) / (SAMPLES - 1))
"""Times in a piece at which limits are held, denser towards its ends, where the snap is largest."""
BASIS: Final = basis(TAU)
ROUNDS, STEPS = 14, 40
"""Most updates of the multipliers, and most steps between two of them."""
LEEWAY: Final = 0.003
"""What is left of each limit, so that times between the samples keep it too."""
HELD, SETTLED = 0.012, 0.002
"""It is enough if no limit is passed by more than HELD, and the time has changed by no more than SETTLED: the
plan is then flown so much slower that all limits hold."""
STILL: Final = 2e-6
"""A step that takes off less of the time is the last one."""
PRICE_PER_S: Final = 10.0
"""First price of a passed limit over the mean duration of a piece."""
LONGEST_STEP: Final = 0.5
"""Largest change of a logarithm of a duration in a step."""
UNITS: Final = np.repeat([1.0, 1.0, 2.0, 6.0], 3)
"""Size of the unknowns of a knot over the mean distance of points."""

Report = Callable[[float], None]
"""Called with the share of the rounds that is done."""


def silent(*_: object) -> None:
    """Report no progress."""


@dataclass(frozen=True, eq=False)
class _State:
    """A course and how far it passes its limits: at samples (m, n, SAMPLES), at knots (2, n + 1)."""

    course: PlannedCourse
    motion: FloatArray
    passed: FloatArray
    knots_passed: FloatArray

    @property
    def worst(self) -> float:
        return float(max(self.passed.max(), self.knots_passed.max()))


def _state(course: PlannedCourse, limits: Sequence[FlightLimit]) -> _State:
    moved = motion(course.knots, course.duration_s, TAU)
    allowed = course.choice.allowed[:, np.newaxis]
    passed = np.stack([limit.of(moved, allowed)[0] for limit in limits]) + LEEWAY
    return _State(course, moved, passed, passed_at_knots(course))


def passed_at_knots(course: PlannedCourse) -> FloatArray:
    """Return by how much each knot leaves its tolerance, and is too slow for its gate (2, n + 1)."""
    return np.stack([_off(course), _backwards(course)])


def _off(course: PlannedCourse) -> FloatArray:
    """Return by how much each knot is farther from its point than it may be: half the square, less 1/2."""
    off_m, reach_m = course.value[:, 0], course.choice.reach_m
    share = np.sum(off_m * off_m, axis=1) / np.maximum(reach_m, 1e-9) ** 2
    return np.where(reach_m > 0.0, (share - 1.0) / 2.0, -1.0)


def _backwards(course: PlannedCourse) -> FloatArray:
    """Return by how much, in m/s, each knot in a gate is too slow along its normal."""
    normal = course.choice.normal
    forward_m_s = np.sum(course.knots[:, 1] * normal, axis=1)
    return np.where(normal.any(axis=1), FORWARD_M_S - forward_m_s, -1.0)


def solve(course: PlannedCourse, limits: Sequence[FlightLimit], progress: Report = silent) -> PlannedCourse:
    """Return the course of least time within limits, from a first one; without any, one that passes them."""
    state = _state(course, limits)
    mean_s = float(course.duration_s.mean())
    price, damping = PRICE_PER_S * mean_s, 1e-2
    multiplier, of_knots = np.zeros_like(state.passed), np.zeros_like(state.knots_passed)
    for attempt in range(ROUNDS):
        before_s = state.course.time_s
        lagrangian = _Lagrangian(limits, price, multiplier, of_knots)
        state, damping = lagrangian.minimise(state, damping)
        progress((attempt + 1) / ROUNDS)
        time_s = state.course.time_s
        if state.worst < HELD and abs(time_s - before_s) < SETTLED * time_s:
            break
        multiplier = np.maximum(multiplier + price * state.passed, 0.0)
        of_knots = np.maximum(of_knots + price * state.knots_passed, 0.0)
        price *= 1.6
        damping = max(damping, 1e-4)
    return state.course


def first_course(course: PlannedCourse, limits: Sequence[FlightLimit]) -> PlannedCourse:
    """Return a course of least snap whose durations are long enough for the limits, if any are."""
    duration_s = course.duration_s
    for _ in range(60):
        smooth = course.smooth(duration_s)
        if _state(smooth, limits).passed.max() < 0.02:
            break
        duration_s = 1.08 * duration_s
    return smooth


@dataclass(frozen=True, eq=False)
class _Lagrangian:
    """The time of a course, and what its passed limits cost."""

    limits: Sequence[FlightLimit]
    price: float
    multiplier: FloatArray
    of_knots: FloatArray

    def cost(self, state: _State) -> float:
        at_samples, at_knots = self._costly(state)
        squares = np.sum(at_samples**2) / SAMPLES + np.sum(at_knots**2)
        return float(state.course.time_s + 0.5 * self.price * squares)

    def minimise(self, state: _State, damping: float) -> tuple[_State, float]:
        """Return the state after damped steps, and the damping that the next one begins with."""
        cost = self.cost(state)
        mean_s, mean_m = state.course.duration_s.mean(), state.course.choice.distance_m.mean()
        knots, durations, count = state.course.choice.index
        scale = np.zeros(count + 1)
        scale[knots] = mean_s / (mean_m * UNITS) ** 2
        scale[durations] = mean_s
        scale = scale[:-1]
        for _ in range(STEPS):
            slope, curvature = self._expanded(state)
            found = None
            while found is None and damping < 1e8:
                step = -splu((curvature + diags(damping * scale)).tocsc()).solve(slope)
                if np.abs(step[durations]).max() <= LONGEST_STEP:
                    tried = _state(state.course.stepped(step), self.limits)
                    tried_cost = self.cost(tried)
                    if tried_cost < cost:
                        found = tried
                        continue
                damping *= 4.0
            if found is None:
                break
            expected = -(slope @ step) - 0.5 * step @ (curvature @ step)
            gain = cost - tried_cost
            ratio = gain / max(expected, 1e-12)
            if ratio > 0.6:
                damping = max(damping / 5.0, 1e-6)
            elif ratio < 0.25:
                damping *= 2.0
            state, cost = found, tried_cost
            if gain < STILL * state.course.time_s:
                break
        return state, min(damping, 1.0)

    def _costly(self, state: _State) -> tuple[FloatArray, FloatArray]:
        """Return what counts: how far limits are passed, beside their multipliers; 0 where they hold."""
        choice = state.course.choice
        own = choice.owner == np.arange(choice.count + 1)
        return (
            np.maximum(state.passed + self.multiplier / self.price, 0.0),
            own * np.maximum(state.knots_passed + self.of_knots / self.price, 0.0),
        )

    def _expanded(self, state: _State) -> tuple[FloatArray, Any]:
        """Return the gradient of the cost by the unknowns, and its curvature to first order of the limits."""
        course = state.course
        _, durations, count = course.choice.index
        at_samples, at_knots = self._costly(state)
        parts = [
            _rows_of_samples(state, limit, costly)
            for limit, costly in zip(self.limits, at_samples, strict=True)
        ]
        parts += [_rows_of_knots(course, at_knots)]
        rows = np.concatenate([part[0] for part in parts])
        columns = np.concatenate([part[1] for part in parts])
        costly = np.concatenate([part[2] for part in parts])
        where = np.broadcast_to(np.arange(len(rows))[:, np.newaxis], columns.shape)
        used = columns >= 0
        jacobian = csr_matrix((rows[used], (where[used], columns[used])), shape=(len(rows), count))
        slope = self.price * (jacobian.T @ costly)
        slope[durations] += course.duration_s
        of_time = np.zeros(count)
        of_time[durations] = course.duration_s
        return slope, self.price * (jacobian.T @ jacobian) + diags(of_time)


_WIDTH: Final = 12 + 12 + 3
"""Unknowns that a sample depends on: two knots, and the durations of its piece and of those beside it."""


def _rows_of_samples(
    state: _State, limit: FlightLimit, costly: FloatArray
) -> tuple[FloatArray, Any, FloatArray]:
    """Return gradients (r, _WIDTH) of a limit where it counts, their unknowns, and how much it counts."""
    course, choice = state.course, state.course.choice
    knots, durations, _ = choice.index
    piece, sample = np.nonzero(costly)
    _, gradient = limit.of(state.motion[:, piece, sample], choice.allowed[piece])
    by_motion = limit.weights[:, np.newaxis] * gradient  # (ORDERS, r, 3)
    factor = per_second(course.duration_s)
    at = BASIS[:, sample]
    by_ends = np.einsum("kr,krj,krc->rjc", factor[:, piece], at, by_motion)
    ends = ends_of(course.knots, course.duration_s)[piece]
    slower = np.arange(ORDERS)[:, np.newaxis, np.newaxis] * state.motion[:, piece, sample]
    by_piece = np.einsum("rjc,rjc,j->r", by_ends, ends, ENDS) - np.einsum("krc,krc->r", by_motion, slower)
    by_values = by_ends * (course.duration_s[piece, np.newaxis] ** ENDS)[:, :, np.newaxis]
    row, column = np.zeros((len(piece), _WIDTH)), np.full((len(piece), _WIDTH), -1)
    row[:, 24], column[:, 24:] = by_piece, durations[_near(choice, piece)]
    for side in range(2):
        at_knot = piece + side
        along = np.einsum("rocd,roc->rod", choice.axes[at_knot], by_values[:, 4 * side : 4 * side + 4])
        powers = course.powers[at_knot]
        row[:, 12 * side : 12 * side + 12] = (along / powers[:, :, np.newaxis]).reshape(-1, 12)
        column[:, 12 * side : 12 * side + 12] = knots[at_knot]
        value = np.where(choice.free[at_knot], course.value[at_knot], 0.0)
        by_time = -np.einsum("rod,rod,o->r", along, value, np.arange(4.0))
        shares = choice.beside[at_knot[:, np.newaxis], _near(choice, piece)]
        row[:, 24:] += by_time[:, np.newaxis] * _once(choice, piece, shares)
    root = np.sqrt(1.0 / SAMPLES)
    return root * row, column, root * costly[piece, sample]


def _near(choice: Choice, piece: NDArray[np.intp]) -> Any:
    """Return each piece (r,), the one before it and the one after it (r, 3); at an end the same again."""
    beside = np.stack([piece, piece - 1, piece + 1], axis=1)
    return beside % choice.count if choice.closed else np.clip(beside, 0, choice.count - 1)


def _once(choice: Choice, piece: NDArray[np.intp], shares: FloatArray) -> FloatArray:
    """Return shares (r, 3) of the pieces of `_near`, with 0 where one of them is there again."""
    near = _near(choice, piece)
    again = np.stack(
        [np.zeros(len(piece), np.bool_), near[:, 1] == near[:, 0], (near[:, 2:] == near[:, :2]).any(axis=1)],
        axis=1,
    )
    return np.where(again, 0.0, shares)


def _rows_of_knots(course: PlannedCourse, costly: FloatArray) -> tuple[FloatArray, Any, FloatArray]:
    """Return the same as `_rows_of_samples` for the tolerances and the gates."""
    choice = course.choice
    knots, durations, _ = choice.index
    rows, columns, sizes = [], [], []
    for order, counts in enumerate(costly):
        at = np.flatnonzero(counts)
        row, column = np.zeros((len(at), _WIDTH)), np.full((len(at), _WIDTH), -1)
        column[:, :12] = knots[at]
        if order == 0:
            row[:, :3] = course.value[at, 0] / np.maximum(choice.reach_m[at, np.newaxis], 1e-9) ** 2
        else:
            along = -np.einsum("kcd,kc->kd", choice.axes[at, 1], choice.normal[at])
            powers = course.powers[at, 1:2]
            row[:, 3:6] = along / powers
            piece = np.minimum(at, choice.count - 1)
            near = _near(choice, piece)
            value = np.where(choice.free[at, 1], course.value[at, 1], 0.0)
            by_time = -np.sum(along * value, axis=1)
            row[:, 24:] = by_time[:, np.newaxis] * _once(
                choice, piece, choice.beside[at[:, np.newaxis], near]
            )
            column[:, 24:] = durations[near]
        rows.append(row)
        columns.append(column)
        sizes.append(counts[at])
    return np.concatenate(rows), np.concatenate(columns), np.concatenate(sizes)
