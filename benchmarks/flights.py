"""Time of a simulated flight: our closed loop against RotorPy's vehicle model without a controller.

RotorPy's `Multirotor` takes 10,000 steps of 10 ms at hover speed of its rotors. Ours flies the Table II case
for the same 100 s: compiled C at 100 Hz, stock loops and integrator at 200 Hz. Both run alternately.
"""

import statistics
import timeit
from functools import partial

from rotorpy.vehicles.crazyflie_params import quad_params
from rotorpy.vehicles.multirotor import Multirotor

from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.engine.simulate import fly
from mambo_nmpc.sil.flight.loop import Flight
from mambo_nmpc.sil.flight.trajectories import Bernoulli

DURATION_S = 100.0
ROUNDS = 5
BATCH = 500


def fly_ours(flights: int) -> None:
    """Fly `flights` Table II cases at once."""
    flight = Flight(Bernoulli(2.0, 0.5), duration_s=DURATION_S, flights=flights)
    fly(flight, CompiledController(presets.load("mambo"), flights))


def fly_rotorpy() -> None:
    """Simulate RotorPy's vehicle at hover for the same time."""
    vehicle = Multirotor(quad_params)
    state = vehicle.initial_state
    control = {"cmd_motor_speeds": state["rotor_speeds"]}
    for _ in range(round(DURATION_S / 0.01)):
        state = vehicle.step(state, control, 0.01)


def main() -> None:
    """Run both alternately; print the median times and their ratio."""
    fly_ours(1)  # builds the C
    seconds = partial(timeit.timeit, number=1)
    rounds = [(seconds(lambda: fly_ours(1)), seconds(fly_rotorpy)) for _ in range(ROUNDS)]
    ours, theirs = (statistics.median(column) for column in zip(*rounds, strict=True))
    ratio = statistics.median(b / a for a, b in rounds)
    batch = seconds(lambda: fly_ours(BATCH))
    print(f"one flight of {DURATION_S:.0f} s, median of {ROUNDS} rounds in turns")
    print(f"  mambo-nmpc, closed loop with compiled C   {ours:7.2f} s")
    print(f"  RotorPy, vehicle alone                    {theirs:7.2f} s   {ratio:.2f} times ours")
    print(f"{BATCH} flights at once                         {batch:7.2f} s")
    print(
        f"  {BATCH / batch:.1f} flights a second, {BATCH * DURATION_S / batch:.0f} times real time in total"
    )


if __name__ == "__main__":
    main()
