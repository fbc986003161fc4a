"""The house keeps its shape: who may import whom, and what the project may not name."""

import ast
import re
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
OURS = {"codegen", "sil", "templates", "tests", "benchmarks"}
ALLOWED = {"codegen": set(), "sil": {"codegen"}, "templates": set(), "benchmarks": {"codegen", "sil"}}
LONGEST_MODULE = 500


def imported(path: Path) -> set[str]:
    """Return the top-level packages that a module imports."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            names.add(node.module.partition(".")[0])
    return names


@pytest.mark.parametrize("package", ALLOWED)
def test_imports_run_one_way(package: str) -> None:
    """Codegen imports nothing of ours, sil only codegen, and no test is imported by anything."""
    for path in (ROOT / package).rglob("*.py"):
        beyond = imported(path) & OURS - ALLOWED[package] - {package}
        assert not beyond, f"{path} imports {beyond}"


def module_name(path: Path) -> str:
    """Return the name by which a module of ours is imported."""
    return ".".join(("mambo_nmpc", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")


def test_no_modules_import_each_other_in_a_circle() -> None:
    """Nor inside functions: `TopologicalSorter` raises CycleError with the modules of a circle."""
    paths = [path for package in ("codegen", "sil") for path in (ROOT / package).rglob("*.py")]
    modules = {module_name(path): path for path in paths}
    graph = {}
    for module, path in modules.items():
        graph[module] = {
            name if (name := f"{node.module}.{alias.name}") in modules else node.module
            for node in ast.walk(ast.parse(path.read_text("utf-8")))
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        } - {module}
    assert len(list(TopologicalSorter(graph).static_order())) >= len(modules)


def test_generating_needs_neither_compiler_nor_plot() -> None:
    """Codegen imports no cffi, no matplotlib and no scipy."""
    for path in (ROOT / "codegen").rglob("*.py"):
        assert not imported(path) & {"cffi", "matplotlib", "scipy"}, path


def test_tests_never_import_each_other() -> None:
    """What they share is in tests.support."""
    for path in (ROOT / "tests").rglob("test_*.py"):
        assert not re.search(r"^(from|import) tests\.test_", path.read_text("utf-8"), re.MULTILINE), path


def test_no_module_is_too_long() -> None:
    """A module of more than 500 lines knows more than one thing."""
    for package in OURS:
        for path in (ROOT / package).rglob("*.py"):
            assert len(path.read_text("utf-8").splitlines()) <= LONGEST_MODULE, path


def test_a_command_that_draws_nothing_loads_no_plotting_library() -> None:
    """Help and generation stay quick, and work where matplotlib does not."""
    script = "import sys; from mambo_nmpc.sil.cli.app import main; print('matplotlib' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["False"]
