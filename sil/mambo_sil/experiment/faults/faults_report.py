"""Verdicts on flights with faults as Markdown table and CSV."""

import csv
import math
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Final

from mambo_sil.experiment.faults.fault_flights import COURSES, ORDER, Verdict, all_statuses


def table(verdicts: Sequence[Verdict]) -> str:
    """Return the verdicts as a Markdown table with one row per fault and both courses side by side."""
    head = ["fault", "status", "command, rad", "tilt, rad", "at limit, %"]
    head += [f"{course}: {what}" for course in COURSES for what in ("error, m", "back after, s")]
    rows = [[*head, "end"], ["---"] * (len(head) + 1)]
    for fault in dict.fromkeys(verdict.fault for verdict in verdicts):
        pair = [verdict for verdict in verdicts if verdict.fault == fault]
        row = [fault, ", ".join(all_statuses(pair))]
        row += [f"{max(getattr(verdict, key) for verdict in pair):.2f}" for key in _LARGEST]
        row.append(f"{100 * max(verdict.saturated_share for verdict in pair):.1f}")
        for verdict in pair:
            never = math.isnan(verdict.recovery_s)
            row += [f"{verdict.largest_error_m:.2f}", "-" if never else f"{verdict.recovery_s:.1f}"]
        rows.append([*row, max((verdict.end for verdict in pair), key=ORDER.index)])
    bands = ", ".join(
        f"{course} {next(v.band_m for v in verdicts if v.course == course and not v.turning):.3f} m"
        for course in COURSES
    )
    return "\n".join("| " + " | ".join(row) + " |" for row in rows) + f"\n\nBack means within: {bands}."


_LARGEST: Final = ("largest_command_rad", "largest_tilt_rad")


def write_csv(verdicts: Sequence[Verdict], path: Path) -> None:
    """Write the verdicts as CSV, one line per course and fault."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Verdict)], lineterminator="\n")
        writer.writeheader()
        for verdict in verdicts:
            writer.writerow(asdict(verdict) | {"statuses": " ".join(verdict.statuses)})
