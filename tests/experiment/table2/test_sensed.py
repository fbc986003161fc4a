"""The table of the Table II case with sensors."""

import pytest

from mambo_codegen.settings import presets
from mambo_sil.experiment.table2.sensed import PRESETS, VIEWS, fly_sensed, sensed_markdown
from mambo_sil.flight.names import PD_TITLES


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
