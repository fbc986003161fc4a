"""Check: builds with sanitizers run the cases without a report, and compute the bits of the reference."""

from typing import Final

from mambo_sil.verify.bits import Build, play
from mambo_sil.verify.check import Result, Subject

_COMMON: Final = ("-g", "-O1", "-fno-omit-frame-pointer", "-fno-sanitize-recover=all")
BUILDS: Final = (
    Build(
        "address and undefined, gcc",
        "gcc",
        (*_COMMON, "-fsanitize=address,undefined,float-cast-overflow,float-divide-by-zero,bounds-strict"),
    ),
    Build(
        "address, undefined and conversions, clang",
        "clang",
        (
            *_COMMON,
            "-fsanitize=address,undefined,float-divide-by-zero,integer,implicit-conversion,local-bounds",
        ),
    ),
    Build("memory, clang", "clang", (*_COMMON, "-fsanitize=memory", "-fsanitize-memory-track-origins")),
)


def check(subject: Subject) -> Result:
    """Run the cases in every build with sanitizers."""
    return play(subject, BUILDS, "nothing reported")
