"""A controller in Python as the engine calls it: one flight, with the bits of the loop in NumPy."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.flight.controllers.thrust_controller import commands_thrust, has_preview, numbers_of
from mambo_sil.flight.engine.engine_library import ffi
from mambo_sil.flight.engine.native import Native
from mambo_sil.flight.loop import Flight, PositionController


def called_back(
    flight: Flight, controller: PositionController, progress: Callable[[float], None] | None
) -> tuple[Native, list[BaseException]]:
    """Return a controller of a single flight, and the list in which its exception will be.

    After an exception, which cannot pass through C, the controller is not called any more.
    """
    has_thrust, errors = commands_thrust(controller), list[BaseException]()
    targets = flight.targets_for(commands_thrust=has_thrust, has_preview=has_preview(controller))
    updates, done = len(targets), 0

    def step(_self: Any, state: Any, target: Any, thrust_m_s2: float, command: Any) -> int:
        nonlocal done
        if errors:
            return NOT_CALLED
        measured, wanted = _row(state, 10 if has_thrust else 7), _row(target, targets.shape[2])
        outcome = controller.step(measured, wanted, np.array([thrust_m_s2]))
        numbers = numbers_of(outcome)
        ffi.memmove(command, numbers, numbers.nbytes)
        done += 1
        if progress is not None:
            progress(done / updates)
        return int(outcome.status[0])

    def keep(_kind: Any, error: BaseException, traceback: Any) -> None:
        errors.append(error.with_traceback(traceback))

    function = ffi.callback("engine_controller_t", step, error=NOT_CALLED, onerror=keep)
    return Native(function, ffi.NULL, 0, (function,), has_thrust, has_preview(controller)), errors


def _row(numbers: Any, columns: int) -> FloatArray:
    """Return numbers of the engine as an array (1, columns) of its own."""
    return np.frombuffer(ffi.buffer(numbers, 8 * columns)).copy()[np.newaxis]
