"""The optimizer's inner steps, watched: what each iteration evaluated, and which way it decided to go."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from codegen.reference import Memory, ReferenceController, Step
from codegen.reference.math import Real, sign
from codegen.reference.optimizer import Evaluate, Search, minimize
from codegen.settings import Settings


@dataclass(frozen=True)
class InnerSteps:
    """The iterations (i) of one control step of n controllers; what a refused step holds means nothing.

    plan_rad: (i, n, control, 2) the plan that each iteration evaluated.
    cost:     (i, n) its cost.
    gradient: (i, n, control, 2) its gradient, per rad.
    """

    plan_rad: Real
    cost: Real
    gradient: Real

    def decisions(self, settings: Settings) -> NDArray[np.int8]:
        """Return the sign (i, n, control, 2) by which RPROP updates each move: 0 once the cost is at rest."""
        tolerance = self.cost.dtype.type(settings.optimizer.tolerance)
        at_rest = np.zeros(self.cost.shape, np.bool_)
        at_rest[1:] = np.logical_or.accumulate(np.abs(np.diff(self.cost, axis=0)) < tolerance)
        return np.where(at_rest[:, :, None, None], 0, sign(self.gradient)).astype(np.int8)


def watched_step(
    settings: Settings,
    memory: Memory,
    state: ArrayLike,
    target: ArrayLike,
    thrust_acceleration_m_s2: ArrayLike,
) -> tuple[Step, InnerSteps]:
    """Let n reference controllers that remember `memory` step once, and return what they did inside."""
    evaluated: list[tuple[Any, Any, Any]] = []

    def watching(chosen: Settings, evaluate: Evaluate, start: Real) -> Search:
        def watch(moves_rad: Real) -> tuple[Real, Real]:
            cost, gradient = evaluate(moves_rad)
            evaluated.append((moves_rad.copy(), cost.copy(), gradient.copy()))
            return cost, gradient

        return minimize(chosen, watch, start)

    controller = ReferenceController(settings, len(memory.command_rad), watching)
    controller.memory = memory
    step = controller.step(state, target, thrust_acceleration_m_s2)
    plan_rad, cost, gradient = (np.stack(values) for values in zip(*evaluated, strict=True))
    return step, InnerSteps(plan_rad, cost, gradient)
