"""The registry: every check that `mambo-nmpc verify` runs, in this order."""

from importlib import import_module
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from mambo_nmpc.sil.verify.check import Check


class Entry(NamedTuple):
    """A check by name, what it is about in one line, and the tools whose versions are evidence."""

    name: str
    about: str
    tools: tuple[str, ...]
    module: str
    """Where the check is; imported when it runs."""

    @property
    def check(self) -> "Check":
        """The check itself."""
        check: Check = import_module(f"{__package__}.{self.module}").check
        return check


_COMPILERS: Final = ("clang", "gcc")

CHECKS: Final = (
    Entry("warnings", "no warning in any dialect of C or C++", (*_COMPILERS, "clang++", "g++"), "dialects"),
    Entry("rules", "MISRA C:2012 by cppcheck, except for the listed deviations", ("cppcheck",), "rules"),
    Entry(
        "proof",
        "Frama-C: no run-time error, no stored NaN, no command beyond the limit, for every input",
        ("frama-c",),
        "proof",
    ),
    Entry(
        "sanitizers",
        "no undefined behaviour in thousands of calls, bits of the reference",
        _COMPILERS,
        "sanitizers",
    ),
    Entry(
        "fuzzing",
        "half a million inputs chosen by a fuzzer: every promise kept, bits of the reference",
        ("clang",),
        "fuzzing",
    ),
    Entry("bits", "optimised builds have the bits of the reference", _COMPILERS, "bits"),
    Entry("faults", "bounded commands and recovery from faults in flight", (), "faults"),
)
