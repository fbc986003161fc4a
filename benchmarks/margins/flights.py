"""Do margins predict flights? Margins of drawn drones beside what these drones fly.

    python -m benchmarks.margins.flights measure     margins and flights, into build/margins; 40 min on a core
    python -m benchmarks.margins.flights evidence    print tables, draw the picture of the manual

It continues where it was stopped.
"""

import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from benchmarks.margins.report import write
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.presets import preset
from mambo_sil.experiment.campaign import campaign_file
from mambo_sil.experiment.campaign.campaign_file import Campaign, scenario
from mambo_sil.experiment.campaign.campaign_flights import fly_scenarios
from mambo_sil.experiment.inputs import Entrant
from mambo_sil.experiment.margins.axis_margins import Margins, measure_loops
from mambo_sil.experiment.margins.hover_loop import hover_loops
from mambo_sil.flight.scenario import flight_of

FOLDER: Final = Path("build/margins")
SLOW_MOTORS: Final = Path("benchmarks/evidence/opponents-slow-motors.toml")
BATCH: Final = 10
FREQUENCIES: Final = 120
RESULTS: Final = ("crashed", "iae_m_s", "seen_iae_m_s", "seen_rms_error_m", "command_variation_rad")


def settings_of(change: Mapping[str, float | str]) -> Settings:
    """Return preset mambo with some other values."""
    settings = preset("mambo")
    for key, value in change.items():
        settings = with_option(settings, key, value)
    return settings


CONTROLLERS: Final[dict[str, Settings]] = {
    "mambo": preset("mambo"),
    "no-feedback": settings_of({"damping.roll_rate_feedback_s": 0.0}),
    "textbook": settings_of({"cost.velocity_weight_s": 0.4, "damping.roll_rate_feedback_s": 0.03}),
    "crazyflie": preset("crazyflie"),
}
"""`textbook` has the margins at the command that textbooks ask for; `crazyflie` is made for another drone."""
DRONES, MOST_DRONES = 300, 1000
"""Drones of a campaign with a controller; the most are those of the default campaign with `mambo`."""


def campaigns() -> dict[str, Campaign]:
    """Return the default campaign, and that of light drones with slow motors."""
    return {"default": campaign_file.default(), "slow": campaign_file.read(SLOW_MOTORS)}


def size(campaign: str, controller: str) -> int:
    """Return how many drones of a campaign a controller flies."""
    return MOST_DRONES if (campaign, controller) == ("default", "mambo") else DRONES


def measure() -> None:
    """Measure margins of, and fly, all drones that are not in the files yet."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    drawn = campaigns()
    for name, settings in CONTROLLERS.items():
        for campaign in ("slow", "default"):
            path = FOLDER / f"{campaign}-{name}.jsonl"
            done = len(path.read_text("utf-8").splitlines()) if path.exists() else 0
            for first in range(done, size(campaign, name), BATCH):
                with path.open("a", encoding="utf-8") as file:
                    for row in _batch(settings, drawn[campaign], first):
                        file.write(json.dumps(row) + "\n")
                print(f"{campaign} {name}: {first + BATCH}", flush=True)


def _batch(settings: Settings, campaign: Campaign, first: int) -> Iterator[dict[str, Any]]:
    """Yield draws, results and margins of drones from number `first` on."""
    draws = [campaign.draw(number) for number in range(first, first + BATCH)]
    scenarios = [scenario(campaign.flight, one) for one in draws]
    flown = fly_scenarios([Entrant("c", "nmpc", settings)], scenarios)
    flight = flight_of(scenarios, settings.horizon.update_period_s)
    measured: dict[str, list[tuple[Margins, ...]]] = {}
    for seen in ("true", "sensed"):
        one = replace(flight, sensors=None) if seen == "true" else flight
        measured[seen] = [
            measure_loops(loops, one, count=FREQUENCIES) for loops in hover_loops(settings, one)
        ]
    for number, row in enumerate(flown):
        margins = {
            seen: [axis.model_dump(mode="json") for axis in axes[number]] for seen, axes in measured.items()
        }
        results = {key: row[f"c_{key}"] for key in RESULTS}
        yield {"draws": draws[number], "results": results, "margins": margins}


if __name__ == "__main__":
    if sys.argv[1:] == ["measure"]:
        measure()
    elif sys.argv[1:] == ["evidence"]:
        write(FOLDER)
    else:
        raise SystemExit(__doc__)
