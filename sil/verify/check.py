"""What a check of the generated C is: a subject in, one result with its evidence out."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

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
    bundle:   folder that holds its generated C, read only.
    folder:   of this check, empty and writable: reports and logs stay there as evidence.
    """

    settings: Settings
    bundle: Path
    folder: Path


@dataclass(frozen=True)
class Result:
    """The outcome of one check.

    evidence: a line for people: what was counted, what is wrong, or which package brings what is missing.
    figures:  the same for programs; JSON types only.
    tools:    name and version of every tool that took part.
    """

    outcome: CheckOutcome
    evidence: str
    figures: Mapping[str, Any] = field(default_factory=dict)
    tools: Mapping[str, str] = field(default_factory=dict)


class Check(Protocol):
    """A check: never raises for what it finds, only for what the user must put right before it can start."""

    def __call__(self, subject: Subject) -> Result:
        """Run the check on `subject`."""
        ...
