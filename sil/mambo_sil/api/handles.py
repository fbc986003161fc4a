"""What C of others calls in place of `Controller.step`: addresses of functions, of memory and of numbers."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.numbers.gravity import hover_thrust
from mambo_sil.api.api_controller import Controller
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.columns import SPACE, TARGET
from mambo_sil.flight.controllers.controller_library import ffi
from mambo_sil.flight.states import TargetState


def is_native(controller: Controller) -> bool:
    """Return whether C alone computes a step: with `[height]` in the settings, and no lever."""
    return controller._method.has_height and controller._lever_m is None


class ControllerHandles:
    """The functions and the memory of controllers for which `is_native` holds.

    members: by the names of records in C: `step`, `reset`, `slew_heading`, `controllers` and
             `controller_bytes`, `hover`, the command of a reset, and `most_turn_rad`.
    """

    def __init__(self, controller: Controller) -> None:
        compiled, self._heading = controller._compiled, controller._heading
        step, memory, stride = compiled.native
        reset, self._hover = compiled.native_reset([[0.0, 0.0, hover_thrust(controller.settings)]])
        self.members: dict[str, float] = {
            "step": as_address(step),
            "reset": as_address(reset),
            "slew_heading": as_address(compiled.native_slew_heading),
            "controllers": as_address(memory),
            "controller_bytes": stride,
            "hover": self._hover.ctypes.data,
            "most_turn_rad": self._heading.most_rad,
        }

    def headings_rad(self) -> FloatArray:
        """Return the set-points (n,) themselves, to be changed; valid until the next step or reset."""
        self._heading.yaw_rad = self._heading.yaw_rad.copy()  # an outcome may show the others
        return self._heading.yaw_rad


def as_address(pointer: Any) -> int:
    """Return the address of a function or of memory of cffi."""
    return int(ffi.cast("uintptr_t", pointer))


def target_rows(target: TargetState) -> NDArray[np.float64]:
    """Return targets with x, y, z (..., columns) in the columns of the closed loop."""
    rows = np.zeros((*target.batch, SPACE.target))
    rows[..., TARGET["known"]] = target.known
    vectors = {
        ("position_m", "height_m"): target.position_m,
        ("velocity_m_s", "climb_m_s"): target.velocity_m_s,
        ("acceleration_m_s2", "climb_acceleration_m_s2"): target.acceleration_m_s2,
        ("ahead_m_s2", "climb_ahead_m_s2"): target.ahead_m_s2,
    }
    for (level, upward), values in vectors.items():
        if values is not None:
            rows[..., TARGET[level]], rows[..., TARGET[upward]] = values[..., :2], -values[..., 2:]
    return rows
