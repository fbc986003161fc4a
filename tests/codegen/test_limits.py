"""Limits of speed, braking and place: their law, their numbers, and what the settings refuse."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.methods.shared.limits import ActiveLimit, LimitsLaw
from mambo_codegen.methods.shared.limits_arithmetic import ROOT_ERROR, LimitsArithmetic
from mambo_codegen.methods.shared.limits_constants import LATER_LIMITS, NEAR_SHARE
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.limits_section import Limits
from mambo_codegen.settings.model import Settings
from tests.support.cases import SCALARS
from tests.support.quadratic import told

FENCE = {"x_min_m": -2.0, "x_max_m": 2.0, "y_min_m": -1.5, "y_max_m": 1.5}
BASES = ("mambo", "mambo-1norm")


def limited(base: str = "mambo", scalar: str = "float64", **limits: Any) -> Settings:
    """Return a preset of a scalar type with these limits; by default a speed of 2 and a braking of 2."""
    settings = with_option(presets.preset(base), "code.scalar", scalar)
    for name, value in ({"speed_m_s": 2.0, "braking_m_s2": 2.0} | limits).items():
        settings = with_option(settings, f"limits.{name}", value)
    return settings


def law(settings: Settings) -> tuple[LimitsLaw, Any]:
    """Return the limits of a controller with `settings`, and their bounds for one controller."""
    method = method_of(settings)
    assert method.limiting is not None
    limits = LimitsLaw(method, method.limiting)
    return limits, limits.bounds(limits.defaults)


def desired(settings: Settings, position: Any, target: Any) -> tuple[Any, Any]:
    """Return desired velocities (n, 2), m/s, and which limits act (n,): position (n, 2), target (n, 4)."""
    method = method_of(settings)
    limits, bounds = law(settings)
    n = len(position)
    many = replace(bounds, **{name: np.repeat(value, n, axis=0) for name, value in vars(bounds).items()})
    inputs = (
        method.numbers.quantize(values, names).astype(method.numbers.computed)
        for values, names in ((position, ("position",) * 2), (target, ("position",) * 2 + ("velocity",) * 2))
    )
    velocity, active = limits._desire(many, many.speed_m_s, *inputs)
    return method.numbers.to_si(velocity, "velocity"), active


def random_flights(seed: int, n: int = 4000) -> tuple[Any, Any]:
    """Draw positions (n, 2) and targets (n, 4), near and far, in and outside of a fence of 2 m."""
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.uniform(-2, 2, (n, 1))
    position = rng.normal(0, 1.5, (n, 2))
    return position, np.column_stack(
        [position + (scale * rng.normal(0, 1, (n, 2))), rng.normal(0, 1.5, (n, 2))]
    )


@pytest.mark.parametrize("scalar", SCALARS)
def test_an_inverse_square_root_keeps_to_its_error(scalar: str) -> None:
    """Over all magnitudes that occur, the relative error stays below ROOT_ERROR."""
    method = method_of(limited(scalar=scalar))
    assert method.limiting is not None
    arithmetic = LimitsArithmetic(method, method.limiting)
    rng = np.random.default_rng(1)
    if scalar == "fixed":
        squares = np.floor(2.0 ** rng.uniform(0, 62, 200_000)).astype(np.int64)
        squares = np.concatenate([squares, [1, 2, 3, 4, 2**62, 2**62 - 1, 2**32, 2**32 - 1]])
        root = arithmetic.inverse_root(squares)
        found = np.ldexp(root.mantissa.astype(np.float64), -(30 + root.half))
    else:
        squares = (10.0 ** rng.uniform(-9, 12, 200_000)).astype(method.numbers.scalar)
        found = arithmetic.inverse_root(squares).astype(np.longdouble)
    exact = 1 / np.sqrt(squares.astype(np.longdouble))
    assert np.max(np.abs((found / exact) - 1)) < ROOT_ERROR[scalar]


@pytest.mark.long
def test_an_inverse_square_root_keeps_to_its_error_for_every_float32() -> None:
    """Every number from 1 to 4; times a power of 4, from 1e-30 to 1e30, the result is scaled exactly."""
    method = method_of(limited(scalar="float32"))
    assert method.limiting is not None
    arithmetic = LimitsArithmetic(method, method.limiting)
    first, last = np.array([1.0, 4.0], np.float32).view(np.uint32)
    for start in range(int(first), int(last), 1 << 21):
        numbers = np.arange(start, min(start + (1 << 21), int(last)), dtype=np.uint32).view(np.float32)
        found = arithmetic.inverse_root(numbers)
        assert np.max(np.abs((found * np.sqrt(numbers.astype(np.float64))) - 1)) < ROOT_ERROR["float32"]
        for power in (-50, -7, 3, 50):
            scaled = arithmetic.inverse_root(np.ldexp(numbers[::64], 2 * power))
            assert np.array_equal(scaled, np.ldexp(found[::64], -power))


@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("base", BASES)
def test_no_desired_velocity_exceeds_a_limit(base: str, scalar: str) -> None:
    """Its size is at most the speed limit, and towards a wall at most what the braking takes away in time."""
    settings = limited(base, scalar, fence=FENCE)
    position, target = random_flights(2)
    velocity, active = desired(settings, position, target)
    limit_active = active != 0
    assert 0.5 < np.mean(limit_active) < 1
    slack = 1e-5 if scalar != "float64" else 1e-12
    assert np.max(np.hypot(*velocity[limit_active].T)) <= 2.0 * (1 + slack)
    for axis, wall in ((0, 2.0), (1, 1.5)):
        for sign in (1, -1):
            room = wall - (sign * position[:, axis])
            towards = sign * velocity[:, axis]
            inside = limit_active & (room > 0)
            assert np.all(towards[inside] <= np.sqrt(2 * 2.0 * room[inside]) + (10 * slack) + 1e-5)
            assert np.all(towards[limit_active & (room < -1e-3)] < 0), "outside it leads back in"


def test_the_law_is_that_of_the_page() -> None:
    """In float64 it equals the formulas, with roots and norms, where drone and target are inside."""
    settings = limited(fence=FENCE)
    method = method_of(settings)
    assert method.limiting is not None
    k, position, target = method.limiting.approach_1_s, *random_flights(3)
    walls = np.array([2.0, 1.5])
    position, target[:, 0:2] = np.clip(position, -walls, walls), np.clip(target[:, 0:2], -walls, walls)
    velocity, active = desired(settings, position, target)

    def f(d: Any) -> Any:
        return np.where(d <= 2.0 / k**2, k * d, np.sqrt(np.maximum(2 * 2.0 * (d - (2.0 / (2 * k**2))), 0)))

    error = target[:, 0:2] - position
    distance = np.maximum(np.hypot(*error.T), 1e-12)[:, None]
    knee = 2.0 / k**2
    slow = np.all(np.abs(target[:, 2:4]) < 1.0 / k, axis=1)[:, None]
    near = np.where(slow, NEAR_SHARE * knee, knee)
    speed = np.where(distance > near, f(distance + knee - near), k * distance)
    expected = target[:, 2:4] + (speed * error / distance)
    clear = np.all(f(walls - np.abs(position)) >= 2.0, axis=1)[:, None]
    expected = np.where(clear, expected, np.clip(expected, -f(walls + position), f(walls - position)))
    size = np.maximum(np.hypot(*expected.T)[:, None], 1e-12)
    expected = np.where(size > 2.0, expected * 2.0 / size, expected)
    limit_active = active != 0
    assert velocity[limit_active] == pytest.approx(expected[limit_active], abs=1e-9)
    untouched = target[:, 2:4] + (k * error)
    assert expected[~limit_active] == pytest.approx(untouched[~limit_active], abs=1e-9), (
        "where no limit acts none would change it"
    )


@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("base", BASES)
def test_flights_within_the_limits_keep_every_bit(base: str, scalar: str) -> None:
    """A controller with limits answers as one without while no limit acts."""
    rng = np.random.default_rng(4)
    plain = with_option(presets.preset(base), "code.scalar", scalar)
    wide = limited(base, scalar, speed_m_s=20.0, fence={"x_min_m": -900.0, "x_max_m": 900.0})
    ours, theirs = (method_of(settings).reference_controller(20) for settings in (wide, plain))
    target = np.column_stack([rng.normal(0, 5, (20, 2)), np.zeros((20, 2))])
    aimed = target if plain.controller.method == "1-norm" else told(target)
    for _ in range(40):
        state = np.column_stack([target + rng.normal(0, 0.15, (20, 4)), rng.normal(0, 0.1, (20, 3))])
        steps = [one.step(state, aimed, np.full(20, 9.8)) for one in (ours, theirs)]
        assert not ours.memory.limits.active.any()
        assert steps[0].command_rad.tobytes() == steps[1].command_rad.tobytes()


def turning(rate_rad_s: float, step: int, n: int = 1) -> Any:
    """Return a target (n, 4) on a circle of 1 m, in control step `step`."""
    phase = 0.01 * rate_rad_s * step
    x, y = np.cos(phase), np.sin(phase)
    return np.tile([x, y, -rate_rad_s * y, rate_rad_s * x], (n, 1))


def turning_controller(scalar: str) -> Any:
    """Return a controller with the 1-norm and a speed limit of 5 m/s, whose search is short."""
    settings = with_option(limited("mambo-1norm", scalar, speed_m_s=5.0), "optimizer.iterations", 1)
    return method_of(settings).reference_controller(1)


def allowed_m_s(controller: Any, target: Any) -> float:
    """Return the largest speed with which the next step would follow a target (1, 4), m/s."""
    method, law_of = method_of(controller.settings), controller._limits
    numbers = method.numbers.quantize(target[:, 2:4], ("velocity",) * 2).astype(method.numbers.computed)
    fastest = law_of._turn_speed(controller.memory.limits, numbers)[1]
    return float(method.numbers.to_si(fastest, "velocity")[0])


@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize(("rate_rad_s", "expected_m_s"), [(1.7, 5.0), (2.2, 1.405), (-3.0, 1.030)])
def test_with_the_1norm_a_hard_turn_lowers_the_speed(
    scalar: str, rate_rad_s: float, expected_m_s: float
) -> None:
    """To A_T over the rate, A_T = 0.9 g 0.35 rad; a target that the tilt can turn changes nothing."""
    controller: Any = turning_controller(scalar)
    for step in range(120):
        controller.step(np.zeros((1, 7)), turning(rate_rad_s, step), [9.81])
    assert allowed_m_s(controller, turning(rate_rad_s, 120)) == pytest.approx(expected_m_s, rel=2e-3)


@pytest.mark.parametrize("scalar", SCALARS)
def test_the_turn_ends_with_the_target_s_motion(scalar: str) -> None:
    """A target that stops, one that flies on straight ahead, and a reset: the speed limit is whole again."""
    for after in ("stop", "straight", "reset"):
        controller: Any = turning_controller(scalar)
        for step in range(120):
            controller.step(np.zeros((1, 7)), turning(3.0, step), [9.81])
        last = turning(3.0, 119)
        if after == "reset":
            assert controller.reset([[0.0, 0.0]]).tolist() == [Status.OK]
        for _ in range({"stop": 1, "straight": 20, "reset": 0}[after]):
            last[:, 2:4] *= after != "stop"
            controller.step(np.zeros((1, 7)), last, [9.81])
        assert allowed_m_s(controller, last) == pytest.approx(5.0, rel=1e-6)


def test_active_limits_are_named() -> None:
    """SPEED for a fast target, BRAKING near a still one, FENCE for a target outside."""
    settings = limited(fence={"x_min_m": -50.0, "x_max_m": 50.0})
    position = np.zeros((4, 2))
    target = np.array([[40.0, 0, 0, 0], [1.0, 0, 0, 0], [0.1, 0, 0, 0], [70.0, 0, 0, 0]])
    _, active = desired(settings, position, target)
    assert active.tolist() == [
        ActiveLimit.SPEED,
        ActiveLimit.BRAKING,
        0,
        ActiveLimit.SPEED | ActiveLimit.FENCE,
    ]


def test_a_tilt_limit_that_can_hardly_brake_has_no_limits() -> None:
    """The braking that follows from it could not be set; one that is given may be as small."""
    tilted = {"tilt_rad": 0.0127, "speed_m_s": 2.0}
    with pytest.raises(ValidationError, match=r"tilt_rad\n  must give a deceleration of 0.125 m/s"):
        Settings.model_validate({"limits": tilted})
    assert Settings.model_validate({"limits": tilted | {"braking_m_s2": 0.11}}).limits.braking_m_s2 == 0.11


@pytest.mark.parametrize("base", BASES)
def test_bad_limits_change_nothing(base: str) -> None:
    """Limits that are not finite, out of range or against each other get BAD_LIMITS."""
    settings = limited(base)
    controller: Any = method_of(settings).reference_controller(8)
    good = np.array([2.0, 2.0, -1.0, -1.0, 1.0, 1.0, 0.35])
    bad = np.tile(good, (8, 1))
    for row, (index, value) in enumerate(
        [(0, np.nan), (0, 0.05), (0, 101.0), (1, 3.6), (2, 1.0), (3, -1001.0), (6, 0.36)]
    ):
        bad[row, index] = value
    before = controller.stored_limits.copy()
    assert controller.set_limits(bad).tolist() == [Status.BAD_LIMITS] * 7 + [Status.OK]
    after = controller.stored_limits
    assert np.array_equal(before[:7], after[:7])
    assert not np.array_equal(before[7], after[7])


def test_a_lower_tilt_limit_cuts_off_every_later_command() -> None:
    """Commands keep within the tilt limit that is set, in flight and on refused inputs."""
    settings = limited("mambo-1norm", "float32")
    controller: Any = method_of(settings).reference_controller(1)
    far = [[20.0, 20.0, 0, 0]]
    for _ in range(60):
        controller.step(np.zeros((1, 7)), far, [9.8])
    limits = np.array([[2.0, 0.9, -900, -900, 900, 900, 0.1]])
    assert controller.set_limits(limits).tolist() == [Status.OK]
    for state in (np.full((1, 7), np.nan), np.zeros((1, 7))):
        step = controller.step(state, far, [9.8])
        assert np.all(np.abs(step.command_rad) <= np.float32(0.1))


@pytest.mark.parametrize(
    ("limits", "fault"),
    [
        ({"speed_m_s": 101.0}, "limits.speed_m_s"),
        ({"braking_m_s2": 3.5}, "limits.braking_m_s2"),
        ({"fence": {"x_min_m": -1.0, "x_max_m": 1001.0}}, "limits.fence.x_max_m"),
        ({"fence": {"y_min_m": 1.0, "y_max_m": 1.0}}, "limits.fence.y_max_m"),
    ],
)
@pytest.mark.parametrize("base", BASES)
def test_settings_refuse_limits_that_cannot_be_kept(base: str, limits: dict[str, Any], fault: str) -> None:
    """A limit beyond a range, a braking that the tilt limit cannot give, walls the wrong way round."""
    document = presets.preset(base).model_dump()
    with pytest.raises(ValidationError) as caught:
        Settings.model_validate(document | {"limits": document["limits"] | limits})
    assert [".".join(map(str, one["loc"])) for one in caught.value.errors()] == [fault]


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("key", [key for key in Limits.model_fields if key != "fence"])
def test_a_limit_that_the_settings_admit_may_be_set(key: str, base: str) -> None:
    """The settings refuse what `nmpc_set_limits` would refuse: else the default limits could not be set."""
    values, admitted = np.geomspace(0.05, 2000.0, 25).tolist(), []
    for value in values:
        try:
            limiting = method_of(settings := limited(base, **{key: value})).limiting
        except InvalidSettingsError:
            continue
        assert limiting is not None
        reference: Any = method_of(settings).reference_controller(1)
        set_to = reference.set_limits([limiting.limits])
        assert set_to.tolist() == [Status.OK], value
        admitted.append(value)
    assert 0 < len(admitted) < len(values)


@pytest.mark.parametrize("base", [*BASES, "table1"])
def test_limits_that_are_not_set_have_no_trace_in_the_digest(base: str) -> None:
    """The digest is of the values that earlier versions had."""
    settings = presets.preset(base)
    for path in LATER_LIMITS:
        settings = with_option(settings, path, {} if path.endswith("fence") else 0.0)
    assert not any(
        "limits.fence" in path or "speed_m_s" in str(values) for path, values in settings.in_use.items()
    )


@pytest.mark.first_is_quick
def test_an_outage_ends_in_level_attitude() -> None:
    """After outage_s without a state the model brakes to rest, and then the command is level."""
    controller: Any = method_of(limited()).reference_controller(2)
    state = np.array([[0.0, 0, 2.0, 0, 0, 0, 0.3], [0.0, 0, 0, -1.5, 0, 0, 1.0]])
    target = np.zeros((2, 9))
    target[:, :2] = np.diag([5.0, -5.0])
    for _ in range(20):
        controller.step(state, target, np.full(2, 9.81))
    commands = [controller.step(np.full((2, 7), np.nan), target, np.full(2, 9.81)) for _ in range(600)]
    assert np.max(np.abs(commands[60].command_rad)) > 0.05, "it brakes"
    assert np.all(commands[-1].command_rad == 0)
    assert np.all(controller.memory.steps_blind == 52)


def test_braking_ends_nearer_where_the_acceleration_of_the_target_is_estimated() -> None:
    """By the tracker of the 1-norm or the target observer; without them at the knee."""
    shares = {
        name: method_of(settings).limiting.near_share  # type: ignore[union-attr]
        for name, settings in {
            "quadratic": limited(),
            "tracked": with_option(limited("mambo-1norm"), "target.acceleration", "tracked"),
            "none": with_option(limited("mambo-1norm"), "target.acceleration", "none"),
        }.items()
    }
    assert shares == {"quadratic": NEAR_SHARE, "tracked": NEAR_SHARE, "none": 1.0}


@pytest.mark.parametrize("period_s", [0.005, 0.01, 0.02])
def test_a_1_norm_with_limits_levels_after_half_a_second(period_s: float) -> None:
    """Without a good state."""
    settings = with_option(limited("mambo-1norm"), "horizon.update_period_s", period_s)
    assert (method_of(settings).outage_steps or 0) * period_s == pytest.approx(0.5)
