"""The generated C under gcc's sanitizers, stepped through inputs of every kind: nothing undefined, ever."""

import re
import subprocess
from pathlib import Path

import pytest

from codegen import presets
from codegen.frozen import frozen_digest
from codegen.render import render
from codegen.settings import Settings
from tests.support.cases import CORNER_HORIZONS, settings_case
from tests.support.tools import require

ADVERSARY = Path(__file__).parent / "support" / "adversary.c"
EPISODES = 3
"""Frozen episodes that the adversary runs."""
SANITIZERS = ["-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"]
SETTINGS = {name: presets.load(name) for name in presets.names()} | {
    f"case {index} {scalar}": settings_case(index, scalar)
    for index in range(len(CORNER_HORIZONS))
    for scalar in ("float32", "float64")
}
BEYOND_THE_END = {
    "a move too many": (
        "src/nmpc_optimizer.c",
        "for (k = 0; k < NMPC_MOVES; k++)",
        "for (k = 0; k <= NMPC_MOVES; k++)",
    ),
    "a predicted step too many": (
        "src/nmpc_predictor.c",
        "for (i = 0; i < NMPC_PREDICTION_HORIZON; i++)",
        "for (i = 0; i <= NMPC_PREDICTION_HORIZON; i++)",
    ),
    "a wild heading converted": ("src/nmpc.c", "nmpc_within(state->yaw_rad, NMPC_YAW_RANGE_RAD)", "1"),
}


def watched(files: dict[str, str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Build the C in `files` with sanitizers and let the adversary loose on it."""
    require("gcc", "gcc")
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    sources = [*sorted(folder.glob("src/*.c")), ADVERSARY]
    command = [
        "gcc",
        "-std=c99",
        "-O1",
        "-g",
        "-ffp-contract=off",
        *SANITIZERS,
        "-Iinclude",
        *map(str, sources),
    ]
    subprocess.run([*command, "-o", "watched"], cwd=folder, check=True)
    return subprocess.run(["./watched"], cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("name", SETTINGS)
def test_nothing_undefined_happens(name: str, tmp_path: Path) -> None:
    """20,000 steps, half of them good or more: no report, no wild command, and the bits of the reference."""
    settings: Settings = SETTINGS[name]
    done = watched(render(settings, with_digest=False), tmp_path)
    assert done.returncode == 0, done.stderr
    found = re.fullmatch(r"good (\d+) wild 0 self-test 0 digest (\d+)\n", done.stdout)
    assert found, done.stdout
    assert int(found[1]) > 5000
    assert int(found[2]) == frozen_digest(settings, EPISODES)


@pytest.mark.parametrize("fault", BEYOND_THE_END)
def test_a_step_beyond_the_end_is_reported(fault: str, tmp_path: Path) -> None:
    """Faults that parity may not see, for the memory beyond happens to be harmless."""
    path, right, wrong = BEYOND_THE_END[fault]
    files = render(presets.load("mambo"), with_digest=False)
    assert right in files[path]
    done = watched(files | {path: files[path].replace(right, wrong)}, tmp_path)
    assert done.returncode != 0
    assert "runtime error" in done.stderr or "AddressSanitizer" in done.stderr
