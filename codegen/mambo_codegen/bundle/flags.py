"""Flags of compilers and analysers, used by the Makefile of a bundle and by `sil`."""

from typing import Final

COMPILE_FLAGS: Final = ("-std=c99", "-O2", "-ffp-contract=off")
"""-ffp-contract=off: a fused multiply-add rounds once, two operations round twice."""

WARNING_FLAGS: Final = (
    "-pedantic",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wsign-conversion",
    "-Wdouble-promotion",
    "-Wfloat-conversion",
    "-Wshadow",
    "-Wundef",
    "-Wstrict-prototypes",
    "-Wmissing-prototypes",
)

PROOF_PREPROCESSING: Final = ("-msse2", "-mfpmath=sse", "-U__GNUC__")
"""Preprocessor flags for Frama-C, which analyses a 32-bit machine: SSE2 instead of x87 (FLT_EVAL_METHOD 0),
and standard C instead of builtins of GCC and clang."""

PROOFS: Final = {
    # Every operation that can result in NaN is an alarm.
    "take_numbers": (
        "-warn-special-float nan",
        "-main take_numbers",
        "-eva",
        "-eva-precision 2",
        "-eva-split-return auto",  # analyse accepted and refused inputs apart
    ),
    # NaN is a legal value. Precision 0, without relations between variables: from a stored comparison
    # Frama-C 25 derives x >= y from !(x < y), which is false for NaN.
    "refuse_nan": (
        "-warn-special-float none",
        "-main refuse_nan",
        "-eva",
        "-eva-precision 0",
    ),
}
"""Frama-C's options of each proof, by its entry function, in floating point."""

QUADRATIC_PROOFS: Final = {
    "take_numbers": (*PROOFS["take_numbers"], "-eva-use-spec nmpc_sine_cosine"),
    "refuse_nan": (
        *PROOFS["refuse_nan"],
        # What they require is that they are called without NaN.
        "-eva-use-spec nmpc_sine_cosine,nmpc_attitude_measure,nmpc_optimizer_minimize",
    ),
    "turn_everywhere": (
        "-warn-special-float nan",
        "-main turn_everywhere",
        "-eva",
        "-eva-precision 0",
        "-eva-min-loop-unroll 1400",  # more than the quarter turns of all headings
    ),
}
"""The same for a quadratic cost, whose products need bounds of sine and cosine."""

_WHOLE_NUMBERS: Final = (
    "-warn-signed-overflow",
    "-warn-signed-downcast",
    "-no-warn-right-shift-negative",  # nmpc_math.h asserts that it is arithmetic
)
FIXED_PROOFS: Final = {
    "take_numbers": (
        *_WHOLE_NUMBERS,
        "-main take_numbers",
        "-eva",
        "-eva-precision 2",
        "-eva-split-return auto",
        "-eva-use-spec nmpc_sine_cosine",
    ),
    "turn_everywhere": (
        *_WHOLE_NUMBERS,
        "-main turn_everywhere",
        "-eva",
        "-eva-precision 0",
        "-eva-min-loop-unroll 1400",  # more than the quarter turns of all headings
    ),
}
"""The same in fixed point, where no NaN exists and signed overflow is an alarm."""

PROOF_FLAGS: Final = (
    "-machdep x86_32",
    "-kernel-warn-key annot:missing-spec=abort",  # every function needs a body or a contract
    "-eva-no-print",
    "-eva-auto-loop-unroll 128",  # more than any loop of a controller
)
"""Options of all proofs."""

RULE_FLAGS: Final = (
    "--std=c99",
    "--addon=misra",
    "--platform=unix32",
    "--enable=warning,style,performance,portability",
    "--quiet",
)


def proofs(scalar: str, norm: str) -> dict[str, tuple[str, ...]]:
    """Return Frama-C's options of each proof for a scalar type and a norm of the cost, by entry function."""
    if scalar == "fixed":
        return FIXED_PROOFS
    return QUADRATIC_PROOFS if norm == "quadratic" else PROOFS
