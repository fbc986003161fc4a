"""Frozen steps: inputs that are the same everywhere, and the digest of what a controller makes of them.

The inputs are a Weyl sequence over the ranges of a flight, every thirteenth of them out of range. The
digest is over the bits of every outcome, so builds that differ anywhere have different digests.
"""

import hashlib
from typing import Final, Protocol

import numpy as np

from codegen.reference import Step
from codegen.settings import Settings
from sil.arrays import FloatArray

TOGETHER: Final = 100
"""Controllers that step side by side."""

_GOLDEN_RATIO: Final = 0.6180339887498949
_WIDTH: Final = 12


class Controller(Protocol):
    """What can be stepped: reference, compiled, emulated."""

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Step:
        """Compute the next commands of TOGETHER controllers."""
        ...


def frozen_digest(settings: Settings, controller: Controller, steps: int) -> str:
    """Return the SHA-256 of the outcomes of `steps` frozen steps, TOGETHER at a time, in hexadecimal."""
    digest = hashlib.sha256()
    for tick in range(steps // TOGETHER):
        outcome = controller.step(*_inputs(settings, tick))
        for values in (
            outcome.status.astype("<i4"),
            outcome.iterations.astype("<i4"),
            outcome.converged.astype("<i4"),
            outcome.command_rad,
            outcome.cost,
            outcome.gradient,
            outcome.plan_rad,
        ):
            digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _inputs(settings: Settings, tick: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return states (TOGETHER, 7), targets (TOGETHER, 4) and thrusts (TOGETHER,) of one tick."""
    ranges = settings.ranges
    index = np.arange(TOGETHER * _WIDTH, dtype=np.float64) + (tick * TOGETHER * _WIDTH) + 1
    unit = 2 * np.reshape(np.modf(index * _GOLDEN_RATIO)[0], (TOGETHER, _WIDTH)) - 1
    position_m, speed_m_s = min(2.0, ranges.position_m / 2), min(1.0, ranges.velocity_m_s / 2)
    scale = np.array([position_m] * 2 + [speed_m_s] * 2)
    target = unit[:, 0:4] * scale
    near = np.choose(np.arange(TOGETHER) % 4, [1.0, 0.1, 0.01, 0.001])
    state = np.concatenate(
        [target + 0.5 * near[:, None] * unit[:, 4:8] * scale, 0.5 * unit[:, 8:10], 100 * unit[:, 10:11]],
        axis=1,
    )
    low, high = ranges.thrust_acceleration_min_m_s2, ranges.thrust_acceleration_max_m_s2
    thrust = np.clip(9.81 + 3 * unit[:, 11], low, high)
    refused = (np.arange(TOGETHER) + tick) % 13 == 0
    state[refused, 0] = np.nan
    return state, target, thrust
