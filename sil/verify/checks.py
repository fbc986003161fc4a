"""The registry: every check that `mambo-nmpc verify` runs, in this order."""

from typing import Final, NamedTuple

from mambo_nmpc.sil.verify import (
    coverage,
    dialects,
    faults,
    fuzzing,
    mutation,
    proof,
    rules,
    sanitizers,
    signs,
    work,
)
from mambo_nmpc.sil.verify.check import Check


class Entry(NamedTuple):
    """A check by name, with what it is about in one line."""

    name: str
    about: str
    check: Check


CHECKS: Final = (
    Entry("warnings", "every compiler and dialect, all warnings on", dialects.check),
    Entry("rules", "MISRA C:2012 by cppcheck, less the deviations listed", rules.check),
    Entry("proof", "Frama-C: no run-time error, no NaN kept, no wild command, for every input", proof.check),
    Entry("sanitizers", "nothing undefined in thousands of calls, same bits", sanitizers.check),
    Entry("fuzzing", "half a million inputs that a fuzzer found worth trying, same bits", fuzzing.check),
    Entry("coverage", "every line and branch of the C runs, or is listed with its reason", coverage.check),
    Entry("mutation", "every small fault of the C shows, or is listed with its reason", mutation.check),
    Entry("work", "a step does the same work whatever it is handed", work.check),
    Entry(
        "signs", "float64, or float32 for float64, decides alike but for ties, and flies alike", signs.check
    ),
    Entry("faults", "bounded commands and a way back, whatever fails in flight", faults.check),
)
