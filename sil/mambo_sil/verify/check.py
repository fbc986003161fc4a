"""A check of the generated C: a function that takes a subject and returns a result; and the list of all.

This module imports nothing slow, because `--help` imports it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
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

    settings: "Settings"
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


class Entry(NamedTuple):
    """A check: its name, what it checks in one line, and the tools whose versions the evidence lists."""

    name: str
    about: str
    tools: tuple[str, ...]
    module: str
    """Module of the check, imported when it runs."""

    @property
    def check(self) -> Check:
        """The function of the check."""
        check: Check = import_module(f"{__package__}.{self.module}").check
        return check


_COMPILERS: Final = ("clang", "gcc")

CHECKS: Final = (
    Entry(
        "warnings",
        "no compiler warning in six dialects of C and C++",
        (*_COMPILERS, "clang++", "g++"),
        "dialects",
    ),
    Entry(
        "rules", "MISRA C:2012, checked by cppcheck, except for the listed deviations", ("cppcheck",), "rules"
    ),
    Entry(
        "proof",
        "proven by Frama-C for every input: no run-time error, no stored NaN, no command beyond the limit",
        ("frama-c",),
        "proof",
    ),
    Entry(
        "sanitizers",
        "no undefined behaviour in thousands of calls, same bits as the reference",
        _COMPILERS,
        "sanitizers",
    ),
    Entry(
        "fuzzing",
        "half a million runs of a fuzzer: every promise of nmpc.h holds, same bits as the reference",
        ("clang",),
        "fuzzing",
    ),
    Entry("bits", "gcc and clang at all optimisation levels: same bits as the reference", _COMPILERS, "bits"),
    Entry("faults", "flights with faults: bounded commands, and recovery", (), "fault_check"),
)
"""All checks, in the order in which `mambo-nmpc verify` runs them."""
