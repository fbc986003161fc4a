"""The closed loop: starts, controller interface, trace, lost flights and flights in a batch."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.sensors.instruments import Sensors
from mambo_sil.errors import FlightError
from mambo_sil.experiment.table2.table2 import CASES, PRINTED_PD
from mambo_sil.flight.columns import LEVEL, TARGET
from mambo_sil.flight.controllers.pd import PdController, PdOutcome
from mambo_sil.flight.engine import simulate
from mambo_sil.flight.height_profiles import Swing
from mambo_sil.flight.loop import Flight, Offset, fly
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.traces import SensedTrace
from mambo_sil.flight.trajectories import (
    Bernoulli,
    Circle,
    Hover,
    InSpace,
    PositionStep,
    Trajectories,
    Waypoints,
)

FloatArray = NDArray[np.float64]

FIGURE_OF_EIGHT = Bernoulli(half_width_m=2.0, angular_rate_rad_s=0.5)
"""The Table II case."""
TOO_FAST = Offset(velocity_m_s=(1e308, 0.0, 0.0))


@dataclass(frozen=True)
class Lean:
    """A position controller that always commands the same angles and returns status 3."""

    roll_rad: float
    pitch_rad: float

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> PdOutcome:
        """Return the same command for every flight."""
        assert (state.shape[1], target.shape[1]) == (LEVEL.state, LEVEL.target)
        assert len(state) == len(target) == len(thrust_acceleration_m_s2)
        command_rad = np.tile([self.roll_rad, self.pitch_rad], (len(state), 1))
        return PdOutcome(command_rad, np.full(len(state), 3, dtype=np.int64))


def test_pd_reproduces_its_row_of_table_2_at_half_a_radian_per_second() -> None:
    """The four indices are within 2 % of the printed ones; the printed rate gives less than half the IAE."""
    flight = Flight(Trajectories(tuple(CASES.values())), flights=len(CASES))
    measured = measure(simulate.fly(flight, PdController()))
    np.testing.assert_allclose(measured.table2[:, 0], PRINTED_PD, rtol=0.02)
    np.testing.assert_allclose(measured.iae_m_s[1:], [21.7, 24.1], rtol=0.01)
    assert (measured.iae_m_s[1:] < PRINTED_PD[0] / 2.0).all()


def test_trace_covers_the_flight_at_the_controller_rate() -> None:
    """A flight of one second at 100 Hz has 101 samples, both ends included, in arrays (k, n, ...)."""
    trace = fly(Flight(FIGURE_OF_EIGHT, duration_s=1.0, flights=3), PdController())
    np.testing.assert_allclose(trace.time_s, np.linspace(0.0, 1.0, 101), atol=1e-12)
    for name, columns in (("position_m", 3), ("velocity_m_s", 3), ("euler_rad", 3), ("target", 4)):
        assert getattr(trace, name).shape == (101, 3, columns)
    assert trace.command_rad.shape == (101, 3, 2)
    assert trace.status.shape == trace.thrust_acceleration_m_s2.shape == (101, 3)
    assert trace.flights == 3
    np.testing.assert_array_equal(trace.target[:, 2], FIGURE_OF_EIGHT.target(trace.time_s))


def test_by_default_a_flight_is_that_of_table_2() -> None:
    """One nominal drone for 100 s at 100 Hz, above the first point at heading 0, undisturbed, true state."""
    flight = Flight(FIGURE_OF_EIGHT)
    times_s = flight.times_s()
    assert (len(times_s), times_s[0], times_s[-1]) == (10_001, 0.0, 100.0)
    assert (flight.ticks_per_update, flight.flights, flight.sensors) == (2, 1, None)
    brief = replace(flight, duration_s=0.2)
    written = Flight(FIGURE_OF_EIGHT, 0.2, 1, "hover", 0.0, 0.0, seeds=(0,), offset=Offset())
    assert fly(brief, PdController()).same_bits(fly(written, PdController()))


def test_hover_start_is_level_and_at_rest_above_the_first_point() -> None:
    """At t = 0 the drone is at z = -1.1 m above the first target, with thrust equal to its weight."""
    trace = fly(Flight(Circle(1.5, 0.5), duration_s=0.1, yaw_rad=0.8), PdController())
    np.testing.assert_array_equal(trace.position_m[0, 0], [1.5, 0.0, -1.1])
    np.testing.assert_array_equal(trace.velocity_m_s[0, 0], 0.0)
    np.testing.assert_array_equal(trace.euler_rad[0, 0], [0.0, 0.0, 0.8])
    assert trace.thrust_acceleration_m_s2[0, 0] == pytest.approx(9.81, rel=1e-12)


def test_hover_start_has_rotors_at_hover_speed() -> None:
    """Rotors with a lag carry the weight from the first tick."""
    trace = fly(Flight(Hover(), duration_s=1.0, vehicle=Vehicle(motor_lag_s=0.05)), PdController())
    np.testing.assert_allclose(trace.position_m[:, 0, 2], -1.1, atol=1e-9)


def test_take_off_reaches_the_reference_height_before_the_clock_starts() -> None:
    """From the ground at t = -5 s: constant thrust for 1 s, then the altitude loop; the target rests."""
    trace = fly(Flight(FIGURE_OF_EIGHT, duration_s=1.0, start="take-off"), PdController())
    assert trace.time_s[0] == -5.0
    assert trace.time_s[500] == 0.0
    np.testing.assert_array_equal(trace.position_m[0, 0], 0.0)
    lifting = trace.time_s < -4.0
    np.testing.assert_allclose(trace.thrust_acceleration_m_s2[lifting, 0], 1.45 * 9.81, rtol=1e-12)
    assert trace.thrust_acceleration_m_s2[100, 0] == pytest.approx(-1.20204 / 0.063, rel=1e-12)
    # One second at 0.45 g climbs 2.2 m.
    assert trace.position_m[100, 0, 2] == pytest.approx(-0.45 * 9.81 / 2.0, rel=0.01)
    np.testing.assert_allclose(trace.position_m[500, 0], [0.0, 0.0, -1.1], atol=0.01)
    np.testing.assert_array_equal(trace.target[:500, 0], 0.0)


def test_controller_receives_the_recorded_state_and_target() -> None:
    """The controller's input is what the trace records at the same update."""
    given: list[tuple[FloatArray, ...]] = []

    class Recorder(PdController):
        """The PD, which records its inputs."""

        def step(self, *inputs: FloatArray) -> PdOutcome:
            """Record and step."""
            given.append(inputs)
            return super().step(*inputs)

    flight = Flight(FIGURE_OF_EIGHT, 3.0, yaw_rad=0.4, disturbances=Disturbances(push_m_s2=(0.5, 0.3)))
    trace = fly(flight, Recorder())
    state = np.concatenate([trace.position_m[..., :2], trace.velocity_m_s[..., :2], trace.euler_rad], axis=-1)
    now, ahead = (FIGURE_OF_EIGHT.acceleration(trace.time_s + later)[:, None] for later in (0.0, 0.05))
    known = np.full((*trace.target.shape[:2], 1), 2.0)
    target = np.concatenate([trace.target, now, ahead, known], axis=-1)
    expected = (state, target, trace.thrust_acceleration_m_s2)
    for values, recorded in zip(zip(*given, strict=True), expected, strict=True):
        np.testing.assert_array_equal(np.stack(values), recorded)


@pytest.mark.long
def test_recorded_velocity_is_the_rate_of_the_position() -> None:
    """Velocities are in the world frame for any heading and tilt."""
    trace = fly(Flight(FIGURE_OF_EIGHT, duration_s=10.0, yaw_rad=0.8), PdController())
    rates = (trace.position_m[2:] - trace.position_m[:-2]) / 0.02
    np.testing.assert_allclose(trace.velocity_m_s[1:-1], rates, atol=2e-3)
    assert np.abs(trace.velocity_m_s).max() > 0.5


def test_command_is_held_between_updates() -> None:
    """With a constant command the path does not depend on the update period."""
    fast = fly(Flight(Hover(), duration_s=1.0, update_period_s=0.005), Lean(0.05, -0.02))
    slow = fly(Flight(Hover(), duration_s=1.0, update_period_s=0.02), Lean(0.05, -0.02))
    np.testing.assert_array_equal(slow.position_m, fast.position_m[::4])
    np.testing.assert_array_equal(slow.status, 3)


@pytest.mark.parametrize(
    ("roll_rad", "pitch_rad", "yaw_rad", "direction"),
    [
        (0.0, -0.05, 0.0, (1.0, 0.0)),
        (0.05, 0.0, 0.0, (0.0, 1.0)),
        (0.0, -0.05, np.pi / 2, (0.0, 1.0)),
        (0.05, 0.0, np.pi / 2, (-1.0, 0.0)),
    ],
)
def test_command_accelerates_along_the_heading(
    roll_rad: float, pitch_rad: float, yaw_rad: float, direction: tuple[float, float]
) -> None:
    """Pitching down accelerates forward, rolling right to the right, for any heading; the heading stays."""
    trace = fly(Flight(Hover(), duration_s=2.0, yaw_rad=yaw_rad), Lean(roll_rad, pitch_rad))
    travelled = trace.position_m[-1, 0, :2]
    np.testing.assert_allclose(travelled / np.hypot(*travelled), direction, atol=0.01)
    assert trace.euler_rad[-1, 0, 2] == pytest.approx(yaw_rad, abs=1e-3)


def test_the_heading_turns_from_the_start_of_the_clock() -> None:
    """It rests during take-off, and then follows a reference that turns at the given rate."""
    flight = Flight(Hover(), 3.0, start="take-off", yaw_rad=0.3, yaw_rate_rad_s=0.5)
    yaw_rad = fly(flight, PdController()).euler_rad[:, 0, 2]
    np.testing.assert_array_equal(yaw_rad[:501], 0.3)
    assert yaw_rad[-1] - yaw_rad[-101] == pytest.approx(0.5, abs=1e-4)
    assert 0.3 + 0.5 * 2.0 < yaw_rad[-1] < 0.3 + 0.5 * 3.0


def test_an_event_between_updates_happens_at_its_own_tick() -> None:
    """A push at 0.5 s moves the drone 10 ms until the update at 0.51 s, one at 0.505 s half as long; once."""
    push = Disturbances(impulse_n_s=(0.0063, 0.0, 0.0), impulse_time_s=np.array([0.5, 0.505]))
    trace = fly(Flight(Hover(), 0.6, 2, disturbances=push), PdController())
    np.testing.assert_allclose(trace.velocity_m_s[50, :, 0], [0.1, 0.0], atol=1e-12)
    np.testing.assert_allclose(trace.velocity_m_s[51, :, 0], 0.1, atol=2e-4)
    np.testing.assert_allclose(trace.position_m[51, :, 0], [1e-3, 0.5e-3], atol=1e-6)


def test_without_seeds_every_flight_has_seed_0() -> None:
    """In gusts the flights are alike, and another seed's is not."""
    flight = Flight(Hover(), 0.2, 2, disturbances=Disturbances(wind_speed_m_s=5.0))
    plain, seeded = (fly(replace(flight, seeds=seeds), PdController()) for seeds in (None, (0, 1)))
    assert plain.digest(0) == plain.digest(1) == seeded.digest(0) != seeded.digest(1)


def test_pd_reaches_a_step_and_is_off_target_under_a_push() -> None:
    """It settles at a point 1.4 m away, and under a push where Kp times the error balances it."""
    push = Disturbances(push_m_s2=(0.0, np.array([0.0, 0.5])))
    flight = Flight(Trajectories((PositionStep(1.0, -1.0), Hover())), 30.0, 2, disturbances=push)
    last = simulate.fly(flight, PdController()).position_m[-1]
    np.testing.assert_allclose(last[0], [1.0, -1.0, -1.1], atol=0.02)
    np.testing.assert_allclose(last[1, 1], 0.5 / 9.81 / 0.24, rtol=0.05)
    assert abs(last[1, 0]) < 1e-6


def test_lost_flight_is_nan_and_does_not_affect_the_others() -> None:
    """A flight that leaves the bounds is NaN from then on and `diverged`; the flight beside it continues."""
    fast = Offset(velocity_m_s=(np.array([0.0, 5020.0]), 0.0, 0.0))
    trace = fly(Flight(Hover(), 3.0, 2, vehicle=Vehicle(drag_1_s=0.0), offset=fast), Lean(0.0, 0.0))
    assert trace.diverged.tolist() == [False, True]
    # At 5.02 km/s the flight is beyond 10 km after two seconds.
    np.testing.assert_allclose(trace.position_m[199, 1, 0], 5020.0 * 1.99, rtol=1e-9)
    assert np.isnan(trace.position_m[201:, 1]).all()
    assert np.isnan(trace.euler_rad[201:, 1]).all()
    np.testing.assert_allclose(trace.position_m[:, 0], [[0.0, 0.0, -1.1]] * 301, atol=1e-9)


def test_a_lost_flight_has_the_same_nan_everywhere() -> None:
    """NaN of the processor, which may be negative, is in no array: digests would tell processors apart."""
    trace = fly(Flight(Hover(), duration_s=0.1, offset=TOO_FAST, sensors=Sensors()), PdController())
    assert isinstance(trace, SensedTrace)
    for values in (trace.position_m, trace.thrust_acceleration_m_s2, trace.seen_velocity_m_s):
        lost = values[np.isnan(values)]
        assert len(lost) > 0
        assert lost.tobytes() == np.full(len(lost), np.nan).tobytes()


def test_overflowing_flight_is_lost_without_a_warning() -> None:
    """A floating-point overflow loses the flight and raises neither warning nor error."""
    assert fly(Flight(Hover(), duration_s=0.1, offset=TOO_FAST), PdController()).diverged.all()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        *(({"update_period_s": value}, "whole multiple of 0.005") for value in (0.0, 0.007, 0.0125, -0.005)),
        *(({"duration_s": value}, "duration_s = .* finite") for value in (0.0, -1.0, np.inf, np.nan)),
        ({"trajectory": Trajectories((Hover(), Hover())), "flights": 3}, "flights = 3 must be 2"),
        ({"flights": 2, "seeds": (1,)}, "there are 1 for 2 flights"),
    ],
)
def test_a_flight_that_cannot_be_simulated_is_refused(wrong: dict[str, Any], message: str) -> None:
    """Periods are multiples of the tick, durations finite; trajectories and seeds are as many as flights."""
    with pytest.raises(FlightError, match=message):
        fly(Flight(**{"trajectory": Hover(), **wrong}), PdController())


def test_progress_is_called_with_the_share_done() -> None:
    """The shares increase by equal steps and end at 1."""
    shares: list[float] = []
    fly(Flight(Hover(), duration_s=0.5), PdController(), shares.append)
    np.testing.assert_allclose(shares, np.arange(1, 52) / 51.0)


def test_a_flight_says_what_its_trajectory_knows_of_the_acceleration() -> None:
    """All of a curve, nothing between waypoints, whose velocity jumps; for each of several, and in space."""
    kinked, curve = Waypoints(((0.0, 0.0, 0.0), (1.0, 1.0, 0.0))), Circle(1.0, 1.0)
    for trajectory, known in (
        (curve, 2),
        (kinked, 0),
        (InSpace(kinked, Swing(0.1, 1.0)), 0),
        (Trajectories((curve, kinked)), [2, 0]),
    ):
        flight = Flight(trajectory, duration_s=0.1, flights=2)
        assert (flight.given_targets[..., TARGET["known"]] == np.reshape(known, (-1, 1))).all()
