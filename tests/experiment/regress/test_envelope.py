"""The flight envelope of each preset and of the PD with feed-forward, with what it is known to fail.

A change in either direction fails.
"""

from pathlib import Path
from typing import Final

import pytest

from mambo_codegen.settings import presets
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.experiment.campaign.executors import processes
from mambo_sil.experiment.inputs import load_entrant
from mambo_sil.experiment.regress.regress_report import judge
from mambo_sil.experiment.regress.suite_file import load_suite
from mambo_sil.experiment.regress.suite_flights import fly_suite

EVERY: Final = list(range(-16, 17))
COURSES: Final = ("eight", "circle", "fast-circle", "step-2m", "step-5m")

PD_FEEDFORWARD: Final = "pd-feedforward"

# Headings by group, as multiples of 11.25 degrees from -16 (south) to 16.
KNOWN: Final[dict[str, dict[str, list[int]]]] = {
    # fails none
    "mambo": {},
    # orbits the fast circle, through sensors only
    "table1": {
        "fast-circle-sensors": [one for one in EVERY if not (-9 <= one <= -5 or 7 <= one <= 11)],
    },
    # likewise, and on fewer headings through sensors
    "mambo-1norm": {
        "fast-circle-sensors": [-16, -15, -14, -13, -12, -11, -4, -2, *range(-1, 6), 12, 14, 15, 16],
    },
    # does not fly
    "table1-printed": {course + view: EVERY for view in ("", "-sensors") for course in COURSES},
    PD_FEEDFORWARD: {},
    # of its own drone
    "crazyflie": {},
}
"""What each controller is known to fail."""


def test_the_envelope_of_every_preset_is_known() -> None:
    """A new preset is added above."""
    assert set(KNOWN) == {*presets.names(), PD_FEEDFORWARD}


@pytest.mark.long
@pytest.mark.parametrize("controller", KNOWN)
def test_a_controller_fails_where_it_is_known_to(controller: str) -> None:
    """No flight more and none less; a preset with the name of a vehicle flies that."""
    vehicle = controller if controller in vehicle_toml.names() else None
    suite, entrant = load_suite("envelope", vehicle), load_entrant(controller, Path(), "test")
    with processes(2) as pool:
        rows = fly_suite(suite, entrant, pool, lambda _: None)
    summary = judge(suite, entrant, rows, None, Path())
    found: dict[str, list[int]] = {}
    for flight, result in zip(suite.flights, summary.flights, strict=True):
        if result.failures:
            found.setdefault(flight.group, []).append(round(flight.scenario.yaw_rad / 3.14159 * 16))
    assert found == KNOWN[controller]
