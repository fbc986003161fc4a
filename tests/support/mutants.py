"""Mutants: every small fault that a rule can make of C source, found by its tokens, none by its text.

Tokens rather than a syntax tree, so that a mutant is a change of the very line a person reads, macros and
attributes and all. What the compiler then refuses was no fault.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_nmpc.codegen import literals
from tests.support.reasons import Key, plain

_TOKEN: Final = re.compile(
    r"""(?P<define>^[ \t]*\#[ \t]*define[ \t]+\w+(\([^)]*\))?(?=[ \t]))
      | (?P<directive>^[ \t]*\#(?:[^\n\\]|\\.)*)
      | (?P<space>\n|[ \t]+|/\*.*?\*/|//[^\n]*)
      | (?P<real>(?:\d+\.\d*(?:[eE][-+]?\d+)?|\d+[eE][-+]?\d+)[fF]?)
      | (?P<integer>0[xX][0-9a-fA-F]+[uUlL]*|\d+[uUlL]*)
      | (?P<word>[A-Za-z_]\w*)
      | (?P<text>"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*')
      | (?P<sign><<=|>>=|->|\+\+|--|&&|\|\||[<>=!]=|[-+*/%&|^]=|<<|>>|.)""",
    re.VERBOSE | re.DOTALL | re.MULTILINE,
)
_TYPE: Final = re.compile(r"const|static|inline|void|char|int|unsigned|signed|float|double|struct|\w+_t")
_CONTROL: Final = frozenset({"if", "for", "while", "switch", "do", "else", "case", "default"})
_ARITHMETIC: Final = {
    "+": "-",
    "-": "+",
    "*": "+",
    "/": "*",
    "%": "*",
    "&": "|",
    "|": "&",
    "<<": ">>",
    ">>": "<<",
}
_SMALL: Final = 100
"""From here on a whole number may be of the settings: no key names it."""
_STEPS: Final = {"++": "--", "--": "++", "+=": "-=", "-=": "+=", "*=": "+=", "/=": "*="}
_LOGIC: Final = {"&&": "||", "||": "&&"}
_COMPARISONS: Final = {
    "<": ("<=", ">="),
    "<=": ("<", ">"),
    ">": (">=", "<="),
    ">=": (">", "<"),
    "==": ("!=",),
    "!=": ("==",),
}


@dataclass(frozen=True)
class Mutant:
    """A fault: in `file`, the text from `start` to `end`, from `line` on, becomes `wrong`."""

    file: str
    line: int
    start: int
    end: int
    wrong: str
    rule: str
    key: Key
    right_line: str
    wrong_line: str

    def apply(self, text: str) -> str:
        """Return `text` with the fault."""
        return text[: self.start] + self.wrong + text[self.end :]


@dataclass(frozen=True)
class _Token:
    kind: str
    text: str
    start: int
    place: str
    """Where it stands: code of a function, data of an initialiser, define, or nowhere that counts."""


@dataclass(frozen=True)
class _Change:
    start: int
    end: int
    wrong: str
    rule: str
    name: str = ""
    """What to call it; empty where right and wrong text say it all."""


def mutants(file: str, text: str, prefix: str) -> list[Mutant]:
    """Return every mutant of the C in `text`, in the order of the lines.

    A key is made of the file, the line and the change, with the default prefix and without the numbers that
    settings put there, so that it outlives a line that moves; the last part counts equal ones.
    """
    tokens = _tokens(text)
    partner = _partners(tokens)
    changes = sorted(
        {
            *_of_tokens(tokens),
            *_of_brackets(text, tokens, partner),
            *_of_statements(tokens, partner),
        },
        key=lambda change: (change.start, change.end, change.wrong),
    )
    seen: Counter[tuple[str, str]] = Counter()
    found = []
    for change in changes:
        right = text[change.start : change.end]
        number = text.count("\n", 0, change.start) + 1
        line = text[text.rfind("\n", 0, change.start) + 1 :].partition("\n")[0].strip()
        described = plain(line, prefix), plain(change.name or f"{right} -> {change.wrong}", prefix)
        name = described[0], f"{described[1]} #{seen[described]}" if seen[described] else described[1]
        seen[described] += 1
        key = (plain(file, prefix), *name)
        begin = text.rfind("\n", 0, change.start) + 1
        after = change.end + len(text[change.end :].partition("\n")[0])
        lines = (
            " ".join((text[begin : change.start] + part + text[change.end : after]).split())
            for part in (right, change.wrong)
        )
        found.append(Mutant(file, number, change.start, change.end, change.wrong, change.rule, key, *lines))
    return found


def _tokens(text: str) -> list[_Token]:
    """Split C into tokens, and tell for each whether it stands in code, in data or in a macro."""
    raw = [(m.lastgroup or "", m[0], m.start()) for m in _TOKEN.finditer(text)]
    tokens: list[_Token] = []
    braces: list[str] = []
    in_initialiser, in_define = False, -1
    for kind, word, start in raw:
        if kind == "space":
            continue
        if kind == "define":
            in_define = _end_of_directive(text, start)
            continue
        if kind == "directive":
            continue
        place = braces[-1] if braces else ("data" if in_initialiser else "")
        if start < in_define:
            tokens.append(_Token(kind, word, start, "define"))
            continue
        if word == "{":
            braces.append(_brace(tokens, place))
        elif word == "}" and braces:
            braces.pop()
        elif not braces and word in {"=", ";"}:
            in_initialiser = word == "="
        tokens.append(_Token(kind, word, start, place))
    return tokens


def _end_of_directive(text: str, start: int) -> int:
    found = re.compile(r"(?:[^\n\\]|\\.)*", re.DOTALL).match(text, start)
    return found.end() if found else start


def _brace(before: Sequence[_Token], place: str) -> str:
    """Tell what an opening brace opens."""
    if place:
        return place
    last = before[-1] if before else None
    if last is None or last.kind == "text":
        return ""  # extern "C"
    return "code" if last.text == ")" else "none"


def _of_tokens(tokens: Sequence[_Token]) -> Iterator[_Change]:
    """Change operators and constants."""
    casts = _ends_of_casts(tokens)
    for index, token in enumerate(tokens):
        if token.place not in {"code", "data", "define"}:
            continue
        if token.kind in {"real", "integer"}:
            for wrong, name in _numbers(token):
                yield _Change(token.start, token.start + len(token.text), wrong, "constant", name)
        elif token.kind == "sign" and token.place != "data":
            binary = _is_binary(tokens, index, casts)
            for wrong, rule in _operators(token.text, binary=binary):
                yield _Change(token.start, token.start + len(token.text), wrong, rule)
        elif token.text == "-" and token.place == "data":
            yield _Change(token.start, token.start + 1, "", "sign")


def _numbers(token: _Token) -> Iterator[tuple[str, str]]:
    """Yield what replaces a constant, and its name: neighbours of a whole number, or of a real."""
    if token.kind == "integer":
        found = re.fullmatch(r"(0[xX][0-9a-fA-F]+|\d+)([uUlL]*)", token.text)
        assert found is not None
        whole, suffix = int(found[1], 0), found[2]
        more, less = ("one more", "one less") if whole >= _SMALL else ("", "")
        yield f"{whole + 1}{suffix}", more
        if whole > 0 or not suffix:
            yield f"{whole - 1}{suffix}" if whole > 0 else "(-1)", less
        return
    scalar = "float32" if token.text[-1] in "fF" else "float64"
    of_type = literals.SCALARS[scalar]
    value = of_type(token.text.rstrip("fF"))
    if value == 0:
        yield literals.real(1.0, scalar), "zero -> one"
    else:
        if token.place == "data":  # of one entry of a table the last bit may round away
            yield literals.real(float(value) * (1 + 2.0**-10), scalar), "a thousandth more"
        else:
            yield literals.real(float(np.nextafter(value, of_type(np.inf))), scalar), "next number"
        yield f"(-{token.text})", "negative"


def _operators(sign: str, *, binary: bool) -> Iterator[tuple[str, str]]:
    if sign in _COMPARISONS:
        yield from ((wrong, "comparison") for wrong in _COMPARISONS[sign])
    elif sign in _LOGIC:
        yield _LOGIC[sign], "logic"
    elif sign in _STEPS:
        yield _STEPS[sign], "arithmetic"
    elif binary and sign in _ARITHMETIC:
        yield _ARITHMETIC[sign], "arithmetic"
    elif not binary and sign in {"-", "!"}:
        yield "", "sign" if sign == "-" else "logic"


def _is_binary(tokens: Sequence[_Token], index: int, casts: frozenset[int]) -> bool:
    if index == 0 or index - 1 in casts:
        return False
    before = tokens[index - 1]
    if before.kind == "word":
        return before.text not in {"return", "case"} and not _TYPE.fullmatch(before.text)
    return before.kind in {"real", "integer"} or before.text in {")", "]"}


def _ends_of_casts(tokens: Sequence[_Token]) -> frozenset[int]:
    """Return the indices of the brackets that close a type in brackets."""
    ends, start = [], -1
    for index, token in enumerate(tokens):
        if token.text == "(":
            start = index
        elif token.text == ")" and start >= 0:
            inside = tokens[start + 1 : index]
            if inside and all(t.text == "*" or _TYPE.fullmatch(t.text) for t in inside):
                ends.append(index)
            start = -1
    return frozenset(ends)


def _of_brackets(text: str, tokens: Sequence[_Token], partner: Mapping[int, int]) -> Iterator[_Change]:
    """Move an index by one, and turn a condition round."""
    declared = {
        index
        for first, last, is_declaration in _statements(tokens, partner)
        if is_declaration
        for index in range(first, _declarator_end(tokens, first, last))
    }
    for index, token in enumerate(tokens):
        if token.place != "code" or index not in partner:
            continue
        end = tokens[partner[index]].start
        inside = tokens[index + 1 : partner[index]]
        if token.text == "[" and index not in declared and [t.kind for t in inside] != ["integer"]:
            yield _Change(end, end, " + 1", "index", "index + 1")
            yield _Change(end, end, " - 1", "index", "index - 1")
        elif token.text == "(" and tokens[index - 1].text == "if":
            turned = f"(!{text[token.start : end + 1]})"
            yield _Change(token.start, end + 1, turned, "condition", "condition turned round")


def _of_statements(tokens: Sequence[_Token], partner: Mapping[int, int]) -> Iterator[_Change]:
    """Leave a statement out."""
    for first, last, is_declaration in _statements(tokens, partner):
        if not is_declaration:
            yield _Change(tokens[first].start, tokens[last].start, "", "statement", "left out")


def _partners(tokens: Sequence[_Token]) -> dict[int, int]:
    """Return for each opening bracket the index of the one that closes it."""
    closing, open_, partner = {"(": ")", "[": "]"}, list[int](), dict[int, int]()
    for index, token in enumerate(tokens):
        if token.text in closing:
            open_.append(index)
        elif token.text in closing.values() and open_:
            partner[open_.pop()] = index
    return partner


def _statements(tokens: Sequence[_Token], partner: Mapping[int, int]) -> Iterator[tuple[int, int, bool]]:
    """Yield first token, semicolon, and whether it declares, for every simple statement of every function."""
    index = 0
    while index < len(tokens):
        token = tokens[index]
        if token.place != "code" or token.text in "{};":
            index += 1
        elif token.text in {"case", "default"}:
            while tokens[index].text != ":":
                index += 1
            index += 1
        elif token.text in _CONTROL or token.text == "_Pragma":
            index = partner.get(index + 1, index) + 1
        elif index + 1 < len(tokens) and tokens[index + 1].text in _CONTROL:
            index += 1  # a macro such as an attribute of the loop
        else:
            last = index
            while tokens[last].text != ";":
                last = partner.get(last, last) + 1
            yield index, last, bool(_TYPE.fullmatch(token.text))
            index = last + 1


def _declarator_end(tokens: Sequence[_Token], first: int, last: int) -> int:
    """Return where the initialiser of a declaration begins, or else its end."""
    return next((index for index in range(first, last) if tokens[index].text == "="), last)
