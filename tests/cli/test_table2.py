"""The command `table2`, used as a person would."""

import json
from pathlib import Path

import pytest

from mambo_sil.experiment.table2.table2 import Claim, Table2Row, Table2Summary
from mambo_sil.results.terminal import result_text
from tests.support.command import run


@pytest.mark.long
def test_table2_judges_the_claims(tmp_path: Path) -> None:
    """The PD row is reproduced, table1 and mambo beat the claim, the printed step does not fly."""
    claims = json.loads(run("table2", "--json")[0])["claims"]
    verdicts = {claim["text"].split(" improves")[0]: claim["holds"] for claim in claims}
    assert verdicts == {
        "the PD has its printed indices on Bernoulli 0.5 rad/s": True,
        "the PD has its printed indices on Bernoulli 0.25 rad/s": False,
        "the PD has its printed indices on Gerono 0.25 rad/s": False,
        "mambo": True,
        "mambo-1norm": True,
        "table1": True,
        "table1-printed": False,
    }
    assert (tmp_path / "table2" / "figure3.png").is_file()
    assert "holds results of table2, not of fly" in run("fly", "-o", "table2", code=2)[1]


@pytest.mark.long
def test_table2_flies_the_presets_in_another_scalar_type() -> None:
    """The row of a preset is what `fly` has of it with the same option."""
    summary = json.loads(run("table2", "--scalar", "fixed", "--json")[0])
    assert summary["scalar"] == "fixed"
    row = next(row for row in summary["rows"] if row["controller"] == "mambo")
    flown = json.loads(run("fly", "--scalar", "fixed", "--json", "--no-pictures")[0])
    assert flown["metrics"]["iae_m_s"] == row["measured"][0]


@pytest.mark.parametrize("sensors", [[], ["--sensors"]])
def test_table2_refuses_an_unknown_scalar_type(sensors: list[str], tmp_path: Path) -> None:
    """Before anything flies or is written, with what there is."""
    said, talk = run("table2", "--scalar", "flat", *sensors, code=2)
    assert said == ""
    assert talk.startswith('--scalar: code.scalar = "flat" must be "float32" or ')
    assert not list(tmp_path.iterdir())


def test_table2_reads_as_a_finding_and_not_as_a_failure() -> None:
    """Ratios are named, and a claim that does not hold is the paper's."""
    row = Table2Row("Bernoulli 0.5 rad/s", "mambo", (1.0, 2.0, 3.0, 4.0), (5.0, 6.0, 7.0, 8.0), 0.0123)
    claims = [Claim("it flies", True, "1 %"), Claim("it lands", False, "90 %")]
    text = result_text(Table2Summary(scalar=None, cases=[row.case], rows=[row], claims=claims).result(Path()))
    lines = text.splitlines()
    assert lines[0] == "mambo on mambo: 1 cm in the mean on Bernoulli 0.5 rad/s"
    assert "improvement: IAE of the flown PD" in text
    flown = next(line for line in lines if line.startswith("flown mambo"))
    assert flown.split() == ["flown", "mambo", "1", "2", "3", "4", "5", "0.0123"]
    assert lines[-3:] == [
        "verdict        the paper's claims, as flown here",
        "holds          it flies: 1 %",
        "does not hold  it lands: 90 %",
    ]
