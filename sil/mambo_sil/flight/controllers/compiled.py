"""The compiled controller: the generated C with the interface of the reference controller."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from mambo_codegen.methods import Method, method_of
from mambo_codegen.methods.shared.limits_constants import LIMITS
from mambo_codegen.numbers.representation import THRUST, WEIGHTS, Representation
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.flight.controllers.controller_library import build_library, ffi


def digest_compiled(library: Any, episodes: int) -> int:
    """Return the self-test digest, computed by the C on this machine."""
    scratch = ffi.new("char[]", library.nmpc_batch_instance_bytes())
    digest = 0
    for episode in range(episodes):
        digest = library.nmpc_self_test_episode(scratch, episode, digest)
    return digest


def as_arrays(
    method: Method, n: int, state: ArrayLike, target: ArrayLike, thrust: ArrayLike | None
) -> list[NDArray[Any]]:
    """Return state (n, k), target (n, m) and, without a height, thrust (n,) as the C reads them.

    Columns of a target that the controller has no use for are left out. Raises ValueError for other shapes,
    and for a thrust that is missing or that there is not.
    """
    columns = len(method.target)
    if (thrust is None) != method.has_height:
        raise ValueError(f"a step takes {'no' if method.has_height else 'the'} thrust with these settings")
    return [
        as_array(method.numbers, values, quantities, shape)
        for values, quantities, shape in (
            (state, method.state, (n, len(method.state))),
            (np.asarray(target)[:, :columns], method.target, (n, columns)),
            *(() if thrust is None else ((thrust, THRUST, (n,)),)),
        )
    ]


def as_array(
    numbers: Representation, values: ArrayLike, quantities: Sequence[str], shape: tuple[int, ...]
) -> NDArray[Any]:
    """Return `values` as an array of the C's type; raises ValueError unless they have `shape`."""
    given = np.asarray(values)
    if given.shape != shape:
        raise ValueError(f"expected an array of shape {shape}, got {given.shape}")
    with np.errstate(over="ignore"):  # infinity, which the C refuses
        quantized = numbers.quantize(given.reshape(-1, len(quantities)), quantities)
    return np.ascontiguousarray(quantized).reshape(shape)


def empty_outcome(method: Method, n: int, integer: DTypeLike) -> dict[str, NDArray[Any]]:
    """Return the arrays that a step of n controllers fills, in the order of nmpc_outcome_t."""
    return {
        one.name: np.empty(
            (n, *one.shape), method.numbers.type_of(one.quantities[0]) if one.quantities else integer
        )
        for one in method.results
    }


Setter = Literal["set_weights", "set_limits"]
SETTERS: Final[tuple[Setter, ...]] = ("set_weights", "set_limits")
"""The functions that change a controller in flight."""


def setter_quantities(method: Method, setter: Setter) -> Sequence[str]:
    """Return the quantities of the numbers of a setter."""
    if setter == "set_weights":
        return WEIGHTS
    return method.limiting.quantities if method.limiting else LIMITS


_DISTURBANCE: Final = ("disturbance",)

DIRT = b"\xa5"
"""Fills a controller's memory before nmpc_init, since memory on a board is not zero either."""


class CompiledController:
    """n controllers in generated C, with the interface of the reference controller of their method."""

    def __init__(self, settings: Settings, n: int = 1, library: Any = None) -> None:
        self.settings = settings
        self._method = method_of(settings)
        self._numbers = self._method.numbers
        self.scalar = self._numbers.scalar
        self.n = n
        self._library = library or build_library(settings, host_toolchain())
        self._instance_bytes: int = self._library.nmpc_batch_instance_bytes()
        self._controllers = ffi.new("char[]", DIRT * (n * self._instance_bytes))
        self._library.nmpc_batch_init(self._controllers, n)

    @property
    def native(self) -> tuple[Any, Any, int]:
        """The function `nmpc_host_step`, the address of the first controller, and the bytes to the next."""
        return ffi.addressof(self._library, "nmpc_host_step"), self._controllers, self._instance_bytes

    def native_reset(self, command_rad: ArrayLike) -> tuple[Any, NDArray[Any]]:
        """Return the function `nmpc_host_reset`, and `command_rad` (n, 2) or (n, 3) as it reads them."""
        return self._native_set("nmpc_host_reset", command_rad, self._method.command)

    def native_setter(self, setter: Setter, values: ArrayLike) -> tuple[Any, NDArray[Any]]:
        """Return the function of a setter, and `values` (n, k) as it reads them."""
        return self._native_set(f"nmpc_host_{setter}", values, setter_quantities(self._method, setter))

    @property
    def native_slew_heading(self) -> Any:
        """The function `nmpc_host_slew_heading`."""
        return ffi.addressof(self._library, "nmpc_host_slew_heading")

    @property
    def instances(self) -> NDArray[np.uint8]:
        """The memory (n, bytes) of the controllers, itself and no copy."""
        whole = np.frombuffer(memoryview(ffi.buffer(self._controllers)), np.uint8)
        return whole[: self.n * self._instance_bytes].reshape(self.n, -1)

    def reset(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Reset all controllers to `command_rad` (n, 2), clamped to the tilt limit; returns a status (n,).

        With a height (n, 3), the thrust over mass too.
        """
        return self._set_each(self._library.nmpc_host_reset, command_rad, self._method.command)

    def set_weights(self, weights: ArrayLike) -> NDArray[np.int64]:
        """Set tracking and effort weight to `weights` (n, 2), of a 1-norm; returns a status (n,)."""
        return self._set_each(self._library.nmpc_host_set_weights, weights, WEIGHTS)

    def report_command(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Tell that `command_rad` (n, 2) or (n, 3) was sent, with a quadratic cost; returns a status (n,)."""
        return self._set_each(self._library.nmpc_host_report_command, command_rad, self._method.command)

    def frame_jumped(self, change: ArrayLike) -> NDArray[np.int64]:
        """Tell that the frames have jumped by `change` (n, 5), with a height (n, 7); returns a status (n,).

        The columns are those of `ReferenceController.frame_jumped`.
        """
        return self._set_each(self._library.nmpc_host_frame_jumped, change, self._method.shift)

    def report_thrust(self, thrust_m_s2: ArrayLike) -> NDArray[np.int64]:
        """Tell that the drones got thrusts over mass (n,); returns a status (n,).

        Raises ValueError without a height in the settings.
        """
        self._demand_height()
        return self._set_each(self._library.nmpc_host_report_thrust, np.asarray(thrust_m_s2)[:, None], THRUST)

    @property
    def last_thrust_m_s2(self) -> NDArray[np.float64]:
        """The thrusts over mass (n,) that were last commanded, set or reported.

        Raises ValueError without a height in the settings.
        """
        self._demand_height()
        thrusts = np.empty(self.n, self._numbers.type_of(*THRUST))
        self._library.nmpc_host_last_thrust(self._controllers, self.n, _address(thrusts))
        return self._numbers.to_si(thrusts, *THRUST).astype(np.float64)

    @property
    def last_disturbance_m_s2(self) -> NDArray[np.float64]:
        """The learnt accelerations (n, 2), x and y, that tilt and drag do not explain; none of a 1-norm."""
        found = np.empty((self.n, 2), self._numbers.type_of(*_DISTURBANCE))
        self._library.nmpc_host_last_disturbance(self._controllers, self.n, _address(found))
        return self._numbers.to_si(found, *_DISTURBANCE).astype(np.float64)

    def slew_heading(
        self, previous_rad: ArrayLike, wanted_rad: ArrayLike, most_change_rad: float
    ) -> NDArray[np.float64]:
        """Return what `nmpc_slew_heading` returns (n,) for previous and wanted headings (n,)."""
        given = [np.ascontiguousarray(values, np.float64) for values in (previous_rad, wanted_rad)]
        if any(values.shape != (self.n,) for values in given):
            raise ValueError(f"expected two arrays of shape {(self.n,)}")
        turned = np.empty(self.n)
        previous, wanted, found = (ffi.from_buffer("double[]", array) for array in (*given, turned))
        self._library.nmpc_host_slew_heading(self.n, previous, wanted, most_change_rad, found)
        return turned

    def set_limits(self, limits: ArrayLike) -> NDArray[np.int64]:
        """Replace the limits by `limits` (n, k), in the order of nmpc_limits_t; returns a status (n,).

        Raises ValueError without limits in the settings.
        """
        if self._method.limiting is None:
            raise ValueError("the settings have no limits")
        quantities = setter_quantities(self._method, "set_limits")
        return self._set_each(self._library.nmpc_host_set_limits, limits, quantities)

    def set_position_measured(self, is_measured: ArrayLike) -> NDArray[np.int64]:
        """Tell whether a position is measured (n,); returns a status (n,).

        Raises ValueError without a guard in the settings.
        """
        if self.settings.guard is None:
            raise ValueError("the settings have no guard")
        measured, status = np.ascontiguousarray(is_measured, np.uint8), np.empty(self.n, np.intc)
        function = self._library.nmpc_host_set_position_measured
        function(self._controllers, self.n, _address(measured), ffi.cast("int *", _address(status)))
        return status.astype(np.int64)

    def step(
        self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike | None = None
    ) -> Any:
        """Compute the next commands; the inputs are as of `ReferenceController.step`.

        Returns a step of the class `Method.step_type`.
        """
        inputs = as_arrays(self._method, self.n, state, target, thrust_acceleration_m_s2)
        outcome = empty_outcome(self._method, self.n, np.intc)
        self.stepper(inputs, outcome)()
        return self._method.make_step(outcome)

    def stepper(
        self, inputs: Sequence[NDArray[Any]], outcome: Mapping[str, NDArray[Any]]
    ) -> Callable[[], None]:
        """Return a function that steps all controllers, from arrays of `as_arrays` into `empty_outcome`'s.

        Each call reads what is in `inputs` then, and overwrites `outcome`.
        """
        given = [_address(values) for values in inputs] + [ffi.NULL] * (3 - len(inputs))
        results = [_address(values) for values in outcome.values()]
        addresses = ffi.new("void *[]", results)
        function, controllers, n = self._library.nmpc_batch_step, self._controllers, self.n

        def step(kept: object = results) -> None:  # noqa: ARG001 - keeps the arrays of the results alive
            function(controllers, n, *given, addresses)

        return step

    def _demand_height(self) -> None:
        if not self._method.has_height:
            raise ValueError("the settings have no height")

    def _native_set(
        self, name: str, values: ArrayLike, quantities: Sequence[str]
    ) -> tuple[Any, NDArray[Any]]:
        array = as_array(self._numbers, values, quantities, np.shape(values))
        return ffi.addressof(self._library, name), array

    def _set_each(self, function: Any, values: ArrayLike, quantities: Sequence[str]) -> NDArray[np.int64]:
        array = as_array(self._numbers, values, quantities, (self.n, len(quantities)))
        status = np.empty(self.n, np.intc)
        function(self._controllers, self.n, _address(array), ffi.cast("int *", _address(status)))
        return status.astype(np.int64)


def _address(array: Any) -> Any:
    """Return a pointer to the numbers of a contiguous array, which the caller keeps alive."""
    return ffi.from_buffer(array)
