"""Compare two controllers with a quadratic cost bit for bit, in flights with all that may go wrong."""

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods.quadratic.controller import QuadraticStep
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.settings.model import Settings
from mambo_sil.verify.step_inputs import StepInputs, random_steps
from tests.support.parity import count_differing

FIELDS = ("status", "command_rad", "missed", "saturated", "stored")
BAD_COMMANDS = (np.nan, np.inf, 4.0, -4.0)


class ExactController(Protocol):
    """What reference and compiled controller share."""

    def reset(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Start over."""

    def set_command(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Replace the last command."""

    def step(self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike) -> QuadraticStep:
        """Compute the next commands."""


class ExactRun(NamedTuple):
    """What a controller answered: the statuses of its setters, and the outcome of every step."""

    setters: list[NDArray[np.int64]]
    steps: list[QuadraticStep]


def inputs_of_steps(settings: Settings, n: int, steps: int, seed: int) -> list[StepInputs]:
    """Draw the inputs of consecutive steps of n controllers.

    Of five controllers two get independent inputs; two fly: state, target and yaw change little from step to
    step, and jump at times; the last flies and misses its state at times, for fewer steps than it may, for as
    many, and for more.
    """
    rng = np.random.default_rng(seed)
    drawn = random_steps(settings, n, steps, rng)
    ranges, most = settings.ranges, Quadratic(settings).observer.outage_steps
    period_s = settings.horizon.update_period_s
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
        inputs.state[:] = np.where(calm[:, None], state, inputs.state)
        starts = (left == 0) & (rng.random(n) < 0.1) & (np.arange(n) % 5 == 4)
        lengths = rng.choice([1, 2, max(1, most - 1), max(1, most), most + 1, most + 3], n)
        left = np.where(starts, lengths, np.maximum(left - 1, 0))
        inputs.state[left > 0, 6] = np.nan
    return drawn


def run(controller: ExactController, inputs: list[StepInputs], seed: int) -> ExactRun:
    """Step a fresh controller through `inputs`; reset it and set its command on the way, also to bad ones."""
    rng = np.random.default_rng(seed)
    setters: list[NDArray[np.int64]] = []
    steps: list[QuadraticStep] = []
    for index, case in enumerate(inputs):
        command = rng.uniform(-1.5, 1.5, (len(case.thrust), 2))
        command[::5, 0] = rng.choice(BAD_COMMANDS, len(command[::5]))
        if index == len(inputs) // 2:
            setters.append(controller.reset(command))
        elif index % 7 == 5:
            setters.append(controller.set_command(command))
        steps.append(controller.step(case.state, case.target, case.thrust))
    return ExactRun(setters, steps)


def differences(a: ExactRun, b: ExactRun) -> dict[str, int]:
    """Count by field the values that differ in any bit; empty when there are none."""
    pairs: dict[str, tuple[list[NDArray[Any]], list[NDArray[Any]]]] = {
        name: ([getattr(s, name) for s in a.steps], [getattr(s, name) for s in b.steps]) for name in FIELDS
    }
    pairs["setters"] = (list(a.setters), list(b.setters))
    counts = {name: count_differing(*both) for name, both in pairs.items()}
    return {name: count for name, count in counts.items() if count}
