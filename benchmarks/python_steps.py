"""Time a step of many drones from Python beside the call of the C in it; takes seconds.

Compared are `Controller.step` with states and targets in NED, the same with an altitude loop, and the C
alone: `nmpc_batch_step` from arrays in its own types. The best of many calls, for others use the machine.
"""

import time
from collections.abc import Callable
from typing import Final

import numpy as np

from benchmarks.markdown import table
from mambo_codegen.methods import method_of
from mambo_sil.api.api_controller import Controller
from mambo_sil.api.states import DroneState, TargetState
from mambo_sil.flight.controllers.compiled import CompiledController, as_arrays, empty_outcome

REPEATS: Final = 1000
DRONES: Final = (1, 10, 100, 1000)


def best_us(call: Callable[[], object]) -> float:
    """Return the shortest of many times of a call, in microseconds."""
    shortest_s = float("inf")
    for _ in range(REPEATS):
        start_s = time.perf_counter()
        call()
        shortest_s = min(shortest_s, time.perf_counter() - start_s)
    return 1e6 * shortest_s


def row(n: int) -> dict[str, str]:
    """Return the times for n drones with preset `crazyflie`."""
    controller = Controller.from_preset("crazyflie", n)
    with_height = Controller.from_preset("crazyflie", n, vehicle="crazyflie", height="pid")
    random = np.random.default_rng(1)
    vectors, angles = random.normal(0.0, 0.5, (4, n, 3)), random.normal(0.0, 0.1, (n, 3))
    state = DroneState(vectors[0], vectors[1], angles)
    target = TargetState(vectors[2], vectors[3], yaw_rad=0.0)
    method, compiled = method_of(controller.settings), CompiledController(controller.settings, n)
    seen = np.concatenate([vectors[0, :, :2], vectors[1, :, :2], angles], axis=1)
    wanted = np.concatenate([vectors[2, :, :2], vectors[3, :, :2]], axis=1)
    inputs = as_arrays(method, n, seen, wanted, np.full(n, 9.81))
    alone_us = best_us(compiled.stepper(inputs, empty_outcome(method, n, np.intc)))
    step_us = best_us(lambda: controller.step(state, target))
    height_us = best_us(lambda: with_height.step(state, target).attitude_thrust("NWU", mass_kg=0.03))
    return {
        "drones": str(n),
        "the C alone, us": f"{alone_us:.1f}",
        "`step`, us": f"{step_us:.1f}",
        "over the C": f"{step_us / alone_us:.2f}",
        '`step` with `height="pid"`, and `attitude_thrust`, us': f"{height_us:.1f}",
    }


if __name__ == "__main__":
    print(table([row(n) for n in DRONES]))
