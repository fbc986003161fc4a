"""Compile mutants of a bundle, run the verification cases on each, and tell what shows the fault."""

import subprocess
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Final

import numpy as np

from mambo_codegen.errors import BuildError
from mambo_codegen.toolchain import Toolchain
from mambo_sil.verify import tape_replay
from mambo_sil.verify.calls import outcome_type
from mambo_sil.verify.cases import cases
from mambo_sil.verify.check import Subject
from tests.mutation.mutants import Mutant, mutants
from tests.mutation.schemata import ORIGINAL, can_share, refused_numbers, with_mutants

FILES: Final = ("nmpc.h", "nmpc.c")
"""What is mutated."""

LIMIT_S: Final = 5
"""Processor time of a mutant, in seconds; the generated C takes a tenth of one."""

SHARED_LIMIT_S: Final = 1
"""The same in a shared program, in which the C without a fault runs first and must end in time."""

_PROGRAM: Final = Path(__file__).with_name("schemata.c")
_SHARED: Final = "shared"
_LIBRARY: Final = "nmpc.c"
_OTHERS: Final = {
    "fuzz/replay.c": ("nmpc.h",),
    "nmpc_self_test.c": ("nmpc.h",),
}
"""What is linked with the library, and the files with mutants that it includes."""

_FLAGS: Final = (*tape_replay.FLAGS, "-Werror=return-type", "-I.")
_FAST: Final[tuple[str, ...]] = ("-O1",)
_SMALL: Final = ("-O1", "-Dalways_inline=unused")
"""For the shared program: a copy of each mutant in each caller takes the compiler minutes and gigabytes."""
_SANITIZED: Final[tuple[str, ...]] = (
    "-O1",
    "-fsanitize=address,undefined,float-cast-overflow",
    "-fno-sanitize-recover=all",
)


class Fate(StrEnum):
    """What became of a mutant."""

    REFUSED = "refused by the compiler"
    SAME = "the same machine code"
    OTHER_BITS = "other bits, a crash or no end"
    UNDEFINED = "undefined, reported by sanitizers alone"
    SURVIVED = "survived"


class Bench:
    """Compiles and runs mutants of the C in one bundle, which it changes and restores."""

    def __init__(self, subject: Subject) -> None:
        self.settings = subject.settings
        self._folder = subject.bundle
        tape_replay.write_program("nmpc", self._folder / "fuzz")
        self._tapes, self._expected = cases(subject.settings)
        self._tapes_file = subject.folder / "tapes.bin"
        tape_replay.write_tapes(subject.settings, self._tapes, self._tapes_file)
        self._outcomes_file = subject.folder / "outcomes.bin"
        any_outcome = np.zeros(1, outcome_type(self.settings)).tobytes()
        self._outcomes_file.write_bytes(
            b"".join(
                b"\0" + any_outcome + b"".join(b"\1" + outcome.tobytes() for outcome in outcomes)
                for outcomes in self._expected
            )
        )
        self._texts = {unit: self._preprocessed(unit) for unit in (_LIBRARY, *_OTHERS)}
        self._originals = {flags: self._all_objects(flags) for flags in (_FAST, _SANITIZED)}
        self._optimized = self._compile(("-O3",), _LIBRARY)

    def mutants_of(self, path: str) -> list[Mutant]:
        """Return the mutants of one file."""
        file = self._folder / path
        return mutants(path, file.read_text("utf-8")) if file.is_file() else []

    def fate(self, mutant: Mutant) -> Fate:
        """Compile and run one mutant, then restore the file."""
        file = self._folder / mutant.file
        text = file.read_text("utf-8")
        file.write_text(mutant.apply(text), "utf-8")
        try:
            return self._fate(mutant.file)
        finally:
            file.write_text(text, "utf-8")

    def unnoticed(self, mutants: Sequence[Mutant]) -> list[Mutant]:
        """Run many mutants in one program; return those that show in no outcome.

        Mutants that cannot share a program, or that the compiler refuses in it, are returned too.
        """
        texts = {path: (self._folder / path).read_text("utf-8") for path in {one.file for one in mutants}}
        shared = [one for one in mutants if can_share(texts[one.file], one)]
        numbered = dict(enumerate(shared, ORIGINAL + 1))
        noticed = dict(numbered)
        try:
            while refused := self._build_shared(texts, noticed):
                noticed = {number: one for number, one in noticed.items() if number not in refused}
        finally:
            for path, text in texts.items():
                (self._folder / path).write_text(text, "utf-8")
        done = subprocess.run(
            [f"./{_SHARED}", str(self._tapes_file), str(SHARED_LIMIT_S), str(self._outcomes_file)]
            + [str(number) for number in (ORIGINAL, *noticed)],
            cwd=self._folder,
            capture_output=True,
            text=True,
            check=True,
        )
        original, *same = map(int, done.stdout.split())
        assert original == ORIGINAL, "the C without a fault shows in no outcome either"
        shown = {noticed[number] for number in noticed.keys() - set(same)}
        return [one for one in mutants if one not in shown]

    def _build_shared(self, texts: Mapping[str, str], numbered: Mapping[int, Mutant]) -> set[int]:
        """Compile mutants into one program; return the numbers of those that the compiler refuses."""
        for path, text in texts.items():
            own = {number: one for number, one in numbered.items() if one.file == path}
            (self._folder / path).write_text(with_mutants(text, own), "utf-8")
        size = f"-DOUTCOME_BYTES={outcome_type(self.settings).itemsize}U"
        units = (_LIBRARY, "nmpc_self_test.c", str(_PROGRAM))
        done = subprocess.run(
            ["gcc", *_FLAGS, *_SMALL, size, *units, "-o", _SHARED],
            cwd=self._folder,
            capture_output=True,
            text=True,
            check=False,
        )
        refused = refused_numbers(done.stderr)
        assert refused or done.returncode == 0, done.stderr
        return refused

    def difference(self) -> str | None:
        """Compile all anew and run the cases; return what differs from the reference, None if nothing."""
        return self._play(_FAST, self._all_objects(_FAST))

    def _fate(self, changed: str) -> Fate:
        try:
            if all(self._preprocessed(unit) == text for unit, text in self._texts.items()):
                return Fate.SAME
            objects = self._objects(_FAST, changed)
        except BuildError:
            return Fate.REFUSED
        same = objects[0] == self._originals[_FAST][0]
        if not same and self._play(_FAST, objects) is not None:
            return Fate.OTHER_BITS
        # Also where the machine code is the same: the compiler may rely on what is undefined.
        objects = self._objects(_SANITIZED, changed)
        if objects != self._originals[_SANITIZED] and self._play(_SANITIZED, objects) is not None:
            return Fate.UNDEFINED
        same = same or self._compile(("-O3",), _LIBRARY) == self._optimized
        return Fate.SAME if same else Fate.SURVIVED

    def _all_objects(self, flags: tuple[str, ...]) -> list[bytes]:
        return [self._compile(flags, unit) for unit in (_LIBRARY, *_OTHERS)]

    def _objects(self, flags: tuple[str, ...], changed: str) -> list[bytes]:
        """Compile the library as one unit, and of the rest what includes the changed file."""
        originals = self._originals[flags][1:]
        return [
            self._compile(flags, _LIBRARY),
            *(
                self._compile(flags, unit) if changed in included else original
                for (unit, included), original in zip(_OTHERS.items(), originals, strict=True)
            ),
        ]

    def _preprocessed(self, unit: str) -> str:
        """Return C as the compiler sees it, without directives, comments and what they leave out."""
        self._gcc(*_FAST, "-E", "-P", unit, "-o", "unit.i")
        return (self._folder / "unit.i").read_text("utf-8")

    def _compile(self, flags: tuple[str, ...], unit: str) -> bytes:
        self._gcc(*flags, "-c", unit, "-o", "unit.o")
        return (self._folder / "unit.o").read_bytes()

    def _play(self, flags: tuple[str, ...], objects: list[bytes]) -> str | None:
        """Link and run the cases; return what differs from the reference, None if nothing does."""
        names = [f"{index}.o" for index in range(len(objects))]
        for name, code in zip(names, objects, strict=True):
            (self._folder / name).write_bytes(code)
        self._gcc(*flags, *names, "-o", "replay")
        limit_s = 10 * LIMIT_S if flags == _SANITIZED else LIMIT_S
        played = tape_replay.play(
            self._folder / "replay", self._tapes_file, self.settings, self._tapes, limit_s
        )
        return tape_replay.fault(played, self._expected)

    def _gcc(self, *arguments: str) -> None:
        Toolchain(("gcc",)).run([*_FLAGS, *arguments], self._folder)
