"""Compile mutants of a bundle, run the verification cases on each, and tell what shows the fault."""

from enum import StrEnum
from typing import Final

from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.render import SUB_BLOCKS
from mambo_nmpc.codegen.toolchain import Toolchain
from mambo_nmpc.sil.verify import replay
from mambo_nmpc.sil.verify.cases import cases
from mambo_nmpc.sil.verify.check import Subject
from tests.support.mutants import Mutant, mutants

FILES: Final = (
    "include/nmpc_config.h",
    *(f"src/{block}.{end}" for block in SUB_BLOCKS["1-norm"] for end in "hc"),
    "src/nmpc.c",
    "src/nmpc_float.c",
)
"""What is mutated; a bundle without one of them has no mutants of it."""

LIMIT_S: Final = 5
"""Processor time of a mutant, in seconds; the generated C takes a tenth of one."""

_FLAGS: Final = (*replay.FLAGS, "-Werror=return-type", "-Iinclude", "-Isrc", "-I.")
_SANITIZED: Final = ("-O1", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all")


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
        units = [path for path in FILES if path.endswith(".c") and (self._folder / path).is_file()]
        (self._folder / "all.c").write_text("".join(f'#include "{unit}"\n' for unit in units))
        replay.write_program("nmpc", self._folder / "fuzz")
        self._tapes, self._expected = cases(subject.settings)
        self._tapes_file = subject.folder / "tapes.bin"
        replay.write_tapes(subject.settings, self._tapes, self._tapes_file)
        self._originals = {level: self._machine_code(level) for level in ("-O1", "-O3")}

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
            return self._fate()
        finally:
            file.write_text(text, "utf-8")

    def _fate(self) -> Fate:
        try:
            same = self._machine_code("-O1") == self._originals["-O1"]
        except BuildError:
            return Fate.REFUSED
        if not same and self.difference(("-O1",)) is not None:
            return Fate.OTHER_BITS
        # Also where the machine code is the same: the compiler may rely on what is undefined.
        if self.difference(_SANITIZED) is not None:
            return Fate.UNDEFINED
        same = same or self._machine_code("-O3") == self._originals["-O3"]
        return Fate.SAME if same else Fate.SURVIVED

    def _machine_code(self, level: str) -> bytes:
        """Compile the library as one unit, and return the object file."""
        self._gcc(level, "-c", "all.c", "-o", "all.o")
        return (self._folder / "all.o").read_bytes()

    def difference(self, flags: tuple[str, ...]) -> str | None:
        """Compile and run the cases; return what differs from the reference, None if nothing does."""
        self._gcc(*flags, "all.c", "fuzz/replay.c", "src/nmpc_self_test.c", "-o", "replay")
        limit_s = 10 * LIMIT_S if flags == _SANITIZED else LIMIT_S
        played = replay.play(self._folder / "replay", self._tapes_file, self.settings, self._tapes, limit_s)
        return replay.fault(played, self._expected)

    def _gcc(self, *arguments: str) -> None:
        Toolchain(("gcc",)).run([*_FLAGS, *arguments], self._folder)
