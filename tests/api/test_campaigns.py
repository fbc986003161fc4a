"""Campaigns from Python: the flights of the command, laws beside controllers, and a table of them."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_codegen.errors import InvalidSettingsError
from mambo_nmpc import (
    ArgumentError,
    CampaignFlights,
    Controller,
    DroneState,
    TargetState,
    Vehicle,
    campaign,
    draw_vehicles,
    fly,
)
from mambo_nmpc.curves import Circle
from mambo_sil.experiment.campaign.campaign_file import CampaignFile, completed, distributions, scenario
from mambo_sil.experiment.campaign.campaign_flights import fly_scenarios
from mambo_sil.experiment.campaign.parameters import draw
from mambo_sil.experiment.inputs import load_entrant
from tests.support.scenarios import CRAZYFLIE as DRONE

CRAZYFLIE = Vehicle.from_preset("crazyflie")
STRAIGHT = {"yaw_rad": 0.0}


class Pd:
    """Errors of position and velocity, and the target's acceleration, at heading 0."""

    def step(self, state: DroneState, target: TargetState) -> Any:
        """Return roll and pitch."""
        assert target.acceleration_m_s2 is not None
        error_m, error_m_s = target.position_m - state.position_m, target.velocity_m_s - state.velocity_m_s
        wanted = target.acceleration_m_s2 + 6.0 * error_m + 4.0 * error_m_s
        return [wanted[1] / 9.81, -wanted[0] / 9.81]


class Ending(Pd):
    """The same, which raises where x is less than -1 m."""

    def step(self, state: DroneState, target: TargetState) -> Any:
        """Return roll and pitch."""
        if state.position_m[0] < -1.0:
            raise RuntimeError("far, and left")
        return super().step(state, target)


class Broken(Pd):
    """Never returns a command."""

    def step(self, state: DroneState, target: TargetState) -> Any:
        """Raise."""
        raise KeyError(f"x of {state} and {target}")


def flown(**laws: Any) -> CampaignFlights:
    """Fly 21 flights of 8 s: more than are flown together."""
    return campaign(laws, CRAZYFLIE, flights=21, seed=3, duration_s=8.0, draws=STRAIGHT)


@pytest.fixture(scope="module")
def both() -> CampaignFlights:
    """Fly a law and a controller."""
    return flown(pd=Pd(), mpc=Controller.from_preset("crazyflie"))


def test_the_flights_are_those_of_the_command(both: CampaignFlights) -> None:
    """Draws and traces, bit for bit."""
    file = CampaignFile.model_validate({"flight": {"duration_s": 8.0}, "draws": STRAIGHT})
    file = completed(file, DRONE, "test", replaced=False)
    drawn = [draw(3, number, distributions(file.flight, file.draws)) for number in (0, 20)]
    flight = file.flight.model_dump() | {"vehicle": DRONE.model_dump()}
    entrants = [load_entrant("crazyflie", Path(), "test")]
    rows = fly_scenarios(entrants, [scenario(flight, one) for one in drawn], lambda _: None)
    assert [both.table["mass_kg"][k] for k in (0, 20)] == [one["mass_kg"] for one in drawn]
    digests = [row["crazyflie_trace_sha256"] for row in rows]
    assert [both.table["mpc_trace_sha256"][k] for k in (0, 20)] == digests


def test_the_table_has_a_value_for_each_flight(both: CampaignFlights) -> None:
    """Of each column; errors are those over the time of a flight."""
    assert {len(column) for column in both.table.values()} == {21}
    assert not [name for name in both.table if name.endswith(("_saturated_share", "_failure"))]
    assert both.failures == {}
    assert both.mean_error_m("pd")[5] == both.table["pd_iae_m_s"][5] / 8.0
    heads, *rows = repr(both).splitlines()
    assert heads.split() == ["mean", "distance", "median", "95", "%", "worst", "crashed"]
    assert [row.split()[0] for row in rows] == ["pd", "mpc"]
    assert rows[0].endswith("0 of 21")
    assert both._repr_markdown_().count("\n") == 3


def test_a_law_that_fails_loses_its_own_flights(both: CampaignFlights) -> None:
    """It is told which, when and why; the others fly as without it."""
    found = flown(ending=Ending(), pd=Pd())
    lost = [k for k, crashed in enumerate(found.table["ending_crashed"]) if crashed]
    assert lost == sorted(found.failures["ending"])
    assert 0 < len(lost) <= 21
    assert found.failures["ending"][lost[0]].endswith(" s: law.step: RuntimeError: far, and left")
    assert list(found.failures) == ["ending"]
    assert f"ending failed in {len(lost)} of 21, as in flight {lost[0]}, " in repr(found)
    assert "ending failed" in found._repr_markdown_()
    assert np.isinf(np.array(found.mean_error_m("ending"))[lost]).all()
    assert found.table["pd_trace_sha256"] == both.table["pd_trace_sha256"]


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"laws": {}}, ArgumentError, "laws = {} must have a controller or a law"),
        ({"laws": {"a": Pd(), "A_seen": Pd()}}, InvalidSettingsError, "would have the same names"),
        ({"draws": [1]}, ArgumentError, r"draws = \[1\] must be a mapping"),
        ({"laws": {"a": Broken()}}, ArgumentError, "a: law.step: KeyError"),
        ({"laws": {"a b": Pd()}}, ArgumentError, 'laws = "a b" must have names of at most 40 letters'),
        ({"laws": {"a": 3}}, ArgumentError, r"laws\['a'\] = 3 must be a Controller or an object with"),
        ({"laws": [Pd()]}, ArgumentError, "laws = .* must be a mapping of names"),
        ({"vehicle": "crazyflie"}, ArgumentError, 'vehicle = "crazyflie" must be a Vehicle'),
        ({"flights": 0}, ArgumentError, r"flights = 0 must be a whole number in 1\.\."),
        ({"seed": -1}, ArgumentError, "seed = -1 must be a whole number"),
        ({"sensors": "flow"}, InvalidSettingsError, 'flight.sensors = "flow" must be'),
        ({"trajectory": "cirle"}, InvalidSettingsError, 'flight.trajectory = "cirle" must be one of'),
        ({"draws": {"mas_kg": 1.0}}, InvalidSettingsError, "did you mean mass_kg"),
    ],
)
def test_a_wrong_argument_is_named(arguments: dict[str, Any], error: type[Exception], words: str) -> None:
    """Before anything flies."""
    given: dict[str, Any] = {"laws": {"pd": Pd()}, "vehicle": CRAZYFLIE} | arguments
    with pytest.raises(error, match=words):
        campaign(**given)


def test_drawn_vehicles_are_those_of_a_campaign(both: CampaignFlights) -> None:
    """Of the same seed; they fly, each in a flight of its own."""
    drones = draw_vehicles(CRAZYFLIE, 3, seed=3)
    assert np.asarray(drones.airframe.mass_kg).tolist() == both.table["mass_kg"][:3]
    found = fly(Controller.from_preset("crazyflie"), drones, "circle", duration_s=4.0, seeds=range(3))
    assert len(set(found.metrics.rms_error_m.tolist())) == 3
    assert repr(found).startswith("FlightResult(3 flights: rms error ")
    assert re.fullmatch(r"Vehicle\(crazyflie: 0\.03\d* to 0\.03\d* kg, attitude cascade, .*\)", repr(drones))
    assert repr(CRAZYFLIE) == "Vehicle(crazyflie: 0.03 kg, attitude cascade, sensors mocap)"
    controller = Controller.from_vehicle("crazyflie", n=2)
    settings = controller.settings.short_digest
    words = "quadratic cost: roll, pitch and thrust of 2 drones every 0.01 s"
    assert repr(controller) == f"Controller(settings {settings}, {words})"
    with pytest.raises(ArgumentError, match=r"has shape \(3,\); it must be \(1,\)"):
        fly(Controller.from_preset("crazyflie"), drones, "circle", duration_s=4.0)


def test_wind_blows_where_it_is_told() -> None:
    """A drone that learns nothing is pushed the way the air goes; the gusts differ from seed to seed."""
    west_rad = -0.5 * np.pi
    found = fly(Pd(), CRAZYFLIE, "hover", duration_s=6.0, wind_speed_m_s=4.0, wind_direction_rad=west_rad)
    off_m = found.trace.position_m[300:, 0, :2].mean(axis=0)
    assert off_m[1] < -0.01
    assert abs(off_m[0]) < 0.3 * abs(off_m[1])
    many = fly(Pd(), CRAZYFLIE, "hover", duration_s=6.0, wind_speed_m_s=4.0, seeds=(1, 2))
    assert many.metrics.rms_error_m[0] != many.metrics.rms_error_m[1]
    calm = fly(Pd(), CRAZYFLIE, "hover", duration_s=6.0)
    assert np.abs(calm.trace.position_m[300:, 0, :2]).max() < 1e-6
    with pytest.raises(ArgumentError, match=r"wind_speed_m_s = -1\.0 must"):
        fly(Pd(), CRAZYFLIE, "hover", wind_speed_m_s=-1.0)


class Backwards(Circle):
    """A circle whose velocity has the wrong sign."""

    def target(self, time_s: Any) -> Any:
        """Return [x, y, vx, vy]."""
        return super().target(time_s) * np.array([1.0, 1.0, -1.0, -1.0])


def test_a_curve_of_one_s_own_is_flown_by_all() -> None:
    """As the same curve by its name, bit for bit; one whose velocity is wrong is refused."""
    laws: dict[str, Any] = {"mpc": Controller.from_preset("crazyflie"), "pd": Pd()}
    settings: dict[str, Any] = {"flights": 2, "duration_s": 4.0, "draws": STRAIGHT}
    own = campaign(laws, CRAZYFLIE, trajectory=Circle(1.0, 0.7), **settings)
    named = campaign(laws, CRAZYFLIE, trajectory="circle", size_m=1.0, rate_rad_s=0.7, **settings)
    for name in laws:
        assert own.table[f"{name}_trace_sha256"] == named.table[f"{name}_trace_sha256"]
    assert own.table["trajectory"] == ["Circle", "Circle"]
    assert not {"size_m", "rate_rad_s"} & own.table.keys()
    for call in (campaign, fly):
        law: Any = laws if call is campaign else laws["mpc"]
        with pytest.raises(ArgumentError, match=r"trajectory: at .* its velocity along [xy] is"):
            call(law, CRAZYFLIE, trajectory=Backwards(1.0, 0.7))
