"""Search the gains of the altitude loop `pid` on random flights of a drone through its sensors.

python -m benchmarks.gains.altitude [VEHICLE]   takes some minutes

Three curves in space with 60 flights of 15 s each, under the PID with feed-forward for roll and pitch. Sizes
and rates, headings, drones, wind, sensors and links differ from flight to flight, as in a campaign: so weight
and thrust are wrong by up to a fifth. The error of a candidate is the geometric mean over the curves of the
median rms error of the height; that of a crashed flight is infinite. A candidate that crashes more often than
the vehicle's own loop is out. Search and choice are those of `feedforward.py`, with the variation of the
thrust in place of that of the command.
"""

import sys
from collections.abc import Sequence
from dataclasses import asdict, astuple, replace
from typing import Any, Final

import numpy as np

from benchmarks.gains.feedforward import Judged, choose, drawn_flights, row, search
from benchmarks.markdown import table
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.altitude_loops import AltitudeLaw, HeightGains, pid_altitude_gains
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import measure

CURVES: Final[dict[str, dict[str, Any]]] = {
    "tilted-circle": {"size_m": {"uniform": [0.5, 1.0]}, "rate_rad_s": {"uniform": [0.5, 1.5]}},
    "height-step": {"size_m": {"uniform": [-0.6, 1.0]}},
    "take-off-and-landing": {"size_m": {"uniform": [0.5, 1.5]}},
}
DURATION_S: Final = 15.0
FIRST: Final = HeightGains(25.0, 9.0, 12.0)
"""Where the search begins: two thirds more than the Crazyflie's own loop has, and an integral."""


def judge(flights: Sequence[Flight], law: AltitudeLaw) -> Judged:
    """Fly all flights with an altitude loop."""
    errors_m, variations, crashes = [], [], 0
    for flight in flights:
        trace = fly(replace(flight, altitude=law), pd_controller("pid-feedforward", flight))
        crashed = detect_crashes(trace, flight.vehicle.drone)
        crashes += int(crashed.sum())
        changes = np.abs(np.diff(trace.thrust_acceleration_m_s2, axis=0)).mean(axis=0)
        errors_m.append(float(np.median(np.where(crashed, np.inf, measure(trace).rms_height_error_m))))
        variations.append(float(np.median(np.where(crashed, np.inf, changes))))
    return Judged(tuple(errors_m), tuple(variations), crashes)


def main() -> None:
    """Print the vehicle's own loop, that with feed-forward, the least error and the chosen gains."""
    vehicle = (sys.argv[1:] or [vehicle_toml.DEFAULT])[0]
    flights = drawn_flights(CURVES, DURATION_S, vehicle=vehicle)
    stock, feedforward = (judge(flights, AltitudeLaw(name)) for name in ("stock", "feedforward"))
    found: dict[HeightGains, Judged] = {}
    for gains, judged in search(
        FIRST, lambda gains: judge(flights, AltitudeLaw("pid", gains)), stock.crashes
    ):
        found[gains] = judged
        print(f"{astuple(gains)}: {judged}", flush=True)
    chosen, closest = choose(found), min(found, key=lambda gains: found[gains].error)
    rows = [
        row("the vehicle's loop", None, stock, CURVES),
        row("with feed-forward", None, feedforward, CURVES),
    ]
    rows += [
        row(name, gains, found[gains], CURVES)
        for name, gains in (("least error", closest), ("chosen", chosen))
    ]
    print(f"\nmedian rms error of the height, m (variation of the thrust, m/s^2); {len(found)} candidates\n")
    print(table(rows))
    print("".join(f"\n{key} = {gain:g}" for key, gain in asdict(chosen).items()))
    shipped = pid_altitude_gains().get(vehicle)
    print(f"\nshipped are {'the chosen gains' if chosen == shipped else f'other gains: {shipped}'}")


if __name__ == "__main__":
    main()
