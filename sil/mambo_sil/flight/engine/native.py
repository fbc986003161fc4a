"""Controllers as the engine calls them: C functions, C wrappers around them, and one in Python."""

import math
from collections.abc import Callable
from dataclasses import asdict, astuple, dataclass, replace
from typing import Any, Final, Protocol, runtime_checkable

import numpy as np

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.flight.columns import LEVEL, Columns
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import ffi as controller_ffi
from mambo_sil.flight.controllers.pd import (
    ERROR_LIMIT_M,
    INTEGRAL_LIMIT_RAD,
    INTEGRATED_ERROR_M,
    JERK_LIMIT_M_S3,
    POSITION_D_RAD_S_M,
    POSITION_P_RAD_M,
    TILT_LIMIT_RAD,
    AnyPd,
    PdController,
    PdFeedForwardController,
    PidFeedForwardController,
)
from mambo_sil.flight.controllers.thrust_controller import columns_of, numbers_of
from mambo_sil.flight.engine.engine_library import ffi
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.names import PdName

EngineController = CompiledController | AnyPd
"""Controllers whose step is a C function."""
PD_STEPS: Final[dict[PdName, str]] = {
    "pd": "engine_pd_step",
    "pd-feedforward": "engine_pd_feedforward_step",
    "pid-feedforward": "engine_pid_feedforward_step",
}
"""The engine's functions of the laws without a model, by name."""


@dataclass(frozen=True, eq=False)
class Native:
    """n controllers in C: the function of a step, their instances, and the bytes from one to the next.

    kept: whatever the instances point to, which lives as long as this record.
    columns: what they take and give.
    """

    step: Any
    instances: Any
    stride: int
    kept: tuple[Any, ...] = ()
    columns: Columns = LEVEL

    def instance(self, index: int) -> Any:
        """Return a pointer to the instance of flight `index`."""
        return ffi.cast("char *", self.instances) + index * self.stride

    def wrapped(self, step: Any, instances: Any, stride: int, kept: tuple[Any, ...]) -> "Native":
        """Return n wrappers around these controllers: they take the same targets and command the same."""
        return replace(self, step=step, instances=instances, stride=stride, kept=(self, *kept))


@runtime_checkable
class Wrapper(Protocol):
    """A controller around another one, with a twin in C."""

    @property
    def controller(self) -> PositionController:
        """The controller inside."""
        ...

    def wrap(self, engine: Any, inner: Native) -> Native:
        """Return the twin in `engine` around `inner`."""
        ...


def is_native(controller: PositionController) -> bool:
    """Return whether the engine can call a controller."""
    while isinstance(controller, Wrapper):
        controller = controller.controller
    return isinstance(controller, EngineController)


def native(engine: Any, controller: PositionController) -> Native:
    """Return a controller for which `is_native` holds as `engine` calls it."""
    if isinstance(controller, Wrapper):
        return controller.wrap(engine, native(engine, controller.controller))
    match controller:
        case PdController() | PdFeedForwardController():
            name, constants = pd_function(controller)
            return Native(getattr(engine, name), constants, 0)
        case PidFeedForwardController():
            name, records = pd_function(controller)
            return Native(getattr(engine, name), records, ffi.sizeof("engine_pid_feedforward_t"))
        case CompiledController():
            step, instances, stride = controller.native
            return Native(foreign("engine_controller_t", step), foreign("char *", instances), stride)
    raise TypeError(f"{type(controller).__name__} is no C function")


def foreign(kind: str, address: Any) -> Any:
    """Return a pointer of the controllers' interface as one of the engine's."""
    return ffi.cast(kind, int(controller_ffi.cast("intptr_t", address)))


def pd_function(controller: AnyPd) -> tuple[str, Any]:
    """Return the name of the engine's function that is the step of a law without a model, and its records."""
    match controller:
        case PdController():
            constants = POSITION_P_RAD_M, POSITION_D_RAD_S_M, ERROR_LIMIT_M
            return PD_STEPS["pd"], ffi.new("engine_pd_t[]", [constants])
        case PdFeedForwardController():
            gains = (*astuple(controller.gains), TILT_LIMIT_RAD)
            return PD_STEPS["pd-feedforward"], ffi.new("engine_pd_feedforward_t[]", [gains])
        case PidFeedForwardController():
            records = ffi.new("engine_pid_feedforward_t[]", [_pid_record(controller)] * controller.n)
            return PD_STEPS["pid-feedforward"], records


def _pid_record(controller: PidFeedForwardController) -> dict[str, Any]:
    """Return the members of a record of the PID at its start; those that are missing are 0."""
    gains = asdict(controller.gains)
    del gains["low_pass_s"]
    return gains | {
        "low_pass_share": controller.low_pass_share,
        "update_period_s": controller.update_period_s,
        "gravity_m_s2": GRAVITY_M_S2,
        "integral_limit_rad": INTEGRAL_LIMIT_RAD,
        "integrated_error_m": INTEGRATED_ERROR_M,
        "jerk_limit_m_s3": JERK_LIMIT_M_S3,
        "tilt_limit_rad": TILT_LIMIT_RAD,
        "acceleration_m_s2": (math.nan, math.nan),
    }


@runtime_checkable
class EachAlone(Protocol):
    """n controllers in Python of which each can be called alone."""

    def of_flight(self, flight: int) -> PositionController:
        """Return the controller of a flight."""
        ...


def can_call_back(flight: Flight, controller: PositionController) -> bool:
    """Return whether the engine can call a controller in Python: flight by flight."""
    return flight.flights == 1 or isinstance(controller, EachAlone)


def called_back(
    flight: Flight, controller: PositionController, progress: Callable[[float], None] | None
) -> tuple[Native, list[BaseException]]:
    """Return a controller in Python, and the list in which its exception will be.

    The bits are those of the loop in NumPy. After an exception, which cannot pass through C, the controller
    is not called any more.
    """
    columns, errors = columns_of(controller), list[BaseException]()
    targets = flight.targets_for(columns)
    updates, done = len(targets) * flight.flights, 0
    each = [controller]
    if isinstance(controller, EachAlone):
        each = [controller.of_flight(number) for number in range(flight.flights)]
    numbers_of_flights = ffi.new("int64_t[]", list(range(flight.flights)))

    def step(itself: Any, state: Any, target: Any, thrust_m_s2: float, command: Any) -> int:
        nonlocal done
        if errors:
            return NOT_CALLED
        called = each[ffi.cast("int64_t *", itself)[0]]
        measured, wanted = _row(state, columns.state), _row(target, targets.shape[2])
        outcome = called.step(measured, wanted, np.array([thrust_m_s2]))
        numbers = numbers_of(outcome)
        ffi.memmove(command, numbers, numbers.nbytes)
        done += 1
        if progress is not None:
            progress(done / updates)
        return int(outcome.status[0])

    def keep(_kind: Any, error: BaseException, traceback: Any) -> None:
        errors.append(error.with_traceback(traceback))

    function = ffi.callback("engine_controller_t", step, error=NOT_CALLED, onerror=keep)
    stride = ffi.sizeof("int64_t")
    return Native(function, numbers_of_flights, stride, (function, numbers_of_flights), columns), errors


def _row(numbers: Any, columns: int) -> FloatArray:
    """Return numbers of the engine as an array (1, columns) of its own."""
    return np.frombuffer(ffi.buffer(numbers, 8 * columns)).copy()[np.newaxis]
