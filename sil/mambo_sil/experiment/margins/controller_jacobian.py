"""The generated C as a linear system: copies of its memory with one number changed, stepped once."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from mambo_codegen.methods import method_of
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.controllers.compiled import CompiledController

_SETTLING_STEPS: Final = 100
_CHANGE: Final = 1e-6
"""Change of one number of memory or input; the law is linear there, so only rounding depends on it."""
_STATE_NUMBERS: Final = 7


@dataclass(frozen=True, eq=False)
class LinearController:
    """A controller at hover, at its target: memory' = a memory + b state, command = c memory + d state.

    a (k, k), b (k, 7), c (2, k), d (2, 7); the state is [x, y, vx, vy, roll, pitch, yaw], as it is seen.
    """

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray


def linear_controller(settings: Settings) -> LinearController | None:
    """Return the C of `settings` with scalar type float64 as a linear system; None if its law is not smooth.

    Raises BuildError, CacheError.
    """
    if method_of(settings).linear_law is None:
        return None
    settings = with_option(settings, "code.scalar", "float64")
    settled = CompiledController(settings)
    stored = 0
    for _ in range(_SETTLING_STEPS):
        stored = _step(settled, np.zeros((1, _STATE_NUMBERS))).stored.shape[1]
    changed = stored + _STATE_NUMBERS
    many = CompiledController(settings, 2 * changed)
    many.instances[:] = settled.instances
    changes = np.repeat(np.eye(changed), 2, axis=0) * np.tile([[_CHANGE], [-_CHANGE]], (changed, 1))
    _numbers(many, stored)[:] += changes[:, :stored]
    outcome = _step(many, changes[:, stored:])
    memory, command = (
        ((after[0::2] - after[1::2]) / (2.0 * _CHANGE)).T
        for after in (_numbers(many, stored), outcome.command_rad)
    )
    return LinearController(memory[:, :stored], memory[:, stored:], command[:, :stored], command[:, stored:])


def _step(controller: CompiledController, state: FloatArray) -> Any:
    """Step controllers whose target is the origin, at hover thrust; with a height it is 0, too."""
    if controller.settings.height is not None:
        heights = np.zeros((controller.n, 3))
        return controller.step(np.concatenate([state, heights], axis=1), np.zeros((controller.n, 9)))
    target, thrust = np.zeros((controller.n, 6)), np.full(controller.n, GRAVITY_M_S2)
    return controller.step(state, target, thrust)


def _numbers(controller: CompiledController, stored: int) -> FloatArray:
    """Return the numbers (n, stored) in the memory of controllers in float64, themselves and no copy."""
    beginning = controller.instances[:, : stored * np.dtype(np.float64).itemsize]
    numbers: FloatArray = beginning.view(np.float64)
    return numbers
