"""Adapters: the generated C in the simulators of others, each with a page in docs/how-to.

Each imports its simulator when it is used, and says which command installs one that is missing.
"""

import importlib
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.api.api_controller import Controller
from mambo_sil.errors import ArgumentError, PackageError

HEIGHT_M: Final = 0.01
"""A drone that is less above its height at rest touches the floor."""
CLIMB_M_S: Final = 0.05
"""A drone that climbs or descends faster does not."""


def load(module: str, install: str) -> Any:
    """Return a module; raises PackageError, which names the command that installs it, if it is missing."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise PackageError(f"{package} cannot be imported ({error}); install it: {install}") from error


def touches_floor(position_m: Any, velocity_m_s: Any, rest_m: float = 0.0) -> NDArray[np.bool_]:
    """Return whether drones (...) with positions and velocities (..., 3), z up, touch the floor.

    Simulators do not report it, but imply it: such a drone is at the floor's height, without climb.

    rest_m: the height that the simulator gives for a drone that lies on it.
    """
    height_m, climb_m_s = np.asarray(position_m)[..., 2], np.asarray(velocity_m_s)[..., 2]
    return np.asarray((height_m < rest_m + HEIGHT_M) & (np.abs(climb_m_s) < CLIMB_M_S))


def demand_period(name: str, period_s: float, controller: Controller) -> None:
    """Raise ArgumentError unless the period `name` of a simulator is that of a controller."""
    if abs(period_s - controller.update_period_s) > 1e-6:
        rule = f"be {controller.update_period_s:g}, the update period of the controller"
        raise ArgumentError(f"{name} = {period_s!r} must {rule}: make it with update_period_s={period_s!r}")
