"""The command verify, used as a person would: lines, verdict, evidence, and what a missing tool does."""

import json
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import pytest

from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.presets import preset
from mambo_sil.results.terminal import result_text
from mambo_sil.verify.check import CHECKS, CheckOutcome
from mambo_sil.verify.sarif import sarif
from mambo_sil.verify.verify_report import Verified, summarise, verdict
from tests.support.command import run, unwrapped
from tests.support.tools import require

HOSTILE = '<img src=x onerror="alert(1)">&.toml'


def ended(*outcomes: CheckOutcome) -> list[Verified]:
    """Return checks that ended so."""
    return [
        Verified(entry.name, entry.about, one, "", {}, {})
        for entry, one in zip(CHECKS, outcomes, strict=False)
    ]


@pytest.mark.long
def test_evidence_is_complete_and_its_digests_hold(tmp_path: Path) -> None:
    """Settings, C, reports, page and summary; stdout repeats the summary, and a hostile name is text."""
    require("cppcheck", "cppcheck")
    (tmp_path / HOSTILE).write_text('[code]\nprefix = "drone"\n')
    said, _ = run("verify", HOSTILE, "--scalar", "float64", "--only", "rules", "--json", "-o", "evidence")
    evidence = tmp_path / "evidence"
    assert said == (evidence / "summary.json").read_text("utf-8")
    summary = json.loads(said, parse_constant=pytest.fail)
    assert (summary["source"], summary["verdict"]) == (HOSTILE, "passed")
    assert summary["not_run"] == [entry.name for entry in CHECKS if entry.name != "rules"]
    (rules,) = summary["checks"]
    assert rules["tools"] == summary["tools"]
    assert rules["tools"]["cppcheck"]

    files = {path.relative_to(evidence).as_posix() for path in evidence.rglob("*") if path.is_file()}
    assert files == {*summary["files"], "summary.json"}
    for path, digest in summary["files"].items():
        assert sha256((evidence / path).read_bytes()).hexdigest() == digest
    for path in ("controller/controller.toml", "controller/drone.c", "checks/rules/cppcheck.txt"):
        assert path in files
    assert 'scalar = "float64"' in (evidence / "controller" / "controller.toml").read_text("utf-8")

    page = (evidence / "verify.html").read_text("utf-8")
    assert "<img" not in page
    assert "&lt;img src=x onerror=" in page
    assert "href=" not in page
    for word in ("passed", "deviations.txt", summary["digest"], "not run: warnings", "prefix"):
        assert word in page


@pytest.mark.long
@pytest.mark.usefixtures("_no_tool")
def test_without_tools_the_verdict_is_incomplete(tmp_path: Path) -> None:
    """Exit 1, never "passed", and every package that is missing is named; the C is kept all the same."""
    checks = ["warnings", "rules", "proof", "sanitizers", "fuzzing", "bits"]
    said, _ = run("verify", "--only", ",".join(checks), code=1)
    lines = said.splitlines()
    results = [line.split()[:2] for line in lines[3:] if not line.startswith(" ")]
    assert results == [[name, "incomplete"] for name in checks]
    for package in ("gcc", "g++", "clang", "cppcheck", "frama-c-base"):
        assert f"(Debian: {package})" in unwrapped(said)
    assert lines[0] == "mambo: 0 of 6 checks passed, 6 incomplete; not run: faults"
    assert (tmp_path / "verification" / "controller" / "nmpc.c").is_file()


def test_sarif_has_a_result_for_each_check_that_did_not_pass() -> None:
    """Of rules the lines that break them, in addresses that an editor finds; a passed check has none."""
    passed, failed, incomplete = CheckOutcome.PASSED, CheckOutcome.FAILED, CheckOutcome.INCOMPLETE
    warnings, rules, proof = ended(passed, failed, incomplete)
    broken = [{"file": "nmpc.c", "line": 7, "rule": "misra-c2012-10.4", "message": "types"}]
    found = [warnings, replace(rules, figures={"findings": broken}), replace(proof, evidence="no frama-c")]
    document = json.loads(sarif(summarise(found, "mambo", preset("mambo")), Path("an evidence/controller")))
    assert document["version"] == "2.1.0"
    (run_,) = document["runs"]
    ids = [rule["id"] for rule in run_["tool"]["driver"]["rules"]]
    assert ids == [entry.name for entry in CHECKS]
    results = run_["results"]
    assert [(one["ruleId"], one["level"]) for one in results] == [("rules", "error"), ("proof", "warning")]
    assert [ids[one["ruleIndex"]] for one in results] == ["rules", "proof"]
    assert [one["message"]["text"] for one in results] == ["misra-c2012-10.4: types", "no frama-c"]
    (place,) = results[0]["locations"]
    assert place["physicalLocation"] == {
        "artifactLocation": {"uri": "an%20evidence/controller/nmpc.c"},
        "region": {"startLine": 7},
    }


@pytest.mark.usefixtures("_no_tool")
def test_an_earlier_run_is_replaced_and_nothing_else(tmp_path: Path) -> None:
    """What somebody put between the reports is not lost."""
    run("verify", "--only", "rules,proof", code=1)
    _, talk = run("verify", "--only", "rules", "--sarif", code=1)
    assert "summary.json, verify.sarif, controller/" in talk
    assert (tmp_path / "verification" / "verify.sarif").is_file()
    assert [path.name for path in (tmp_path / "verification" / "checks").iterdir()] == ["rules"]
    (tmp_path / "verification" / "checks" / "notes.txt").write_text("mine")
    _, talk = run("verify", "--only", "rules", code=2)
    assert "notes.txt: is not a result of mambo-nmpc" in talk
    assert (tmp_path / "verification" / "checks" / "notes.txt").read_text() == "mine"


@pytest.mark.usefixtures("_no_tool")
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--only", "rules,prove"],
            "--only rules,prove: prove is not a check; the checks are warnings, rules, proof",
        ),
        (["mamba"], "did you mean mambo?"),
    ],
)
def test_bad_input_gets_a_message_and_exit_2(arguments: list[str], message: str, tmp_path: Path) -> None:
    """Nothing is written."""
    assert message in run("verify", *arguments, code=2)[1]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("outcomes", "whole"),
    [
        ((CheckOutcome.PASSED, CheckOutcome.PASSED), CheckOutcome.PASSED),
        ((CheckOutcome.PASSED, CheckOutcome.INCOMPLETE), CheckOutcome.INCOMPLETE),
        ((CheckOutcome.INCOMPLETE, CheckOutcome.FAILED), CheckOutcome.FAILED),
    ],
)
def test_the_verdict_is_the_worst_outcome(outcomes: tuple[CheckOutcome, ...], whole: CheckOutcome) -> None:
    """A failure outweighs a gap, and a gap everything that passed."""
    assert verdict(ended(*outcomes)) is whole
    text = unwrapped(result_text(summarise(ended(*outcomes), "mambo", Settings()).result(Path())))
    passed = outcomes.count(CheckOutcome.PASSED)
    assert text.startswith(f"mambo: {passed} of {len(outcomes)} checks passed")
    assert (", 1 failed" in text) is (whole is CheckOutcome.FAILED)
    assert f"; not run: {CHECKS[2].name}" in text


def test_checks_have_names_and_order() -> None:
    """Each is named once, and what it is about fits a line."""
    order = ["warnings", "rules", "proof", "sanitizers", "fuzzing", "bits", "faults"]
    assert [entry.name for entry in CHECKS] == order
    assert all(callable(entry.check) and "\n" not in entry.about for entry in CHECKS)
