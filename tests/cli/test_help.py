"""Help: what it says of every command, and that it need not wait for what only commands need."""

import subprocess
import sys

import pytest

from mambo_sil.cli.app import PANELS
from tests.support.command import run

HEAVY = {"capstone", "cffi", "elftools", "jinja2", "matplotlib", "numpy", "optuna", "scipy", "unicorn"}
SETTINGS = "mambo_codegen.settings.model"
SCRIPT = """
import sys
from mambo_sil.cli.app import main
try:
    main()
except SystemExit as leaving:
    print(*sys.modules, file=sys.stderr)
    raise
"""


@pytest.mark.parametrize("arguments", [["--help"], ["fly", "--help"], ["generate", "--help"]])
def test_help_loads_no_heavy_library(arguments: list[str]) -> None:
    """It answers at once: a command imports what it needs when it is called."""
    line = [sys.executable, "-c", SCRIPT, *arguments]
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    assert done.stdout
    assert "typer" in done.stderr.split()
    assert not {*HEAVY, SETTINGS} & set(done.stderr.split())


def test_every_command_has_its_line() -> None:
    """The first sentence of what it does, in the panel of what it is for."""
    said, _ = run("--help")
    assert all(f"─ {panel} ─" in said for panel in PANELS)
    for name in (name for commands in PANELS.values() for name in commands):
        assert f"│ {name} " in said
