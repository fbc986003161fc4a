"""Wind, battery, payload, impulse, and the link between controller and stock loops."""

import math

import numpy as np
import pytest
from scipy import linalg

from mambo_sil.drone.plant.disturbances import Disturbances, World
from mambo_sil.drone.plant.ground import ROTOR_HEIGHT_M, carry_on_ground, ground_effect
from mambo_sil.drone.plant.gusts import (
    ACROSS_GAINS,
    FOOT_M,
    LIGHT_M_S,
    Gusts,
    coefficients,
    low_altitude_scales,
    mean_speed_m_s,
)
from mambo_sil.drone.plant.link import NOT_CALLED, Link
from mambo_sil.drone.plant.randomness import Purpose, generators
from mambo_sil.drone.plant.rigid_body import RigidBody
from mambo_sil.drone.plant.vehicle import STEP_S, Vehicle, VehicleState
from mambo_sil.flight.controllers.pd import PdController
from mambo_sil.flight.loop import Flight, Offset, fly
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import CURVES, Bernoulli, Hover


def hover(duration_s: float = 1.0, flights: int = 1, **more: object) -> Trace:
    """Hover with the PD."""
    return fly(Flight(Hover(), duration_s, flights, **more), PdController())  # type: ignore[arg-type] # tests


def at_rest(flights: int = 1) -> VehicleState:
    """Return n level drones at rest."""
    return Vehicle().at_rest(np.zeros((3, flights)), 0.0, 236.5)


def test_gust_scales_match_the_specification() -> None:
    """At 100 ft: L = 100 / 0.2593^1.2 ft, sigma = 0.1 W20 / 0.2593^0.4; below 10 ft the scales at 10 ft."""
    scales = low_altitude_scales(100.0 * 0.3048)
    assert scales.length_m / 0.3048 == pytest.approx(100.0 / 0.2593**1.2)
    assert scales.intensity == pytest.approx(0.1 / 0.2593**0.4)
    least = low_altitude_scales(1.1)
    assert least.length_m / 0.3048 == pytest.approx(10.0 / (0.177 + 0.00823) ** 1.2)
    assert low_altitude_scales(10.1 * 0.3048).length_m > least.length_m
    assert pytest.approx(7.7167, abs=1e-4) == LIGHT_M_S  # 15 knots


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


def test_gusts_along_and_across_have_the_documented_transfer_functions() -> None:
    """In x = t V / L: 1 / (1 + s) and (1 + sqrt(3) s) / (1 + s)^2 over sqrt(2), of w with intensity 2."""
    rates, drive = np.array([[-1.0, 0.0], [1.0, -1.0]]), np.array([1.0, 0.0])
    for s in (0.0, 0.5j, 2.0j):
        states = np.linalg.solve(s * np.eye(2) - rates, drive)
        across = (1.0 + math.sqrt(3.0) * s) / (1.0 + s) ** 2 / math.sqrt(2.0)
        np.testing.assert_allclose(np.array(ACROSS_GAINS) @ states, across, rtol=1e-14)


@pytest.mark.parametrize("step_s", [0.1, 1.0, 10.0])
def test_increments_of_the_gusts_have_the_covariance_of_a_stationary_process(step_s: float) -> None:
    """It is P - F P F', where P solves Lyapunov's equation and F is the matrix exponential of the step."""
    rates, drive = np.array([[-1.0, 0.0], [1.0, -1.0]]), np.array([[1.0], [0.0]])
    stationary = linalg.solve_continuous_lyapunov(rates, -2.0 * drive @ drive.T)
    np.testing.assert_allclose(stationary, [[1.0, 0.5], [0.5, 0.5]], atol=1e-14)
    gusts = coefficients(8.0, 0.0, 1, height_m=6.0, step_s=step_s)
    move = linalg.expm(rates * gusts.x[0])
    np.testing.assert_allclose(move, gusts.decay * np.array([[1.0, 0.0], [gusts.x[0], 1.0]]), rtol=1e-12)
    root = np.array([[gusts.root_aa[0], 0.0], [gusts.root_ab[0], gusts.root_bb[0]]])
    np.testing.assert_allclose(root @ root.T, stationary - move @ stationary @ move.T, atol=1e-14)


def test_gusts_follow_the_documented_recurrence() -> None:
    """Three normal numbers a tick drive the states, of which the first three give the stationary start."""
    speed_m_s, heading_rad, step_s = 7.0, 0.6, 3.0
    gusts = Gusts(speed_m_s, heading_rad, (11,), height_m=2.0, step_s=step_s)
    f = coefficients(speed_m_s, heading_rad, 1, height_m=2.0, step_s=step_s)
    move = math.exp(-f.x[0]) * np.array([[1.0, 0.0], [f.x[0], 1.0]])
    root = np.array([[f.root_aa[0], 0.0], [f.root_ab[0], f.root_bb[0]]])
    drawn = generators((11,), Purpose.GUSTS)[0].standard_normal((300, 3))
    along, across = drawn[0, 0], np.linalg.cholesky([[1.0, 0.5], [0.5, 0.5]]) @ drawn[0, 1:]
    sigma_m_s = speed_m_s * low_altitude_scales(2.0).intensity
    turn = np.array(
        [[math.cos(heading_rad), -math.sin(heading_rad)], [math.sin(heading_rad), math.cos(heading_rad)]]
    )
    for numbers in drawn[1:]:
        air_m_s = [f.mean_m_s[0] + sigma_m_s * along, sigma_m_s * np.dot(ACROSS_GAINS, across)]
        np.testing.assert_allclose(np.ravel(gusts.next()), turn @ air_m_s, rtol=1e-11, atol=1e-11)
        along, across = move[0, 0] * along + root[0, 0] * numbers[0], move @ across + root @ numbers[1:]


def test_gusts_vary_in_still_air_and_whichever_way_the_wind_blows() -> None:
    """The step is that of V = 0.1 m/s where the mean wind is slower, and of its magnitude elsewhere."""
    speeds_m_s = np.array([0.0, 0.05, -0.05, 4.0, -4.0])
    gusts = coefficients(speeds_m_s, 0.0, 5, height_m=20.0 * FOOT_M, step_s=0.5)
    length_m = low_altitude_scales(20.0 * FOOT_M).length_m
    np.testing.assert_allclose(gusts.x, 0.5 * np.array([0.1, 0.1, 0.1, 4.0, 4.0]) / length_m, rtol=1e-14)


def test_increments_of_the_gusts_are_finite_however_small_the_step() -> None:
    """Rounding makes the variance of the second increment negative there; it counts as 0."""
    gusts = coefficients(np.linspace(0.1, 5.0, 1000), 0.0, 1000, height_m=20.0 * FOOT_M, step_s=1e-5)
    assert np.isfinite(gusts.root_bb).all()
    assert (gusts.root_bb == 0.0).any()


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


def test_payload_is_added_at_its_time() -> None:
    """Before it nothing changes; after it Kp times the altitude error carries the payload's weight."""
    trace = hover(4.0, 2, disturbances=Disturbances(payload_kg=np.array([0.0, 0.005]), payload_time_s=0.5))
    np.testing.assert_allclose(trace.position_m[:51, 1, 2], -1.1, atol=1e-9)
    assert trace.position_m[-1, 1, 2] + 1.1 == pytest.approx(0.005 * 9.81 / 0.8, rel=0.02)
    np.testing.assert_allclose(trace.position_m[:, 0, 2], -1.1, atol=1e-9)


@pytest.mark.parametrize("part", [(0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.01)])
@pytest.mark.parametrize("loaded", [True, False])
def test_an_impulse_meets_the_mass_of_its_instant(part: tuple[float, float, float], loaded: bool) -> None:
    """A payload counts from its own tick on: due with the impulse it is carried, one tick later it is not."""
    disturbances = Disturbances(
        payload_kg=0.007, payload_time_s=0.01 if loaded else 0.015, impulse_n_s=part, impulse_time_s=0.01
    )
    world = World(disturbances, Vehicle(), (0,), 1.1)
    state = at_rest()
    for tick in range(5):
        after, moment = world.tick(state, STEP_S * tick)
        expected = np.array(part) / (0.07 if loaded else 0.063) if tick == 2 else np.zeros(3)
        np.testing.assert_allclose(after.body[3:6, 0], expected, rtol=1e-12)
        assert moment is not None
        assert moment.payload_kg == (0.007 if tick >= (2 if loaded else 3) else 0.0)


def test_events_happen_at_the_nearest_tick_of_each_flight() -> None:
    """12.4 ms is tick 2, 12.6 ms tick 3; 35 ms is tick 7, although 0.035 / 0.005 is not exactly 7."""
    times_s = np.array([0.0124, 0.0126, 0.035])
    disturbances = Disturbances(
        payload_kg=0.007, payload_time_s=times_s, impulse_n_s=(0.0, 0.007, 0.0), impulse_time_s=times_s
    )
    world = World(disturbances, Vehicle(), (0, 0, 0), 1.1)
    pushed, loaded = np.zeros((9, 3)), np.zeros((9, 3))
    for tick in range(9):
        state, moment = world.tick(at_rest(3), STEP_S * tick)
        assert moment is not None
        pushed[tick], loaded[tick] = state.body[4], moment.payload_kg
    due = np.eye(9)[:, [2, 3, 7]]
    np.testing.assert_allclose(pushed, 0.1 * due, rtol=1e-12)
    np.testing.assert_array_equal(loaded, 0.007 * np.cumsum(due, axis=0))


def test_the_battery_sags_from_the_start_of_the_flight_to_nothing() -> None:
    """The share falls by its rate from 1 at the first tick, whatever the trajectory's clock shows."""
    disturbances = Disturbances(battery_sag_1_s=np.array([0.0, 1.0, 100.0]))
    world = World(disturbances, Vehicle(), (0, 0, 0), 1.1)
    for tick in range(4):
        _, moment = world.tick(at_rest(3), -5.0 + STEP_S * tick)
        assert moment is not None
        expected = [1.0, 1.0 - 0.005 * tick, max(1.0 - 0.5 * tick, 0.0)]
        np.testing.assert_allclose(moment.thrust_share, expected, rtol=1e-12)


WINDY = Disturbances(wind_speed_m_s=np.array([0.0, 3.0]), wind_direction_rad=np.array([0.0, 2.0]))


def test_each_flight_has_the_gusts_of_its_own_wind_at_the_given_height() -> None:
    """The air is that of `Gusts`, tick by tick; it is still in a flight without wind beside one with wind."""
    world = World(WINDY, Vehicle(), (7, 8), 4.0)
    gusts = Gusts(3.0, 2.0, (8,), height_m=4.0, step_s=STEP_S)
    for tick in range(5):
        state, moment = world.tick(at_rest(2), STEP_S * tick)
        assert moment is not None
        assert moment.air_m_s is not None
        air_m_s = np.array(moment.air_m_s)
        np.testing.assert_array_equal(air_m_s[:, 0], 0.0)
        np.testing.assert_array_equal(air_m_s[:, 1:], gusts.next())
        np.testing.assert_array_equal(moment.thrust_share, 1.0)
        np.testing.assert_array_equal(moment.payload_kg, 0.0)
        np.testing.assert_array_equal(state.body, at_rest(2).body)


@pytest.mark.parametrize(
    ("disturbances", "share", "payload_kg", "velocity_m_s"),
    [
        (Disturbances(battery_sag_1_s=np.array([0.0, 2.0])), [1.0, 0.99], 0.0, 0.0),
        (Disturbances(payload_kg=np.array([0.0, 0.005])), 1.0, [0.0, 0.005], 0.0),
        (Disturbances(impulse_n_s=(0.0, np.array([0.0, 0.0063]), 0.0)), 1.0, 0.0, [0.0, 0.1]),
        (Disturbances(push_m_s2=(0.0, np.array([0.0, 0.5]))), 1.0, 0.0, 0.0),
    ],
    ids=["battery", "payload", "impulse", "push"],
)
def test_each_disturbance_acts_alone_and_in_its_flight_only(
    disturbances: Disturbances,
    share: float | list[float],
    payload_kg: float | list[float],
    velocity_m_s: float | list[float],
) -> None:
    """By default payload and impulse are due at t = 0, not before; all others stay off."""
    world = World(disturbances, Vehicle(), (0, 0), 1.1)
    state, early = world.tick(at_rest(2), -STEP_S)
    assert early is not None
    np.testing.assert_array_equal(early.payload_kg, 0.0)
    np.testing.assert_array_equal(state.body, 0.0)
    state, moment = world.tick(state, 0.0)
    assert moment is not None
    np.testing.assert_allclose(moment.thrust_share, np.broadcast_to(share, 2), rtol=1e-15)
    np.testing.assert_array_equal(moment.payload_kg, np.broadcast_to(payload_kg, 2))
    np.testing.assert_allclose(state.body[4], np.broadcast_to(velocity_m_s, 2), rtol=1e-12)
    assert moment.air_m_s is None
    assert moment.push_m_s2 is disturbances.push_m_s2


def test_wind_blows_towards_north_by_default() -> None:
    """Its mean is along world x, and its gusts are small beside it."""
    gusts = World(Disturbances(wind_speed_m_s=5.0), Vehicle(), (1,), 20.0 * FOOT_M)
    _, moment = gusts.tick(at_rest(), 0.0)
    assert moment is not None
    assert moment.air_m_s is not None
    np.testing.assert_allclose(np.array(moment.air_m_s)[:, 0], [5.0, 0.0], atol=2.0)


def test_without_disturbances_nothing_happens() -> None:
    """The state is the one given, and there is nothing to apply."""
    state = at_rest()
    assert World(Disturbances(), Vehicle(), (0,), 1.1).tick(state, 0.0) == (state, None)


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


def test_ground_effect_is_the_formula_of_cheeseman_and_bennett() -> None:
    """4/3 at z = R/2 and below, 16/15 at z = R, 1.0159 at 2 R, nothing far away or without a radius."""
    z_m = np.array([0.2, 0.25, 0.5, 1.0, 1e6])
    found = ground_effect(z_m - ROTOR_HEIGHT_M, 0.5)
    np.testing.assert_allclose(found, [4 / 3, 4 / 3, 16 / 15, 1 / (1 - 1 / 64), 1.0], rtol=1e-12)
    with np.errstate(all="ignore"):
        without = ground_effect(np.array([-ROTOR_HEIGHT_M, 0.0, 1.0]), np.zeros(3))
    np.testing.assert_array_equal(without, 1.0)


@pytest.mark.parametrize("vehicle", ["crazyflie", "crazyflie-flown", "mambo"])
def test_a_vertical_gust_lifts_the_drone_until_the_altitude_loop_balances_it(vehicle: str) -> None:
    """Acceleration times mass over the loop's gain, from its time on; downwards as far as upwards."""
    drone = Vehicle.from_preset(vehicle)
    trace = hover(
        6.0,
        3,
        vehicle=drone,
        disturbances=Disturbances(
            vertical_gust_m_s2=np.array([1.0, 0.0, -1.0]), vertical_gust_time_s=np.array([2.0, 0.0, 2.0])
        ),
    )
    gained_m = drone.drone.body.mass_kg / drone.drone.altitude.p_n_m
    heights_m = -trace.position_m[..., 2] - 1.1
    np.testing.assert_allclose(heights_m[200], 0.0, atol=1e-12)
    np.testing.assert_allclose(heights_m[-1], gained_m * np.array([1.0, 0.0, -1.0]), atol=2e-3 * gained_m)


def test_ground_effect_lifts_a_low_drone() -> None:
    """The altitude loop demands less thrust, which it does where the drone is too high."""
    drone = Vehicle.from_preset("crazyflie")
    flight = Flight(
        CURVES["height-step"](-1.0, 0.0),
        5.0,
        2,
        vehicle=drone,
        disturbances=Disturbances(ground_effect_radius_m=np.array([0.0, 0.05])),
    )
    trace = fly(flight, PdController())
    plain_m, lifted_m = -trace.position_m[-1, :, 2]
    assert plain_m == pytest.approx(0.1, abs=1e-3)
    share = float(ground_effect(np.array([lifted_m]), 0.05)[0])
    gain_n = drone.drone.weight_n * (1.0 - 1.0 / share)
    assert lifted_m - plain_m == pytest.approx(gain_n / drone.drone.altitude.p_n_m, rel=0.02)
    assert lifted_m - plain_m > 0.005


def test_the_ground_stops_what_falls_and_lets_go_what_rises() -> None:
    """Position to 0; what sinks or stands is level and at rest, with its heading and rotors; no one else."""
    state = at_rest(5)
    state.body[2] = [0.1, 0.1, -0.1, 0.1, 0.0]
    state.body[5] = [1.0, -1.0, 1.0, 1.0, 0.0]
    state.body[6:9] = [[0.1], [0.2], [0.3]]
    state.body[9:] = 0.4
    there = np.array([True, True, True, False, True])
    after = carry_on_ground(state, there)
    assert after.body[2].tolist() == [0.0, 0.0, -0.1, 0.1, 0.0]
    for flight, (stops, before) in enumerate(
        zip([True, False, False, False, True], state.body.T, strict=True)
    ):
        expected = before.copy()
        expected[2] = after.body[2, flight]
        if stops:
            expected[3:8] = expected[9:] = 0.0
        np.testing.assert_array_equal(after.body[:, flight], expected)
    np.testing.assert_array_equal(after.rotor_speed_rad_s, state.rotor_speed_rad_s)
    assert carry_on_ground(state, ~there & False) is state
