"""Each example runs, and prints what its first comment says."""

import ast
import json
import re
import shutil
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest

from tests.support.console import Command, Page, faults
from tests.support.tools import require, require_module

EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = sorted(
    str(path.relative_to(EXAMPLES)) for path in EXAMPLES.rglob("*") if path.suffix in {".py", ".sh", ".c"}
)
NEEDED = {
    "train.py": ["gymnasium"],
    "tune.sh": ["optuna"],
    "crazyflow_flight.py": ["crazyflow"],
    "mujoco_flight.py": ["mujoco"],
    "drake_flight.py": ["pydrake"],
}
TOOLS = {
    "own_loop/main.c": [("cmake", "cmake"), ("cc", "gcc")],
    "stm32/main.c": [("arm-none-eabi-gcc", "gcc-arm-none-eabi")],
}
OF_OTHERS = ("crazyflow_flight.py", "drake_flight.py", "mujoco_flight.py")
"""Those that need a simulator of others."""
QUICK = ("flight.py",)
MOST_LINES = 60


def marks(name: str) -> list[pytest.MarkDecorator]:
    """Return the marks of an example."""
    if name in OF_OTHERS:
        return [pytest.mark.long, pytest.mark.thorough]
    return [] if name in QUICK else [pytest.mark.long]


def page_of(path: Path) -> Page:
    """Return the commands of the first comment of a file, with what they print."""
    text = path.read_text("utf-8")
    if path.suffix == ".py":
        comment = ast.get_docstring(ast.parse(text)) or ""
    else:
        comment = re.split(r"\*/|^(?![#/ ])", text, maxsplit=1, flags=re.MULTILINE)[0]
    lines = [re.sub(r"^(?:/\*| \*|#) ?", "", line).rstrip() for line in comment.splitlines()]
    steps: list[Command] = []
    for number, line in enumerate(lines, 1):
        if line.startswith("$ "):
            steps.append(Command(number, line.removeprefix("$ "), ()))
        elif steps and line:
            last = steps.pop()
            steps.append(Command(last.line, last.text, (*last.output, line)))
    return Page(tuple(steps), ())


@pytest.mark.parametrize("name", [pytest.param(name, marks=marks(name)) for name in FILES])
def test_it_prints_what_its_first_comment_says(name: str, tmp_path: Path) -> None:
    """In a copy of the folder, as a reader types it; and it is short."""
    for module in NEEDED.get(name, []):
        require_module(module)
    for tool, package in TOOLS.get(name, []):
        require(tool, package)
    folder = shutil.copytree(EXAMPLES, tmp_path / "examples")
    page = page_of(EXAMPLES / name)
    assert page.steps
    assert any(step.output for step in page.steps if isinstance(step, Command))
    found = faults(page, (folder / name).parent)
    assert not found, "\n\n".join(found)
    assert len((EXAMPLES / name).read_text("utf-8").splitlines()) <= MOST_LINES


@pytest.mark.long
def test_the_cells_of_the_notebook_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One after another, without a screen."""
    mpl.use("agg")
    shutil.copytree(EXAMPLES, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    cells = json.loads((EXAMPLES / "notebook.ipynb").read_text("utf-8"))["cells"]
    names: dict[str, Any] = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), "notebook.ipynb", "exec"), names)
    assert capsys.readouterr().out == "within 5 cm\n"


def test_the_list_of_examples_names_each() -> None:
    """By its file, with what it shows."""
    text = (EXAMPLES / "README.md").read_text("utf-8")
    linked = set(re.findall(r"\]\(([\w/.]+)\)", text))
    assert {*FILES, "notebook.ipynb"} <= linked
