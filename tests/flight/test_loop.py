"""The closed loop: starts, controller interface, trace, lost flights and flights in a batch."""

from dataclasses import dataclass, fields, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_nmpc.sil.controllers.pd import PdController, PdOutcome
from mambo_nmpc.sil.errors import FlightError
from mambo_nmpc.sil.flight.loop import Flight, fly
from mambo_nmpc.sil.flight.metrics import measure
from mambo_nmpc.sil.flight.traces import Trace
from mambo_nmpc.sil.flight.trajectories import (
    Bernoulli,
    Circle,
    Gerono,
    Hover,
    PositionStep,
    Trajectories,
    Trajectory,
)
from mambo_nmpc.sil.plant.airframe import MAMBO
from mambo_nmpc.sil.plant.vehicle import Vehicle

FloatArray = NDArray[np.float64]

FIGURE_OF_EIGHT = Bernoulli(half_width_m=2.0, angular_rate_rad_s=0.5)
"""The Table II case."""


@dataclass(frozen=True)
class Lean:
    """A position controller that always commands the same angles and returns status 3."""

    roll_rad: float
    pitch_rad: float

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> PdOutcome:
        """Return the same command for every flight."""
        assert (state.shape[1], target.shape[1]) == (7, 4)
        assert len(state) == len(target) == len(thrust_acceleration_m_s2)
        command_rad = np.tile([self.roll_rad, self.pitch_rad], (len(state), 1))
        return PdOutcome(command_rad, np.full(len(state), 3, dtype=np.int64))


@dataclass(frozen=True)
class Echo:
    """A position controller that returns two columns of its input, state and target, as its command."""

    columns: tuple[int, int]

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> PdOutcome:
        """Return the chosen columns as command, and the thrust acceleration as status."""
        given = np.concatenate([state, target], axis=1)
        return PdOutcome(
            0.01 * given[:, self.columns], np.asarray(1e6 * thrust_acceleration_m_s2, dtype=np.int64)
        )


def same(one: Trace, other: Trace) -> bool:
    """Return whether two traces agree bit for bit, NaN included."""
    return all(
        np.array_equal(getattr(one, field.name), getattr(other, field.name), equal_nan=True)
        for field in fields(Trace)
    )


def flight_of(trace: Trace, flight: int) -> Trace:
    """Return a trace of one flight of a trace."""
    picked = {
        field.name: getattr(trace, field.name)[:, flight : flight + 1]
        for field in fields(Trace)
        if field.name != "time_s"
    }
    return Trace(time_s=trace.time_s, **picked)


def test_pd_reproduces_its_row_of_table_2() -> None:
    """IAE, ISE, ITSE and ITAE of the stock PD are within 2 % of the printed 63.02, 47.86, 2460, 3200."""
    metrics = measure(fly(Flight(FIGURE_OF_EIGHT), PdController()))
    measured = [metrics.iae_m_s[0], metrics.ise_m2_s[0], metrics.itse_m2_s2[0], metrics.itae_m_s2[0]]
    np.testing.assert_allclose(measured, [63.02, 47.86, 2460.0, 3200.0], rtol=0.02)


def test_printed_angular_rate_contradicts_table_2() -> None:
    """At 0.25 rad/s the IAE of the PD is less than half of the printed one on either figure of eight."""
    slow = Trajectories((Bernoulli(2.0, 0.25), Gerono(2.0, 0.25)))
    metrics = measure(fly(Flight(slow, flights=2), PdController()))
    np.testing.assert_allclose(metrics.iae_m_s, [21.7, 24.1], rtol=0.01)
    assert (metrics.iae_m_s < 63.02 / 2.0).all()


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


def test_same_flight_gives_the_same_bits() -> None:
    """The simulation is a pure function of flight and controller."""
    flight = Flight(FIGURE_OF_EIGHT, duration_s=2.0)
    assert same(fly(flight, PdController()), fly(flight, PdController()))


def test_flight_in_a_batch_is_the_flight_alone() -> None:
    """Flights with different trajectories, headings, airframes, lags, drags and winds do not interact."""
    trajectories: tuple[Trajectory, ...] = (
        FIGURE_OF_EIGHT,
        Circle(1.0, 0.8),
        Gerono(1.0, 0.5),
        PositionStep(1.0, 0.0),
        Hover(),
    )
    yaws, lags = np.array([0.0, 0.8, -0.5, 3.0, 0.1]), np.array([0.0, 0.03, 0.0, 0.05, 0.02])
    masses, drags = np.linspace(0.06, 0.07, 5), np.linspace(0.0, 0.1, 5)
    winds, factors = np.linspace(-0.4, 0.4, 5), np.linspace(4.2e-8, 5.0e-8, 5)
    inertias = np.linspace(5e-5, 8e-5, 5)
    together = Vehicle(
        replace(
            MAMBO,
            mass_kg=masses,
            thrust_factor_n_s2=factors,
            inertia_kg_m2=(inertias, 1.2 * inertias, 2.0 * inertias),
        ),
        lags,
        drags,
        (winds, -winds),
    )
    batch = fly(Flight(Trajectories(trajectories), 2.0, 5, yaw_rad=yaws, vehicle=together), PdController())
    for number, trajectory in enumerate(trajectories):
        inertia = float(inertias[number])
        airframe = replace(
            MAMBO,
            mass_kg=float(masses[number]),
            thrust_factor_n_s2=float(factors[number]),
            inertia_kg_m2=(inertia, 1.2 * inertia, 2.0 * inertia),
        )
        wind = float(winds[number])
        vehicle = Vehicle(airframe, float(lags[number]), float(drags[number]), (wind, -wind))
        alone = fly(Flight(trajectory, 2.0, yaw_rad=float(yaws[number]), vehicle=vehicle), PdController())
        assert same(flight_of(batch, number), alone), number


def test_controller_receives_the_recorded_state_and_target() -> None:
    """The controller's input is what the trace records at the same update."""
    drifting = Vehicle(wind_m_s2=(0.5, 0.3))
    flight = Flight(FIGURE_OF_EIGHT, duration_s=3.0, yaw_rad=0.4, vehicle=drifting)
    for columns in ((0, 1), (2, 3), (4, 5), (6, 7), (8, 9), (10, 0)):
        trace = fly(flight, Echo(columns))
        recorded = np.concatenate(
            [trace.position_m[..., :2], trace.velocity_m_s[..., :2], trace.euler_rad, trace.target], axis=-1
        )
        np.testing.assert_array_equal(trace.command_rad, 0.01 * recorded[..., columns])
        np.testing.assert_array_equal(trace.status, np.int64(1e6 * trace.thrust_acceleration_m_s2))


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


def test_step_of_the_target_is_reached() -> None:
    """The PD moves the drone to a point 1.4 m away and keeps its height."""
    trace = fly(Flight(PositionStep(1.0, -1.0), duration_s=30.0), PdController())
    np.testing.assert_allclose(trace.position_m[-1, 0], [1.0, -1.0, -1.1], atol=0.02)


def test_wind_leaves_the_pd_a_steady_error() -> None:
    """In a steady side wind of 0.5 m/s^2 the PD settles where Kp times the error balances the wind."""
    vehicle = Vehicle(wind_m_s2=(0.0, 0.5))
    trace = fly(Flight(Hover(), duration_s=30.0, vehicle=vehicle), PdController())
    np.testing.assert_allclose(trace.position_m[-1, 0, 1], 0.5 / 9.81 / 0.24, rtol=0.05)
    assert abs(trace.position_m[-1, 0, 0]) < 1e-6


def test_lost_flight_is_nan_and_does_not_affect_the_others() -> None:
    """A flight blown out of bounds is NaN from then on and `diverged`; the flight beside it continues."""
    vehicle = Vehicle(drag_1_s=0.0, wind_m_s2=(np.array([0.0, 5e3]), 0.0))
    trace = fly(Flight(Hover(), 3.0, 2, vehicle=vehicle), Lean(0.0, 0.0))
    assert trace.diverged.tolist() == [False, True]
    # At 5 km/s^2 the flight reaches 10 km after two seconds.
    np.testing.assert_allclose(trace.position_m[199, 1, 0], 2500.0 * 1.99**2, rtol=1e-9)
    assert np.isnan(trace.position_m[201:, 1]).all()
    assert np.isnan(trace.euler_rad[201:, 1]).all()
    np.testing.assert_allclose(trace.position_m[:, 0], [[0.0, 0.0, -1.1]] * 301, atol=1e-9)


def test_overflowing_flight_is_lost_without_a_warning() -> None:
    """A floating-point overflow loses the flight and raises neither warning nor error."""
    vehicle = Vehicle(wind_m_s2=(1e308, 0.0))
    assert fly(Flight(Hover(), duration_s=0.1, vehicle=vehicle), PdController()).diverged.all()


@pytest.mark.parametrize("update_period_s", [0.0, 0.007, 0.0125, -0.005])
def test_update_period_must_be_a_multiple_of_the_tick(update_period_s: float) -> None:
    """An update period that is not a positive multiple of 5 ms is rejected."""
    with pytest.raises(FlightError, match=r"update_period_s = .* must be a whole multiple of 0\.005"):
        Flight(Hover(), update_period_s=update_period_s)


@pytest.mark.parametrize("duration_s", [0.0, -1.0, np.inf, np.nan])
def test_duration_must_be_finite_and_positive(duration_s: float) -> None:
    """A duration that is infinite, NaN or shorter than one update is rejected."""
    with pytest.raises(FlightError, match=r"duration_s = .* must be finite"):
        Flight(Hover(), duration_s=duration_s)


def test_number_of_trajectories_must_be_the_number_of_flights() -> None:
    """Two trajectories for three flights are rejected."""
    with pytest.raises(FlightError, match="flights = 3 must be 2"):
        fly(Flight(Trajectories((Hover(), Hover())), flights=3), PdController())


def test_progress_is_called_with_the_share_done() -> None:
    """The shares increase by equal steps and end at 1."""
    shares: list[float] = []
    fly(Flight(Hover(), duration_s=0.5), PdController(), shares.append)
    np.testing.assert_allclose(shares, np.arange(1, 52) / 51.0)
