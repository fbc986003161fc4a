"""Options of Frama-C for the proofs that controllers of every method have, by entry function."""

from collections.abc import Mapping
from typing import Final

_SPEC: Final = "-eva-use-spec "
_SPLIT: Final = (
    "-eva-split-return auto",  # analyse accepted and refused inputs apart
    "-eva-split-return-function between:0,within:0,is_good_point:0,is_good_state:0,is_good_target:0",
)
FLOAT_PROOFS: Final = {
    # Every operation that can result in NaN is an alarm.
    "take_numbers": (
        "-warn-special-float nan",
        "-main take_numbers",
        "-eva",
        "-eva-precision 2",
        *_SPLIT,
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
"""In floating point."""

_WHOLE_NUMBERS: Final = (
    "-warn-signed-overflow",
    "-warn-signed-downcast",
    "-no-warn-right-shift-negative",  # nmpc.c asserts that it is arithmetic
)
TURN_EVERYWHERE: Final = (
    "-main turn_everywhere",
    "-eva",
    "-eva-precision 0",
    "-eva-min-loop-unroll 1400",  # more than the quarter turns of all headings
)
"""Bounds of sine and cosine over all headings."""

FIXED_PROOFS: Final = {
    "take_numbers": (
        *_WHOLE_NUMBERS,
        "-main take_numbers",
        "-eva",
        "-eva-precision 2",
        *_SPLIT,
        "-eva-use-spec sine_cosine",
    ),
    "turn_everywhere": (*_WHOLE_NUMBERS, *TURN_EVERYWHERE),
}
"""In fixed point, where no NaN exists and signed overflow is an alarm."""


def with_limits(proofs: Mapping[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """Return the options of the proofs of a controller with limits.

    Eva takes inverse square roots by their contract. What reads a target calls limits_are_free(), but
    optimizer_minimize() runs after an outage without any.
    """
    found = {}
    for name, flags in proofs.items():
        specs = [flag.removeprefix(_SPEC) for flag in flags if flag.startswith(_SPEC)]
        used = ",".join(["inverse_root", *specs]).replace("optimizer_minimize", "limits_are_free")
        others = tuple(flag for flag in flags if not flag.startswith(_SPEC))
        found[name] = others if name == "turn_everywhere" else (*others, _SPEC + used)
    return found
