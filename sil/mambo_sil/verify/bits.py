"""Check: builds of gcc and clang at several optimisation levels compute the bits of the reference."""

from collections.abc import Sequence
from typing import Final, NamedTuple

from mambo_codegen.errors import BuildError
from mambo_sil.verify import tape_replay
from mambo_sil.verify.cases import cases
from mambo_sil.verify.check import Result, Subject, combine


class Build(NamedTuple):
    """A build of the C: its name, compiler and flags."""

    name: str
    tool: str
    flags: tuple[str, ...]


BUILDS: Final = tuple(
    Build(f"{tool} {level}", tool, (level,))
    for tool, level in (("gcc", "-O0"), ("gcc", "-O2"), ("gcc", "-O3"), ("clang", "-O2"), ("clang", "-O3"))
)


def check(subject: Subject) -> Result:
    """Run the cases in every build."""
    return play(subject, BUILDS, "bits of the reference")


def play(subject: Subject, builds: Sequence[Build], finding: str) -> Result:
    """Run the cases in every build; fail if one reports an error or differs from the reference in a bit.

    `finding` is what passing builds show; it ends the line of evidence.
    """
    tapes, expected = cases(subject.settings)
    calls = sum(len(tape) for tape in tapes)
    tapes_file = subject.folder / "tapes.bin"
    tape_replay.write_tapes(subject.settings, tapes, tapes_file)
    faults: list[str] = []
    gaps: list[str] = []
    good: list[str] = []
    for index, build in enumerate(builds):
        folder = subject.folder / f"build-{index}"
        folder.mkdir()
        try:
            program = tape_replay.build(subject, build.tool, build.flags, folder)
        except BuildError as error:
            gap = tape_replay.missing(build.tool, build.flags, folder)
            if gap:
                gaps.append(gap)
            else:
                faults.append(f"{build.name}: does not compile: {error}")
            continue
        played = tape_replay.play(program, tapes_file, subject.settings, tapes)
        (folder / "report.txt").write_text(played.report)
        fault = tape_replay.fault(played, expected)
        if fault:
            faults.append(f"{build.name}: {fault}; {folder / 'report.txt'}")
        else:
            good.append(build.name)
    counted = f"{calls} calls of {len(tapes)} tapes in {len(good)} of {len(builds)} builds: {finding}"
    figures = {"tapes": len(tapes), "calls": calls, "builds": good, "faults": faults, "missing": gaps}
    return combine(faults, gaps, counted, figures)
