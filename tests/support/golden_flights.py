"""Short flights of every kind and the digests of their traces, which must be the same on every processor.

python -m tests.support.golden_flights c             print the digests of flights in the engine as JSON
python -m tests.support.golden_flights numpy         print those of flights in NumPy
python -m tests.support.golden_flights numpy short   print those of the first `SHORT_S` of each flight
python -m tests.support.golden_flights --write       write all of them to the golden file; read the diff
"""

import json
import os
import sys
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from mambo_codegen.settings import presets
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.experiment.campaign.campaign_file import default, scenario
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.engine.engine_library import VARIABLE
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.names import PD_NAMES, PD_TITLES
from mambo_sil.flight.scenario import SHARED_KEYS, Scenario, flight_of

GOLDEN: Final = Path(__file__).with_name("golden_flights.json")
PRESETS: Final = ("mambo", "mambo-1norm")

SCENARIOS: Final = {
    "figure of eight": Scenario(duration_s=10.0),
    "circle, turned, pushed, with motor lag": Scenario(
        trajectory="circle", duration_s=10.0, yaw_rad=0.8, push_m_s2=(0.5, 0.3), motor_lag_s=0.03
    ),
    "Lissajous, turning": Scenario(trajectory="lissajous", duration_s=10.0, yaw_rad=-2.0, yaw_rate_rad_s=1.0),
    "step": Scenario(trajectory="step", duration_s=10.0),
    "sensors, gusts and dropped updates": Scenario(
        duration_s=10.0,
        seed=1,
        sensors="mambo",
        wind_speed_m_s=4.0,
        wind_direction_rad=2.5,
        dropped_share=0.1,
    ),
    "take-off": Scenario(duration_s=5.0, start="take-off"),
    "Crazyflie": Scenario(vehicle=vehicle_toml.load("crazyflie"), duration_s=10.0, yaw_rad=0.8),
    "Crazyflie, motion capture, gusts": Scenario(
        vehicle=vehicle_toml.load("crazyflie"), duration_s=10.0, seed=2, sensors="mocap", wind_speed_m_s=3.0
    ),
    "first order, motion capture, gusts": Scenario(
        vehicle=vehicle_toml.load("crazyflie-flown"),
        duration_s=10.0,
        seed=3,
        sensors="mocap",
        wind_speed_m_s=3.0,
    ),
    "drawn by the default campaign": scenario(default().flight | {"duration_s": 10.0}, default().draw(0)),
}


SHORT_S: Final = 1.0
SHORT: Final = {name: flown.model_copy(update={"duration_s": SHORT_S}) for name, flown in SCENARIOS.items()}
"""The same flights, ended early."""


def digests(scenarios: Mapping[str, Scenario]) -> dict[str, str]:
    """Fly every scenario with each law without a model and each preset; return the digests of the traces."""
    chosen = {name: presets.load(name) for name in PRESETS}
    period_s = chosen[PRESETS[0]].horizon.update_period_s
    batches = defaultdict(list)
    for name, flown in scenarios.items():
        batches[tuple(getattr(flown, key) for key in SHARED_KEYS)].append(name)
    found: dict[str, str] = {}
    for names in batches.values():
        flight = flight_of([scenarios[name] for name in names], period_s)
        traces = {PD_TITLES[pd]: fly(flight, pd_controller(pd, flight)) for pd in PD_NAMES}
        traces |= {
            preset: fly(flight, CompiledController(settings, len(names)))
            for preset, settings in chosen.items()
        }
        for index, name in enumerate(names):
            found |= {f"{name}: {controller}": trace.digest(index) for controller, trace in traces.items()}
    return found


if __name__ == "__main__":
    os.environ[VARIABLE] = "numpy" if sys.argv[1] == "--write" else sys.argv[1]
    if sys.argv[1:] == ["--write"]:
        both = {"whole": digests(SCENARIOS), "short": digests(SHORT)}
        GOLDEN.write_text(json.dumps(both, indent=2) + "\n", "utf-8")
    else:
        print(json.dumps(digests(SHORT if sys.argv[2:] else SCENARIOS), indent=2))
