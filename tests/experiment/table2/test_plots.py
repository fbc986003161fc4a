"""Figure 3, flown again."""

from pathlib import Path
from xml.etree import ElementTree

from mambo_sil.experiment.table2.table2_plots import DRAWN, draw_figure3
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.names import PD_NAMES, PD_TITLES
from mambo_sil.flight.trajectories import Bernoulli


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
