"""The command `faults`, used as a person would."""

import json
from pathlib import Path

import pytest

from mambo_sil.cli.fly.commands import FAULTS_FILES
from mambo_sil.cli.options import load
from tests.support.command import run


@pytest.mark.long
def test_faults_leave_table_picture_and_json(tmp_path: Path) -> None:
    """CSV, PNG, SVG and the summary, which stdout repeats; with the scalar type that was asked for."""
    said, _ = run("faults", "table1", "--scalar", "fixed", "--json", "-o", "out")
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} == {*FAULTS_FILES, "summary.json"}
    assert (out / "faults.png").read_bytes().startswith(b"\x89PNG")
    assert said == (out / "summary.json").read_text("utf-8")
    summary = json.loads(said, parse_constant=pytest.fail)
    assert summary["settings"] == load("table1", "fixed").digest
    flights = summary["flights"]
    lines = (out / "faults.csv").read_text("utf-8").splitlines()
    assert len(lines) == 1 + len(flights)
    assert {flight["end"] for flight in flights} == {"recovered", "not recovered"}
    assert flights[1]["statuses"] == ["BAD_STATE"]
    assert lines[2].startswith("eight,")
    assert ",BAD_STATE," in lines[2]


def test_settings_that_cannot_be_flown_are_refused_by_key(tmp_path: Path) -> None:
    """A period that is no multiple of the stock loops' is named with its file; nothing is left behind."""
    (tmp_path / "odd.toml").write_text("[horizon]\nupdate_period_s = 0.007\n", "utf-8")
    _, said = run("faults", "odd.toml", "-o", "out", code=2)
    assert "odd.toml: horizon.update_period_s = 0.007" in said
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_a_range_that_the_course_exceeds_is_named(tmp_path: Path) -> None:
    """The controller would refuse the figure of eight."""
    (tmp_path / "small.toml").write_text("[ranges]\nposition_m = 1.5\n", "utf-8")
    _, said = run("faults", "small.toml", "-o", "out", code=2)
    assert "small.toml: ranges.position_m = 1.5" in said
