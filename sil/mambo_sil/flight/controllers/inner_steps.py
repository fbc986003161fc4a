"""Record the optimizer's iterations within a control step: plan, cost, gradient, sign decision, step size."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods.one_norm.arithmetic import OneNormArithmetic
from mambo_codegen.methods.one_norm.controller import OneNormController, OneNormStep
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.methods.one_norm.optimizer import Evaluate, Rprop, Search
from mambo_codegen.methods.shared.math import Real, sign
from mambo_codegen.settings.model import Settings


@dataclass(frozen=True)
class InnerSteps:
    """The i iterations of one control step of n controllers; values of refused steps are meaningless.

    plan_rad: (i, n, control, 2) plan that each iteration evaluates, rad.
    cost:     (i, n) its cost.
    gradient: (i, n, control, 2) its gradient, per rad.

    Fixed-point values are converted to SI units in float64 without rounding.
    """

    plan_rad: Real
    cost: Real
    gradient: Real

    def decisions(self, settings: Settings) -> NDArray[np.int8]:
        """Return the gradient signs (i, n, control, 2) that RPROP uses: all 0 after convergence."""
        numbers = OneNorm(settings).numbers
        tolerance = numbers.to_si(numbers.constant(settings.optimizer.tolerance, "cost"), "cost")
        at_rest = np.zeros(self.cost.shape, np.bool_)
        at_rest[1:] = np.logical_or.accumulate(np.abs(np.diff(self.cost, axis=0)) < tolerance)
        return np.where(at_rest[:, :, None, None], 0, sign(self.gradient)).astype(np.int8)

    def step_sizes_rad(self, settings: Settings) -> Real:
        """Return RPROP's step sizes (i, n, control, 2) after the update of each iteration."""
        method = OneNorm(settings)
        rprop = Rprop(settings, OneNormArithmetic(method))
        size = np.full(self.plan_rad[0].shape, rprop.initial_step)
        before = np.zeros_like(size)
        sizes = []
        for slope in self.decisions(settings).astype(size.dtype):
            agreement = slope * before
            size = rprop.next_step(size, agreement)
            before = np.where(agreement < 0, np.zeros_like(slope), slope)
            sizes.append(size)
        return method.numbers.to_si(np.stack(sizes), "angle")


class WatchedController:
    """n reference controllers that record the iterations of every control step."""

    def __init__(self, settings: Settings, n: int = 1) -> None:
        self.settings = settings
        method = OneNorm(settings)
        self.controller = OneNormController(method, n, self._watch)
        self._numbers = method.numbers
        self.steps: list[InnerSteps] = []
        self._evaluated: list[list[Real]] = []

    def step(self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike) -> OneNormStep:
        """Compute the next commands like `OneNormController.step`, and append to `steps`."""
        self._evaluated = []
        step = self.controller.step(state, target, thrust_acceleration_m_s2)
        self.steps.append(InnerSteps(*(np.stack(values) for values in zip(*self._evaluated, strict=True))))
        return step

    def _watch(self, rprop: Rprop, evaluate: Evaluate, start: Real) -> Search:
        def watch(moves_rad: Real) -> tuple[Real, Real]:
            cost, gradient = evaluate(moves_rad)
            values = {"angle": moves_rad, "cost": cost, "gradient": gradient}
            self._evaluated.append(
                [self._numbers.to_si(v.copy(), quantity) for quantity, v in values.items()]
            )
            return cost, gradient

        return rprop.minimize(watch, start)


def write_inner_steps(watched: WatchedController, path: Path) -> None:
    """Write the iterations of k control steps as NPZ: the arrays of `InnerSteps`, and `step_size_rad`.

    Each has shape (k, i, n, ...).
    """
    with path.open("wb") as file:
        np.savez_compressed(
            file,
            plan_rad=np.stack([inner.plan_rad for inner in watched.steps]),
            cost=np.stack([inner.cost for inner in watched.steps]),
            gradient=np.stack([inner.gradient for inner in watched.steps]),
            step_size_rad=np.stack([inner.step_sizes_rad(watched.settings) for inner in watched.steps]),
        )
