"""The structure of the project: who may import whom, and what a module may be."""

import ast
import gc
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parent.parent
OURS = ("codegen", "sil", "templates", "benchmarks", "docs", "tests")
LONGEST_MODULE = 500
# A wing of sil imports only wings above it in this list.
WINGS = [
    "errors",
    "vehicles",
    "plant",
    "sensors",
    "firmware",
    "files",
    "show",
    "flight",
    "emulation",
    "controllers",
    "engine",
    "pil",
    "paper",
    "footprint",
    "faults",
    "campaign",
    "regress",
    "verify",
    "tuning",
    "identify",
    "replay",
    "derivation",
    "diff",
    "playground",
    "api",
    "report",
    "cli",
    "package",
]
# Wings whose results must have the same bits on every processor, and what of them only draws or prints.
EXACT_WINGS = {"vehicles", "plant", "sensors", "flight", "controllers", "paper", "pil", "faults", "campaign"}
ROUNDED = {"sil.flight.animation", "sil.faults.section"}
# NumPy and math have these with other bits on other processors.
INEXACT = {
    *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "arcsin", "arccos", "arctan", "arctan2"),
    *("sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "arcsinh", "arccosh", "arctanh", "hypot", "sinc"),
    *("exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "pow", "power", "float_power", "cbrt"),
    *("erf", "erfc", "gamma", "lgamma", "logaddexp", "logaddexp2", "dist", "sumprod", "fma"),
    *("dot", "vdot", "inner", "matmul", "einsum", "tensordot", "linalg", "fft", "polyfit", "polyval"),
}
# What else a top-level folder imports of ours.
ALLOWED = {
    "codegen": set(),
    "templates": set(),
    "sil": {"codegen"},
    "benchmarks": {"codegen", "sil"},
    "docs": {"codegen", "sil", "mambo_nmpc"},
    "tests": {"codegen", "sil", "templates", "benchmarks", "docs", "mambo_nmpc"},
}


@cache
def modules() -> dict[str, Path]:
    """Return all modules and packages of ours, named by their folders: sil.plant.rotors."""
    paths = [path for folder in OURS for path in (ROOT / folder).rglob("*.py")]
    dotted = {path: ".".join(path.relative_to(ROOT).with_suffix("").parts) for path in paths}
    return {name.removesuffix(".__init__"): path for path, name in dotted.items()}


def tree(module: str) -> ast.Module:
    """Return the syntax tree of a module, made without looking for garbage again and again."""
    gc.disable()
    try:
        return ast.parse(modules()[module].read_text("utf-8"))
    finally:
        gc.enable()


def nodes(module: str) -> Iterator[ast.AST]:
    """Return the nodes of the syntax tree of a module."""
    return ast.walk(tree(module))


def statements(module: str) -> Iterator[ast.AST]:
    """Yield the statements of a module, those inside others too, which are a tenth of its nodes."""
    left: list[ast.AST] = [tree(module)]
    while left:
        node = left.pop()
        yield node
        children = ast.iter_child_nodes(node)
        left += [each for each in children if isinstance(each, ast.stmt | ast.excepthandler | ast.match_case)]


@cache
def imported(module: str) -> frozenset[str]:
    """Return the names that a module imports anywhere in it, of ours those of modules and packages."""
    names: set[str] = set()
    for node in statements(module):
        if isinstance(node, ast.Import):
            names |= {ours(alias.name) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module} imports relatively"
            source = ours(node.module or "")
            inside = {f"{source}.{alias.name}" for alias in node.names}
            names |= (inside & modules().keys()) | ({source} if inside - modules().keys() else set())
    return frozenset(names)


def ours(name: str) -> str:
    """Return the name of an installed module by its folders."""
    return name.removeprefix("mambo_nmpc.")


def wing(module: str) -> str:
    """Return the part of sil that a module belongs to."""
    return module.split(".")[1]


def test_top_level_folders_import_one_way() -> None:
    """Codegen and templates import nothing of ours, sil only codegen, and nothing imports tests."""
    for module in modules():
        folder = module.partition(".")[0]
        others = {name.partition(".")[0] for name in imported(module)} & {*OURS, "mambo_nmpc"} - {folder}
        assert others <= ALLOWED[folder], f"{module} imports {others - ALLOWED[folder]}"


def test_wings_import_one_way() -> None:
    """A wing of sil imports only wings below it."""
    inside = [module for module in modules() if module.startswith("sil.")]
    assert {wing(module) for module in inside} == set(WINGS)
    upwards = [
        f"{module} imports {name}"
        for module in inside
        for name in imported(module)
        if name.startswith("sil.") and WINGS.index(wing(name)) > WINGS.index(wing(module))
    ]
    assert not upwards


def test_no_import_runs_in_a_circle() -> None:
    """Not even through an import inside a function."""
    TopologicalSorter({module: imported(module) & modules().keys() for module in modules()}).prepare()


def test_flights_use_only_exact_functions() -> None:
    """Sine, exponential and powers are those of sil.plant.elementary: those of NumPy and C differ."""
    for module in modules():
        if not module.startswith("sil.") or wing(module) not in EXACT_WINGS or module in ROUNDED:
            continue
        for node in nodes(module):
            place = f"{module}, line {getattr(node, 'lineno', 0)}"
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                assert node.value.id not in {"np", "math"} or node.attr not in INEXACT, (
                    f"{place}: {node.attr}"
                )
            if isinstance(node, ast.ImportFrom) and node.module in {"math", "numpy"}:
                assert not {alias.name for alias in node.names} & INEXACT, place
            if isinstance(node, ast.BinOp):
                assert not isinstance(node.op, ast.MatMult), place
                whole = isinstance(node.right, ast.Constant | ast.Name) and isinstance(
                    node.left, ast.Constant
                )
                assert not isinstance(node.op, ast.Pow) or whole, f"{place}: a power of a variable"


def test_generating_needs_neither_compiler_nor_plot() -> None:
    """Codegen imports no cffi, no matplotlib and no scipy."""
    for module in modules():
        if module.startswith("codegen"):
            assert not {name.partition(".")[0] for name in imported(module)} & {"cffi", "matplotlib", "scipy"}


def test_tests_never_import_each_other() -> None:
    """What they share is in tests.support."""
    for module in modules():
        if module.startswith("tests."):
            others = {name for name in imported(module) if name.startswith("tests.")}
            assert all(name.startswith("tests.support") for name in others), f"{module} imports {others}"


def test_one_class_name_is_one_class() -> None:
    """Whoever reads a name in one module need not ask which of two classes it is."""
    homes = defaultdict(list)
    for module in modules():
        if not module.startswith("tests"):
            for node in statements(module):
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    homes[node.name].append(module)
    assert not {name: where for name, where in homes.items() if len(where) > 1}


def test_every_folder_of_modules_is_installed() -> None:
    """A package that pyproject.toml does not list is missing in the wheel."""
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]["packages"]
    folders = [
        "mambo_nmpc" if name == "sil.package" else f"mambo_nmpc.{name}"
        for name, path in modules().items()
        if path.name == "__init__.py" and not name.startswith(("tests", "benchmarks", "docs"))
    ]
    assert sorted(listed) == sorted(folders)


def test_modules_are_short_and_named_by_their_subject() -> None:
    """A module of more than 500 lines, or one of utilities, has more than one subject."""
    for module, path in modules().items():
        assert len(path.read_text("utf-8").splitlines()) <= LONGEST_MODULE, path
        assert module.rpartition(".")[2] not in {"utils", "util", "helpers", "misc"}, path
