"""Why a line is not run, or a fault does not show: exceptions of coverage and mutation, each with its reason.

A row is found by file, line and what happens there, with the default prefix and without real numbers, so
that it outlives a line that moves. It counts only for settings for which it holds.
"""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from mambo_nmpc.codegen.settings.model import Settings

Key = tuple[str, str, str]
"""File, line, and what happens there."""


def _always(_: Settings) -> bool:
    return True


@dataclass(frozen=True)
class Reason:
    """One exception: where, what, why, and for which settings."""

    file: str
    line: str
    what: str
    reason: str
    holds: Callable[[Settings], bool] = _always


def reason_for(key: Key, rows: Iterable[Reason], settings: Settings) -> str | None:
    """Return the reason in `rows` for what happens at `key`; None if there is none."""
    found = (row for row in rows if key == (row.file, row.line, row.what) and row.holds(settings))
    return next((row.reason for row in found), None)


def row(key: Key) -> str:
    """Spell a row to paste into a table of reasons."""
    file, line, what = key
    return f'    Reason(\n        {file!r},\n        {line!r},\n        {what!r},\n        "why",\n    ),\n'


def plain(text: str, prefix: str) -> str:
    """Return `text` on one line, with the default prefix, without reals and whole numbers from 100 on."""
    named = re.sub(
        rf"\b({prefix}|{prefix.upper()})(?=[_.])", lambda name: "nmpc" if name[1] == prefix else "NMPC", text
    )
    without_reals = re.sub(r"-?\b\d+\.\d*(e[-+]?\d+)?f?|-?\b\d+e-?\d+f?", "<real>", named)
    return " ".join(re.sub(r"\b\d{3,}\b", "<number>", without_reals).split())
