"""The thrust vector: the direction of the thrust by tilt, and the tilt that the thrust can afford."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.methods.quadratic.thrust_vector import ThrustVector
from mambo_codegen.methods.quadratic.thrust_vector_constants import LEAST_SHARE, LEAST_SPARE_M_S2
from mambo_codegen.methods.shared.limits import ActiveLimit
from mambo_codegen.numbers.reach import THRUST_LEFT
from mambo_codegen.numbers.trigonometry import ARC_TANGENT_ERROR
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.cases import SCALARS
from tests.support.height import height_case
from tests.support.height_settings import height_settings

STRONG = 7
"""The corner of the settings whose tilt limit is the largest, without trim."""
GAINS = np.array([0.8, 0.9])
"""Measured per commanded roll and pitch."""


def exact_settings(tilt_rad: float = 0.7, scalar: str = "float64") -> Settings:
    """Return the settings of a Crazyflie with the thrust vector."""
    settings = with_option(height_settings(scalar), "limits.tilt_rad", tilt_rad)
    return with_option(settings, "model.tilt", "exact")


def vector_of(scalar: str) -> tuple[Quadratic, ThrustVector]:
    """Return a method and its thrust vector."""
    settings = with_option(height_case(STRONG, scalar), "model.roll_gain", GAINS[0])
    method = Quadratic(with_option(settings, "model.pitch_gain", GAINS[1]))
    vector = method.reference_controller(1).parts.model.vector
    assert vector is not None
    return method, vector


def numbers(method: Quadratic, values: Any, quantity: str) -> NDArray[Any]:
    """Return values (n, 2) as numbers that the reference computes with."""
    return method.numbers.quantize(values, [quantity] * 2).astype(method.numbers.computed)


def si(method: Quadratic, found: NDArray[Any], quantity: str) -> NDArray[np.float64]:
    """Return numbers in SI units."""
    return method.numbers.to_si(found, quantity).astype(np.float64)


@pytest.mark.parametrize("scalar", SCALARS)
def test_slopes_are_those_of_a_rotated_thrust(scalar: str) -> None:
    """By the rotation of a vector: right, forward and vertical components, where the share is not limited."""
    method, vector = vector_of(scalar)
    tilts = np.random.default_rng(1).uniform(-1.2, 1.2, (5000, 2))
    body_up = np.array([0.0, 0.0, -1.0])
    forward, right, down = Rotation.from_euler("xy", tilts).apply(body_up).T
    near = -down > LEAST_SHARE + 1e-3
    share, slope = vector.of_measured(numbers(method, tilts, "angle"))
    np.testing.assert_allclose(si(method, share, "factor")[near], -down[near], atol=1e-6)
    expected = np.stack([right, forward], axis=1) / -down[:, np.newaxis]
    np.testing.assert_allclose(si(method, slope, "factor")[near], expected[near], rtol=2e-6, atol=6e-6)
    assert np.all(si(method, share, "factor")[~near] >= LEAST_SHARE - 1e-6)
    assert np.max(np.abs(si(method, slope, "factor"))) <= 1.01 / LEAST_SHARE


@pytest.mark.parametrize("scalar", SCALARS)
def test_commands_lead_back_to_the_accelerations_that_they_stand_for(scalar: str) -> None:
    """Angle by angle, up to the tilt limit of 1.2 rad along each axis and in the corners."""
    method, vector = vector_of(scalar)
    gain = method.attitude.gain_m_step2_rad
    slopes = np.random.default_rng(2).uniform(-2.5, 2.5, (5000, 2))
    wanted = numbers(method, gain * slopes, "acceleration")
    command = vector.command_rad(wanted)
    tilt = GAINS * si(method, command, "angle")
    forward, right, down = Rotation.from_euler("xy", tilt).apply([0.0, 0.0, -1.0]).T
    found = np.stack([right, forward], axis=1) / -down[:, np.newaxis]
    np.testing.assert_allclose(found, si(method, wanted, "acceleration") / gain, rtol=3e-6, atol=4e-6)


@pytest.mark.parametrize("scalar", SCALARS)
def test_the_arc_tangent_keeps_its_stated_error(scalar: str) -> None:
    """For every tangent of a fine grid, up to 4 either way; and the bound is tight."""
    method, vector = vector_of(scalar)
    grid = np.concatenate([np.linspace(-4, 4, 200_001), np.linspace(0.999, 1.001, 20_001)])
    slopes = numbers(method, grid.reshape(-1, 1).repeat(2, axis=1), "factor")[:, 0]
    errors = si(method, vector.arc_tangent(slopes), "angle") - np.arctan(si(method, slopes, "factor"))
    bits = method.numbers.bits
    rounding = 0.0 if bits is None else 2.0 ** -(bits["angle"] + 1)
    largest = np.max(np.abs(errors))
    assert 0.85 * ARC_TANGENT_ERROR[scalar] < largest <= ARC_TANGENT_ERROR[scalar] + rounding


def test_the_tilt_gets_what_the_thrust_leaves_beside_the_height() -> None:
    """The quarter circle of thrust and height, from within by at most 2 % of its radius, never nothing."""
    method = Quadratic(exact_settings())
    controller = method.reference_controller(200)
    height, step_s2 = controller.parts.height, method.step_s**2
    controller.step(np.zeros((200, 10)), np.zeros((200, 13)))
    vertical_m_s2 = np.linspace(0.0, 25.0, 200)
    state = controller.memory.height
    found = height.spare(state.__class__(**{**vars(state), "command": vertical_m_s2 * step_s2}))
    assert found is not None
    assert method.settings.height is not None
    radius = THRUST_LEFT * method.settings.height.thrust_max_m_s2
    spare = found / step_s2
    together = np.hypot(spare, vertical_m_s2) / radius
    free = spare > LEAST_SPARE_M_S2 + 1e-9
    assert np.all((together[free] <= 1 + 1e-9) & (together[free] >= 0.98))
    assert np.min(spare) == pytest.approx(LEAST_SPARE_M_S2)
    assert np.count_nonzero(free) > 50


@pytest.mark.parametrize("known", [0, 1, 2])
def test_a_known_acceleration_always_gets_a_tilt_of_its_own(known: int) -> None:
    """0.36 rad by the vertical part of the thrust, where the target's velocities alone get 1.7 m/s^2."""
    method = Quadratic(exact_settings())
    controller = method.reference_controller(200)
    height, step_s2 = controller.parts.height, method.step_s**2
    target = np.zeros((200, 13))
    target[:, -1] = known
    controller.step(np.zeros((200, 10)), target)
    vertical_m_s2 = np.linspace(0.0, 25.0, 200)
    state = controller.memory.height
    found = height.spare(state.__class__(**{**vars(state), "command": vertical_m_s2 * step_s2}))
    assert found is not None
    held = found[-60:] / step_s2
    if known:
        assert np.arctan(held / vertical_m_s2[-60:]) == pytest.approx(0.36, rel=1e-9)
    else:
        assert held == pytest.approx(LEAST_SPARE_M_S2)


def test_a_steep_climb_takes_tilt_away_and_says_so() -> None:
    """The same far target sideways: level the tilt limit acts, with a target high above the thrust does."""
    settings = exact_settings(1.0)
    tilts = []
    for above_m in (0.0, 5.0):
        controller = Quadratic(settings).reference_controller(1)
        state = np.zeros((1, 10))
        target = np.zeros((1, 13))
        target[0, [0, 6]] = 20.0, above_m
        for _ in range(30):
            step = controller.step(state, target)
        assert step.active_limits is not None
        tilts.append((np.max(np.abs(step.command_rad)), int(step.active_limits[0])))
    (level, _), (climbing, active) = tilts
    assert climbing < 0.6 * level
    assert active & ActiveLimit.THRUST


@pytest.mark.parametrize("scalar", SCALARS)
def test_a_move_is_as_long_in_every_direction_as_the_thrust_leaves(scalar: str) -> None:
    """A target far away and above, by 64 bearings and six headings: the length, within the rounding."""
    method = Quadratic(exact_settings(1.0, scalar))
    bearing, heading = np.linspace(0, 2 * np.pi, 65)[:-1], np.linspace(-3, 3, 6)
    angles = np.array([(one, other) for one in bearing for other in heading])
    controller = method.reference_controller(len(angles))
    state, target = np.zeros((len(angles), 10)), np.zeros((len(angles), 13))
    state[:, 6] = angles[:, 1]
    target[:, 0], target[:, 1] = 5 * np.cos(angles[:, 0]), 5 * np.sin(angles[:, 0])
    target[:, 6] = 5.0
    for _ in range(40):
        step = controller.step(state, target)
    assert step.active_limits is not None
    assert np.all(step.active_limits & ActiveLimit.THRUST)
    command = si(method, controller.memory.attitude.command, "acceleration")
    found = controller.parts.height.spare(controller.memory.height)
    assert found is not None
    left = si(method, found, "acceleration")
    bits = method.numbers.bits
    rounding = 0.0 if bits is None else 2.0 ** -bits["move"]
    np.testing.assert_allclose(np.hypot(*command.T), left, rtol=1e-6, atol=1.5 * rounding)


@pytest.mark.parametrize("scalar", SCALARS)
def test_a_short_move_stays_and_a_long_one_keeps_its_direction(scalar: str) -> None:
    """Drawn moves around a drawn length, against the vector of that length."""
    method = Quadratic(exact_settings(1.0, scalar))
    draw = np.random.default_rng(3)
    moves = numbers(method, draw.uniform(-0.05, 0.05, (5000, 2)), "move")
    lengths = numbers(method, draw.uniform(0.005, 0.06, (5000, 2)), "move")[:, 0]
    found, takes_much = method.reference_controller(1).parts.limits.shortened(moves, lengths)
    before, after, most = (si(method, one, "move") for one in (moves, found, lengths))
    size = np.hypot(*before.T)
    is_long = size >= most
    is_near = np.abs(size - 0.85 * most) < 1e-7
    np.testing.assert_array_equal(takes_much[~is_near], (size >= 0.85 * most)[~is_near])
    np.testing.assert_array_equal(found[~is_long], moves[~is_long])
    np.testing.assert_allclose(
        after[is_long], (before * (most / size)[:, None])[is_long], rtol=2e-6, atol=1e-7
    )
    assert np.all(np.abs(after) <= np.abs(before))


def test_small_angles_know_no_thrust_budget() -> None:
    """The bit is never set, and the digest of settings without the key is that of before."""
    settings = height_settings()
    assert settings.digest == with_option(settings, "model.tilt", "small-angle").digest
    assert settings.digest != with_option(settings, "model.tilt", "exact").digest
    assert Quadratic(settings).thrust_vector is None


@pytest.mark.parametrize(
    ("settings", "path", "value", "words"),
    [
        (
            exact_settings(0.9),
            "model.roll_gain",
            1.5,
            'limits.tilt_rad = 0.9 must be at most 0.8 with model.tilt = "exact"',
        ),
        (exact_settings(0.9), "model.pitch_gain", 1.6, "limits.tilt_rad = 0.9 must be at most 0.75 with"),
        (presets.preset("crazyflie"), "model.tilt", "exact", "has no effect without [height]"),
    ],
)
def test_what_it_cannot_be_is_refused(settings: Settings, path: str, value: object, words: str) -> None:
    """By key, rule and fix."""
    with pytest.raises(InvalidSettingsError) as refused:
        with_option(settings, path, value)
    assert words in str(refused.value)
