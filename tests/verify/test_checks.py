"""Checks of warnings, bits, sanitizers pass controllers and fail faults; a full disk is no fault of the C."""

import json
import re
from functools import partial
from pathlib import Path
from typing import Final

import pytest

from mambo_codegen.errors import UnwritableError
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import Toolchain
from mambo_sil.verify import bits, dialects, fuzzing, rules, sanitizers
from mambo_sil.verify.check import Check, CheckOutcome
from mambo_sil.verify.dialects import DIALECTS
from mambo_sil.verify.tools import run
from tests.support.cases import CORNER_HORIZONS, settings_case
from tests.support.command import command
from tests.support.one_norm import ONE_NORM
from tests.support.quadratic import quadratic_settings
from tests.support.subjects import Harm, subject
from tests.support.tools import require

CONTROLLER: Final = "nmpc.c"
QUADRATIC: Final = quadratic_settings()
FIXED: Final = with_option(ONE_NORM, "code.scalar", "fixed")
LIMITED: Final = with_option(with_option(FIXED, "limits.speed_m_s", 5.0), "limits.braking_m_s2", 3.0)
"""With limits the instance has an odd count of numbers, and sums of twice their size behind them."""
QUICK: Final = ("1-norm, sanitizers", "quadratic, warnings", "quadratic, bits")
PASSING: Final[dict[str, tuple[Check, Settings]]] = {
    "1-norm of another prefix, bits": (
        bits.check,
        with_option(settings_case(6, "float64"), "code.prefix", "left_wing"),
    ),
    "1-norm, limited in fixed point, bits": (bits.check, LIMITED),
    "1-norm, sanitizers": (sanitizers.check, ONE_NORM),
    "quadratic, warnings": (dialects.check, QUADRATIC),
    "quadratic, bits": (bits.check, QUADRATIC),
    "quadratic in fixed point, sanitizers": (sanitizers.check, quadratic_settings("fixed")),
    **{
        f"quadratic in float64, {name}": (check, quadratic_settings("float64"))
        for name, check in (
            ("rules", rules.check),
            ("sanitizers", sanitizers.check),
            ("fuzzing", partial(fuzzing.check, runs=fuzzing.RUNS // 5)),
        )
    },
}
"""Other checks, and the proofs, are in the tests of all presets; dialects and bits too in tests/templates."""
ANY_SETTINGS: Final = {name: presets.load(name) for name in presets.names()} | {
    f"case {index}": settings_case(index, ("float32", "float64")[index % 2])
    for index in range(len(CORNER_HORIZONS))
}
FEW_RUNS: Final = partial(fuzzing.check, runs=20_000)
ONE_NORM_FAULTS: Final[dict[str, tuple[Check, Settings, Harm, str]]] = {
    "pitch takes roll": (
        bits.check,
        ONE_NORM,
        Harm(CONTROLLER, r"(self->command_rad\[1\]) = self->plan_rad\[1\];", r"\1 = self->plan_rad[0];"),
        "command_rad",
    ),
    "another scale": (
        bits.check,
        FIXED,
        Harm(CONTROLLER, r"quantize\(given->yaw_rad, NMPC_YAW_SCALE\)", "quantize(given->yaw_rad, 1.0f)"),
        "the self-test fails",
    ),
    "a conversion that loses digits": (
        dialects.check,
        ONE_NORM,
        Harm(CONTROLLER, r"\+ absolute\(", "+ (double)absolute("),
        f"{CONTROLLER}:",
    ),
    "a declaration inside for": (
        dialects.check,
        ONE_NORM,
        Harm(CONTROLLER, r"    for \(k = 0;", "    for (int k = 0;"),
        f"{CONTROLLER}:",
    ),
    "a move too many": (
        sanitizers.check,
        ONE_NORM,
        Harm(
            CONTROLLER,
            r"k < (NMPC_MOVES; k\+\+\) \{\n        self->plan_rad\[k\] = self->command_rad)",
            r"k <= \1",
        ),
        "Sanitizer|runtime error",
    ),
    "a weight read before it is written": (
        sanitizers.check,
        ONE_NORM,
        Harm(CONTROLLER, r"    self->weights\.effort = NMPC_EFFORT_WEIGHT;\n", ""),
        "MemorySanitizer",
    ),
}
QUADRATIC_FAULTS: Final[dict[str, tuple[Check, Harm]]] = {
    "a warning": (dialects.check, Harm(CONTROLLER, r"    int axis;\n", r"    int unused;\n\g<0>")),
    "a rule": (
        rules.check,
        Harm(CONTROLLER, r"    return status;\n\}", "    goto end;\nend:\n    return status;\n}"),
    ),
    "another bit": (
        bits.check,
        Harm(CONTROLLER, r"gains\[1\]\[0\] \* n\[0\]", "gains[1][1] * n[0]"),
    ),
    "another state": (bits.check, Harm(CONTROLLER, r"row\[k\] \* state\[k\]", "row[k] * state[k - 1]")),
    "a flag that stays": (bits.check, Harm(CONTROLLER, r"    self->has_target = 0U;\n", "")),
    "an outage a step too long": (
        bits.check,
        Harm(CONTROLLER, r"\(NMPC_OUTAGE_STEPS \+ 1U\)", "(NMPC_OUTAGE_STEPS + 2U)"),
    ),
    "a state past its end": (sanitizers.check, Harm(CONTROLLER, r"k < NMPC_STATES", "k <= NMPC_STATES")),
    "memory read before it is written": (
        sanitizers.check,
        Harm(CONTROLLER, r"    attitude->cosine = NMPC_ONE;\n", ""),
    ),
    "a refused state leaves a trace": (
        FEW_RUNS,
        Harm(CONTROLLER, r"            good_state = NULL;\n", ""),
    ),
    "a refused command is set": (
        FEW_RUNS,
        Harm(
            CONTROLLER,
            r"(?s)(nmpc_report_command\(.*?)    if \(!is_good_command\(command\)\) \{\n",
            r"\1    if (0) {\n",
        ),
    ),
}
FAULTS: Final = ONE_NORM_FAULTS | {
    f"quadratic, {name}": (check, QUADRATIC, harm, "") for name, (check, harm) in QUADRATIC_FAULTS.items()
}
QUICK_FAULT: Final = "pitch takes roll"
COUNTED: Final[dict[Check, tuple[str, int]]] = {
    bits.check: ("builds", len(bits.BUILDS)),
    sanitizers.check: ("builds", len(sanitizers.BUILDS)),
    dialects.check: ("silent", len(DIALECTS)),
}
"""Figures that count what passed, and how much there is."""


@pytest.fixture(autouse=True)
def _tools() -> None:
    for dialect in DIALECTS.values():
        require(dialect.compiler, dialect.package)
    require("cppcheck", "cppcheck")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.long] * (name not in QUICK)) for name in PASSING]
)
def test_a_check_passes(name: str, tmp_path: Path) -> None:
    """Nothing is found, in every build and dialect, and the figures say so."""
    check, settings = PASSING[name]
    its = subject(settings, tmp_path)
    result = check(its)
    assert result.outcome is CheckOutcome.PASSED, result.evidence
    assert json.loads(json.dumps(result.figures)) == result.figures
    if check in COUNTED:
        figure, count = COUNTED[check]
        assert len(result.figures[figure]) == count
    if check is dialects.check:
        assert (its.folder / "compilers.txt").read_text("utf-8").count("exit code 0") == len(DIALECTS)


@pytest.mark.sampled(4)
@pytest.mark.long
@pytest.mark.parametrize("name", ANY_SETTINGS)
def test_nothing_undefined_happens_whatever_the_settings(name: str, tmp_path: Path) -> None:
    """Every preset, and the corners of the horizon with float32 and float64 by turns."""
    result = sanitizers.check(subject(ANY_SETTINGS[name], tmp_path))
    assert result.outcome is CheckOutcome.PASSED, result.evidence
    assert result.figures["calls"] > 10_000


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    "fault", [pytest.param(fault, marks=[pytest.mark.long] * (fault != QUICK_FAULT)) for fault in FAULTS]
)
def test_a_check_finds_a_fault(fault: str, tmp_path: Path) -> None:
    """The check that is there for it fails, and says what it found, though memory beyond may be harmless."""
    check, settings, harm, said = FAULTS[fault]
    result = check(subject(settings, tmp_path, harm))
    assert result.outcome is CheckOutcome.FAILED, result.evidence
    assert re.search(said, f"{result.evidence} {json.dumps(dict(result.figures))}")


NO_SPACE = r"cannot write its files: .*No space left on device; free some space in "


@pytest.fixture
def full(tmp_path: Path) -> Path:
    """Make a file that the disk has no space for."""
    (tmp_path / "full").symlink_to("/dev/full")
    return tmp_path / "full"


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_a_full_disk_is_named(compiler: str, full: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The compiler's line; then the folder for temporary files, and that of the build."""
    require(compiler, compiler)
    monkeypatch.setenv("TMPDIR", "/var/tmp")
    arguments = ["-S", "-x", "c", "/dev/null", "-o", str(full)]
    message = (
        f"^{compiler} {NO_SPACE}/var/tmp, or set TMPDIR to another folder; or free some in {full.parent}$"
    )
    with pytest.raises(UnwritableError, match=message):
        Toolchain((compiler,)).run(arguments, full.parent)
    with pytest.raises(UnwritableError, match=message):
        run([compiler, *arguments], full.parent)


def test_a_full_folder_for_temporary_files_is_named_alone(
    full: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If the compiler's line has a file in it."""
    require("gcc", "gcc")
    monkeypatch.setenv("TMPDIR", str(full.parent))
    with pytest.raises(UnwritableError, match=f"{NO_SPACE}{full.parent}, or set TMPDIR to another folder$"):
        Toolchain(("gcc",)).run(["-S", "-x", "c", "/dev/null", "-o", str(full)], Path("/"))


def test_a_check_without_space_has_no_result(full: Path) -> None:
    """It raises; the C is not said to fail, and no tool to be missing."""
    require("gcc", "gcc")
    build = bits.Build("gcc", "gcc", ("-MD", "-MF", str(full)))
    with pytest.raises(UnwritableError, match=NO_SPACE):
        bits.play(subject(ONE_NORM, full.parent), (build,), "bits")


@pytest.mark.parametrize(
    ("name", "reason"), [("gone", "No such file or directory"), ("full", "Not a directory")]
)
def test_an_unusable_folder_for_temporary_files_is_refused(
    name: str, reason: str, full: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """TMPDIR is checked before the first tool runs."""
    monkeypatch.setenv("TMPDIR", str(full.parent / name))
    done = command("verify", "--only", "bits", "-o", full.parent / "out")
    assert (done.returncode, done.stdout) == (2, "")
    assert f"{name}: temporary files cannot be written: {reason}; free some space there, or set TMPDIR" in (
        done.stderr
    )
    assert not (full.parent / "out").exists()
