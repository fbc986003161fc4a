"""Count what runs: the C with a counter in every function and loop, built for this machine and stepped."""

import copy
import subprocess
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pycparser import c_ast, c_generator

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.flags import COMPILE_FLAGS
from mambo_nmpc.codegen.render import with_prefix
from mambo_nmpc.codegen.representation import STATE, TARGET, THRUST
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.codegen.toolchain import Toolchain
from mambo_nmpc.sil.verify.loops import Unit, place, walk

TOGETHER: Final = 100
"""Controllers that step in turn."""

_COUNTS: Final = "nmpc_work_counts"


def places(units: Sequence[Unit]) -> list[str]:
    """Return what is counted: functions by name, loops by place."""
    named = [name for unit in units for name in unit.functions]
    loops = [place(node) for unit in units for node in walk(unit.tree) if isinstance(node, c_ast.For)]
    return list(dict.fromkeys([*named, *loops]))


def counting_program(
    units: Sequence[Unit], settings: Settings, bundle: Path, work: Path, toolchain: Toolchain
) -> Path:
    """Build the program `work.c` with the library `units`, counting; raises BuildError."""
    index = {one: number for number, one in enumerate(places(units))}
    sources = []
    for unit in units:
        source = work / f"counting_{Path(unit.path).name}"
        text = c_generator.CGenerator().visit(_counting(unit, index))
        source.write_text(f"extern unsigned int {_COUNTS}[];\n{text}", "utf-8")
        sources.append(source.name)
    driver = resources.files("mambo_nmpc.sil").joinpath("verify/work.c").read_text("utf-8")
    prefix = settings.code.prefix
    (work / "work.c").write_text(
        with_prefix(driver, prefix).replace(f"{prefix}_work_", "nmpc_work_"), "utf-8"
    )
    sizes = {"PLACES": len(index), "CONTROLLERS": TOGETHER}
    defined = [f"-D{prefix.upper()}_WORK_{name}={value}" for name, value in sizes.items()]
    include = f"-I{(bundle / 'include').absolute()}"
    toolchain.run([*COMPILE_FLAGS, *defined, include, "work.c", *sources, "-o", "work"], work)
    return work / "work"


def _counting(unit: Unit, index: dict[str, int]) -> Any:
    """Return the tree of a unit with a counter first in the body of every function and loop."""
    tree = copy.deepcopy(unit.tree)
    for node in walk(tree):
        match node:
            case c_ast.FuncDef():
                node.body = _counted(node.body, index[node.decl.name])
            case c_ast.For():
                node.stmt = _counted(node.stmt, index[place(node)])
            case _:
                pass
    return tree


def _counted(body: Any, number: int) -> Any:
    count = c_ast.ArrayRef(c_ast.ID(_COUNTS), c_ast.Constant("int", str(number)))
    return c_ast.Compound([c_ast.UnaryOp("p++", count), body])


def count(
    program: Path, settings: Settings, places_counted: int, inputs: NDArray[Any]
) -> tuple[NDArray[np.int32], NDArray[Any], NDArray[np.uint32]]:
    """Step on inputs (n, 12), state, target, thrust; return status (n,), command (n, 2), count (n, places).

    Step k is one of controller k modulo TOGETHER. Raises BuildError if the program dies.
    """
    numbers = Design(settings).numbers
    layout = np.dtype(
        [("status", np.int32), ("command", numbers.scalar, 2), ("counts", np.uint32, places_counted)],
        align=False,
    )
    done = subprocess.run(
        [str(program.absolute())],
        input=numbers.quantize(inputs, (*STATE, *TARGET, *THRUST)).tobytes(),
        capture_output=True,
        check=False,
    )
    if done.returncode != 0 or len(done.stdout) != layout.itemsize * len(inputs):
        raise BuildError(f"{program.name}: the counting build ended with code {done.returncode}")
    found = np.frombuffer(done.stdout, layout)
    return found["status"], numbers.to_si(found["command"], "angle"), found["counts"]
