"""What surrounds the app on the desk: its estimator, set-points, loops, mixer and supervisor."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from mambo_extensions.crazyflie.desk.desk_events import fly_events, measure
from mambo_extensions.crazyflie.desk.desk_flight import Desk, DeskConditions, DeskSensors
from mambo_extensions.crazyflie.desk.events_file import EventsFile
from mambo_sil.errors import FlightError

RECORD = Path(__file__).parents[4] / "docs" / "evidence" / "records" / "firmware.json"
"""Flights of apps in the Crazyflie's real firmware."""
CURVES = {
    "eight": {"trajectory": "bernoulli", "size_m": 2.0, "rate_rad_s": 0.5},
    "circle": {"trajectory": "circle", "size_m": 1.0, "rate_rad_s": 1.5},
}
UP = np.array([[0.0, 0.0, 1.0], [0.0] * 3, [0.0] * 3])


def hovering(app: Path, conditions: DeskConditions | None = None) -> Desk:
    """Return a drone that hovers at 1 m by a plan."""
    desk = Desk(app, conditions or DeskConditions(camera_offset_ms=3))
    desk.run(1000)
    desk.take_off(1.0, 2.0)
    desk.run(6000)
    return desk


@pytest.mark.parametrize("title", CURVES)
@pytest.mark.parametrize("name", ["design", "crazyflie"])
def test_curves_are_flown_as_in_the_firmware(name: str, title: str, app: Path, preset_app: Path) -> None:
    """The IAE of 60 s differs by at most 15 % from that in the real firmware."""
    flown = json.loads(RECORD.read_text("utf-8"))["figures"]["curves"][title][name]["iae_m_s"]
    file = EventsFile.model_validate(CURVES[title] | {"duration_s": 60.0})
    library = app if name == "design" else preset_app
    ours = [
        measure(fly_events(library, file, seed, offset_ms), file)["iae_60_s_m_s"]
        for seed, offset_ms in enumerate((1, 3, 7))
    ]
    assert np.mean(ours) == pytest.approx(np.mean(flown), rel=0.15)


def test_the_estimate_is_as_sure_as_the_firmware_s(app: Path) -> None:
    """A camera of 100 Hz leaves a variance of 7e-6 m^2 along x; the estimate is right to 4 mm."""
    desk = hovering(app)
    errors = []
    for _ in range(200):
        desk.run(10)
        errors.append(desk.log("stateEstimate.x") - desk.state.position_m[0])
    assert desk.log("kalman.varX") == pytest.approx(7.2e-6, rel=0.1)
    assert np.abs(errors).max() < 0.004


def test_a_wrong_heading_is_learnt(app: Path) -> None:
    """From positions, while the drone accelerates: an error of 15 degrees becomes one of less than 8."""
    desk = hovering(app, DeskConditions(camera_offset_ms=3, heading_rad=math.radians(15.0)))
    for k in range(1000):
        x, v, a = math.sin(0.01 * k), math.cos(0.01 * k), -math.sin(0.01 * k)
        desk.full_state(np.array([[x, 0.0, 1.0], [v, 0.0, 0.0], [a, 0.0, 0.0]]))
        desk.run(10)
    assert abs(desk.log("stateEstimate.yaw") - math.degrees(desk.state.angles_rad[2])) < 8.0


def test_a_flow_deck_knows_its_height_and_not_its_place(app: Path) -> None:
    """Its variance of the place stays at the largest; that of the velocity is small."""
    desk = Desk(app, DeskConditions(sensors=DeskSensors.FLOW_DECK, camera_offset_ms=3))
    desk.run(1500)
    desk.take_off(0.5, 2.0)
    desk.run(2500)
    assert desk.log("kalman.varX") > 50.0
    assert desk.log("kalman.varPX") < 0.05
    assert desk.log("stateEstimate.z") == pytest.approx(desk.state.position_m[2], abs=0.03)


def test_the_same_seed_is_the_same_flight_and_two_drones_share_nothing(app: Path) -> None:
    """Another seed is another flight."""
    first, second, other = (
        hovering(app, DeskConditions(seed=seed, camera_offset_ms=3)) for seed in (1, 1, 2)
    )
    first.set("nmpc.mass", 30.0)
    assert np.array_equal(first.state.position_m, second.state.position_m)
    assert not np.array_equal(first.state.position_m, other.state.position_m)
    first.run(100)
    second.run(100)
    assert (first.log("nmpc.badLimits"), second.log("nmpc.badLimits")) == (32768.0, 0.0)


def test_a_plan_ends_at_rest_where_it_shall(app: Path) -> None:
    """A plan within a plan goes on from where it is."""
    desk = hovering(app)
    desk.go_to((1.0, 0.5, 1.2), 2.0)
    desk.run(1000)
    halfway = desk.log("ctrltarget.x")
    desk.go_to((0.0, 0.0, 1.0), 2.0)
    desk.run(10)
    assert desk.log("ctrltarget.x") == pytest.approx(halfway + 0.01 * 2.1875 / 2.0, abs=0.002)
    desk.run(6000)
    assert desk.log("ctrltarget.x") == pytest.approx(0.0, abs=1e-6)
    assert np.hypot(*desk.state.position_m[:2]) < 0.01


def test_the_supervisor_levels_out_and_stops_the_motors(app: Path) -> None:
    """0.5 s and 2 s after the last set-point; then no set-point starts them again."""
    desk = hovering(app)
    desk.full_state(UP)
    desk.run(1900)
    assert desk.state.motors.max() > 0.2
    desk.run(200)
    assert desk.state.motors.max() == 0.0
    desk.full_state(UP)
    desk.run(100)
    assert desk.state.motors.max() == 0.0


def test_attitude_goes_before_thrust(app: Path) -> None:
    """A kick that asks for all motors leaves the drone upright, and costs height."""
    desk = hovering(app)
    desk.kick((3.0, 0.0, 0.0))
    lowest, most = 1.0, 0.0
    for _ in range(150):
        desk.run(10)
        lowest = min(lowest, float(desk.state.position_m[2]))
        most = max(most, float(desk.state.motors.max()))
    assert most <= 1.0
    assert lowest > 0.5
    desk.run(4000)
    assert np.abs(desk.state.angles_rad[:2]).max() < 0.1


def test_a_parameter_that_the_app_lacks_is_named(app: Path, preset_app: Path) -> None:
    """As a log variable it is not a number."""
    assert math.isnan(Desk(app, DeskConditions()).log("nmpc.nothing"))
    with pytest.raises(FlightError, match=r"^nmpc\.mass is not a parameter of this app$"):
        Desk(preset_app, DeskConditions()).set("nmpc.mass", 0.03)
