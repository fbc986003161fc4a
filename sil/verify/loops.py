"""Read the loops of C: where each begins and ends, and what could make it run otherwise.

The text is what the preprocessor leaves, so a macro that ends a loop is its value here. What other compilers'
branches of #if would hold is not seen.
"""

import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pycparser import c_ast, c_parser

from mambo_nmpc.codegen.toolchain import Toolchain

_PREPROCESS: Final = ("-std=c99", "-E", "-D__attribute__(x)=", "-D__extension__=", "-D__restrict=")
"""What the headers of a C library say beyond C99 is nothing to a reader of loops."""

_ARITHMETIC: Final[dict[str, Callable[[int, int], int]]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.floordiv,
    "%": operator.mod,
}
_MEETS: Final[dict[str, Callable[[int, int], bool]]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}

_OF_THE_COMPILER: Final = {"__builtin_ctzl", "__builtin_ctzll", "__builtin_fabs", "__builtin_fabsf"}
"""What looks like a function and is an operation, or a call into libgcc where a processor lacks it."""


@dataclass(frozen=True, eq=False)
class Unit:
    """One translation unit: its path in the bundle, its syntax tree, and the functions that it defines."""

    path: str
    tree: Any
    functions: Mapping[str, Any]


def read_unit(path: str, folder: Path, toolchain: Toolchain, work: Path) -> Unit:
    """Preprocess and parse the C file at `path` in `folder`, with what it includes.

    Raises BuildError for what the compiler refuses, and pycparser's ParseError.
    """
    made = work / f"{Path(path).stem}.i"
    toolchain.run([*_PREPROCESS, "-Iinclude", path, "-o", str(made.absolute())], folder)
    tree = c_parser.CParser().parse(made.read_text("utf-8"), path)
    functions = {node.decl.name: node for node in tree.ext if isinstance(node, c_ast.FuncDef)}
    return Unit(path, tree, functions)


def place(node: Any) -> str:
    """Return where `node` stands: the name of its file, and its line."""
    return f"{Path(node.coord.file).name}:{node.coord.line}"


Passes = tuple[int, int]
"""How many passes a loop makes whenever it is entered: at least, at most."""


@dataclass(frozen=True, eq=False)
class Reading:
    """What the units of a library hold.

    trips:  the passes of each loop (file:line).
    faults: what breaks a rule, each with its place.
    """

    defined: Mapping[str, Any]
    """Every function by name; one in a header stands in several units, alike."""
    trips: Mapping[str, Passes]
    faults: Sequence[str]


def read_loops(units: Sequence[Unit]) -> Reading:
    """Read every function, and hold it against the rules.

    A loop is a `for` from a constant to a constant by a constant; it may end sooner when a word has no ones
    left. Nothing in it writes its counter, nothing leaves it early. Calls go to functions of the library by
    name, and never in a circle, or to what the compiler has instead of a function. Names are those of an
    amalgamated library, where no two files have a function of their own by the same name.
    """
    defined = {name: node for unit in units for name, node in unit.functions.items()}
    trips: dict[str, Passes] = {}
    faults: list[str] = []
    for unit in units:
        loops = [place(node) for node in walk(unit.tree) if isinstance(node, c_ast.For)]
        faults += [f"{one}: two loops on a line" for one in loops if loops.count(one) > 1]
        for name, node in unit.functions.items():
            faults += _jumps(name, node)
            for loop in (found for found in walk(node) if isinstance(found, c_ast.For)):
                passes = _passes(loop, _counters(node))
                if isinstance(passes, str):
                    faults.append(f"{place(loop)}: {name}: {passes}")
                else:
                    trips[place(loop)] = passes
    faults += _calls(defined)
    return Reading(defined, trips, tuple(dict.fromkeys(faults)))


def walk(node: Any) -> Iterator[Any]:
    """Yield `node` and everything in it."""
    yield node
    for _, child in node.children():
        yield from walk(child)


def _jumps(function: str, body: Any) -> list[str]:
    """Return the statements that no function may hold."""
    return [
        f"{place(node)}: {function} {_BARRED[type(node)]}" for node in walk(body) if type(node) in _BARRED
    ]


_BARRED: Final = {
    c_ast.While: "loops by while",
    c_ast.DoWhile: "loops by do",
    c_ast.Goto: "jumps by goto",
    c_ast.Label: "has a label to jump to",
    c_ast.Continue: "cuts a pass short by continue",
}


def _counters(function: Any) -> set[str]:
    """Return the names of the plain int variables that a function declares."""
    return {node.name for node in walk(function.body) if isinstance(node, c_ast.Decl) and _is_plain_int(node)}


def _is_plain_int(node: Any) -> bool:
    declared = node.type
    return (
        isinstance(declared, c_ast.TypeDecl)
        and isinstance(declared.type, c_ast.IdentifierType)
        and declared.type.names == ["int"]
        and not node.storage
        and not node.quals
    )


def _passes(loop: Any, counters: set[str]) -> Passes | str:
    """Return how many passes a `for` makes, or which rule it breaks."""
    begin, test, step = loop.init, loop.cond, loop.next
    may_end_sooner = isinstance(test, c_ast.BinaryOp) and test.op == "&&" and _has_ones(test.left)
    if may_end_sooner:
        test = test.right
    if not (isinstance(begin, c_ast.Assignment) and begin.op == "=" and isinstance(begin.lvalue, c_ast.ID)):
        return "a loop must begin with counter = constant"
    counter = begin.lvalue.name
    if counter not in counters:
        return f"the counter {counter} must be a local int"
    first = constant(begin.rvalue)
    if not (isinstance(test, c_ast.BinaryOp) and test.op in _MEETS and _is_name(test.left, counter)):
        return f"a loop must go on while {counter} is below or above a constant"
    last = constant(test.right)
    by = _step(step, counter)
    if first is None or last is None or not by:
        return "a loop must go from a constant to a constant, by a constant"
    if (by > 0) != (test.op in {"<", "<="}):
        return "a loop must go towards its end"
    trips = max(0, -(-(last - first) // by))
    if test.op in {"<=", ">="} and _MEETS[test.op](first, last):
        trips = (last - first) // by + 1
    return _disturbance(loop.stmt, counter) or (0 if may_end_sooner else trips, trips)


def _has_ones(test: Any) -> bool:
    """Tell whether a condition is that a word, a variable, has ones."""
    return (
        isinstance(test, c_ast.BinaryOp)
        and test.op == "!="
        and isinstance(test.left, c_ast.ID)
        and constant(test.right) == 0
    )


def _step(step: Any, counter: str) -> int | None:
    match step:
        case c_ast.UnaryOp(op="p++" | "++", expr=target) if _is_name(target, counter):
            return 1
        case c_ast.UnaryOp(op="p--" | "--", expr=target) if _is_name(target, counter):
            return -1
        case c_ast.Assignment(op="+=" | "-=", lvalue=target) if _is_name(target, counter):
            by = constant(step.rvalue)
            return by if by is None or step.op == "+=" else -by
        case _:
            return None


def _disturbance(body: Any, counter: str, in_switch: bool = False) -> str:
    """Return what in the body of a loop writes its counter or leaves it early; nothing is empty."""
    match body:
        case c_ast.Assignment(lvalue=target) if _is_name(target, counter):
            return f"{place(body)} writes the counter {counter}"
        case c_ast.UnaryOp(op="p++" | "++" | "p--" | "--" | "&", expr=target) if _is_name(target, counter):
            return f"{place(body)} may write the counter {counter}"
        case c_ast.Decl(name=name) if name == counter:
            return f"{place(body)} declares another {counter}"
        case c_ast.Return():
            return f"{place(body)} leaves the loop by return"
        case c_ast.Break() if not in_switch:
            return f"{place(body)} leaves the loop by break"
        case c_ast.For():
            in_switch = True  # a break in there leaves that loop, which is held to account for it
        case c_ast.Switch():
            in_switch = True
        case _:
            pass
    return next(filter(None, (_disturbance(child, counter, in_switch) for _, child in body.children())), "")


def _is_name(node: Any, name: str) -> bool:
    return isinstance(node, c_ast.ID) and bool(node.name == name)


def constant(node: Any) -> int | None:
    """Return the value of a whole-number expression without names, else None."""
    match node:
        case c_ast.Constant() if "int" in node.type:
            return int(node.value.rstrip("uUlL"), 0)
        case c_ast.UnaryOp(op="+" | "-"):
            value = constant(node.expr)
            return value if value is None or node.op == "+" else -value
        case c_ast.BinaryOp() if node.op in _ARITHMETIC:
            left, right = constant(node.left), constant(node.right)
            if left is None or right is None or (node.op in "/%" and (left < 0 or right <= 0)):
                return None
            return _ARITHMETIC[node.op](left, right)
        case _:
            return None


def _calls(defined: Mapping[str, Any]) -> list[str]:
    """Return the calls that leave the library, go through a pointer, or come back to where they began."""
    faults = []
    below: dict[str, set[str]] = {}
    for name, node in defined.items():
        calls = [found for found in walk(node) if isinstance(found, c_ast.FuncCall)]
        named = [call for call in calls if isinstance(call.name, c_ast.ID)]
        known = [call for call in named if call.name.name in defined]
        inline = [call for call in named if call.name.name in _OF_THE_COMPILER]
        below[name] = {call.name.name for call in known}
        faults += [
            f"{place(call)}: {name} calls what the library does not define"
            for call in calls
            if call not in known and call not in inline
        ]
    for name, called in below.items():
        reached: set[str] = set()
        ahead = called
        while ahead:
            reached |= ahead
            ahead = set().union(*(below[one] for one in ahead)) - reached
        if name in reached:
            faults.append(f"{name} calls itself")
    return faults
