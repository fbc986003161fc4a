"""A check of the generated C: a function that takes a subject and returns a result."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from mambo_codegen.settings.model import Settings


class CheckOutcome(StrEnum):
    """How a check ended; INCOMPLETE means that a tool is missing and no fault was found."""

    PASSED = "passed"
    FAILED = "failed"
    INCOMPLETE = "incomplete"


@dataclass(frozen=True)
class Subject:
    """What a check examines.

    settings: the settings of the controller.
    bundle:   folder of its generated C; a check does not write there.
    folder:   empty folder for the reports and logs of this check, which are kept as evidence.
    """

    settings: Settings
    bundle: Path
    folder: Path


@dataclass(frozen=True)
class Result:
    """How a check ended.

    evidence: one line of text: what was checked, what is wrong, or which package has a missing tool.
    figures:  the same for programs; JSON types only.
    tools:    {name: version} of tools beyond those in the registry.
    """

    outcome: CheckOutcome
    evidence: str
    figures: Mapping[str, Any] = field(default_factory=dict)
    tools: Mapping[str, str] = field(default_factory=dict)


Check = Callable[[Subject], Result]
"""A check raises only errors that the user must correct, such as a full disk; faults of the C are results."""


def passed(evidence: str, figures: Mapping[str, Any]) -> Result:
    """Return the result of a check that found no fault."""
    return Result(CheckOutcome.PASSED, evidence, figures)


def failed(evidence: str, figures: Mapping[str, Any] | None = None) -> Result:
    """Return the result of a check that found a fault."""
    return Result(CheckOutcome.FAILED, evidence, figures or {})


def incomplete(evidence: str, figures: Mapping[str, Any] | None = None) -> Result:
    """Return the result of a check that could not run."""
    return Result(CheckOutcome.INCOMPLETE, evidence, figures or {})


def combine(faults: Sequence[str], gaps: Sequence[str], counted: str, figures: Mapping[str, Any]) -> Result:
    """Return the result of several builds: failed if there are faults, incomplete if tools are missing."""
    outcome = CheckOutcome.FAILED if faults else CheckOutcome.INCOMPLETE if gaps else CheckOutcome.PASSED
    return Result(outcome, "; ".join([*faults, *dict.fromkeys(gaps), counted]), figures)
