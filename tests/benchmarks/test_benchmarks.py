"""The benchmarks compare equal controllers and equal problems."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.host_builds import build, plans
from benchmarks.ours import Ours, bundle, rollout
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.one_norm import ONE_NORM
from tests.support.tools import require

Array = NDArray[np.float64]


def random_inputs(n: int) -> Array:
    """Return errors and last commands (n, 6) of three magnitudes."""
    scale = np.array([0.5, 1.0, 0.5, 1.0, 0.1, 0.1]) * 10.0 ** -(np.arange(n) % 3)[:, None]
    inputs: Array = np.random.default_rng(0).uniform(-1, 1, (n, 6)) * scale
    return inputs


def plan_all(program: Ours, folder: Path) -> list[Array]:
    """Return the plans (n, 4) of a build, with a reset before each input, and without."""
    program.write(folder)
    library = build(program, folder, "-O0", folder / "library.so")
    return [plans(library, random_inputs(600), follows=follows)[0] for follows in (False, True)]


@pytest.mark.first_is_quick
@pytest.mark.parametrize("chosen", [presets.load("table1"), ONE_NORM], ids=["no lag", "lag"])
def test_plain_roll_out_plans_what_the_generated_c_plans(chosen: Settings, tmp_path: Path) -> None:
    """In double both have the same plans, with and without lag, with and without warm start."""
    require("gcc", "gcc")
    settings = with_option(chosen, "code.scalar", "float64", "test")
    ours = plan_all(bundle("ours", "", settings), tmp_path / "ours")
    plain = plan_all(rollout("plain", "", settings), tmp_path / "plain")
    for mine, theirs in zip(ours, plain, strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-6)
        assert np.ptp(mine, axis=0).min() > 0.1
