"""A made-up number of the target: one row more in the port reaches all that lists the target's numbers.

What computes with a number, the law and its checks in C, is no part of this: nothing reads this one.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.tools import toolchain

ROWS = """
from mambo_codegen.port import taken
from mambo_codegen.port.row import WHOLE, CHANCE, Draw, PortRow
*numbers, known = taken.TAKEN["target"]
taken.TAKEN["target"] = (
    *numbers,
    PortRow("swirl_1_s", "factor", "made up", 2, draw=Draw("SWIRL_1_S", 0.5),
        told=(("swirl_x", "x"), ("swirl_y", "y"))),
    known,
    PortRow("flag", "whole", "made up", kind=WHOLE, draw=CHANCE),
)
"""
"""Run before anything of ours is imported, so that no list is made without the rows."""

BUNDLE = """
import json, sys
from mambo_codegen.bundle.render import render, render_target
from mambo_codegen.bundle.targets import find_target, target_names
from tests.support.options import OPTIONS
settings = OPTIONS[sys.argv[1]].settings
files = render(settings, with_digest=False)
there = [name for name in ("fmu", "pil", "arduino") if name in target_names()]
for name in there:
    made = render_target(settings, find_target(name), with_digest=False)
    files |= {f"{name}/{path}": text for path, text in made.items()}
print(json.dumps({"files": files, "there": there}))
"""

RUNS = """
import sys
import numpy as np
from mambo_codegen.bundle.digest import episode_inputs, self_test_digest
from mambo_codegen.methods import method_of
from mambo_sil.experiment.faults.fault import Fault, ShiftTarget
from mambo_sil.experiment.faults.injection import FaultyController
from mambo_sil.flight.columns import LEVEL, SPACE, TARGET
from mambo_sil.flight.controllers.compiled import CompiledController, digest_compiled
from mambo_sil.flight.controllers.controller_library import build_library
from mambo_sil.flight.engine import engine_library
from mambo_sil.flight import loop
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.model.replay.logged_columns import signals_of
from mambo_sil.verify.step_inputs import StepRows, random_inputs
from mambo_codegen.toolchain import host_toolchain
from hashlib import sha256
from mambo_sil.drone.vehicles import vehicle_toml
from tests.support.options import OPTIONS

settings = OPTIONS[sys.argv[1]].settings
method = method_of(settings)
swirl = [one.column for one in method.port.numbers("target") if one.row.member == "swirl_1_s"]
flag = [one.column for one in method.port.numbers("target") if one.row.member == "flag"]
assert len(swirl) == 2 and len(flag) == 1

# The self-test draws it, in NumPy and in C with the same bits; a range that the C lacks would show.
drawn = np.concatenate([step[1] for step in episode_inputs(method, np.arange(40, dtype=np.uint32))])
assert len(np.unique(drawn[:, swirl])) > 100 and set(np.unique(drawn[:, flag])) == {0, 1}
library = build_library(settings, host_toolchain())
assert digest_compiled(library, 20) == self_test_digest(method, 20)

# Calls of the C interface as bytes have it, drawn at random.
rows = StepRows(method)
inputs = random_inputs(settings, 200, np.random.default_rng(0))
assert len(np.unique(inputs.target[:, swirl])) > 100
again = rows.split(rows.join(inputs))
np.testing.assert_array_equal(again.target, inputs.target)

# It flies in the engine and in NumPy, by itself and behind a fault, with the same bits.
assert TARGET["swirl_1_s"].stop <= LEVEL.target < SPACE.target
digest = sha256(engine_library.declarations().encode()).hexdigest()
engine_library.engine_interface.DECLARATIONS_SHA256 = digest  # its records are the same
scenario = Scenario(vehicle=vehicle_toml.load("crazyflie"), duration_s=1.0)
flight = flight_of([scenario], settings.horizon.update_period_s)
faults = [Fault(20, 40, ShiftTarget((0.1, 0.0, 0.0, 0.0, 0.0, 0.0)))]
for wrap in (lambda one: one, lambda one: FaultyController(one, faults)):
    traces = [fly_in(flight, wrap(CompiledController(settings, 1, library))) for fly_in in (fly, loop.fly)]
    for name in ("position_m", "command_rad", "status"):
        assert getattr(traces[0], name).tobytes() == getattr(traces[1], name).tobytes(), name
    assert not traces[0].status.any()
assert signals_of(method.port, "target")[-2:] == ("target_swirl_1_s[0]", "target_swirl_1_s[1]")
print("ok")
"""


def run(script: str, option: str) -> str:
    """Run a script with the rows, in a process of its own."""
    made = subprocess.run(
        [sys.executable, "-c", ROWS + script, option],
        cwd=Path(__file__).parents[1],
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr[-3000:]
    return made.stdout


@pytest.mark.parametrize("option", ["height", "quadratic", "learnt gain"])
def test_a_member_more_flies_with_the_same_bits_everywhere(option: str) -> None:
    """In the self-test, the tapes, the engine, NumPy and behind a fault; a replay asks for its columns."""
    assert run(RUNS, option) == "ok\n"


@pytest.mark.parametrize("option", ["height", "quadratic"])
def test_a_member_more_is_in_all_that_a_bundle_has(option: str, tmp_path: Path) -> None:
    """Header, self-test, fuzz, proof, mock-up unit and frames name it or count it, and compile."""
    made = json.loads(run(BUNDLE, option))
    files = made["files"]
    named = ("nmpc.h", "nmpc_self_test.c", "fuzz/nmpc_fuzz.c", "proof/nmpc_proof.c")
    glue = [path for path in ("fmu/sources/nmpc_fmu.c", "pil/pil.c") if path in files]
    for path in (*named, *(one for one in glue if one.startswith("fmu"))):
        assert "swirl_1_s" in files[path], path
        assert "flag" in files[path], path
    if "fmu" in made["there"]:
        described = files["fmu/fmi3/modelDescription.xml"]
        assert all(f'name="{one}"' in described for one in ("swirl_x", "swirl_y", "flag"))
    if "pil" in made["there"]:
        assert "target.flag = whole(" in files["pil/pil.c"]
    for path, text in files.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    gcc = toolchain("gcc")
    for path in (*named[1:], *glue, "example/main.c"):
        folder = tmp_path / Path(path).parts[0] if path.startswith(("fmu", "pil")) else tmp_path
        headers = [f"-I{folder}", f"-I{folder / 'sources'}"]
        digest = "-DNMPC_SELF_TEST_DIGEST=0UL"
        gcc.run(["-std=c99", "-Wall", "-Werror", "-fsyntax-only", digest, *headers, path], tmp_path)
