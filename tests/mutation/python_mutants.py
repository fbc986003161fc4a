"""Make every small fault (mutant) of the numeric lines of Python source, from its syntax tree."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from tests.mutation.reasons import Key

_OPERATORS: Final[dict[type[ast.AST], tuple[str, tuple[str, ...]]]] = {
    ast.Add: ("+", ("-",)),
    ast.Sub: ("-", ("+",)),
    ast.Mult: ("*", ("/",)),
    ast.Div: ("/", ("*",)),
    ast.FloorDiv: ("//", ("*",)),
    ast.Mod: ("%", ("*",)),
    ast.Pow: ("**", ("*",)),
    ast.BitAnd: ("&", ("|",)),
    ast.BitOr: ("|", ("&",)),
    ast.Lt: ("<", ("<=", ">")),
    ast.LtE: ("<=", ("<", ">")),
    ast.Gt: (">", (">=", "<")),
    ast.GtE: (">=", (">", "<")),
    ast.Eq: ("==", ("!=",)),
    ast.NotEq: ("!=", ("==",)),
    ast.And: ("and", ("or",)),
    ast.Or: ("or", ("and",)),
}
_REVERSED: Final = (ast.Sub, ast.Div)
_FUNCTIONS: Final = (
    *(("min", "max"), ("minimum", "maximum"), ("argmin", "argmax"), ("nanargmin", "nanargmax")),
    *(("floor", "ceil"), ("any", "all"), ("sin", "cos"), ("acos", "asin"), ("degrees", "radians")),
    *(("real", "imag"), ("zeros", "ones"), ("zeros_like", "ones_like")),
)
_LEFT_OUT: Final = ("abs", "round", "sqrt", "unwrap")
"""Functions of which a mutant takes the argument instead of the value."""
_WORDS: Final = (
    *(("climb", "descent"), ("min", "max"), ("low", "high"), ("roll", "pitch"), ("up", "down"), ("x", "y")),
    *(("floor", "ceiling"), ("least", "most"), ("position", "velocity"), ("lag", "delay"), ("first", "last")),
    *(("lag", "dead_time"), ("slowest", "quickest"), ("command", "motors"), ("moved", "shown")),
    ("phases", "leads"),
)
"""Words of names that a mutant exchanges, if the source has such a name."""


@dataclass(frozen=True)
class PythonMutant:
    """A fault: in `file`, the text from `start` to `end` becomes `wrong`.

    lines: those of its statement in a function; None for one outside of functions, which runs at the import.
    """

    file: str
    start: int
    end: int
    wrong: str
    key: Key
    lines: range | None

    def apply(self, text: str) -> str:
        """Return `text` with the fault."""
        return text[: self.start] + self.wrong + text[self.end :]


@dataclass(frozen=True)
class _Change:
    start: int
    end: int
    wrong: str
    lines: range | None


def python_mutants(file: str, text: str, names: frozenset[str] = frozenset()) -> list[PythonMutant]:
    """Return every mutant of the module in `text`, ordered by position.

    names: those of attributes and columns that other modules have. A key consists of file, line and change;
    equal changes of equal lines are numbered.
    """
    seen: Counter[tuple[str, str]] = Counter()
    found = []
    for change in sorted(
        set(_Source(text, names).changes()), key=lambda one: (one.start, one.end, one.wrong)
    ):
        right = text[change.start : change.end]
        begin = text.rfind("\n", 0, change.start) + 1
        described = _plain(text[begin:].partition("\n")[0]), _plain(f"{right} -> {change.wrong}")
        repeated = f" #{seen[described]}" if seen[described] else ""
        seen[described] += 1
        key = (file, described[0], described[1] + repeated)
        found.append(PythonMutant(file, change.start, change.end, change.wrong, key, change.lines))
    return found


def names_of(text: str) -> frozenset[str]:
    """Return all names in the source of a module."""
    return frozenset(re.findall(r"[A-Za-z_]\w*", text))


def _plain(text: str) -> str:
    return " ".join(text.split())


class _Source:
    """The text of a module, and where its nodes are in it."""

    def __init__(self, text: str, names: frozenset[str]) -> None:
        self._text, self._own, self._names = text, names_of(text), names
        self._begins = [0, *(match.end() for match in re.finditer("\n", text))]

    def changes(self) -> Iterator[_Change]:
        """Yield the changes of all statements."""
        yield from self._of_body(ast.parse(self._text).body, runs=False)

    def _of_body(self, body: list[ast.stmt], *, runs: bool) -> Iterator[_Change]:
        """Yield the changes of statements but imports, errors, documentation and annotations."""
        for statement in body:
            match statement:
                case ast.Import() | ast.ImportFrom() | ast.Raise() | ast.Expr(value=ast.Constant()):
                    continue
                case ast.FunctionDef() | ast.ClassDef():
                    is_function = isinstance(statement, ast.FunctionDef)
                    yield from self._of_body(statement.body, runs=runs or is_function)
                case ast.AnnAssign(value=None):
                    continue
                case _:
                    last = statement.end_lineno or statement.lineno
                    lines = range(statement.lineno, last + 1) if runs else None
                    node = statement.value if isinstance(statement, ast.AnnAssign) else statement
                    assert node is not None
                    yield from self._of(node, lines)

    def _of(self, node: ast.AST, lines: range | None) -> Iterator[_Change]:
        """Yield the changes of a node and of all below it, in a statement of `lines`."""
        for start, end, wrong in self._of_node(node):
            yield _Change(start, end, wrong, lines)
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.stmt):
                yield from self._of_body([child], runs=lines is not None)
            elif not isinstance(child, ast.JoinedStr | ast.arguments) and not _is_exact(child):
                yield from self._of(child, lines)

    def _of_node(self, node: ast.AST) -> Iterator[tuple[int, int, str]]:
        match node:
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
                yield from self._of_operator(op, left, right)
                if isinstance(op, _REVERSED):
                    sign = _OPERATORS[type(op)][0]
                    yield (*self._place(node), f"({self._segment(right)}) {sign} ({self._segment(left)})")
            case ast.BoolOp(op=op, values=[first, second, *_]):
                yield from self._of_operator(op, first, second)
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _OPERATORS:
                yield from self._of_operator(op, left, right)
            case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
                yield (*self._place(node), f"({self._segment(operand)})")
            case ast.IfExp(body=body, orelse=orelse):
                yield from ((*self._place(node), f"({self._segment(one)})") for one in (body, orelse))
            case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name), args=[value, *_]):
                if name in _LEFT_OUT:
                    yield (*self._place(node), f"({self._segment(value)})")
            case ast.Constant(value=value):
                yield from self._of_constant(node, value)
        yield from self._of_name(node)

    def _of_operator(self, op: ast.AST, left: ast.expr, right: ast.expr) -> Iterator[tuple[int, int, str]]:
        sign, others = _OPERATORS[type(op)]
        first, last = self._place(left)[1], self._place(right)[0]
        start = first + re.sub(r"#.*", lambda one: " " * len(one[0]), self._text[first:last]).index(sign)
        yield from ((start, start + len(sign), other) for other in others)

    def _of_constant(self, node: ast.Constant, value: object) -> Iterator[tuple[int, int, str]]:
        match value:
            case bool():
                yield (*self._place(node), str(not value))
            case int():
                yield (*self._place(node), str(value + 1))
            case float():
                yield (*self._place(node), repr(1.1 * value) if value else "1.0")
            case str() if value.isidentifier():
                start, end = self._place(node)
                quote = self._text[start]
                yield from ((start, end, f"{quote}{name}{quote}") for name in _exchanged(value, self._names))

    def _of_name(self, node: ast.AST) -> Iterator[tuple[int, int, str]]:
        match node:
            case ast.Name(id=name, ctx=ast.Load()):
                known = self._own
            case ast.Attribute(attr=name, ctx=ast.Load()):
                known = self._names
            case _:
                return
        end = self._place(node)[1]
        for pair in _FUNCTIONS:
            if name in pair:
                yield end - len(name), end, pair[1 - pair.index(name)]
        yield from ((end - len(name), end, other) for other in _exchanged(name, known))

    def _place(self, node: ast.AST) -> tuple[int, int]:
        """Return start and end of a node in the text."""
        assert isinstance(node, ast.expr)
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return self._offset(node.lineno, node.col_offset), self._offset(node.end_lineno, node.end_col_offset)

    def _offset(self, line: int, column: int) -> int:
        """Return the offset of a column, which counts bytes, in characters."""
        begin = self._begins[line - 1]
        return begin + len(self._text[begin:].partition("\n")[0].encode()[:column].decode())

    def _segment(self, node: ast.expr) -> str:
        start, end = self._place(node)
        return self._text[start:end]


def _is_exact(node: ast.AST) -> bool:
    """Return whether a node is a type or its setting, chooses words, or says that a loop runs over all."""
    match node:
        case ast.Subscript(value=ast.Name(id="Literal")) | ast.Call(func=ast.Name(id="ConfigDict")):
            return True
        case ast.keyword(arg="strict"):
            return True
        case ast.IfExp(body=body, orelse=orelse):
            return all(_is_text(branch) for branch in (body, orelse))
    return False


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def _exchanged(name: str, known: frozenset[str]) -> Iterator[str]:
    """Yield the names that differ from `name` in one of _WORDS and are known."""
    for pair in _WORDS:
        for here, there in (pair, pair[::-1]):
            other = re.sub(rf"(?<![a-z0-9]){here}(?![a-z0-9])", there, name)
            if other != name and other in known:
                yield other
