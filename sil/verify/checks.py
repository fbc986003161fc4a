"""The registry: every check that `mambo-nmpc verify` runs, in this order."""

from importlib import import_module
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from mambo_nmpc.sil.verify.check import Check


class Entry(NamedTuple):
    """A check by name, what it is about in one line, and its module, which is imported when it runs."""

    name: str
    about: str
    module: str

    @property
    def check(self) -> "Check":
        """The check itself."""
        check: Check = import_module(f"{__package__}.{self.module}").check
        return check


CHECKS: Final = (
    Entry("warnings", "every compiler and dialect, all warnings on", "dialects"),
    Entry("rules", "MISRA C:2012 by cppcheck, less the deviations listed", "rules"),
    Entry("proof", "Frama-C: no run-time error, no NaN kept, no wild command, for every input", "proof"),
    Entry("sanitizers", "nothing undefined in thousands of calls, same bits", "sanitizers"),
    Entry("fuzzing", "half a million inputs that a fuzzer found worth trying, same bits", "fuzzing"),
    Entry("faults", "bounded commands and a way back, whatever fails in flight", "faults"),
)
