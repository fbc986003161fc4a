"""All pictures share one style, which is legible in grey and gives the same bytes every time."""

import ast
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from mambo_sil.results.pictures import save
from mambo_sil.results.style import LOOKS, PD_LOOKS, looks, style

ROOT = Path(__file__).parents[2]
DRAWING = sorted(
    path
    for folder in ("sil", "benchmarks")
    for path in (ROOT / folder).rglob("*.py")
    if "matplotlib" in path.read_text("utf-8") and path.name != "style.py"
)
STYLED = {"color", "colors", "linewidth", "linewidths", "markersize", "fontsize", "fontfamily"}
EVERY_LOOK = (*LOOKS, *PD_LOOKS.values())


def test_there_are_modules_that_draw() -> None:
    """Else the next test would look at none."""
    assert len(DRAWING) > 10


@pytest.mark.parametrize("path", DRAWING, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_no_other_module_states_a_colour_or_a_width(path: Path) -> None:
    """Colours, widths and sizes of lines, markers and fonts have names in sil/mambo_sil/results/style.py."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            hexadecimal = set(node.value[1:]) <= set("0123456789abcdefABCDEF")
            assert not (node.value.startswith("#") and len(node.value) == 7 and hexadecimal), node.value
        if isinstance(node, ast.keyword) and node.arg in STYLED and isinstance(node.value, ast.Constant):
            assert node.value.value == 0, f"line {node.value.lineno}: {node.arg}={node.value.value!r}"


def test_looks_differ_without_colour() -> None:
    """Any two controllers differ in dashes and in marker, and every line is dark enough on paper."""
    for one, other in combinations(EVERY_LOOK, 2):
        assert one.dashes != other.dashes
        assert one.marker != other.marker
        assert one.colour != other.colour
    for look in EVERY_LOOK:
        assert float(np.dot(to_rgb(look.colour), (0.299, 0.587, 0.114))) < 0.7


def test_a_pd_keeps_its_look_in_any_company() -> None:
    """And a preset has the first look, wherever it stands."""
    assert looks(["mambo", "pd"])["pd"] == looks(["pd", "pd-feedforward", "x"])["pd"] == PD_LOOKS["pd"]
    assert looks(["pd", "mambo"])["mambo"] == looks(["mambo"])["mambo"] == LOOKS[0]


def test_a_picture_has_the_same_bytes_again(tmp_path: Path) -> None:
    """PNG and SVG hold neither date nor random names, and the SVG has short numbers."""
    contents = []
    for name in ("one", "two"):
        with style():
            figure = Figure(figsize=(2.0, 2.0), layout="constrained")
            figure.subplots().plot([0.0, 1.0 / 3.0, 1.0], [0.0, 0.7, 0.1], label="line", **LOOKS[1].line)
            png, svg = save(figure, tmp_path / name)
        contents.append((png.read_bytes(), svg.read_bytes()))
    assert contents[0] == contents[1]
    assert b"clip-path" in contents[0][1]
    assert not [one for one in contents[0][1].split(b'<path d="')[1:] if b".333" in one.partition(b'"')[0]]
