"""The cases that the run-time checks run: random tapes, and tapes for every limit and special value."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.shared.tracker_constants import target_limit_m_s2
from mambo_codegen.numbers.representation import (
    ATTITUDE_LIMIT_RAD,
    STATE,
    THRUST,
    WEIGHT_LIMIT,
    WEIGHTS,
    YAW_LIMIT_RAD,
)
from mambo_codegen.settings.model import Settings
from mambo_sil.verify.calls import ApiFunction, Outcomes, Tape, answers, api_of, calls
from mambo_sil.verify.step_inputs import (
    POSITION,
    TILT,
    YAW,
    StepInputs,
    StepRows,
    around,
    completed,
    floating,
    method_of,
    random_steps,
)
from mambo_sil.verify.target_cases import observed_motion, target_motion

Array = NDArray[np.float64]
Floats = NDArray[np.floating]

RANDOM_TAPES: Final = 1000

Shares = dict[float, float]
"""Values and with which probability each is drawn."""

_MOST_TURNS: Final[Shares] = {0.01: 0.3, 0.04: 0.3, 1.0: 0.3, 0.0: 0.05, -0.1: 0.05}
"""Most changes of the heading in a step, rad; the last two are refused."""
_TILT_SHARES: Final[Shares] = {1.0: 0.5, 0.7: 0.25, 0.4: 0.1, 1.01: 0.05, -0.7: 0.05, math.nan: 0.05}
"""Tilt limits over the largest one; the last three are refused."""
_WIDTHS_M: Final[Shares] = {0.5: 0.3, 2.0: 0.3, 8.0: 0.38, -1.0: 0.02}
"""Widths of a fence; the last one is refused."""
_HEIGHTS_M: Final[Shares] = {0.3: 0.3, 2.0: 0.68, -1.0: 0.02}
"""Distances of the ceiling from the floor; the last one is refused."""
_OPEN_ENDS: Final[Shares] = {1.0: 0.95, 1.1: 0.05}
"""Walls of an open fence over the range; the last one is refused."""
_OPEN: Final = 0.2
"""Probability that a fence is open along an axis."""
_BAD_HEADING: Final = 0.03
"""Probability that a number of a heading is NaN."""
_BAD_COMMANDS: Final = (math.nan, math.inf, 4.0, -4.0)
_BAD_EFFORT_WEIGHTS: Final = (-1.0, math.nan, math.inf, 1.1 * WEIGHT_LIMIT)


@lru_cache(maxsize=2)
def cases(settings: Settings) -> tuple[tuple[Tape, ...], tuple[Outcomes, ...]]:
    """Return the tapes of all cases, and the outcomes of the reference for each."""
    rng, method = np.random.default_rng(0), method_of(settings)
    tapes = (
        *random_tapes(settings, RANDOM_TAPES),
        *_limits(settings, rng),
        *_nulls(settings, rng),
        *_quadrants(settings, rng),
        *_headings(settings),
        *(_convergence(settings) if method.iterates else []),
        *(_zero_errors(settings) if method.iterates else []),
        *(_outages(settings, rng, method.outage_steps) if method.outage_steps is not None else []),
        *_largest_inputs(settings, rng),
        *(target_motion(settings, method.tracker) if method.tracker else []),
        *(observed_motion(settings) if method.target_observer else []),
    )
    return tapes, tuple(answers(settings, tapes))


def random_tapes(settings: Settings, n: int) -> list[Tape]:
    """Return `n` tapes of eight steps with random inputs, a reset, and a change of weights or of the command.

    Every fourth tape holds each input for two steps. In every fifth tape the drone is so close to the target
    that the last bits of the prediction constants matter.
    """
    rng, method = np.random.default_rng(0), method_of(settings)
    rows = StepRows(method)
    draws = [rows.join(inputs) for inputs in random_steps(settings, n, 8, rng)]
    with np.errstate(invalid="ignore"):
        for drawn in draws:
            state, target = drawn[::5, 0:4], drawn[::5, rows.target]
            drawn[::5, 0:4] = target + (1e-3 * (state - target))
            drawn[::5, TILT] *= 1e-3
    steps = [
        np.where((np.arange(n) % 4 == 3)[:, None], draws[index // 2 * 2], drawn)
        for index, drawn in enumerate(draws)
    ]
    command = rng.uniform(-1.5, 1.5, (n, 2)) * settings.limits.tilt_rad
    command[::5, 0] = rng.choice(_BAD_COMMANDS, len(command[::5]))
    weights = 10.0 ** rng.uniform(-3, 6, (n, 2))
    weights[3::7] = rng.choice([0.0, WEIGHT_LIMIT], weights[3::7].shape)
    weights[::7, 1] = rng.choice(_BAD_EFFORT_WEIGHTS, len(weights[::7]))
    limits = random_limits(settings, n, rng) if method.limiting else None
    if method.has_height:
        command = np.concatenate([command, _random_thrusts(settings, n, rng)], axis=1)
    columns = [
        *(calls(settings, ApiFunction.STEP, drawn) for drawn in steps[:3]),
        calls(settings, ApiFunction.RESET, command),
        *(calls(settings, ApiFunction.STEP, drawn) for drawn in steps[3:5]),
        calls(settings, ApiFunction.SET_WEIGHTS, weights)
        if method.weight_limits
        else calls(settings, ApiFunction.SET_COMMAND, command[::-1]),
        *([] if limits is None else [calls(settings, ApiFunction.SET_LIMITS, limits)]),
        calls(settings, ApiFunction.SLEW_HEADING, _random_headings(n, rng)),
        calls(settings, ApiFunction.STEP, steps[5]),
        *(
            [calls(settings, ApiFunction.SET_MEASURED, rng.uniform(-1, 1, (n, 1)))]
            if method.guard is not None
            else []
        ),
        *(
            [calls(settings, ApiFunction.SET_THRUST, _random_thrusts(settings, n, rng))]
            if method.has_height
            else []
        ),
        calls(settings, ApiFunction.STEP, steps[6]),
        calls(settings, ApiFunction.SHIFT, random_shifts(settings, n, rng)),
        calls(settings, ApiFunction.STEP, steps[7]),
    ]
    return list(np.stack(columns, axis=1))


def _random_headings(n: int, rng: np.random.Generator) -> Array:
    """Draw previous and wanted headings and most changes (n, 3), some beside the range's ends, some bad."""
    previous = rng.uniform(-1.1, 1.1, n) * YAW_LIMIT_RAD
    ends = YAW_LIMIT_RAD - rng.uniform(0, 0.05, n)
    previous = np.where(np.arange(n) % 3 == 0, rng.choice([-1, 1], n) * ends, previous)
    beyond = previous - (np.sign(previous) * (2.0 * np.pi - rng.uniform(0, 0.2, n)))
    within = previous + (2.0 * np.pi * rng.integers(-3, 4, n)) + rng.uniform(-np.pi, np.pi, n)
    wanted = np.where(np.abs(previous) > YAW_LIMIT_RAD - 1.0, beyond, within)
    most = _draw(rng, _MOST_TURNS, n)
    headings = np.stack([previous, wanted, most], axis=1)
    headings[rng.random((n, 3)) < _BAD_HEADING] = np.nan
    return headings


def _draw(rng: np.random.Generator, shares: Shares, shape: int | tuple[int, ...]) -> Array:
    """Draw values with their probabilities."""
    return np.asarray(rng.choice(list(shares), shape, p=list(shares.values())))


def _random_thrusts(settings: Settings, n: int, rng: np.random.Generator) -> Array:
    """Draw thrusts (n, 1), some beyond the limits of what is commanded, some that are refused."""
    most_m_s2 = settings.ranges.thrust_acceleration_max_m_s2
    drawn = rng.uniform(-0.2, 1.02, (n, 1)) * most_m_s2
    drawn[::6, 0] = rng.choice([np.nan, np.inf, -np.inf, 1.1 * most_m_s2], len(drawn[::6]))
    return drawn


def random_shifts(settings: Settings, n: int, rng: np.random.Generator) -> Array:
    """Draw jumps of the frame (n, k), most of them small, some without a turn, some that are refused."""
    quantities, ranges = method_of(settings).shift, settings.ranges
    most = {"position": ranges.position_m, "velocity": ranges.velocity_m_s, "yaw": YAW_LIMIT_RAD}
    shifts = rng.normal(0, 1, (n, len(quantities))) * 10.0 ** rng.uniform(-3, 0.5, (n, 1))
    shifts[::4] = rng.uniform(-1.02, 1.02, shifts[::4].shape) * [most[name] for name in quantities]
    shifts[1::4, -1] = 0.0
    shifts[::9, rng.integers(len(quantities))] = rng.choice([np.nan, np.inf, -np.inf], len(shifts[::9]))
    return shifts


def random_limits(settings: Settings, n: int, rng: np.random.Generator) -> Array:
    """Draw limits (n, k) in the order of nmpc_limits_t; a quarter of them are bad."""
    ranges, most_rad = settings.ranges, settings.limits.tilt_rad
    speed = np.exp(rng.uniform(np.log(0.05), np.log(1.2 * ranges.velocity_m_s), n))
    tilt = most_rad * _draw(rng, _TILT_SHARES, n)
    braking = rng.uniform(0.05, 0.11 + (9.0 * np.abs(np.nan_to_num(tilt))))
    low = rng.uniform(-3, 1, (n, 2))
    high = low + _draw(rng, _WIDTHS_M, (n, 2))
    is_open, reach_m = rng.random((n, 2)) < _OPEN, ranges.position_m
    ends_m = reach_m * _draw(rng, _OPEN_ENDS, (2, n, 2))
    level = np.column_stack(
        [
            speed,
            braking,
            np.where(is_open, -ends_m[0], np.clip(low, -reach_m, reach_m)),
            np.where(is_open, ends_m[1], np.clip(high, -reach_m, reach_m)),
            tilt,
        ]
    )
    height = settings.height
    if height is None:
        return level
    floor_m = rng.uniform(-3, 1, n)
    ceiling_m = floor_m + _draw(rng, _HEIGHTS_M, n)
    speeds = np.array([height.climb_m_s, height.descent_m_s]) * rng.uniform(0.3, 1.02, (n, 2))
    return np.column_stack([level, floor_m, ceiling_m, np.maximum(speeds, 0.1)])


def _limits(settings: Settings, rng: np.random.Generator) -> Iterator[Tape]:
    """Set one input to a limit of its range, to the number next to the limit, or to a special value.

    One good step precedes the step with that input, and two follow.
    """
    ranges, tilt, method = settings.ranges, settings.limits.tilt_rad, method_of(settings)
    rows, most_m_s2 = StepRows(method), ranges.thrust_acceleration_max_m_s2
    largest = {
        "position": ranges.position_m,
        "velocity": ranges.velocity_m_s,
        "angle": ATTITUDE_LIMIT_RAD,
        "yaw": YAW_LIMIT_RAD,
        "thrust": most_m_s2,
        "whole": 1.0,
    }
    for index, quantity in enumerate(rows.quantities):
        is_thrust = rows.thrust.start <= index < rows.thrust.stop
        least = ranges.thrust_acceleration_min_m_s2 if is_thrust else -largest[quantity]
        for value in around(settings, quantity, least, largest[quantity]):
            good = _good_steps(settings, rng, 4)
            good[1, index] = value
            yield calls(settings, ApiFunction.STEP, good)
    weight_limits = method.weight_limits
    pairs: list[tuple[ApiFunction, Sequence[str], Sequence[float], Sequence[float]]] = [
        (function, method.command, *_both(*[limit] * 2, *[most_m_s2] * (len(method.command) - 2)))
        for function in (ApiFunction.SET_COMMAND, ApiFunction.RESET)
        for limit in (ATTITUDE_LIMIT_RAD, tilt)
        if function == ApiFunction.RESET or not weight_limits
    ]
    if weight_limits:
        pairs.insert(0, (ApiFunction.SET_WEIGHTS, WEIGHTS, (0.0, 0.0), weight_limits))
    if (height := settings.height) is not None:
        pairs.append((ApiFunction.SET_THRUST, THRUST, *_both(most_m_s2)))
        limits_m_s2 = height.command_m_s2[:1], height.command_m_s2[1:]
        pairs.append((ApiFunction.SET_THRUST, THRUST, *limits_m_s2))
    ends = [largest[name] for name in method.shift]
    pairs.append((ApiFunction.SHIFT, method.shift, *_both(*ends)))
    for function, names, lows, highs in pairs:
        for index, name in enumerate(names):
            for value in around(settings, name, lows[index], highs[index]):
                pair = np.full((1, len(names)), 0.1 * tilt)
                pair[0, index] = value
                yield _surround(settings, rng, calls(settings, function, pair))


def _both(*limits: float) -> tuple[Sequence[float], Sequence[float]]:
    """Return the lower and the upper ends of ranges that are symmetric."""
    return [-limit for limit in limits], limits


def _nulls(settings: Settings, rng: np.random.Generator) -> Iterator[Tape]:
    """Pass every combination of null pointers to every function; initialise a used controller."""
    for function, called in api_of(method_of(settings)).items():
        for nulls in range(called.pointers + 1 if called.pointers else 0):
            values = [[0.1]] if len(called.quantities) == 1 else [[0.1, 0.2]]
            made = calls(settings, function, np.array(values), nulls)
            yield _surround(settings, rng, made)


def _quadrants(settings: Settings, rng: np.random.Generator) -> list[Tape]:
    """Yaw by eighths of a turn and neighbouring numbers, where the quadrant of the sine changes."""
    scalar = floating(settings)
    eighths = np.unique([*range(-64, 65), *range(-1303, 1304, 4)])
    yaws = [(eighths * (np.pi / 4)).astype(scalar)]
    for _ in range(3):
        yaws = [
            np.nextafter(yaws[0], scalar(-np.inf)),
            *yaws,
            np.nextafter(yaws[-1], scalar(np.inf)),
        ]
    columns = []
    for yaw in yaws:
        good = _good_steps(settings, rng, len(eighths))
        good[:, YAW] = yaw
        columns.append(calls(settings, ApiFunction.STEP, good))
    return list(np.stack(columns, axis=1))


def _headings(settings: Settings) -> Iterator[Tape]:
    """Turn to the ends of the range and beside them, with every most change around 0 and around the turn."""
    ends, changes = (
        around(settings, "yaw", -YAW_LIMIT_RAD, YAW_LIMIT_RAD),
        around(settings, "yaw", 0.0, 0.25),
    )
    for last in (YAW_LIMIT_RAD, -YAW_LIMIT_RAD):
        near = math.copysign(YAW_LIMIT_RAD - 0.25, last)
        rows = [
            *((end, end, 0.5) for end in ends),
            *((last, end, 0.5) for end in ends),
            *((last, near, change) for change in changes),
        ]
        yield calls(settings, ApiFunction.SLEW_HEADING, np.array(rows))


def _convergence(settings: Settings) -> list[Tape]:
    """Choose weights with which the cost changes by the tolerance between two iterations, up to rounding.

    Close to the target the first iteration overshoots, and the cost changes by about the tracking weight
    times a constant. Bisection finds the largest weight with which the search converges; that weight and its
    neighbours are the cases. In fixed point one unit of that weight changes the cost by many units, so
    bisection also finds the effort weight, whose unit is finer than the cost's.
    """
    n, scalar, numbers = 16, floating(settings), method_of(settings).numbers
    most_tracking, most_effort = method_of(settings).weight_limits
    near_m = 1e-7 if numbers.bits is None else math.ldexp(1, -numbers.bits["position"])
    steps = StepRows(method_of(settings)).hovering(n)
    steps[:, POSITION] = near_m * np.linspace(1, 2, n)[:, None]
    steps[:, YAW] = np.linspace(-3, 3, n)

    def tapes(weights: Floats, effort: Floats) -> list[Tape]:
        pairs = np.stack([weights, effort], axis=1)
        columns = calls(settings, ApiFunction.SET_WEIGHTS, pairs), calls(settings, ApiFunction.STEP, steps)
        return list(np.stack(columns, axis=1))

    def between(made: Callable[[Floats], list[Tape]], most: float) -> tuple[Floats, Floats]:
        resting, moving = np.zeros(n, scalar), np.full(n, most, scalar)
        for _ in range(4 * np.finfo(scalar).nmant):
            weights = (resting + moving) / scalar(2)
            rests = np.array([outcome["iterations"][1] == 1 for outcome in answers(settings, made(weights))])
            resting, moving = np.where(rests, weights, resting), np.where(rests, moving, weights)
        return resting, moving

    without = np.zeros(n)
    resting, moving = between(lambda weights: tapes(weights, without), most_tracking)
    found = []
    for _ in range(8):
        found += tapes(moving, without)
        moving = np.nextafter(moving, scalar(0))
    if numbers.bits is not None:
        for effort in between(lambda weights: tapes(resting, weights), most_effort):
            found += tapes(resting, effort)
    return found


def _zero_errors(settings: Settings) -> Iterator[Tape]:
    """Let the predicted error be exactly 0 after one step, from both sides along both axes."""
    scalar = floating(settings)
    advance_m = scalar(settings.horizon.prediction_step_s) * scalar(1)
    for axis in range(2):
        for way in (-1, 1):
            steps = StepRows(method_of(settings)).hovering(1)
            steps[0, axis], steps[0, 2 + axis] = -way * advance_m, way
            yield calls(settings, ApiFunction.STEP, steps)


def _outages(settings: Settings, rng: np.random.Generator, limit: int) -> Iterator[Tape]:
    """Refuse states for the `limit` steps that the estimate lasts, and a step less or more.

    Then come good steps again.
    The targets are good in one tape and refused in another, so that both kinds of step are repeated.
    """
    aimed = StepRows(method_of(settings)).target
    for refused in (1, max(1, limit - 1), limit, limit + 1, limit + 3):
        for target in (0.0, np.nan):
            steps = _good_steps(settings, rng, refused + 6)
            steps[:, aimed] = steps[0, aimed]
            steps[2 : 2 + refused, 0] = np.nan
            steps[2 : 2 + refused, aimed.start] += target
            yield calls(settings, ApiFunction.STEP, steps)


def _largest_inputs(settings: Settings, rng: np.random.Generator) -> Iterator[Tape]:
    """In fixed point set every input to a limit of its range, where intermediate values are largest.

    Then start one unit below the tilt limit with a target that wants more tilt: the smallest change of tilt.
    """
    numbers = method_of(settings).numbers
    if numbers.bits is None:
        return
    limits, rows = method_of(settings).limits, StepRows(method_of(settings))
    largest = {
        "position": limits.position,
        "velocity": limits.velocity,
        "angle": limits.attitude,
        "yaw": limits.yaw,
        "thrust": limits.thrust_most,
        "whole": 1,
    }
    most = np.array([largest[quantity] for quantity in rows.quantities])
    steps = numbers.to_si(most * rng.choice([-1, 1], (512, len(most))), *rows.quantities)
    steps[:, rows.thrust] = np.abs(steps[:, rows.thrust])
    steps[::2, YAW] = rng.choice([-1, 1], 256) * np.pi / 4 + rng.choice([-1, 1], 256) * np.pi / 2
    yield from calls(settings, ApiFunction.STEP, steps).reshape(-1, 4)

    near_rad = settings.limits.tilt_rad - math.ldexp(1, -numbers.bits["angle"])
    signs = np.array(list(itertools.product((-1, 1), repeat=4)))
    pulled = rows.hovering(len(signs))
    pulled[:, POSITION] = signs[:, 2:] * min(1.0, settings.ranges.position_m)
    columns = (
        calls(settings, ApiFunction.RESET, near_rad * signs[:, :2]),
        calls(settings, ApiFunction.STEP, pulled),
    )
    yield from np.stack(columns, axis=1)


def _surround(settings: Settings, rng: np.random.Generator, made: Tape) -> Tape:
    """Put a call between good steps; the refused step after it shows the last command."""
    steps = calls(settings, ApiFunction.STEP, _good_steps(settings, rng, 4))
    refused = calls(settings, ApiFunction.STEP, np.full((1, len(STATE)), np.nan))
    return np.concatenate([steps[:2], made, refused, steps[2:]])


def _good_steps(settings: Settings, rng: np.random.Generator, n: int) -> Array:
    """Draw inputs of steps within the ranges (n, k), in the columns of `StepRows`."""
    ranges, method = settings.ranges, method_of(settings)
    position_m, speed_m_s = min(1.0, ranges.position_m / 4), min(1.0, ranges.velocity_m_s / 4)
    scale = np.array([position_m] * 2 + [speed_m_s] * 2 + [0.3, 0.3, 3.0])
    state = rng.uniform(-1, 1, (n, 7)) * scale
    target = state[:, :4] + 0.1 * rng.uniform(-1, 1, (n, 4)) * scale[:4]
    low, high = ranges.thrust_acceleration_min_m_s2, ranges.thrust_acceleration_max_m_s2
    thrust = np.clip(rng.uniform(8, 12, n), low, high)
    if method.target_observer is not None:
        accelerations = rng.uniform(-0.5, 0.5, (n, 2)) * target_limit_m_s2(settings)
        target = np.concatenate([target, accelerations], axis=1)
    if not method.has_height:
        state, target = completed(method, "state", state, rng), completed(method, "target", target, rng)
        return StepRows(method).join(StepInputs(state, target, thrust))
    own = rng.uniform(-1, 1, (n, 2)) * scale[[0, 2]]
    goal = own + 0.1 * rng.uniform(-1, 1, (n, 2)) * scale[[0, 2]]
    climbs = rng.uniform(-1, 1, (n, 1))
    state = np.concatenate([state, own, np.zeros((n, 1))], axis=1)
    target = np.concatenate([target, goal, climbs], axis=1)
    state, target = completed(method, "state", state, rng), completed(method, "target", target, rng)
    return StepRows(method).join(StepInputs(state, target, None))
