"""Controllers made by one call: options, batches, height and heading, saved states, curves."""

import copy
import pickle
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.methods import method_of
from mambo_codegen.methods.quadratic.reciprocal import RECIPROCAL_ERROR
from mambo_codegen.methods.shared.heading import slew_heading
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings import controller_toml, presets
from mambo_codegen.settings.controller_toml import to_toml, with_option
from mambo_nmpc import ArgumentError, Controller, DroneState, TargetState, Vehicle, fly
from mambo_nmpc.curves import CurvePoint, Trajectory, curve, sample
from mambo_sil.api import set_points
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.frames import FRAMES, FrameName
from mambo_sil.flight.names import CURVE_NAMES, AltitudeName, CurveName
from tests.support.derived import settings_for
from tests.support.one_norm import ONE_NORM

DERIVED = settings_for(vehicle_toml.preset("crazyflie"), exact=True)
RECIPROCAL_M_S2 = RECIPROCAL_ERROR * GRAVITY_M_S2
"""Error of the thrust in hover with `[height]`, whose C divides by products."""
RNG = np.random.default_rng(5)


def aloft(*batch: int, z_m: float = -1.0, yaw_rad: float = 0.0) -> DroneState:
    """Return drones at rest at the origin, at a height."""
    return DroneState(
        np.broadcast_to([0.0, 0.0, z_m], (*batch, 3)),
        np.zeros((*batch, 3)),
        np.broadcast_to([0.0, 0.0, yaw_rad], (*batch, 3)),
    )


def goal(*batch: int, yaw_rad: float | None = None) -> TargetState:
    """Return targets at rest, a metre above the origin."""
    yaws_rad = None if yaw_rad is None else np.full(batch, yaw_rad)
    return TargetState(aloft(*batch).position_m, np.zeros((*batch, 3)), yaw_rad=yaws_rad)


def stock(height: AltitudeName, n: int = 1) -> Controller:
    """Return controllers beside an altitude loop of the Crazyflie."""
    return Controller.from_preset("crazyflie", n, vehicle="crazyflie", height=height)


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_a_push_is_learnt_up_to_its_limit(scalar: str) -> None:
    """In m/s^2, along x and y, of each of n; a 1-norm learns none."""
    controller = Controller(with_option(presets.preset("mambo"), "code.scalar", scalar), 2)
    limit_m_s2 = controller.settings.observer.disturbance_limit_m_s2
    np.testing.assert_array_equal(controller.disturbance_m_s2, np.zeros((2, 2)))
    period_s = controller.update_period_s
    for number in range(300):
        speed_m_s = 8.0 * period_s * number
        north_m = np.array([0.5 * speed_m_s * period_s * number, 0.0])
        position_m, velocity_m_s = np.zeros((2, 3)), np.zeros((2, 3))
        position_m[:, 0], velocity_m_s[:, 0] = north_m, [speed_m_s, 0.0]
        here = DroneState(position_m, velocity_m_s, np.zeros((2, 3)))
        controller.step(here, TargetState(position_m, velocity_m_s))
    np.testing.assert_allclose(controller.disturbance_m_s2, [[limit_m_s2, 0.0], [0.0, 0.0]], atol=0.01)
    with pytest.raises(ArgumentError, match="disturbance_m_s2 needs controller"):
        _ = Controller(ONE_NORM).disturbance_m_s2


@pytest.mark.long
def test_a_vehicle_gives_what_design_derives(tmp_path: Path) -> None:
    """By name or as a file."""
    assert Controller.from_vehicle("crazyflie").settings == DERIVED
    file = tmp_path / "mine.toml"
    axis = "{ gain = 0.9, lag_s = 0.05, dead_time_s = 0.02 }"
    attitude = f"[attitude]\nkind = 'first_order'\nroll = {axis}\npitch = {axis}\n"
    file.write_text(f"[body]\nmass_kg = 0.05\ndrag_1_s = 0.3\n{attitude}", "utf-8")
    derived = settings_for(vehicle_toml.read(file))
    assert Controller.from_vehicle(file).settings == derived
    assert Controller.from_vehicle(str(file)).settings == derived
    quick = Controller.from_vehicle(file, sensors="true").settings.observer
    assert (quick.disturbance_noise, derived.observer.disturbance_noise) == (3.0, 1.0)


@pytest.mark.long
def test_options_are_keys_of_the_settings(tmp_path: Path) -> None:
    """From a vehicle, a preset and a file alike."""
    document: dict[str, Any] = presets.load("crazyflie").model_dump()
    document["observer"]["measurement_age_s"] = 0.0
    document["limits"] = {
        "tilt_rad": 0.4,
        "speed_m_s": 3.0,
        "braking_m_s2": 2.5,
        "fence": {"x_min_m": -2.0, "x_max_m": 3.0, "y_min_m": -1.0, "y_max_m": 1.5},
    }
    made = Controller.from_preset(
        "crazyflie",
        measurement_age_s=0.0,
        tilt_rad=0.4,
        speed_m_s=3.0,
        braking_m_s2=2.5,
        fence_m=(-2.0, 3.0, -1.0, 1.5),
    )
    assert made.settings == controller_toml.validate(document, "wanted")
    careful = Controller.from_vehicle("crazyflie", tilt_rad=DERIVED.limits.tilt_rad / 2.0).settings
    assert careful.limits.braking_m_s2 == pytest.approx(DERIVED.limits.braking_m_s2 / 2.0)
    (tmp_path / "mine.toml").write_text(to_toml(ONE_NORM), "utf-8")
    assert Controller.from_file(tmp_path / "mine.toml", tilt_rad=0.2).settings == with_option(
        ONE_NORM, "limits.tilt_rad", 0.2
    )


def test_another_update_period_changes_the_delay_of_the_thrust() -> None:
    """By half as much: a command holds for a period."""
    quick = Controller.from_vehicle("crazyflie", update_period_s=1.0 / 120.0)
    assert quick.update_period_s == 1.0 / 120.0
    assert DERIVED.height is not None
    assert quick.settings.height is not None
    assert DERIVED.height.delay_s - quick.settings.height.delay_s == pytest.approx((0.01 - 1.0 / 120.0) / 2.0)
    flat = Controller.from_preset("crazyflie", update_period_s=0.02)
    assert flat.settings == with_option(presets.load("crazyflie"), "horizon.update_period_s", 0.02)


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"measurement_age_s": 0.3}, r"measurement_age_s = 0\.3 must lie in 0\.\.0\.2"),
        ({"measurement_age_s": float("nan")}, "measurement_age_s = nan must"),
        ({"measurement_age_s": "old"}, 'measurement_age_s = "old" must be a number'),
        ({"measurement_age_s": True}, "measurement_age_s = True must be no truth value"),
        ({"measurement_age_s": None}, "measurement_age_s = .* must be a number"),
        ({"tilt_rad": 2.0}, r"tilt_rad = 2\.0 must lie in"),
        ({"speed_m_s": -1.0}, r"speed_m_s = -1\.0 must"),
        ({"tilt_rad": 0.2, "braking_m_s2": 9.0}, "braking_m_s2 = 9.0"),
        ({"fence_m": (0.0, 1.0)}, r"fence_m: has shape \(2,\); it must be \(4,\)"),
        ({"fence_m": (1.0, -1.0, -1.0, 1.0)}, r"fence_m: x_max_m = -1\.0 must be more than 1\.0"),
        ({"floor_m": 0.5}, r"ceiling_m = 0\.0 must be more than 0\.5 \(floor_m\)"),
        ({"ceiling_m": -1.0}, r"ceiling_m = -1\.0 must be more than 0"),
        ({"climb_m_s": 0.0}, r"climb_m_s = 0\.0 must lie in"),
        ({"descent_m_s": 20.0}, r"descent_m_s = 20\.0 must"),
        ({"ceiling_m": True}, "ceiling_m = True must be no truth value"),
        ({"height": "firm"}, 'height = "firm" must be "stock" or "feedforward" or "pid"'),
        ({"update_period_s": 0.0}, r"update_period_s = 0\.0 must lie in"),
        ({"update_period_s": "slow"}, 'update_period_s = "slow" must be a number'),
        ({"tilt_deg": 20.0}, 'option = "tilt_deg" must be "measurement_age_s" or "tilt_rad"'),
    ],
)
def test_a_wrong_option_is_refused_by_name(options: dict[str, Any], message: str) -> None:
    """With its value and what is allowed."""
    with pytest.raises(ArgumentError, match=message):
        Controller.from_vehicle("crazyflie", **options)


def test_sensors_without_figures_are_refused_by_name() -> None:
    """Of the vehicle; a name that no sensors have names those that there are."""
    with pytest.raises(
        InvalidSettingsError, match=r'sensors = "mambo" needs its figures, \[sensors\], in the file'
    ):
        Controller.from_vehicle("crazyflie", sensors="mambo")
    wrong: Any = "sonar"
    with pytest.raises(ArgumentError, match='sensors = "sonar" must be "true" or "mocap" or "flow-deck"'):
        Controller.from_vehicle("crazyflie", sensors=wrong)


def test_what_does_not_fit_together_is_refused() -> None:
    """An age with a 1-norm, a height without a drone, x and y where x, y, z are needed."""
    with pytest.raises(
        ArgumentError, match=r'measurement_age_s = 0\.0 has no use with controller\.method = "1-norm"'
    ):
        Controller.from_preset("mambo-1norm", measurement_age_s=0.0)
    limits: dict[str, Any] = {"floor_m": 1.0, "ceiling_m": 1.0, "climb_m_s": 1.0, "descent_m_s": 1.0}
    for name, value in limits.items():
        with pytest.raises(ArgumentError, match=rf"{name} = 1\.0 has no use without \[height\]"):
            Controller.from_preset("crazyflie", **{name: value})
    with pytest.raises(ArgumentError, match="height = 'pid' must have a vehicle beside it"):
        Controller.from_preset("crazyflie", height="pid")
    with pytest.raises(ArgumentError, match=r"vehicle = 3 must be the path of a vehicle\.toml, or one of c"):
        Controller.from_vehicle(3)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match=r"attitude_thrust needs settings with \[height\]"):
        Controller.from_preset("crazyflie").step(aloft(), goal()).attitude_thrust("NED")
    with pytest.raises(ArgumentError, match=r'height = "pid" must be left out: the settings have \[height\]'):
        Controller.from_vehicle("crazyflie", height="pid")
    pilot = stock("pid")
    level = TargetState([0.0, 0.0], [0.0, 0.0])
    with pytest.raises(ArgumentError, match="target: position_m has no z; the height wants x, y, z"):
        pilot.step(aloft(), level)
    with pytest.raises(ArgumentError, match=r"thrust_acceleration_m_s2 = 9\.0 must be left out"):
        pilot.step(aloft(), goal(), 9.0)
    outcome = pilot.step(aloft(), goal())
    with pytest.raises(ArgumentError, match="mass_kg = -1 must lie in"):
        outcome.attitude_thrust("NED", mass_kg=-1)
    with pytest.raises(ArgumentError, match=r"mass_kg = 0\.03 must be left out"):
        outcome.attitude_thrust("NED", mass_kg=0.03, most_thrust_m_s2=16.0)


@pytest.mark.parametrize("name", ["crazyflie", "mambo-1norm"])
def test_the_shape_that_goes_in_comes_out(name: str) -> None:
    """Each drone of a batch has the bits that it has alone, also in fixed point."""
    settings = with_option(presets.load(name), "code.scalar", "fixed")
    for each in (presets.load(name), settings):
        position, velocity = RNG.normal(0.0, 0.3, (2, 3, 2, 2))
        attitude = RNG.normal(0.0, 0.1, (3, 2, 3))
        together, alone = Controller(each, 6), [Controller(each) for _ in range(6)]
        for _ in range(2):
            batch = together.step(
                DroneState(position, velocity, attitude), TargetState(-position, 0 * velocity)
            )
            assert batch.command_rad.shape == (3, 2, 2)
            assert batch.status.shape == (3, 2)
            for index, one in zip(np.ndindex(3, 2), alone, strict=True):
                single = one.step(
                    DroneState(position[index], velocity[index], attitude[index]),
                    TargetState(-position[index], [0.0, 0.0]),
                )
                assert single.command_rad.shape == (2,)
                assert (single.command_rad == batch.command_rad[index]).all()
    flat = TargetState(np.zeros((6, 2)), np.zeros((6, 2)))
    with pytest.raises(ArgumentError, match=r"target: has a batch of shape \(6,\); that of the state"):
        together.step(DroneState(position, velocity, attitude), flat)


@pytest.mark.parametrize(
    "made",
    [lambda n: stock("pid", n), lambda n: Controller.from_vehicle("crazyflie", n)],
    ids=["loop", "axis"],
)
def test_some_of_n_are_reset(made: Callable[[int], Controller]) -> None:
    """The others, and their heights and headings, go on as before."""
    state, target = aloft(4, z_m=-0.9), goal(4, yaw_rad=1.0)
    swarm = made(4)
    first = swarm.step(state, target)
    other = copy.deepcopy(swarm)
    which = np.array([True, False, False, True])
    assert (swarm.reset((0.1, 0.0), which) == 0).all()
    after, going_on = swarm.step(state, target), other.step(state, target)
    for name in ("command_rad", "thrust_m_s2", "yaw_rad"):
        here, there = getattr(after, name), getattr(going_on, name)
        assert (here[~which] == there[~which]).all()
        assert (here[which] != there[which]).any()
    assert first.thrust_m_s2 is not None
    assert after.thrust_m_s2 is not None
    assert (after.thrust_m_s2[which] == first.thrust_m_s2[which]).all()
    for wrong in ([0, 1], [True, False], [0, 1, 1, 0]):
        with pytest.raises(ArgumentError, match=r"which = .* must be 4 truth values"):
            swarm.reset(which=wrong)


@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", ["crazyflie", "mambo-1norm", "[height]"])
def test_a_saved_controller_goes_on_as_the_first(name: str) -> None:
    """Pickled and copied, with what the altitude loop remembers; other C is refused."""
    if name == "[height]":
        first, other_c = (Controller.from_vehicle("crazyflie", n) for n in (2, 1))
    else:
        first = Controller.from_preset(name, 2, vehicle="crazyflie", height="pid")
        other_c = Controller.from_preset(name)
    state, target = aloft(2, z_m=-0.8), goal(2, yaw_rad=2.0)
    for _ in range(3):
        first.step(state, target)
    saved = pickle.dumps(first)
    for other in (copy.deepcopy(first), pickle.loads(saved)):
        expected = copy.deepcopy(first).step(state, target)
        got = other.step(state, target)
        for field in ("command_rad", "thrust_m_s2", "yaw_rad"):
            assert (getattr(got, field) == getattr(expected, field)).all()
    with pytest.raises(ArgumentError, match="was saved by another version"):
        other_c.__setstate__({**first.__getstate__(), "generator": "another"})


@pytest.mark.parametrize("made", [lambda: stock("stock"), lambda: Controller.from_vehicle("crazyflie")])
def test_the_heading_turns_by_the_shorter_way_at_a_bounded_rate(made: Callable[[], Controller]) -> None:
    """From the measured one, across the south, by `nmpc_slew_heading`; without a target it stays."""
    pilot = made()
    state, most_rad = aloft(yaw_rad=3.0), set_points.HEADING_RATE_RAD_S * pilot.update_period_s
    expected = np.array([3.0])
    for _ in range(20):
        expected = slew_heading(method_of(pilot.settings), expected, [-3.0], [most_rad])
        assert pilot.step(state, goal(yaw_rad=-3.0)).yaw_rad == expected[0]
    np.testing.assert_allclose(expected, 2.0 * np.pi - 3.0, atol=1e-6)
    pilot.reset()
    assert [pilot.step(state, goal()).yaw_rad for _ in range(2)] == [3.0, 3.0]


def test_the_heading_starts_at_the_first_one_in_range() -> None:
    """Not at what is no number, or out of range, whatever the target."""
    pilot = Controller.from_vehicle("crazyflie", 3)
    state = DroneState(
        [[0.0, 0.0, -1.0]] * 3, np.zeros((3, 3)), [[0, 0, np.nan], [0, 0, 2000.0], [0, 0, 0.5]]
    )
    first = pilot.step(state, goal(3, yaw_rad=0.6)).yaw_rad
    assert first is not None
    assert np.isnan(first[:2]).all()
    then = pilot.step(aloft(3, yaw_rad=0.6), goal(3)).yaw_rad
    assert then is not None
    assert (then == [0.6, 0.6, first[2]]).all()


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("made", "atol"),
    [(lambda: stock("stock"), 1e-6), (lambda: Controller.from_vehicle("crazyflie"), RECIPROCAL_M_S2)],
)
@pytest.mark.parametrize("frame", FRAMES)
def test_one_call_gives_an_attitude_and_a_thrust_in_any_frame(
    frame: FrameName, made: Callable[[], Controller], atol: float
) -> None:
    """A hover is level with the weight as thrust; below the target it is more."""
    up = -1.0 if frame == "NED" else 1.0
    pilot = made()
    state = DroneState.in_frame(frame, [0.0, 0.0, up], [0.0, 0.0, 0.0], [0.0, 0.0, 0.5])
    target = TargetState.in_frame(frame, [0.0, 0.0, up], [0.0, 0.0, 0.0], yaw_rad=0.5)
    hover = [0.0, 0.0, 0.5, GRAVITY_M_S2]
    np.testing.assert_allclose(pilot.step(state, target).attitude_thrust(frame), hover, atol=atol)
    higher = TargetState.in_frame(frame, [0.0, 0.0, 1.1 * up], [0.0, 0.0, 0.0])
    outcome = pilot.step(state, higher)
    over_mass = outcome.attitude_thrust(frame)[3]
    assert over_mass > GRAVITY_M_S2
    assert outcome.attitude_thrust(frame, mass_kg=0.03)[3] == over_mass * 0.03
    assert outcome.attitude_thrust(frame, most_thrust_m_s2=16.0)[3] == over_mass / 16.0
    assert outcome.attitude_thrust(frame, most_thrust_m_s2=9.0)[3] == 1.0


def test_no_number_leaves_thrust_and_heading_as_they_are() -> None:
    """As the C keeps its command."""
    pilot = stock("pid")
    before = pilot.step(aloft(z_m=-0.9), goal(yaw_rad=0.0))
    lost = DroneState([np.nan] * 3, [np.nan] * 3, [np.nan] * 3)
    after = pilot.step(lost, goal())
    assert after.status != 0
    assert (after.thrust_m_s2, after.yaw_rad) == (before.thrust_m_s2, before.yaw_rad)


def test_a_wrong_mass_leaves_no_error_of_height_with_pid() -> None:
    """On a point mass of 1.2 times the weight, which the stock loop lets sag, with a warning that says so."""
    left = {}
    names: tuple[tuple[AltitudeName, AbstractContextManager[object]], ...] = (
        ("stock", pytest.warns(UserWarning, match="131 mm below its target: it has 20 % less thrust")),
        ("pid", nullcontext()),
    )
    for name, said in names:
        pilot = stock(name)
        z, climb = 1.0, 0.0
        with said:
            for _ in range(700):
                state = DroneState.in_frame("NWU", [0.0, 0.0, z], [0.0, 0.0, climb], [0.0, 0.0, 0.0])
                thrust = pilot.step(
                    state, TargetState.in_frame("NWU", [0.0, 0.0, 1.0], [0.0] * 3)
                ).thrust_m_s2
                climb += 0.01 * (float(thrust or 0.0) / 1.2 - GRAVITY_M_S2)
                z += 0.01 * climb
        left[name] = abs(z - 1.0)
    assert left["stock"] > 0.1
    assert left["pid"] < 0.01


@pytest.mark.parametrize("name", CURVE_NAMES)
def test_velocity_and_acceleration_of_a_curve_are_its_derivatives(name: CurveName) -> None:
    """In every frame, by central differences, away from jumps."""
    flown: Trajectory = curve(name, 1.5, 0.7)
    times_s, step_s = np.array([2.3, 4.1, 7.9]), 1e-5
    for frame in FRAMES:
        before, now, after = (sample(flown, times_s + shift, frame) for shift in (-step_s, 0.0, step_s))
        assert isinstance(now, CurvePoint)
        for rate, of in ((1, 0), (2, 1)):
            np.testing.assert_allclose(now[rate], (after[of] - before[of]) / (2.0 * step_s), atol=1e-5)
    east = sample(flown, 2.3, "ENU", height_m=1.1).position_m
    north = sample(flown, 2.3, "NED", height_m=1.1).position_m
    assert (east == north[[1, 0, 2]] * [1.0, 1.0, -1.0]).all()
    with pytest.raises(ArgumentError, match='name = "8" must be "bernoulli"'):
        curve("8")  # type: ignore[arg-type]


def test_curves_fly() -> None:
    """Those of the module are those of `fly`."""
    controller = Controller.from_preset("crazyflie")
    vehicle = Vehicle.from_preset("crazyflie")
    named = fly(controller, vehicle, "circle", size_m=1.0, rate_rad_s=1.0, duration_s=1.0)
    assert named.trace.same_bits(fly(controller, vehicle, curve("circle", 1.0, 1.0), duration_s=1.0).trace)
