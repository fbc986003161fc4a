"""Same bits: every build has the digest of the reference; other settings and wrong C have other digests."""

import re
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen import boards
from mambo_codegen.bundle.digest import TICKS, episode_count, episode_inputs, self_test_digest
from mambo_codegen.bundle.render import render
from mambo_codegen.errors import BuildError
from mambo_codegen.methods import method_of
from mambo_codegen.methods.one_norm.controller import OneNormController
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.board.emulated import GUEST, digest_emulated
from mambo_sil.board.firmware.firmware_build import OPTIMISATIONS, builder, clang_builder
from mambo_sil.board.footprint.build_digests import (
    BOARD_COMPILERS,
    HOST_COMPILERS,
    REFERENCE,
    count_builds,
    run_everywhere,
)
from mambo_sil.flight.controllers.compiled import digest_compiled
from mambo_sil.flight.controllers.controller_library import batch_source, load_library
from tests.support.cases import settings_case
from tests.support.one_norm import ONE_NORM
from tests.support.tools import board_builder, require, toolchain

MAMBO = ONE_NORM
EMULATED = {
    "float32": ("mambo", "rp2040", "crazyflie", "teensy41", "rv32"),
    "float64": ("mambo", "teensy41"),
    "fixed": ("rp2040", "crazyflie"),
}
"""Boards of each scalar type: all, with and without doubles in hardware, with and without wide products.

At the optimisation that is shipped `test_emulated` compares every scalar type on every board.
"""

FAULTS = {
    "another order": (
        "nmpc.c",
        "rollout->acceleration_m_step2 + (rollout->roll_deficit_m_step2 + rollout->pitch_deficit_m_step2)",
        "(rollout->acceleration_m_step2 + rollout->roll_deficit_m_step2) + rollout->pitch_deficit_m_step2",
    ),
    "another sign": ("nmpc.c", "effort_slope = -weight", "effort_slope = weight"),
}
"""Faults by name: file, the line, what it becomes."""


@pytest.mark.sampled(4)
@pytest.mark.long
@pytest.mark.parametrize(
    ("scalar", "name"), [(scalar, name) for scalar, names in EMULATED.items() for name in names]
)
def test_every_build_has_the_digest_of_the_reference(scalar: str, name: str) -> None:
    """Host and boards, with all compilers and optimisations, with and without an FPU.

    The sample has every scalar type, and four of the five boards.
    """
    for compiler in HOST_COMPILERS:
        require(compiler, compiler)
    board_builder(name)
    settings = with_option(MAMBO, "code.scalar", scalar)
    chosen = [boards.load(name)]
    found = list(run_everywhere(settings, chosen, 3))
    builds = [("host", compiler) for compiler in HOST_COMPILERS]
    for board in chosen:
        builds += [(board.name, builder(board).toolchain.command[0]), (board.name, "clang")]
    assert [(one.where, one.compiler, one.optimisation) for one in found] == [
        (REFERENCE, "NumPy", ""),
        *((*build, flag) for build in builds for flag in OPTIMISATIONS),
    ]
    assert len(found) == count_builds(chosen)
    assert {one.digest for one in found} == {f"0x{self_test_digest(OneNorm(settings), 3):08X}"}


@pytest.mark.first_is_quick
@pytest.mark.parametrize(("fault", "compiler"), list(zip(FAULTS, BOARD_COMPILERS, strict=True)))
def test_a_wrong_bundle_has_another_digest(fault: str, compiler: str, tmp_path: Path) -> None:
    """A changed order of additions changes the digest."""
    board_builder("crazyflie")
    require(compiler, compiler)
    path, line, instead = FAULTS[fault]
    files = render(MAMBO, with_digest=False)
    assert files[path].count(line) == 1
    wrong = files | {path: files[path].replace(line, instead)}
    digests = []
    for bundle in (files, wrong):
        build = BOARD_COMPILERS[compiler](boards.load("crazyflie"), "-O2")
        elf = build.guest(bundle, batch_source(), GUEST, tmp_path)
        digests.append(digest_emulated(MAMBO, elf, "cortex-m4", 2))
    assert digests[0] == self_test_digest(OneNorm(MAMBO), 2) != digests[1]


@pytest.mark.long
def test_other_settings_and_other_steps_have_other_digests() -> None:
    """A change of one bit of a weight, of the optimizer or of the scalar type changes the digest."""
    heavier = float(np.nextafter(np.float32(MAMBO.cost.tracking_weight), np.float32(np.inf)))
    changed = [
        with_option(MAMBO, "cost.tracking_weight", heavier),
        with_option(MAMBO, "optimizer.variant", "irprop-"),
        with_option(MAMBO, "code.scalar", "float64"),
    ]
    digests = [self_test_digest(OneNorm(settings), 3) for settings in (MAMBO, *changed)]
    assert len({*digests, self_test_digest(OneNorm(MAMBO), 4)}) == len(digests) + 1


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", ["float32", "float64"])
@pytest.mark.parametrize("index", [0, 3, 7, 9])
def test_c_has_the_digest_of_the_reference(index: int, scalar: str) -> None:
    """The digests are equal for extreme horizons and narrow ranges too."""
    settings = settings_case(index, scalar)
    library = load_library(render(settings, with_digest=False), toolchain("gcc"))
    assert digest_compiled(library, 5) == self_test_digest(OneNorm(settings), 5)


def test_self_test_steps_end_in_every_way() -> None:
    """About one step in ten is refused, for each reason; some converge, some reach the tilt limit."""
    episode = np.arange(50, dtype=np.uint32)
    reference = OneNormController(OneNorm(MAMBO), len(episode))
    steps = [reference.step(*inputs) for inputs in episode_inputs(OneNorm(MAMBO), episode)]
    assert len(steps) == TICKS
    status = np.array([step.status for step in steps])
    assert set(status.flat) == {Status.OK, Status.BAD_STATE, Status.BAD_TARGET, Status.BAD_THRUST}
    assert 0.07 < np.mean(status != Status.OK) < 0.14
    assert 0.005 < np.mean([step.converged for step in steps]) < 0.5
    assert {int(count) for step in steps for count in step.iterations} == {1, 2, 3, 4, 5}
    limit = np.float32(MAMBO.limits.tilt_rad)
    assert 0.05 < np.mean([np.abs(step.command_rad) == limit for step in steps]) < 0.5


def test_self_test_inputs_are_uniform_and_seldom_repeat() -> None:
    """Inputs are uniform and uncorrelated; but for zeros and ends they differ between episodes."""
    inputs = list(episode_inputs(OneNorm(MAMBO), np.arange(400, dtype=np.uint32)))[::4]
    yaw = np.concatenate([state[:, 6] for state, _, _ in inputs])
    yaw = yaw[np.abs(yaw) <= 100]
    shares = np.histogram(yaw, bins=10, range=(-100, 100))[0] / len(yaw)
    assert np.all(np.abs(shares - 0.1) < 0.015)
    rolls = np.concatenate([state[:, 4] for state, _, _ in inputs])
    assert len(np.unique(rolls)) > 0.9 * len(rolls)
    assert np.all(np.abs(np.corrcoef(inputs[0][1], rowvar=False) - np.eye(4))[:3, :3] < 0.2)


def test_a_missing_compiler_is_a_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A build that cannot run has a reason instead of a digest; the reference always runs."""
    monkeypatch.setenv("PATH", str(tmp_path))
    found = list(run_everywhere(MAMBO, [boards.load("crazyflie"), boards.load("mega")], 1))
    assert found[0].digest == f"0x{self_test_digest(OneNorm(MAMBO), 1):08X}"
    reasons = {(one.where, one.compiler, one.reason) for one in found[1:]}
    assert all(one.digest is None for one in found[1:])
    assert ("host", "clang", "clang is missing") in reasons
    for where, compiler, package in (
        ("crazyflie", "gcc", "gcc-arm-none-eabi"),
        ("crazyflie", "clang", "clang"),
        ("mega", "gcc", "gcc-avr"),
    ):
        assert any((one[0], one[1]) == (where, compiler) and package in one[2] for one in reasons)


def test_clang_needs_the_compiler_of_the_board_to_link(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Clang has no libgcc for a board, so the message names the package that has it."""
    (tmp_path / "clang").symlink_to(require("clang", "clang"))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BuildError, match="gcc-arm-none-eabi"):
        clang_builder(boards.load("crazyflie"), "-O2")


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("preset", "scalar"), [("mambo", "float32"), ("mambo", "float64"), ("table1", "float32")]
)
def test_a_bundle_has_the_digest_in_its_header(preset: str, scalar: str) -> None:
    """The generated C computes the digest in its header, over all steps."""
    settings = with_option(presets.load(preset), "code.scalar", scalar)
    files = {path: text for path, text in render(settings).items() if path.endswith((".c", ".h"))}
    stated = re.search(r"NMPC_SELF_TEST_DIGEST (0x[0-9A-F]{8})UL$", files["nmpc_self_test.h"], re.M)
    assert stated
    library = load_library(files, toolchain(host_toolchain().command[0]))
    assert digest_compiled(library, episode_count(method_of(settings))) == int(stated[1], 16)
