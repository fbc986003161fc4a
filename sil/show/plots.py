"""Pictures: the common style, PNG and SVG files, and SVG for pages in their colours, light or dark."""

import contextlib
import hashlib
import io
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

TARGET, FLOWN, COMMAND = "#c4c4c4", "#0072B2", "#E69F00"
"""Colours that colour-blind readers and grey prints can distinguish (Okabe and Ito)."""
THIRD = "#2ca02c"

PANEL_INCHES: Final = 4.2
"""Width of a picture on a page, which shows two side by side."""

_STYLE: Final[dict[Any, Any]] = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "mambo-nmpc",
}
_VARIABLES: Final = {
    "#000000": "currentColor",
    "#444444": "var(--quiet)",
    "#e6e6e6": "var(--line)",
    TARGET.lower(): "var(--target)",
    FLOWN.lower(): "var(--flown)",
    COMMAND.lower(): "var(--other)",
    THIRD: "var(--good)",
    "#1f77b4": "var(--flown)",
    "#ff7f0e": "var(--other)",
}
"""CSS variable of the page for each colour of a picture, the first three of matplotlib's cycle included."""


@contextlib.contextmanager
def style() -> Iterator[None]:
    """Set the common style, independent of the user's matplotlibrc; missing glyphs give no warning."""
    with mpl.rc_context(), warnings.catch_warnings():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        warnings.filterwarnings("ignore", "Glyph .* missing", UserWarning)
        yield


class PlainLogFormatter(LogFormatter):
    """Labels the same ticks of a logarithmic axis, but writes 0.02 for 2e-02."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label of the tick at `x`, empty for one that has none."""
        return f"{x:g}" if super().__call__(x, pos) else ""


def save(figure: Figure, stem: Path) -> tuple[Path, Path]:
    """Write a figure as PNG and SVG."""
    png, svg = stem.with_suffix(".png"), stem.with_suffix(".svg")
    figure.savefig(png, dpi=160, metadata={"Software": None})
    figure.set_layout_engine("none")  # keep the positions instead of computing them again
    figure.savefig(svg, metadata={"Date": None, "Creator": None})
    return png, svg


def inline(figure: Figure, description: str) -> Markup:
    """Return a figure as an SVG element: transparent, with the page's font and colours and unique ids."""
    text = io.StringIO()
    figure.savefig(text, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<!--.*?-->|<(metadata|style).*?</\1>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'(<(?:g|svg)[^>]*?) id="[^"]*"', r"\1", svg)
    svg = re.sub(r'\sxmlns(:\w+)?="[^"]*"|\sversion="1.1"', "", svg).replace("xlink:href", "href")
    svg = re.sub(r"<[^>]*>", lambda tag: re.sub(r"(\d\.\d)\d+", r"\1", tag[0]), svg)
    svg = re.sub(r"\s*\n(?:L )?", " ", svg)
    svg = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font-size: \1px", svg)
    svg = re.sub(r"; font-family: [^;\"]*", "", svg)
    svg = re.sub(r"(?<=: )#[0-9a-f]{6}", lambda colour: _VARIABLES.get(colour[0], colour[0]), svg)
    role = Markup('<svg role="img" aria-label="{}"').format(description)
    return Markup(_with_own_ids(svg).replace("<svg", role, 1))


def _with_own_ids(svg: str) -> str:
    """Return the SVG with ids derived from its content; matplotlib's depend on last bits of positions."""
    found = list(dict.fromkeys(re.findall(r' id="([^"]+)"', svg)))
    numbered = {name: f"n{number}" for number, name in enumerate(found)}
    plain = re.sub("|".join(found), lambda name: numbered[name[0]], svg)
    digest = hashlib.sha256(plain.encode()).hexdigest()[:8]
    return re.sub("|".join(found), lambda name: f"s{digest}{numbered[name[0]]}", svg)
