"""The controller alone, told less of its targets than a trajectory knows: what an app or a block tells it."""

from typing import Any

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.columns import TARGET
from mambo_sil.flight.controllers.compiled import CompiledController


class Knowing:
    """Its targets know their position and velocity, with `known` 1 their acceleration too."""

    def __init__(self, settings: Settings, known: int) -> None:
        self._controller, self._known = CompiledController(settings), known

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Any:
        """Return the next commands."""
        told = target.copy()
        told[:, TARGET["known"]] = self._known
        told[:, TARGET["ahead_m_s2"]] = 0.0
        if not self._known:
            told[:, TARGET["acceleration_m_s2"]] = 0.0
        return self._controller.step(state, told, thrust_acceleration_m_s2)
