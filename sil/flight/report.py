"""What flights found, as plain text for a terminal, a pipe or a diff."""

from dataclasses import fields
from typing import Any

import numpy as np

from mambo_nmpc.codegen.reference import Status
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.flight.metrics import TRANSIENT_S, Metrics, measure
from mambo_nmpc.sil.flight.traces import SensedTrace, Trace
from mambo_nmpc.sil.paper.table2 import (
    CASES,
    INDICES,
    PRINTED_IMPROVEMENT,
    PRINTED_NMPC,
    PRINTED_PD,
    Four,
    Row,
    Table2,
    digits,
)
from mambo_nmpc.sil.plant.link import NOT_CALLED

_UNITS = {"_m2_s2": "m^2 s^2", "_m2_s": "m^2 s", "_m_s2": "m s^2", "_m_s": "m s", "_rad_s": "rad s"}
_UNITS |= {"_rad": "rad", "_m": "m"}


def numbers(metrics: Metrics, flight: int = 0) -> dict[str, float]:
    """Return the metrics of one flight by name."""
    return {field.name: float(getattr(metrics, field.name)[flight]) for field in fields(metrics)}


def refusals(trace: Trace, settings: Settings) -> list[str]:
    """Say how often the controller of the first flight refused its input, and which range was exceeded."""
    if isinstance(trace, SensedTrace):
        trace = trace.as_seen()
    status, ranges = trace.status[:, 0], settings.ranges
    sentences = []
    refused = (status == Status.BAD_STATE) & np.isfinite(trace.position_m[:, 0]).all(axis=-1)
    for words, unit, values, key, limit in (
        ("position", "m", trace.position_m[:, 0, :2], "position_m", ranges.position_m),
        ("speed", "m/s", trace.velocity_m_s[:, 0, :2], "velocity_m_s", ranges.velocity_m_s),
    ):
        largest = np.abs(values).max(axis=-1)
        beyond = refused & (largest > limit)
        if beyond.any():
            sentences.append(
                f"{beyond.sum()} steps: the vehicle's {words}, up to {largest[beyond].max():.4g} {unit}, "
                f"exceeds ranges.{key} = {limit:g}"
            )
    refused = status == Status.BAD_THRUST
    if refused.any():
        thrust = trace.thrust_acceleration_m_s2[refused, 0]
        during = " during lift-off" if (trace.time_s[refused] < 0.0).all() else ""
        sentences.append(
            f"{refused.sum()} steps{during}: thrust out of range, {thrust.min():.4g}..{thrust.max():.4g} "
            f"m/s^2 where ranges.thrust_acceleration_* = {ranges.thrust_acceleration_min_m_s2:g}.."
            f"{ranges.thrust_acceleration_max_m_s2:g}"
        )
    return [f"{sentence}; the last command was kept" for sentence in sentences]


def found(trace: Trace, settings: Settings) -> dict[str, Any]:
    """Return what a flight is judged by; "mostly_refused" is about the time on the trajectory."""
    status = trace.status[:, 0]
    names = {NOT_CALLED: "NOT_CALLED", **{int(each): each.name for each in Status}}
    counts = {name: int((status == value).sum()) for value, name in names.items()}
    refused = ~np.isin(status[trace.time_s >= 0.0], (Status.OK, NOT_CALLED))
    summary: dict[str, Any] = {
        "lost": bool(trace.diverged[0]),
        "mostly_refused": bool(np.mean(refused) > 0.5),
        "statuses": {name: count for name, count in counts.items() if count},
        "refusals": refusals(trace, settings),
        "metrics": numbers(measure(trace)),
    }
    if trace.time_s[-2] >= TRANSIENT_S:
        summary["metrics_without_transient"] = numbers(measure(trace, TRANSIENT_S))
    if isinstance(trace, SensedTrace):
        summary["metrics_as_seen"] = numbers(measure(trace.as_seen()))
    return summary


def flight_text(summary: dict[str, Any]) -> str:
    """Spell the summary of a flight: a metric a line, with and without the start transient, and as seen."""
    columns = {"whole flight": summary["metrics"]}
    for heading, key in (("after 10 s", "metrics_without_transient"), ("as seen", "metrics_as_seen")):
        if key in summary:
            columns[heading] = summary[key]
    lines = [f"{'':22}" + "".join(f"{heading:>14}" for heading in columns)]
    for key in summary["metrics"]:
        name, unit = named(key)
        lines.append(
            f"{name:22}" + "".join(f"{values[key]:14.5g}" for values in columns.values()) + f"  {unit}"
        )
    quiet = ("OK", "NOT_CALLED")
    refused = {name: count for name, count in summary["statuses"].items() if name not in quiet}
    if refused:
        lines.append("refused inputs: " + ", ".join(f"{count} {name}" for name, count in refused.items()))
        lines += [f"  {sentence}" for sentence in summary["refusals"]]
    if summary.get("same_bits_as_recorded") is not None:
        same = "equals" if summary["same_bits_as_recorded"] else "DIFFERS FROM"
        lines.append(f"flown again: the trace {same} the recorded one, bit for bit")
    if summary["same_bits_as_host"] is not None:
        same = "equals" if summary["same_bits_as_host"] else "DIFFERS FROM"
        lines.append(
            f"flown on the core of {summary['board']}: the trace {same} that of this machine, bit for bit"
        )
    if summary["lost"]:
        lines.append("LOST: the vehicle left the world before the end of the flight")
    elif summary["mostly_refused"]:
        lines.append("NOT CONTROLLED: the controller refused more than half of its inputs")
    return "\n".join(lines)


def named(key: str) -> tuple[str, str]:
    """Return the words and the unit of a metric's key, as rms_error_m."""
    suffix = next((suffix for suffix in _UNITS if key.endswith(suffix)), "")
    name = key.removesuffix(suffix).replace("_", " ")
    words = [word.upper() if word in ("iae", "ise", "itse", "itae") else word for word in name.split()]
    return " ".join(words), _UNITS.get(suffix, "")


def table2_text(result: Table2) -> str:
    """Spell Table II: a block for each case, printed above measured, then what the paper claims."""
    lines = [f"{'':68}  PD over NMPC"]
    for case in CASES:
        lines += [f"{case:28}" + "".join(f"{index:>10}" for index in INDICES)]
        lines[-1] += "".join(f"{index:>9}" for index in INDICES)
        if case == next(iter(CASES)):
            lines += [_line("printed PD", PRINTED_PD, None)]
            lines += [_line("printed NMPC", PRINTED_NMPC, PRINTED_IMPROVEMENT)]
        lines += [_row(row) for row in result.rows if row.case == case]
        lines += [""]
    lines += ["the paper's claims, as flown here:"]
    lines += [
        f"  {'holds' if claim.holds else 'does not hold':13}  {claim.text}: {claim.evidence}"
        for claim in result.claims
    ]
    return "\n".join(lines)


def _row(row: Row) -> str:
    return _line(f"flown {row.controller}", row.measured, row.improvement)


def _line(name: str, values: Four, improvement: Four | None) -> str:
    ratios = "" if improvement is None else "".join(f"{digits(ratio):>9}" for ratio in improvement)
    return f"  {name:26}" + "".join(f"{digits(value):>10}" for value in values) + ratios
