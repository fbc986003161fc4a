"""Count on the source: how often at least and at most each loop's body and each function of C can run."""

from collections import Counter
from typing import Any

from pycparser import c_ast

from mambo_nmpc.sil.verify.loops import Reading, place, walk

Count = Counter[str]
"""How often loops, by place (file:line), and functions, by name, run."""

Runs = tuple[Count, Count]
"""At least, at most."""


def runs(reading: Reading, name: str) -> Runs:
    """Return how often everything runs when the function `name` runs once, in a library without faults."""
    least, most = _runs(reading, reading.defined[name].body)
    itself = Counter({name: 1})
    return least + itself, most + itself


def _runs(reading: Reading, node: Any) -> Runs:
    parts = {name: (child, _runs(reading, child)) for name, child in node.children()}
    least = sum((part[0] for _, part in parts.values()), Counter[str]())
    most = sum((part[1] for _, part in parts.values()), Counter[str]())

    def of(name: str) -> Runs:
        return parts[name][1] if name in parts else (Counter(), Counter())

    match node:
        case c_ast.If() | c_ast.TernaryOp():
            test, yes, no = of("cond"), of("iftrue"), of("iffalse")
            least, most = test[0] + (yes[0] & no[0]), test[1] + (yes[1] | no[1])
        case c_ast.Switch():
            least = of("cond")[0]
        case c_ast.BinaryOp(op="&&" | "||"):
            least = of("left")[0]
        case c_ast.For():
            least, most = (
                _times(count, trips) + Counter({place(node): trips})
                for count, trips in zip(of("stmt"), reading.trips[place(node)], strict=True)
            )
        case c_ast.Compound():
            least = Counter()
            for statement, part in parts.values():
                least += part[0]
                if any(isinstance(found, c_ast.Return) for found in walk(statement)):
                    break  # what follows may not run
        case c_ast.FuncCall() if node.name.name in reading.defined:
            called = runs(reading, node.name.name)
            least, most = least + called[0], most + called[1]
        case _:
            pass
    return least, most


def _times(count: Count, trips: int) -> Count:
    return Counter({key: trips * value for key, value in count.items()})
