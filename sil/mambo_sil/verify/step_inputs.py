"""Inputs of steps: random values from a seed, special cases that random values miss, and rows of numbers."""

import itertools
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_codegen import methods
from mambo_codegen.methods import Method
from mambo_codegen.numbers.gravity import hover_thrust
from mambo_codegen.numbers.literals import SCALARS, Scalar
from mambo_codegen.numbers.representation import TARGET
from mambo_codegen.port.row import COUNT, WHOLE
from mambo_codegen.port.taken import MOST_KNOWN
from mambo_codegen.settings.model import Settings

Array = NDArray[np.float64]

NOT_IN_RANGE = (np.nan, np.inf, -np.inf, 1e30, -1e30)
_DRAWN = {
    *("position_m", "velocity_m_s", "roll_rad", "pitch_rad", "yaw_rad", "height_m", "climb_m_s", "on_ground"),
    *("acceleration_m_s2", "climb_acceleration_m_s2"),
}
"""Members that are drawn to suit each other."""
POSITION = slice(0, 2)
VELOCITY = slice(2, 4)
TILT = slice(4, 6)
YAW = 6
"""Columns of the state; the target's come after it and begin with position and velocity too."""


@lru_cache(maxsize=4)
def method_of(settings: Settings) -> Method:
    """Return the method of `settings`, whose constants are derived once for all cases."""
    return methods.method_of(settings)


@dataclass(frozen=True)
class StepInputs:
    """Inputs of one step of n controllers, as in `ReferenceController.step`; no thrust with a height."""

    state: Array
    target: Array
    thrust: Array | None


class StepRows:
    """The inputs of a step as one row of numbers, as calls of the C interface have them.

    The columns are state, target, thrust; with a height state and target, and no thrust.

    quantities:   of all columns.
    target:       columns of the target's position and velocity.
    thrust:       columns of the thrust, none with a height.
    acceleration: columns of the target's acceleration, none if it cannot be known.
    """

    def __init__(self, method: Method) -> None:
        self._hover_m_s2 = hover_thrust(method.settings)
        row = method.port.step_row()
        self.quantities: tuple[str, ...] = tuple(one.quantity for one in row)
        self._state, self._target, thrust = (
            [one.column for one in row if one.record == record] for record in ("state", "target", "thrust")
        )
        places = [one.column for one in row if one.member.startswith("acceleration_m_s2")]
        self.target = slice(self._target[0], self._target[0] + len(TARGET))
        self.thrust, self.acceleration = (
            slice(columns[0], columns[-1] + 1) if columns else slice(0, 0) for columns in (thrust, places)
        )

    def hovering(self, n: int) -> Array:
        """Return rows (n, k) of drones that hover in the origin, which is their target."""
        rows = np.zeros((n, len(self.quantities)))
        rows[:, self.thrust] = self._hover_m_s2
        return rows

    def join(self, inputs: StepInputs) -> Array:
        """Return the rows (n, k) of inputs."""
        rows = np.zeros((len(inputs.state), len(self.quantities)))
        rows[:, self._state], rows[:, self._target] = inputs.state, inputs.target
        if inputs.thrust is not None:
            rows[:, self.thrust] = inputs.thrust[:, np.newaxis]
        return rows

    def split(self, rows: NDArray[Any]) -> StepInputs:
        """Return the inputs of rows (n, k)."""
        thrust = rows[:, self.thrust]
        return StepInputs(
            np.ascontiguousarray(rows[:, self._state]),
            np.ascontiguousarray(rows[:, self._target]),
            thrust[:, 0] if thrust.size else None,
        )


def random_inputs(settings: Settings, n: int, rng: np.random.Generator) -> StepInputs:
    """Draw inputs with errors from 0.1 mm to 10 m; make a tenth of them special cases."""
    ranges = settings.ranges
    scale = 10.0 ** rng.uniform(-4, 1, (n, 1))
    target = rng.normal(0, 1, (n, 4)) * [2, 2, 1, 1]
    error = rng.normal(0, 1, (n, 4)) * scale
    state = np.concatenate(
        [
            target + error,
            rng.uniform(-0.5, 0.5, (n, 2)),
            rng.choice([1.0, 10.0, 1000.0], (n, 1)) * rng.uniform(-1, 1, (n, 1)),
        ],
        axis=1,
    )
    state[:, 0:2] = np.clip(state[:, 0:2], -ranges.position_m, ranges.position_m)
    state[:, 2:4] = np.clip(state[:, 2:4], -ranges.velocity_m_s, ranges.velocity_m_s)
    target[:, 0:2] = np.clip(target[:, 0:2], -ranges.position_m, ranges.position_m)
    target[:, 2:4] = np.clip(target[:, 2:4], -ranges.velocity_m_s, ranges.velocity_m_s)
    low, high = ranges.thrust_acceleration_min_m_s2, ranges.thrust_acceleration_max_m_s2
    thrust = rng.uniform(low, high, n)
    thrust[::3] = np.clip(9.81, low, high)

    for row in np.flatnonzero(rng.random(n) < 0.1):
        _make_special(settings, state[row], target[row], thrust[row : row + 1], rng)
    method = method_of(settings)
    level, climb = _known_limits(method)
    if level:
        target = np.concatenate([target, _accelerations(level, high, (n, 2), rng)], axis=1)
    if method.has_height:
        own, goal = _heights(settings, scale, rng)
        state, target = np.concatenate([state, own], axis=1), np.concatenate([target, goal], axis=1)
        if climb:
            target = np.concatenate([target, _accelerations(climb, high, (n, 1), rng)], axis=1)
    state, target = completed(method, "state", state, rng), completed(method, "target", target, rng)
    return StepInputs(state, target, None if method.has_height else thrust)


def _known_limits(method: Method) -> list[float]:
    """Return the limits of accelerations that targets know, along x and y and up, m/s^2; 0 without."""
    if (observer := method.target_observer) is None:
        return [0.0, 0.0]
    return [*(one.acceleration / observer.update_s for one in observer.limits), 0.0][:2]


def completed(method: Method, record: str, known: Array, rng: np.random.Generator) -> Array:
    """Return states or targets (n, k) with draws for all members that `known` (n, j) does not have."""
    numbers = method.port.numbers(record)
    there = [one.column for one in numbers if one.row.member in _DRAWN]
    whole = np.zeros((len(known), len(numbers)))
    whole[:, there] = known
    for one in (one for one in numbers if one.row.member not in _DRAWN):
        if one.row.kind == WHOLE:
            most = MOST_KNOWN if one.row.draw is COUNT else 1
            is_special = rng.random(len(known)) < 0.05
            special = rng.choice([0.5, most + 1.0], len(known))
            whole[:, one.column] = np.where(is_special, special, rng.integers(most + 1, size=len(known)))
        else:
            size = one.row.draw.largest if one.row.draw is not None else None
            whole[:, one.column] = rng.uniform(-1, 1, len(known)) * (size or 1.0)
    return whole


def _heights(settings: Settings, scale: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Draw height, climb and contact with the floor (n, 3), and targets (n, 2); some are special."""
    n, limits = len(scale), [settings.ranges.position_m, settings.ranges.velocity_m_s]
    goal = np.clip(rng.normal(0, 1, (n, 2)) * [2, 1], np.negative(limits), limits)
    own = np.clip(goal + (rng.normal(0, 1, (n, 2)) * scale), np.negative(limits), limits)
    own[rng.random(n) < 0.1] = goal[0]
    for values in (own, goal):
        row, column = rng.integers(n), rng.integers(2)
        values[row, column] = rng.choice([*NOT_IN_RANGE, limits[column], -limits[column], -0.0])
    on_ground = rng.choice([0.0, 1.0], (n, 1), p=[0.8, 0.2])
    return np.concatenate([own, on_ground], axis=1), goal


def _accelerations(
    limit_m_s2: float,
    range_m_s2: float,
    shape: tuple[int, int],
    rng: np.random.Generator,
) -> Array:
    """Draw accelerations of targets, some beyond their limit or the range of the input."""
    drawn = rng.uniform(-1.25 * limit_m_s2, 1.25 * limit_m_s2, shape)
    is_special = rng.random(shape) < 0.05
    edges = [0.0, -0.0, limit_m_s2, -limit_m_s2, range_m_s2, -range_m_s2, 1.001 * range_m_s2, *NOT_IN_RANGE]
    return np.where(is_special, rng.choice(edges, shape), np.clip(drawn, -range_m_s2, range_m_s2))


def random_steps(settings: Settings, n: int, steps: int, rng: np.random.Generator) -> list[StepInputs]:
    """Draw the inputs of consecutive steps of n controllers, independent of each other.

    For a tracker or an observer of targets, two targets in three change their velocity little from step to
    step; one in five of these changes is a jump.
    """
    drawn = [random_inputs(settings, n, rng) for _ in range(steps)]
    method = method_of(settings)
    tracker, observer = method.tracker, method.target_observer
    if observer is not None:
        change_m_s = 1.25 * observer.level.jump
    elif tracker is not None:
        change_m_s = tracker.tested_change_m_s
    else:
        return drawn
    limit_m_s = settings.ranges.velocity_m_s
    with np.errstate(invalid="ignore"):
        for before, now in itertools.pairwise(drawn):
            moved = before.target[:, 2:4] + rng.uniform(-change_m_s, change_m_s, (n, 2))
            near = (rng.random((n, 1)) < 2 / 3) & np.isfinite(moved) & np.isfinite(now.target[:, 2:4])
            now.target[:, 2:4] = np.where(near, np.clip(moved, -limit_m_s, limit_m_s), now.target[:, 2:4])
    return drawn


def _make_special(
    settings: Settings, state: Array, target: Array, thrust: Array, rng: np.random.Generator
) -> None:
    """Make one row a special case, in place."""
    ranges = settings.ranges
    bounds = np.array([ranges.position_m] * 2 + [ranges.velocity_m_s] * 2 + [3.25, 3.25, 1024.0])
    match rng.integers(10):
        case 0:  # no error: every gradient is zero
            state[:4] = target
            state[4:6] = 0
        case 1:  # an error along one axis only, yaw 0
            state[:4] = target
            state[0] += 0.1
            state[4:] = 0
        case 2:  # equal errors, equal gradients
            state[:4] = target + 0.25
        case 3:  # yaws where the quadrant of the sine changes, and large ones
            turned = rng.integers(-600, 601) * np.pi / 2
            state[6] = rng.choice([turned, -1000.0, 1000.0, -1024.0, 1024.0, 0.0, -0.0])
        case 4:  # at the limit of a range, and just beyond
            axis = rng.integers(7)
            state[axis] = rng.choice([-1, 1]) * bounds[axis] * rng.choice([1, 1.001])
        case 5:  # as far from the target as the ranges allow
            state[:2], target[:2] = ranges.position_m, -ranges.position_m
        case 6:
            state[rng.integers(7)] = rng.choice(NOT_IN_RANGE)
        case 7:
            target[rng.integers(4)] = rng.choice(NOT_IN_RANGE)
        case 8:
            low, high = ranges.thrust_acceleration_min_m_s2, ranges.thrust_acceleration_max_m_s2
            thrust[0] = rng.choice([*NOT_IN_RANGE, 0.0, -0.0, -9.81, low, high])
        case _:  # errors below the smallest normal number
            target[:], state[:4] = 0, rng.normal(0, 1, 4) * 1e-40


def around(settings: Settings, quantity: str, low: float, high: float) -> Array:
    """Return both limits of a range, their neighbours, NaN, infinities, zeros and the smallest numbers."""
    scalar, numbers = floating(settings), method_of(settings).numbers
    ends = np.array([low, high], scalar)
    beyond = np.array([-np.inf, np.inf], scalar)
    neighbours = [np.nextafter(ends, beyond), np.nextafter(ends, -beyond)]
    if numbers.bits is not None:
        ends = numbers.to_si(numbers.quantize(ends[:, None], (quantity,)), quantity)[:, 0]
        unit = np.ldexp([-1.0, 1.0], -numbers.bits[quantity])
        neighbours = [ends + unit, ends - unit]
    tiny = np.finfo(scalar).smallest_subnormal
    odd = np.array([np.nan, np.inf, -np.inf, 0.0, -0.0, tiny, -tiny], scalar)
    return np.concatenate([ends, *neighbours, odd]).astype(np.float64)


def floating(settings: Settings) -> Scalar:
    """Return the scalar type, or float64 for fixed point; neighbours of a number are found in it."""
    return np.float64 if settings.code.scalar == "fixed" else SCALARS[settings.code.scalar]
