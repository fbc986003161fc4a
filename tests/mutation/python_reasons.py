"""Why some faults of Python change nothing that a test can see, by file, line and change."""

from collections.abc import Mapping
from typing import Final

from tests.mutation.reasons import Key

REASONS: Final[Mapping[Key, str]] = {
    **{
        ("fences.py", 'for end, sign in (("min", -1), ("max", 1))', change): "a multiple of infinity"
        for change in ("1 -> 2", "1 -> 2 #1")
    },
    (
        "fences.py",
        "along = (way_m / np.where(rests, length_m, 1.0)[:, np.newaxis]).T",
        "1.0 -> 1.1",
    ): "of a flight whose target does not rest, whose overshoot is 0",
    (
        "fences.py",
        "return 0.0 * float(trace.position_m[-1, row, 0])",
        "0 -> 1",
    ): "x and y of a lost flight are NaN together",
}
