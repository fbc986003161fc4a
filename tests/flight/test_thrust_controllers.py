"""Controllers of the height in the closed loop: their thrust, the floor, mixers that cap, and the bits."""

import math
from dataclasses import dataclass, fields, replace

import numpy as np
import pytest

from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.flight import loop
from mambo_sil.flight.columns import SPACE, TARGET
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.thrust_controller import ThrustController, ThrustDelivery
from mambo_sil.flight.engine.adjusted import Adjustment
from mambo_sil.flight.engine.engine_library import load
from mambo_sil.flight.engine.simulate import fly, fly_compiled
from mambo_sil.flight.fences import with_limits
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.scenario import Scenario, choose_sensors, flight_of
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import CURVES, Hover
from tests.support.engines import lanes_here
from tests.support.faults import FAULTS, PATIENCE, faulty_controller, faulty_flight
from tests.support.height_settings import height_settings
from tests.support.scenarios import BATCHES, CRAZYFLIE, changed
from tests.support.tools import toolchain

PERIOD_S = 0.01
FLOWN = ("space", "cascade", "lower", "flown in space", "lagging", "take-off", "coupled")
SLOW = [pytest.param(scalar, marks=pytest.mark.long) for scalar in ("float64", "fixed")]


def assert_same(ours: Trace, theirs: Trace) -> None:
    """Compare every array."""
    assert type(ours) is type(theirs)
    for column in fields(theirs):
        assert getattr(ours, column.name).tobytes() == getattr(theirs, column.name).tobytes(), column.name


@pytest.mark.first_is_quick
@pytest.mark.sampled(6)
@pytest.mark.parametrize("scalar", ["float32", *SLOW])
@pytest.mark.parametrize("batch", FLOWN)
def test_engine_and_reference_have_the_bits_of_numpy(batch: str, scalar: str) -> None:
    """On level courses and in space, through sensors, with lost updates and late commands, in all lanes."""
    settings, flight = height_settings(scalar), flight_of(BATCHES[batch], PERIOD_S)
    expected = loop.fly(flight, CompiledController(settings, flight.flights))
    assert_same(loop.fly(flight, method_of(settings).reference_controller(flight.flights)), expected)
    for lanes in lanes_here():
        engine = load(toolchain("gcc"), lanes)
        assert_same(fly_compiled(engine, flight, CompiledController(settings, flight.flights)), expected)


def test_a_command_is_the_thrust_over_the_gain() -> None:
    """With a gain of 1/2 commands are twice as large, bit by bit, and so is the reported thrust."""
    rng, reported = np.random.default_rng(7), np.full(5, np.nan)
    plain, halved = (
        ThrustController(CompiledController(height_settings("float64", thrust_gain=gain), 5))
        for gain in (1.0, 0.5)
    )
    for step in range(60):
        state, target = rng.normal(0.0, 0.3, (5, SPACE.state)), rng.normal(0.0, 0.3, (5, SPACE.target))
        state[:, 9] = step % 4 == 0
        one, other = plain.step(state, target, reported), halved.step(state, target, 2.0 * reported)
        assert (2.0 * one.thrust_m_s2).tobytes() == other.thrust_m_s2.tobytes()
        assert one.command_rad.tobytes() == other.command_rad.tobytes()
        reported = np.where(rng.random(5) < 0.5, rng.uniform(5.0, 15.0, 5), np.nan)


def test_faults_have_the_bits_of_numpy() -> None:
    """Every effect of a fault, limits that change in flight, and callers that level out to hover."""
    settings = height_settings()
    limits = with_limits(settings, speed_m_s=0.5, climb_m_s=0.5)
    changes = (
        Adjustment(1, 10, "set_limits", (math.nan,) * len(limits)),
        Adjustment(4, 30, "set_limits", limits),
    )
    flight = faulty_flight(FAULTS)
    (ours, answered), (theirs, answers) = (
        faulty_controller(settings, FAULTS, changes, PATIENCE) for _ in range(2)
    )
    assert_same(fly_compiled(load(toolchain("gcc")), flight, ours), loop.fly(flight, theirs))
    assert [status for _, status in answered.answers] == [status for _, status in answers.answers]
    assert len(answers.answers) == len(changes)


@dataclass
class Recorder:
    """Controllers of the height behind a record of their inputs."""

    controller: PositionController
    states: list[FloatArray]
    targets: list[FloatArray]
    reported: list[FloatArray]

    @classmethod
    def around(cls, settings: Settings, n: int = 1) -> "Recorder":
        """Return new ones."""
        return cls(ThrustController(CompiledController(settings, n)), [], [], [])

    def step(self, state: FloatArray, target: FloatArray, thrust: FloatArray) -> loop.Outcome:
        """Record and step."""
        self.states.append(state.copy())
        self.targets.append(target.copy())
        self.reported.append(thrust.copy())
        return self.controller.step(state, target, thrust)


@pytest.mark.long
def test_the_thrust_of_the_trace_is_the_commanded_one_and_reaches_the_rotors() -> None:
    """A level course is one at the hover height; at rest the thrust is g, with a fifth more mass 1.2 g."""
    vehicle = Vehicle.of(CRAZYFLIE)
    heavy = replace(vehicle, airframe=replace(vehicle.airframe, mass_kg=1.2 * CRAZYFLIE.body.mass_kg))
    for drone, thrust_g, low_m in ((vehicle, 1.0, 0.001), (heavy, 1.2, 0.07)):
        flight = Flight(Hover(), 8.0, vehicle=drone)
        trace = fly(flight, CompiledController(height_settings()))
        assert trace.thrust_acceleration_m_s2[-1, 0] == pytest.approx(9.81 * thrust_g, rel=1e-3)
        assert float(measure(trace).max_height_error_m[0]) < low_m
        assert -trace.position_m[-1, 0, 2] == pytest.approx(1.1, abs=2e-3)
        recorder = Recorder.around(height_settings())
        assert_same(loop.fly(flight, recorder), trace)
        assert recorder.targets[-1][0, TARGET["height_m"].start :].tolist() == [1.1, 0.0, 0.0, 0.0]
        assert np.isnan(recorder.reported).all()


@pytest.mark.long
def test_the_floor_is_reported_while_it_carries_the_drone() -> None:
    """Before take-off and after landing; in between not."""
    scenario = Scenario(
        vehicle=CRAZYFLIE, trajectory="take-off-and-landing", size_m=0.6, duration_s=9.0, start="hover"
    )
    flight, recorder = flight_of([scenario], PERIOD_S), Recorder.around(height_settings())
    trace = loop.fly(flight, recorder)
    on_ground = np.array(recorder.states)[:, 0, 9]
    np.testing.assert_array_equal(on_ground, trace.position_m[:, 0, 2] >= 0.0)
    assert on_ground[0] == on_ground[-1] == 1.0
    assert not on_ground[(trace.time_s > 2.0) & (trace.time_s < 7.0)].any()
    assert trace.thrust_acceleration_m_s2[0, 0] == pytest.approx(2.9)


def test_a_thrust_that_the_mixer_caps_is_reported() -> None:
    """While a drone that starts tilted turns upright; then only, and less than was commanded."""
    drone = changed(CRAZYFLIE, rotors={"mixer": "lower"})
    scenario = Scenario(vehicle=drone, duration_s=1.0, start_tilt_rad=(0.8, 0.0))
    flight, recorder = flight_of([scenario], PERIOD_S), Recorder.around(height_settings())
    trace = loop.fly(flight, recorder)
    reported = np.array(recorder.reported)[:, 0]
    lowered = np.flatnonzero(np.isfinite(reported))
    assert 3 < len(lowered) < 20
    assert (reported[lowered] < trace.thrust_acceleration_m_s2[lowered - 1, 0]).all()
    still = Recorder.around(height_settings())
    loop.fly(flight_of([scenario.model_copy(update={"start_tilt_rad": (0.0, 0.0)})], PERIOD_S), still)
    assert np.isnan(still.reported).all()


def test_the_mean_of_a_capped_period_is_reported_once() -> None:
    """Of two drones one is capped in one of two ticks."""
    delivery, mass_kg = ThrustDelivery(CRAZYFLIE, 2), CRAZYFLIE.body.mass_kg
    assert np.isnan(delivery.report()).all()
    delivery.note(np.array([0.3, 0.3]), np.array([0.3, 0.2]))
    delivery.note(np.array([0.3, 0.3]), np.array([0.3, 0.3 + 1e-16]))
    np.testing.assert_allclose(delivery.report(), [np.nan, 0.25 / mass_kg], rtol=1e-12)
    delivery.note(np.array([0.3, 0.3]), np.array([0.3, 0.3]))
    assert np.isnan(delivery.report()).all()


def test_a_curve_in_space_is_followed_closer_than_by_any_altitude_loop() -> None:
    """A swing of 0.3 m at 1.5 rad/s through motion capture: within 2 mm (rms)."""
    sensors = choose_sensors("mocap", CRAZYFLIE)
    curve = CURVES["tilted-circle"](1.0, 1.5)
    flight = Flight(curve, 10.0, vehicle=Vehicle.of(CRAZYFLIE), sensors=sensors)
    trace = fly(flight, CompiledController(height_settings()))
    assert float(measure(trace, 2.0).rms_height_error_m[0]) < 0.002
