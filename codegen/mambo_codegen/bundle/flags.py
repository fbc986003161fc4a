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
and standard C in the four small functions with a quicker form for gcc and clang; a test compares them."""

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
