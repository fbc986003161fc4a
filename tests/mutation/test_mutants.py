"""A wrong line of C turns parity red: some by hand, of both methods; `test_mutation.py` makes every small one."""

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import load_library
from tests.support.parity import Run, differences, inputs_of_steps, run
from tests.support.quadratic import EVERYTHING
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
CONTROLLER = "nmpc.c"
ONE_NORM_FAULTS = {
    "roll accelerates x the other way": ("gain_x_m_step2_rad[NMPC_ROLL] = sine", "gain_x_m_step2_rad[NMPC_ROLL] = -sine"),
    "the sign of zero is one": ("(value > (nmpc_sum_t)0) ? 1", "(value >= (nmpc_sum_t)0) ? 1"),
    "one predicted step too few": ("i < NMPC_HORIZON_PREDICTION; i++)", "i < NMPC_HORIZON_PREDICTION - 1; i++)"),
    "one iteration too many": ("iteration < NMPC_ITERATIONS", "iteration <= NMPC_ITERATIONS"),
    "pitch takes roll's response": ("subgradient_x[response]", "subgradient_x[response - angle]"),
    "roll and pitch change places": ("command->roll_rad = self->command_rad[0]", "command->roll_rad = self->command_rad[1]"),
    "effort weighs like tracking in the cost": ("weight.effort * variation_rad", "weight.tracking * variation_rad"),
    "a constant an ulp off": ("NMPC_ROLL_DEFICIT_DECAY 0.8309504f", "NMPC_ROLL_DEFICIT_DECAY 0.83095044f"),
    "sine multiplied out": ("rest + (rest * (square * sine_rest))", "rest * ((nmpc_real_t)1 + (square * sine_rest))"),
    "half a turn keeps the sine": ("if ((quadrant & 2U) != 0U) {", "if ((quadrant & 4U) != 0U) {"),
    "the sign of the cosine is that of the sine": ("if (((quadrant + 1U) & 2U) != 0U) {", "if ((quadrant & 2U) != 0U) {"),
    "the cosine of every turn is even": ("*cosine = ((quadrant & 1U) == 0U) ? cosine_rest : sine_rest;", "*cosine = cosine_rest;"),
    "a quarter turn is its first part": (" - (count * NMPC_QUARTER_TURN_REST_RAD);", ";"),
    "each quadrant is the next": ("#define NMPC_ROUNDING 1.2582912e+07f", "#define NMPC_ROUNDING 1.2582913e+07f"),
    "no lower clamp of a move": ("larger(move_rad - rprop->step_rad, -limit_rad)", "move_rad - rprop->step_rad"),
    "no backtracking": ("        next_rad = rprop->previous_rad;\n", ""),
    "no first command": ("        self->command_rad[k] = (nmpc_real_t)0;\n", ""),
    "the target accelerates the other way": ("rollout->acceleration_m_step2 - target_acceleration_m_step2", "rollout->acceleration_m_step2 + target_acceleration_m_step2"),
    "x takes the target's acceleration along y": ("&prediction->x, self->tracker.acceleration_m_step2[0]", "&prediction->x, self->tracker.acceleration_m_step2[1]"),
    "the acceleration does not displace the target": (" - (NMPC_DISPLACEMENT_SHARE * target_acceleration_m_step2);", " - (nmpc_real_t)0;"),
    "the first velocity is an acceleration": ("(self->has_target != 0U) && ", ""),
    "a jump is an acceleration": ("&& (is_steady != 0)", ""),
    "a jump keeps the jerk": ("tracker->jerk_m_step2_update[axis] = (nmpc_real_t)0;\n        }", "}"),
    "the jerk is not predicted": ("tracker->acceleration_m_step2[axis] + tracker->jerk_m_step2_update[axis]", "tracker->acceleration_m_step2[axis]"),
    "the gains change places": ("(NMPC_TRACKER_JERK_GAIN * ", "(NMPC_TRACKER_GAIN * "),
    "the prediction counts in full": ("(NMPC_TRACKER_REST * predicted_m_step2)", "predicted_m_step2"),
    "rest and gain change places": ("(NMPC_TRACKER_GAIN * measured_m_step2)", "(NMPC_TRACKER_REST * measured_m_step2)"),
    "another rest": ("NMPC_TRACKER_REST 0.7f", "NMPC_TRACKER_REST 0.70000005f"),
    "another gain": ("NMPC_TRACKER_GAIN 0.3f", "NMPC_TRACKER_GAIN 0.30000004f"),
    "a reset remembers the target": ("    set_plan(self);\n    tracker_clear(self);", "    set_plan(self);"),
    "bad input gets a level command": ("    command->roll_rad = self->command_rad[0];", "    command->roll_rad = (status == NMPC_OK) ? self->command_rad[0] : (nmpc_real_t)0;"),
}  # fmt: skip
"""The one place in nmpc.c that reads so, and what it reads instead."""
QUICK = 3
"""So many faults of each method are tried in the default run, all of them in the long one."""
QUADRATIC_FAULTS = {
    "x and y change places": ("*right = (y * attitude->cosine) - (x", "*right = (x * attitude->cosine) - (y"),
    "no velocity of the target": ("- (NMPC_UPDATE_STEP_S * step->aim->velocity_m_s[axis])", "- (nmpc_real_t)0"),
    "the target accelerates the other way": ("error[2][axis] = error[2][axis] - self->tracker.", "error[2][axis] = error[2][axis] + self->tracker."),
    "the limits change places": ("most_m_step2 = self->bounds.command_m_step2[axis];", "most_m_step2 = self->bounds.command_m_step2[1 - axis];"),
    "one step less of outage": ("#define NMPC_NO_ESTIMATE (NMPC_OUTAGE_STEPS + 1U)", "#define NMPC_NO_ESTIMATE NMPC_OUTAGE_STEPS"),
    "rates over a gap": ("if (self->steps_blind == 0U) {", "if (self->steps_blind != NMPC_NO_ESTIMATE) {"),
    "no turn of the model": ("            attitude_turn(&self->attitude, sine, cosine, step->target != NULL);\n", "            self->attitude.sine = sine;\n            self->attitude.cosine = cosine;\n"),
    "a turn of the model after an outage": ("            self->attitude.sine = sine;\n            self->attitude.cosine = cosine;\n", "            attitude_turn(&self->attitude, sine, cosine, step->target != NULL);\n"),
    "a held command turns": ("sine, cosine, step->target != NULL)", "sine, cosine, 1)"),
    "a new command does not turn": ("sine, cosine, step->target != NULL)", "sine, cosine, 0)"),
    "a held command has rate feedback": ("    const int is_fed = (step->steps_blind < NMPC_NO_ESTIMATE) && (self->steps_blind == 0U);", "    const int is_fed = 0;"),
    "measured attitude": ("state[axis][4] = attitude->tilt_m_step2[axis];", "state[axis][4] = step->tilt_m_step2[axis];"),
    "no prediction in an outage": ("    observer_predict(&step->observer, step->world_m_step2);\n", "    if (step->state != NULL) { observer_predict(&step->observer, step->world_m_step2); }\n"),
    "a bad thrust allows a command": (
        "status = NMPC_BAD_THRUST;\n            good_target = NULL;",
        "status = NMPC_BAD_THRUST;",
    ),
    "a command of others leaves the model": ("    replace_command(self, self->command_rad, given_rad);\n", ""),
    "a command of others has no rate feedback": ("    replace_command(self, self->command_rad, given_rad);\n", "    attitude_set_command(&self->attitude, given_rad[0], given_rad[1]);\n"),
    "a change of pitch the same way as roll": ("-(NMPC_PITCH_GAIN_M_STEP2_RAD * pitch_change_rad)", "(NMPC_PITCH_GAIN_M_STEP2_RAD * pitch_change_rad)"),
    "a reset keeps the estimate": ("    self->steps_blind = NMPC_AT_REST;\n", ""),
    "a reset keeps the target": ("    observer_clear(&self->observer);\n    tracker_clear(self);\n", "    observer_clear(&self->observer);\n"),
    "no clamp of feedback": ("    step->command_rad[1] = limited_angle(self, step->command_rad[1]);\n", ""),
    "saturated to the right only": ("self->command_rad[0] <= angle_of_move(self, NMPC_RIGHT, -right_m_step2)", "0"),
    "saturated to the left only": ("self->command_rad[0] >= angle_of_move(self, NMPC_RIGHT, right_m_step2)", "0"),
    "saturated forward only": ("self->command_rad[1] >= angle_of_move(self, NMPC_FORWARD, -forward_m_step2)", "0"),
    "saturated backward only": ("self->command_rad[1] <= angle_of_move(self, NMPC_FORWARD, forward_m_step2)", "0"),
    "a command within the limit saturates": ("right_m_step2 = self->bounds.command_m_step2[NMPC_RIGHT];", "right_m_step2 = (nmpc_real_t)0.5 * self->bounds.command_m_step2[NMPC_RIGHT];"),
    "a move has no limit": ("return clamp(move_m_step2, limit_m_step2);", "return move_m_step2;"),
    "drag the other way": ("[axis] - (NMPC_DRAG_1_STEP", "[axis] + (NMPC_DRAG_1_STEP"),
    "no age of the velocity": ("+ (NMPC_AGE_STEPS * acceleration_m_step2)", "+ (nmpc_real_t)0"),
    "a start forgets the disturbance": ("NMPC_UPDATE_STEP_S * state->velocity_m_s[axis];\n    }", "NMPC_UPDATE_STEP_S * state->velocity_m_s[axis];\n        observer->disturbance_m_step2[axis] = (nmpc_real_t)0;\n    }"),
    "no limit of the disturbance": ("clamp(disturbance_m_step2, NMPC_DISTURBANCE_LIMIT_M_STEP2)", "clamp(disturbance_m_step2, (nmpc_real_t)1000)"),
    "pitch the same way as roll": ("attitude->command_m_step2[NMPC_FORWARD] = -forward_m_step2;", "attitude->command_m_step2[NMPC_FORWARD] = forward_m_step2;"),
    "no trim of roll": ("state->roll_rad - NMPC_ROLL_TRIM_RAD", "state->roll_rad"),
    "rows of the other axis": ("next(tilt_rows[axis], state)", "next(tilt_rows[1 - axis], state)"),
    "the tilt stays": ("    turn_vector(attitude->tilt_m_step2, sine_change, cosine_change);\n", ""),
    "the first move alone": ("move_m_step2 - (move_ratios[axis] * change_m_step2)", "move_m_step2"),
    "the ratio of the other axis": ("(move_ratios[axis] * change_m_step2)", "(move_ratios[1 - axis] * change_m_step2)"),
    "the second move has no limit": ("(within(second_m_step2, limit_m_step2) == 0)", "(0)"),
    "the second move is limited on one side": ("((second_m_step2 < (nmpc_real_t)0) ? -limit_m_step2 : limit_m_step2) - ", "limit_m_step2 - "),
    "the second move within its limit counts": ("(within(second_m_step2, limit_m_step2) == 0)", "(1)"),
    "command and lag change places": ("(lagged_rows[axis][0] * state[2]) + (lagged_rows[axis][1] * state[3])", "(lagged_rows[axis][1] * state[2]) + (lagged_rows[axis][0] * state[3])"),
    "the lag of the other axis": ("(lagged_rows[axis][1]", "(lagged_rows[1 - axis][1]"),
    "the jerk of x alone": ("self->tracker.jerk_m_step2_update[0], self->tracker.jerk_m_step2_update[1]", "self->tracker.jerk_m_step2_update[0], self->tracker.jerk_m_step2_update[0]"),
    "the model answers nothing": ("    attitude_advance(&self->attitude);\n", ""),
    "the model does not know its command": ("    attitude->command_m_step2[1] = move_m_step2[1];\n", ""),
    "a command without feedback": ("    step->command_rad[1] = step->command_rad[1] + step->feedback_rad[1];\n", ""),
    "an outage is not counted": ("        step->steps_blind = (unsigned int)self->steps_blind + 1U;\n", "        step->steps_blind = self->steps_blind;\n"),
    "an outage has an aim": ("(step->steps_blind < NMPC_NO_ESTIMATE) ? step->target : NULL", "step->target"),
    "the estimates are not stored": ("    self->observer = step->observer;\n", ""),
    "the outage is not stored": ("    self->steps_blind = (unsigned char)step->steps_blind;\n", ""),
}  # fmt: skip


class Bench:
    """Runs changed C of some settings through the same inputs as their reference."""

    def __init__(self, settings: Settings, n: int, steps: int) -> None:
        self._settings, self._n = settings, n
        self.files = render(settings, with_digest=False)
        self._inputs = inputs_of_steps(settings, n, steps, seed=0)
        self._expected = run(method_of(settings).reference_controller(n), self._inputs, seed=0)

    def differences(self, changed: dict[str, str]) -> dict[str, int]:
        """Build the C, without optimisation to save time, and count the values that differ in any bit."""
        library = load_library(self.files | changed, toolchain("gcc", "-O0"))
        found: Run = run(CompiledController(self._settings, self._n, library), self._inputs, seed=0)
        return differences(self._expected, found)


@pytest.mark.parametrize(
    ("settings", "faults"),
    [(BACKTRACKING, ONE_NORM_FAULTS), (EVERYTHING, QUADRATIC_FAULTS)],
    ids=["one_norm", "quadratic"],
)
def test_every_fault_has_its_place(settings: Settings, faults: dict[str, tuple[str, str]]) -> None:
    """The line that it changes is in the C, once: also of faults that are tried rarely."""
    text = render(settings, with_digest=False)[CONTROLLER]
    assert [fault for fault, (right, _) in faults.items() if text.count(right) != 1] == []


@pytest.fixture(scope="module")
def benches() -> dict[str, Bench]:
    """Run the references once for all faults."""
    return {"one_norm": Bench(BACKTRACKING, 400, 12), "quadratic": Bench(EVERYTHING, 100, 40)}


@pytest.mark.parametrize("method", ["one_norm", "quadratic"])
def test_the_generated_code_passes(method: str, benches: dict[str, Bench]) -> None:
    """Without a fault no bit differs."""
    assert benches[method].differences({}) == {}


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("method", "fault"),
    [
        pytest.param(method, fault, marks=[pytest.mark.long] * (index >= QUICK))
        for method, faults in (("one_norm", ONE_NORM_FAULTS), ("quadratic", QUADRATIC_FAULTS))
        for index, fault in enumerate(faults)
    ],
)
def test_a_fault_is_caught(method: str, fault: str, benches: dict[str, Bench]) -> None:
    """The faulty C compiles, and some bit differs."""
    bench, faults = benches[method], {"one_norm": ONE_NORM_FAULTS, "quadratic": QUADRATIC_FAULTS}[method]
    right, wrong = faults[fault]
    assert bench.files[CONTROLLER].count(right) == 1, "the template has changed: adapt the fault"
    assert bench.differences({CONTROLLER: bench.files[CONTROLLER].replace(right, wrong)}) != {}
