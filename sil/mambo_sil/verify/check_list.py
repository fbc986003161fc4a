"""The registry of checks, in the order in which `mambo-nmpc verify` runs them."""

from importlib import import_module
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from mambo_sil.verify.check import Check


class Entry(NamedTuple):
    """A check: its name, what it checks in one line, and the tools whose versions the evidence lists."""

    name: str
    about: str
    tools: tuple[str, ...]
    module: str
    """Module of the check, imported when it runs."""

    @property
    def check(self) -> "Check":
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
