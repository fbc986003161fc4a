"""Same bits: every build has the digest of the reference, and nothing else has."""

import json
import shutil
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from codegen import boards, presets
from codegen.footprint.build import OPTIMISATIONS, builder
from codegen.reference import ReferenceController
from codegen.render import render
from codegen.settings import Settings
from codegen.settings.controller_toml import read
from codegen.toolchain import host_toolchain
from sil.compiled import CompiledController
from sil.emulated import GUEST, EmulatedController
from sil.extension import load_extension
from sil.frozen import TOGETHER, frozen_digest
from sil.same_bits import HOST_COMPILERS, REFERENCE, builds, same_bits
from tests.support.cases import settings_case
from tests.support.tools import require, toolchain

MAMBO = presets.load("mambo")
EMULATED = ("mambo", "rp2040", "crazyflie", "teensy41", "rv32")
GENERATED = Path(__file__).parent.parent / "generated"
DIGESTS = GENERATED / "digests.json"
FROZEN_STEPS = 100_000

HARM = {
    "another order": (
        "src/nmpc_cost.c",
        "distance_m = distance_m\n                     + (weigh(error_x_m, nmpc_predictor_response_s2[i], "
        "sums_x_s2)\n                        + weigh(error_y_m, nmpc_predictor_response_s2[i], sums_y_s2));",
        "distance_m = (distance_m + weigh(error_x_m, nmpc_predictor_response_s2[i], sums_x_s2))"
        " + weigh(error_y_m, nmpc_predictor_response_s2[i], sums_y_s2);",
    ),
    "another sign": ("src/nmpc_cost.c", "effort = -weights->effort;", "effort = weights->effort;"),
}
"""Faults by name: file, the line, what it becomes."""


def digest(settings: Settings, steps: int = 300) -> str:
    """Return the digest of the reference."""
    return frozen_digest(settings, ReferenceController(settings, TOGETHER), steps)


def require_compiler(name: str) -> None:
    """Skip without a compiler for a board."""
    compiler = boards.load(name).compiler
    if not any(shutil.which(command) for command in compiler.candidates):
        require(compiler.candidates[0], compiler.packages[0])


def check_every_build(names: tuple[str, ...], scalar: str) -> None:
    """Compare the digests of all host compilers and of some boards at all optimisations."""
    for compiler in HOST_COMPILERS:
        require(compiler, compiler)
    for name in names:
        require_compiler(name)
    settings = Settings.model_validate(MAMBO.model_dump() | {"code": {"scalar": scalar}})
    chosen = [boards.load(name) for name in names]
    found = list(same_bits(settings, chosen, 300))
    assert [(one.where, one.optimisation) for one in found] == [
        (REFERENCE, ""),
        *((where, flag) for where in ("host", "host", *names) for flag in OPTIMISATIONS),
    ]
    assert len(found) == builds(chosen)
    assert {one.digest for one in found} == {digest(settings)}


def test_compilers_and_boards_share_one_digest() -> None:
    """The compilers here and an FPU of single precision, at every optimisation."""
    check_every_build(("crazyflie",), "float32")


@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "float64"])
def test_everything_shares_one_digest(scalar: str) -> None:
    """All boards that are emulated, with and without an FPU."""
    check_every_build(EMULATED, scalar)


@pytest.mark.parametrize("harm", HARM)
def test_a_harmed_bundle_has_another_digest(harm: str, tmp_path: Path) -> None:
    """Even the order of an addition shows."""
    require_compiler("crazyflie")
    path, line, instead = HARM[harm]
    files = render(MAMBO)
    assert files[path].count(line) == 1
    glue = resources.files("sil").joinpath("batch.c").read_text("utf-8")
    good, harmed = (
        builder(boards.load("crazyflie")).guest(bundle, glue, GUEST, tmp_path / name)
        for name, bundle in {
            "good": files,
            "harmed": files | {path: files[path].replace(line, instead)},
        }.items()
    )
    digests = [
        frozen_digest(MAMBO, EmulatedController(MAMBO, elf, "cortex-m4", TOGETHER), 200)
        for elf in (good, harmed)
    ]
    assert digests[0] == digest(MAMBO, 200) != digests[1]


def test_other_settings_and_other_steps_have_other_digests() -> None:
    """Whatever is changed, down to the last bit of a weight or a scalar type."""
    document = MAMBO.model_dump()
    weight = document["cost"]["tracking_weight"]
    heavier = float(np.nextafter(np.float32(weight), np.float32(np.inf)))
    changed = [
        document | {"cost": document["cost"] | {"tracking_weight": heavier}},
        document | {"optimizer": document["optimizer"] | {"variant": "irprop-"}},
        document | {"code": {"scalar": "float64"}},
    ]
    digests = [digest(Settings.model_validate(one)) for one in (document, *changed)]
    assert len({*digests, digest(MAMBO, 400)}) == len(digests) + 1
    assert digests[0] == digest(MAMBO)


@pytest.mark.parametrize("index", [0, 3, 7, 9])
def test_frozen_steps_visit_every_answer(index: int) -> None:
    """Whatever the settings, most inputs are good, and every thirteenth is refused."""
    settings = settings_case(index, "float32")
    reference = ReferenceController(settings, TOGETHER)
    statuses: list[int] = []

    class Watched:
        def step(self, *inputs: object) -> object:
            outcome = reference.step(*inputs)  # type: ignore[arg-type] # handed on as they come
            statuses.extend(outcome.status)
            return outcome

    frozen_digest(settings, Watched(), 1300)  # type: ignore[arg-type] # handed on as they come
    assert len(statuses) == 1300
    assert sum(status != 0 for status in statuses) == 100


def test_a_missing_compiler_and_another_core_are_reasons(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What did not run has no digest and says why; the reference always runs."""
    monkeypatch.setenv("PATH", str(tmp_path))
    found = list(same_bits(MAMBO, [boards.load("crazyflie"), boards.load("mega")], 100))
    assert found[0].digest == digest(MAMBO, 100)
    reasons = {(one.where, one.reason) for one in found[1:]}
    assert all(one.digest is None for one in found[1:])
    assert ("host", "clang is not here") in reasons
    assert ("mega", "avr is not emulated here") in reasons
    assert any(where == "crazyflie" and "gcc-arm-none-eabi" in reason for where, reason in reasons)


@pytest.mark.long
@pytest.mark.parametrize("name", ["mambo", "mambo-float64", "table1"])
def test_a_committed_bundle_has_its_committed_digest(name: str) -> None:
    """The C as it lies in generated/, over 100,000 steps; the reference has written the digest."""
    toolchain(host_toolchain().command[0])
    settings = read(GENERATED / name / "controller.toml")
    files = {
        path.relative_to(GENERATED / name).as_posix(): path.read_text("utf-8")
        for path in (GENERATED / name).rglob("*.[ch]")
    }
    extension = load_extension(files, settings.code.scalar, host_toolchain())
    controller = CompiledController(settings, TOGETHER, extension)
    expected = json.loads(DIGESTS.read_text("utf-8"))[name]
    assert frozen_digest(settings, controller, FROZEN_STEPS) == expected
