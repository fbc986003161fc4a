"""The sub-blocks of the 1-norm, and those of both methods, compute the bits of the reference."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_codegen.methods.one_norm import cost
from mambo_codegen.methods.one_norm.arithmetic import OneNormArithmetic
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.methods.one_norm.predictor import Predictor
from mambo_codegen.methods.shared.tracker import Tracker, unknown_motion
from mambo_codegen.numbers.representation import COMMAND, STATE, TARGET, THRUST, YAW_LIMIT_RAD
from mambo_codegen.numbers.trigonometry import SINE_ERRORS
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.cases import CORNER_HORIZONS, SCALARS, settings_case
from tests.support.extension import build_extension

FEW_SETTINGS = [
    pytest.param(index, marks=[] if index in {2, 5} else pytest.mark.long)
    for index in range(len(CORNER_HORIZONS) + 1)
]


def bits(values: Any) -> bytes:
    """Return the bits of an array or of a cffi array copied into one."""
    return np.ascontiguousarray(values).tobytes()


class SubBlocks:
    """The C of one set of settings, sub-block by sub-block."""

    def __init__(self, settings: Settings) -> None:
        extension = build_extension(settings)
        self.method = OneNorm(settings)
        self.products = OneNormArithmetic(self.method)
        self.numbers = self.products.numbers
        self.scalar = self.numbers.scalar
        self.ffi, self.lib = extension.ffi, extension.lib

    def reals(self, count: int) -> tuple[NDArray[Any], Any]:
        """Make an array of `count` numbers and the pointer to it."""
        array = np.zeros(count, self.scalar)
        return array, self.pointer("nmpc_real_t", array)

    def computed(self, array: NDArray[Any]) -> NDArray[Any]:
        """Return numbers in the type that the reference computes with."""
        return array.astype(self.numbers.computed)

    def pointer(self, kind: str, array: NDArray[Any]) -> Any:
        """Point at `array`."""
        return self.ffi.cast(f"{kind} *", self.ffi.from_buffer(array))

    def unpack(self, array: Any) -> NDArray[Any]:
        """Copy an array out of C."""
        return np.array(list(array), self.scalar)


@pytest.mark.parametrize("scalar", SCALARS)
def test_sine_and_cosine_equal_the_reference_and_keep_their_error(scalar: str) -> None:
    """Over the whole range of yaw: same bits in C and Python, and the stated absolute error."""
    blocks = SubBlocks(settings_case(0, scalar))
    corners = np.arange(-651, 652) * (np.pi / 4)
    given = np.concatenate(
        [
            corners,
            np.random.default_rng(0).uniform(-1, 1, 20_000) * YAW_LIMIT_RAD,
            [0.0, -0.0, 1024.0, -1024.0],
        ]
    )
    angles = blocks.numbers.quantize(given[:, None], ("yaw",))[:, 0]
    sine, cosine = blocks.products.sine_cosine(blocks.computed(angles))
    (c_sine, sine_pointer), (c_cosine, cosine_pointer) = blocks.reals(1), blocks.reals(1)
    for angle, expected_sine, expected_cosine in zip(angles, sine, cosine, strict=True):
        blocks.lib.sine_cosine(angle, sine_pointer, cosine_pointer)
        assert bits(c_sine) == bits(expected_sine.astype(blocks.scalar))
        assert bits(c_cosine) == bits(expected_cosine.astype(blocks.scalar))

    exact = blocks.numbers.to_si(angles, "yaw").astype(np.longdouble)
    sine, cosine = (blocks.numbers.to_si(values, "sine") for values in (sine, cosine))
    assert float(np.max(np.abs(sine - np.sin(exact)))) < SINE_ERRORS[scalar]
    assert float(np.max(np.abs(cosine - np.cos(exact)))) < SINE_ERRORS[scalar]


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("index", FEW_SETTINGS)
def test_predictor_and_cost_equal_the_reference(index: int, scalar: str) -> None:
    """Gains, the initial roll-outs, predicted errors, cost and its gradient have the same bits."""
    settings = settings_case(index, scalar)
    blocks = SubBlocks(settings)
    ffi, lib = blocks.ffi, blocks.lib
    moves_count = 2 * settings.horizon.control
    predictor = Predictor(blocks.method, blocks.products)
    limits, quantize, computed = blocks.method.limits, blocks.numbers.quantize, blocks.computed
    rng = np.random.default_rng(index)
    controller = ffi.new("nmpc_t *")
    prediction = ffi.addressof(controller, "prediction")

    for draw in range(50):
        state = quantize(rng.normal(0, 1, (1, 7)) * [1, 1, 1, 1, 0.3, 0.3, 10], STATE)
        target = quantize(rng.normal(0, 1, (1, 4)), TARGET)
        thrust = quantize(rng.uniform(5, 15, (1, 1)), THRUST)[0]
        reach = min(0.3, settings.limits.tilt_rad)
        last = quantize(rng.uniform(-reach, reach, (1, 2)), COMMAND)
        moves = quantize(rng.uniform(-reach, reach, (1, moves_count // 2, 2)), COMMAND)
        moves[0, 0, int(rng.integers(2))] = last[0, 0]
        acceleration = quantize_acceleration(blocks, rng)
        weights = (
            rng.uniform(0, 0.5, (1, 2)) * np.minimum(limits.weights, limits.weights.dtype.type(2**30))
        ).astype(blocks.scalar)
        if draw == 0:  # a move that does not change has no effort, also of the weight -0
            weights = np.array([[0.0, -0.0]]).astype(blocks.scalar)

        given = [computed(values) for values in (state, target, thrust)]
        expected = predictor.prepare(
            given[0], given[1], given[2], None if acceleration is None else computed(acceleration)
        )
        if acceleration is not None:
            controller.tracker.acceleration_m_step2 = acceleration[0].tolist()
        lib.predictor_prepare(
            controller,
            blocks.pointer("nmpc_state_t", state),
            blocks.pointer("nmpc_target_t", target),
            thrust[0],
        )
        gains = [blocks.unpack(prediction.gain_x_m_step2_rad), blocks.unpack(prediction.gain_y_m_step2_rad)]
        members = ("error_m", "displacement_m_step", "acceleration_m_step2")
        starts = [[getattr(axis, name) for axis in (prediction.x, prediction.y)] for name in members]
        assert bits(gains) == bits(expected.gain_m_step2_rad[0].astype(blocks.scalar))
        assert bits(np.array(starts, blocks.scalar)) == bits(
            np.concatenate([getattr(expected, name) for name in members]).astype(blocks.scalar)
        )

        x, y = ffi.new("nmpc_rollout_t *", prediction.x), ffi.new("nmpc_rollout_t *", prediction.y)
        for i, errors in enumerate(predictor.errors(expected, computed(moves))):
            if i < settings.horizon.control:
                lib.predictor_apply_moves(prediction, blocks.pointer("nmpc_real_t", moves), i, x, y)
            for rollout in (x, y):
                lib.predictor_step(rollout)
            assert bits(np.array([x.error_m, y.error_m], blocks.scalar)) == bits(
                errors[0].astype(blocks.scalar)
            )

        controller.weights = blocks.pointer("nmpc_weights_t", weights)[0]
        controller.command_rad = last[0].tolist()
        controller.plan_rad = moves.ravel().tolist()
        c_cost = lib.cost_evaluate(controller)
        expected_cost, expected_gradient = cost.evaluate(
            predictor, expected, *map(computed, (weights, moves, last))
        )
        assert bits(blocks.numbers.wide(c_cost)) == bits(expected_cost)
        assert bits(np.array(ffi.unpack(controller.gradient, moves_count), blocks.numbers.wide)) == bits(
            expected_gradient
        )


def quantize_acceleration(blocks: SubBlocks, rng: np.random.Generator) -> NDArray[Any] | None:
    """Draw a target's acceleration (1, 2) within the tracker's limit; None without a tracker."""
    tracker = blocks.method.tracker
    if tracker is None:
        return None
    drawn = rng.uniform(-1, 1, (1, 2)) * tracker.acceleration_limit_m_step2
    return blocks.numbers.quantize(drawn, ("acceleration",) * 2)


@pytest.mark.first_is_quick
@pytest.mark.sampled(6)
@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("index", FEW_SETTINGS)
def test_tracker_equals_the_reference(index: int, scalar: str) -> None:
    """Velocity, acceleration and jerk have the same bits, in ramps, at the jerk's limit and over jumps."""
    tracked = with_option(settings_case(index, scalar), "target.acceleration", "tracked")
    blocks = SubBlocks(with_option(tracked, "horizon.update_period_s", 0.01))
    controller, constants = blocks.ffi.new("nmpc_t *"), blocks.method.tracker
    assert constants is not None
    tracker, rng = Tracker(constants, blocks.products), np.random.default_rng(index)
    motion = unknown_motion(blocks.computed(np.zeros((1, 2))))
    blocks.lib.tracker_clear(controller)
    jerk_limit = blocks.numbers.constant(constants.jerk_limit_m_step2_update, "acceleration")
    bound = blocks.numbers.constant(constants.acceleration_bound_m_step2, "acceleration")
    largest_jerk = 0
    velocity = np.zeros((1, 2))
    for step in range(400):
        if step % 10 == 0:  # the same acceleration for ten steps, to and fro; one in ten is beyond the limit
            change = constants.change_limit_m_s * rng.uniform(0.55, 1.05, (1, 2)) * (-1) ** (step // 10)
        velocity = velocity + change
        told = blocks.numbers.quantize(velocity, ("velocity",) * 2)
        motion = tracker.update(motion, blocks.computed(told))
        blocks.lib.tracker_update(controller, blocks.pointer("nmpc_real_t", told))
        for name in ("velocity_m_s", "acceleration_m_step2", "jerk_m_step2_update"):
            found = blocks.unpack(getattr(controller.tracker, name))
            assert bits(found) == bits(getattr(motion, name)[0].astype(blocks.scalar)), (step, name)
        assert np.abs(motion.acceleration_m_step2).max() <= bound
        largest_jerk = max(largest_jerk, np.abs(motion.jerk_m_step2_update).max())
    assert largest_jerk == jerk_limit
