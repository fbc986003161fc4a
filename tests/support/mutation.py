"""Check: every small fault of the generated C shows in the bits, or is listed with why it cannot."""

import math
import resource
import shutil
import threading
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.render import SUB_BLOCKS
from mambo_nmpc.codegen.toolchain import Toolchain
from mambo_nmpc.sil.firmware.doctor import command_version
from mambo_nmpc.sil.verify import replay
from mambo_nmpc.sil.verify.cases import cases
from mambo_nmpc.sil.verify.check import Outcome, Result, Subject
from tests.support.mutants import Mutant, mutants
from tests.support.mutation_reasons import REASONS
from tests.support.reasons import reason_for, row

AT_ONCE: Final = 2
SLOWER: Final = 20
"""Processor time of a mutant, in times of the original's and beside a second; watched, as often that."""

_FLAGS: Final = (*replay.FLAGS, "-Werror=return-type", "-Iinclude", "-Isrc", "-I.")
_HARNESS_OBJECTS: Final = ("replay.o", "self_test.o")
_WATCHED: Final = ("-O1", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all")


class Fate(StrEnum):
    """What became of a mutant."""

    REFUSED = "refused by the compiler"
    SAME = "the same machine code"
    KILLED = "other bits, a crash or no end"
    WATCHED = "undefined, seen by sanitizers alone"
    EXPLAINED = "explained"
    SURVIVED = "survived"


@dataclass(frozen=True)
class Judged:
    """A mutant, what became of it, and why if it had to be explained."""

    mutant: Mutant
    fate: Fate
    reason: str = ""


def check(subject: Subject) -> Result:
    """Make every mutant, compile it, and compare its bits with the reference's over fixed cases."""
    tools = {"gcc": command_version("gcc") or ""}
    gap = replay.missing("gcc", _WATCHED, subject.folder)
    if gap:
        return Result(Outcome.INCOMPLETE, gap, tools=tools)
    bench = Bench(subject)
    fault = bench.original_fault()
    if fault:
        return Result(Outcome.FAILED, f"the unharmed C: {fault}", tools=tools)
    found = [mutant for path in bench.files for mutant in bench.mutants_of(path)]
    with ThreadPoolExecutor(AT_ONCE) as pool:
        judged = list(pool.map(bench.judge, found))
    return summary(subject, judged, tools)


class Bench:
    """Compiles and runs mutants of one bundle, each thread in a copy of its own."""

    def __init__(self, subject: Subject) -> None:
        replay.sources(subject)
        self._subject = subject
        self._prefix = subject.settings.code.prefix
        blocks = [name.replace("nmpc", self._prefix, 1) for name in SUB_BLOCKS]
        self._harness = ("fuzz/replay.c", f"src/{self._prefix}_self_test.c")
        code = [*blocks, self._prefix, f"{self._prefix}_float"]
        self._units = [path for name in code if (subject.bundle / (path := f"src/{name}.c")).is_file()]
        self.files = [
            f"include/{self._prefix}_config.h",
            *(f"src/{block}.h" for block in blocks),
            *self._units,
        ]
        self._tapes, self._expected = cases(subject.settings)
        self._tapes_file = subject.folder / "tapes.bin"
        replay.write_tapes(subject.settings, self._tapes, self._tapes_file)
        self._own = threading.local()
        self._lock = threading.Lock()
        self._benches = 0
        self._originals: dict[str, bytes] = {}
        self._limit_s = replay.LIMIT_S

    def mutants_of(self, path: str) -> list[Mutant]:
        """Return the mutants of one file; none if the bundle has not got it."""
        file = self._subject.bundle / path
        return mutants(path, file.read_text("utf-8"), self._prefix) if file.is_file() else []

    def original_fault(self) -> str | None:
        """Judge the C as it is, and keep its machine code to compare with."""
        folder = self._folder()
        for level in ("-O3", "-O1"):
            try:
                self._originals[level] = self._machine_code(folder, level)
            except BuildError as error:
                return str(error)
        before_s = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        fault = self._fault(folder)
        taken_s = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before_s
        self._limit_s = 1 + math.ceil(SLOWER * taken_s)
        return fault

    def judge(self, mutant: Mutant) -> Judged:
        """Compile and run one mutant, and put the file right again."""
        folder = self._folder()
        file = folder / mutant.file
        text = file.read_text("utf-8")
        file.write_text(mutant.apply(text), "utf-8")
        try:
            fate = self._fate(folder, mutant)
        finally:
            file.write_text(text, "utf-8")
        if fate is Fate.SURVIVED:
            reason = reason_for(mutant.key, REASONS, self._subject.settings)
            if reason is not None:
                return Judged(mutant, Fate.EXPLAINED, reason)
        return Judged(mutant, fate)

    def _fate(self, folder: Path, mutant: Mutant) -> Fate:
        try:
            made = self._machine_code(folder, "-O1")
        except BuildError:
            return Fate.REFUSED
        same = made == self._originals["-O1"]
        whole = mutant.file.startswith("include/")
        if not same and self._fault(folder, ("-O1",) if whole else None) is not None:
            return Fate.KILLED
        # Same machine code or not: a compiler may take what is undefined for what was meant.
        if self._fault(folder, _WATCHED) is not None:
            return Fate.WATCHED
        same = same or self._machine_code(folder, "-O3") == self._originals["-O3"]
        return Fate.SAME if same else Fate.SURVIVED

    def _machine_code(self, folder: Path, level: str) -> bytes:
        """Compile the library as one unit, and return the object file."""
        self._gcc(folder, level, "-c", "all.c", "-o", "all.o")
        return (folder / "all.o").read_bytes()

    def _fault(self, folder: Path, anew: Sequence[str] | None = None) -> str | None:
        """Link and run; with flags compile all `anew`, not the library alone. None if nothing differs."""
        if anew is None:
            self._gcc(folder, *_HARNESS_OBJECTS, "all.o", "-o", "replay")
        else:
            self._gcc(folder, *anew, "all.c", *self._harness, "-o", "replay")
        limit_s = self._limit_s * (SLOWER if anew == _WATCHED else 1)
        program = folder / "replay"
        played = replay.play(program, self._tapes_file, self._subject.settings, self._tapes, limit_s)
        return replay.fault(played, self._expected)

    def _folder(self) -> Path:
        """Return this thread's copy of the bundle, with what does not change compiled."""
        if not hasattr(self._own, "folder"):
            with self._lock:
                self._benches += 1
                folder = self._subject.folder / f"bench-{self._benches}"
            for part in ("include", "src", "fuzz"):
                shutil.copytree(self._subject.bundle / part, folder / part)
            (folder / "all.c").write_text("".join(f'#include "{unit}"\n' for unit in self._units))
            replay.write_program(self._prefix, folder / "fuzz")
            for source, made in zip(self._harness, _HARNESS_OBJECTS, strict=True):
                self._gcc(folder, "-O1", "-c", source, "-o", made)
            self._own.folder = folder
        return Path(self._own.folder)

    def _gcc(self, folder: Path, *arguments: str) -> None:
        Toolchain(("gcc",)).run([*_FLAGS, *arguments], folder)


def summary(subject: Subject, judged: Sequence[Judged], tools: dict[str, str]) -> Result:
    """Count fates, and list survivors with their diffs and the rows that would explain them."""
    counts = Counter(one.fate for one in judged)
    survivors = [one.mutant for one in judged if one.fate is Fate.SURVIVED]
    killed = counts[Fate.KILLED] + counts[Fate.WATCHED]
    faults = killed + len(survivors)
    figures: dict[str, Any] = {
        "mutants": len(judged),
        "fates": {fate.value: counts[fate] for fate in Fate},
        "score": killed / faults if faults else 0.0,
        "by_rule": {
            rule: {
                fate.value: n
                for fate in Fate
                if (n := sum(1 for o in judged if o.mutant.rule == rule and o.fate is fate))
            }
            for rule in sorted({one.mutant.rule for one in judged})
        },
        "explained": [
            _described(one.mutant) | {"reason": one.reason} for one in judged if one.fate is Fate.EXPLAINED
        ],
        "survivors": [_described(mutant) for mutant in survivors],
    }
    rows = "".join(row(mutant.key) for mutant in survivors)
    (subject.folder / "survivors.txt").write_text(
        "".join(
            f"{d['where']}: {d['rule']}: {d['key'][2]}\n- {d['right']}\n+ {d['wrong']}\n\n"
            for d in figures["survivors"]
        )
        + (f"rows for tests/support/mutation_reasons.py:\n{rows}" if rows else "")
    )
    evidence = (
        f"{killed} of {faults} faults caught; of {len(judged)} mutants {counts[Fate.SAME]} are the same "
        f"machine code, {counts[Fate.REFUSED]} do not compile, {counts[Fate.EXPLAINED]} are explained"
    )
    if survivors:
        first = figures["survivors"][0]
        evidence += f"; {len(survivors)} neither caught nor explained, the first {first['where']}: "
        evidence += f"{first['wrong']}; all in {subject.folder / 'survivors.txt'}"
    return Result(
        Outcome.FAILED if survivors or not killed else Outcome.PASSED, evidence, figures=figures, tools=tools
    )


def _described(mutant: Mutant) -> dict[str, Any]:
    """Describe a mutant for programs: place, rule, the line before and after, key."""
    return {
        "where": f"{mutant.file}:{mutant.line}",
        "rule": mutant.rule,
        "right": mutant.right_line,
        "wrong": mutant.wrong_line,
        "key": list(mutant.key),
    }
