"""Read a flight log from CSV: one row a sample, one clock; a cell without a number is a missing sample.

A row with fewer cells than the header is left out, because a lost cell moves the others into wrong columns.
"""

import contextlib
import csv
import io
import math
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from mambo_codegen.errors import echo
from mambo_codegen.plain_file import guess_name, read_plain_file
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import LogError
from mambo_sil.model.identify.columns import KNOWN, Column, choose_columns
from mambo_sil.model.identify.resolution import read_resolution
from mambo_sil.model.identify.signals import COMMANDS, OPTIONAL, REQUIRED, TIME, FlightLog, Signal

LARGEST_FILE_BYTES: Final = 100_000_000
LARGEST_VALUE: Final = 1e15
_MOST_FAULTS: Final = 5
_FASTER: Final = "log at 50 to 100 Hz; for a clock in ms write --columns time_s=0.001*COLUMN"
SHORTEST_PERIOD_S, LONGEST_PERIOD_S = 0.0002, 0.025
"""Bounds on the median time between two samples: 5 kHz to 40 Hz. A command that is logged rarely
would be read as a late one."""


_SCRAMBLED: Final = 0.1
"""Least share of rows that are earlier than the row before, of rows in another order."""
COUNTER_BITS: Final = (24, 32)
"""Counters of ms: in the Crazyflie's log packets, which ends after 4.7 hours, and of its clock."""
WRAP_SHARE: Final = 64.0
"""A fall from the last to the first of this many parts of a counter's range is an end of the counter."""

LONGEST_RARE_PERIOD_S: Final = 0.12
"""The same where what lies between two samples may be interpolated, which widens intervals."""
LONGEST_OPTIONAL_PERIOD_S: Final = 0.12
"""Median time between two samples of position, velocity or yaw beyond which they are left out."""


def read_csv(
    path: Path,
    chosen: Mapping[str, Column],
    signals: Mapping[str, Sequence[Column]] = KNOWN,
    longest_period_s: float = LONGEST_PERIOD_S,
    binary: str = ".ulg or .bin",
) -> FlightLog:
    """Read the log at `path`; `chosen` has the columns that the user named, `signals` the known ones of each.

    `binary` names the other files that the command reads.

    Raises LogError, all faults; also for angles that come less often than every `longest_period_s`.
    """
    name = echo(str(path))
    rows = _rows(_read_text(path, binary))
    header = [column.strip() for column in next(rows, (0, []))[1]]
    if not any(header):
        raise LogError((f"{name}: is empty; the first line must name the columns",))
    columns, faults = choose_columns(header, chosen, signals)
    if faults:
        raise LogError(tuple(f"{name}: {fault}" for fault in faults))
    places = {signal: header.index(each.name) for signal, each in columns.items()}
    values, faults, remarks = _values(rows, places, len(header))
    if faults:
        raise LogError(tuple(f"{name}: {fault}" for fault in faults))
    log = _log(name, columns, values, [f"{name}: {remark}" for remark in remarks])
    return demand_one_clock(log, columns[TIME].text, _FASTER, longest_period_s)


def _read_text(path: Path, binary: str) -> str:
    """Return the text of a log; raises LogError for a file that cannot be read."""
    name = echo(str(path))
    try:
        content = read_plain_file(path, LARGEST_FILE_BYTES + 1)
    except FileNotFoundError:
        raise LogError((f"{name}: there is no such file{guess_name(path)}",)) from None
    except IsADirectoryError:
        raise LogError((f"{name}: is a folder; name a log in it, such as its trace.csv",)) from None
    except OSError as error:
        raise LogError((f"{name}: cannot be read: {error.strerror}{guess_name(path)}",)) from error
    if len(content) > LARGEST_FILE_BYTES:
        raise LogError((f"{name}: is larger than 100 MB; some minutes of flight suffice: cut it",))
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise LogError(
            (f"{name}: line {line}: is not UTF-8; save the log as CSV in UTF-8, or name a {binary}",)
        ) from None


def _rows(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and fields of each row; the delimiter is the first line's most frequent one."""
    first = text.partition("\n")[0]
    delimiter = max(",;\t", key=first.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter)
    while True:
        try:
            yield reader.line_num, next(reader)
        except StopIteration:
            return
        except csv.Error:  # a NUL, or a field of more than 131072 characters
            yield reader.line_num, ["not CSV"]


def _values(
    rows: Iterator[tuple[int, list[str]]], places: Mapping[str, int], width: int
) -> tuple[dict[str, FloatArray], list[str], list[str]]:
    """Return each signal as (k,), NaN for a missing sample, faults and remarks.

    `places` has field numbers, `width` is the number of cells of the header.
    """
    found: dict[str, list[float]] = {signal: [] for signal in places}
    faults: list[str] = []
    short: list[int] = []
    not_finite: list[int] = []
    for line, row in rows:
        if len(row) > width:
            faults.append(f"line {line + 1}: has {len(row)} cells, the header {width}; delete the line")
        elif any(row) and len(row) < width:
            short.append(line + 1)
        if not any(row) or len(row) != width:
            continue
        for signal, place in places.items():
            text = row[place].strip()
            value = _number(text)
            if value is None:
                faults.append(f"line {line + 1}: {signal} = {echo(text)} must be a number")
            elif text and not math.isfinite(value):
                not_finite.append(line + 1)
            found[signal].append(math.nan if value is None else value)
    if (more := len(faults) - _MOST_FAULTS) > 0:
        faults[_MOST_FAULTS:] = [f"and {more} more faults of rows and cells"]
    remarks = [
        f"{len(lines)} {what}, the first in line {lines[0]}"
        for lines, what in (
            (short, "rows with fewer cells than the header are left out"),
            (not_finite, "cells without a finite number are taken as missing"),
        )
        if lines
    ]
    return {signal: np.array(values) for signal, values in found.items()}, faults, remarks


def _number(text: str) -> float | None:
    """Return the number of a cell, NaN for an empty one or one of no physical size, None for other text."""
    try:
        value = float(text) if text else math.nan
    except ValueError:
        return None
    return value if abs(value) < LARGEST_VALUE else math.nan


def _log(
    name: str, columns: Mapping[str, Column], values: Mapping[str, FloatArray], remarks: list[str]
) -> FlightLog:
    """Return the log of the columns' values with `remarks` on its rows; raises LogError."""
    time_s = columns[TIME].factor * _unwrapped(values[TIME])
    if _is_scrambled(time_s):
        order = np.argsort(time_s)  # what has no time is last
        time_s, values = time_s[order], {signal: each[order] for signal, each in values.items()}
        remarks.append(f"{name}: the rows are in another order than their times: sorted")
    timed = np.isfinite(time_s)
    faults, signals = [], {}
    for signal, column in columns.items():
        if signal == TIME:
            continue
        there = timed & np.isfinite(values[signal])
        if not there.any():
            if signal in REQUIRED:
                faults.append(f"{name}: column {echo(column.name)} holds no number; {signal} is needed")
            continue
        if (lost := int(timed.sum() - there.sum())) and signal in REQUIRED:
            remarks.append(f"{name}: {lost} of {timed.sum()} rows have no {echo(column.name)}")
        value = values[signal][there]
        resolution = read_resolution(value, abs(column.factor))
        signals[signal] = Signal(time_s[there], column.factor * value, column.text, resolution)
    if faults:
        raise LogError(tuple(faults))
    return FlightLog(name, signals, tuple(remarks))


def _is_scrambled(time_s: FloatArray) -> bool:
    """Return whether rows with times (k,) are those of one clock, in another order.

    Times of two flights fall once, and those of two clocks are uneven when sorted.
    """
    steps = np.diff(time_s[np.isfinite(time_s)])
    if len(steps) == 0 or (steps < 0.0).mean() < _SCRAMBLED:
        return False
    apart = np.diff(np.sort(time_s[np.isfinite(time_s)]))
    return bool(apart.min() > 0.5 * np.median(apart))


def _unwrapped(ticks: FloatArray) -> FloatArray:
    """Return the ticks (k,) of a clock, going on where its counter of 24 or 32 bits began again at 0."""
    timed = np.isfinite(ticks)
    before, after = ticks[timed][:-1], ticks[timed][1:]
    passed = np.zeros(len(ticks))
    for bits in COUNTER_BITS:
        end, near = 2.0**bits, 2.0**bits / WRAP_SHARE
        wraps = (before > end - near) & (before < end) & (after < near)
        passed[timed] += np.cumsum(np.append(0.0, end * wraps))
    return ticks + passed


@contextlib.contextmanager
def reading(path: Path, kind: str, package: str) -> Iterator[None]:
    """Make what the reader of a binary log raises a LogError, and keep it from printing."""
    name = echo(str(path))
    try:
        if path.stat().st_size > LARGEST_FILE_BYTES:
            raise LogError((f"{name}: is larger than 100 MB; some minutes of flight suffice: log less",))
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            yield
    except ImportError:
        install = shlex.join([sys.executable, "-m", "pip", "install", package])
        needs = f"reading {kind.removesuffix(' log')} needs {package}"
        raise LogError((f"{name}: {needs}; install it: {install}",)) from None
    except OSError as error:
        raise LogError((f"{name}: cannot be read: {error.strerror}{guess_name(path)}",)) from error
    except LogError:
        raise
    except Exception as error:  # whatever a damaged file makes of the parser
        raise LogError((f"{name}: is no {kind}: {echo(str(error))}",)) from error


def demand_one_clock(
    log: FlightLog, clock: str, fix: str, longest_period_s: float = LONGEST_PERIOD_S
) -> FlightLog:
    """Return the log without repeated times and rare signals.

    Raises LogError if times fall, or are in another unit, or angles come too rarely.
    `fix` says how to log faster.
    """
    signals, faults, remarks = {}, [], list(log.remarks)
    for name, signal in log.signals.items():
        if not len(signal.time_s):
            if name in REQUIRED:
                faults.append(f"{log.name}: {echo(signal.column)} holds no number; {name} is needed")
                break
            remarks.append(f"{log.name}: {echo(signal.column)} holds no number: left out")
            continue
        step_s = np.diff(signal.time_s)
        if (step_s < 0.0).any():
            at = int(np.argmax(step_s < 0.0))
            faults.append(
                f"{log.name}: the time {echo(clock)} falls from {signal.time_s[at]:.10g} to "
                f"{signal.time_s[at + 1]:.10g} s: the rows are of two clocks or of two flights; "
                "a log must be of one flight, on one clock"
            )
            break
        fresh = np.append(step_s > 0.0, values=True)
        period_s = float(np.median(step_s[step_s > 0.0])) if (step_s > 0.0).any() else 0.0
        rate = f"{echo(signal.column)} has a sample every {period_s:.3g} s by the time {echo(clock)}"
        if name in OPTIONAL and period_s > LONGEST_OPTIONAL_PERIOD_S:
            remarks.append(f"{log.name}: {rate}: left out, because that is too rare")
            continue
        if name in REQUIRED and not SHORTEST_PERIOD_S <= period_s <= longest_period_s:
            why = ", since nothing shows what happens in between" if period_s > longest_period_s else ""
            faults.append(
                f"{log.name}: {rate}; that must be {SHORTEST_PERIOD_S:g}..{longest_period_s:g} s{why}: {fix}"
            )
            break
        if name == COMMANDS[0] and period_s > LONGEST_PERIOD_S:
            remarks.append(
                f"{log.name}: {rate}: whether it was held in between is not known, so the intervals of lag "
                f"and dead time are wider by {250.0 * period_s:.0f} ms; {fix}"
            )
        signals[name] = replace(signal, time_s=signal.time_s[fresh], value=signal.value[fresh])
    if faults:
        raise LogError(tuple(faults))
    return FlightLog(log.name, signals, tuple(remarks))
