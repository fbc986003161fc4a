"""Wind, battery, payload, push, and the link between controller and stock loops."""

import math

import numpy as np
import pytest

from mambo_nmpc.sil.controllers.pd import PdController
from mambo_nmpc.sil.flight.loop import Flight, Offset, fly
from mambo_nmpc.sil.flight.traces import Trace
from mambo_nmpc.sil.flight.trajectories import Bernoulli, Hover
from mambo_nmpc.sil.plant import loops
from mambo_nmpc.sil.plant.disturbances import Disturbances
from mambo_nmpc.sil.plant.gusts import FOOT_M, Gusts, low_altitude_scales, mean_speed_m_s
from mambo_nmpc.sil.plant.link import NOT_CALLED, Link
from mambo_nmpc.sil.plant.rigid_body import RigidBody
from mambo_nmpc.sil.plant.vehicle import STEP_S


def hover(duration_s: float = 1.0, flights: int = 1, **more: object) -> Trace:
    """Hover with the PD."""
    return fly(Flight(Hover(), duration_s, flights, **more), PdController())  # type: ignore[arg-type] # tests


def test_gust_scales_match_the_specification() -> None:
    """At 100 ft: L = 100 / 0.2593^1.2 ft, sigma = 0.1 W20 / 0.2593^0.4; below 10 ft the scales at 10 ft."""
    scales = low_altitude_scales(100.0 * FOOT_M)
    assert scales.length_m / FOOT_M == pytest.approx(100.0 / 0.2593**1.2)
    assert scales.intensity == pytest.approx(0.1 / 0.2593**0.4)
    assert low_altitude_scales(1.1) == low_altitude_scales(10.0 * FOOT_M)


def test_mean_wind_grows_with_the_logarithm_of_the_height() -> None:
    """The mean wind is W20 at 20 ft and about two thirds of it at 1.1 m."""
    at_20ft = mean_speed_m_s(np.array([5.0]), 20.0 * FOOT_M)
    assert at_20ft[0] == pytest.approx(5.0)
    assert mean_speed_m_s(np.array([1.0]), 1.1)[0] == pytest.approx(
        math.log(1.1 / FOOT_M / 0.15) / math.log(20.0 / 0.15)
    )


def test_gusts_have_variance_and_correlation_of_the_dryden_spectra() -> None:
    """Over 4000 flights: along exp(-t/T), across exp(-t/T) (1 - t/2T), T = L/V, at t = 0, 1 s and 3 s."""
    flights, height_m = 4000, 6.0
    gusts = Gusts(8.0, 0.0, tuple(range(flights)), height_m=height_m, step_s=0.1)
    rows = np.array([gusts.next() for _ in range(31)])
    mean = float(mean_speed_m_s(np.array([8.0]), height_m)[0])
    scales = low_altitude_scales(height_m)
    sigma, time_constant_s = 8.0 * scales.intensity, scales.length_m / mean
    along, across = (rows[:, 0] - mean) / sigma, rows[:, 1] / sigma
    for tick in (0, 10, 30):
        x = 0.1 * tick / time_constant_s
        assert (along[0] * along[tick]).mean() == pytest.approx(math.exp(-x), abs=0.07)
        assert (across[0] * across[tick]).mean() == pytest.approx(math.exp(-x) * (1.0 - x / 2.0), abs=0.07)
        assert along[tick].var() == pytest.approx(1.0, abs=0.07)
        assert across[tick].var() == pytest.approx(1.0, abs=0.07)
    assert abs((along[30] * across[30]).mean()) < 0.07


def test_gusts_rotate_with_the_wind_direction_and_follow_the_seed() -> None:
    """Wind towards east is that towards north, rotated; the same seed repeats it, another one does not."""
    north, east, again, other = (
        Gusts(5.0, heading, (seed,), height_m=1.1, step_s=STEP_S)
        for heading, seed in ((0.0, 3), (math.pi / 2.0, 3), (0.0, 3), (0.0, 4))
    )
    for _ in range(200):
        (x, y), (east_x, east_y) = north.next(), east.next()
        np.testing.assert_allclose([east_y, -east_x], [x, y], atol=1e-12)
        assert again.next() == (x, y)
        assert other.next() != (x, y)


def test_drag_is_proportional_to_the_velocity_relative_to_the_air() -> None:
    """Moving air has the effect of a disturbance acceleration d times air velocity, along body x and y."""
    state = np.zeros((12, 1))
    state[3:9, 0] = [1.0, -0.5, 0.2, 0.1, -0.2, 0.7]
    wrench = np.array([[0.6], [0.0], [0.0], [0.0]])
    drag = 0.3
    moving = RigidBody(0.063, (6e-5, 7e-5, 1e-4), drag, (0.0, 0.0), (2.0, -1.0)).derivative(state, wrench)
    pushed = RigidBody(0.063, (6e-5, 7e-5, 1e-4), drag, (drag * 2.0, drag * -1.0)).derivative(state, wrench)
    np.testing.assert_allclose(moving[3:5], pushed[3:5], atol=1e-12)  # drag has no component along body z
    assert moving[5, 0] != pushed[5, 0]


def test_battery_sag_leaves_an_altitude_error() -> None:
    """The altitude loop has no integral action: Kp times the altitude error makes up for the lost thrust."""
    trace = hover(20.0, disturbances=Disturbances(battery_sag_1_s=0.002))
    share = 1.0 - 0.002 * 20.0
    assert trace.position_m[-1, 0, 2] + 1.1 == pytest.approx(
        loops.WEIGHT_N * (1.0 / share - 1.0) / loops.ALTITUDE_P_N_M, rel=0.05
    )


def test_payload_is_added_at_its_time() -> None:
    """Before it nothing changes; after it Kp times the altitude error carries the payload's weight."""
    trace = hover(8.0, 2, disturbances=Disturbances(payload_kg=np.array([0.0, 0.005]), payload_time_s=2.0))
    np.testing.assert_allclose(trace.position_m[:201, 1, 2], -1.1, atol=1e-9)
    assert trace.position_m[-1, 1, 2] + 1.1 == pytest.approx(0.005 * 9.81 / 0.8, rel=0.02)
    np.testing.assert_allclose(trace.position_m[:, 0, 2], -1.1, atol=1e-9)


def test_push_changes_the_velocity_at_once_by_impulse_over_mass() -> None:
    """The change is along the axes of the world for any heading, at that time and in that flight only."""
    disturbances = Disturbances(push_n_s=(np.array([0.0063, 0.0]), -0.00063, 0.0), push_time_s=0.5)
    trace = hover(1.0, 2, yaw_rad=0.8, disturbances=disturbances)
    np.testing.assert_array_equal(trace.velocity_m_s[:50, :, :2], 0.0)
    np.testing.assert_allclose(trace.velocity_m_s[50, :, :2], [[0.1, -0.01], [0.0, -0.01]], atol=1e-12)


def test_a_command_delay_postpones_the_response() -> None:
    """A delay of 8 ticks keeps the drone level for 8 ticks more; the flight beside it is unaffected."""
    offset = Offset(position_m=(-1.0, 0.0, 0.0))
    both = hover(1.0, 2, offset=offset, link=Link(delay_ticks=np.array([0, 8])))
    alone = hover(1.0, offset=offset)
    np.testing.assert_array_equal(both.position_m[:, 0], alone.position_m[:, 0])
    tilted = [np.flatnonzero(both.euler_rad[:, flight, 1])[0] for flight in range(2)]
    assert tilted[1] - tilted[0] == 4
    np.testing.assert_array_equal(both.command_rad[0, 0], both.command_rad[0, 1])


def test_dropped_updates_hold_the_command() -> None:
    """About the given share of updates is dropped and holds the last command; the other flight drops none."""
    flight = Flight(Bernoulli(2.0, 0.5), 4.0, 2, seeds=(1, 2), link=Link(dropped_share=np.array([0.0, 0.3])))
    trace = fly(flight, PdController())
    dropped = trace.status[:, 1] == NOT_CALLED
    assert (trace.status[:, 0] == 0).all()
    assert dropped.mean() == pytest.approx(0.3, abs=0.07)
    held = np.flatnonzero(dropped[1:]) + 1
    np.testing.assert_array_equal(trace.command_rad[held, 1], trace.command_rad[held - 1, 1])


def test_start_can_be_offset_in_position_velocity_and_tilt() -> None:
    """Position and velocity are offset in the world frame, tilt in roll and pitch."""
    offset = Offset((0.1, -0.2, 0.3), (0.4, np.array([0.5]), -0.6), (0.05, -0.06))
    trace = hover(0.01, yaw_rad=0.8, offset=offset)
    np.testing.assert_allclose(trace.position_m[0, 0], [0.1, -0.2, -0.8])
    np.testing.assert_allclose(trace.velocity_m_s[0, 0], [0.4, 0.5, -0.6])
    np.testing.assert_allclose(trace.euler_rad[0, 0], [0.05, -0.06, 0.8])
