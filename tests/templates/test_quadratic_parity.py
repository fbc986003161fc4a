"""The sub-blocks of a quadratic cost compute the bits of the reference."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.attitude import AttitudeModel, AttitudeState
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_codegen.methods.quadratic.observer import Estimate, KalmanObserver
from mambo_codegen.methods.quadratic.optimizer import QuadraticOptimizer
from mambo_codegen.settings.model import Settings
from tests.support.extension import build_extension
from tests.support.quadratic import CORNER_SETTINGS, quadratic_case

SCALARS = ("float32", "float64")
FEW_SETTINGS = range(len(CORNER_SETTINGS) + 2)
CASES = 300


class SubBlocks:
    """The C of one set of settings beside the reference's sub-blocks."""

    def __init__(self, settings: Settings, seed: int) -> None:
        extension = build_extension(settings)
        self.ffi, self.lib = extension.ffi, extension.lib
        self.method = Quadratic(settings)
        self.products = QuadraticArithmetic(self.method)
        self.numbers = self.products.numbers
        self.scalar = self.numbers.scalar
        self.controller = self.ffi.new("nmpc_t *")
        self._rng = np.random.default_rng(seed)

    def draw(self, limit: float, count: int = 2) -> NDArray[Any]:
        """Draw numbers (1, count) of very different sizes: within the limit, at it, 0, or 1.5 times of it."""
        rng = self._rng
        sizes = rng.choice([1.0, 1.0, 0.1, 1e-3, 0.0, 1.5], (1, count))
        drawn = np.where(rng.random((1, count)) < 0.15, np.sign(sizes - 0.5), rng.uniform(-1, 1, (1, count)))
        values: NDArray[Any] = (limit * sizes * drawn).astype(self.scalar)
        return values

    def put(self, block: str, **members: NDArray[Any]) -> None:
        """Set members (1, 2) or (1,) of a part of the controller."""
        for name, values in members.items():
            numbers = values.ravel().tolist()
            setattr(getattr(self.controller, block), name, numbers if len(numbers) > 1 else numbers[0])

    def get(self, block: str, name: str) -> bytes:
        """Return the bits of a member of a part of the controller."""
        member = getattr(getattr(self.controller, block), name)
        values = [member] if isinstance(member, float) else list(member)
        return np.array(values, self.scalar).tobytes()

    def part(self, block: str) -> Any:
        """Point at a part of the controller."""
        return self.ffi.addressof(self.controller, block)

    def pointer(self, kind: str, values: NDArray[Any]) -> Any:
        """Point at numbers, which the caller keeps."""
        return self.ffi.cast(f"{kind} *", self.ffi.from_buffer(values))

    def reals(self, values: NDArray[Any]) -> Any:
        """Point at numbers."""
        return self.pointer("nmpc_real_t", values)


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("index", FEW_SETTINGS)
def test_observer_equals_the_reference(index: int, scalar: str) -> None:
    """Start, correction, prediction and disturbance have the same bits, up to and beyond every limit."""
    blocks = SubBlocks(quadratic_case(index, scalar), index)
    lib, observer = blocks.lib, KalmanObserver(blocks.method, blocks.products)
    its_observer = blocks.part("observer")
    constants, ranges = blocks.method.observer, blocks.method.settings.ranges
    limits = {
        "position_m": ranges.position_m,
        "velocity_m_step": constants.velocity_limit_m_step,
        "disturbance_m_step2": constants.disturbance_limit_m_step2,
    }
    at_limit: set[str] = set()

    def compare(estimate: Estimate) -> None:
        for name, limit in limits.items():
            assert blocks.get("observer", name) == getattr(estimate, name).tobytes(), name
            at_limit.update(
                {name} if np.abs(getattr(estimate, name)).max() == blocks.scalar(limit) else set()
            )

    for case in range(CASES):
        estimate = Estimate(**{name: blocks.draw(limit) for name, limit in limits.items()})
        position, velocity = blocks.draw(ranges.position_m), blocks.draw(ranges.velocity_m_s)
        state = np.concatenate([position, velocity, blocks.draw(1.0, 3)], axis=1)
        tilt = blocks.draw(blocks.method.attitude.limit_m_step2)
        measured, accelerated = blocks.pointer("nmpc_state_t", state), blocks.reals(tilt)

        blocks.put("observer", **vars(estimate))
        found = np.array([lib.observer_disturbance(its_observer, axis) for axis in (0, 1)], blocks.scalar)
        assert found.tobytes() == observer.disturbance(estimate).tobytes()
        is_coarse = blocks.method.guard is not None and bool(case % 2)
        lib.observer_correct(its_observer, measured, int(is_coarse), accelerated)
        compare(corrected := observer.correct(estimate, state, tilt, np.array([is_coarse])))
        lib.observer_predict(its_observer, accelerated)
        compare(observer.predict(corrected, tilt))
        lib.observer_start(its_observer, measured)
        compare(observer.start(corrected, state))
    assert at_limit >= set(limits)
    lib.observer_clear(its_observer)
    compare(Estimate(*[np.zeros((1, 2), blocks.scalar)] * 3))


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("index", FEW_SETTINGS)
def test_attitude_model_equals_the_reference(index: int, scalar: str) -> None:
    """Its step, its turns, measurement, commands and reset have the same bits, up to and beyond its limit."""
    blocks = SubBlocks(quadratic_case(index, scalar), index)
    lib, model = blocks.lib, AttitudeModel(blocks.method, blocks.products)
    its_model = blocks.part("attitude")
    limit, tilt_rad = blocks.method.attitude.limit_m_step2, blocks.method.settings.limits.tilt_rad
    rng = np.random.default_rng(index)
    members = {"tilt": "tilt", "integral": "integral", "lagged": "lagged", "command": "command"}
    names = {name: f"{member}_m_step2" for name, member in members.items()} | {
        "sine": "sine",
        "cosine": "cosine",
    }

    def compare(attitude: AttitudeState) -> None:
        for name, member in names.items():
            assert blocks.get("attitude", member) == getattr(attitude, name).tobytes(), name

    lib.attitude_reset(its_model, 0, 0)
    compare(model.steady(np.zeros((1, 2), blocks.scalar)))
    for _ in range(CASES):
        yaws = blocks.scalar(
            [rng.uniform(-1024, 1024), rng.choice([0.0, np.pi / 2, -np.pi, 1024.0, -1024.0])]
        )
        sine, cosine = blocks.products.sine_cosine(yaws)
        drawn = {name: blocks.draw(limit) for name in members}
        attitude = AttitudeState(**drawn, sine=sine[:1], cosine=cosine[:1])
        blocks.put("attitude", **{member: getattr(attitude, name) for name, member in names.items()})
        lib.attitude_advance(its_model)
        compare(attitude := model.advance(attitude))
        followed = rng.random(1) < 0.5
        lib.attitude_turn(its_model, sine[1], cosine[1], int(followed[0]))
        compare(attitude := model.turn(attitude, sine[1:], cosine[1:], followed))
        right, forward = attitude.command[0].tolist()
        found = np.array([[lib.attitude_roll(right), lib.attitude_pitch(forward)]], blocks.scalar)
        assert found.tobytes() == model.command_rad(attitude.command).tobytes()

        angles = blocks.draw(tilt_rad)
        state = np.concatenate([blocks.draw(1.0, 4), angles, blocks.draw(1.0, 1)], axis=1)
        measured = np.zeros((1, 2), blocks.scalar)
        lib.attitude_measure(blocks.pointer("nmpc_state_t", state), blocks.reals(measured))
        assert measured.tobytes() == model.measure(angles).tobytes()
        lib.attitude_change_command(its_model, *angles[0].tolist())
        compare(attitude := model.change_command(attitude, np.zeros_like(angles), angles))
        lib.attitude_set_command(its_model, *angles[0].tolist())
        compare(model.set_command(attitude, angles))
        lib.attitude_reset(its_model, *angles[0].tolist())
        compare(model.steady(angles))


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", SCALARS)
@pytest.mark.parametrize("index", FEW_SETTINGS)
def test_optimizer_equals_the_reference(index: int, scalar: str) -> None:
    """The move has the same bits on both axes, with none, one or both of the moves at their limits."""
    blocks = SubBlocks(quadratic_case(index, scalar), index)
    attitude, law = blocks.method.attitude, blocks.method.law
    limits = attitude.command_limit_m_step2.astype(blocks.scalar)
    optimizer = QuadraticOptimizer(blocks.method, blocks.products, limits)
    rng = np.random.default_rng(index)
    n, kinds = 4 * CASES, set()
    move = 10.0 ** rng.uniform(-2, 1.5, (n, 1, 1)) * limits[None, :, None]
    states = rng.normal(0, 1, (n, *law.rows.shape[::2])) * move / (np.abs(law.rows).max(axis=1) + 1e-30)[None]
    states *= rng.choice([0.0, 1.0, 1.0], states.shape)
    states[:, :, 7] = np.clip(states[:, :, 7], -limits, limits)
    states = states.astype(blocks.scalar)
    expected = optimizer.minimize(states)
    for state, moves in zip(states, expected, strict=True):
        for axis in (0, 1):
            numbers = np.ascontiguousarray(state[axis])
            found = blocks.lib.optimizer_minimize(axis, blocks.reals(numbers), limits[axis])
            assert blocks.scalar(found).tobytes() == moves[axis].tobytes()
            free = law.rows[axis] @ state[axis]
            kinds.add(tuple((np.sign(free) * (np.abs(free) > limits[axis])).tolist()))
    assert len(kinds) == 3**law.moves
