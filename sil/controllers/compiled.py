"""The compiled controller: the generated C with the interface of the reference controller."""

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.reference import Step
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.representation import COMMAND, STATE, TARGET, THRUST, WEIGHTS, Representation
from mambo_nmpc.codegen.settings.controller_toml import with_option
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.codegen.toolchain import Toolchain, host_toolchain
from mambo_nmpc.sil.controllers.extension import load_extension


def with_default_prefix(settings: Settings) -> Settings:
    """Return `settings` with the prefix nmpc, which the Python side expects; no computed value changes."""
    return with_option(settings, "code.prefix", "nmpc")


def build_extension(settings: Settings, toolchain: Toolchain) -> ModuleType:
    """Generate the C of `settings` and build it as a Python extension; raises BuildError, CacheError."""
    return load_extension(
        render(with_default_prefix(settings), with_digest=False), settings.code.scalar, toolchain
    )


def digest_compiled(extension: ModuleType, episodes: int) -> int:
    """Return the self-test digest, computed by the C on this machine."""
    scratch = extension.ffi.new("nmpc_t *")
    digest = 0
    for episode in range(episodes):
        digest = extension.lib.nmpc_self_test_episode(scratch, episode, digest)
    return digest


def as_arrays(
    numbers: Representation, n: int, state: ArrayLike, target: ArrayLike, thrust: ArrayLike
) -> list[NDArray[Any]]:
    """Return state (n, 7), target (n, 4), thrust (n,) as the C reads them; raises ValueError for shapes."""
    return [
        as_array(numbers, values, quantities, shape)
        for values, quantities, shape in (
            (state, STATE, (n, 7)),
            (target, TARGET, (n, 4)),
            (thrust, THRUST, (n,)),
        )
    ]


def as_array(
    numbers: Representation, values: ArrayLike, quantities: Sequence[str], shape: tuple[int, ...]
) -> NDArray[Any]:
    """Return `values` as a contiguous array of the C's type; raises ValueError unless they have `shape`."""
    given = np.asarray(values)
    if given.shape != shape:
        raise ValueError(f"expected an array of shape {shape}, got {given.shape}")
    quantized = numbers.quantize(given.reshape(-1, len(quantities)), quantities)
    return np.ascontiguousarray(quantized.reshape(shape))


DIRT = b"\xa5"
"""Fills a controller's memory before nmpc_init, since memory on a board is not zero either."""


class CompiledController:
    """n controllers in generated C, with the interface of `codegen.reference.ReferenceController`."""

    def __init__(self, settings: Settings, n: int = 1, extension: ModuleType | None = None) -> None:
        self.settings = settings
        self._numbers = Design(settings).numbers
        self.scalar = self._numbers.scalar
        self._n = n
        self._moves = (settings.horizon.control, 2)
        extension = extension or build_extension(settings, host_toolchain())
        self._ffi, self._lib = extension.ffi, extension.lib
        self._controllers = self._ffi.new("nmpc_t[]", n)
        self._ffi.buffer(self._controllers)[:] = DIRT * self._ffi.sizeof(self._controllers)
        self._lib.nmpc_batch_init(self._controllers, n)

    def reset(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Reset all controllers to `command_rad` (n, 2), clamped to the tilt limit; returns a status (n,)."""
        return self._set_each(self._lib.nmpc_reset, "nmpc_command_t", command_rad, COMMAND)

    def set_weights(self, weights: ArrayLike) -> NDArray[np.int64]:
        """Set tracking and effort weight to `weights` (n, 2); returns a status (n,)."""
        return self._set_each(self._lib.nmpc_set_weights, "nmpc_weights_t", weights, WEIGHTS)

    def step(self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike) -> Step:
        """Compute the next commands from state (n, 7), target (n, 4) and thrust_acceleration_m_s2 (n,)."""
        n = self._n
        status, iterations, converged = (np.empty(n, np.intc) for _ in range(3))
        scalar, wide, to_si = self.scalar, self._numbers.wide, self._numbers.to_si
        command, plan = np.empty((n, 2), scalar), np.empty((n, *self._moves), scalar)
        cost, gradient = np.empty(n, wide), np.empty((n, *self._moves), wide)
        inputs = as_arrays(self._numbers, n, state, target, thrust_acceleration_m_s2)
        outcome = self._ffi.new("nmpc_outcome_t *")
        for name, kind, values in (
            ("status", "int", status),
            ("command", "nmpc_command_t", command),
            ("cost", "nmpc_sum_t", cost),
            ("gradient", "nmpc_sum_t", gradient),
            ("plan_rad", "nmpc_real_t", plan),
            ("iterations", "int", iterations),
            ("converged", "int", converged),
        ):
            setattr(outcome, name, self._pointer(kind, values))
        self._lib.nmpc_batch_step(
            self._controllers,
            n,
            self._pointer("nmpc_state_t", inputs[0]),
            self._pointer("nmpc_target_t", inputs[1]),
            self._pointer("nmpc_real_t", inputs[2]),
            outcome,
        )
        return Step(
            status=status.astype(np.int64),
            command_rad=to_si(command, "angle"),
            cost=to_si(cost, "cost"),
            gradient=to_si(gradient, "gradient"),
            plan_rad=to_si(plan, "angle"),
            iterations=iterations.astype(np.int64),
            converged=converged.astype(np.bool_),
        )

    def _pointer(self, kind: str, array: NDArray[Any]) -> Any:
        return self._ffi.cast(f"{kind} *", self._ffi.from_buffer(array))

    def _set_each(
        self, function: Any, kind: str, values: ArrayLike, quantities: Sequence[str]
    ) -> NDArray[np.int64]:
        array = as_array(self._numbers, values, quantities, (self._n, 2))
        pointer = self._pointer(kind, array)
        return np.array(
            [function(self._ffi.addressof(self._controllers, i), pointer + i) for i in range(self._n)],
            np.int64,
        )
