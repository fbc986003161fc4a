"""What a caller of the C of a quadratic cost may rely on, whatever the compiler and the input."""

from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import build_library, ffi
from tests.support.extension import build_extension
from tests.support.height_settings import height_settings
from tests.support.quadratic import CORNER_SETTINGS, Array, quadratic_case
from tests.support.strict_builds import built
from tests.support.tools import toolchain

EVERYTHING = 2
"""Number of settings with all parts."""
PREFIXED = with_option(quadratic_case(EVERYTHING, "float32"), "code.prefix", "x_axis")
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
    library = built(settings, tmp_path, compiler)
    assert library.nmpc_self_test(ffi.new("char[]", library.nmpc_batch_instance_bytes())) == 0


def test_the_estimate_is_in_si_units() -> None:
    """Position, velocity and disturbance of the next step, from the numbers that are stored for steps.

    It is valid from the first step on; a null pointer gets a status.
    """
    settings = quadratic_case(EVERYTHING, "float32")
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
    bounds = np.array([ranges.position_m] * 2 + [ranges.velocity_m_s] * 2 + [3.25, 3.25, 1024.0])

    target = np.append(bounds[:4], [ranges.thrust_acceleration_max_m_s2] * 2)

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
            used.set_command(rng.uniform(-3.25, 3.25, (n, 2)))
        outcome = used.step(numbers(bounds), numbers(target), np.full(n, 9.81))
        assert np.all(np.abs(outcome.command_rad) <= tilt)
        assert np.all(np.isfinite(outcome.stored))
