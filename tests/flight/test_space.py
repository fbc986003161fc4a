"""Curves in space: the altitude loop follows heights, the ground carries, level flights stay as they were."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.flight import columns
from mambo_sil.flight.columns import LEVEL, TARGET
from mambo_sil.flight.controllers.pd import PdController, pd_controller
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.flight_plots import draw_flight, flight_columns
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import CURVES, Circle, Hover, Trajectories, vertical_of
from tests.support.scenarios import FLOWN_IN_SPACE, SPACE

CRAZYFLIE = Vehicle.from_preset("crazyflie")


def flown(curve: str, size_m: float, duration_s: float, vehicle: Vehicle = CRAZYFLIE) -> Trace:
    """Fly one curve with the PD with feed-forward and the true state."""
    flight = Flight(
        next(make for name, make in CURVES.items() if name == curve)(size_m, 1.5),
        duration_s=duration_s,
        vehicle=vehicle,
    )
    return fly(flight, pd_controller("pd-feedforward", flight))


@pytest.mark.parametrize("batch", [SPACE, FLOWN_IN_SPACE], ids=["cascade", "first order"])
def test_flights_that_meet_the_ground_end_on_it(batch: tuple[Scenario, ...]) -> None:
    """Of level courses, swings, a climb and jumps those that land, or want a height below the ground."""
    flight = flight_of(batch, 0.01)
    touching = [one.trajectory == "take-off-and-landing" or one.size_m == -2.0 for one in batch]
    assert flight.landing.tolist() == touching
    assert any(touching)
    assert (fly(flight, PdController()).position_m[..., 2].max(axis=0)[flight.landing] == 0.0).all()


def test_a_flight_among_many_in_space_is_the_flight_alone() -> None:
    """Level flights beside others that have heights, too."""
    together = fly(flight_of(SPACE, 0.01), PdController())
    for number, scenario in enumerate(SPACE):
        alone = fly(flight_of([scenario], 0.01), PdController())
        assert alone.digest() == together.digest(number), number
        assert alone.spatial == (number >= 2)


def test_a_level_course_that_says_so_is_the_level_course() -> None:
    """A step of no height: the same motion and commands, bit for bit."""
    level = fly(Flight(Hover(), duration_s=2.0, start="take-off"), PdController())
    said = fly(Flight(CURVES["height-step"](0.0, 0.0), duration_s=2.0, start="take-off"), PdController())
    assert said.spatial
    assert replace(said, target=said.target[..., :4]).same_bits(level)
    assert said.digest() == level.digest()


def test_the_altitude_loop_lags_behind_a_swing() -> None:
    """It knows the height, but neither its climb nor its acceleration: 0.13 m rms on 0.3 m at 1.5 rad/s."""
    metrics = measure(flown("tilted-circle", 1.0, 15.0), 5.0)
    assert metrics.rms_height_error_m[0] == pytest.approx(0.134, abs=0.005)
    assert metrics.rms_error_m[0] < 0.05
    whole = np.hypot(metrics.rms_error_m, metrics.rms_height_error_m)
    np.testing.assert_allclose(metrics.rms_error_3d_m, whole, rtol=1e-9)


def test_a_step_up_and_down_arrives() -> None:
    """At both heights, within 1 cm after 4 s; a course that starts in the air starts at hover height."""
    trace = flown("height-step", 1.0, 11.0)
    heights_m = -trace.position_m[:, 0, 2]
    assert heights_m[0] == HOVER_HEIGHT_M
    np.testing.assert_allclose(heights_m[[500, 1000]], [HOVER_HEIGHT_M + 1.0, HOVER_HEIGHT_M], atol=0.01)


@pytest.mark.parametrize("vehicle", ["crazyflie", "mambo", "generic"])
def test_take_off_and_landing_begin_and_end_on_the_ground(vehicle: str) -> None:
    """The drone stands with idle motors, lifts off late, never sinks into the ground; that is no crash."""
    trace = flown("take-off-and-landing", 1.0, 11.0, Vehicle.from_preset(vehicle))
    heights_m = -trace.position_m[:, 0, 2]
    assert not detect_crashes(trace, Vehicle.from_preset(vehicle).drone).any()
    assert (heights_m.min(), heights_m[0], heights_m[100]) == (0.0, 0.0, 0.0)
    assert heights_m[550] == pytest.approx(1.0, abs=0.02)
    assert heights_m[-1] < 0.02
    late_m = measure(trace).max_height_error_m[0]
    assert 0.2 < late_m < 0.5


def test_a_drone_that_cannot_carry_its_weight_crashes_on_the_ground() -> None:
    """It stays there while its target rises."""
    drone = CRAZYFLIE.drone
    heavy = Vehicle(
        replace(CRAZYFLIE.airframe, mass_kg=2.0 * drone.body.mass_kg), CRAZYFLIE.motor_lag_s, drone=drone
    )
    trace = flown("take-off-and-landing", 1.0, 5.0, heavy)
    assert (trace.position_m[..., 2] == 0.0).all()
    assert detect_crashes(trace, drone).all()


def test_targets_have_the_columns_of_their_courses() -> None:
    """Those of the level axes, and those of the height where any has one; of a trace four and six."""
    level, space = Circle(1.0, 1.0), CURVES["helix"](1.0, 1.0)
    for curve, given, traced in ((level, LEVEL.target, 4), (space, columns.SPACE.target, 6)):
        flight = Flight(curve, duration_s=0.1)
        assert flight.given_targets.shape[2] == given
        assert flight.traced_targets.shape == (11, 1, traced)
    both = Flight(Trajectories((level, space)), duration_s=0.1, flights=2)
    hover, climbing = both.given_targets[:, :, LEVEL.target :].swapaxes(0, 1)
    np.testing.assert_array_equal(hover, np.tile([HOVER_HEIGHT_M, 0.0, 0.0, 0.0], (11, 1)))
    np.testing.assert_array_equal(climbing[:, :3], vertical_of(space, both.times_s()))
    np.testing.assert_array_equal(climbing[:, 3], vertical_of(space, both.times_s() + 0.05)[:, 2])


def test_a_target_knows_its_acceleration_and_the_one_ahead() -> None:
    """At each update, of the curve at that time and 0.05 s later."""
    flight, curve = Flight(Circle(1.0, 2.0), duration_s=1.0), Circle(1.0, 2.0)
    given = flight.given_targets[:, 0]
    assert (given[:, TARGET["known"]] == 2).all()
    for name, later_s in (("acceleration_m_s2", 0.0), ("ahead_m_s2", 0.05)):
        np.testing.assert_array_equal(given[:, TARGET[name]], curve.acceleration(flight.times_s() + later_s))


@pytest.mark.long
def test_pictures_of_a_course_with_a_height_show_it(tmp_path: Path) -> None:
    """Two panels more than on a level course: from the side, and over time."""
    trace = flown("helix", 0.5, 1.0)
    level = fly(Flight(Circle(1.0, 1.0), duration_s=1.0), PdController())
    for name, one, panels in (("space", trace, 6), ("level", level, 4)):
        draw_flight(one, "", "", tmp_path / name)
        picture = (tmp_path / f"{name}.svg").read_text("utf-8")
        assert picture.count('<g id="axes_') == panels
        assert ("path seen from above, height, distance" in flight_columns({name: one})[0]) == (panels == 6)
