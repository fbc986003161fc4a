"""The emulated controller: the C as built for a board, on an emulated core, behind the same interface."""

from importlib import resources
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from codegen.footprint.build import Builder
from codegen.frozen import TICKS
from codegen.literals import SCALARS
from codegen.reference import Step
from codegen.render import render
from codegen.settings import Settings
from sil.compiled import DIRT, as_array, plainly_named
from sil.machine import TIME_LIMIT_S, Machine

GUEST: Final = ("nmpc_batch_step", "nmpc_batch_init", "nmpc_batch_instance_bytes", "nmpc_self_test_episode")
"""Functions of the guest that are called from outside."""

_WORK_A_CALL: Final = 2_000
"""Predicted steps times moves times iterations in one call of the guest, which has to end in time."""

_SECONDS_A_WORK: Final = 2e-4
"""What is granted for it on top of TIME_LIMIT_S: ten times what the slowest core takes on a slow machine."""


def build_guest(settings: Settings, builder: Builder, folder: Path) -> Path:
    """Build the program for an emulated core: the bundle of `settings` and the loop over n controllers."""
    glue = resources.files("sil").joinpath("batch.c").read_text("utf-8")
    return builder.guest(render(plainly_named(settings), with_digest=False), glue, GUEST, folder)


class EmulatedController:
    """n controllers on one emulated core, in a program that `build_guest` made for it."""

    def __init__(self, settings: Settings, elf: Path, core: str, n: int = 1) -> None:
        self.settings = settings
        self.scalar = SCALARS[settings.code.scalar]
        self._n = n
        horizon = settings.horizon
        self._shapes = {
            "status": (np.dtype(np.int32), ()),
            "command_rad": (np.dtype(self.scalar), (2,)),
            "cost": (np.dtype(self.scalar), ()),
            "gradient": (np.dtype(self.scalar), (horizon.control, 2)),
            "plan_rad": (np.dtype(self.scalar), (horizon.control, 2)),
            "iterations": (np.dtype(np.int32), ()),
            "converged": (np.dtype(np.int32), ()),
        }
        work = _work(settings)
        self._together = max(1, _WORK_A_CALL // work)
        limit_s = TIME_LIMIT_S + _SECONDS_A_WORK * max(work, _WORK_A_CALL)
        self.machine = Machine(elf, core, n * _bytes_each(settings) + 4096, limit_s)
        self._instance_bytes = self.machine.call("nmpc_batch_instance_bytes")
        self._controllers = self.machine.allocate(n * self._instance_bytes)
        real = np.dtype(self.scalar).itemsize
        self._inputs = [(self.machine.allocate(n * width * real), width * real) for width in (7, 4, 1)]
        self._outputs = {
            name: (self.machine.allocate(n * _size(kind, shape)), _size(kind, shape))
            for name, (kind, shape) in self._shapes.items()
        }
        self._outcome = self.machine.allocate(len(self._outputs) * 4)
        self.machine.write(self._controllers, DIRT * (n * self._instance_bytes))
        self.machine.call("nmpc_batch_init", self._controllers, n)

    def step(self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike) -> Step:
        """Compute the next commands from state (n, 7), target (n, 4) and thrust_acceleration_m_s2 (n,)."""
        given = (state, (self._n, 7)), (target, (self._n, 4)), (thrust_acceleration_m_s2, (self._n,))
        for (values, shape), (address, _) in zip(given, self._inputs, strict=True):
            self.machine.write(address, as_array(values, self.scalar, shape).tobytes())
        for first in range(0, self._n, self._together):
            self._step_few(first, min(self._together, self._n - first))
        outcome = {name: self._read(name) for name in self._outputs}
        return Step(
            **outcome
            | {
                "status": outcome["status"].astype(np.int64),
                "iterations": outcome["iterations"].astype(np.int64),
                "converged": outcome["converged"].astype(np.bool_),
            }
        )

    def _step_few(self, first: int, count: int) -> None:
        pointers = [address + (first * size) for address, size in self._outputs.values()]
        self.machine.write(self._outcome, np.array(pointers, "<u4").tobytes())
        controllers = self._controllers + (first * self._instance_bytes)
        inputs = [address + (first * size) for address, size in self._inputs]
        self.machine.call("nmpc_batch_step", controllers, count, *inputs, self._outcome)

    def _read(self, name: str) -> NDArray[Any]:
        kind, shape = self._shapes[name]
        address, size = self._outputs[name]
        return np.frombuffer(self.machine.read(address, self._n * size), kind).reshape(self._n, *shape)


def emulated_digest(settings: Settings, elf: Path, core: str, episodes: int) -> int:
    """Return the digest of the frozen steps on an emulated core, from a program of `build_guest`."""
    limit_s = TIME_LIMIT_S + _SECONDS_A_WORK * _work(settings) * TICKS
    machine = Machine(elf, core, _bytes_each(settings), limit_s)
    scratch = machine.allocate(machine.call("nmpc_batch_instance_bytes"))
    digest = 0
    for episode in range(episodes):
        digest = machine.call("nmpc_self_test_episode", scratch, episode, digest)
    return digest


def _work(settings: Settings) -> int:
    return settings.horizon.prediction * settings.horizon.control * settings.optimizer.iterations


def _size(kind: np.dtype[Any], shape: tuple[int, ...]) -> int:
    return kind.itemsize * int(np.prod(shape, dtype=np.int64))


def _bytes_each(settings: Settings) -> int:
    """Bound what one controller needs in the guest: instance, inputs and outcome, 8 bytes a number."""
    moves = 2 * settings.horizon.control
    return 8 * (40 + 6 * moves + 2 * settings.horizon.prediction)
