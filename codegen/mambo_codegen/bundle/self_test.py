"""The self-test vectors of a bundle: inputs of consecutive steps, and the results of the reference."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from mambo_codegen.bundle.digest import step_digest
from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.methods.shared.tracker_constants import given_limit_m_s2
from mambo_codegen.numbers.gravity import hover_thrust
from mambo_codegen.numbers.literals import SCALARS
from mambo_codegen.settings.model import Settings

STEPS: Final = 24
_GOLDEN_RATIO: Final = 0.6180339887498949


@dataclass(frozen=True)
class SelfTestStep:
    """One step: its inputs as in `ReferenceController.step`, the thrust None with a height, and its status.

    digest: of all results that `Method.digested` names, of 32 bits.
    """

    state: tuple[float, ...]
    target: tuple[float, ...]
    thrust_acceleration_m_s2: float | None
    status: Status
    digest: int


@lru_cache(maxsize=64)
def self_test(settings: Settings) -> tuple[SelfTestStep, ...]:
    """Run the reference controller through the inputs of a typical flight.

    The first input has a position error below the smallest normal number, so that a board that flushes such
    numbers to zero fails. Every seventh input is out of range: first a state, then a target, then a thrust.
    For a tracker that reads it the target's velocity changes little from step to step. With a height every
    sixth input is out of range, the last of them a height, and the drone touches the floor in every fifth
    step. The values are a Weyl sequence; a library's random numbers may change with its version.
    """
    method = method_of(settings)
    controller = method.reference_controller()

    def step(state: list[float], target: list[float], thrust: float) -> SelfTestStep:
        given = None if method.has_height else thrust
        made = controller.step([state], [target], None if given is None else [given])
        return SelfTestStep(
            state=tuple(state),
            target=tuple(target),
            thrust_acceleration_m_s2=given,
            status=Status(int(made.status[0])),
            digest=int(step_digest(method, made, np.zeros(1, np.uint32))[0]),
        )

    ranges = settings.ranges
    position_m, speed_m_s = min(2.0, ranges.position_m / 2), min(1.0, ranges.velocity_m_s / 2)
    spread = _weyl_sequence()
    scalar = settings.code.scalar
    tiny = 0.0 if scalar == "fixed" else float(np.finfo(SCALARS[scalar]).smallest_normal) / 100
    still = [tiny] + [0.0] * (len(method.state) - 1)
    steps = [step(still, [0.0] * len(method.target), hover_thrust(settings))]
    tracker = method.tracker
    measures, given_m_s2 = tracker is not None and not tracker.is_given, given_limit_m_s2(settings) / 2
    velocity_m_s, change_m_s, climb_m_s = [0.0, 0.0], speed_m_s, 0.0
    if tracker and measures:
        change_m_s = min(tracker.tested_input, speed_m_s / 8)
    refused = 6 if method.has_height else 7
    for index in range(1, STEPS):
        target = [_next(spread, scale) for scale in (position_m, position_m, change_m_s, change_m_s)]
        if measures:
            velocity_m_s = [v + change for v, change in zip(velocity_m_s, target[2:], strict=True)]
            target[2:] = velocity_m_s
        error = [_next(spread, scale) for scale in (*[0.15 * position_m] * 2, *[0.5 * speed_m_s] * 2)]
        tilt = [_next(spread, settings.limits.tilt_rad) for _ in range(2)]
        state = [t + e for t, e in zip(target, error, strict=True)] + tilt + [_next(spread, 7.0)]
        if len(method.level_target) > len(target):
            target += [_next(spread, given_m_s2) for _ in range(2)]
        if method.has_height:
            goal_m, climb_change_m_s = _next(spread, position_m), _next(spread, change_m_s)
            climb_m_s = (climb_m_s * measures) + climb_change_m_s
            state += [goal_m + _next(spread, 0.15 * position_m), climb_m_s + _next(spread, 0.5 * speed_m_s)]
            state += [float(index % 5 == 4)]
            given = [_next(spread, given_m_s2)] if settings.target.acceleration != "none" else []
            target = [*target, goal_m, climb_m_s, *given][: len(method.target)]
        target += [_next(spread, given_m_s2) for _ in range(len(method.target) - len(target))]
        thrust = hover_thrust(settings, _next(spread, 2.0))
        if index % refused == refused - 1:
            match index // refused:
                case 0:
                    state[0] = 2 * ranges.position_m
                case 1:
                    target[3] = -2 * ranges.velocity_m_s
                case _:
                    state[7:8] = [2 * ranges.position_m] * len(state[7:8])
                    thrust = 0.0
        steps.append(step(state, target, thrust))
    return tuple(steps)


def _weyl_sequence() -> Iterator[float]:
    """Yield the Weyl sequence of the golden ratio, in 0..1."""
    fraction = 0.5
    while True:
        fraction = (fraction + _GOLDEN_RATIO) % 1.0
        yield fraction


def _next(spread: Iterator[float], scale: float) -> float:
    """Return the next value in -scale..scale, rounded to three decimals to keep the vectors readable."""
    return round(scale * (2 * next(spread) - 1), 3)
