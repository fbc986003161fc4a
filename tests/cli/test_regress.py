"""The command `regress`, used as a person would."""

import json
import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest

from mambo_codegen.errors import INTERRUPTED
from tests.support.command import command, run

SUITE = """
[baseline]
iae_m_s = 0.01
same_bits = true
[flight]
duration_s = 1.0
[flights.eight]
yaw_rad = [0.0, 0.8]
sensors = ["true", "mambo"]
bounds = { iae_m_s = 0.5 }
[flights.far]
trajectory = "step"
size_m = 2.0
start_offset_m = [0.5, 0.0, 0.0]
"""
FILES = {"summary.json", "junit.xml", "regress.png", "regress.svg", "flights"}


@pytest.fixture(scope="module", name="passed")
def _passed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run the suite with --json, whose text is in stdout.json; return the folder of its results."""
    folder = tmp_path_factory.mktemp("passed")
    (folder / "mine.toml").write_text(SUITE, "utf-8")
    done = command("regress", "mine.toml", "--json", "-o", "out", folder=folder)
    assert done.returncode == 0, done.stderr
    assert {path.name for path in folder.iterdir()} == {"mine.toml", "out"}
    (folder / "stdout.json").write_text(done.stdout, "utf-8")
    return folder


@pytest.fixture(autouse=True)
def _suite(_in_the_folder: None) -> None:
    Path("mine.toml").write_text(SUITE, "utf-8")


def break_suite() -> None:
    """Set a bound that no flight holds."""
    Path("mine.toml").write_text(SUITE.replace("iae_m_s = 0.5", "iae_m_s = 1e-6"), "utf-8")


@pytest.mark.long
def test_a_suite_passes_and_leaves_its_results(passed: Path) -> None:
    """Summary, which --json prints, JUnit XML and pictures; no record, because no flight failed."""
    out, said = passed / "out", (passed / "stdout.json").read_text("utf-8")
    assert {path.name for path in out.iterdir()} == FILES
    assert not list((out / "flights").iterdir())
    assert said == (out / "summary.json").read_text("utf-8")
    summary = json.loads(said, parse_constant=pytest.fail)
    assert [flight["checks"][0]["holds"] for flight in summary["flights"]] == [True] * 5
    assert ElementTree.parse(out / "junit.xml").getroot().get("tests") == "5"
    assert (out / "regress.png").read_bytes().startswith(b"\x89PNG")
    drawn = (out / "regress.svg").read_text("utf-8")
    assert ">\N{LESS-THAN OR EQUAL TO} 0.01<" in drawn
    assert ">\N{GREATER-THAN OR EQUAL TO} 100<" in drawn


@pytest.mark.long
def test_a_broken_bound_fails_and_its_flight_repeats_bit_for_bit() -> None:
    """Exit 1 names flight, metric, value and bound; the record is that of the flight."""
    break_suite()
    said, _ = run("regress", "mine.toml", "-o", "out", code=1)
    assert "mine with mambo on mambo: 1 of 5 flights passed, 4 failed" in said
    line = next(line for line in said.splitlines() if line.startswith("eight/yaw_rad=0.8,sensors=mambo: "))
    assert ": IAE " in line
    assert "(bound 1e-06)" in line
    assert len(list(Path("out/flights").iterdir())) == 4
    repeated, _ = run(
        "fly", "--repeat", "out/flights/0003-eight.json", "--json", "--no-pictures", "-o", "again"
    )
    assert json.loads(repeated)["same_bits_as_recorded"] is True
    flown = json.loads(Path("out/summary.json").read_text("utf-8"))["flights"][3]
    assert json.loads(repeated)["metrics"]["iae_m_s"] == flown["metrics"]["iae_m_s"]
    Path("mine.toml").write_text(SUITE, "utf-8")
    run("regress", "mine.toml", "-o", "out")
    assert not list(Path("out/flights").iterdir())


@pytest.mark.long
def test_recorded_flights_are_the_same_again_and_others_fail() -> None:
    """--update records; the same controller passes with the same bits, one with other weights fails."""
    _, said = run("regress", "mine.toml", "-o", "out", "--update")
    assert "mine.mambo.baseline.json: recorded 5 flights" in said
    run("regress", "mine.toml", "-o", "out")
    Path("mambo.toml").write_text("[cost]\neffort_weight = 0.5\n", "utf-8")
    said, _ = run("regress", "mine.toml", "--controller", "./mambo.toml", "-o", "out", code=1)
    assert "eight/yaw_rad=0,sensors=true: " in said
    assert "recorded 0." in said
    assert "the trace differs from the recorded one" in said
    assert "the controller's settings have changed since the metrics were recorded" in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["gone.toml"], "gone.toml is neither a shipped suite nor a file"),
        (["mine.toml", "--controller", "gone.toml"], "--controller gone.toml: gone.toml is neither a preset"),
        (["mine.toml", "--controller", "odd.toml"], "update_period_s = 0.007 must be a whole multiple"),
        (["wrong.toml"], "wrong.toml: flights.a.yaw is not a key of this file; did you mean yaw_rad"),
        (["other.toml"], "other.mambo.baseline.json: was recorded from other flights: 5 new"),
        (["mine.toml", "--update"], "mine.mambo.baseline.json: exists and is no baseline of mambo-nmpc"),
    ],
)
def test_a_refused_command_leaves_no_folder(arguments: list[str], message: str) -> None:
    """Exit 2, the reason, and nothing else."""
    Path("odd.toml").write_text("[horizon]\nupdate_period_s = 0.007\n", "utf-8")
    Path("wrong.toml").write_text("[flights.a]\nyaw = 1\n", "utf-8")
    Path("other.toml").write_text(SUITE, "utf-8")
    recorded = {"generator": "mambo-nmpc 0", "suite": "", "controller": "", "settings": "", "flights": {}}
    Path("other.mambo.baseline.json").write_text(json.dumps(recorded), "utf-8")
    Path("mine.mambo.baseline.json").write_text("mine", "utf-8")
    before = set(Path().iterdir())
    _, said = run("regress", *arguments, "-o", "out", code=2)
    assert message in said
    assert set(Path().iterdir()) == before
    assert Path("mine.mambo.baseline.json").read_text("utf-8") == "mine"


STOPPED = """
import os, signal
from mambo_nmpc.__main__ import main
from mambo_sil.experiment.campaign.executors import Pool
run = Pool.run
def run_and_stop(*arguments):
    for found in run(*arguments):
        os.killpg(0, signal.SIGINT)
        yield found
Pool.run = run_and_stop
main()
"""


@pytest.mark.long
def test_a_stopped_run_leaves_nothing_half_written(passed: Path) -> None:
    """Ctrl-C: neither folder nor baseline, and earlier results stay as they are."""
    done = command("regress", "mine.toml", "-o", "out", "--update", script=STOPPED)
    assert (done.returncode, done.stdout, done.stderr) == (INTERRUPTED, "", "")
    assert {path.name for path in Path().iterdir()} == {"mine.toml"}
    shutil.copytree(passed / "out", "out")
    before = {path: path.read_bytes() for path in Path("out").iterdir() if path.is_file()}
    command("regress", "mine.toml", "-o", "out", "--update", script=STOPPED)
    assert {path: path.read_bytes() for path in Path("out").iterdir() if path.is_file()} == before
    assert not Path("mine.mambo.baseline.json").exists()
