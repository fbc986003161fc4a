"""A program of version 0.3 compiles with a bundle of today, without a warning, and flies as it flew."""

import subprocess
from pathlib import Path

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from tests.support.bundles import place
from tests.support.tools import require

PROGRAM = Path(__file__).with_name("version_0_3.c")
FLAGS = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off", "-I.")


@pytest.mark.parametrize("preset", ["mambo", "mambo-1norm", "crazyflie"])
def test_a_program_of_0_3_flies(preset: str, tmp_path: Path) -> None:
    """What it does not know of a target is 0: the position and the velocity are known, no acceleration."""
    place(render(presets.preset(preset)), tmp_path)
    sources = ("nmpc.c", "nmpc_self_test.c", PROGRAM)
    subprocess.run([require("gcc", "gcc"), *FLAGS, *sources, "-o", "flies"], cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "flies"], capture_output=True, text=True, check=True)
    x_m, behind_m = map(float, done.stdout.split())
    assert x_m == pytest.approx(1.0, abs=0.01)
    assert behind_m == pytest.approx(0.0, abs=0.01)
