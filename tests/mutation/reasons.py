"""Exceptions of the coverage and mutation tests: why a line cannot run, or why a fault changes no bit.

A table has, below the name of each source file, a row for a line of it: the line, the reason, and the faults
or branches, with ` @@ ` between. A reason that begins with `if NAME: ` holds under that condition only.
"""

import re
from collections.abc import Mapping
from pathlib import Path

from mambo_codegen.settings.model import Settings
from tests.mutation.conditions import CONDITIONS

Key = tuple[str, str, str]
"""File, line, and what happens there, spelled by `plain`, so that the key stays valid when the line moves."""


def is_explained(key: Key, reasons: Mapping[Key, str], settings: Settings) -> bool:
    """Whether a reason for `key` holds for these settings."""
    condition = re.match(r"if (\w+): ", reasons.get(key, ""))
    return key in reasons and (condition is None or CONDITIONS[condition[1]](settings))


def plain(text: str) -> str:
    """Return `text` on one line, without reals and integers from 100 on: those may come from the settings."""
    without_reals = re.sub(r"-?\b\d+\.\d*(e[-+]?\d+)?f?|-?\b\d+e-?\d+f?", "<real>", text)
    return " ".join(re.sub(r"\b\d{3,}\b", "<number>", without_reals).split())


def survivors(name: str) -> dict[Key, str]:
    """Return the reasons of a table in this folder."""
    found, source = dict[Key, str](), ""
    for row in Path(__file__).with_name(name).read_text("utf-8").splitlines():
        line, *reason_and_faults = row.split(" @@ ")
        if reason_and_faults:
            reason, *faults = reason_and_faults
            found |= {(source, line, fault): reason for fault in faults}
        else:
            source = row
    return found
