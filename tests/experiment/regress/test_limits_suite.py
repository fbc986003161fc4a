"""The suite of limits: presets with limits pass it, others are refused."""

from pathlib import Path

import pytest

from mambo_codegen.errors import InvalidSettingsError
from mambo_sil.experiment.campaign.executors import processes
from mambo_sil.experiment.inputs import load_entrant
from mambo_sil.experiment.regress.regress_report import judge
from mambo_sil.experiment.regress.suite_file import load_suite
from mambo_sil.experiment.regress.suite_flights import demand_flyable, fly_suite


@pytest.mark.parametrize("controller", ["table1", "pd-feedforward"])
def test_a_controller_without_limits_is_refused(controller: str) -> None:
    """With the group and the key that want limits."""
    entrant = load_entrant(controller, Path(), "test")
    with pytest.raises(InvalidSettingsError, match=r"flights\.step\.speed_excess: wants .* with limits"):
        demand_flyable(load_suite("limits"), entrant, "test")


def test_every_group_is_judged_at_eight_headings() -> None:
    """Each flight has a bound on how it keeps within limits."""
    flights = load_suite("limits").flights
    for group in {flight.group for flight in flights}:
        chosen = [flight for flight in flights if flight.group == group]
        assert len({flight.scenario.yaw_rad for flight in chosen}) == 8
        assert all(flight.bounds for flight in chosen)


@pytest.mark.long
@pytest.mark.parametrize(("preset", "vehicle"), [("mambo", None), ("crazyflie", "crazyflie")])
def test_a_preset_with_limits_passes(preset: str, vehicle: str | None) -> None:
    """Every flight, each preset on its drone."""
    suite, entrant = load_suite("limits", vehicle), load_entrant(preset, Path(), "test")
    with processes(2) as pool:
        rows = fly_suite(suite, entrant, pool, lambda _: None)
    summary = judge(suite, entrant, rows, None, Path())
    assert {flight.name: flight.failures for flight in summary.failed} == {}
