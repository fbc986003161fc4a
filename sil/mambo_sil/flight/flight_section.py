"""The sections of the report on single flights: parameters, metrics, pictures and animation."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mambo_sil.flight.animation import animate
from mambo_sil.flight.flight_plots import flight_columns
from mambo_sil.flight.flight_report import FlightSummary, FlySummary, ReplaySummary, named
from mambo_sil.flight.names import PD_TITLES
from mambo_sil.flight.scenario import Scenario
from mambo_sil.flight.traces import Trace, read_npz
from mambo_sil.results.section import Section


def fly_section(folder: Path, summary: FlySummary) -> Section:
    """Return the section of a flight; raises TraceError."""
    facts, bad = {}, []
    if summary.board is not None:
        bits = ", bit for bit as on the host" if summary.same_bits_as_host else ""
        facts["flown on"] = f"the emulated core of {summary.board}{bits}"
        if summary.same_bits_as_host is False:
            bad = [f"the trace of {summary.board} differs from that of the host"]
    return flown_section(folder, summary, facts, bad)


def flown_section(folder: Path, summary: FlySummary, facts: dict[str, str], bad: list[str]) -> Section:
    """Return the section of a flight with its parameters, further facts and faults; raises TraceError."""
    name = PD_TITLES.get(summary.controller, f"NMPC, {summary.source}")
    parameters = {
        **_course(summary),
        "controller": _controller(summary.controller, f"{summary.settings[:16]} of {summary.source}"),
        "start": f"{summary.start}, heading {summary.yaw_rad:g} rad",
        "disturbances": "steady acceleration {:g}, {:g} m/s²".format(*summary.wind_m_s2)
        + f"; wind with gusts {summary.wind_speed_m_s:g} m/s; motor lag {summary.motor_lag_s:g} s",
    }
    titles = (name, f"Flight: {name}, {summary.trajectory}")
    return _flight(folder, summary, titles, parameters | facts, bad)


def replay_section(folder: Path, summary: ReplaySummary) -> Section:
    """Return the section of a replayed flight; raises TraceError."""
    name = PD_TITLES.get(summary.controller, "NMPC")
    facts = {
        "record": summary.replay,
        **_course(summary.scenario),
        "controller": _controller(summary.controller, summary.settings[:16]),
        "seed": str(summary.scenario.seed),
    }
    bad = ["the trace differs from the recorded one"] if summary.same_bits_as_recorded is False else []
    return _flight(folder, summary, (name, f"Replay: {name}, {summary.replay}"), facts, bad)


def traces(folder: Path, files: Mapping[str, str]) -> tuple[dict[str, Trace], list[str]]:
    """Return the existing traces by title, and the names of missing files; raises TraceError."""
    here = {path.name: path for path in folder.iterdir()}
    flights = {title: read_npz(here[name]) for title, name in files.items() if name in here}
    return flights, [name for name in files.values() if name not in here]


def pictures(flights: Mapping[str, Trace]) -> dict[str, Any]:
    """Return animation and pictures of flights, if there are any."""
    return {
        "animation": animate(flights) if flights else None,
        "columns": flight_columns(flights) if flights else [],
    }


def _controller(name: str, settings: str) -> str:
    """Return the controller's name, with its settings if it has any: a PD has none."""
    return name if name in PD_TITLES else f"{name}, settings {settings}"


def _course(flown: FlySummary | Scenario) -> dict[str, str]:
    shape = "" if flown.trajectory.endswith(".csv") else f", {flown.size_m:g} m, {flown.rate_rad_s:g} rad/s"
    return {
        "vehicle": flown.vehicle.name,
        "trajectory": f"{flown.trajectory}{shape}, {flown.duration_s:g} s",
        "state": "true" if flown.sensors == "none" else f"estimated, sensors {flown.sensors}",
    }


def _flight(
    folder: Path, summary: FlightSummary, names: tuple[str, str], facts: dict[str, str], bad: list[str]
) -> Section:
    """Return the section of a flight; `names` has the names of drone and section, `bad` the faults found."""
    flights, missing = traces(folder, {names[0]: "trace.npz"})
    if summary.crash is not None:
        bad = [*bad, f"the drone crashed at {summary.crash.time_s:.2f} s: {summary.crash.how}"]
    if summary.lost:
        bad = [*bad, "the drone was lost before the end of the flight"]
    elif summary.mostly_refused:
        bad = [*bad, "the controller refused more than half of its inputs"]
    columns = summary.columns
    tracked = {"rms error": summary.metrics.get("rms_error_m"), "largest": summary.metrics.get("max_error_m")}
    content = {
        "facts": facts,
        "refusals": summary.refusals,
        "titles": list(columns),
        "metrics": [
            (*named(key), [values.get(key) for values in columns.values()]) for key in summary.metrics
        ],
        **pictures(flights),
    }
    finding = "; ".join(bad) or ", ".join(
        f"{words} {value:.3g} m" for words, value in tracked.items() if value
    )
    return Section("fly", names[1], not bad, finding, content, missing, moves=bool(flights))
