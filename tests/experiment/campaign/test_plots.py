"""The picture of a campaign."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from mambo_sil.experiment.campaign.campaign_plots import draw_campaign
from mambo_sil.experiment.campaign.statistics import COMPARED


def test_few_very_large_values_leave_the_others_wide(tmp_path: Path) -> None:
    """One flight of a hundred that gets lost does not squeeze the curves: its value has no tick."""
    values = np.geomspace(10.0, 40.0, 100)
    table = {
        f"{name}_{index}": values * factor
        for name, factor in (("pd", 2.0), ("mambo", 1.0))
        for index in COMPARED
    }
    table |= {f"{name}_crashed": np.zeros(100) for name in ("pd", "mambo")}
    for index in COMPARED:
        table[f"mambo_{index}"] = np.append(values[:-1], 1e7)
    _, svg = draw_campaign(table, ["pd", "mambo"], tmp_path / "campaign")
    texts = [element.text or "" for element in ElementTree.parse(svg).iter() if element.tag.endswith("text")]
    assert {"10", "30"} <= set(texts)
    assert "1e+06" not in texts
    assert "IAE, m s" in texts
    assert "IAE: improvement on pd" in texts
