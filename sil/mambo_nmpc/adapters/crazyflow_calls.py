"""Commands of crazyflow's drones inside a program of JAX: XLA calls crazyflow.c on the CPU.

One program simulates many commands, without Python between them.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.numbers.representation import YAW_LIMIT_RAD
from mambo_codegen.toolchain import host_toolchain
from mambo_nmpc.adapters import CLIMB_M_S, HEIGHT_M, load
from mambo_sil.api.api_controller import Controller
from mambo_sil.api.handles import ControllerHandles, is_native, target_rows
from mambo_sil.arguments import require
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.columns import SPACE, STATE
from mambo_sil.flight.controllers.controller_library import ffi
from mambo_sil.flight.frames import LENGTH_TOLERANCE
from mambo_sil.flight.states import TargetState
from mambo_sil.results.shared_library import LibrarySource, built_library

INSTALL: Final = 'pip install ".[crazyflow]"'
TARGET_ROWS: Final = 100_000
"""Most targets that are sampled at once: 10 MB."""
SAMPLED_AHEAD: Final = 100
"""Commands whose targets are sampled at once where fewer are wanted: one costs NumPy as much as they do."""
_NAME: Final = "mambo_nmpc_crazyflow_command"
_ADDRESSES: Final = ("step", "reset", "slew_heading", "controllers", "controller_bytes", "hover")
_PILOT: Final = np.dtype(
    [
        *((name, np.int64) for name in _ADDRESSES),
        ("most_turn_rad", np.float64),
        *((name, np.int64) for name in ("ticks", "yaw_rad", "wanted_rad", "mass_kg", "targets")),
        *((name, np.int64) for name in ("rows", "curves", "refused")),
    ]
)
"""crazyflow_pilot_t."""
_FLAGS: Final = ("-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off")


def can_call(sim: Any, controller: Controller) -> bool:
    """Return whether XLA can call the C: on one CPU, in float32, without an altitude loop in Python."""
    on_cpu = getattr(getattr(sim, "device", None), "platform", None) == "cpu"
    is_single = on_cpu and getattr(sim, "mesh", None) is None and sim.data.states.pos.dtype == np.float32
    return is_single and is_native(controller)


class CrazyflowCalls:
    """Flies the drones of a simulation with controllers, which keep their memory.

    targets: returns where the drones shall be after steps (commands, worlds or 1).
    ticks:   steps from one command to the next.
    """

    def __init__(
        self, controller: Controller, targets: Callable[[NDArray[Any]], TargetState], ticks: int
    ) -> None:
        self._handles, self._targets, self._ticks = ControllerHandles(controller), targets, ticks
        self._next_ages, self._next_rows = np.empty(0, np.int64), np.empty(0)
        self._fly, self._pilot = _program(), np.zeros((), _PILOT)
        for name, value in {**self._handles.members, "ticks": ticks}.items():
            self._pilot[name] = value
        address = np.array([self._pilot.ctypes.data], np.uint64).view(np.uint32)
        self._address = _jax().device_put(address)

    def advance(
        self, sim: Any, n_steps: int, ages: NDArray[Any], wanted_rad: FloatArray, mass_kg: FloatArray
    ) -> int:
        """Simulate steps that begin with a command, and command when it is due; return how many, at most n.

        ages:                steps since the reset of each world (w,), or of all (1,).
        wanted_rad, mass_kg: headings in NED, and masses (worlds, drones), both contiguous.
        """
        each, most = min(n_steps, self._ticks), max(TARGET_ROWS // (ages.size * sim.n_drones), 1)
        count = min(max(n_steps // self._ticks, 1), most)
        targets = self._rows(ages, count, most)
        numbers = {
            "targets": targets,
            "yaw_rad": self._handles.headings_rad(),
            "wanted_rad": wanted_rad,
            "mass_kg": mass_kg,
        }
        for name, values in numbers.items():
            self._pilot[name] = values.ctypes.data
        self._pilot["refused"] = 0
        self._pilot["rows"], self._pilot["curves"] = targets.shape[1:3]
        sim.data = self._fly(sim.data, self._address, np.int32(count), simulate=sim._step, each=each)
        sim.data.states.pos.block_until_ready()  # until then the C reads and writes the numbers
        require(self._pilot["refused"] == 0, "quaternion", sim.data.states.quat, "have length 1")
        return int(count * each)

    def _rows(self, ages: NDArray[Any], count: int, most: int) -> FloatArray:
        """Return targets (count, worlds or 1, curves, columns), sampled ahead; at most `most` at once."""
        if len(self._next_rows) < count or not np.array_equal(ages, self._next_ages):
            commands = np.arange(min(max(count, SAMPLED_AHEAD), most))[:, np.newaxis]
            self._next_rows = target_rows(self._targets(ages + self._ticks * commands))
        targets, self._next_rows = self._next_rows[:count], self._next_rows[count:]
        self._next_ages = ages + self._ticks * count
        return targets


def _jax() -> Any:
    return load("jax", INSTALL)


@cache
def _program() -> Any:
    """Return the program of JAX that simulates `count` commands, each held for `each` steps."""
    jax, functional = _jax(), load("crazyflow.sim.functional", INSTALL)
    capsule = jax.ffi.pycapsule(_library(jax.ffi.include_dir()).crazyflow_command)
    jax.ffi.register_ffi_target(_NAME, capsule, platform="cpu")

    def fly(data: Any, address: Any, count: Any, *, simulate: Any, each: int) -> Any:
        batch = data.core.n_worlds, data.core.n_drones
        shape = jax.ShapeDtypeStruct((*batch, 4), np.float32)
        # Not said to have an effect, which costs 2 ms per call: each command is used, in its turn.
        command = jax.ffi.ffi_call(_NAME, shape)

        def hold(number: Any, data: Any) -> Any:
            seen = data.states
            given = command(address, number, data.core.steps, seen.pos, seen.quat, seen.vel)
            return simulate(functional.attitude_control(data, given), n_steps=each)

        return jax.lax.fori_loop(0, count, hold, data)

    return jax.jit(fly, static_argnames=("simulate", "each"))


def _library(include: str) -> ctypes.CDLL:
    """Return the library of crazyflow.c, compiled with the headers in a folder."""
    text = resources.files("mambo_nmpc.adapters").joinpath("crazyflow.c").read_text("utf-8")
    files = {"crazyflow.c": text, "columns.h": _columns()}
    header = Path(include, "xla/ffi/api/c_api.h")
    source = LibrarySource(
        "crazyflow",
        (files, header.read_text("utf-8")),
        lambda: files,
        (*_FLAGS, "-isystem", include),
        ffi,
        ("-lm",),
    )
    return ctypes.CDLL(str(built_library(source, host_toolchain())))


def _columns() -> str:
    """Return where the members of a state stand in the closed loop, and limits of numbers."""
    named: dict[str, object] = {name.upper(): place.start for name, place in STATE.items()}
    named |= {
        f"{record}_COLUMNS": getattr(SPACE, record.lower()) for record in ("STATE", "TARGET", "COMMAND")
    }
    named |= {"FLOOR_HEIGHT_M": f"{HEIGHT_M}f", "FLOOR_CLIMB_M_S": f"{CLIMB_M_S}f"}
    named |= {"LENGTH_TOLERANCE": LENGTH_TOLERANCE, "YAW_LIMIT_RAD": YAW_LIMIT_RAD}
    return "".join(f"#define {name} {value}\n" for name, value in named.items())
