"""What a caller of the C of a quadratic cost may rely on, whatever the compiler and the input."""

import itertools
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.bundle.flags import COMPILE_FLAGS, WARNING_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import build_library, ffi
from tests.support.bundles import place
from tests.support.extension import build_extension
from tests.support.height_settings import height_settings
from tests.support.quadratic import CORNER_SETTINGS, Array, quadratic_case
from tests.support.strict_builds import built
from tests.support.tools import require, toolchain

EVERYTHING, TWO = 2, 1
"""Numbers of settings with all parts, and with two moves and few of them."""
CORNERS = range(len(CORNER_SETTINGS))
DIALECTS = {
    "C99": ("gcc", "-std=c99", "-pedantic"),
    "C11": ("gcc", "-std=c11", "-pedantic"),
    "gnu89": ("gcc", "-std=gnu89"),
    "C++": ("g++", "-x", "c++", "-std=c++11"),
}


@pytest.mark.sampled(6)
@pytest.mark.long
@pytest.mark.parametrize(
    ("dialect", "scalar"),
    [
        pytest.param(*case, marks=[] if case == ("C++", "float32") else pytest.mark.long)
        for case in itertools.product(DIALECTS, ("float32", "float64"))
    ],
)
def test_every_dialect_compiles_without_a_word(dialect: str, scalar: str, tmp_path: Path) -> None:
    """All corners of the settings, with all warnings as errors."""
    compiler, *flags = DIALECTS[dialect]
    require(compiler, compiler)
    for index in CORNERS:
        files = render(quadratic_case(index, scalar))
        folder = place(files, tmp_path / str(index))
        sources = sorted(path for path in files if re.fullmatch(r"(example/)?[^/]*\.c", path))
        line = [compiler, *flags, "-Wall", "-Werror", "-ffp-contract=off", "-O2", "-I.", "-c"]
        done = subprocess.run([*line, *sources], cwd=folder, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.first_is_quick
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_another_prefix_passes_the_strictest_build_and_the_self_test(compiler: str, tmp_path: Path) -> None:
    """Under a prefix of two words."""
    settings = with_option(quadratic_case(EVERYTHING, "float32"), "code.prefix", "x_axis")
    library = built(settings, tmp_path, compiler)
    assert library.nmpc_self_test(ffi.new("char[]", library.nmpc_batch_instance_bytes())) == 0


@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_a_height_passes_the_strictest_build_and_the_self_test(scalar: str, tmp_path: Path) -> None:
    """With the C that Python and the engine call."""
    library = built(height_settings(scalar), tmp_path, "gcc")
    assert library.nmpc_self_test(ffi.new("char[]", library.nmpc_batch_instance_bytes())) == 0


def test_two_controllers_with_different_prefixes_link_into_one_program(tmp_path: Path) -> None:
    """No public name appears twice."""
    objects = []
    for prefix, index in (("roof", EVERYTHING), ("floor_", TWO)):
        settings = with_option(quadratic_case(index, "float32"), "code.prefix", prefix.strip("_"))
        files = render(settings, with_digest=False)
        name = prefix.strip("_")
        folder = place(files, tmp_path / name)
        toolchain("gcc").run([*COMPILE_FLAGS, *WARNING_FLAGS, "-c", f"{name}.c", "-o", f"{name}.o"], folder)
        objects.append(str(folder / f"{name}.o"))
    toolchain("gcc").run(["-r", "-nostdlib", *objects, "-o", "both.o"], tmp_path)


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
