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
