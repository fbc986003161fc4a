"""The fuzzer finds what breaks a promise of nmpc.h, repeatably, and names the file that repeats it."""

import json
import re
import subprocess
from pathlib import Path

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.verify import fuzzing, tape_replay
from mambo_sil.verify.check import CheckOutcome
from tests.support.bundles import place
from tests.support.cases import settings_case
from tests.support.one_norm import ONE_NORM
from tests.support.subjects import subject
from tests.support.tools import require

FEW_RUNS = 20_000
WHOLE = ("mambo", "table1")
"""Presets that are fuzzed as by `verify`, one of each method; a fifth of the runs for the others."""
FAULTS = {
    "a clamp removed": (
        "nmpc.c",
        "clamp(command->roll_rad, tilt_limit(self))",
        "command->roll_rad",
    ),
    "NaN passes": (
        "nmpc.c",
        "return NMPC_MAGNITUDE_BITS(value) <= NMPC_MAGNITUDE_BITS(limit);",
        "return !(value < -limit) && !(value > limit);",
    ),
    "a bad weight half taken": (
        "nmpc.c",
        "        return NMPC_BAD_WEIGHT;",
        "        self->weights.tracking = weights->tracking;\n        return NMPC_BAD_WEIGHT;",
    ),
    "a memory that is nobody's": (
        "nmpc.c",
        "    self->command_rad[0] = self->plan_rad[0];",
        "        { static int n; self->command_rad[0] = (n++ % 2 == 1) ? 0 : self->plan_rad[0]; }",
    ),
}


@pytest.fixture(autouse=True)
def _compilers() -> None:
    require("clang", "clang")


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("name", presets.names())
def test_no_call_breaks_a_promise(name: str, tmp_path: Path) -> None:
    """And every tape kept has the bits of the reference."""
    runs = fuzzing.RUNS if name in WHOLE else fuzzing.RUNS // 5
    result = fuzzing.check(subject(presets.load(name), tmp_path), runs=runs)
    assert result.outcome is CheckOutcome.PASSED, result.evidence
    assert result.figures["runs"] >= runs


@pytest.mark.long
def test_a_float64_controller_of_another_name_is_fuzzed(tmp_path: Path) -> None:
    """Format and names of the harness follow the settings."""
    settings = with_option(settings_case(1, "float64"), "code.prefix", "left_wing")
    result = fuzzing.check(subject(settings, tmp_path), runs=FEW_RUNS)
    assert result.outcome is CheckOutcome.PASSED, result.evidence
    assert result.figures["corpus"] > 50
    assert json.loads(json.dumps(result.figures)) == result.figures


@pytest.mark.parametrize(
    "fault", [pytest.param(name, marks=[pytest.mark.long] * (name != "NaN passes")) for name in FAULTS]
)
def test_a_broken_promise_is_found_and_can_be_repeated(fault: str, tmp_path: Path) -> None:
    """The evidence says which promise, its command repeats the finding, and no seed was needed for it."""
    result = fuzzing.check(subject(ONE_NORM, tmp_path, FAULTS[fault]), runs=FEW_RUNS)
    assert result.outcome is CheckOutcome.FAILED
    assert "broken promise" in result.evidence or "runtime error" in result.evidence
    command = re.search(r"repeat it with (\S+) (\S+);", result.evidence)
    assert command, result.evidence
    again = subprocess.run([command[1], command[2]], capture_output=True, check=False)
    assert again.returncode != 0
    options = ["-seed=1", f"-runs={fuzzing.RUNS}", "-max_len=588", "-len_control=0", "-use_cmp=0"]
    from_nothing = subprocess.run([command[1], *options], cwd=tmp_path, capture_output=True, check=False)
    assert from_nothing.returncode != 0


@pytest.mark.long
def test_what_the_harness_cannot_know_is_found_by_the_reference(tmp_path: Path) -> None:
    """A wrong number keeps every promise of the header, and not the reference's bits."""
    fault = (
        "nmpc.c",
        "    self->weights.tracking = NMPC_TRACKING_WEIGHT;",
        "    self->weights.tracking = NMPC_TRACKING_WEIGHT + (nmpc_real_t)1;",
    )
    result = fuzzing.check(subject(ONE_NORM, tmp_path, fault), runs=1000)
    assert result.outcome is CheckOutcome.FAILED
    assert "reference" in result.evidence


@pytest.mark.long
def test_the_same_runs_keep_the_same_corpus(tmp_path: Path) -> None:
    """A fixed number of runs from a fixed seed: what is done depends on no clock."""
    kept = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        made = subject(ONE_NORM, tmp_path / name)
        assert fuzzing.check(made, runs=5000).outcome is CheckOutcome.PASSED
        kept.append(sorted(path.name for path in (made.folder / "corpus").iterdir()))
    assert kept[0] == kept[1]


@pytest.mark.long
def test_the_command_in_the_harness_works(tmp_path: Path) -> None:
    """A user repeats the fuzzing from the bundle alone."""
    place(render(ONE_NORM), tmp_path)
    comment = (tmp_path / "fuzz/nmpc_fuzz.c").read_text().partition("*/")[0]
    lines = [line.removeprefix(" *   ") for line in comment.splitlines() if line.startswith(" *   ")]
    script = "\n".join(lines).replace("1000000", "1000")
    assert tape_replay.missing("clang", ["-fsanitize=fuzzer"], tmp_path) is None
    done = subprocess.run(["sh", "-ec", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Done 1000 runs" in done.stderr
