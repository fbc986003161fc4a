"""Compiler flags of a bundle, the same in its Makefile and in the software in the loop."""

from typing import Final

COMPILE_FLAGS: Final = ("-std=c99", "-O2", "-ffp-contract=off")
"""Without contraction: a fused multiply-add rounds once where two operations round twice."""

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
"""Frama-C takes the sizes of a 32-bit machine; two keep the preprocessor from naming its x87, and without
__GNUC__ two operations of gcc and clang are spelled out in C."""

PROOFS: Final = {
    # NaN is an alarm wherever an operation gives it.
    "take_numbers": (
        "-warn-special-float nan",
        "-main take_numbers",
        "-eva",
        "-eva-precision 2",
        "-eva-split-return auto",  # a range check that says yes and one that says no are told apart
    ),
    # NaN is a value. No relations between variables: Frama-C 25 takes !(x < y) for x >= y when it draws
    # conclusions from a stored comparison, which NaN breaks.
    "refuse_nan": (
        "-warn-special-float none",
        "-main refuse_nan",
        "-eva",
        "-eva-precision 0",
    ),
}
"""What each of the two proofs asks of Frama-C."""

_WHOLE_NUMBERS: Final = (
    "-warn-signed-overflow",
    "-warn-signed-downcast",
    "-no-warn-right-shift-negative",  # nmpc_math.h asserts what it does
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
        "-eva-min-loop-unroll 1400",  # all quarter turns of a heading
    ),
}
"""The same for fixed point: no NaN, and overflow to look for."""

PROOF_FLAGS: Final = (
    "-machdep x86_32",
    "-kernel-warn-key annot:missing-spec=abort",  # no function without a body or a contract
    "-eva-no-print",
    "-eva-auto-loop-unroll 128",  # every loop of a controller is shorter
)
"""What all ask."""

RULE_FLAGS: Final = (
    "--std=c99",
    "--addon=misra",
    "--platform=unix32",
    "--enable=warning,style,performance,portability",
    "--quiet",
)


def proofs(scalar: str) -> dict[str, tuple[str, ...]]:
    """Return the proofs of a scalar type: what each asks of Frama-C, by the function it starts in."""
    return FIXED_PROOFS if scalar == "fixed" else PROOFS
