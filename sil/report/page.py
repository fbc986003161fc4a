"""One page of whatever has been run: result folders in, HTML out; a pure function of the folders."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mambo_nmpc.sil.campaign.store import TABLE
from mambo_nmpc.sil.campaign.table import read_table
from mambo_nmpc.sil.flight.report import named
from mambo_nmpc.sil.flight.traces import Trace, read_npz
from mambo_nmpc.sil.footprint.sweep import Point
from mambo_nmpc.sil.paper.table2 import INDICES, PD, PRINTED_IMPROVEMENT, PRINTED_NMPC, PRINTED_PD
from mambo_nmpc.sil.report.plots import distributions, flight_columns, sweep_panels
from mambo_nmpc.sil.report.summaries import (
    CampaignSummary,
    FaultsSummary,
    Flown,
    FlySummary,
    FootprintSummary,
    ReplayedScenario,
    ReplaySummary,
    SensedSummary,
    Summary,
    SweepPoint,
    SweepSummary,
    Table2Summary,
    UnfinishedCampaign,
    VerifySummary,
    read_summary,
)
from mambo_nmpc.sil.show.animation import animate
from mambo_nmpc.sil.show.page import render_page


@dataclass(frozen=True)
class Section:
    """What a page shows of one folder.

    good:     whether what was run came out well; None if there is nothing to judge.
    finding:  the result in a line.
    missing:  files of the folder that would have shown more.
    content:  what the template of the command fills itself with.
    """

    command: str
    folder: str
    title: str
    good: bool | None
    finding: str
    missing: list[str]
    content: dict[str, Any]


def report_page(folders: Sequence[Path]) -> str:
    """Return a page of result folders, in their order; raises ResultsError and TraceError."""
    summaries = [read_summary(folder) for folder in folders]
    sections = [_section(folder, summary) for folder, summary in zip(folders, summaries, strict=True)]
    generators = sorted({summary.generator for summary in summaries})
    moves = any(section.content.get("animation") for section in sections)
    context = {"sections": sections, "generators": generators, "moves": moves}
    return render_page("report.html.j2", context)


def _section(folder: Path, summary: Summary) -> Section:  # noqa: PLR0911 - a command a line
    match summary:
        case FlySummary():
            return _fly(folder, summary)
        case ReplaySummary():
            return _replay(folder, summary)
        case SensedSummary():
            return _sensed(folder, summary)
        case Table2Summary():
            return _table2(folder, summary)
        case FootprintSummary():
            return _footprint(folder, summary)
        case SweepSummary():
            return _sweep(folder, summary)
        case FaultsSummary():
            return _faults(folder, summary)
        case VerifySummary():
            return _verify(folder, summary)
        case CampaignSummary() | UnfinishedCampaign():
            return _campaign(folder, summary)
    raise AssertionError(summary)


def _fly(folder: Path, summary: FlySummary) -> Section:
    name = "PD" if summary.controller == "pd" else f"NMPC, {summary.source}"
    bits = "" if summary.same_bits_as_host is not True else ", bit for bit as on the desk"
    facts = {
        **_course(summary),
        "controller": f"{summary.controller}, settings {summary.settings[:16]} of {summary.source}",
        "start": f"{summary.start}, heading {summary.yaw_rad:g} rad",
        "disturbance": "push of {:g}, {:g} m/s²".format(*summary.wind_m_s2)
        + f"; moving air {summary.wind_speed_m_s:g} m/s; motor lag {summary.motor_lag_s:g} s",
    }
    if summary.board is not None:
        facts["flown on"] = f"the emulated core of {summary.board}{bits}"
    bad = []
    if summary.same_bits_as_host is False:
        bad = [f"the trace of {summary.board} differs from that of the desk"]
    return _flight(folder, summary, (name, f"Flight: {name}, {summary.trajectory}"), facts, bad)


def _replay(folder: Path, summary: ReplaySummary) -> Section:
    name = "PD" if summary.controller == "pd" else "NMPC"
    facts = {
        "record": summary.replay,
        **_course(summary.scenario),
        "controller": f"{summary.controller}, settings {summary.settings[:16]}",
        "seed": str(summary.scenario.seed),
    }
    bad = ["the trace differs from the recorded one"] if summary.same_bits_as_recorded is False else []
    return _flight(folder, summary, (name, f"Flown again: {name}, {summary.replay}"), facts, bad)


def _course(flown: FlySummary | ReplayedScenario) -> dict[str, str]:
    shape = "" if flown.trajectory.endswith(".csv") else f", {flown.size_m:g} m, {flown.rate_rad_s:g} rad/s"
    return {
        "trajectory": f"{flown.trajectory}{shape}, {flown.duration_s:g} s",
        "seen through": "the truth" if flown.sensors == "none" else f"sensors {flown.sensors}",
    }


def _flight(
    folder: Path, summary: Flown, names: tuple[str, str], facts: dict[str, str], bad: list[str]
) -> Section:
    """Return the section of a flight; `names` are of the drone and of the section."""
    flights, missing = _traces(folder, {names[0]: "trace.npz"})
    if summary.lost:
        bad = [*bad, "the vehicle left the world before the end of the flight"]
    elif summary.mostly_refused:
        bad = [*bad, "the controller refused more than half of its inputs"]
    columns = {
        "whole flight": summary.metrics,
        "after 10 s": summary.metrics_without_transient,
        "as seen": summary.metrics_as_seen,
    }
    shown = {title: values for title, values in columns.items() if values is not None}
    tracked = {"rms error": summary.metrics.get("rms_error_m"), "largest": summary.metrics.get("max_error_m")}
    content = {
        "facts": facts,
        "refusals": summary.refusals,
        "titles": list(shown),
        "metrics": [(*named(key), [values.get(key) for values in shown.values()]) for key in summary.metrics],
        **_pictures(flights),
    }
    finding = "; ".join(bad) or ", ".join(
        f"{words} {value:.3g} m" for words, value in tracked.items() if value
    )
    return Section("fly", str(folder), names[1], not bad, finding, missing, content)


def _table2(folder: Path, summary: Table2Summary) -> Section:
    controllers = list(dict.fromkeys(row.controller for row in summary.rows))
    nmpc = [name for name in controllers if name != PD]
    shown = {f"NMPC, {name}": name for name in ("mambo", *nmpc) if name in nmpc}
    wanted = {PD: PD} | dict(list(shown.items())[:1])
    flights, missing = _traces(folder, {title: f"{name.lower()}.npz" for title, name in wanted.items()})
    cases = list(dict.fromkeys(row.case for row in summary.rows))
    tables = [
        (case, _printed() if case == cases[0] else [], [row for row in summary.rows if row.case == case])
        for case in cases
    ]
    held = sum(claim.holds for claim in summary.claims)
    content = {
        "indices": INDICES,
        "tables": tables,
        "claims": summary.claims,
        **_pictures(flights),
    }
    finding = f"{held} of {len(summary.claims)} claims of the paper hold as flown here"
    return Section("table2", str(folder), "Table II of the paper", None, finding, missing, content)


def _sensed(folder: Path, summary: SensedSummary) -> Section:
    lost, flown = (sum(getattr(row, key) for row in summary.rows) for key in ("lost", "flights"))
    finding = f"{flown} flights, {lost} lost"
    content = {"rows": summary.rows, "indices": INDICES}
    return Section("sensed", str(folder), "Table II through sensors", lost == 0, finding, [], content)


def _printed() -> list[tuple[str, tuple[float, ...], tuple[float, ...] | None]]:
    return [("PD", PRINTED_PD, None), ("NMPC", PRINTED_NMPC, PRINTED_IMPROVEMENT)]


def _footprint(folder: Path, summary: FootprintSummary) -> Section:
    fits = [board for board in summary.boards if board.fits]
    finding = f"fits {len(fits)} of {len(summary.boards)} boards"
    good = len(fits) == len(summary.boards)
    return Section(
        "footprint", str(folder), f"Footprint of {summary.source}", good, finding, [], summary.model_dump()
    )


def _sweep(folder: Path, summary: SweepSummary) -> Section:
    points = [_point(point) for point in summary.points]
    best = summary.largest_fit
    finding = (
        "nothing fits"
        if best is None
        else f"largest that fits: prediction {best.prediction}, {best.control} moves, "
        f"{best.iterations} iterations"
    )
    content = {"summary": summary, "pictures": sweep_panels(points, summary.budget) if points else []}
    return Section(
        "sweep",
        str(folder),
        f"Sweep of {summary.source} on {summary.board}",
        best is not None,
        finding,
        [],
        content,
    )


def _point(point: SweepPoint) -> Point:
    """Return the point as it was measured: what JSON cannot spell is NaN."""
    stack, instructions, time_ms, iae = (
        math.nan if value is None else value
        for value in (point.stack_bytes, point.instructions, point.time_ms, point.iae_m_s)
    )
    return Point(
        prediction=point.prediction,
        control=point.control,
        iterations=point.iterations,
        flash_bytes=point.flash_bytes,
        ram_bytes=point.ram_bytes,
        stack_bytes=stack,
        instructions=instructions,
        time_ms=time_ms,
        iae_m_s=iae,
        fits=point.fits,
    )


def _faults(folder: Path, summary: FaultsSummary) -> Section:
    courses = list(dict.fromkeys(flight.course for flight in summary.flights))
    faults = list(dict.fromkeys(flight.fault for flight in summary.flights))
    largest = max((flight.largest_error_m or 0.0 for flight in summary.flights), default=0.0)
    rows = [
        (
            fault,
            [
                (flight, _share(flight.largest_error_m, largest))
                for flight in summary.flights
                if flight.fault == fault
            ],
        )
        for fault in faults
    ]
    ends = [flight.end for flight in summary.flights]
    counts = ", ".join(f"{ends.count(end)} {end}" for end in dict.fromkeys(ends))
    finding = f"{len(ends)} flights with {len(faults)} faults: {counts}"
    content = {"summary": summary, "courses": courses, "rows": rows}
    return Section(
        "faults",
        str(folder),
        f"Faults in flight, {summary.source}",
        "crashed" not in ends,
        finding,
        [],
        content,
    )


def _share(value: float | None, largest: float) -> float:
    """Return the length of a bar, in %, on a logarithmic scale from a centimetre to the largest."""
    if value is None or value <= 0.01 or largest <= 0.01:
        return 0.0
    return round(100.0 * math.log(value / 0.01) / math.log(largest / 0.01), 1)


def _verify(folder: Path, summary: VerifySummary) -> Section:
    passed = sum(check.outcome == "passed" for check in summary.checks)
    finding = f"{summary.verdict}: {passed} of {len(summary.checks)} checks passed"
    finding += f"; not run: {', '.join(summary.not_run)}" if summary.not_run else ""
    good = summary.verdict == "passed"
    title = f"Verification of {summary.source}"
    return Section("verify", str(folder), title, good, finding, [], summary.model_dump())


def _campaign(folder: Path, summary: CampaignSummary | UnfinishedCampaign) -> Section:
    drawn = summary.campaign if isinstance(summary, CampaignSummary) else summary
    finished = summary if isinstance(summary, CampaignSummary) else None
    path, names = folder / TABLE, [entrant.name for entrant in drawn.controllers]
    table = read_table(path) if path.is_file() else {}
    found = finished.controllers if finished else {}
    content = {
        "drawn": drawn,
        "summary": finished,
        "folder": str(folder),
        "pictures": distributions(table, names),
        "indices": {
            name: [(*named(index), values) for index, values in one.quantiles.items()]
            for name, one in found.items()
        },
        "improvements": [(named(one.index)[0], one) for one in (finished.improvements if finished else [])],
    }
    if finished is None:
        so_far = len(next(iter(table.values()), ()))
        finding, good = f"not finished, {so_far} flights so far; the same command goes on", None
    else:
        crashes = ", ".join(f"{one.crashed.count} with {name}" for name, one in found.items())
        finding = f"{finished.flights} flights; crashed: {crashes}"
        good = all(one.crashed.count == 0 for name, one in found.items() if name != PD.lower())
    missing = [] if path.is_file() else [TABLE]
    title = f"Campaign, {drawn.flight.trajectory}"
    return Section("campaign", str(folder), title, good, finding, missing, content)


def _traces(folder: Path, files: Mapping[str, str]) -> tuple[dict[str, Trace], list[str]]:
    """Return the traces that are there by title, and the names of those that are not."""
    here = {path.name: path for path in folder.iterdir()}
    flights = {title: read_npz(here[name]) for title, name in files.items() if name in here}
    return flights, [name for name in files.values() if name not in here]


def _pictures(flights: Mapping[str, Trace]) -> dict[str, Any]:
    """Return the moving and the still pictures of flights, if there are any."""
    return {
        "animation": animate(flights) if flights else None,
        "columns": flight_columns(flights) if flights else [],
    }
