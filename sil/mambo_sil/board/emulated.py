"""The emulated controller: the C built for a board, run on an emulated core, with the same interface."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.bundle.digest import TICKS
from mambo_codegen.bundle.render import render
from mambo_codegen.methods import method_of
from mambo_codegen.numbers.representation import THRUST
from mambo_codegen.settings.model import Settings
from mambo_sil.board.emulation.avr_machine import Long
from mambo_sil.board.emulation.machine import TIME_LIMIT_S, start
from mambo_sil.board.firmware.firmware_build import Builder
from mambo_sil.errors import EmulatorError
from mambo_sil.flight.controllers.compiled import DIRT, as_array, as_arrays, empty_outcome
from mambo_sil.flight.controllers.controller_library import batch_source, with_default_prefix

GUEST: Final = ("nmpc_batch_step", "nmpc_batch_init", "nmpc_batch_instance_bytes", "nmpc_self_test_episode")
"""Functions of the emulated program that Python calls; with a height nmpc_batch_report_thrust, too."""

_MAX_WORK: Final = 2_000
"""Most prediction steps x moves x iterations in one call, so that it ends within its time limit."""

_SECONDS_PER_WORK: Final = 2e-4
"""Time limit for each of these, ten times what the slowest core takes on a slow machine."""

_MAX_PADDING: Final = 16
"""Upper bound of the bytes that alignment adds to an array."""


def build_guest(settings: Settings, builder: Builder, folder: Path) -> Path:
    """Build the program for an emulated core: the bundle of `settings` and a loop over n controllers."""
    files = render(with_default_prefix(settings), with_digest=False)
    functions = GUEST if settings.height is None else (*GUEST, "nmpc_batch_report_thrust")
    return builder.guest(files, batch_source(), functions, folder)


class EmulatedController:
    """n controllers on one emulated core that runs a program of `build_guest`.

    The instances are stored in this process and copied to the core in batches that fit its memory.

    counting: instructions are counted. Whether a command lies at the tilt limit is then not asked for, since
              the answer calls functions of the step, whose instructions would count.
    """

    def __init__(
        self, settings: Settings, elf: Path, core: str, n: int = 1, *, counting: bool = False
    ) -> None:
        self.settings = settings
        self._method = method_of(settings)
        self._numbers = self._method.numbers
        self.scalar = self._numbers.scalar
        self._n = n
        work = math.prod(method_of(settings).work)
        limit_s = TIME_LIMIT_S + _SECONDS_PER_WORK * max(work, _MAX_WORK)
        self.machine = start(elf, core, limit_s, counting=counting)
        one = self._empty_outcome(1)
        self._instance_bytes = self.machine.call("nmpc_batch_instance_bytes")
        sizes = [
            self._instance_bytes,
            *(
                width * np.dtype(self.scalar).itemsize
                for width in (len(self._method.state), len(self._method.target), 1)
            ),
        ]
        sizes += [values.nbytes for values in one.values()]
        overhead = len(sizes) * (self.machine.word_bytes + _MAX_PADDING) + _MAX_PADDING  # pointers, alignment
        room = (self.machine.arena.free_bytes - overhead) // sum(sizes)
        self._batch_size = min(n, max(1, _MAX_WORK // work), room)
        if self._batch_size < 1:
            raise EmulatorError(
                f"a controller with its inputs and outputs takes {sum(sizes)} B, "
                f"but the emulated core has only {self.machine.arena.free_bytes} B free"
            )
        addresses = [self.machine.arena.allocate(self._batch_size * size) for size in sizes]
        self._controller, self._inputs, outputs = addresses[0], addresses[1:4], addresses[4:]
        self._outputs = dict(zip(one, outputs, strict=True))
        self._outcome = self.machine.arena.allocate(len(outputs) * self.machine.word_bytes)
        asked = [
            0 if counting and name == "saturated" else address for name, address in self._outputs.items()
        ]
        self.machine.write(self._outcome, np.array(asked, f"<u{self.machine.word_bytes}").tobytes())
        self._instances = bytearray(DIRT * (n * self._instance_bytes))
        for batch in self._batches():
            self._run_batch(batch, "nmpc_batch_init")

    def step(
        self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike | None = None
    ) -> Any:
        """Compute the next commands; the inputs are as of `CompiledController.step`.

        Returns the `step_type` of the method.
        """
        inputs = as_arrays(self._method, self._n, state, target, thrust_acceleration_m_s2)
        outcome = self._empty_outcome(self._n)
        for batch in self._batches():
            for address, values in zip(self._inputs, inputs, strict=False):  # with a height without thrust
                self.machine.write(address, values[batch].tobytes())
            self._run_batch(batch, "nmpc_batch_step", *self._inputs, self._outcome)
            for name, values in outcome.items():
                content = self.machine.read(self._outputs[name], values[batch].nbytes)
                values[batch] = np.frombuffer(content, values.dtype).reshape(values[batch].shape)
        return self._method.make_step(outcome)

    def report_thrust(self, thrust_m_s2: ArrayLike) -> None:
        """Tell that the drones got thrusts over mass (n,), with a height; one that is NaN changes nothing."""
        numbers = as_array(self._numbers, np.asarray(thrust_m_s2)[:, np.newaxis], THRUST, (self._n, 1))
        for batch in self._batches():
            self.machine.write(self._inputs[2], numbers[batch].tobytes())
            self._run_batch(batch, "nmpc_batch_report_thrust", self._inputs[2])

    def save(self) -> bytes:
        """Return the instances as they are now."""
        return bytes(self._instances)

    def restore(self, instances: bytes) -> None:
        """Set the instances to what `save` returned."""
        self._instances[:] = instances

    def _empty_outcome(self, n: int) -> dict[str, NDArray[Any]]:
        return empty_outcome(self._method, n, f"<i{self.machine.word_bytes}")

    def _batches(self) -> Iterator[slice]:
        """Yield the indices of the controllers of each batch."""
        for first in range(0, self._n, self._batch_size):
            yield slice(first, min(first + self._batch_size, self._n))

    def _run_batch(self, batch: slice, function: str, *arguments: int) -> None:
        """Copy a batch of instances to the core, call `function` on them, and copy them back."""
        size, count = self._instance_bytes, batch.stop - batch.start
        place = slice(batch.start * size, batch.stop * size)
        self.machine.write(self._controller, bytes(self._instances[place]))
        self.machine.call(function, self._controller, count, *arguments)
        self._instances[place] = self.machine.read(self._controller, count * size)


def digest_emulated(settings: Settings, elf: Path, core: str, episodes: int) -> int:
    """Return the self-test digest, computed by a program of `build_guest` on an emulated core."""
    limit_s = TIME_LIMIT_S + _SECONDS_PER_WORK * math.prod(method_of(settings).work) * TICKS
    machine = start(elf, core, limit_s)
    scratch = machine.arena.allocate(machine.call("nmpc_batch_instance_bytes"))
    digest = 0
    for episode in range(episodes):
        digest = machine.call("nmpc_self_test_episode", scratch, episode, Long(digest))
    return digest
