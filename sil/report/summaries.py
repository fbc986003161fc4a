"""The summaries of result folders as records: what a folder holds, read back and checked."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Final

from pydantic import BaseModel, ConfigDict, ValidationError

from mambo_nmpc.codegen.errors import echo
from mambo_nmpc.sil.errors import ResultsError
from mambo_nmpc.sil.files.folders import SUMMARY

Number = float | None
"""A measured value; None where there is none, for JSON spells no NaN."""


class Record(BaseModel):
    """Part of a summary; keys of later versions are passed over."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class Summary(Record):
    """What every command writes first."""

    command: ClassVar[str]
    generator: str


class Flown(Summary):
    """What every flight found."""

    controller: str
    settings: str
    same_bits_as_host: bool | None
    lost: bool
    mostly_refused: bool
    refusals: list[str]
    metrics: dict[str, Number]
    metrics_without_transient: dict[str, Number] | None = None
    metrics_as_seen: dict[str, Number] | None = None


class FlySummary(Flown):
    """A flight."""

    command = "fly"
    source: str
    trajectory: str
    size_m: float
    rate_rad_s: float
    yaw_rad: float
    wind_m_s2: tuple[float, float]
    wind_speed_m_s: float = 0.0
    sensors: str = "none"
    motor_lag_s: float
    start: str
    duration_s: float
    board: str | None


class ReplayedScenario(Record):
    """How a recorded flight was flown."""

    trajectory: str
    size_m: float
    rate_rad_s: float
    duration_s: float
    start: str
    sensors: str
    seed: int


class ReplaySummary(Flown):
    """A recorded flight, flown again."""

    command = "fly --replay"
    replay: str
    scenario: ReplayedScenario
    same_bits_as_recorded: bool | None


class Table2Row(Record):
    """A controller in a case of Table II: IAE, ISE, ITSE, ITAE."""

    case: str
    controller: str
    measured: tuple[Number, Number, Number, Number]
    improvement: tuple[Number, Number, Number, Number] | None


class Claim(Record):
    """What the paper says, and whether it holds."""

    text: str
    holds: bool
    evidence: str


class Table2Summary(Summary):
    """Table II."""

    command = "table2"
    rows: list[Table2Row]
    claims: list[Claim]


class SensedRow(Record):
    """A controller with one view of the state: medians over its flights."""

    controller: str
    view: str
    flights: int
    lost: int
    tracked: tuple[Number, Number, Number, Number]
    seen: tuple[Number, Number, Number, Number]
    worst_iae_m_s: Number
    drift_m: Number


class SensedSummary(Summary):
    """The Table II case through sensors and estimators."""

    command = "table2 --sensors"
    rows: list[SensedRow]


class Limit(Record):
    """A measured value beside its budget."""

    name: str
    value: float
    budget: float
    unit: str
    share: float
    percent: str
    width: float


class Function(Record):
    """A symbol of the program; a dash is what was not measured."""

    name: str
    size: int | str
    frame: int | str
    depth: int | str
    instructions: int | str


class BoardFootprint(Record):
    """The footprint on one board."""

    name: str
    title: str
    core: str
    compiler: str
    fits: bool
    complete: bool
    limits: list[Limit]
    functions: list[Function]
    notes: list[str]
    instructions: dict[str, float] | None
    time_s_estimate: tuple[float, float] | None


class FootprintSummary(Summary):
    """Footprints on boards."""

    command = "footprint"
    source: str
    digest: str
    scalar: str
    optimisation: str
    boards: list[BoardFootprint]


class SweepPoint(Record):
    """A controller of the grid."""

    prediction: int
    control: int
    iterations: int
    flash_bytes: int
    ram_bytes: int
    stack_bytes: Number
    instructions: Number
    time_ms: Number
    iae_m_s: Number
    fits: bool


class SweepSummary(Summary):
    """A grid of horizons and iterations."""

    command = "sweep"
    source: str
    settings: str
    board: str
    budget: dict[str, float] = {}
    points: list[SweepPoint]
    largest_fit: SweepPoint | None


class FaultFlight(Record):
    """What became of one fault on one course."""

    course: str
    fault: str
    statuses: list[str]
    largest_command_rad: Number
    largest_tilt_rad: Number
    largest_error_m: Number
    recovery_s: Number
    end: str


class FaultsSummary(Summary):
    """Flights with faults."""

    command = "faults"
    source: str
    settings: str
    flights: list[FaultFlight]


class VerifiedCheck(Record):
    """A check of the generated C, and how it ended."""

    name: str
    about: str
    outcome: str
    evidence: str


class VerifySummary(Summary):
    """A verification."""

    command = "verify"
    source: str
    digest: str
    scalar: str
    verdict: str
    not_run: list[str]
    checks: list[VerifiedCheck]
    tools: dict[str, str]
    settings: str


class CampaignFlight(Record):
    """What all flights of a campaign have in common."""

    trajectory: str
    size_m: float
    rate_rad_s: float
    duration_s: float
    sensors: str


class Entrant(Record):
    """A controller of a campaign."""

    name: str


class Drawn(Record):
    """What a campaign flies; the first controller is the one that the others are compared with."""

    seed: int
    flight: CampaignFlight
    controllers: list[Entrant]


class Proportion(Record):
    """A share of flights with its interval."""

    count: int
    flights: int
    share: float
    low: float
    high: float


class Distributions(Record):
    """What became of a controller over all flights: quantiles by index and share."""

    crashed: Proportion
    refused_an_input: Proportion
    quantiles: dict[str, dict[str, Number]]


class Improvement(Record):
    """An index of the first controller over that of another."""

    controller: str
    index: str
    median: Number
    low: Number
    high: Number
    better: Proportion


class WorstFlight(Record):
    """A flight to look at, with the record that flies it again."""

    flight: int
    crashed: bool
    iae_m_s: Number
    max_error_m: Number
    record: str


class CampaignSummary(Summary):
    """A finished campaign."""

    command = "campaign"
    campaign: Drawn
    flights: int
    controllers: dict[str, Distributions]
    improvements: list[Improvement]
    worst: dict[str, list[WorstFlight]]


class UnfinishedCampaign(Drawn, Summary):
    """What a campaign says of itself before its last flight."""

    command = "campaign"


_KINDS: Final[dict[str, type[Summary]]] = {
    kind.command: kind
    for kind in (
        FlySummary,
        ReplaySummary,
        Table2Summary,
        SensedSummary,
        FootprintSummary,
        SweepSummary,
        FaultsSummary,
        VerifySummary,
        CampaignSummary,
    )
}


_UNFINISHED: Final = "campaign.json"
"""The file that a campaign begins with; its summary comes last."""


def read_summary(folder: Path) -> Summary:
    """Return the summary of a result folder, which names the command; raises ResultsError."""
    commands = ", ".join(_KINDS)
    if (folder / SUMMARY).is_file():
        return _read(folder / SUMMARY, _KINDS)
    if (folder / _UNFINISHED).is_file():
        return _read(folder / _UNFINISHED, {UnfinishedCampaign.command: UnfinishedCampaign})
    what = f"holds no {SUMMARY}" if folder.is_dir() else "is no folder"
    raise ResultsError(f"{echo(str(folder))}: {what}; expected is a result folder of {commands}")


def _read(path: Path, kinds: Mapping[str, type[Summary]]) -> Summary:
    """Return the summary at `path`, of one of the `kinds` by command; raises ResultsError."""
    name = echo(str(path))
    try:
        summary: Any = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ResultsError(f"{name}: cannot be read as JSON: {error}; run its command again") from error
    command = summary.get("command") if isinstance(summary, dict) else None
    if not isinstance(command, str) or command not in kinds:
        raise ResultsError(f"{name}: command = {echo(str(command))} must be one of {', '.join(kinds)}")
    try:
        return kinds[command].model_validate(summary)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        raise ResultsError(
            f"{name}: {echo(key)} is not what {command} writes: {first['msg']}; run {command} again"
        ) from error
