"""Processor time of a simulated flight: the closed loop in C and in NumPy, and RotorPy's vehicle alone.

RotorPy's `Multirotor` takes 10,000 steps of 10 ms at hover speed of its rotors. Ours flies the Table II case
for the same 100 s: compiled C at 100 Hz, stock loops and integrator at 200 Hz, seeing the truth or through
sensors. All run in turns.
"""

import os
import statistics
import time
from collections.abc import Callable
from typing import Final

from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor

from mambo_codegen.settings import presets
from mambo_sil.drone.sensors.instruments import Sensors
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.engine_library import VARIABLE
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.names import EngineName
from mambo_sil.flight.trajectories import Bernoulli

DURATION_S: Final = 100.0
ROUNDS: Final = 5
BATCH: Final = 100


def ours(flights: int, engine: EngineName, *, sensed: bool) -> Callable[[], None]:
    """Return a function that flies `flights` Table II cases at once."""
    settings = presets.load("mambo")
    sensors = Sensors(derotated=True) if sensed else None
    flight = Flight(
        Bernoulli(2.0, 0.5),
        duration_s=DURATION_S,
        flights=flights,
        sensors=sensors,
        seeds=tuple(range(flights)),
    )

    def run() -> None:
        os.environ[VARIABLE] = engine
        fly(flight, CompiledController(settings, flights))

    return run


def rotorpy() -> None:
    """Simulate RotorPy's vehicle at hover for the same time."""
    vehicle = Multirotor(quad_params)
    state = vehicle.initial_state
    control = {"cmd_motor_speeds": state["rotor_speeds"]}
    for _ in range(round(DURATION_S / 0.01)):
        state = vehicle.step(state, control, 0.01)


CASES: Final[dict[str, tuple[int, Callable[[], None]]]] = {
    "C, truth": (1, ours(1, "c", sensed=False)),
    "C, sensors": (1, ours(1, "c", sensed=True)),
    f"C, truth, {BATCH} flights": (BATCH, ours(BATCH, "c", sensed=False)),
    f"C, sensors, {BATCH} flights": (BATCH, ours(BATCH, "c", sensed=True)),
    "NumPy, truth": (1, ours(1, "numpy", sensed=False)),
    "NumPy, sensors": (1, ours(1, "numpy", sensed=True)),
    "RotorPy, vehicle alone": (1, rotorpy),
}
"""Number of flights and the function that flies them, by name."""


def seconds(run: Callable[[], None]) -> float:
    """Return the processor time of one call."""
    start = time.process_time()
    run()
    return time.process_time() - start


def main() -> None:
    """Run all in turns; print the median processor time of a flight, and how many times real time that is."""
    ours(1, "c", sensed=False)()  # builds the C
    rounds = [{name: seconds(run) / n for name, (n, run) in CASES.items()} for _ in range(ROUNDS)]
    print(f"a flight of {DURATION_S:.0f} s, processor time, median of {ROUNDS} rounds in turns")
    for name in CASES:
        median = statistics.median(one[name] for one in rounds)
        ratio = statistics.median(one[name] / one["C, truth"] for one in rounds)
        speed = DURATION_S / median
        print(f"  {name:26} {1e3 * median:9.1f} ms {speed:9.0f} times real time {ratio:7.1f} times C, truth")


if __name__ == "__main__":
    main()
