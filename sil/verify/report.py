"""What a verification found, as lines, JSON and a page: the same words, three times."""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from mambo_nmpc.codegen import __version__
from mambo_nmpc.codegen.settings.controller_toml import to_toml
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.show.page import render_page
from mambo_nmpc.sil.verify.check import Outcome, Result
from mambo_nmpc.sil.verify.checks import CHECKS, Entry

PAGE: Final = "verify.html"


class Verified(NamedTuple):
    """A check that was run, and what came of it."""

    entry: Entry
    result: Result


def verdict(found: Sequence[Verified]) -> Outcome:
    """Return the worst outcome: one failure fails all, and what could not run is never passed."""
    outcomes = {one.result.outcome for one in found}
    worst_first = (Outcome.FAILED, Outcome.INCOMPLETE, Outcome.PASSED)
    return next(outcome for outcome in worst_first if outcome in outcomes)


def line(one: Verified) -> str:
    """Spell one check in a line."""
    return f"{one.entry.name:12}{one.result.outcome:12}{one.result.evidence}"


def closing(found: Sequence[Verified]) -> str:
    """Spell the verdict, and what it does not speak of."""
    counts = ", ".join(
        f"{count} {outcome}"
        for outcome in Outcome
        if (count := sum(one.result.outcome is outcome for one in found))
    )
    left_out = _left_out(found)
    return f"verdict: {verdict(found)} ({counts})" + (f"; not run: {', '.join(left_out)}" if left_out else "")


def summary(found: Sequence[Verified], source: str, settings: Settings) -> dict[str, Any]:
    """Return everything that was found, ready for JSON."""
    tools: dict[str, str] = {}
    for one in found:
        tools |= one.result.tools
    return {
        "generator": f"mambo-nmpc {__version__}",
        "command": "verify",
        "source": source,
        "digest": settings.digest[:16],
        "scalar": settings.code.scalar,
        "verdict": verdict(found),
        "not_run": _left_out(found),
        "checks": [
            {
                "name": one.entry.name,
                "about": one.entry.about,
                "outcome": one.result.outcome,
                "evidence": one.result.evidence,
                "figures": dict(one.result.figures),
                "tools": dict(one.result.tools),
            }
            for one in found
        ],
        "tools": dict(sorted(tools.items())),
        "settings": to_toml(settings),
    }


def page(summary_of_all: Mapping[str, Any]) -> str:
    """Render the summary as one HTML page that needs no other file."""
    return render_page("verify.html.j2", summary_of_all)


def digests(folder: Path) -> dict[str, str]:
    """Return {path: SHA-256} of every file in `folder`."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def _left_out(found: Sequence[Verified]) -> list[str]:
    ran = {one.entry.name for one in found}
    return [entry.name for entry in CHECKS if entry.name not in ran]
