"""What a caller of the generated C may rely on, whatever the compiler, and whatever it passes in."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_codegen.methods import method_of
from mambo_codegen.methods.one_norm.controller import OneNormController
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import build_library, ffi
from tests.support import strict_builds
from tests.support.extension import build_extension
from tests.support.height_settings import height_settings
from tests.support.one_norm import ONE_NORM
from tests.support.quadratic import CORNER_SETTINGS, EVERYTHING, Array, quadratic_case
from tests.support.tools import toolchain

MAMBO = ONE_NORM
Controller = OneNormController | CompiledController
HOVER_STATE, HOVER_TARGET, HOVER_THRUST = np.zeros(7), np.array([0.5, -0.4, 0.0, 0.0]), 9.81


@cache
def built(settings: Settings) -> Any:
    """Build the C of `settings`, once for all tests."""
    return build_library(settings, toolchain("gcc"))


def controller(kind: str, n: int = 1) -> Controller:
    """Make a controller of preset mambo."""
    if kind == "reference":
        return OneNormController(OneNorm(MAMBO), n)
    return CompiledController(MAMBO, n, built(MAMBO))


def after_one_step(kind: str) -> tuple[Controller, NDArray[Any]]:
    """Make a controller that has given one good command, and that command."""
    used = controller(kind)
    step = used.step([HOVER_STATE], [HOVER_TARGET], [HOVER_THRUST])
    assert step.status[0] == Status.OK
    assert np.all(step.command_rad != 0)
    return used, step.command_rad


def bad_inputs() -> list[tuple[str, int, float, Status]]:
    """List every input by itself, not finite or out of its range, and the status it earns."""
    ranges = MAMBO.ranges
    bounds = {
        "state": [ranges.position_m] * 2 + [ranges.velocity_m_s] * 2 + [3.25, 3.25, 1024.0],
        "target": [ranges.position_m] * 2 + [ranges.velocity_m_s] * 2,
    }
    earned = {"state": Status.BAD_STATE, "target": Status.BAD_TARGET}
    cases = [
        (name, axis, value, earned[name])
        for name, limits in bounds.items()
        for axis, limit in enumerate(limits)
        for value in (np.nan, np.inf, -np.inf, 1.001 * limit, -1.001 * limit)
    ]
    thrusts = (np.nan, np.inf, -np.inf, 0.0, -9.81, 0.5, 51.0, 1e30)
    return cases + [("thrust", 0, value, Status.BAD_THRUST) for value in thrusts]


@pytest.mark.parametrize("kind", ["reference", "compiled"])
def test_bad_input_repeats_the_last_good_command_and_does_no_harm(kind: str) -> None:
    """A status for each bad value, the last good command, and the next good step as if nothing had been."""
    for name, axis, value, status in bad_inputs():
        used, last = after_one_step(kind)
        undisturbed, _ = after_one_step(kind)
        inputs = {
            "state": HOVER_STATE.copy(),
            "target": HOVER_TARGET.copy(),
            "thrust": np.array([HOVER_THRUST]),
        }
        inputs[name][axis] = value
        refused = used.step([inputs["state"]], [inputs["target"]], inputs["thrust"])
        assert refused.status[0] == status, (name, axis, value)
        assert refused.command_rad.tobytes() == last.tobytes()
        good = [HOVER_STATE], [HOVER_TARGET], [HOVER_THRUST]
        assert used.step(*good).command_rad.tobytes() == undisturbed.step(*good).command_rad.tobytes()


@pytest.mark.parametrize("kind", ["reference", "compiled"])
def test_before_the_first_good_step_the_command_is_level(kind: str) -> None:
    """A fresh controller answers bad input with zero angles."""
    step = controller(kind).step([HOVER_STATE * np.nan], [HOVER_TARGET], [HOVER_THRUST])
    assert step.status[0] == Status.BAD_STATE
    assert np.array_equal(step.command_rad, [[0, 0]])


@pytest.mark.parametrize("kind", ["reference", "compiled"])
def test_any_turn_of_yaw_is_flown(kind: str) -> None:
    """At +/-1000 rad the command is that of the same heading within one turn."""
    turns = 159
    for heading in (0.3, -0.3):
        states = np.tile(HOVER_STATE, (2, 1))
        states[:, 6] = heading, heading + np.sign(heading) * turns * 2 * np.pi
        step = controller(kind, 2).step(states, np.tile(HOVER_TARGET, (2, 1)), [HOVER_THRUST] * 2)
        assert np.array_equal(step.status, [Status.OK] * 2)
        assert np.allclose(step.command_rad[0], step.command_rad[1], atol=1e-6)


@pytest.mark.parametrize("kind", ["reference", "compiled"])
def test_reset_starts_from_the_given_command_within_the_limit(kind: str) -> None:
    """A takeover from another controller: the command is its, clamped; a bad one changes nothing."""
    used, last = after_one_step(kind)
    assert used.reset([[0.1, -0.9]])[0] == Status.OK
    held = used.step([HOVER_STATE * np.nan], [HOVER_TARGET], [HOVER_THRUST])
    assert np.allclose(held.command_rad, [[0.1, -MAMBO.limits.tilt_rad]])

    used, last = after_one_step(kind)
    for bad in ([np.nan, 0.0], [0.0, np.inf], [3.3, 0.0]):
        assert used.reset([bad])[0] == Status.BAD_COMMAND
        held = used.step([HOVER_STATE * np.nan], [HOVER_TARGET], [HOVER_THRUST])
        assert held.command_rad.tobytes() == last.tobytes()


@pytest.mark.parametrize("kind", ["reference", "compiled"])
def test_weights_change_the_cost_and_bad_ones_nothing(kind: str) -> None:
    """Doubled weights double the cost of the same step; negative, NaN or huge ones are refused."""

    def cost(weights: list[float] | None, status: Status) -> float:
        used = controller(kind)
        if weights is not None:
            assert used.set_weights([weights])[0] == status
        return float(used.step([HOVER_STATE], [HOVER_TARGET], [HOVER_THRUST]).cost[0])

    initial = cost(None, Status.OK)
    assert cost([4500.0, 2.0], Status.OK) == 2 * initial
    assert cost([0.0, 0.0], Status.OK) == 0
    assert cost([1e6, 1e6], Status.OK) > initial
    for bad in ([-1.0, 1.0], [2250.0, np.nan], [2e6, 1.0]):
        assert cost(bad, Status.BAD_WEIGHT) == initial


@pytest.mark.parametrize("chosen", [MAMBO, EVERYTHING], ids=["one_norm", "quadratic"])
def test_null_pointers_get_a_status_and_a_safe_command(chosen: Settings) -> None:
    """Each argument null by itself: a status, the last good command if there is room for one, no change."""
    extension, method = build_extension(chosen), method_of(chosen)
    ffi, lib, null = extension.ffi, extension.lib, extension.ffi.NULL
    self = ffi.new("nmpc_t *")
    state, target = ffi.new("nmpc_state_t *"), ffi.new("nmpc_target_t *", {"position_m": [0.5, 0.5]})
    command = ffi.new("nmpc_command_t *")
    other = ffi.new("nmpc_weights_t *") if method.weight_limits else command
    lib.nmpc_init(null)
    lib.nmpc_init(self)
    assert lib.nmpc_step(self, state, target, 9.81, command) == Status.OK
    last, before = (command.roll_rad, command.pitch_rad), bytes(ffi.buffer(self))
    for arguments in ((self, null, target), (self, state, null)):
        command.roll_rad = command.pitch_rad = 9.0
        assert lib.nmpc_step(*arguments, 9.81, command) == Status.NULL_POINTER
        assert (command.roll_rad, command.pitch_rad) == last
    command.roll_rad = command.pitch_rad = 9.0
    assert lib.nmpc_step(null, state, target, 9.81, command) == Status.NULL_POINTER
    assert (command.roll_rad, command.pitch_rad) == (0, 0)
    assert lib.nmpc_step(self, state, target, 9.81, null) == Status.NULL_POINTER
    for setter, argument in ((lib.nmpc_reset, command), (getattr(lib, f"nmpc_{method.setter}"), other)):
        assert setter(self, null) == setter(null, argument) == Status.NULL_POINTER
    assert bytes(ffi.buffer(self)) == before


TRACKED = presets.load("mambo-1norm")
HELD_ACCELERATION = np.array([0.0, 0.0, 0.01, -0.004])
"""What the target's velocity changes by in every step, within the limit of a jump."""


def tracking(kind: str, n: int = 1) -> Controller:
    """Make a controller of preset mambo-1norm."""
    if kind == "reference":
        return OneNormController(OneNorm(TRACKED), n)
    return CompiledController(TRACKED, n, built(TRACKED))


def followed(used: Controller, first: int, last: int, target: NDArray[Any] = HOVER_TARGET) -> NDArray[Any]:
    """Step with a target that accelerates, in steps `first` to `last` - 1, and return the last cost."""
    for step in range(first, last):
        outcome = used.step([HOVER_STATE], [target + step * HELD_ACCELERATION], [HOVER_THRUST])
        assert outcome.status[0] == Status.OK
    return outcome.cost


@pytest.mark.parametrize("kind", ["reference", "compiled"])
def test_a_refused_input_leaves_the_target_as_it_was(kind: str) -> None:
    """Bad state, target or thrust between two good steps: the next command is as without them."""
    used, undisturbed = tracking(kind), tracking(kind)
    for each in (used, undisturbed):
        followed(each, 0, 20)
    bad = np.full(7, np.nan), np.array([0.0, 0.0, 1e9, 0.0]), 0.0
    for state, target, thrust in (
        (bad[0], HOVER_TARGET, HOVER_THRUST),
        (HOVER_STATE, bad[1], HOVER_THRUST),
        (HOVER_STATE, HOVER_TARGET, bad[2]),
    ):
        assert used.step([state], [target], [thrust]).status[0] != Status.OK
    assert followed(used, 20, 21) == followed(undisturbed, 20, 21)


@pytest.mark.parametrize("kind", ["reference", "compiled"])
def test_a_reset_forgets_the_target(kind: str) -> None:
    """After it the cost of a step is that of a fresh controller; a refused one forgets nothing."""
    used, fresh = tracking(kind), tracking(kind)
    followed(used, 0, 20)
    remembered = followed(used, 20, 21)
    for each in (used, fresh):
        assert each.reset([[0.0, 0.0]])[0] == Status.OK
    assert followed(used, 20, 21) == followed(fresh, 20, 21) != remembered

    used, undisturbed = tracking(kind), tracking(kind)
    for each in (used, undisturbed):
        followed(each, 0, 20)
    assert used.reset([[np.nan, 0.0]])[0] == Status.BAD_COMMAND
    assert followed(used, 20, 21) == followed(undisturbed, 20, 21)


def test_the_acceleration_is_found_kept_over_a_jump_and_bounded() -> None:
    """A constant acceleration is estimated to 1 %; a jump keeps it; any inputs keep it bounded."""
    lib, ffi = (extension := build_extension(TRACKED)).lib, extension.ffi
    constants, horizon = OneNorm(TRACKED).tracker, TRACKED.horizon
    assert constants is not None
    self, change_m_s, velocity_m_s = ffi.new("nmpc_t *"), 0.02, 0.0
    lib.nmpc_init(self)
    for _ in range(60):
        lib.tracker_update(self, [velocity_m_s, -0.5 * velocity_m_s])
        velocity_m_s += change_m_s
    found = np.array(list(self.tracker.acceleration_m_step2)) / horizon.prediction_step_s**2
    truth = change_m_s / horizon.update_period_s * np.array([1.0, -0.5])
    assert found == pytest.approx(truth, rel=0.01)
    lib.tracker_update(self, [velocity_m_s + 3.0, 3.0])
    kept = np.array(list(self.tracker.acceleration_m_step2)) / horizon.prediction_step_s**2
    assert np.array_equal(kept, found)
    assert list(self.tracker.jerk_m_step2_update) == [0.0, 0.0]
    for step in range(200):
        fast = 0.999 * constants.change_limit_m_s * (abs(step % 60 - 30) - 15)
        lib.tracker_update(self, [fast, -fast])
        assert max(map(abs, self.tracker.acceleration_m_step2)) <= constants.acceleration_bound_m_step2


def test_the_version_traces_a_binary_to_its_settings() -> None:
    """The string in the binary names the generator and the digest of the settings."""
    extension = build_extension(MAMBO)
    text = extension.ffi.string(extension.lib.nmpc_version()).decode()
    assert text.startswith("mambo-nmpc ")
    assert text.endswith(f"settings {MAMBO.short_digest}")


WITH_ALL_PARTS = 2
"""Number of settings with all parts."""
PREFIXED = with_option(quadratic_case(WITH_ALL_PARTS, "float32"), "code.prefix", "x_axis")
CORNERS = range(len(CORNER_SETTINGS))


@pytest.mark.parametrize(
    ("settings", "compiler"),
    [
        (PREFIXED, "gcc"),
        pytest.param(PREFIXED, "clang", marks=pytest.mark.long),
        (height_settings("float32"), "gcc"),
        (height_settings("fixed"), "gcc"),
    ],
    ids=["two words, gcc", "two words, clang", "height", "height in fixed point"],
)
def test_the_strictest_build_passes_the_self_test(settings: Settings, compiler: str, tmp_path: Path) -> None:
    """Under a prefix of two words, and with the C that Python and the engine call."""
    library = strict_builds.built(settings, tmp_path, compiler)
    assert library.nmpc_self_test(ffi.new("char[]", library.nmpc_batch_instance_bytes())) == 0


def test_the_estimate_is_in_si_units() -> None:
    """Position, velocity and disturbance of the next step, from the numbers that are stored for steps.

    It is valid from the first step on; a null pointer gets a status.
    """
    settings = quadratic_case(WITH_ALL_PARTS, "float32")
    extension = build_extension(settings)
    ffi_, lib, period_s = extension.ffi, extension.lib, settings.horizon.update_period_s
    self, estimate, command = (ffi_.new(f"nmpc_{name} *") for name in ("t", "estimate_t", "command_t"))
    lib.nmpc_init(self)
    assert lib.nmpc_last_estimate(self, estimate) == Status.OK
    assert estimate.is_valid == 0
    for arguments in ((self, ffi_.NULL), (ffi_.NULL, estimate)):
        assert lib.nmpc_last_estimate(*arguments) == Status.NULL_POINTER
    state = ffi_.new("nmpc_state_t *", {"position_m": [1.5, -2.5], "velocity_m_s": [0.25, -0.75]})
    for _ in range(3):
        lib.nmpc_step(self, state, ffi_.new("nmpc_target_t *"), 9.81, command)
    assert lib.nmpc_last_estimate(self, estimate) == Status.OK
    assert estimate.is_valid == 1
    assert list(estimate.position_m) == list(self.observer.position_m)
    velocities = np.array(list(self.observer.velocity_m_step)) / period_s
    assert list(estimate.velocity_m_s) == pytest.approx(velocities, rel=1e-6)
    disturbances = np.array(list(self.observer.disturbance_m_step2)) / period_s**2
    assert list(estimate.disturbance_m_s2) == pytest.approx(disturbances, rel=1e-6)
    assert np.all(disturbances != 0)


@pytest.mark.sampled(4)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", ["float32", "float64"])
@pytest.mark.parametrize("index", CORNERS)
def test_any_bits_at_all_keep_commands_within_the_limit_and_numbers_finite(index: int, scalar: str) -> None:
    """Inputs of random bits among good ones at the ends of their ranges, for thousands of steps."""
    settings = quadratic_case(index, scalar)
    n, steps, ranges = 100, 150, settings.ranges
    used = CompiledController(settings, n, build_library(settings, toolchain("gcc")))
    rng = np.random.default_rng(index)
    kind = used.scalar
    tilt = kind(settings.limits.tilt_rad)
    largest = {"position": ranges.position_m, "velocity": ranges.velocity_m_s, "angle": 3.25, "yaw": 1024.0}
    largest |= {"thrust": ranges.thrust_acceleration_max_m_s2, "whole": 2.0}
    method = method_of(settings)
    state, target = (np.array([largest[one] for one in names]) for names in (method.state, method.target))

    def numbers(limits: Array) -> Array:
        shape = (n, len(limits))
        bits = rng.integers(0, 256, (*shape, kind(0).itemsize), np.uint8).view(kind)[:, :, 0]
        with np.errstate(invalid="ignore", over="ignore"):
            odd = bits.astype(np.float64)
        ends = limits * rng.choice([-1.0, 1.0, 0.0, 0.5], shape)
        drawn: Array = np.where(rng.random(shape) < 0.03, odd, ends)
        return drawn

    for step in range(steps):
        if step % 40 == 39:
            used.report_command(rng.uniform(-3.25, 3.25, (n, 2)))
        outcome = used.step(numbers(state), numbers(target), np.full(n, 9.81))
        assert np.all(np.abs(outcome.command_rad) <= tilt)
        assert np.all(np.isfinite(outcome.stored))


@pytest.mark.parametrize("scalar", ["float32", "float64"])
def test_a_number_in_the_place_of_an_integer_is_that_integer_or_none(scalar: str) -> None:
    """A target knows 0, 1 or 2, anything else is refused; a drone touches the floor unless it is 0."""
    settings = height_settings(scalar)
    method, library = method_of(settings), build_library(settings, toolchain("gcc"))
    values = [0.0, -0.0, 1.0, 2.0, 0.5, 1.5, 3.0, -1.0, 100.0, 1e9, np.nan, np.inf]
    target, state = np.zeros((len(values), 13)), np.zeros((len(values), 10))
    target[:, 12] = values
    for controller in (CompiledController(settings, len(values), library), method.reference_controller(12)):
        status = controller.step(state, target).status
        assert status.tolist() == [Status.OK] * 4 + [Status.BAD_TARGET] * 8
    state[:, 9], target[:, 12], target[:, 6] = values, 0.0, 0.5
    for controller in (CompiledController(settings, len(values), library), method.reference_controller(12)):
        outcome: Any = [controller.step(state, target) for _ in range(3)][-1]
        assert (outcome.stored[2:] == outcome.stored[2]).all()
        assert (outcome.stored[:2] != outcome.stored[2]).any(axis=1).all()
