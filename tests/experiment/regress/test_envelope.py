"""Shipped suites: which flights they have, and what presets and derived settings are known to fail."""

from pathlib import Path
from typing import Final

import pytest

from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.settings import presets
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.experiment.campaign.campaign_flights import fly_scenarios
from mambo_sil.experiment.campaign.executors import processes
from mambo_sil.experiment.inputs import Entrant, load_entrant
from mambo_sil.experiment.regress.regress_report import RegressSummary, judge
from mambo_sil.experiment.regress.suite_file import FlightSuite, load_suite
from mambo_sil.experiment.regress.suite_flights import demand_flyable, fly_suite
from mambo_sil.flight.names import IN_SPACE
from mambo_sil.model.derive.derived_settings import controller_text

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


def flown(suite: FlightSuite, entrant: Entrant) -> RegressSummary:
    """Fly a suite on two processes, and judge it by its bounds."""
    with processes(2) as pool:
        rows = fly_suite(suite, entrant, pool, lambda _: None)
    return judge(suite, entrant, rows, None, Path())


def test_the_envelope_of_every_preset_is_known() -> None:
    """A new preset is added above."""
    assert set(KNOWN) == {*presets.names(), PD_FEEDFORWARD}


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("controller", KNOWN)
def test_a_controller_fails_where_it_is_known_to(controller: str) -> None:
    """No flight more and none less; a preset with the name of a vehicle flies that."""
    vehicle = controller if controller in vehicle_toml.names() else None
    suite, entrant = load_suite("envelope", vehicle), load_entrant(controller, Path(), "test")
    summary = flown(suite, entrant)
    found: dict[str, list[int]] = {}
    for flight, result in zip(suite.flights, summary.flights, strict=True):
        if result.failures:
            found.setdefault(flight.group, []).append(round(flight.scenario.yaw_rad / 3.14159 * 16))
    assert found == KNOWN[controller]


def test_the_envelope_has_33_headings_over_the_full_turn() -> None:
    """Ten groups: five courses with the true state and through sensors, each with a bound on the IAE."""
    found = load_suite("envelope")
    groups = {flight.group for flight in found.flights}
    assert len(groups) == 10
    for group in groups:
        flights = [flight for flight in found.flights if flight.group == group]
        yaws_rad = [flight.scenario.yaw_rad for flight in flights]
        assert len(set(yaws_rad)) == 33
        assert max(yaws_rad) - min(yaws_rad) == pytest.approx(6.28318)
        assert all("iae_m_s" in flight.bounds for flight in flights)
        sensors = {flight.scenario.sensors for flight in flights}
        assert sensors == {"mambo-derotated" if group.endswith("-sensors") else "true"}


def test_the_suite_in_space_flies_every_course_and_condition() -> None:
    """All curves with a height; heavy, sagging, unloaded, in gusts and close to the ground."""
    flights = [flight.scenario for flight in load_suite("space").flights]
    assert set(IN_SPACE) <= {one.trajectory for one in flights}
    for key in ("battery_sag_1_s", "payload_kg", "vertical_gust_m_s2", "ground_effect_radius_m"):
        assert any(getattr(one, key) for one in flights), key
    assert any(one.mass_kg == pytest.approx(1.3 * one.vehicle.body.mass_kg) for one in flights)


@pytest.mark.long
@pytest.mark.parametrize("name", ["space", "height"])
def test_no_bound_of_a_suite_in_space_is_exceeded_or_twice_what_is_flown(name: str, tmp_path: Path) -> None:
    """Suite `space` by preset crazyflie with the stock altitude loop, `height` by what design derives."""
    suite, source = load_suite(name), "crazyflie"
    if name == "height":
        derived = tmp_path / "controller.toml"
        derived.write_text(controller_text(vehicle_toml.load("crazyflie"), "crazyflie"), "utf-8")
        source = str(derived)
    entrant = load_entrant(source, tmp_path, "test")
    for group in dict.fromkeys((one.group, one.scenario.duration_s) for one in suite.flights):
        flights = [one for one in suite.flights if (one.group, one.scenario.duration_s) == group]
        rows = fly_scenarios([entrant], [one.scenario for one in flights], lambda _: None)
        for metric, bound in flights[0].bounds.items():
            worst = max(float(row[f"{entrant.name}_{metric}"]) for row in rows)
            assert 0.5 * bound <= worst <= bound, (group, metric, worst)


@pytest.mark.parametrize("controller", ["table1", "pd-feedforward"])
def test_a_controller_without_limits_is_refused(controller: str) -> None:
    """With the group and the key that want limits."""
    entrant = load_entrant(controller, Path(), "test")
    with pytest.raises(InvalidSettingsError, match=r"flights\.step\.speed_excess: wants .* with limits"):
        demand_flyable(load_suite("limits"), entrant, "test")


def test_every_group_of_limits_is_judged_at_eight_headings() -> None:
    """Each flight has a bound on how it keeps within limits."""
    flights = load_suite("limits").flights
    for group in {flight.group for flight in flights}:
        chosen = [flight for flight in flights if flight.group == group]
        assert len({flight.scenario.yaw_rad for flight in chosen}) == 8
        assert all(flight.bounds for flight in chosen)


@pytest.mark.long
@pytest.mark.parametrize(("preset", "vehicle"), [("mambo", None), ("crazyflie", "crazyflie")])
def test_a_preset_with_limits_passes_the_suite_of_limits(preset: str, vehicle: str | None) -> None:
    """Every flight, each preset on its drone."""
    suite, entrant = load_suite("limits", vehicle), load_entrant(preset, Path(), "test")
    summary = flown(suite, entrant)
    assert {flight.name: flight.failures for flight in summary.failed} == {}
