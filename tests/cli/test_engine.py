"""The variable MAMBO_NMPC_ENGINE in every command that flies: with numpy the engine is not built."""

import os
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import to_toml, with_option
from tests.support.command import command, of_installed
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
SLOW_DRONE = """\
[body]
mass_kg = 0.03
drag_1_s = 0.15
[attitude]
kind = "first_order"
rate_hz = 50
roll = { gain = 0.82, lag_s = 0.047, dead_time_s = 0.091 }
pitch = { gain = 0.82, lag_s = 0.047, dead_time_s = 0.091 }
[altitude]
p_n_m = 0.45
d_n_s_m = 0.21
thrust_max_n = 0.575
"""
"""A drone that NumPy simulates quickly: a quarter of the usual ticks, and no rotors."""

SLOW = ("table1", "mambo-1norm")
"""Presets, whose controllers are also there as slow-NAME.toml, at the 50 Hz of that drone."""

COMMANDS = (
    "fly --duration-s 0.5 --no-pictures",
    "regress regress.toml",
    *(
        pytest.param(line, marks=pytest.mark.long)
        for line in of_installed(
            (
                "campaign campaign.toml --flights 1 --workers 1",
                "tune tune.toml --trials 1 --workers 1",
                "faults slow-table1.toml --vehicle slow.toml",
                "table2",
                "diff slow-table1.toml slow-mambo-1norm.toml --vehicle slow.toml",
                "sweep slow-table1.toml --vehicle slow.toml --vary horizon.prediction=5:5:1",
            )
        )
    ),
)
SCRIPT = """\
from mambo_sil.cli.app import main
from mambo_sil.experiment.faults import fault_flights
from mambo_sil.experiment.table2 import table2

fault_flights.DURATION_S, table2.DURATION_S = 31.0, 2.0
main()
"""
"""The command, with shorter flights: their number and their calls are the same."""

ODD_COMPILER = '#!/bin/sh\ncase "$*" in *loop.c*) exit 1 ;; esac\nexec {} "$@"\n'
"""A compiler that does everything but the engine."""

SAID = "the simulation runs in NumPy"


@pytest.mark.sampled(6)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("line", COMMANDS)
def test_numpy_needs_no_engine(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a compiler that refuses the engine, only the engine c says that it flies in NumPy."""
    name = line.split(maxsplit=1)[0]
    if name == "tune":
        require_module("optuna")
    if name == "sweep":
        require("arm-none-eabi-gcc", "gcc-arm-none-eabi")
    if name in FILES:
        (tmp_path / f"{name}.toml").write_text(FILES[name], "utf-8")
    (tmp_path / "slow.toml").write_text(SLOW_DRONE, "utf-8")
    for preset in SLOW:
        slow = with_option(presets.preset(preset), "horizon.update_period_s", 0.02)
        (tmp_path / f"slow-{preset}.toml").write_text(to_toml(slow), "utf-8")
    compiler = tmp_path / "odd-gcc"
    compiler.write_text(ODD_COMPILER.format(shlex.quote(require("gcc", "gcc"))), "utf-8")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    monkeypatch.setenv("MAMBO_NMPC_ENGINE", "c")
    demand_said([*line.split(), "-o", "c"], tmp_path)
    monkeypatch.setenv("MAMBO_NMPC_ENGINE", "numpy")
    done = command(*line.split(), "-o", "numpy", folder=tmp_path, script=SCRIPT)
    assert SAID not in done.stderr
    assert (tmp_path / "numpy" / "summary.json").is_file()


def demand_said(arguments: list[str], folder: Path) -> None:
    """Run a command until it says that it flies in NumPy, and demand that it does."""
    with subprocess.Popen(
        [sys.executable, "-c", SCRIPT, *arguments],
        cwd=folder,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stderr is not None
        said = any(SAID in line for line in process.stderr)
        os.killpg(process.pid, signal.SIGKILL)
    assert said


@pytest.mark.first_is_quick
@pytest.mark.parametrize("line", ["fly --duration-s 0.5", "campaign campaign.toml --flights 1 --workers 1"])
def test_an_unknown_engine_is_refused(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names both; also in a worker."""
    (tmp_path / "campaign.toml").write_text(FILES["campaign"], "utf-8")
    monkeypatch.setenv("MAMBO_NMPC_ENGINE", "fast")
    done = command(*line.split(), "-o", "out", folder=tmp_path)
    assert done.returncode == 2
    assert done.stderr.endswith('MAMBO_NMPC_ENGINE = "fast" in the environment must be c or numpy\n')
