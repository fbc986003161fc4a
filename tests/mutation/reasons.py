"""Exceptions of the coverage and mutation tests: why a line cannot run, or why a fault changes no bit."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from mambo_codegen.settings.model import Settings

Key = tuple[str, str, str]
"""File, line, and what happens there, spelled by `plain`, so that the key stays valid when the line moves."""


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

    @property
    def key(self) -> Key:
        """The key of the exception."""
        return self.file, self.line, self.what


def reasons(
    file: str, line: str, reason: str, *faults: str, holds: Callable[[Settings], bool] = _always
) -> tuple[Reason, ...]:
    """Make an exception for each of the faults of a line."""
    return tuple(Reason(file, line, what, reason, holds) for what in faults)


def is_explained(key: Key, reasons: Iterable[Reason], settings: Settings) -> bool:
    """Whether a reason for `key` holds for these settings."""
    return any(reason.key == key and reason.holds(settings) for reason in reasons)


def plain(text: str) -> str:
    """Return `text` on one line, without reals and integers from 100 on: those may come from the settings."""
    without_reals = re.sub(r"-?\b\d+\.\d*(e[-+]?\d+)?f?|-?\b\d+e-?\d+f?", "<real>", text)
    return " ".join(re.sub(r"\b\d{3,}\b", "<number>", without_reals).split())


def survivors(name: str) -> dict[Key, str]:
    """Return why faults change nothing, from a file of this folder.

    Below the name of a source file each row is a line of it, the reason, and the faults, with ` @@ ` between.
    """
    found, source = dict[Key, str](), ""
    for row in Path(__file__).with_name(name).read_text("utf-8").splitlines():
        line, *reason_and_faults = row.split(" @@ ")
        if reason_and_faults:
            reason, *faults = reason_and_faults
            found |= {(source, line, fault): reason for fault in faults}
        else:
            source = row
    return found
