"""The plant as an environment of Gymnasium, as its checker demands it."""

import importlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mambo_codegen.methods.shared.inputs import Status
from mambo_nmpc import ArgumentError, Vehicle
from mambo_nmpc.curves import Circle
from mambo_sil.api.simulated import SimulatedDrones
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.sensors.instruments import Sensors
from mambo_sil.flight.scenario import choose_sensors
from tests.support.tools import require_module

NAME = "mambo_nmpc.adapters.gymnasium:MamboNmpc-v0"
CRAZYFLIE = Vehicle.from_preset("crazyflie")


def make(**options: Any) -> Any:
    """Return the environment by its name."""
    require_module("gymnasium")
    return importlib.import_module("gymnasium").make(NAME, **options)


@pytest.mark.first_is_quick
@pytest.mark.parametrize("action", ["target", "attitude"])
def test_the_checker_of_gymnasium_finds_nothing(action: str) -> None:
    """No error, and no warning: the tests turn warnings into errors."""
    environment = make(action=action)
    importlib.import_module("gymnasium.utils.env_checker").check_env(environment.unwrapped)


@pytest.mark.long
def test_a_policy_that_aims_at_the_curve_follows_it() -> None:
    """The C flies to the targets within the limits that info tells; the seed draws the start."""
    environment = make(tilt_rad=0.3, speed_m_s=2.0)
    seen, info = environment.reset(seed=4)
    assert 0.0 < info["distance_m"] < 0.5
    assert (seen == environment.reset(seed=4)[0]).all()
    assert (seen != environment.reset(seed=5)[0]).any()
    assert (info["tilt_limit_rad"], info["speed_limit_m_s"]) == (0.3, 2.0)
    for _ in range(150):
        seen, reward, terminated, truncated, info = environment.step((seen[:2] + seen[9:11]) / 5.0)
        assert not terminated
        assert not truncated
        assert reward == -info["distance_m"]
    assert info["distance_m"] < 0.5
    assert info["status"] == 0


@pytest.mark.first_is_quick
@pytest.mark.parametrize("vehicle", ["crazyflie", "crazyflie-flown"])
def test_the_height_of_a_curve_in_space_is_held(vehicle: str) -> None:
    """By the thrust of the C, of a drone without [height] by an altitude loop, as where the policy tilts."""
    for action in ("target", "attitude"):
        environment = make(action=action, vehicle=vehicle, trajectory="swinging-eight")
        seen, _ = environment.reset(seed=2)
        heights, errors = [], []
        for _ in range(200):
            aim = (seen[:2] + seen[9:11]) / 5.0 if action == "target" else np.zeros(2)
            seen, *_ = environment.step(aim)
            heights.append(seen[2])
            errors.append(abs(seen[11]))
        assert max(errors[100:]) < 0.01  # after a start at rest beneath a curve that climbs
        assert np.ptp(heights) > 0.2


@pytest.mark.parametrize("kind", ["mocap", "true"])
def test_a_drone_that_is_measured_beside_its_centre_flies(kind: Any) -> None:
    """The environment's states are those of the centre: its controller does not move them once more."""
    drone = CRAZYFLIE.drone.with_sensors(kind)
    placed = drone.sensors.model_copy(update={"lever_m": (0.0, 0.0, -0.05)})
    environment = make(
        vehicle=Vehicle.of(drone.model_copy(update={"sensors": placed})), trajectory="hover", sensors=kind
    )
    seen, _ = environment.reset(seed=2)
    for _ in range(30):
        seen, _, crashed, *_ = environment.step(np.zeros(2))
        assert not crashed
    assert abs(seen[2] - 1.0) < 0.01


@pytest.mark.parametrize("sensors", [None, choose_sensors("mocap", CRAZYFLIE.drone)])
def test_drones_are_seen_where_their_sensors_really_lie(sensors: Any) -> None:
    """By `lever_error_m` away, after a placement and in flight; the true state stays that of the centre."""
    beside = replace(CRAZYFLIE, lever_error_m=(0.0, 0.0, 0.1))
    drones = SimulatedDrones(beside, 0.01, (0, 1), sensors=sensors)
    drones.place(np.array([[0.0, 0.0, -2.0], [0.0, 0.0, -1.0]]), np.array([True, False]))
    for _ in range(10):
        off_m = drones.state.position_m - drones.true_state.position_m
        assert np.allclose(off_m, [0.0, 0.0, 0.1], atol=0.005)
        drones.advance(np.zeros((2, 2)), np.array([9.81, 9.81]))


def test_a_thrust_that_the_mixer_caps_is_reported() -> None:
    """Beside a large tilt the Crazyflie's motors do not give all that is commanded; at rest they do."""
    drones = SimulatedDrones(CRAZYFLIE, 0.01, (0, 1))
    drones.advance(np.zeros((2, 2)), np.array([9.81, 9.81]))
    assert np.isnan(drones.report_thrust()).all()
    drones.advance(np.full((2, 2), 0.5), np.array([15.9, 15.9]))
    drones.place(np.array([[0.0, 0.0, -1.0]] * 2), np.array([True, False]))
    placed, other = drones.report_thrust()
    assert np.isnan(placed)
    assert other < 15.9
    drones.advance(np.array([[0.0, 0.0], [0.5, 0.0]]), np.array([9.81, 15.9]))
    calm, capped = drones.report_thrust()
    assert np.isnan(calm)
    assert 9.0 < capped < 15.9
    assert np.isnan(drones.report_thrust()).all()


@pytest.mark.long
def test_a_crash_ends_the_episode() -> None:
    """Of a policy that tilts the drone until it is far away, or lower than the ground."""
    environment = make(action="attitude", tilt_rad=1.1)
    environment.reset(seed=1)
    steps = (environment.step(np.ones(2)) for _ in range(1000))
    reward, info = next((reward, info) for _, reward, terminated, _, info in steps if terminated)
    assert reward == -10.0 - info["distance_m"]
    assert "status" not in info


def test_an_action_of_nan_ends_no_flight_of_the_c_and_is_a_crash_of_a_policy() -> None:
    """The C refuses a target of NaN and holds its command; an attitude of NaN costs 10, no lost drone."""
    environment = make(action="target")
    environment.reset(seed=3)
    _, reward, terminated, _, info = environment.step(np.array([np.nan, 0.2]))
    assert not terminated
    assert info["status"] == int(Status.BAD_TARGET)
    assert reward == -info["distance_m"]
    environment = make(action="attitude")
    environment.reset(seed=3)
    seen, reward, terminated, _, info = environment.step(np.array([0.1, np.nan]))
    assert terminated
    assert reward == -10.0 - info["distance_m"]
    assert info["distance_m"] < 0.5
    assert np.isfinite(seen).all()


def test_an_action_of_another_shape_is_refused_by_name() -> None:
    """Not by the name of what is made of it."""
    environment = make(action="attitude").unwrapped
    environment.reset(seed=3)
    for wrong in (0.1, [0.1, 0.2, 0.3], [[0.1, 0.2]]):
        with pytest.raises(ArgumentError, match=r"action: has shape .*; it must be \(2,\)"):
            environment.step(wrong)


def test_wrong_arguments_are_refused() -> None:
    """By name."""
    for wrong, message in (
        ({"action": "thrust"}, 'action = "thrust" must be "attitude" or "target"'),
        ({"height": "pid"}, 'height = "pid" must be left out'),
        ({"reach_m": 0.0}, r"reach_m = 0\.0 must lie in 0\.1\.\.100"),
        ({"update_period_s": 1.0 / 240.0}, r"update_period_s = 0\.00416\d* must be a multiple of 0\.002"),
        ({"tilt_deg": 3.0}, 'option = "tilt_deg" must be'),
    ):
        with pytest.raises(ArgumentError, match=message):
            make(**wrong)


def make_many(n: int, **options: Any) -> Any:
    """Return n environments that are simulated together."""
    require_module("gymnasium")
    return importlib.import_module("gymnasium").make_vec(
        NAME, num_envs=n, vectorization_mode="vector_entry_point", **options
    )


@pytest.mark.parametrize("sensors", ["true", "mocap"])
def test_drones_that_fly_together_fly_as_each_alone(sensors: str) -> None:
    """Bit for bit, in gusts and through cameras with noise, after one of them was placed anew."""
    chosen = choose_sensors("mocap", CRAZYFLIE.drone) if sensors == "mocap" else None
    assert not isinstance(chosen, Sensors)
    wind = Disturbances(wind_speed_m_s=3.0)
    rng, seeds = np.random.default_rng(1), (5, 6, 7)
    starts, commands = rng.uniform(-2.0, -1.0, (2, 3, 3)), rng.uniform(-0.1, 0.1, (40, 3, 2))
    found = []
    for group in (seeds, *((seed,) for seed in seeds)):
        rows = [seeds.index(seed) for seed in group]
        drones = SimulatedDrones(CRAZYFLIE, 0.01, group, sensors=chosen, disturbances=wind)
        drones.place(starts[0, rows])
        for step, command in enumerate(commands[:, rows]):
            if step == 20:
                drones.place(starts[1, rows], np.array([seed == 6 for seed in group]))
            drones.advance(command, np.full(len(group), 9.9))
        found.append(np.column_stack([drones.state.position_m, drones.true_state.velocity_m_s]))
    assert np.array_equal(found[0], np.concatenate(found[1:]))
    assert len(np.unique(found[0][:, 0])) == 3


def test_an_environment_that_ends_begins_anew_alone() -> None:
    """At the next step, whose action it does not take; the others fly on, and long ones are cut."""
    many = make_many(3, action="attitude", trajectory="hover", max_episode_steps=60)
    first, info = many.reset(seed=2)
    assert first.shape == (3, 15)
    assert info["distance_m"].shape == (3,)
    assert (first == many.reset(seed=2)[0]).all()
    assert (first != many.reset(seed=3)[0]).any()
    actions, ended = np.zeros((3, 2), np.float32), []
    for step in range(59):
        actions[1] = np.nan if step in (10, 11) else 0.0
        _, reward, crashed, truncated, info = many.step(actions)
        assert not truncated.any()
        if step == 10:
            assert crashed.tolist() == [False, True, False]
            assert reward[1] == -10.0 - info["distance_m"][1]
        if step == 11:
            assert reward[1] == 0.0
            assert not crashed.any()
            assert info["distance_m"][1] < 0.5
        ended += [step] if crashed.any() else []
    assert ended == [10]
    assert many.step(actions)[3].tolist() == [True, False, True]


def test_many_are_seen_through_cameras_in_wind() -> None:
    """The C flies to the targets; what is seen has noise, the distance is the true one."""
    many = make_many(
        4, sensors="mocap", wind_speed_m_s=2.0, trajectory="hover", vehicle=Vehicle.from_preset("crazyflie")
    )
    seen, _ = many.reset(seed=1)
    for _ in range(300):
        seen, _, crashed, _, info = many.step((seen[:, :2] + seen[:, 9:11]) / 5.0)
        assert not crashed.any()
    assert info["distance_m"].max() < 0.1
    assert (info["status"] == 0).all()
    assert (np.abs(np.linalg.norm(seen[:, 9:12], axis=1) - info["distance_m"]) > 1e-4).all()
    for wrong, message in (
        ({"sensors": "flow"}, 'sensors = "flow" must be "true" or "mocap" or "flow-deck"'),
        ({"wind_direction_rad": 90.0}, r"wind_direction_rad = 90\.0 must lie in"),
        ({"wind_speed_m_s": -1.0}, r"wind_speed_m_s = -1\.0 must lie in"),
    ):
        with pytest.raises(ArgumentError, match=message):
            make_many(2, **wrong)
    with pytest.raises(ArgumentError, match=r"actions: has shape \(2,\); it must be \(4, 2\)"):
        many.step(np.zeros(2))


@pytest.mark.sampled(2)
@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("vehicle", "sensors"),
    [
        ("crazyflie", "flow-deck"),
        ("crazyflie", "autopilot"),
        ("mambo", "mambo"),
        ("mambo", "mambo-derotated"),
    ],
)
def test_every_kind_of_sensors_measures(vehicle: str, sensors: str) -> None:
    """What is seen is not the true state, and is again where an environment begins again."""
    many = make_many(3, action="attitude", vehicle=vehicle, sensors=sensors, trajectory="hover", tilt_rad=0.3)
    seen, info = many.reset(seed=1)
    for _ in range(40):
        seen, _, crashed, _, info = many.step(np.zeros((3, 2)))
    assert not crashed.any()
    off_m = np.abs(np.linalg.norm(seen[:, 9:12], axis=1) - info["distance_m"])
    assert 1e-5 < off_m.max() < 0.2
    flights = many.unwrapped._flights
    flights.begin_again(np.random.default_rng(3), np.array([True, False, True]))
    again, info = flights.observe({})
    placed = [0, 2]
    np.testing.assert_allclose(
        np.linalg.norm(again[placed, 9:12], axis=1), info["distance_m"][placed], atol=1e-6
    )
    assert (again[1] == seen[1]).all()
    for _ in range(5):
        seen, _, crashed, _, info = many.step(np.zeros((3, 2)))
    assert not crashed.any()
    assert np.abs(np.linalg.norm(seen[:, 9:12], axis=1) - info["distance_m"])[placed].max() < 0.05


def test_the_wind_blows_from_where_it_is_asked() -> None:
    """Towards a heading: pi / 2 is to the right, where y, to the left, falls."""
    ends = []
    for direction_rad in (0.0, np.pi / 2.0, np.pi):
        environment = make(
            action="attitude", trajectory="hover", wind_speed_m_s=6.0, wind_direction_rad=direction_rad
        )
        start, _ = environment.reset(seed=3)
        for _ in range(100):
            seen, *_ = environment.step(np.zeros(2))
        ends.append(seen[:2] - start[:2])
    ahead, right, back = ends
    assert ahead[0] > 0.1 > abs(ahead[1])
    assert right[1] < -0.1
    assert abs(right[0]) < 0.1
    assert back[0] < -0.1


def test_a_curve_of_one_s_own_is_followed() -> None:
    """An object, as `fly` takes it; one whose velocity is wrong is refused."""
    environment = make(trajectory=Circle(1.0, 0.7))
    assert (
        environment.reset(seed=2)[0] == make(trajectory="circle", size_m=1.0, rate_rad_s=0.7).reset(seed=2)[0]
    ).all()

    class Wrong(Circle):
        """Moves the other way."""

        def target(self, time_s: Any) -> Any:
            """Return [x, y, vx, vy]."""
            return super().target(time_s) * np.array([1.0, 1.0, -1.0, -1.0])

    with pytest.raises(ArgumentError, match=r"trajectory: at .* its velocity along . is"):
        make(trajectory=Wrong(1.0, 0.7))
