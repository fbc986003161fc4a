"""Controllers as the engine calls them: C functions, and C wrappers around them."""

from dataclasses import astuple, dataclass
from typing import Any, Protocol, runtime_checkable

from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import ffi as controller_ffi
from mambo_sil.flight.controllers.pd import (
    ERROR_LIMIT_M,
    POSITION_D_RAD_S_M,
    POSITION_P_RAD_M,
    TILT_LIMIT_RAD,
    PdController,
    PdFeedForwardController,
)
from mambo_sil.flight.engine.engine_library import ffi
from mambo_sil.flight.loop import PositionController

EngineController = CompiledController | PdController | PdFeedForwardController
"""Controllers whose step is a C function."""


@dataclass(frozen=True, eq=False)
class Native:
    """n controllers in C: the function of a step, their instances, and the bytes from one to the next.

    kept: whatever the instances point to, which lives as long as this record.
    """

    step: Any
    instances: Any
    stride: int
    kept: tuple[Any, ...] = ()

    def instance(self, index: int) -> Any:
        """Return a pointer to the instance of flight `index`."""
        return ffi.cast("char *", self.instances) + index * self.stride


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
        case CompiledController():
            step, instances, stride = controller.native
            return Native(foreign("engine_controller_t", step), foreign("char *", instances), stride)
    raise TypeError(f"{type(controller).__name__} is no C function")


def foreign(kind: str, address: Any) -> Any:
    """Return a pointer of the controllers' interface as one of the engine's."""
    return ffi.cast(kind, int(controller_ffi.cast("intptr_t", address)))


def pd_function(controller: PdController | PdFeedForwardController) -> tuple[str, Any]:
    """Return the name of the engine's function that is the step of a PD, and its record of constants."""
    if isinstance(controller, PdController):
        constants = POSITION_P_RAD_M, POSITION_D_RAD_S_M, ERROR_LIMIT_M
        return "engine_pd_step", ffi.new("engine_pd_t *", constants)
    gains = (*astuple(controller.gains), TILT_LIMIT_RAD)
    return "engine_pd_feedforward_step", ffi.new("engine_pd_feedforward_t *", gains)
