"""What import-linter does not check of the structure; the layers are contracts in pyproject.toml."""

import ast
import gc
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import grimp

ROOT = Path(__file__).parent.parent
SOURCE_ROOTS = {
    "mambo_codegen": "codegen",
    "mambo_extensions": "sil",
    "mambo_nmpc": "sil",
    "mambo_sil": "sil",
    "benchmarks": ".",
}
LONGEST_MODULE, LONGEST_TEMPLATE = 500, 400
# Rooms whose results must have the same bits on every processor, and what of them only draws or prints.
_MANY = ("campaign", "faults", "table2")
EXACT_ROOMS = ("api", "drone", "flight", *(f"experiment.{name}" for name in _MANY))
ROUNDED = {
    "mambo_sil.flight.animation",
    "mambo_sil.flight.frames",
    "mambo_sil.experiment.faults.faults_report",
}
# NumPy and math have these with other bits on other processors.
INEXACT = {
    *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "arcsin", "arccos", "arctan", "arctan2"),
    *("sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "arcsinh", "arccosh", "arctanh", "hypot", "sinc"),
    *("exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "pow", "power", "float_power", "cbrt"),
    *("erf", "erfc", "gamma", "lgamma", "logaddexp", "logaddexp2", "dist", "sumprod", "fma"),
    *("dot", "vdot", "inner", "matmul", "einsum", "tensordot", "linalg", "fft", "polyfit", "polyval"),
}


@cache
def imports() -> grimp.ImportGraph:
    """Return all modules of ours, and which imports which, anywhere in it."""
    return grimp.build_graph(*SOURCE_ROOTS, "tests", include_external_packages=False, cache_dir=None)


@cache
def modules() -> dict[str, Path]:
    """Return the modules and packages of ours but the tests, by their names."""
    return {
        ".".join(path.relative_to(ROOT / folder).with_suffix("").parts).removesuffix(".__init__"): path
        for package, folder in SOURCE_ROOTS.items()
        for path in (ROOT / folder / package).rglob("*.py")
    }


def nodes(module: str) -> Iterator[ast.AST]:
    """Return the nodes of the syntax tree of a module, made without looking for garbage again and again."""
    gc.disable()
    try:
        return ast.walk(ast.parse(modules()[module].read_text("utf-8")))
    finally:
        gc.enable()


def test_no_import_runs_in_a_circle() -> None:
    """Not even through an import inside a function."""
    graph = imports()
    imported = graph.find_modules_directly_imported_by
    TopologicalSorter({name: imported(name) for name in graph.modules}).prepare()


def test_tests_never_import_each_other() -> None:
    """What they share is in tests.support and tests.mutation, or in the support of an extension's tests."""
    graph = imports()
    for module in graph.modules:
        if module.startswith("tests."):
            for name in graph.find_modules_directly_imported_by(module):
                shared = re.match(r"tests\.(support|mutation|extensions\.\w+\.support)\b", name)
                is_test = name.startswith("tests.") and (not shared or ".test_" in name)
                assert not is_test, f"{module} imports {name}"


def test_flights_use_only_exact_functions() -> None:
    """Sine, exponential and powers are those of `plant.elementary`: those of NumPy and C differ."""
    rooms = ("mambo_extensions.pil.", *(f"mambo_sil.{room}." for room in EXACT_ROOMS))
    for module in modules():
        if not module.startswith(rooms) or module in ROUNDED:
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


def test_a_module_with_an_equal_in_c_names_it() -> None:
    """Whoever reads the NumPy simulation learns in its first lines which C the commands run instead."""
    engine = ROOT / "sil" / "mambo_sil" / "flight" / "engine"
    named = 0
    for source in engine.glob("*.[ch]"):
        head = source.read_text("utf-8").partition("*/")[0]
        for folder, names in re.findall(r"(sil/mambo_sil/[\w/]+)/(\w+|\{[\w,]+\})\.py", head):
            for name in names.strip("{}").split(","):
                module = ROOT / folder / f"{name}.py"
                if module.parent != engine:
                    named += 1
                    words = ast.get_docstring(ast.parse(module.read_text("utf-8"))) or ""
                    assert f"`flight/engine/{source.name}`" in words, module
    assert named > 15


def test_one_class_name_is_one_class() -> None:
    """Whoever reads a name in one module need not ask which of two classes it is."""
    homes = defaultdict(list)
    for module in modules():
        for node in nodes(module):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].append(module)
    assert not {name: where for name, where in homes.items() if len(where) > 1}


def test_modules_are_short_and_named_by_their_subject() -> None:
    """A module of more than 500 lines, or one of utilities, has more than one subject."""
    for module, path in modules().items():
        assert len(path.read_text("utf-8").splitlines()) <= LONGEST_MODULE, path
        assert module.rpartition(".")[2] not in {"utils", "util", "helpers", "misc"}, path


def test_templates_are_short() -> None:
    """A template of more than 400 lines has more than one subject."""
    templates = [*(ROOT / "templates").rglob("*.j2"), *(ROOT / "templates").rglob("kernel/**/*.c")]
    longest = max(templates, key=lambda path: len(path.read_text("utf-8").splitlines()))
    assert len(longest.read_text("utf-8").splitlines()) <= LONGEST_TEMPLATE, longest
