"""Table II: the command, Figure 3, and the table with sensors."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from mambo_codegen.settings import presets
from mambo_sil.experiment.table2.sensed import PRESETS, VIEWS, fly_sensed, sensed_markdown
from mambo_sil.experiment.table2.table2 import Claim, Table2Row, Table2Summary
from mambo_sil.experiment.table2.table2_plots import DRAWN, draw_figure3
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.names import PD_NAMES, PD_TITLES
from mambo_sil.flight.trajectories import Bernoulli
from mambo_sil.results.terminal import result_text
from tests.support.command import run

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def test_figure_3_labels_every_axis_with_its_unit(tmp_path: Path) -> None:
    """A column per controller, titles, units and one legend; nothing is cut off at the right edge."""
    flight = Flight(Bernoulli(2.0, 0.5), duration_s=63.0)
    flights = {
        PD_TITLES[name]: fly(flight, pd_controller(name, flight))
        for name in PD_NAMES
        if PD_TITLES[name] in DRAWN
    }
    _, svg = draw_figure3(flights, tmp_path / "figure3")
    texts = [element.text or "" for element in ElementTree.parse(svg).iter() if element.tag.endswith("text")]
    assert texts.count("x (north), m") == len(flights)
    assert texts.count("time, s") == 3 * len(flights)
    for wanted in ("y (east), m", "distance to the target, m", "roll, rad: a lap", "roll, rad: 1 s"):
        assert texts.count(wanted) == 1
    assert [text for text in texts if text.startswith("(")] == [
        f"({letter}) {DRAWN[name]}" for letter, name in zip("ab", flights, strict=True)
    ]
    assert [text for text in texts if text in ("target", "flown", "roll command", "roll")] == [
        *("target", "flown", "roll command", "roll")
    ]


@pytest.mark.long
def test_sensed_table_has_a_row_for_every_controller_and_view() -> None:
    """With the true state both indices are equal and the drift is 0; rows with noise have several flights."""
    shares: list[float] = []
    settings = {name: presets.load(name) for name in PRESETS}
    rows = fly_sensed(settings, shares.append, duration_s=1.0, flights=2)
    controllers = (*PD_TITLES.values(), *PRESETS)
    assert [(row.controller, row.view) for row in rows] == [(c, v) for c in controllers for v in VIEWS]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    for row in rows:
        assert (row.seen == row.tracked) == (row.view == "the truth")
        assert (row.drift_m == 0.0) == (row.view == "the truth")
        assert row.flights == (2 if row.view in ("mambo", "mambo-derotated") else 1)
    lines = sensed_markdown(rows).splitlines()
    assert len(lines) == 4 + len(rows)
    assert len({line.count("|") for line in lines}) == 1


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
