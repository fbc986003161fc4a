"""The rules: nothing but the listed deviations, each of which occurs and has its reasons; a new one fails."""

import re
import subprocess
from pathlib import Path

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.verify.check import CheckOutcome
from mambo_sil.verify.rules import check, deviations
from tests.support.cases import settings_case
from tests.support.one_norm import ONE_NORM
from tests.support.quadratic import quadratic_case
from tests.support.subjects import Harm, subject
from tests.support.tools import require

SETTINGS = (
    {name: presets.load(name) for name in presets.names() if name != "table1-printed"}  # table1 but two signs
    | {f"case {index}": settings_case(index, ("float32", "float64")[index % 2]) for index in (0, 3, 9)}
    | {f"{steps} steps": with_option(ONE_NORM, "horizon.prediction", steps, "test") for steps in (2, 33)}
    | {f"{scalar} 1-norm": with_option(ONE_NORM, "code.scalar", scalar) for scalar in ("float32", "fixed")}
    | {
        f"quadratic case {index}": quadratic_case(index, scalar)
        for index, scalar in ((1, "fixed"), (4, "fixed"), (2, "float32"))
    }
)
HARMS = {
    "15.1 goto": Harm("nmpc.c", r"    return status;\n\}", "    goto end;\nend:\n    return status;\n}"),
    "17.7 a result thrown away": Harm(
        "nmpc_self_test.c", r"    nmpc_init\(scratch\);\n", "    nmpc_last_cost(scratch);\n"
    ),
    "20.7 a parameter without brackets": Harm(
        "nmpc.h", r"#define NMPC_ANGLES 2", r"#define NMPC_TWICE(a) (2 * a)\n\g<0>"
    ),
    "2.3 in a file that is not listed": Harm("nmpc.h", r"\nvoid nmpc", r"\ntypedef int unused_t;\n\g<0>"),
}
FIXED_HARMS = {
    "10.7 beside a deviation from 10.1": Harm("nmpc.c", r"\* \(nmpc_real_t\)\(step_rad", r"* (step_rad"),
}


@pytest.fixture(autouse=True)
def _cppcheck() -> None:
    require("cppcheck", "cppcheck")


@pytest.mark.sampled(4)
@pytest.mark.long
@pytest.mark.parametrize("name", SETTINGS)
def test_nothing_but_listed_deviations_is_found(name: str, tmp_path: Path) -> None:
    """MISRA C:2012 and cppcheck's own findings, whatever the settings; each deviation occurs in its file."""
    its = subject(SETTINGS[name], tmp_path)
    result = check(its)
    assert result.outcome is CheckOutcome.PASSED, result.evidence
    listed = {
        (rule.removeprefix("misra-c2012-"), file) for rule, file in deviations(its.bundle / "deviations.txt")
    }
    assert {(rule, file) for rule, files in result.figures["deviations"].items() for file in files} == listed


@pytest.mark.parametrize(
    ("scalar", "harms"),
    [
        ("float32", [next(iter(HARMS))]),
        pytest.param("float32", [*HARMS][1:], marks=pytest.mark.long),
        pytest.param("fixed", [*FIXED_HARMS], marks=pytest.mark.long),
    ],
    ids=lambda words: words if isinstance(words, str) else ", ".join(words),
)
def test_an_unlisted_finding_fails(scalar: str, harms: list[str], tmp_path: Path) -> None:
    """It is named by rule, file and line; findings that do not touch each other are made at once."""
    wrong = {harm: (HARMS | FIXED_HARMS)[harm] for harm in harms}
    result = check(subject(with_option(ONE_NORM, "code.scalar", scalar, "test"), tmp_path, *wrong.values()))
    assert result.outcome is CheckOutcome.FAILED
    for harm, (path, _, _) in wrong.items():
        rule = harm.split(maxsplit=1)[0]
        assert re.search(rf"{re.escape(path)}:\d+: MISRA C:2012 rule {re.escape(rule)}(;|$)", result.evidence)


def test_every_deviation_is_in_the_manual() -> None:
    """The table of docs/reference/c-api.md has the rules and files of the list, no more and no less."""
    text = (Path(__file__).parents[2] / "docs" / "reference" / "c-api.md").read_text("utf-8")
    table = text[text.index("## MISRA") :].partition("\n## ")[0]
    rows = re.findall(r"^\| (\d+\.\d+) [^|]*\| ([^|]*) \|", table, re.MULTILINE)
    documented = {
        (f"misra-c2012-{rule}", file) for rule, files in rows for file in re.findall(r"`([^`]+)`", files)
    }
    fixed = with_option(ONE_NORM, "code.scalar", "fixed", "test")
    bundles = [render(settings) for settings in (ONE_NORM, fixed, presets.load("mambo"))]
    listed = {
        row
        for files in bundles
        for row in re.findall(r"^([\w.-]+):(\S+)$", files["deviations.txt"], re.MULTILINE)
    }
    assert documented == listed


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize(
    ("scalar", "rule", "harm"),
    [
        ("float32", "15.1", HARMS["15.1 goto"]),
        ("float32", "", None),
        ("fixed", "", None),
        ("fixed", "10.7", FIXED_HARMS["10.7 beside a deviation from 10.1"]),
    ],
)
def test_make_rules_comes_to_the_same_verdict(
    scalar: str, rule: str, harm: Harm | None, tmp_path: Path
) -> None:
    """The verdicts are those of the check on the same bundles, in the tests above."""
    require("make", "make")
    settings = with_option(ONE_NORM, "code.scalar", scalar, "test")
    its = subject(settings, tmp_path, *([harm] if harm else []))
    done = subprocess.run(
        ["make", "-s", "rules"], cwd=its.bundle, capture_output=True, text=True, check=False
    )
    assert (done.returncode == 0) == (harm is None), done.stderr
    assert f"misra-c2012-{rule}" in done.stderr or not rule


def test_cppcheck_without_its_addon_is_no_pass(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that knows nothing of MISRA C says so."""
    (tmp_path / "cppcheck").write_text("#!/bin/sh\nexit 0\n")
    (tmp_path / "cppcheck").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    result = check(subject(ONE_NORM, tmp_path))
    assert result.outcome is CheckOutcome.INCOMPLETE
    assert "addon" in result.evidence
