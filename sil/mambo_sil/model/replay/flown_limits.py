"""The limits of our own flight mode of PX4: those of the settings, tightened by its parameters."""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.limits_constants import PLACES
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.controllers.compiled import CompiledController

Limits = Mapping[int, FloatArray]
"""The limits (k,) that are set before an update, by its number, in the order of nmpc_limits_t."""


class LimitParameter(NamedTuple):
    """A parameter MC_NMPC_* and the place of its limit in nmpc_limits_t; a least value, or a largest one."""

    name: str
    place: int
    is_least: bool = False


_TILT, _BRAKE = (
    LimitParameter("TILT", PLACES["tilt_rad"]),
    LimitParameter("BRAKE", PLACES["braking_m_s2"]),
)
PARAMETERS: Final = (
    _TILT,
    _BRAKE,
    LimitParameter("SPEED", PLACES["speed_m_s"]),
    LimitParameter("CLIMB", PLACES["climb_m_s"]),
    LimitParameter("DESCENT", PLACES["descent_m_s"]),
    LimitParameter("X_MIN", PLACES["fence_min_m"], is_least=True),
    LimitParameter("X_MAX", PLACES["fence_max_m"]),
    LimitParameter("Y_MIN", PLACES["fence_min_m"] + 1, is_least=True),
    LimitParameter("Y_MAX", PLACES["fence_max_m"] + 1),
    LimitParameter("Z_MIN", PLACES["floor_m"], is_least=True),
    LimitParameter("Z_MAX", PLACES["ceiling_m"]),
)
"""In the order in which the module sets them."""


def flown_limits(settings: Settings, parameters: Mapping[str, float]) -> FloatArray | None:
    """Return the limits (k,) of the module with `parameters`, by their names behind MC_NMPC_.

    As the module does: a parameter that is looser than the settings, or 0, changes nothing; less tilt leaves
    less braking; and one that the controller refuses is left out by itself. None without limits in the
    settings.
    """
    limiting = method_of(settings).limiting
    if limiting is None:
        return None
    real: type[np.floating[Any]] = np.float64 if settings.code.scalar == "float64" else np.float32
    own = limiting.limits.astype(real)
    wanted, controller = own.copy(), CompiledController(settings)
    tilt = _tighter(own[_TILT.place], parameters, _TILT, real)
    wanted[_BRAKE.place] = own[_BRAKE.place] * (tilt / own[_TILT.place])
    for one in PARAMETERS:
        if one == _BRAKE and wanted[_TILT.place] >= own[_TILT.place]:
            wanted[_BRAKE.place] = own[_BRAKE.place]
        before = wanted[one.place]
        limit = wanted[one.place] if one == _BRAKE else own[one.place]
        wanted[one.place] = _tighter(limit, parameters, one, real)
        if controller.set_limits(wanted[np.newaxis]).any():
            wanted[one.place] = before
    return np.asarray(wanted, np.float64)


def _tighter(
    limit: float, parameters: Mapping[str, float], one: LimitParameter, real: type[np.floating[Any]]
) -> float:
    """Return a limit, or what the parameter makes of it where that is tighter."""
    written = float(real(parameters.get(one.name, 0.0)))
    is_tighter = written >= limit if one.is_least else written <= limit
    return written if written != 0.0 and is_tighter else limit
