"""Many mutants in one program: a global number chooses which body a function has, and which numbers a table.

A compiler then reads everything but the mutated functions once for all mutants.
"""

import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from tests.mutation.mutants import Mutant, Token, tokens_of

CHOSEN: Final = "mutant_number"
"""The global variable: the number of a mutant, 0 for the C as it is."""

ORIGINAL: Final = 0


@dataclass(frozen=True)
class Region:
    """What is there once for each mutant, `start` to `end`: the body of a function, or the value of a table.

    Its declaration begins at `declared` and ends before the brace or the equals sign.
    """

    declared: int
    start: int
    end: int
    declaration: str
    is_body: bool

    def holds(self, mutant: Mutant) -> bool:
        """Whether the change of a mutant lies within."""
        return self.start <= mutant.start and mutant.end <= self.end


@lru_cache(maxsize=4)
def regions(text: str) -> tuple[Region, ...]:
    """Return the bodies of all functions and the values of all tables of C, ordered by position."""
    found = list[Region]()
    declared, outer = -1, list[Token]()
    tokens = [token for token in tokens_of(text) if token.place != "define"]
    runs = ((place, list(run)) for place, run in itertools.groupby(tokens, lambda token: token.place))
    for place, run in runs:
        if place in {"code", "data"}:
            before = outer[-1]
            is_body = place == "code"
            start, end = (before.start, run[-1].start + 1) if is_body else (run[0].start, run[-1].start)
            found.append(Region(declared, start, end, text[declared : before.start], is_body))
            outer = []
        else:
            outer = run
        ends = [
            index
            for index, token in enumerate(outer[:-1])
            if token.text in {";", "}"} or _opens_c(outer, index)
        ]
        rest = outer[ends[-1] + 1 :] if ends else outer
        declared = rest[0].start if rest else -1
    return tuple(found)


def can_share(text: str, mutant: Mutant) -> bool:
    """Whether a mutant of C changes one region alone: none outside of all, none that removes a lone brace."""
    right = text[mutant.start : mutant.end]
    return right.count("{") == right.count("}") and any(region.holds(mutant) for region in regions(text))


def with_mutants(text: str, numbered: Mapping[int, Mutant]) -> str:
    """Return C that behaves as the mutant with the number `CHOSEN`; all lie in regions of `text`."""
    pieces, position = [f"extern int {CHOSEN};\n"], 0
    for region in regions(text):
        values = [
            (number, _value(text, region, mutant))
            for number, mutant in numbered.items()
            if region.holds(mutant)
        ]
        if values:
            original = text[region.start : region.end]
            changed = _body if region.is_body else _table
            pieces += [text[position : region.declared], changed(region, original, values)]
            position = region.end if region.is_body else region.end + 1
    return "".join([*pieces, text[position:]])


def _opens_c(tokens: Sequence[Token], index: int) -> bool:
    """Whether the token opens `extern "C"`."""
    return index > 0 and tokens[index].text == "{" and tokens[index - 1].kind == "text"


def _value(text: str, region: Region, mutant: Mutant) -> str:
    return text[region.start : mutant.start] + mutant.wrong + text[mutant.end : region.end]


def _body(region: Region, original: str, values: Sequence[tuple[int, str]]) -> str:
    """Return a body that consists of those of the mutants and the original."""
    end = "return;" if re.search(r"\bvoid\s+\w+\s*\(", region.declaration) else "__builtin_trap();"
    cases = "".join(f"case {number}:\n{_line(number)}{value}\n{end}\n" for number, value in values)
    default = f"default:\n{_line(ORIGINAL)}{original}\n{end}\n"
    return f"{region.declaration}{{\nswitch ({CHOSEN}) {{\n{cases}{default}}}\n}}"


def _table(region: Region, original: str, values: Sequence[tuple[int, str]]) -> str:
    """Return a table with a row for each mutant, under a macro that selects the row."""
    name = re.findall(r"\w+", region.declaration.partition("[")[0])[-1]
    declaration = re.sub(rf"\b{name}\b", f"{name}_rows[]", region.declaration)
    rows = "".join(f",\n{_line(number)}{value}" for number, value in values)
    cases = "".join(f"case {number}: return {row};\n" for row, (number, _) in enumerate(values, 1))
    return (
        f"{declaration}= {{ {original}{rows} }};\n"
        f"static int {name}_row(void)\n{{\nswitch ({CHOSEN}) {{\n{cases}default: return 0;\n}}\n}}\n"
        f"#define {name} ({name}_rows[{name}_row()])\n"
    )


def _line(number: int) -> str:
    """Return the directive after which the compiler's messages name the mutant."""
    return f'#line 1 "mutant {number}"\n'


def refused_numbers(messages: str) -> set[int]:
    """Return the numbers of the mutants in the compiler's messages of errors."""
    return {int(number) for number in re.findall(r"^mutant (\d+):[\d:]+ error:", messages, re.MULTILINE)}
