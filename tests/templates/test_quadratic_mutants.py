"""A wrong line of the C of a quadratic cost turns parity red, and a wrong constant or sign the self-test."""

import re
import subprocess
from pathlib import Path

import pytest

from mambo_codegen.bundle.flags import COMPILE_FLAGS
from mambo_codegen.bundle.render import render
from mambo_codegen.methods.quadratic.controller import QuadraticController
from mambo_codegen.methods.quadratic.method import Quadratic
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import load_library
from tests.support.bundles import place
from tests.support.mutants import mutants
from tests.support.quadratic import ONE_MOVE, settings_of
from tests.support.quadratic_parity import ExactRun, differences, inputs_of_steps, run
from tests.support.tools import require, toolchain

EVERYTHING = settings_of(
    ONE_MOVE
    | {
        "horizon.ramp_s": 0.4,
        "model.drag_1_s": 0.067,
        "model.roll_trim_rad": 0.02,
        "model.pitch_trim_rad": -0.01,
        "model.roll_gain": 0.9,
        "model.pitch_gain": 1.1,
        "damping.pitch_rate_feedback_s": 0.02,
        "observer.age_s": 0.013,
        "observer.outage_s": 0.05,
        "limits.tilt_rad": 0.25,
    }
)
CASES, STEPS = 100, 40
INPUTS = inputs_of_steps(EVERYTHING, CASES, STEPS, seed=0)
STEP, OBSERVER, ATTITUDE = "src/nmpc.c", "src/nmpc_observer.c", "src/nmpc_attitude.c"
OPTIMIZER = "src/nmpc_optimizer.c"
FAULTS = {
    "x and y change places": (STEP, "*right = (y * self->attitude.cosine) - (x", "*right = (x * self->attitude.cosine) - (y"),
    "no velocity of the target": (STEP, "- (NMPC_UPDATE_STEP_S * target->velocity_m_s[axis])", "- (nmpc_real_t)0"),
    "the target accelerates the other way": (STEP, "nmpc_observer_disturbance(self, axis) - self->tracker", "nmpc_observer_disturbance(self, axis) + self->tracker"),
    "the limits change places": (STEP, "state[NMPC_RIGHT], NMPC_RIGHT_LIMIT_M_STEP2", "state[NMPC_RIGHT], NMPC_FORWARD_LIMIT_M_STEP2"),
    "one step less of outage": (STEP, "#define NMPC_NO_ESTIMATE (NMPC_OUTAGE_STEPS + 1U)", "#define NMPC_NO_ESTIMATE NMPC_OUTAGE_STEPS"),
    "rates over a gap": (STEP, "if (self->missed == 0U) {", "if (self->missed != NMPC_NO_ESTIMATE) {"),
    "no turn of the model": (STEP, "        nmpc_attitude_turn(self, sine, cosine);\n", "        self->attitude.sine = sine;\n        self->attitude.cosine = cosine;\n"),
    "a turn of the model after an outage": (STEP, "        self->attitude.sine = sine;\n        self->attitude.cosine = cosine;\n", "        nmpc_attitude_turn(self, sine, cosine);\n"),
    "measured attitude": (STEP, "minimize(self, target, self->attitude.tilt_m_step2);", "minimize(self, target, tilt_m_step2);"),
    "no prediction in an outage": (STEP, "    nmpc_observer_predict(self, world_m_step2);\n", "    if (state != NULL) { nmpc_observer_predict(self, world_m_step2); }\n"),
    "a bad thrust allows a command": (STEP, "((has_target != 0) && (has_thrust != 0))", "(has_target != 0)"),
    "a command of others leaves the model": (STEP, "    nmpc_attitude_set_command(self, self->command_rad[0], self->command_rad[1]);\n", ""),
    "a reset keeps the estimate": (STEP, "    self->missed = NMPC_NO_ESTIMATE;\n", ""),
    "a reset keeps the target": (STEP, "    nmpc_tracker_clear(self);\n", ""),
    "no clamp of feedback": (STEP, "nmpc_clamp(nmpc_attitude_pitch(self) + feedback_rad[1], NMPC_TILT_LIMIT_RAD)", "(nmpc_attitude_pitch(self) + feedback_rad[1])"),
    "saturated only in roll": (STEP, "(nmpc_reaches(forward_m_step2, NMPC_FORWARD_LIMIT_M_STEP2) != 0)", "0"),
    "drag the other way": ("src/nmpc_observer.h", "           - (NMPC_DRAG_1_STEP", "           + (NMPC_DRAG_1_STEP"),
    "no age of the velocity": (OBSERVER, "+ (NMPC_AGE_STEPS * acceleration_m_step2)", "+ (nmpc_real_t)0"),
    "a start forgets the disturbance": (OBSERVER, "NMPC_UPDATE_STEP_S * state->velocity_m_s[axis];\n    }", "NMPC_UPDATE_STEP_S * state->velocity_m_s[axis];\n        self->observer.disturbance_m_step2[axis] = (nmpc_real_t)0;\n    }"),
    "no limit of the disturbance": (OBSERVER, "                       NMPC_DISTURBANCE_LIMIT_M_STEP2);", "                       (nmpc_real_t)1000);"),
    "pitch the same way as roll": (ATTITUDE, "-(NMPC_PITCH_GAIN_M_STEP2_RAD * (pitch_rad - NMPC_PITCH_TRIM_COMMAND_RAD))", "NMPC_PITCH_GAIN_M_STEP2_RAD * (pitch_rad - NMPC_PITCH_TRIM_COMMAND_RAD)"),
    "no trim of roll": (ATTITUDE, "state->roll_rad - NMPC_ROLL_TRIM_RAD", "state->roll_rad"),
    "rows of the other axis": (ATTITUDE, "next(tilt_rows[axis], state)", "next(tilt_rows[1 - axis], state)"),
    "the tilt stays": (ATTITUDE, "    turn(attitude->tilt_m_step2, sine_change, cosine_change);\n", ""),
    "the first move alone": (OPTIMIZER, "first - (ratios[axis] * second_change)", "first"),
    "the ratio of the other axis": (OPTIMIZER, "(ratios[axis] * second_change)", "(ratios[1 - axis] * second_change)"),
    "the second move has no limit": (OPTIMIZER, "nmpc_clamp(second, limit_m_step2) - second", "second - second"),
}  # fmt: skip
"""The one place in a file that reads so, and what it reads instead."""

_NUMBER = re.compile(r"-?\d+\.\d+(?:e-?\d+)?f")


@pytest.fixture(scope="module")
def files() -> dict[str, str]:
    """Render the bundle once."""
    return render(EVERYTHING)


@pytest.fixture(scope="module")
def expected() -> ExactRun:
    """Run the reference once for all faults."""
    return run(QuadraticController(Quadratic(EVERYTHING), CASES), INPUTS, seed=0)


def found(files: dict[str, str]) -> ExactRun:
    """Build the C in `files`, without optimisation to save time, and run it through the same inputs."""
    library = load_library(files, toolchain("gcc", "-O0"))
    return run(CompiledController(EVERYTHING, CASES, library), INPUTS, seed=0)


def test_the_generated_code_passes(files: dict[str, str], expected: ExactRun) -> None:
    """Without a fault no bit differs."""
    assert differences(expected, found(files)) == {}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_caught(fault: str, files: dict[str, str], expected: ExactRun) -> None:
    """The faulty C compiles, and some bit differs."""
    path, right, wrong = FAULTS[fault]
    assert files[path].count(right) == 1, "the template has changed: adapt the fault"
    assert differences(expected, found(files | {path: files[path].replace(right, wrong)})) != {}


class SelfTest:
    """Builds the program whose result says whether a bundle's self-test notices."""

    def __init__(self, files: dict[str, str], folder: Path) -> None:
        (digest,) = re.findall(r"#define NMPC_SELF_TEST_DIGEST (\w+)", "\n".join(files.values()))
        self._folder = place(files, folder)
        self._gcc = require("gcc", "gcc")
        self._sources = sorted(path for path in files if re.fullmatch(r"src/.*\.c", path))
        (folder / "run.c").write_text(
            '#include "nmpc.h"\n#include "nmpc_self_test.h"\n'
            "int main(void) { static nmpc_t self; unsigned long digest = 0; int i;\n"
            "    if (nmpc_self_test(&self) != 0) { return 1; }\n"
            "    for (i = 0; i < NMPC_SELF_TEST_EPISODES; i++) {\n"
            "        digest = nmpc_self_test_episode(&self, i, digest);\n    }\n"
            f"    return (digest == {digest}) ? 0 : 2; }}\n",
            "utf-8",
        )
        for source in [*self._sources, "run.c"]:
            self._compile(source)

    def _compile(self, source: str) -> None:
        subprocess.run(
            [
                self._gcc,
                *COMPILE_FLAGS,
                "-w",
                "-Iinclude",
                "-Isrc",
                "-c",
                source,
                "-o",
                f"{Path(source).stem}.o",
            ],
            cwd=self._folder,
            check=True,
            capture_output=True,
        )

    def result(self, changed: dict[str, str]) -> int:
        """Return 0 if the self-test and its digest pass with the `changed` files."""
        before = {path: (self._folder / path).read_text("utf-8") for path in changed}
        place(changed, self._folder)
        headers = any(path.endswith(".h") for path in changed)
        rebuilt = self._sources if headers else list(changed)
        for source in rebuilt:
            self._compile(source)
        objects = [f"{Path(source).stem}.o" for source in [*self._sources, "run.c"]]
        subprocess.run([self._gcc, *objects, "-o", "run"], cwd=self._folder, check=True, capture_output=True)
        code = subprocess.run(["./run"], cwd=self._folder, check=False, timeout=60).returncode
        place(before, self._folder)
        for source in rebuilt:
            self._compile(source)
        return code


@pytest.mark.long
def test_the_self_test_notices_every_constant_of_every_table(files: dict[str, str], tmp_path: Path) -> None:
    """Each number of the rows and ratios, and of the attitude model, larger by a millionth."""
    bench = SelfTest(files, tmp_path)
    assert bench.result({}) == 0
    unnoticed, count = [], 0
    for path in (OPTIMIZER, ATTITUDE):
        text = files[path]
        for number in _NUMBER.finditer(text):
            if float(number[0][:-1]) == 0:
                continue
            count += 1
            larger = f"({number[0]} * 1.000001f)"
            changed = text[: number.start()] + larger + text[number.end() :]
            if bench.result({path: changed}) == 0:
                unnoticed.append(f"{path}: {number[0]}")
    assert count == 2 * ((2 * 8) + 1 + 4 + 4 + 1)
    assert unnoticed == []


def test_the_self_test_notices_a_wrong_sign_anywhere_in_the_step(
    files: dict[str, str], tmp_path: Path
) -> None:
    """Each plus made a minus and the other way round, in step, observer, attitude model and optimizer."""
    bench = SelfTest(files, tmp_path)
    unnoticed, count = [], 0
    for path in (STEP, OBSERVER, ATTITUDE, OPTIMIZER):
        text = files[path]
        for mutant in mutants(path, text):
            if {text[mutant.start : mutant.end].strip(), mutant.wrong.strip()} != {"+", "-"}:
                continue
            count += 1
            if bench.result({path: mutant.apply(text)}) == 0:
                unnoticed.append(mutant.wrong_line)
    assert count > 30
    assert unnoticed == []
