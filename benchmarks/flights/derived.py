"""What settings by `design` fly beside presets and laws without a model, on six vehicles and their sensors.

python -m benchmarks.flights.derived FOLDER     writes figures.json into the folder; takes five minutes
"""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.flights.limits import settling_s
from mambo_codegen.settings.controller_toml import parse
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.presets import preset
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.campaign import campaign_file
from mambo_sil.experiment.campaign.campaign_file import scenario
from mambo_sil.experiment.campaign.campaign_flights import fly_scenarios
from mambo_sil.experiment.inputs import Entrant
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.names import DEFAULT_SENSORS
from mambo_sil.flight.scenario import Scenario
from mambo_sil.flight.trajectories import PositionStep
from mambo_sil.model.derive.derived_flight import chosen_text
from mambo_sil.results.folders import finite

LAWS: Final = ("pd", "pd-feedforward", "pid-feedforward")
IN_CAMPAIGNS: Final = ("mambo", "crazyflie", "crazyflie-flown", "generic")
VEHICLES: Final = (*IN_CAMPAIGNS[:3], "crazyflie-l250", "crazyflie-brushless", "generic")
PRESETS: Final = ("mambo", "crazyflie")
FLIGHTS, HEADINGS = 100, 8
CURVES: Final[dict[str, dict[str, Any]]] = {
    "eight": {"trajectory": "bernoulli", "size_m": 2.0, "rate_rad_s": 0.5},
    "circle": {"trajectory": "circle", "size_m": 1.0, "rate_rad_s": 1.5},
}


def settings_for(drone: VehicleFile, name: str) -> dict[str, Settings]:
    """Return the settings that fly a drone: by `design`, and the presets."""
    return {"derived": parse(chosen_text(drone, name), name)} | {one: preset(one) for one in PRESETS}


def in_campaign(name: str, settings: Mapping[str, Settings]) -> dict[str, Any]:
    """Fly the default campaign with every controller; return crashes, median true IAE, median variation."""
    campaign = campaign_file.default(name)
    scenarios = [scenario(campaign.flight, campaign.draw(number)) for number in range(FLIGHTS)]
    entrants = [
        *(Entrant(law, law, preset("mambo")) for law in LAWS),
        *(Entrant(one, "nmpc", own) for one, own in settings.items()),
    ]
    rows = fly_scenarios(entrants, scenarios)

    def median(entrant: str, index: str) -> float:
        values = [float(row[f"{entrant}_{index}"]) for row in rows if not float(row[f"{entrant}_crashed"])]
        return float(np.median(values)) if values else np.nan

    return {
        one.name: {
            "crashed": int(sum(float(row[f"{one.name}_crashed"]) > 0 for row in rows)),
            "iae_m_s": median(one.name, "iae_m_s"),
            "variation_rad": median(one.name, "command_variation_rad"),
        }
        for one in entrants
    }


def on_curves(drone: VehicleFile, settings: Settings, *, seen: bool) -> dict[str, float]:
    """Return IAE by curve, estimated with the Mambo's sensors, and the variation on the eight."""
    sensors = DEFAULT_SENSORS[drone.sensors.kind] if seen else "true"
    index = "seen_iae_m_s" if sensors == "mambo-derotated" else "iae_m_s"
    found = {}
    for curve, values in CURVES.items():
        scenarios = [
            Scenario(vehicle=drone, duration_s=60.0, yaw_rad=yaw, seed=seed, sensors=sensors, **values)
            for seed, yaw in enumerate(np.linspace(0, 2 * np.pi, HEADINGS, endpoint=False).tolist())
        ]
        rows = fly_scenarios([Entrant("c", "nmpc", settings)], scenarios)
        found[curve] = float(np.median([float(row[f"c_{index}"]) for row in rows]))
        if curve == "eight":
            found["variation_rad"] = float(np.median([float(row["c_command_variation_rad"]) for row in rows]))
    return found


def step_s(drone: VehicleFile, settings: Settings) -> float:
    """Return the median time until a drone is within 5 cm of a target that has moved by a metre."""
    flight = Flight(
        PositionStep(1.0, 0.0),
        duration_s=20.0,
        flights=HEADINGS,
        yaw_rad=np.linspace(0, 2 * np.pi, HEADINGS, endpoint=False),
        vehicle=Vehicle.of(drone),
        update_period_s=settings.horizon.update_period_s,
    )
    return float(np.median(settling_s(fly(flight, CompiledController(settings, HEADINGS)))))


def main(arguments: list[str]) -> None:
    """Measure everything."""
    folder = Path(arguments[0])
    folder.mkdir(parents=True, exist_ok=True)
    figures: dict[str, Any] = {"campaigns": {}, "vehicles": {}}
    for name in VEHICLES:
        drone = vehicle_toml.preset(name)
        settings = settings_for(drone, name)
        if name in IN_CAMPAIGNS:
            figures["campaigns"][name] = in_campaign(name, settings)
        flown = settings if name in IN_CAMPAIGNS else {"derived": settings["derived"]}
        figures["vehicles"][name] = {
            title: {
                "known": on_curves(drone, own, seen=False),
                "step_s": step_s(drone, own),
                "seen": on_curves(drone, own, seen=True),
            }
            for title, own in flown.items()
        }
    (folder / "figures.json").write_text(json.dumps(finite(figures), indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
