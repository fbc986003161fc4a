"""What a check of the generated C is: a function from a subject to a result."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from mambo_nmpc.codegen.settings.model import Settings


class CheckOutcome(StrEnum):
    """How a check ended; INCOMPLETE is never as good as PASSED."""

    PASSED = "passed"
    FAILED = "failed"
    INCOMPLETE = "incomplete"


@dataclass(frozen=True)
class Subject:
    """What is checked.

    settings: of the controller.
    bundle:   folder of its generated C, read only.
    folder:   of this check, empty and writable: reports and logs stay there as evidence.
    """

    settings: Settings
    bundle: Path
    folder: Path


@dataclass(frozen=True)
class Result:
    """How a check ended.

    evidence: a line for people: what was counted, what is wrong, or which package brings a missing tool.
    figures:  the same for programs; JSON types only.
    tools:    name and version of every tool that took part.
    """

    outcome: CheckOutcome
    evidence: str
    figures: Mapping[str, Any] = field(default_factory=dict)
    tools: Mapping[str, str] = field(default_factory=dict)


Check = Callable[[Subject], Result]
"""A check raises only for what the user must correct before it can start, never for what it finds."""


def passed(evidence: str, figures: Mapping[str, Any]) -> Result:
    """Return the result of a check that found nothing."""
    return Result(CheckOutcome.PASSED, evidence, figures)


def failed(evidence: str, figures: Mapping[str, Any] | None = None) -> Result:
    """Return the result of a check that found a fault."""
    return Result(CheckOutcome.FAILED, evidence, figures or {})


def incomplete(evidence: str, figures: Mapping[str, Any] | None = None) -> Result:
    """Return the result of a check that could not run."""
    return Result(CheckOutcome.INCOMPLETE, evidence, figures or {})


def joined(faults: Sequence[str], gaps: Sequence[str], counted: str, figures: Mapping[str, Any]) -> Result:
    """Return the result of several builds: what is wrong, what is missing, and what was counted."""
    outcome = CheckOutcome.FAILED if faults else CheckOutcome.INCOMPLETE if gaps else CheckOutcome.PASSED
    return Result(outcome, "; ".join([*faults, *dict.fromkeys(gaps), counted]), figures)
