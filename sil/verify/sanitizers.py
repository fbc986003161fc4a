"""Check: builds that watch every access, conversion and bit of memory play the project's cases."""

from typing import Final, NamedTuple

from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.sil.firmware.doctor import command_version
from mambo_nmpc.sil.verify import replay
from mambo_nmpc.sil.verify.cases import cases
from mambo_nmpc.sil.verify.check import CheckOutcome, Result, Subject


class Watch(NamedTuple):
    """A build that watches: a name, a compiler, its flags."""

    name: str
    tool: str
    flags: tuple[str, ...]


_COMMON: Final = ("-g", "-O1", "-fno-omit-frame-pointer", "-fno-sanitize-recover=all")
WATCHES: Final = (
    Watch(
        "address and undefined, gcc",
        "gcc",
        (*_COMMON, "-fsanitize=address,undefined,float-cast-overflow,float-divide-by-zero,bounds-strict"),
    ),
    Watch(
        "address, undefined and conversions, clang",
        "clang",
        (
            *_COMMON,
            "-fsanitize=address,undefined,float-divide-by-zero,integer,implicit-conversion,local-bounds",
        ),
    ),
    Watch("memory, clang", "clang", (*_COMMON, "-fsanitize=memory", "-fsanitize-memory-track-origins")),
)


def check(subject: Subject) -> Result:
    """Play the cases on every watching build: no report, and the bits of the reference."""
    tapes, expected = cases(subject.settings)
    calls = sum(len(tape) for tape in tapes)
    tapes_file = subject.folder / "tapes.bin"
    replay.write_tapes(subject.settings, tapes, tapes_file)
    faults, gaps, passed = [], [], []
    for index, watch in enumerate(WATCHES):
        folder = subject.folder / f"watch-{index}"
        folder.mkdir()
        gap = replay.missing(watch.tool, watch.flags, folder)
        if gap:
            gaps.append(gap)
            continue
        try:
            program = replay.build(subject, watch.tool, watch.flags, folder)
        except BuildError as error:
            faults.append(f"{watch.name}: does not build: {error}")
            continue
        played = replay.play(program, tapes_file, subject.settings, tapes)
        (folder / "report.txt").write_text(played.report)
        fault = replay.fault(played, expected)
        if fault:
            faults.append(f"{watch.name}: {fault}; {folder / 'report.txt'}")
        else:
            passed.append(watch.name)
    outcome = CheckOutcome.FAILED if faults else CheckOutcome.INCOMPLETE if gaps else CheckOutcome.PASSED
    counted = (
        f"{calls} calls of {len(tapes)} tapes under {len(passed)} of {len(WATCHES)} builds, nothing reported"
    )
    return Result(
        outcome,
        "; ".join([*faults, *gaps, counted]),
        figures={"tapes": len(tapes), "calls": calls, "builds": passed, "faults": faults, "missing": gaps},
        tools={tool: command_version(tool) or "" for tool in sorted({watch.tool for watch in WATCHES})},
    )
