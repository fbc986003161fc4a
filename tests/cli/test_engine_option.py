"""The option --engine of every command that flies: with numpy the engine is not even built."""

import shlex
from pathlib import Path

import pytest

from tests.support.command import command
from tests.support.tools import require, require_module

FILES = {
    "regress": "[flight]\nduration_s = 0.5\n[flights.eight]\nbounds = { iae_m_s = 9.0 }\n",
    "campaign": 'controllers = ["pd", "mambo"]\n[flight]\nduration_s = 1.0\n',
    "tune": """
        base = "mambo-1norm"
        flights = 1
        flight.duration_s = 1.0
        [search]
        cost.effort_weight = { uniform = [0.1, 1.0] }
        """,
}
COMMANDS = (
    "fly --duration-s 0.5 --no-pictures",
    "regress regress.toml",
    "campaign campaign.toml --flights 1 --workers 1",
    "tune tune.toml --trials 1 --workers 1",
    *(
        pytest.param(line, marks=pytest.mark.long)
        for line in (
            "faults",
            "table2",
            "diff table1 mambo-1norm",
            "sweep --prediction 5 --control 1 --iterations 3",
        )
    ),
)
ODD_COMPILER = '#!/bin/sh\ncase "$*" in *loop.c*) exit 1 ;; esac\nexec {} "$@"\n'
"""A compiler that does everything but the engine."""


@pytest.mark.parametrize("line", COMMANDS)
def test_numpy_needs_no_engine(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a compiler that refuses the engine, only the option c says that it flies in NumPy."""
    name = line.split(maxsplit=1)[0]
    if name == "tune":
        require_module("optuna")
    if name == "sweep":
        require("arm-none-eabi-gcc", "gcc-arm-none-eabi")
    if name in FILES:
        (tmp_path / f"{name}.toml").write_text(FILES[name], "utf-8")
    compiler = tmp_path / "odd-gcc"
    compiler.write_text(ODD_COMPILER.format(shlex.quote(require("gcc", "gcc"))), "utf-8")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    said = {
        engine: command(*line.split(), "--engine", engine, "-o", engine, folder=tmp_path).stderr
        for engine in ("c", "numpy")
    }
    assert "the simulation runs in NumPy" in said["c"]
    assert "the simulation runs in NumPy" not in said["numpy"]
    assert (tmp_path / "numpy" / "summary.json").is_file()
