"""A wrong line of C turns parity red: a dozen faults by hand; `test_mutation.py` makes every small one."""

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.methods.one_norm.controller import OneNormController
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import load_library
from tests.support.parity import Run, differences, inputs_of_steps, run
from tests.support.tools import toolchain

BACKTRACKING = Settings.model_validate(
    {
        "horizon": {"control": 3, "prediction_step_s": 0.05},
        "model": {"roll_lag_s": 0.27, "pitch_lag_s": 0.15},
        "cost": {"effort_weight": 40.0},
        "optimizer": {
            "iterations": 12,
            "tolerance": 2.0,
            "warm_start": "plan",
            "step_min_rad": 0.004,
            "step_max_rad": 0.03,
        },
        "limits": {"tilt_rad": 0.25},
        "target": {"acceleration": "tracked"},
    }
)
CASES = 400
INPUTS = inputs_of_steps(BACKTRACKING, CASES, steps=12, seed=0)
PREDICTOR, PREDICTOR_H, COST = "src/nmpc_predictor.c", "src/nmpc_predictor.h", "src/nmpc_cost.c"
TRACKER, TRACKER_H = "src/nmpc_tracker.c", "src/nmpc_tracker.h"
OPTIMIZER, STEP, HELPERS = "src/nmpc_optimizer.c", "src/nmpc.c", "src/nmpc_math.h"
FAULTS = {
    "roll accelerates x the other way": (PREDICTOR, "gain_x_m_step2_rad[NMPC_ROLL] = -sine", "gain_x_m_step2_rad[NMPC_ROLL] = sine"),
    "the sign of zero is one": (HELPERS, "(value > (nmpc_sum_t)0) ? 1", "(value >= (nmpc_sum_t)0) ? 1"),
    "one predicted step too few": (COST, "i < NMPC_HORIZON_PREDICTION; i++)", "i < NMPC_HORIZON_PREDICTION - 1; i++)"),
    "one iteration too many": (OPTIMIZER, "iteration < NMPC_ITERATIONS", "iteration <= NMPC_ITERATIONS"),
    "pitch takes roll's response": (COST, "subgradient_x[response]", "subgradient_x[response - angle]"),
    "roll and pitch change places": (STEP, "command->roll_rad = self->command_rad[0]", "command->roll_rad = self->command_rad[1]"),
    "effort weighs like tracking in the cost": (COST, "weight.effort * variation_rad", "weight.tracking * variation_rad"),
    "a constant an ulp off": (PREDICTOR_H, "NMPC_ROLL_DEFICIT_DECAY 0.8309504f", "NMPC_ROLL_DEFICIT_DECAY 0.83095044f"),
    "sine multiplied out": ("src/nmpc_math.c", "rest + (rest * (square * sine_rest))", "rest * ((nmpc_real_t)1 + (square * sine_rest))"),
    "no lower clamp of a move": (OPTIMIZER, "nmpc_larger(move_rad - rprop->step_rad, -NMPC_TILT_LIMIT_RAD)", "move_rad - rprop->step_rad"),
    "no backtracking": (OPTIMIZER, "        next_rad = rprop->previous_rad;\n", ""),
    "no first command": (STEP, "        self->command_rad[k] = (nmpc_real_t)0;\n", ""),
    "the target accelerates the other way": (PREDICTOR, "rollout->acceleration_m_step2 - target_acceleration_m_step2", "rollout->acceleration_m_step2 + target_acceleration_m_step2"),
    "x takes the target's acceleration along y": (PREDICTOR, "&prediction->x, target_acceleration_m_step2[0]", "&prediction->x, target_acceleration_m_step2[1]"),
    "the acceleration does not displace the target": (PREDICTOR, "        - (NMPC_DISPLACEMENT_SHARE * target_acceleration_m_step2);", "        - (nmpc_real_t)0;"),
    "the first velocity is an acceleration": (TRACKER, "(self->has_target != 0U) && ", ""),
    "a jump is an acceleration": (TRACKER, "&& (is_steady != 0)", ""),
    "a jump keeps the jerk": (TRACKER, "tracker->jerk_m_step2_update[axis] = (nmpc_real_t)0;\n        }", "}"),
    "the jerk is not predicted": (TRACKER, "tracker->acceleration_m_step2[axis] + tracker->jerk_m_step2_update[axis]", "tracker->acceleration_m_step2[axis]"),
    "the gains change places": (TRACKER, "(NMPC_TRACKER_JERK_GAIN * ", "(NMPC_TRACKER_GAIN * "),
    "another gain": (TRACKER_H, "NMPC_TRACKER_GAIN 0.3f", "NMPC_TRACKER_GAIN 0.30000004f"),
    "a reset remembers the target": (STEP, "    set_plan(self);\n    nmpc_tracker_clear(self);", "    set_plan(self);"),
    "bad input gets a level command": (STEP, "    command->roll_rad = self->command_rad[0];", "    command->roll_rad = (status == NMPC_OK) ? self->command_rad[0] : (nmpc_real_t)0;"),
}  # fmt: skip
"""The one place in a file that reads so, and what it reads instead."""


@pytest.fixture(scope="module")
def expected() -> Run:
    """Run the reference once for all faults."""
    return run(OneNormController(OneNorm(BACKTRACKING), CASES), INPUTS, seed=0)


def found(files: dict[str, str]) -> Run:
    """Build the C in `files`, without optimisation to save time, and run it through the same inputs."""
    library = load_library(files, toolchain("gcc", "-O0"))
    return run(CompiledController(BACKTRACKING, CASES, library), INPUTS, seed=0)


def test_the_generated_code_passes(expected: Run) -> None:
    """Without a fault no bit differs."""
    assert differences(expected, found(render(BACKTRACKING, with_digest=False))) == {}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_caught(fault: str, expected: Run) -> None:
    """The faulty C compiles, and some bit differs."""
    path, right, wrong = FAULTS[fault]
    files = render(BACKTRACKING, with_digest=False)
    assert files[path].count(right) == 1, "the template has changed: adapt the fault"
    assert differences(expected, found(files | {path: files[path].replace(right, wrong)})) != {}
