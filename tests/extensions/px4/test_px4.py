"""Flight mode MPC on the desk: the module of `generate --for px4`, compiled unchanged, flies."""

import math
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.settings.controller_toml import to_toml, with_option
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import sine_cosine
from mambo_sil.drone.plant.rigid_body import to_world
from mambo_sil.flight.trajectories import Bernoulli, Circle, Hover
from tests.extensions.px4.support import HOLD, LAND, MPC, POSITION, px4_settings, status_ulog
from tests.extensions.px4.support.px4_desk import Px4Desk, build_px4
from tests.support.command import run

SEEDS = range(3)
LITTLE_WIND = with_option(px4_settings(), "observer.disturbance_limit_m_s2", 1.0)


@pytest.fixture(scope="module")
def module() -> Path:
    """Return the library of the module with the settings that `design crazyflie` writes."""
    return build_px4(px4_settings())


@pytest.fixture(scope="module")
def in_little_wind() -> Path:
    """Return the library of a module that learns no more than 1 m/s^2."""
    return build_px4(LITTLE_WIND)


def follow(desk: Px4Desk, curve: Bernoulli | Circle | Hover, duration_s: float) -> FloatArray:
    """Send a curve 100 times a second; return the distances to it (n,) in the plane."""
    desk.set("px4.trajectory", 1)
    distances = []
    for k in range(round(100.0 * duration_s)):
        place = [*curve.target(0.01 * k), *curve.acceleration(0.01 * k)]
        motion = np.column_stack([np.reshape(place, (3, 2)), [1.0, 0.0, 0.0]])
        distances.append(math.hypot(*(desk.state.position_m[:2] - motion[0, :2])))
        desk.full_state(motion)
        desk.run(10)
    return np.array(distances)


def test_the_mode_is_there_in_the_air_and_takes_position_control(module: Path) -> None:
    """PX4 refuses it on the floor, and flies only the attitude in it."""
    desk = Px4Desk(module)
    assert (desk["can_run"], desk["attitude_only"], desk["position_controlled"]) == (1.0, 1.0, 0.0)
    desk.land(2.0)
    desk.run(4000)
    assert (desk["landed"], desk["can_run"], desk["s.refusal"]) == (1.0, 0.0, 4.0)
    assert desk.select(MPC)["mode"] == POSITION
    assert desk.console == ""
    desk.stop()
    desk.select(POSITION, 3000).select(MPC, 500)
    assert (desk["mode"], desk["can_run"], desk["s.active"]) == (MPC, 0.0, 0.0)
    assert desk.console == "GCS: MPC not available: take off in another mode\n"


@pytest.mark.parametrize(
    ("name", "value", "reason"), [("invalid", 1.0, 2.0), ("hover", 0.7, 3.0)], ids=["estimate", "hover"]
)
def test_a_mode_that_cannot_fly_is_refused_and_offered_again(
    name: str, value: float, reason: float, module: Path
) -> None:
    """An estimate that is not valid; less thrust than the settings count on: the ground station says so."""
    desk = Px4Desk(module)
    before = {"invalid": 0.0, "hover": desk["throttle"]}[name]
    desk.set(f"px4.{name}", value)
    desk.run(700)
    assert (desk.select(MPC)["mode"], desk["s.refusal"]) == (POSITION, reason)
    words = {2.0: "estimate not valid", 3.0: "less thrust than in the settings"}[reason]
    assert desk.console == f"GCS: MPC not available: {words}\n"
    desk.set(f"px4.{name}", before)
    desk.select(POSITION, 700)
    assert desk.select(MPC)["mode"] == MPC


def test_a_refusal_that_comes_and_goes_is_said_once(module: Path) -> None:
    """As at a take-off, where the estimate is valid, not, and valid again; ten seconds later it is news."""
    desk = Px4Desk(module)
    for invalid in (1.0, 0.0, 1.0, 0.0):
        desk.set("px4.invalid", invalid)
        desk.run(300)
    assert desk.console == "GCS: MPC not available: estimate not valid\n"
    desk.run(10000)
    desk.set("px4.invalid", 1.0)
    desk.run(300)
    assert desk.console.count("GCS: MPC not available: estimate not valid\n") == 2


def test_a_build_with_other_bits_is_refused() -> None:
    """The self-test sees a product that a compiler rounds otherwise."""
    desk = Px4Desk(build_px4(px4_settings(), ("#define NMPC_HALF 0.5f", "#define NMPC_HALF 0.50001f")))
    assert "self-test: step" in desk.console
    assert (desk["can_run"], desk["s.refusal"]) == (0.0, 1.0)


@pytest.mark.parametrize(("wind_m_s", "most_deg"), [(0.0, 0.3), (4.0, 0.5), (6.0, 0.7)])
def test_the_pilot_may_switch_twenty_times(wind_m_s: float, most_deg: float, module: Path) -> None:
    """Without a bump of 0.7 degrees, in wind too, against which the drone leans by up to 9 degrees."""
    for seed in SEEDS:
        desk = Px4Desk(module, seed, wind_m_s=(wind_m_s, 0.0))
        for count in range(20):
            before, place = desk.angles_deg, desk.state.position_m
            assert desk.select(MPC)["s.take_overs"] == count + 1
            assert np.abs(desk.angles_deg - before).max() < most_deg
            desk.run(800)
            assert np.abs(desk.state.position_m - place).max() < 0.1
            desk.select(HOLD, 2000)


@pytest.mark.parametrize(("rates", "goes_on_deg"), [(0.0, 0.0), (1.0, 5.0)], ids=["attitude", "rates"])
def test_the_mode_goes_on_from_what_px4_flies(rates: float, goes_on_deg: float, module: Path) -> None:
    """From its attitude set-point, which the drone lags; from the drone, after a mode that sends none."""
    for seed in SEEDS:
        desk = Px4Desk(module, seed)
        desk.set("px4.rates", rates)
        desk.set("px4.roll_error", math.radians(5.0))
        desk.run(200)
        before = desk.angles_deg
        desk.select(MPC)
        start_deg = np.degrees([desk["s.start_roll"], desk["s.start_pitch"]])
        assert start_deg - before == pytest.approx([goes_on_deg, 0.0], abs=0.6)


@pytest.mark.parametrize(
    ("stick", "axis", "sign"),
    [("pitch", 0, 1.0), ("roll", 1, -1.0), ("throttle", 2, 1.0)],
    ids=["ahead", "right", "up"],
)
def test_a_stick_moves_the_drone_and_centred_stops_it(
    stick: str, axis: int, sign: float, module: Path
) -> None:
    """Half a stick past its dead zone is half of the speed; the desk's y is to the left."""
    desk = Px4Desk(module).select(MPC, 500)
    desk.set("px4.sticks", 1)
    desk.set(f"px4.{stick}", 0.55)
    desk.run(3000)
    speed = 1.0 if stick == "throttle" else 2.5
    velocity = sign * desk.state.velocity_m_s
    assert velocity[axis] == pytest.approx(speed, rel=0.15)
    assert np.abs(np.delete(velocity, axis)).max() < 0.1
    desk.set(f"px4.{stick}", 0.0)
    desk.run(4000)
    assert np.abs(desk.state.velocity_m_s).max() < 0.05


def test_the_thrust_points_where_it_shall_while_the_heading_lags(module: Path) -> None:
    """Roll and pitch are of the measured heading, but those of a set-point of the heading that it wants."""
    desk = Px4Desk(module).select(MPC, 500)
    desk.set("px4.sticks", 1)
    desk.set("px4.pitch", 1.0)
    desk.run(500)
    desk.set("px4.yaw", 1.0)
    desk.run(300)
    sent = [desk[name] for name in ("roll", "pitch", "yaw")]
    wanted = [desk[name] for name in ("s.command_roll", "s.command_pitch", "s.yaw")]
    assert abs(sent[2] - wanted[2]) > 0.05
    assert np.abs(wanted[:2]).max() > 0.05
    np.testing.assert_allclose(thrust_direction(sent), thrust_direction(wanted), atol=1e-5)


def thrust_direction(attitude_rad: list[float]) -> FloatArray:
    """Return where the thrust points (3,) at roll, pitch, yaw."""
    return to_world(*sine_cosine(np.array(attitude_rad)), np.array([0.0, 0.0, -1.0]))


def test_sticks_are_of_the_heading_which_they_turn(module: Path) -> None:
    """To the right by the yaw stick, clockwise seen from above; then ahead is there."""
    desk = Px4Desk(module).select(MPC, 500)
    desk.set("px4.sticks", 1)
    desk.set("px4.yaw", 1.0)
    desk.run(1047)
    desk.set("px4.yaw", 0.0)
    desk.run(1500)
    assert desk.state.angles_rad[2] == pytest.approx(-math.pi / 2.0, abs=0.1)
    desk.set("px4.pitch", 0.3)
    desk.run(3000)
    assert desk.state.velocity_m_s[1] < -0.8
    assert abs(desk.state.velocity_m_s[0]) < 0.2
    desk.set("px4.sticks", 0)
    desk.run(4000)
    assert np.abs(desk.state.velocity_m_s).max() < 0.05


def test_a_stick_down_lands(module: Path) -> None:
    """On the floor the motors stop, and PX4 finds that the drone has landed."""
    desk = Px4Desk(module).select(MPC, 500)
    desk.set("px4.sticks", 1)
    desk.set("px4.throttle", -0.5)
    desk.run(6000)
    assert (desk["landed"], desk["throttle"], desk["mode"]) == (1.0, 0.0, MPC)
    assert desk.state.touch_m_s < 1.0


CURVES: dict[str, tuple[Bernoulli | Circle, int, float]] = {
    "eight .5": (Bernoulli(2.0, 0.5), 10, 0.01),
    "circle 1.5": (Circle(1.0, 1.5), 8, 0.03),
    "eight 1": (Bernoulli(2.0, 1.0), 16, 0.07),  # at its tips it asks for more than the tilt limit gives
}
"""Curve, period of the estimates in ms, largest RMS distance in m."""


@pytest.mark.parametrize("title", CURVES)
def test_a_trajectory_is_followed_whenever_estimates_come(title: str, module: Path) -> None:
    """There is a step for each update period, also between estimates."""
    curve, estimate_ms, most_m = CURVES[title]
    for seed in SEEDS:
        desk = Px4Desk(module, seed)
        desk.set("px4.estimate_ms", estimate_ms)
        desk.select(MPC, 500)
        before = desk["s.step"]
        distances = follow(desk, curve, 15.0)
        assert desk["s.step"] - before == pytest.approx(1500, abs=2)
        assert np.sqrt(np.mean(distances[500:] ** 2)) < most_m


def test_a_silent_trajectory_gives_way_to_the_sticks(module: Path) -> None:
    """The target brakes where the last set-point left it."""
    desk = Px4Desk(module).select(MPC, 500)
    follow(desk, Circle(1.0, 1.0), 3.0)
    desk.set("px4.trajectory", 0)
    desk.yield_()
    desk.run(4000)
    assert desk["mode"] == MPC
    assert np.abs(desk.state.velocity_m_s).max() < 0.05


def bump_deg(desk: Px4Desk, milliseconds: int) -> float:
    """Return how far the attitude set-point goes from where it is within a time, in degrees."""
    before = desk.angles_deg
    found: list[float] = []
    for _ in range(milliseconds):
        desk.run(1)
        found.append(float(np.abs(desk.angles_deg - before).max()))
    return max(found)


JUMPS = {
    "position": {"jump_x": 0.2, "jump_y": -0.2, "jump_z": -0.2},
    "velocity": {"jump_vx": 0.3, "jump_vy": 0.2, "jump_vz": 0.1},
    "heading": {"jump_heading": 0.3},
}


def jump(desk: Px4Desk, kind: str, sign: float = 1.0) -> None:
    """Let the estimator jump."""
    for name, value in JUMPS[kind].items():
        desk.set(f"px4.{name}", sign * value)


@pytest.mark.parametrize(
    ("kind", "within_ms", "most_deg"), [("position", 100, 1.0), ("velocity", 12, 2.0), ("heading", 100, 1.0)]
)
def test_a_jump_of_the_estimator_moves_target_and_controller(
    kind: str, within_ms: int, most_deg: float, module: Path
) -> None:
    """An estimate that was wrong becomes right: the attitude does not jump with it; then the drone stops.

    A target whose velocity has jumped brakes: the controller follows its jerk from the first step on.
    """
    for seed in SEEDS:
        desk = Px4Desk(module, seed, wind_m_s=(2.0, 1.0))
        jump(desk, kind, -1.0)
        desk.select(MPC, 3000)
        usual = bump_deg(desk, within_ms)
        jump(desk, kind)
        assert bump_deg(desk, within_ms) < usual + most_deg
        desk.run(4000)
        assert desk["mode"] == MPC
        assert np.abs(desk.state.velocity_m_s).max() < 0.05


@pytest.mark.parametrize("turn_rad", [0.8, -0.8])
def test_a_jump_of_the_heading_turns_the_lean_of_a_take_over(turn_rad: float, module: Path) -> None:
    """20 ms after it, in wind of 6 m/s: what was learnt in the mode before is in the frame of then."""
    desk = Px4Desk(module, wind_m_s=(6.0, 0.0)).select(MPC, 20)
    before_deg, changes_deg = desk.angles_deg.copy(), []
    desk.set("px4.jump_heading", turn_rad)
    for _ in range(100):
        desk.run(1)
        changes_deg.append(np.abs(desk.angles_deg - before_deg).max())
    assert max(changes_deg) < 4.0


def test_a_drone_glides_to_a_trajectory_whose_frame_has_jumped(module: Path) -> None:
    """The set-points are of the new frame: the drone is there after some seconds, without a jump."""
    for seed in SEEDS:
        desk = Px4Desk(module, seed).select(MPC, 500)
        follow(desk, Hover(), 3.0)
        desk.set("px4.jump_x", 0.2)
        assert bump_deg(desk, 150) < 2.0
        assert follow(desk, Hover(), 10.0)[-1] < 0.01


FAULTS = {
    "silent": ("silent", 1.0, 200, "estimate is old"),
    "invalid": ("invalid", 1.0, 100, "estimate not valid"),
    "refused": ("jump_x", 5000.0, 700, "inputs refused"),
    "tilted": ("roll_error", 1.1, 100, "tilted too far"),
    "late": ("slow_ms", 3.0, 100, "steps took too long"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_gives_the_drone_back_to_hold_and_is_said_once(fault: str, module: Path) -> None:
    """An estimate that stops or is not valid, refused inputs, 0.2 rad too much tilt, late steps."""
    name, value, within_ms, words = FAULTS[fault]
    for seed in SEEDS:
        desk = Px4Desk(module, seed).select(MPC, 1000)
        desk.set(f"px4.{name}", value)
        desk.run(within_ms)
        assert desk["mode"] == HOLD
        desk.set("px4.slow_ms", 0.0)
        desk.run(1000)
        assert [line for line in desk.console.splitlines() if line] == [f"GCS: MPC: {words}, hold"]
        assert desk["commands"] == 1.0


@pytest.mark.parametrize(
    ("wind_m_s", "is_pushed"), [((0.0, 3.0), False), ((0.0, -8.0), True), ((8.0, 1.0), True)]
)
def test_a_drone_in_more_wind_than_it_learns_is_given_back(
    wind_m_s: tuple[float, float], is_pushed: bool, in_little_wind: Path
) -> None:
    """After 2 s of a disturbance at its limit, 1 m/s^2, which 4 m/s give; to the ground station too."""
    desk = Px4Desk(in_little_wind, wind_m_s=wind_m_s).select(MPC, 2000)
    assert desk["mode"] == MPC
    desk.run(4000)
    assert desk["mode"] == (HOLD if is_pushed else MPC)
    assert desk["s.given_back"] == (10.0 if is_pushed else 0.0)
    assert ("GCS: MPC: pushed away by more wind than in the settings, hold" in desk.console) == is_pushed


def test_a_drone_without_a_global_position_is_given_back_to_position_mode(module: Path) -> None:
    """PX4 refuses hold indoors; in the meantime it hears that the mode cannot run."""
    desk = Px4Desk(module).select(MPC, 1000)
    desk.set("px4.sticks", 1)
    desk.set("px4.indoors", 1.0)
    desk.set("px4.roll_error", 1.1)
    desk.run(150)
    assert desk["mode"] == MPC
    desk.run(250)
    assert (desk["mode"], desk["commands"]) == (POSITION, 2.0)
    assert desk.console.count("tilted too far") == 1


def test_a_drone_that_was_given_back_stays_so_until_the_pilot_selects_another_mode(module: Path) -> None:
    """PX4 goes back to a selected mode as soon as it can run: it cannot, although the cause has gone."""
    desk = Px4Desk(module).select(MPC, 1000)
    desk.set("px4.indoors", 1.0)
    desk.set("px4.invalid", 1.0)
    desk.run(350)
    assert desk["mode"] == LAND
    desk.set("px4.invalid", 0.0)
    desk.run(1000)
    assert desk["mode"] == LAND
    assert (desk["s.take_overs"], desk["s.refusal"], desk["can_run"]) == (1.0, 9.0, 0.0)
    desk.select(POSITION, 700).select(MPC, 100)
    assert (desk["mode"], desk["s.take_overs"]) == (MPC, 2.0)


def test_parameters_hold_each_by_itself(module: Path) -> None:
    """A slower speed, a wall; a bad one sets its bit, and the others count."""
    desk = Px4Desk(module).select(MPC, 500)
    desk.set("px4.SPEED", 0.5)
    desk.set("px4.TILT", -1.0)
    desk.set("px4.X_MAX", 1.0)
    desk.set("px4.sticks", 1)
    desk.set("px4.pitch", 1.0)
    fastest = farthest = 0.0
    for _ in range(800):
        desk.run(10)
        fastest = max(fastest, float(desk.state.velocity_m_s[0]))
        farthest = max(farthest, float(desk.state.position_m[0]))
    assert desk["s.bad_limits"] == 4.0
    assert fastest < 0.6
    assert farthest < 1.001
    assert int(desk["s.limits"]) & 4


def test_a_parameter_of_0_is_none(module: Path) -> None:
    """Each limit is then that of the settings, as with PX4's own parameters; nothing moves."""
    desk = Px4Desk(module).select(MPC, 500)
    for name in ("SPEED", "BRAKE", "TILT", "CLIMB", "DESCENT", "X_MIN", "X_MAX", "Z_MIN", "Z_MAX"):
        desk.set(f"px4.{name}", 0.0)
    desk.run(3000)
    assert desk["s.bad_limits"] == desk["s.limits"] == 0.0
    assert np.abs(desk.state.position_m - [0.0, 0.0, 1.0]).max() < 0.05
    desk.set("px4.sticks", 1)
    desk.set("px4.pitch", 1.0)
    desk.run(3000)
    assert desk.state.velocity_m_s[0] > 3.0


def test_a_module_that_stops_takes_its_mode_away_and_nothing_else(module: Path) -> None:
    """PX4 is told, and its attitude controller still hears the set-points of PX4's other modes."""
    desk = Px4Desk(module).select(MPC, 500).select(POSITION, 500)
    desk.set("px4.stop", 1.0)
    desk.run(100)
    assert desk["left"] == 1.0
    heard = desk["heard"]
    desk.run(100)
    assert desk["heard"] - heard == 100.0


def test_a_module_whose_mode_flies_does_not_stop(module: Path) -> None:
    """The console says what to do first."""
    desk = Px4Desk(module).select(MPC, 500)
    desk.set("px4.stop", 1.0)
    before = desk["s.step"]
    desk.run(1000)
    assert "not stopped: mode MPC flies; select another mode first" in desk.console
    assert (desk["left"], desk["mode"], desk["s.step"] - before) == (0.0, MPC, 100.0)


HOVERS = (0.1, 0.125, 0.155, 0.3, 0.5)
"""Throttles of hover; PX4's MPC_THR_MIN is 0.12."""


@pytest.mark.parametrize("hover", HOVERS)
def test_no_thrust_is_cut_in_the_air_however_strong_the_drone(hover: float, module: Path) -> None:
    """PX4 finds ground contact where a strong drone hovers in the air; on the floor it still lands."""
    desk = Px4Desk(module)
    desk.be_strong(hover)
    desk.select(MPC, 500)
    desk.set("px4.sticks", 1)
    contacts = 0.0
    for k in range(2000):
        desk.set("px4.throttle", 0.6 if k % 200 < 100 else -0.9 if k % 400 < 200 else -0.5)
        desk.run(10)
        contacts += desk["contact"]
        assert desk["throttle"] > 0.25 * hover
        assert (desk["s.grounded"], desk["s.level"]) == (0.0, 0.0)
    assert (contacts > 0.0) == (hover < 0.2)
    desk.set("px4.throttle", -0.7)
    desk.run(20000)
    assert (desk["landed"], desk["throttle"], desk["mode"]) == (1.0, 0.0, MPC)


@pytest.mark.usefixtures("in_an_empty_folder")
def test_a_log_of_the_mode_is_repeated_bit_for_bit() -> None:
    """With two take-overs, sticks, jumps of the estimator, set-points and a landing."""
    settings = px4_settings()
    desk = Px4Desk(build_px4(settings), wind_m_s=(2.0, -1.0)).select(MPC, 0)
    rows: list[dict[str, float]] = []

    def fly(milliseconds: int) -> None:
        for _ in range(milliseconds):
            before = desk["s.step"]
            desk.run(1)
            if desk["s.step"] != before:
                rows.append(desk.status())

    fly(1000)
    desk.set("px4.sticks", 1)
    desk.set("px4.pitch", 0.7)
    fly(700)
    for kind in JUMPS:
        jump(desk, kind)
        fly(300)
    desk.select(POSITION, 300).select(MPC, 0)
    desk.set("px4.pitch", 0.0)
    fly(1500)
    desk.set("px4.trajectory", 1)
    for acceleration_m_s2 in (0.5, math.nan):
        for k in range(100):
            motion = np.zeros((3, 3))
            motion[:, 0] = desk.state.position_m[0] + 0.005 * k, 0.5, acceleration_m_s2
            motion[0, 1:] = desk.state.position_m[1:]
            desk.full_state(motion)
            fly(10)
    desk.set("px4.trajectory", 0)
    fly(1500)
    desk.set("px4.throttle", -0.6)
    fly(4000)
    Path("flight.ulg").write_bytes(status_ulog(rows, desk.fields))
    Path("controller.toml").write_text(to_toml(settings), "utf-8")
    printed = run("replay", "flight.ulg", "controller.toml")[0]
    assert f"all {len(rows)} commands of the log are those of this controller, bit for bit" in printed
