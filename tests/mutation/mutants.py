"""Make every small fault (mutant) of C source: the rules change one token, bracket or statement at a time.

Working on tokens instead of a syntax tree keeps macros and attributes as they are in the file.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from mambo_codegen.numbers import literals
from tests.mutation.reasons import Key, plain

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
_ARITHMETIC: Final = {"+": "-", "-": "+", "*": "+", "/": "*", "%": "*", "&": "|", "|": "&"}
_SHIFTS: Final = {"<<": ">>", ">>": "<<"}
_COMPARISONS: Final = {"<": ("<=", ">="), "<=": ("<", ">"), ">": (">=", "<="), ">=": (">", "<")}
_OTHERS: Final = {"==": "!=", "!=": "==", "&&": "||", "||": "&&", "++": "--", "--": "++"}
_ASSIGNMENTS: Final = {"+=": "-=", "-=": "+=", "*=": "+=", "/=": "*="}
_ALWAYS: Final = _COMPARISONS | {sign: (wrong,) for sign, wrong in (_SHIFTS | _OTHERS | _ASSIGNMENTS).items()}
_SMALL: Final = 100
"""Integers from here on may come from the settings, so keys do not contain them."""


@dataclass(frozen=True)
class Mutant:
    """A fault: in `file`, the text from `start` to `end` becomes `wrong`, its line `wrong_line`."""

    file: str
    start: int
    end: int
    wrong: str
    key: Key
    wrong_line: str

    def apply(self, text: str) -> str:
        """Return `text` with the fault."""
        return text[: self.start] + self.wrong + text[self.end :]


@dataclass(frozen=True)
class Token:
    """A token of C, without spaces and comments."""

    kind: str
    text: str
    start: int
    place: str
    """code (of a function), data (of an initialiser), define, or empty: no mutants are made there."""


@dataclass(frozen=True)
class _Change:
    start: int
    end: int
    wrong: str
    name: str = ""
    """Name of the change in the key; if empty, the key spells the text before and after."""


def mutants(file: str, text: str) -> list[Mutant]:
    """Return every mutant of the C in `text`, ordered by position.

    A key consists of file, line and change; equal changes of equal lines are numbered.
    """
    tokens = tokens_of(text)
    partner = _partners(tokens)
    changes = {
        *_of_tokens(tokens),
        *_of_brackets(text, tokens, partner),
        *_of_statements(tokens, partner),
    }
    seen: Counter[tuple[str, str]] = Counter()
    found = []
    for change in sorted(changes, key=lambda change: (change.start, change.end, change.wrong)):
        right = text[change.start : change.end]
        begin = text.rfind("\n", 0, change.start) + 1
        line = text[begin:].partition("\n")[0]
        described = plain(line), plain(change.name or f"{right} -> {change.wrong}")
        repeated = f" #{seen[described]}" if seen[described] else ""
        seen[described] += 1
        key = (file, described[0], described[1] + repeated)
        wrong_line = text[begin : change.start] + change.wrong + text[change.end :].partition("\n")[0]
        found.append(Mutant(file, change.start, change.end, change.wrong, key, " ".join(wrong_line.split())))
    return found


def tokens_of(text: str) -> list[Token]:
    """Split C into tokens and find the place of each."""
    raw = [(m.lastgroup or "", m[0], m.start()) for m in _TOKEN.finditer(text)]
    tokens: list[Token] = []
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
            tokens.append(Token(kind, word, start, "define"))
            continue
        if word == "{":
            braces.append(_brace(tokens, place))
        elif word == "}" and braces:
            braces.pop()
        elif not braces and word in {"=", ";"}:
            in_initialiser = word == "="
        tokens.append(Token(kind, word, start, place))
    return tokens


def _end_of_directive(text: str, start: int) -> int:
    found = re.compile(r"(?:[^\n\\]|\\.)*", re.DOTALL).match(text, start)
    return found.end() if found else start


def _brace(before: Sequence[Token], place: str) -> str:
    """Return the place of the tokens that follow an opening brace."""
    if place:
        return place
    last = before[-1] if before else None
    if last is None or last.kind == "text":
        return ""  # extern "C"
    return "code" if last.text == ")" else "none"


def _of_tokens(tokens: Sequence[Token]) -> Iterator[_Change]:
    """Change operators and constants."""
    casts = _ends_of_casts(tokens)
    for index, token in enumerate(tokens):
        if token.place not in {"code", "data", "define"}:
            continue
        if token.kind in {"real", "integer"}:
            for wrong, name in _numbers(token):
                yield _Change(token.start, token.start + len(token.text), wrong, name)
        elif token.kind == "sign" and token.place != "data":
            binary = _is_binary(tokens, index, casts)
            for wrong in _operators(token.text, binary=binary):
                yield _Change(token.start, token.start + len(token.text), wrong)
        elif token.text == "-" and token.place == "data":
            yield _Change(token.start, token.start + 1, "")


def _numbers(token: Token) -> Iterator[tuple[str, str]]:
    """Yield replacements of a constant with their names: the neighbours, and the negative of a real."""
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


def _operators(sign: str, *, binary: bool) -> Sequence[str]:
    """Return what replaces an operator."""
    if binary and sign in _ARITHMETIC:
        return (_ARITHMETIC[sign],)
    if not binary and sign in {"-", "!"}:
        return ("",)
    return _ALWAYS.get(sign, ())


def _is_binary(tokens: Sequence[Token], index: int, casts: frozenset[int]) -> bool:
    if index == 0 or index - 1 in casts:
        return False
    before = tokens[index - 1]
    if before.kind == "word":
        return before.text not in {"return", "case"} and not _TYPE.fullmatch(before.text)
    return before.kind in {"real", "integer"} or before.text in {")", "]"}


def _ends_of_casts(tokens: Sequence[Token]) -> frozenset[int]:
    """Return the indices of the brackets that close a cast."""
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


def _of_brackets(text: str, tokens: Sequence[Token], partner: Mapping[int, int]) -> Iterator[_Change]:
    """Change an index by one, and negate a condition."""
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
            yield _Change(end, end, " + 1", "index + 1")
            yield _Change(end, end, " - 1", "index - 1")
        elif token.text == "(" and tokens[index - 1].text == "if":
            turned = f"(!{text[token.start : end + 1]})"
            yield _Change(token.start, end + 1, turned, "condition turned round")


def _of_statements(tokens: Sequence[Token], partner: Mapping[int, int]) -> Iterator[_Change]:
    """Leave a statement out."""
    for first, last, is_declaration in _statements(tokens, partner):
        if not is_declaration:
            yield _Change(tokens[first].start, tokens[last].start, "", "left out")


def _partners(tokens: Sequence[Token]) -> dict[int, int]:
    """Return for each opening bracket the index of the one that closes it."""
    closing, open_, partner = {"(": ")", "[": "]"}, list[int](), dict[int, int]()
    for index, token in enumerate(tokens):
        if token.text in closing:
            open_.append(index)
        elif token.text in closing.values() and open_:
            partner[open_.pop()] = index
    return partner


def _statements(tokens: Sequence[Token], partner: Mapping[int, int]) -> Iterator[tuple[int, int, bool]]:
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


def _declarator_end(tokens: Sequence[Token], first: int, last: int) -> int:
    """Return where the initialiser of a declaration begins, or its end if it has none."""
    return next((index for index in range(first, last) if tokens[index].text == "="), last)
