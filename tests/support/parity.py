"""Compare two controllers of one method bit for bit, with all that may go wrong in their inputs."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings
from mambo_sil.verify.cases import random_limits, random_shifts
from mambo_sil.verify.step_inputs import StepInputs, random_steps

BAD_COMMANDS = (np.nan, np.inf, 4.0, -4.0)


class Run(NamedTuple):
    """What a controller answered: the statuses of its setters, and the outcome of every step."""

    setters: list[NDArray[np.int64]]
    steps: list[Any]


def inputs_of_steps(settings: Settings, n: int, steps: int, seed: int) -> list[StepInputs]:
    """Draw the inputs of consecutive steps of n controllers."""
    rng = np.random.default_rng(seed)
    drawn, most = random_steps(settings, n, steps, rng), method_of(settings).outage_steps
    return drawn if most is None else _with_flights(settings, drawn, most, rng)


def _with_flights(
    settings: Settings, drawn: list[StepInputs], most: int, rng: np.random.Generator
) -> list[StepInputs]:
    """Replace inputs that are drawn for each step by those of flights, for a method that estimates.

    Of five controllers two get independent inputs; two fly: state, target and yaw change little from step to
    step, and jump at times; the last flies and misses its state at times, for fewer steps than it may, for as
    many, and for more.
    """
    n, ranges, period_s = len(drawn[0].state), settings.ranges, settings.horizon.update_period_s
    method = method_of(settings)
    flying = np.arange(n) % 5 >= 2
    scale = 10.0 ** rng.uniform(-3, 0.5, (n, 1))
    yaw, yaw_rate = rng.uniform(-7, 7, n), rng.choice([0.0, 1.0, -3.0], n)
    position, velocity = rng.normal(0, 1, (n, 2)), rng.normal(0, 1, (n, 2))
    left = np.zeros(n, np.int64)
    for inputs in drawn:
        jumps = rng.random(n) < 0.03
        velocity = np.where(jumps[:, None], rng.normal(0, 1, (n, 2)), velocity + rng.normal(0, 0.02, (n, 2)))
        position = np.where(jumps[:, None], rng.normal(0, 2, (n, 2)), position + (period_s * velocity))
        yaw = np.where(rng.random(n) < 0.02, rng.choice([1024.0, -1024.0, np.pi, 0.0], n), yaw)
        yaw = np.clip(yaw + (period_s * yaw_rate), -1024, 1024)
        target = np.concatenate([position, velocity], axis=1)
        state = np.concatenate(
            [
                target + (scale * rng.normal(0, 1, (n, 4))),
                settings.limits.tilt_rad * rng.uniform(-1, 1, (n, 2)),
                yaw[:, None],
            ],
            axis=1,
        )
        bounds = [ranges.position_m] * 2 + [ranges.velocity_m_s] * 2
        calm = flying & (rng.random(n) < 0.97)
        inputs.target[:, :4] = np.where(
            calm[:, None], np.clip(target, np.negative(bounds), bounds), inputs.target[:, :4]
        )
        state[:, :4] = np.clip(state[:, :4], np.negative(bounds), bounds)
        inputs.state[:, :7] = np.where(calm[:, None], state, inputs.state[:, :7])
        if method.has_height:
            _fly_height(settings, inputs, calm, scale, rng)
        starts = (left == 0) & (rng.random(n) < 0.1) & (np.arange(n) % 5 == 4)
        lengths = rng.choice([1, 2, max(1, most - 1), max(1, most), most + 1, most + 3], n)
        left = np.where(starts, lengths, np.maximum(left - 1, 0))
        inputs.state[left > 0, 6] = np.nan
    return drawn


def _fly_height(
    settings: Settings, inputs: StepInputs, calm: NDArray[np.bool_], scale: Any, rng: np.random.Generator
) -> None:
    """Let heights of flights differ little from those of their targets, which repeat those of y; in place."""
    numbers = method_of(settings).port.numbers("target")
    (first,) = (one.column for one in numbers if one.row.member == "height_m")
    limits = np.array([settings.ranges.position_m, settings.ranges.velocity_m_s])
    goal = np.clip(inputs.target[:, [1, 3]], -limits, limits)
    own = np.clip(goal + (scale * rng.normal(0, 1, goal.shape)), -limits, limits)
    inputs.target[calm, first : first + 2] = goal[calm]
    inputs.state[calm, 7:9] = own[calm]


def run(controller: Any, inputs: Sequence[StepInputs], seed: int) -> Run:
    """Step a fresh controller through `inputs`, bad values among the good.

    With a height the delivered thrust is set in every eleventh step.
    Halfway it is reset. What else its method sets is set then, if it is weights, or in every seventh step.
    In every 17th step the frame jumps.
    With limits, they change in every ninth step; with a guard, whether a position is measured, in every 13th.
    """
    rng = np.random.default_rng(seed)
    method = method_of(controller.settings)
    takes_weights, columns = bool(method.weight_limits), len(method.command)
    found = Run([], [])
    for index, case in enumerate(inputs):
        command = rng.uniform(-1.5, 1.5, (len(case.state), 2))
        if method.has_height:
            command = np.column_stack([command, rng.uniform(-5, 30, len(command))])
        command[::5, index % columns if columns > 2 else 0] = rng.choice(BAD_COMMANDS, len(command[::5]))
        if index == len(inputs) // 2:
            found.setters.append(controller.reset(command))
            if takes_weights:
                found.setters.append(controller.set_weights(_weights(rng, len(command))))
        elif index % 7 == 5 and not takes_weights:
            found.setters.append(controller.report_command(command))
        if method.has_height and index % 11 == 10:
            found.setters.append(controller.report_thrust(rng.choice([np.nan, 1e9, 3.0, 9.0], len(command))))
        if index % 17 == 4:
            found.setters.append(
                controller.frame_jumped(random_shifts(controller.settings, len(command), rng))
            )
        if index % 13 == 6 and method.guard is not None:
            found.setters.append(controller.set_position_measured(rng.random(len(command)) < 0.5))
        if index % 9 == 8 and method.limiting is not None:
            found.setters.append(controller.set_limits(random_limits(controller.settings, len(command), rng)))
        found.steps.append(controller.step(case.state, case.target, case.thrust))
    return found


def _weights(rng: np.random.Generator, n: int) -> NDArray[np.float64]:
    weights = 10.0 ** rng.uniform(-2, 6, (n, 2))
    weights[3::7] = rng.choice([0.0, 1e6], weights[3::7].shape)
    weights[::7, 1] = rng.choice([-1.0, np.nan, np.inf, 1.1e6], len(weights[::7]))
    return weights


def differences(a: Run, b: Run) -> dict[str, int]:
    """Count by field the values that differ in any bit; empty when there are none."""
    counts = {
        field.name: count_differing(
            [getattr(step, field.name) for step in a.steps], [getattr(step, field.name) for step in b.steps]
        )
        for field in fields(a.steps[0])
        if not getattr(a.steps[0], field.name) is getattr(b.steps[0], field.name) is None
    }
    counts["setters"] = count_differing(a.setters, b.setters)
    return {name: count for name, count in counts.items() if count}


def count_differing(ours: list[NDArray[Any]], theirs: list[NDArray[Any]]) -> int:
    """Count the values of equally many arrays that differ in any bit."""
    return sum(_differing(a, b) for a, b in zip(ours, theirs, strict=True))


def _differing(a: NDArray[Any], b: NDArray[Any]) -> int:
    assert a.dtype == b.dtype
    assert a.shape == b.shape
    if a.tobytes() == b.tobytes():
        return 0
    raw = [np.ascontiguousarray(values).view(np.uint8).reshape(-1, a.dtype.itemsize) for values in (a, b)]
    return int(np.any(raw[0] != raw[1], axis=1).sum())
