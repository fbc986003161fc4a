"""Inputs of the comparison: the sets W, T, F and C of docs/evidence/benchmarks.md."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings import presets
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.trajectories import Bernoulli

Inputs = NDArray[np.float32]
"""(n, 6): x (m), vx (m/s), y, vy of the drone less the target's; roll and pitch last commanded (rad)."""

COUNT: Final = 1000
_LAST_RAD: Final = 0.1
_WITHIN: Final = {"W": [0.5, 1.0], "T": [0.05, 0.1], "F": [0.005, 0.01]}
_NOISE: Final = [0.01, 0.05]
"""Of position (m) and velocity (m/s)."""
_SEED: Final = 1
_SETTLED_S: Final = 10.0


def state_sets() -> dict[str, Inputs]:
    """Return the sets, (COUNT, 6) each."""
    random = np.random.default_rng(_SEED)
    sets = {}
    for name, within in _WITHIN.items():
        scale = [*within, *within, _LAST_RAD, _LAST_RAD]
        sets[name] = (random.uniform(-1, 1, (COUNT, 6)) * scale).astype(np.float32)
    sets["C"] = _flown(random)
    return sets


def _flown(random: np.random.Generator) -> Inputs:
    """Fly preset mambo for 10 s after it has settled, and add measurement noise."""
    flight = Flight(Bernoulli(2.0, 0.5), duration_s=_SETTLED_S + 0.01 * COUNT)
    trace: Any = fly(flight, CompiledController(presets.load("mambo")))
    error = np.concatenate([trace.position_m[..., :2], trace.velocity_m_s[..., :2]], -1) - trace.target
    x, y, vx, vy = error[-COUNT:, 0].T
    noise = random.standard_normal((COUNT, 4)) * (_NOISE * 2)
    seen = np.stack([x, vx, y, vy], 1) + noise
    return np.concatenate([seen, np.zeros((COUNT, 2))], 1).astype(np.float32)
