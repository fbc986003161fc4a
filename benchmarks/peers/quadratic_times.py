"""Time of the exact minimum of the quadratic cost beside solvers of others, on the same problem.

The problem of a control step of preset mambo: two free moves along each of two axes, within the tilt limit.
Both get the same states and compute the gradient from them. One process passes through each set of states
with each contender in turn. Prints a table; docs/evidence/benchmarks.md has it.
"""

import ctypes
import json
import os
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import trim_mean

from benchmarks.markdown import table
from benchmarks.peers.ours import Ours
from benchmarks.peers.programs import NotHereError, Program, run_tool
from benchmarks.peers.setups import CONTROL_STEP
from benchmarks.peers.times_report import FLAGS
from mambo_codegen.methods.quadratic.controller import QuadraticController
from mambo_codegen.methods.quadratic.law import second_derivatives
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.settings import presets
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.flight.loop import Flight, fly
from mambo_sil.flight.trajectories import Bernoulli

Array = NDArray[Any]

SETTINGS: Final = presets.load("mambo")
COUNT: Final = 1000
ROUNDS: Final = 40
_WITHIN: Final = {"W": (0.5, 1.0), "T": (0.05, 0.1), "F": (0.005, 0.01)}
"""Errors of position (m) and velocity (m/s)."""
_TILT_RAD: Final = 0.1
_NOISE: Final = (0.01, 0.05)
_SEED: Final = 1
_G_M_S2: Final = 9.81
OURS: Final = Ours(
    name="ours",
    title="mambo-nmpc, preset mambo",
    cost="quadratic",
    scalar="float32",
    sources=(),
    includes=(".",),
    glue="glue/quadratic_ours.c",
    settings=SETTINGS,
)


def state_sets() -> dict[str, Array]:
    """Return the states (COUNT, 2, 8) of the sets W, T, F and C of docs/evidence/benchmarks.md."""
    random, step_s = np.random.default_rng(_SEED), SETTINGS.horizon.update_period_s
    sets = {}
    for name, (position_m, velocity_m_s) in _WITHIN.items():
        tilt = _TILT_RAD * _G_M_S2 * step_s**2
        scale = [position_m, velocity_m_s * step_s, 0.1 * tilt, 0.0, tilt, 0.1 * tilt, tilt, tilt]
        sets[name] = random.uniform(-1, 1, (COUNT, 2, 8)) * scale
    sets["C"] = _flown(random)
    return {name: np.ascontiguousarray(states, np.float32) for name, states in sets.items()}


class _Recorder:
    """The controller behind measurement noise; keeps the states that its optimizer is given."""

    def __init__(self, random: np.random.Generator) -> None:
        self._controller = QuadraticController(Quadratic(SETTINGS))
        self._random = random
        self.states: list[Array] = []
        optimizer = self._controller.parts.optimizer
        minimize = optimizer.minimize

        def record(state: Array, limit: Array | None = None) -> Array:
            self.states.append(state[0])
            return minimize(state, limit)

        optimizer.minimize = record  # type: ignore[method-assign]

    def step(self, state: Array, target: Array, thrust: Array) -> Any:
        """Step with noise on position and velocity."""
        noise = self._random.standard_normal((len(state), 4)) * np.repeat(_NOISE, 2)
        seen = np.concatenate([state[:, :4] + noise, state[:, 4:]], axis=1)
        return self._controller.step(seen, target, thrust)


def _flown(random: np.random.Generator) -> Array:
    recorder = _Recorder(random)
    fly(Flight(Bernoulli(2.0, 0.5), duration_s=0.01 * COUNT + 1.0), recorder)
    return np.array(recorder.states[-COUNT:])


def write_problem(folder: Path) -> None:
    """Write the problem as tables of C, in moves as shares of the limit: H of both axes, and H (-rows).

    H, which the set-ups of peers read from hessian.json, is divided by its first element, so that absolute
    tolerances suit it.
    """
    method, hessian, gradient = Quadratic(SETTINGS), np.zeros((4, 4)), np.zeros((4, 8))
    limits = method.attitude.command_limit_m_step2
    for axis, curvature in enumerate(second_derivatives(SETTINGS)):
        moves, scaled = slice(2 * axis, 2 * axis + 2), curvature / curvature[0, 0]
        hessian[moves, moves] = scaled
        gradient[moves] = -scaled @ method.law.rows[axis] / limits[axis]
    tables = {
        "hessian[16]": hessian,
        "const from_state[32]": gradient,
        "upper[4]": np.ones(4),
        "lower[4]": -np.ones(4),
        "const limits[2]": limits,
    }
    (folder / "hessian.json").write_text(json.dumps(hessian.tolist()), "utf-8")
    (folder / "problem.h").write_text(
        "".join(
            f"static c_float {name} = {{{', '.join(repr(float(v)) for v in values.ravel())}}};\n"
            for name, values in tables.items()
        )
    )


def contenders(work: Path) -> dict[str, tuple[Program, Path]]:
    """Write the problem into `work`, and the C of ours and of each peer into a folder there.

    Raises NotHereError without the peers.
    """
    write_problem(work)
    found: dict[str, tuple[Program, Path]] = {}
    for program in (OURS, *CONTROL_STEP):
        folder = work / program.name
        folder.mkdir()
        program.write(folder)
        found[program.name] = program, folder
    return found


def build(program: Program, folder: Path, flags: str, library: Path) -> Any:
    """Return the function `time_all` of a contender, built with `flags`."""
    work = library.with_suffix("")
    work.mkdir()
    contract = "off" if isinstance(program, Ours) else "fast"
    line = [*host_toolchain().command, "-w", "-fPIC", "-DTIMED", *flags.split(), f"-ffp-contract={contract}"]
    objects = program.compile(line, folder, work)
    run_tool([*host_toolchain().command, "-shared", "-Wl,-Bsymbolic", *objects, "-lm", "-o", str(library)])
    return ctypes.CDLL(str(library)).time_all


def share_limited(states: Array) -> float:
    """Return the share of states (n, 2, 8) in which a free move along an axis would exceed the limit."""
    method = Quadratic(SETTINGS)
    moves = np.einsum("amk,nak->nam", method.law.rows, states)
    beyond = np.abs(moves) > method.attitude.command_limit_m_step2[:, None]
    return float(np.mean(np.any(beyond, axis=2)))


def one_pass(time_all: Any, states: Array) -> tuple[Array, Array]:
    """Return moves (n, 2) and times (n,) in ns."""
    moves, ns = np.zeros((len(states), 2), np.float32), np.zeros(len(states))
    time_all(_address(states), len(states), _address(moves), _address(ns))
    return moves, ns


def _address(array: Array) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


def main() -> None:
    """Measure, and print the table."""
    sets = state_sets()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    rows = []
    with tempfile.TemporaryDirectory(prefix="mambo-nmpc-") as place:
        try:
            programs = contenders(Path(place))
            nothing = replace(OURS, glue="glue/quadratic_nothing.c", title="clock and call")
            programs = {"nothing": (nothing, programs["ours"][1]), **programs}
        except NotHereError as error:
            sys.exit(str(error))
        for number, flags in enumerate(FLAGS):
            calls = {
                name: build(program, folder, flags, Path(place, f"{name}-{number}.so"))
                for name, (program, folder) in programs.items()
            }
            times: dict[tuple[str, str], list[Array]] = {}
            planned = {}
            for _ in range(ROUNDS):
                for name, states in sets.items():
                    for contender, call in calls.items():
                        one_pass(call, states[:50])
                        planned[contender, name], ns = one_pass(call, states)
                        times.setdefault((contender, name), []).append(ns)
            median = {key: float(np.median(trim_mean(passes, 0.25, axis=0))) for key, passes in times.items()}
            limits = Quadratic(SETTINGS).attitude.command_limit_m_step2
            limited = {name: share_limited(states) for name, states in sets.items()}
            for contender in list(calls)[1:]:
                row = {"contender": programs[contender][0].title, "flags": flags}
                for name in sets:
                    own = f"{median[contender, name] - median['nothing', name]:.0f}"
                    row[f"{name} ({100 * limited[name]:.0f} % limited)"] = own
                    row[f"{name}, over ours"] = "{:.1f}".format(
                        (median[contender, name] - median["nothing", name])
                        / (median["ours", name] - median["nothing", name])
                    )
                apart = [np.abs(planned[contender, n] - planned["ours", n]) / limits for n in sets]
                row["apart from ours, of the limit"] = f"{np.max(apart):.1e}"
                rows.append(row)
    print(table(rows))


if __name__ == "__main__":
    main()
