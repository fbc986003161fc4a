"""Run the self-test of a bundle on many mutants of its C, and tell which of them it notices, and when."""

import re
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from enum import IntEnum
from pathlib import Path
from typing import Final

from mambo_codegen.bundle.render import render
from mambo_codegen.settings.model import Settings
from tests.mutation.mutants import Mutant, mutants
from tests.mutation.mutation import Fate
from tests.mutation.schemata import CHOSEN, can_share, refused_numbers, with_mutants
from tests.support.bundles import place
from tests.support.tools import require

FILES: Final = ("nmpc.h", "nmpc.c")
"""What is mutated."""

AT_ONCE: Final = 400
"""So many mutants are compiled into one program."""

_PROGRAM: Final = str(Path(__file__).with_name("broken_lines.c"))
_UNITS: Final = ("nmpc.c", "nmpc_self_test.c", _PROGRAM)
_FLAGS: Final = (
    *("-std=c99", "-ffp-contract=off", "-D_POSIX_C_SOURCE=200809L", "-w", "-Werror=return-type", "-I."),
    *("-O1", "-Dalways_inline=unused"),
)
_SANITIZED: Final = (
    *(*_FLAGS, "-ftrivial-auto-var-init=pattern", "-fno-sanitize-recover=all"),
    "-fsanitize=address,undefined,float-cast-overflow",
)
_MACRO: Final = re.compile(
    r"^([ \t]*#[ \t]*define[ \t]+\w+[ \t]+)([^\n]*?)([ \t]*(?:/\*[^\n]*)?)$", re.MULTILINE
)
_NUMBER: Final = re.compile(r"-?(?:\d+\.\d*(?:e[-+]?\d+)?f?|\d+e[-+]?\d+f?|\d{3,})")
_FLOATS: Final = "/* ---- Float -"
_NAMED: Final = re.compile(r"\bNMPC_\w+")


class Noticed(IntEnum):
    """What notices a mutant, as in broken_lines.c."""

    NEVER = 0
    AT_START_UP = 1
    IN_EPISODES = 2


class SelfTestBench:
    """A bundle in a folder, whose C has mutants, of which a global number chooses one."""

    def __init__(self, settings: Settings, folder: Path) -> None:
        self.settings, self.files = settings, render(settings)
        self._folder, self._gcc = folder / "broken", require("gcc", "gcc")
        self._place()
        self._preprocessed = self._object("-E", "-P")
        self._optimized = self._object("-O3", "-c")

    def mutants(self) -> list[Mutant]:
        """Return every mutant of the C but those of the functions with floats of a bundle in fixed point.

        The self-test does not call these: firmware that does not shall not link them.
        """
        end = self.files["nmpc.c"].find(_FLOATS)
        return [
            one
            for name in FILES
            for one in mutants(name, self.files[name])
            if name != "nmpc.c" or end < 0 or one.start < end
        ]

    def noticed(self, lines: Sequence[Mutant]) -> dict[Mutant, Noticed]:
        """Return what notices each mutant that compiles; the others are left out."""
        found = dict[Mutant, Noticed]()
        for first in range(0, len(lines), AT_ONCE):
            found |= self._noticed(lines[first : first + AT_ONCE])
        return found

    def fate(self, mutant: Mutant) -> Fate:
        """Return what becomes of a mutant that the self-test does not notice."""
        self._place({mutant.file: mutant.apply(self.files[mutant.file])})
        try:
            if self._preprocessed == self._object("-E", "-P") or self._optimized == self._object("-O3", "-c"):
                return Fate.SAME
            if self._build(*_SANITIZED).returncode != 0:
                return Fate.REFUSED
            done = subprocess.run("./broken", cwd=self._folder, check=False, capture_output=True)
            return Fate.SURVIVED if done.returncode == 0 else Fate.UNDEFINED
        finally:
            self._place()

    def _noticed(self, lines: Sequence[Mutant]) -> dict[Mutant, Noticed]:
        numbered = dict(enumerate(lines, 1))
        shared = {number: one for number, one in numbered.items() if self._is_shared(one)}
        while True:
            self._place(self._texts(shared))
            done = self._build(*_FLAGS)
            named = {f"define {name} " for name in _NAMED.findall(done.stderr)}
            refused = refused_numbers(done.stderr) or {
                number for number, one in shared.items() if any(name in self._line(one) for name in named)
            }
            if done.returncode == 0:
                break
            assert refused, done.stderr
            shared = {number: one for number, one in shared.items() if number not in refused}
        found = {shared[number]: result for number, result in self._run(shared)}
        for one in (one for number, one in numbered.items() if number not in shared):
            found |= self._alone(one)
        self._place()
        return found

    def _alone(self, mutant: Mutant) -> dict[Mutant, Noticed]:
        """Build one mutant; nothing if the compiler refuses it."""
        self._place({mutant.file: mutant.apply(self.files[mutant.file])})
        if self._build(*_FLAGS).returncode != 0:
            return {}
        try:
            done = subprocess.run("./broken", cwd=self._folder, check=False, timeout=60)
        except subprocess.TimeoutExpired:
            return {mutant: Noticed.AT_START_UP}
        crashed = done.returncode not in set(Noticed)
        return {mutant: Noticed.AT_START_UP if crashed else Noticed(done.returncode)}

    def _is_shared(self, mutant: Mutant) -> bool:
        text = self.files[mutant.file]
        is_macro = any(macro.start(2) <= mutant.start < macro.end(2) for macro in self._macros(mutant.file))
        return is_macro or (mutant.file == "nmpc.c" and can_share(text, mutant))

    def _macros(self, name: str) -> Iterator[re.Match[str]]:
        """Yield the macros that are a number which an expression may replace."""
        yield from (macro for macro in _MACRO.finditer(self.files[name]) if _NUMBER.fullmatch(macro[2]))

    def _line(self, mutant: Mutant) -> str:
        return self.files[mutant.file][mutant.start - 100 : mutant.start]

    def _texts(self, numbered: Mapping[int, Mutant]) -> dict[str, str]:
        """Return the files with the mutants."""
        texts = dict[str, str]()
        for name in FILES:
            own = {number: one for number, one in numbered.items() if one.file == name}
            text, spans = self.files[name], [macro.span(2) for macro in self._macros(name)]
            of_macros = {
                span: {number: one for number, one in own.items() if span[0] <= one.start < span[1]}
                for span in spans
            }
            others = {
                number: one for number, one in own.items() if not any(number in m for m in of_macros.values())
            }
            changed = with_mutants(text, others) if others else f"extern int {CHOSEN};\n{text}"
            for (start, end), mine in of_macros.items():
                value = text[start:end]
                for number, one in mine.items():
                    wrong = text[start : one.start] + one.wrong + text[one.end : end]
                    value = f"(({CHOSEN} == {number}) ? ({wrong}) : {value})"
                line = text[text.rindex("\n", 0, start) + 1 : start]
                changed = changed.replace(f"\n{line}{text[start:end]}", f"\n{line}{value}", 1)
            texts[name] = changed
        return texts

    def _run(self, numbers: Mapping[int, Mutant]) -> Iterator[tuple[int, Noticed]]:
        done = subprocess.run(
            ["./broken", *map(str, numbers)], cwd=self._folder, check=True, capture_output=True, text=True
        )
        for line in done.stdout.splitlines():
            number, result = map(int, line.split())
            yield number, Noticed(result)

    def _place(self, changed: Mapping[str, str] | None = None) -> None:
        place(self.files | dict(changed or {}), self._folder)

    def _build(self, *flags: str) -> subprocess.CompletedProcess[str]:
        line = [self._gcc, *flags, *_UNITS, "-o", "broken"]
        return subprocess.run(line, cwd=self._folder, check=False, capture_output=True, text=True)

    def _object(self, *flags: str) -> bytes:
        line = [self._gcc, *_FLAGS, *flags, "nmpc.c", "-o", "unit"]
        subprocess.run(line, cwd=self._folder, check=False, capture_output=True)
        return (self._folder / "unit").read_bytes()
