"""The record of the command `margins`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from markupsafe import Markup
from pydantic import BaseModel, ConfigDict, Field

from mambo_codegen.errors import echo
from mambo_sil.experiment.margins.axis_margins import PLACES, AxisName, Margins, PlaceName
from mambo_sil.experiment.margins.margin_figures import figure_table, number, verdict
from mambo_sil.flight.names import SensorsName
from mambo_sil.results.blocks import Block, CommandResult, Details, Picture, ResultTable, Sentence
from mambo_sil.results.summary import Number, ReportedSummary

PICTURES: Final = tuple(
    f"{name}.{kind}" for name in ("bode", "nyquist", "sensitivity") for kind in ("png", "svg")
)
RESPONSES: Final = "response.csv"
DRONES: Final = "drones.csv"
CAPTION: Final = (
    "The loop of each axis, broken at the command, roll and pitch also at the motors' torque. The circle "
    "encloses all loops with a sensitivity above 2."
)


class MarginSpread(BaseModel):
    """One figure over many drones; the worst is the least of a margin, the largest of a sensitivity."""

    model_config = ConfigDict(frozen=True)

    axis: AxisName
    place: PlaceName | None
    """None for a figure of the whole axis."""
    figure: str
    worst: Number
    median: Number
    drone: int
    """Number of the drone with the worst."""


class ManyDrones(BaseModel):
    """The margins of many drones; an unstable one counts as the worst."""

    model_config = ConfigDict(frozen=True)

    origin: str
    """Where the drones come from, in words."""
    drones: int
    unstable: int
    spreads: list[MarginSpread]
    worst_drone: int
    """One with the largest sensitivity of all places and axes; the first of the unstable ones, if any."""
    worst_values: dict[str, float | str]
    """What was drawn or changed for it."""

    @property
    def blocks(self) -> list[Block]:
        """How many are unstable, every figure, and the drone with the worst."""
        rows = []
        for one in self.spreads:
            where = "" if one.place is None else f" at {PLACES[one.place]}"
            scale, unit = (1e3, ", ms") if one.figure == "delay margin" else (1.0, "")
            worst, median = (number(scale * value) for value in (one.worst, one.median))
            rows.append((f"{one.axis}: {one.figure}{where}{unit}", worst, median, str(one.drone)))
        changed = ", ".join(f"{name} = {_spelled(value)}" for name, value in self.worst_values.items())
        return [
            Sentence(f"{self.drones} drones, {self.origin}; {self.unstable} unstable"),
            ResultTable(("", "worst", "median", "worst drone"), rows),
            Sentence(f"drone {self.worst_drone}: {changed}"),
        ]


class LeverMargins(BaseModel):
    """The least margins of all loops of a drone that is seen elsewhere than its controller was told."""

    model_config = ConfigDict(frozen=True)

    below_m: float
    """How far below that place; above it is negative."""
    unstable: AxisName | None
    """The axis that grows quickest, if one grows."""
    gain_up: Number
    delay_s: Number

    @classmethod
    def of(cls, below_m: float, axes: Sequence[Margins]) -> "LeverMargins":
        """Return what the margins of all axes have in common; 0 if one is unstable."""
        worst = max(axes, key=lambda axis: axis.poles.growth_1_s)
        if not worst.stable:
            return cls(below_m=below_m, unstable=worst.axis, gain_up=0.0, delay_s=0.0)
        loops = [loop for axis in axes for loop in axis.loops.values()]
        gain_up, delay_s = (min(getattr(loop, key) for loop in loops) for key in ("gain_up", "delay_s"))
        return cls(below_m=below_m, unstable=None, gain_up=gain_up, delay_s=delay_s)

    @property
    def words(self) -> str:
        """How far the loops are from instability."""
        where = f"{100.0 * abs(self.below_m):g} cm {'below' if self.below_m > 0.0 else 'above'}"
        if self.unstable is not None:
            return f"{where}, where {self.unstable} is UNSTABLE"
        return f"{where}, {self.gain_up:.2g} times the gain or {1e3 * self.delay_s:.0f} ms"


def _spelled(value: float | str) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


class MarginsSummary(ReportedSummary):
    """Margins of a controller on a drone; without axes, but with a reason, if no linear margin applies."""

    command = "margins"

    source: str
    settings: str
    """Digest of the settings."""
    vehicle: str
    sensors: SensorsName
    update_period_s: float
    reason: str | None = None
    axes: list[Margins] | None = None
    levers: list[LeverMargins] = Field(default_factory=list)
    many: ManyDrones | None = None
    all_figures: bool = Field(default=False, exclude=True)
    """Whether the result shows every figure unfolded."""

    @property
    def stable(self) -> bool:
        """Whether no loop of the drone itself is unstable."""
        return all(axis.stable for axis in self.axes or ())

    @property
    def verdicts(self) -> list[str]:
        """One line for each axis, in words; the reason if there are no margins."""
        if self.axes is None:
            return [self.reason or ""]
        return [verdict(axis) for axis in self.axes]

    @property
    def about(self) -> str:
        """Say whose margins these are."""
        state = "the true state" if self.sensors == "true" else f"sensors {self.sensors}"
        period = f"{1e3 * self.update_period_s:g} ms an update"
        return f"{echo(self.source)} on {echo(self.vehicle)}, {state}, {period}"

    @property
    def headline(self) -> tuple[str, str]:
        """The margins of the loop broken at the command, and whose they are, for a picture."""
        verdicts = "; ".join(line.partition("; at the motors")[0] for line in self.verdicts)
        return verdicts, f"{self.about}, at hover, without wind; bold bars: margins"

    def result(self, folder: Path, /) -> CommandResult:
        """Return the result: a verdict for each axis, every figure folded, and those of many drones."""

        def panels() -> list[Markup]:
            from mambo_sil.experiment.margins.margins_plots import margin_panels  # noqa: PLC0415 - slow to load
            from mambo_sil.experiment.margins.response_file import read_responses  # noqa: PLC0415

            return [Markup("\n").join(margin_panels(read_responses(folder / RESPONSES)))]

        blocks: list[Block] = []
        if self.axes is not None:
            heads = ("broken at", *(axis.axis for axis in self.axes), "")
            rows = [(name, *values, unit) for name, values, unit in figure_table(self.axes)]
            figures = ResultTable(heads, rows, (0, -1))
            shown = figures if self.all_figures else Details("All figures", [figures])
            blocks = [Picture(panels, CAPTION, [folder / RESPONSES]), shown]
        if self.levers:
            blocks.append(Sentence(f"seen elsewhere: {'; '.join(one.words for one in self.levers)}"))
        if self.many is not None:
            blocks += self.many.blocks
        return CommandResult(
            f"Margins of {self.source} on {self.vehicle}",
            None if self.axes is None else self.stable,
            [self.about, *self.verdicts],
            blocks,
        )
