"""Pictures as PNG and SVG files, and as SVG for pages in their colours, light or dark."""

import hashlib
import io
import math
import re
from pathlib import Path
from typing import Final

from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from mambo_sil.results.style import BLUE, GREEN, GRID, INK, ORANGE, QUIET, TARGET

_VARIABLES: Final = {
    INK: "currentColor",
    QUIET: "var(--quiet)",
    GRID: "var(--line)",
    TARGET: "var(--target)",
    BLUE.lower(): "var(--flown)",
    ORANGE.lower(): "var(--other)",
    GREEN.lower(): "var(--good)",
}
"""CSS variable of the page for colours of pictures, as matplotlib spells them."""


class PlainLogFormatter(LogFormatter):
    """Labels the same ticks of a logarithmic axis, but writes 0.02 for 2e-02.

    At `least` and `most`, edges of the axis, stands what lies beyond, too; the labels say so.
    """

    def __init__(self, least: float = -math.inf, most: float = math.inf) -> None:
        super().__init__()
        self._signs = {least: "\N{LESS-THAN OR EQUAL TO} ", most: "\N{GREATER-THAN OR EQUAL TO} "}

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label of the tick at `x`, empty for one that has none."""
        return f"{self._signs.get(x, '')}{x:g}" if super().__call__(x, pos) else ""


def save(figure: Figure, stem: Path) -> tuple[Path, Path]:
    """Write a figure as PNG and SVG."""
    png, svg = stem.with_suffix(".png"), stem.with_suffix(".svg")
    _lay_out(figure)
    figure.savefig(png, metadata={"Software": None})
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg.write_text(_with_own_ids(_shorten_numbers(text.getvalue(), 2)), "utf-8")
    return png, svg


def inline(figure: Figure, description: str) -> Markup:
    """Return a figure as an SVG element: transparent, with the page's font and colours and unique ids."""
    _lay_out(figure)
    text = io.StringIO()
    figure.savefig(text, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<!--.*?-->|<(metadata|style).*?</\1>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'(<(?:g|svg)[^>]*?) id="[^"]*"', r"\1", svg)
    svg = re.sub(r'\sxmlns(:\w+)?="[^"]*"|\sversion="1.1"', "", svg).replace("xlink:href", "href")
    svg = _shorten_numbers(svg, 1)
    svg = re.sub(r"\s*\n(?:L )?", " ", svg)
    svg = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font-size: \1px", svg)
    svg = re.sub(r"; font-family: [^;\"]*", "", svg)
    svg = re.sub(r"(?<=: )#[0-9a-f]{6}", lambda colour: _VARIABLES.get(colour[0], colour[0]), svg)
    role = Markup('<svg role="img" aria-label="{}"').format(description)
    return Markup(_with_own_ids(svg).replace("<svg", role, 1))


def _lay_out(figure: Figure) -> None:
    """Compute the positions once; with a layout engine matplotlib draws everything twice for each file."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine(None)


def _shorten_numbers(svg: str, decimals: int) -> str:
    """Return the SVG with at most `decimals` in the numbers of its tags, which are points."""
    longer = re.compile(rf"(\d\.\d{{{decimals}}})\d+")
    return re.sub(r"<[^>]*>", lambda tag: longer.sub(r"\1", tag[0]), svg)


def _with_own_ids(svg: str) -> str:
    """Return the SVG with ids of markers and clips from its content; matplotlib's depend on last bits."""
    found = list(dict.fromkeys(re.findall(r' id="([a-z][0-9a-f]{10})"', svg)))
    numbered = {name: f"n{number}" for number, name in enumerate(found)}
    plain = re.sub("|".join(found), lambda name: numbered[name[0]], svg)
    digest = hashlib.sha256(plain.encode()).hexdigest()[:8]
    return re.sub("|".join(found), lambda name: f"s{digest}{numbered[name[0]]}", svg)
