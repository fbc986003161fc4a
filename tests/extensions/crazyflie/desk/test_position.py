"""The position as the app sees it: its source, whether it is lost, and how a lost drone comes down."""

from pathlib import Path

import numpy as np
import pytest

from mambo_extensions.crazyflie.desk.desk_flight import Desk, DeskConditions, DeskSensors


def started(library: Path, height_m: float, climb_s: float, conditions: DeskConditions) -> Desk:
    """Return a drone that has begun a plan to a height."""
    desk = Desk(library, conditions)
    desk.run(1500)
    desk.take_off(height_m, climb_s)
    return desk


def lost_ms(desk: Desk, milliseconds: int) -> int:
    """Return for how many of the next milliseconds the position is lost."""
    count = 0
    for _ in range(milliseconds):
        desk.run(1)
        count += desk.log("nmpc.lost") > 0.0
    return count


@pytest.mark.parametrize("phase_ms", range(10))
def test_a_flow_deck_is_no_lost_position_whenever_it_measures(phase_ms: int, flow_app: Path) -> None:
    """In any of the ten milliseconds from prediction to prediction; its end is noticed in 0.3 s."""
    flow = DeskConditions(seed=phase_ms, sensors=DeskSensors.FLOW_DECK, camera_offset_ms=phase_ms)
    desk = started(flow_app, 2.5, 2.0, flow)
    assert lost_ms(desk, 5000) == 0
    desk.measure(on=False)
    assert lost_ms(desk, 280) == 0
    assert lost_ms(desk, 30) > 0


@pytest.mark.parametrize("at_ms", [300, 500, 800, 1300, 1600])
@pytest.mark.parametrize(
    "case", [(0.03, 0.0, 1.65), (0.03, -0.05, 1.8), (0.036, 0.0, 1.65)], ids=["right", "biased", "heavy"]
)
def test_a_camera_lost_in_the_climb_brings_the_drone_down(
    case: tuple[float, float, float], at_ms: int, app: Path, preset_app: Path
) -> None:
    """It climbs a tenth higher than the plan at most, a fifth with a bias, and touches at 1.52 m/s."""
    mass_kg, bias_g, most_m = case
    conditions = DeskConditions(
        seed=at_ms, camera_offset_ms=3, mass_kg=mass_kg, accelerometer_bias_g=(0.0, 0.0, bias_g)
    )
    for library in (app, preset_app):
        desk = started(library, 1.5, 1.5, conditions)
        desk.run(at_ms)
        desk.measure(on=False)
        heights_m = []
        for _ in range(400):
            desk.run(25)
            heights_m.append(desk.state.position_m[2])
        assert max(heights_m) < most_m
        assert heights_m[-1] == 0.0
        assert desk.log("nmpc.source") == 1.0
        assert desk.state.touch_m_s < 1.52


@pytest.mark.parametrize("period_ms", [2, 3, 4, 10, 33, 100])
def test_a_measured_place_is_the_source_however_often_it_comes(period_ms: int, app: Path) -> None:
    """Also several times a prediction, as base stations measure, and less often than the filter predicts."""
    desk = started(app, 1.0, 2.0, DeskConditions(seed=period_ms, camera_period_ms=period_ms))
    assert lost_ms(desk, 4000) == 0
    assert (desk.log("nmpc.source"), desk.log("nmpc.badSource")) == (1.0, 0.0)
    assert np.hypot(*desk.state.position_m[:2]) < 0.01


def test_settings_for_another_source_are_named(app: Path, flow_app: Path) -> None:
    """On the floor already, in the log and on the console, once."""
    for library, sensors, found, words in (
        (app, DeskSensors.FLOW_DECK, (2.0, 1.0), "only flow is measured: settings are for a measured place"),
        (flow_app, DeskSensors.MOCAP, (1.0, 1.0), "a place is measured: settings are for a flow deck"),
        (flow_app, DeskSensors.FLOW_DECK, (2.0, 0.0), ""),
        (app, DeskSensors.MOCAP, (1.0, 0.0), ""),
    ):
        desk = Desk(library, DeskConditions(sensors=sensors, camera_offset_ms=3))
        desk.run(2000)
        desk.full_state(np.zeros((3, 3)))
        desk.run(100)
        assert (desk.log("nmpc.source"), desk.log("nmpc.badSource")) == found
        assert desk.console.count("settings are for") == (words != "")
        assert words in desk.console


@pytest.mark.parametrize("sensors", DeskSensors)
def test_nothing_is_said_of_the_position_before_it_is_measured(
    sensors: DeskSensors, app: Path, flow_app: Path
) -> None:
    """A filter that has just started says nothing of its source; then the source is named once, and right."""
    is_flow = sensors is DeskSensors.FLOW_DECK
    for library, for_flow in ((app, False), (flow_app, True)):
        desk = Desk(library, DeskConditions(sensors=sensors, camera_offset_ms=3))
        desk.measure(on=False)
        desk.run(1)
        assert desk.log("kalman.varX") == 100.0, "the start of the filter, 10000, falls"
        desk.run(1500)
        (version,) = desk.console.splitlines()
        assert "settings" in version
        assert (desk.log("nmpc.source"), desk.log("nmpc.badSource"), desk.log("nmpc.lost")) == (0.0, 0.0, 1.0)
        desk.measure(on=True)
        desk.run(400)
        said = desk.console.splitlines()[1:]
        assert "NMPC: position found" in said
        assert len(said) == 1 + (is_flow != for_flow)
        assert desk.log("nmpc.source") == 1.0 + is_flow


def test_a_flight_without_a_position_says_why_no_motor_starts(app: Path) -> None:
    """Once a flight; with a position the next one begins."""
    desk = Desk(app, DeskConditions(camera_offset_ms=3))
    desk.measure(on=False)
    desk.run(1500)
    desk.take_off(1.0, 2.0)
    desk.run(2500)
    assert desk.console.splitlines()[1:] == ["NMPC: no position: the motors stay off"]
    assert desk.state.position_m[2] == 0.0
    desk.measure(on=True)
    desk.run(2000)
    assert desk.state.position_m[2] > 0.5
    assert desk.console.splitlines()[2:] == ["NMPC: position found"]


def test_the_source_changes_in_flight(flow_app: Path) -> None:
    """A flow deck is found within a second, a camera within 20 ms."""
    desk = started(flow_app, 1.0, 2.0, DeskConditions(camera_offset_ms=3))
    desk.run(5000)
    seen = []
    for sensors, after_ms in ((DeskSensors.FLOW_DECK, 1000), (DeskSensors.MOCAP, 20)):
        desk.switch(sensors)
        desk.run(after_ms)
        seen.append(desk.log("nmpc.source"))
    assert seen == [2.0, 1.0]
