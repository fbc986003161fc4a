"""A wrong line of C turns parity red: deliberate one-line faults, each of which must be caught."""

from functools import cache
from typing import NamedTuple

import pytest

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.reference import ReferenceController
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings.controller_toml import with_option
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.controllers.extension import load_extension
from mambo_nmpc.sil.verify.inputs import Inputs
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
    }
)
STAYING = with_option(
    with_option(BACKTRACKING, "optimizer.variant", "irprop-"), "optimizer.warm_start", "last_command"
)
NEVER_CONVERGING = with_option(BACKTRACKING, "optimizer.tolerance", 0.0)
CASES = 400


class Mutant(NamedTuple):
    """A fault: in `path`, the one place that reads `right` reads `wrong`."""

    name: str
    path: str
    right: str
    wrong: str
    settings: Settings = BACKTRACKING


MATH, PREDICTOR, COST = "src/nmpc_math.c", "src/nmpc_predictor.c", "src/nmpc_cost.c"
PREDICTOR_H = "src/nmpc_predictor.h"
OPTIMIZER, STEP, HELPERS, CONFIG = (
    "src/nmpc_optimizer.c",
    "src/nmpc.c",
    "src/nmpc_math.h",
    "include/nmpc_config.h",
)

MUTANTS = [
    # signs
    Mutant("roll pushes x the other way", PREDICTOR, "gain_x_m[NMPC_ROLL] = -across", "gain_x_m[NMPC_ROLL] = across"),
    Mutant("pitch pushes x the other way", PREDICTOR, "gain_x_m[NMPC_PITCH] = -along", "gain_x_m[NMPC_PITCH] = along"),
    Mutant("pitch pushes y the other way", PREDICTOR, "gain_y_m[NMPC_PITCH] = -across", "gain_y_m[NMPC_PITCH] = across"),
    Mutant("error counts from the target", PREDICTOR, "state->position_m[0] - target->position_m[0]", "target->position_m[0] - state->position_m[0]"),
    Mutant("sine of a half turn keeps its sign", MATH, "*sine = -sine_rest;", "*sine = sine_rest;"),
    Mutant("quadrants of negative angles round up", MATH, "? -half : half", "? half : half"),
    Mutant("the move climbs", OPTIMIZER, "nmpc_larger(move_rad - rprop", "nmpc_larger(move_rad + rprop"),
    Mutant("the sign of zero is one", HELPERS, "(value > (nmpc_sum_t)0) ? 1", "(value >= (nmpc_sum_t)0) ? 1"),
    Mutant("a negative value stays negative", HELPERS, "__builtin_fabsf(value)", "value"),
    Mutant("leaving a move costs like entering it", COST, "slope - effort", "slope + effort"),
    Mutant("an error below zero has a negative size", COST, "(nmpc_real_t)nmpc_absolute(walk->error_m)", "walk->error_m"),
    Mutant("an error below zero slopes up", COST, "-(nmpc_real_t)1", "(nmpc_real_t)1"),
    Mutant("a part is not taken back", COST, "nmpc_predictor_response_sum[i][k] - slopes[k]", "nmpc_predictor_response_sum[i][k] + slopes[k]"),
    Mutant("the last error sets the sign", COST, "errors->below >> NMPC_LAST_STEP", "errors->below & 1U"),
    Mutant("errors that are all zero slope up", COST, "nmpc_real_t sign = (nmpc_real_t)0", "nmpc_real_t sign = (nmpc_real_t)1"),
    Mutant("what is yet to come comes early", PREDICTOR_H, "roll_to_come_m - nmpc_part(", "roll_to_come_m + nmpc_part("),
    # bounds
    Mutant("one predicted step too few", COST, "i < NMPC_PREDICTION_HORIZON; i++)", "i < NMPC_PREDICTION_HORIZON - 1; i++)"),
    Mutant("the first predicted step left out", COST, "for (i = 0; i < NMPC_CONTROL_HORIZON; i++) {\n        nmpc_predictor", "for (i = 1; i < NMPC_CONTROL_HORIZON; i++) {\n        nmpc_predictor"),
    Mutant("a predicted step counted twice", COST, "for (i = NMPC_CONTROL_HORIZON;", "for (i = NMPC_CONTROL_HORIZON - 1;"),
    Mutant("one iteration too few", OPTIMIZER, "iteration < NMPC_ITERATIONS", "iteration < NMPC_ITERATIONS - 1"),
    Mutant("one iteration too many", OPTIMIZER, "iteration < NMPC_ITERATIONS", "iteration <= NMPC_ITERATIONS"),
    Mutant("the last move never updated", OPTIMIZER, "        for (k = 0; k < NMPC_MOVES; k++)", "        for (k = 0; k < NMPC_MOVES - 1; k++)"),
    Mutant("the second move is entered from nowhere", COST, "if (i > 0)", "if (i > 1)"),
    Mutant("a sine term too few", MATH, "for (k = NMPC_SINE_TERMS - 2", "for (k = NMPC_SINE_TERMS - 3"),
    Mutant("convergence tested at once", OPTIMIZER, "(iteration > 0) && ", ""),
    Mutant("any cheaper plan counts as converged", OPTIMIZER, "nmpc_absolute(self->cost - previous_cost) < NMPC_TOLERANCE", "self->cost - previous_cost < NMPC_TOLERANCE"),
    # indices
    Mutant("y looks where x is", PREDICTOR, "state->position_m[1] - target", "state->position_m[0] - target"),
    Mutant("pitch takes roll's response", COST, "slopes_x[response]", "slopes_x[response - axis]"),
    Mutant("a change of sign is found a step late", COST, "(NMPC_LAST_STEP - 1U) - nmpc_lowest_one", "NMPC_LAST_STEP - nmpc_lowest_one"),
    Mutant("the first change of sign goes unseen", COST, "<< NMPC_LAST_STEP) - 1U)", "<< (NMPC_LAST_STEP - 1U)) - 1U)"),
    Mutant("one change of sign too few", COST, "part = 1;", "part = NMPC_PREDICTION_HORIZON - 1;"),
    Mutant("the gradient of pitch takes the gain of roll", COST, "gain_x_m[axis]", "gain_x_m[0]"),
    Mutant("pitch decays like roll", PREDICTOR_H, "nmpc_part(NMPC_PITCH_DECAY, walk->pitch", "nmpc_part(NMPC_ROLL_DECAY, walk->pitch"),
    Mutant("pitch comes at once like roll", PREDICTOR_H, "NMPC_PITCH_AT_ONCE, pitch_m", "NMPC_ROLL_AT_ONCE, pitch_m"),
    Mutant("every move turns from the measured tilt", PREDICTOR_H, "(i > 0) ? &moves_rad[NMPC_AXES * (i - 1)] : prediction->tilt_rad", "prediction->tilt_rad"),
    Mutant("pitch pushes by roll", PREDICTOR, "gain_m[NMPC_PITCH], tilt_rad[NMPC_PITCH]", "gain_m[NMPC_PITCH], tilt_rad[NMPC_ROLL]"),
    Mutant("a move follows the other axis", COST, "before_rad = moves_rad[k];", "before_rad = moves_rad[NMPC_AXES * i];"),
    Mutant("the command takes the second move", STEP, "self->command_rad[1] = self->plan_rad[1]", "self->command_rad[1] = self->plan_rad[3]"),
    Mutant("roll and pitch change places", STEP, "command->roll_rad = self->command_rad[0]", "command->roll_rad = self->command_rad[1]"),
    Mutant("a reset starts pitch at roll", STEP, "self->command_rad[k % NMPC_AXES]", "self->command_rad[0]"),
    # weights and constants
    Mutant("effort free of charge in the gradient", COST, "                effort = nmpc_effort_slope(weight.effort);\n", ""),
    Mutant("going down is rewarded", COST, "effort = -nmpc_effort_slope", "effort = nmpc_effort_slope"),
    Mutant("a change downwards has a negative size", COST, "variation_rad - change_rad", "variation_rad + change_rad"),
    Mutant("effort weighs like tracking in the cost", COST, "nmpc_effort_cost(weight.effort, variation_rad)", "nmpc_effort_cost(weight.tracking, variation_rad)"),
    Mutant("tracking unweighted in the gradient", COST, "nmpc_tracking_slope(weight.tracking, distance_by_move_m)", "distance_by_move_m"),
    Mutant("the robot stands still", PREDICTOR, "nmpc_travel(velocity_m_s) + ", "velocity_m_s + "),
    Mutant("thrust left out", PREDICTOR, "nmpc_push(thrust_acceleration_m_s2)", "nmpc_push((nmpc_real_t)9.81)"),
    Mutant("steps grow while they should shrink", OPTIMIZER, "nmpc_scaled(rprop->step_rad, NMPC_DECREASE)", "nmpc_scaled(rprop->step_rad, NMPC_INCREASE)"),
    Mutant("a constant an ulp off", PREDICTOR_H, "NMPC_ROLL_DECAY 0.8309504f", "NMPC_ROLL_DECAY 0.83095044f"),
    # order of operations
    Mutant("bend added first", PREDICTOR_H, "walk->advance_m + (walk->bend_m + (walk->roll_to_come_m + walk->pitch_to_come_m))", "(walk->advance_m + walk->bend_m) + (walk->roll_to_come_m + walk->pitch_to_come_m)"),
    Mutant("tracking weighed after the gains", COST, "nmpc_tracking_slope(weight.tracking, distance_by_move_m)", "(((weight.tracking * prediction->gain_x_m[axis]) * slopes_x[response]) + ((weight.tracking * prediction->gain_y_m[axis]) * slopes_y[response]))"),
    Mutant("sine multiplied out", MATH, "rest + nmpc_component(rest, nmpc_component(square, sine_rest))", "rest * ((nmpc_real_t)1 + (square * sine_rest))"),
    Mutant("angle reduced in one go", MATH, "((angle_rad - (count * quarter_turn_rad[0])) - (count * quarter_turn_rad[1]))", "(angle_rad - (count * (quarter_turn_rad[0] + quarter_turn_rad[1])))"),
    # missing lines
    Mutant("no upper clamp of a move", OPTIMIZER, "nmpc_smaller(move_rad + rprop->step_rad, NMPC_TILT_LIMIT_RAD)", "move_rad + rprop->step_rad"),
    Mutant("no lower clamp of a move", OPTIMIZER, "nmpc_larger(move_rad - rprop->step_rad, -NMPC_TILT_LIMIT_RAD)", "move_rad - rprop->step_rad"),
    Mutant("no lower clamp", HELPERS, "nmpc_smaller(nmpc_larger(value, -limit), limit)", "nmpc_smaller(value, limit)"),
    Mutant("no largest step", OPTIMIZER, "nmpc_smaller(nmpc_scaled(rprop->step_rad, NMPC_INCREASE), NMPC_STEP_MAX_RAD)", "nmpc_scaled(rprop->step_rad, NMPC_INCREASE)"),
    Mutant("no smallest step", OPTIMIZER, "nmpc_larger(nmpc_scaled(rprop->step_rad, NMPC_DECREASE), NMPC_STEP_MIN_RAD)", "nmpc_scaled(rprop->step_rad, NMPC_DECREASE)"),
    Mutant("no backtracking", OPTIMIZER, "        next_rad = rprop->before_rad;\n", ""),
    Mutant("backtracking from the start", OPTIMIZER, "        rprop->before_rad = move_rad;\n", ""),
    Mutant("backtracking where there is none", OPTIMIZER, "        rprop->direction = 0;\n", "        rprop->direction = 0;\n        next_rad -= rprop->step_rad;\n", STAYING),
    Mutant("the stored slope outlives a crossing", OPTIMIZER, "        rprop->direction = 0;\n", ""),
    Mutant("steps start small", OPTIMIZER, "step_rad = NMPC_INITIAL_STEP_RAD;", "step_rad = NMPC_STEP_MIN_RAD;"),
    Mutant("the plan starts over", STEP, "        nmpc_optimizer_minimize(self);", "        set_plan(self);\n        nmpc_optimizer_minimize(self);"),
    Mutant("the plan lives on", STEP, "        set_plan(self);\n        nmpc_optimizer_minimize(self);", "        nmpc_optimizer_minimize(self);", STAYING),
    Mutant("the frozen plan moves on", OPTIMIZER, "(converged == 0) ? nmpc_sign(self->gradient[k]) : 0", "nmpc_sign(self->gradient[k])"),
    Mutant("a frozen plan counts iterations", OPTIMIZER, "        if (converged == 0) {\n            updates++;\n        }", "        updates++;"),
    Mutant("convergence at the tolerance itself", OPTIMIZER, "nmpc_absolute(self->cost - previous_cost) < NMPC_TOLERANCE", "nmpc_absolute(self->cost - previous_cost) <= NMPC_TOLERANCE", NEVER_CONVERGING),
    Mutant("no first command", STEP, "        self->command_rad[k] = (nmpc_real_t)0;\n", ""),
    Mutant("no first plan", STEP, "        self->plan_rad[k] = (nmpc_real_t)0;\n", ""),
    Mutant("no first cost", STEP, "    self->cost = (nmpc_sum_t)0;\n", ""),
    Mutant("no first gradient", STEP, "        self->gradient[k] = (nmpc_sum_t)0;\n", ""),
    Mutant("no first count of iterations", STEP, "    self->iterations = 0U;\n", ""),
    Mutant("no first verdict on convergence", STEP, "    self->converged = 0U;\n", ""),
    Mutant("the largest weight refused", STEP, "nmpc_between(weights->tracking, (nmpc_real_t)0, NMPC_TRACKING_WEIGHT_LIMIT)", "(nmpc_between(weights->tracking, (nmpc_real_t)0, NMPC_TRACKING_WEIGHT_LIMIT) && (weights->tracking < NMPC_TRACKING_WEIGHT_LIMIT))"),
    Mutant("a weight of zero refused", STEP, "nmpc_between(weights->effort, (nmpc_real_t)0, NMPC_EFFORT_WEIGHT_LIMIT)", "(nmpc_between(weights->effort, (nmpc_real_t)0, NMPC_EFFORT_WEIGHT_LIMIT) && (weights->effort > (nmpc_real_t)0))"),
    Mutant("yaw unchecked", STEP, "nmpc_within(state->yaw_rad, NMPC_YAW_RANGE_RAD)", "(state->yaw_rad == state->yaw_rad)"),
    Mutant("NaN passes", HELPERS, "(value >= least);\n    const int is_no_more = (value <= most);", "!(value < least);\n    const int is_no_more = !(value > most);"),
    Mutant("velocity of the target unchecked", STEP, "           && nmpc_within(velocity_m_s[1], NMPC_VELOCITY_RANGE_M_S);", "           ;"),
    Mutant("no least thrust", STEP, "nmpc_between(thrust_acceleration_m_s2, NMPC_THRUST_ACCELERATION_MIN_M_S2,", "nmpc_between(thrust_acceleration_m_s2, (nmpc_real_t)0,"),
    Mutant("negative weights pass", STEP, "nmpc_between(weights->effort, (nmpc_real_t)0, NMPC_EFFORT_WEIGHT_LIMIT)", "nmpc_between(weights->effort, -NMPC_EFFORT_WEIGHT_LIMIT, NMPC_EFFORT_WEIGHT_LIMIT)"),
    Mutant("a reset beyond the limit", STEP, "nmpc_clamp(command->roll_rad, NMPC_TILT_LIMIT_RAD)", "command->roll_rad"),
    Mutant("bad input gets a level command", STEP, "    command->roll_rad = self->command_rad[0];", "    command->roll_rad = (status == NMPC_OK) ? self->command_rad[0] : (nmpc_real_t)0;"),
    Mutant("the tilt limit an ulp wider", CONFIG, "NMPC_TILT_LIMIT_RAD 0.25f", "NMPC_TILT_LIMIT_RAD 0.25000003f"),
]  # fmt: skip


@cache
def expected(settings: Settings) -> tuple[list[Inputs], Run]:
    """Run the reference once for all mutants of `settings`."""
    inputs = inputs_of_steps(settings, CASES, steps=4, seed=0)
    return inputs, run(ReferenceController(Design(settings), CASES), inputs, seed=0)


def found(settings: Settings, files: dict[str, str]) -> Run:
    """Build the C in `files` and run it through the same inputs."""
    extension = load_extension(files, settings.code.scalar, toolchain("gcc"))
    return run(CompiledController(settings, CASES, extension), expected(settings)[0], seed=0)


@pytest.mark.parametrize("settings", [BACKTRACKING, STAYING], ids=["rprop+", "irprop-"])
def test_the_unharmed_code_passes(settings: Settings) -> None:
    """Without a fault the check that catches the mutants finds nothing."""
    assert differences(expected(settings)[1], found(settings, render(settings, with_digest=False))) == {}


@pytest.mark.long
@pytest.mark.parametrize("mutant", MUTANTS, ids=[mutant.name for mutant in MUTANTS])
def test_mutant_is_caught(mutant: Mutant) -> None:
    """The fault applies, compiles, and shows as differing bits."""
    files = render(mutant.settings, with_digest=False)
    assert files[mutant.path].count(mutant.right) == 1, "the template moved on: the mutant must follow"
    harmed = files | {mutant.path: files[mutant.path].replace(mutant.right, mutant.wrong, 1)}
    assert differences(expected(mutant.settings)[1], found(mutant.settings, harmed)) != {}
