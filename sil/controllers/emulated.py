"""The emulated controller: the C as built for a board, on an emulated core, behind the same interface."""

import math
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.digest import TICKS
from mambo_nmpc.codegen.reference import Step
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.representation import OUTCOME
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.controllers.compiled import DIRT, as_arrays, plainly_named
from mambo_nmpc.sil.emulation.avr import Long
from mambo_nmpc.sil.emulation.machine import TIME_LIMIT_S, start
from mambo_nmpc.sil.errors import EmulatorError
from mambo_nmpc.sil.firmware.build import Builder

GUEST: Final = ("nmpc_batch_step", "nmpc_batch_init", "nmpc_batch_instance_bytes", "nmpc_self_test_episode")
"""Functions of the guest that are called from outside."""

_WORK_A_CALL: Final = 2_000
"""Predicted steps times moves times iterations in one call of the guest, which has to end in time."""

_SECONDS_A_WORK: Final = 2e-4
"""What is granted for it on top of TIME_LIMIT_S: ten times what the slowest core takes on a slow machine."""

_MOST_PADDING: Final = 16
"""Bytes that the alignment of an array may take."""


def build_guest(settings: Settings, builder: Builder, folder: Path) -> Path:
    """Build the program for an emulated core: the bundle of `settings` and the loop over n controllers."""
    glue = resources.files("mambo_nmpc.sil.controllers").joinpath("batch.c").read_text("utf-8")
    return builder.guest(render(plainly_named(settings), with_digest=False), glue, GUEST, folder)


class EmulatedController:
    """n controllers on one emulated core, in a program that `build_guest` made for it.

    They rest in this process and visit the core a few at a time, so that its memory holds any number of them.
    """

    def __init__(
        self, settings: Settings, elf: Path, core: str, n: int = 1, *, counting: bool = False
    ) -> None:
        self.settings = settings
        self._numbers = Design(settings).numbers
        self.scalar = self._numbers.scalar
        real, wide = np.dtype(self.scalar), np.dtype(self._numbers.wide)
        self._n = n
        horizon = settings.horizon
        work = _work(settings)
        limit_s = TIME_LIMIT_S + _SECONDS_A_WORK * max(work, _WORK_A_CALL)
        self.machine = start(elf, core, limit_s, counting=counting)
        integer = np.dtype(f"<i{self.machine.word_bytes}")
        self._shapes = {
            "status": (integer, ()),
            "command_rad": (real, (2,)),
            "cost": (wide, ()),
            "gradient": (wide, (horizon.control, 2)),
            "plan_rad": (real, (horizon.control, 2)),
            "iterations": (integer, ()),
            "converged": (integer, ()),
        }
        self._instance_bytes = self.machine.call("nmpc_batch_instance_bytes")
        sizes = [self._instance_bytes, *(width * real.itemsize for width in (7, 4, 1))]
        sizes += [kind.itemsize * math.prod(shape) for kind, shape in self._shapes.values()]
        self._together = min(n, max(1, _WORK_A_CALL // work), self._room(sizes) // sum(sizes))
        if self._together < 1:
            raise EmulatorError(
                f"a controller and what it is given take {sum(sizes)} B, "
                f"of which the emulated core has {self.machine.free_bytes} B free"
            )
        addresses = [self.machine.allocate(self._together * size) for size in sizes]
        self._controller, self._inputs, outputs = addresses[0], addresses[1:4], addresses[4:]
        self._outputs = dict(zip(self._shapes, outputs, strict=True))
        self._outcome = self.machine.allocate(len(outputs) * self.machine.word_bytes)
        self.machine.write(self._outcome, np.array(outputs, f"<u{self.machine.word_bytes}").tobytes())
        self._resting = bytearray(DIRT * (n * self._instance_bytes))
        for few in self._visits():
            self._visit(few, "nmpc_batch_init")

    def step(self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike) -> Step:
        """Compute the next commands from state (n, 7), target (n, 4) and thrust_acceleration_m_s2 (n,)."""
        inputs = as_arrays(self._numbers, self._n, state, target, thrust_acceleration_m_s2)
        outcome = {name: np.empty((self._n, *shape), kind) for name, (kind, shape) in self._shapes.items()}
        for few in self._visits():
            for address, values in zip(self._inputs, inputs, strict=True):
                self.machine.write(address, values[few].tobytes())
            self._visit(few, "nmpc_batch_step", *self._inputs, self._outcome)
            for name, values in outcome.items():
                content = self.machine.read(self._outputs[name], values[few].nbytes)
                values[few] = np.frombuffer(content, values.dtype).reshape(values[few].shape)
        for name, quantity in OUTCOME.items():
            outcome[name] = self._numbers.to_si(outcome[name], quantity)
        return Step(
            **outcome
            | {
                "status": outcome["status"].astype(np.int64),
                "iterations": outcome["iterations"].astype(np.int64),
                "converged": outcome["converged"].astype(np.bool_),
            }
        )

    def _room(self, sizes: list[int]) -> int:
        """Return the bytes for controllers: what is free less the pointers, and what alignment may take."""
        return (
            self.machine.free_bytes - len(sizes) * (self.machine.word_bytes + _MOST_PADDING) - _MOST_PADDING
        )

    def _visits(self) -> Iterator[slice]:
        """Yield which controllers are on the core together, in turn."""
        for first in range(0, self._n, self._together):
            yield slice(first, min(first + self._together, self._n))

    def _visit(self, few: slice, function: str, *arguments: int) -> None:
        """Take a few controllers to the core, call `function` on them, and take them back."""
        size, count = self._instance_bytes, few.stop - few.start
        place = slice(few.start * size, few.stop * size)
        self.machine.write(self._controller, bytes(self._resting[place]))
        self.machine.call(function, self._controller, count, *arguments)
        self._resting[place] = self.machine.read(self._controller, count * size)


def emulated_digest(settings: Settings, elf: Path, core: str, episodes: int) -> int:
    """Return the self-test digest on an emulated core, from a program of `build_guest`."""
    limit_s = TIME_LIMIT_S + _SECONDS_A_WORK * _work(settings) * TICKS
    machine = start(elf, core, limit_s)
    scratch = machine.allocate(machine.call("nmpc_batch_instance_bytes"))
    digest = 0
    for episode in range(episodes):
        digest = machine.call("nmpc_self_test_episode", scratch, episode, Long(digest))
    return digest


def _work(settings: Settings) -> int:
    return settings.horizon.prediction * settings.horizon.control * settings.optimizer.iterations
