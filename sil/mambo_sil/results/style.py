"""The style of all pictures: colours, dashes, markers, widths and sizes, fit for print.

Colours are those of Okabe and Ito (Color Universal Design, 2008), which colour-blind readers distinguish. In
grey some are alike: so lines that are to be told apart differ in dashes or width too, dots in their marker.
"""

import contextlib
import textwrap
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.rcsetup import cycler

BLUE: Final = "#0072B2"
ORANGE: Final = "#E69F00"
GREEN: Final = "#009E73"
VERMILION: Final = "#D55E00"
PURPLE: Final = "#CC79A7"
SKY: Final = "#56B4E9"
BROWN: Final = "#8C510A"

TARGET, FLOWN, COMMAND = "#c4c4c4", BLUE, ORANGE
"""Colours of what all pictures of flights show."""
INK: Final = "#000000"
QUIET: Final = "#444444"
"""Limits and other lines to compare with."""
GRID: Final = "#e6e6e6"

BROAD: Final = 2.5
"""Width in points of a line that another one covers."""
ARM: Final = 1.5
"""Of the arms and rotors of a drone."""
THIN: Final = 0.7
DOT: Final = 3.5
"""Size of a marker in points."""

COLUMN_INCHES: Final = 3.5
"""Width of a column of a journal, and of a picture on a page, which shows two side by side."""
PAGE_INCHES: Final = 7.16
"""Width of a page of a journal, two columns."""
SMALL: Final = 7.0
"""Size of the font beside ticks and in crowded legends."""
_HEADLINE: Final = 8.5

Dashes = str | tuple[float, tuple[float, ...]]

_STYLE: Final[dict[Any, Any]] = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "legend.fontsize": SMALL,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.prop_cycle": cycler(color=[BLUE, ORANGE, GREEN, VERMILION, PURPLE, SKY, INK]),
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.0,
    "lines.markersize": DOT,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "savefig.dpi": 220,
    "svg.fonttype": "none",
    "svg.hashsalt": "mambo-nmpc",
}


@dataclass(frozen=True)
class Look:
    """How one of several lines is drawn."""

    colour: str
    dashes: Dashes
    marker: str

    @property
    def line(self) -> dict[str, Any]:
        """Arguments of `Axes.plot` for a line."""
        return {"color": self.colour, "linestyle": self.dashes}

    @property
    def dots(self) -> dict[str, Any]:
        """Arguments of `Axes.plot` for dots."""
        return {"color": self.colour, "linestyle": "none", "marker": self.marker}


LOOKS: Final = (
    Look(BLUE, "solid", "o"),
    Look(VERMILION, (0.0, (6.0, 1.5, 1.0, 1.5)), "D"),
    Look(PURPLE, (0.0, (3.0, 1.0, 1.0, 1.0, 1.0, 1.0)), "^"),
    Look(INK, (0.0, (8.0, 2.0)), "v"),
    Look(SKY, (0.0, (2.0, 1.0)), "P"),
)
"""Looks in the order in which controllers get them, but for those with one of their own."""
PD_LOOKS: Final = {
    "pd": Look(ORANGE, (0.0, (1.0, 1.0)), "s"),
    "pd-feedforward": Look(GREEN, (0.0, (4.0, 1.5)), "X"),
    "pid-feedforward": Look(BROWN, (0.0, (5.0, 1.0, 2.0, 1.0)), "<"),
}


def looks(names: Sequence[str]) -> dict[str, Look]:
    """Return the look of each controller; the laws without a model have looks of their own."""
    others = [name for name in names if name not in PD_LOOKS]
    return {
        name: PD_LOOKS[name] if name in PD_LOOKS else LOOKS[others.index(name) % len(LOOKS)] for name in names
    }


@contextlib.contextmanager
def style() -> Iterator[None]:
    """Set the style, independent of the user's matplotlibrc; missing glyphs give no warning."""
    with mpl.rc_context(), warnings.catch_warnings():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        warnings.filterwarnings("ignore", "Glyph .* missing", UserWarning)
        yield


_LETTERS_AN_INCH: Final = 13.5
"""Letters of the headline that fit into an inch, those of a bold line included."""
_LINE_INCHES: Final = 0.15


def add_headline(figure: Figure, message: str, about: str) -> None:
    """Put what a picture says above it, and in grey below that what was flown, how often and where."""
    letters = int(_LETTERS_AN_INCH * figure.get_figwidth())
    bold, quiet = textwrap.wrap(message, letters), textwrap.wrap(about, int(1.15 * letters))
    height = figure.get_figheight()
    look: dict[str, Any] = {"ha": "left", "va": "top", "parse_math": False, "fontsize": _HEADLINE}
    below = 1.0 - (0.06 + _LINE_INCHES * len(bold)) / height
    figure.text(0.01, 1.0 - 0.05 / height, "\n".join(bold), fontweight="bold", **look)
    figure.text(0.01, below, "\n".join(quiet), color=QUIET, **look)
    engine = figure.get_layout_engine()
    if isinstance(engine, ConstrainedLayoutEngine):
        engine.set(rect=(0.0, 0.0, 1.0, below - (0.05 + _LINE_INCHES * len(quiet)) / height))
