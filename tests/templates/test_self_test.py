"""The self-test names the first step with a wrong output; it notices a broken line of any function."""

import re
import subprocess
from pathlib import Path

import pytest

from mambo_codegen.bundle.episodes import null_calls
from mambo_codegen.bundle.render import render
from mambo_codegen.errors import BuildError
from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_codegen.toolchain import Toolchain
from tests.mutation.mutants import Mutant, mutants
from tests.mutation.schemata import can_share
from tests.mutation.self_test_bench import Noticed, SelfTestBench
from tests.support.bundles import place
from tests.support.height import EVERY_FUNCTION
from tests.support.one_norm import ONE_NORM
from tests.support.quadratic import EVERYTHING
from tests.support.tools import require

SELF_TEST = "nmpc_self_test.c"
CONTROLLER = "nmpc.c"
FLAGS = ("-std=c99", "-ffp-contract=off", "-w", "-I.")
SANITIZED = ("-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
RENAMED = ("-Dnmpc_step=wrong_step", "-Dnmpc_last_cost=wrong_last_cost")
OUTPUTS = 6
"""Status, two commands, cost, two gradients: the outputs that wrong_outputs.c makes wrong, one at a time."""
LIMIT_S = 20
_NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+(?:e-?\d+)?f)?(?!\w)")
_TABLE = re.compile(r"^ *static const nmpc_real_t (\w+)(?:\[\w*\])+ = \{(.*?)\};$", re.MULTILINE | re.DOTALL)
_ANGLES = {"sine_terms", "cosine_terms"}
_PLANE = {*_ANGLES, "tilt_rows", "integral_rows", "lagged_rows", "move_rows", "move_ratios", "observer_gains"}
_UNUSED = {"signs", "motion_limits", "motion_gains", "known_gains"}
_HEIGHT = {*_PLANE, "thrust_row", "thrust_lagged_row", "height_rows", "height_gains"}
_CRAZYFLIE, _MAMBO = presets.load("crazyflie"), presets.load("mambo")
TABLED = {
    "every function": (EVERY_FUNCTION, _HEIGHT),
    "crazyflie": (_CRAZYFLIE, _PLANE),
    "mambo": (_MAMBO, _PLANE),
    "table1": (presets.load("table1"), {*_ANGLES, "response_sum"}),
    "mambo-1norm": (presets.load("mambo-1norm"), {*_ANGLES, "response_sum"}),
    "crazyflie, fixed": (with_option(_CRAZYFLIE, "code.scalar", "fixed"), _PLANE),
    "mambo, fixed": (with_option(_MAMBO, "code.scalar", "fixed"), _PLANE),
}
"""Settings, and the tables that their C has."""
BREAKS = {
    "a limit above its range": ("between(limits->speed_m_s, NMPC", "between(limits->tilt_rad, NMPC"),
    "walls change places": ("(limits->fence_min_m[axis] < limits->fence_max_m[axis])", "(limits->fence_min_m[axis] > limits->fence_max_m[axis])"),
    "the fence's centre lies on a wall": ("bounds->centre_m[axis] = NMPC_HALF * (min_m + max_m)", "bounds->centre_m[axis] = NMPC_HALF * (min_m + min_m)"),
    "the knee is 3 % off": ("const nmpc_real_t knee_m = NMPC_KNEE_S2", "const nmpc_real_t knee_m = 1.03f * NMPC_KNEE_S2"),
    "no descent limit": ("    bounds->down_m = NMPC_REACH", "    bounds->up_m = NMPC_REACH"),
    "no speed towards a wall": ("limits_half_width(bounds, axis);\n        const nmpc_real_t place_m = limited", "bounds->margin_m;\n        const nmpc_real_t place_m = limited"),
    "no braking before a wall": ("most_m_s = braking_speed(braking_square(bounds, excess_m));", "most_m_s = braking_speed(bounds->braking_m_s2);"),
    "the wall behind": ("(towards < (nmpc_real_t)0) ? (nmpc_real_t)-1", "(towards > (nmpc_real_t)0) ? (nmpc_real_t)-1"),
    "a heading turns the long way": ("change_rad = (nmpc_sum_t)wanted_rad - previous_rad;", "change_rad = (nmpc_sum_t)previous_rad - wanted_rad;"),
    "a heading beyond its range": ("        next_rad = next_rad + NMPC_TURN_RAD;", "        next_rad = next_rad - NMPC_TURN_RAD;"),
    "a heading turns at once": ("        change_rad = -most_change_rad;", "        change_rad = change_rad;"),
    "a command set changes no pitch": ("    self->command_rad[1] = given_rad[1];\n    return NMPC_OK;", "    return NMPC_OK;"),
    "a thrust set is not limited": ("height->thrust_m_s2 = confine(thrust_m_s2, NMPC_THRUST_MIN_M_S2, NMPC_THRUST_MAX_M_S2);\n    height->command_m_step2", "height->thrust_m_s2 = thrust_m_s2;\n    height->command_m_step2"),
    "a bad thrust is set": ("if (is_good_thrust(thrust_m_s2) == 0) {", "if (is_good_thrust(thrust_m_s2) != 0) {"),
    "a shift does not move the height": ("    height_shift(&self->height, position_change_m[2], velocity_change_m_s[2]);\n", ""),
    "a shift turns the axes the other way": ("(sine_before * cosine) + (cosine_before * sine)", "(sine_before * cosine) - (cosine_before * sine)"),
    "a shift forgets the drag": ("+ (NMPC_DRAG_1_STEP * change_m_step)", "- (NMPC_DRAG_1_STEP * change_m_step)"),
    "a bad shift is made": ("        || (within(velocity_change_m_s[2], NMPC_VELOCITY_RANGE_M_S) == 0)\n", ""),
    "a reset keeps the tilt": ("        attitude->tilt_m_step2[axis] = attitude->command_m_step2[axis];\n", ""),
    "a reset keeps the budget": ("    self->budget_rad[1] = NMPC_TILT_BUDGET_RAD;\n", ""),
    "a reset is not clamped": ("limited.pitch_rad = clamp(command->pitch_rad, self->bounds.tilt_rad);", "limited.pitch_rad = command->pitch_rad;"),
    "coarse gains for a measured position": ("(is_measured != 0) ? 0U : 1U", "(is_measured != 0) ? 1U : 0U"),
    "an outage ends at once": ("        step->steps_blind = (unsigned int)self->steps_blind + 1U;", "        step->steps_blind = (unsigned int)self->steps_blind + 2U;"),
    "no rest after an outage": ("        step->steps_blind = NMPC_AT_REST;\n", ""),
    "an estimate without its unit": ("NMPC_STEPS_PER_S * self->observer.velocity_m_step[axis]", "NMPC_STEPS2_PER_S2 * self->observer.velocity_m_step[axis]"),
    "no estimate is valid": ("estimate->is_valid = has_estimate(self)", "estimate->is_valid = 0"),
    "a null target makes a step": ("if ((state != NULL) && (target != NULL)) {", "if (state != NULL) {"),
    "a new controller commands a tilt": ("command->pitch_rad = (nmpc_real_t)0;", "command->pitch_rad = (nmpc_real_t)1;"),
}  # fmt: skip
"""The one place in nmpc.c that reads so, and what it reads instead."""


class Bench:
    """Builds the self-test of a bundle, or a mutant of it, against the controller with wrong outputs."""

    def __init__(self, scalar: str, folder: Path) -> None:
        files = render(with_option(ONE_NORM, "code.scalar", scalar), with_digest=False)
        self.text = files[SELF_TEST]
        (steps,) = re.findall(r"#define NMPC_SELF_TEST_STEPS (\d+)", self.text)
        self.steps = int(steps)
        self._folder = place(files, folder / "controller")
        self._gcc = Toolchain((require("gcc", "gcc"),))
        program = Path(__file__).with_name("wrong_outputs.c")
        objects = [f"{number}.o" for number, _ in enumerate([CONTROLLER, program])]
        for source, name in zip([CONTROLLER, program], objects, strict=True):
            self._gcc.run([*FLAGS, *SANITIZED, "-c", str(source), "-o", name], self._folder)
        self._objects = objects

    def passes(self, mutant: Mutant | None = None) -> bool:
        """Whether each output, wrong in the first step, the last, or from the second on, is found there."""
        text = self.text if mutant is None else mutant.apply(self.text)
        (self._folder / SELF_TEST).write_text(text, "utf-8")
        line = [*FLAGS, *SANITIZED, *RENAMED, SELF_TEST, *self._objects, "-o", "wrong"]
        try:
            self._gcc.run(line, self._folder)
        except BuildError:
            return False
        last = self.steps - 1
        return all(
            self._results(first, to) == [first + 1] * OUTPUTS
            for first, to in ((0, 0), (1, last), (last, last))
        )

    def _results(self, first: int, last: int) -> list[int] | None:
        """Return the result for each wrong output; None after a crash, or if the right controller fails."""
        line = [str(self._folder / "wrong"), str(first), str(last)]
        try:
            done = subprocess.run(line, capture_output=True, text=True, check=True, timeout=LIMIT_S)
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired):
            return None
        right, *wrong = done.stdout.split()
        return [int(result) for result in wrong] if right == "0" and "?" not in done.stdout else None

    def mutants(self) -> list[Mutant]:
        """Return the mutants of the function nmpc_self_test."""
        start = self.text.index("int nmpc_self_test(nmpc_t *scratch)\n{")
        end = self.text.index("\n}\n", start)
        return [mutant for mutant in mutants(SELF_TEST, self.text) if start < mutant.start < end]


@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", ["float32", "float64", "fixed"])
def test_the_first_step_with_a_wrong_output_is_named(scalar: str, tmp_path: Path) -> None:
    """Status, roll, pitch, cost and both gradients, each alone; 0 for the right controller."""
    assert Bench(scalar, tmp_path).passes()


@pytest.mark.sampled(2)
@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_every_fault_of_the_comparisons_is_noticed(scalar: str, tmp_path: Path) -> None:
    """All mutants of the function; the message has the lines of those that survive."""
    bench = Bench(scalar, tmp_path)
    found = bench.mutants()
    assert len(found) > 10
    assert [mutant.wrong_line for mutant in found if bench.passes(mutant)] == []


def change(text: str, start: int, right: str, wrong: str, name: str) -> Mutant:
    """Return the fault that makes `right` at `start` read `wrong`."""
    assert text.startswith(right, start)
    return Mutant(CONTROLLER, start, start + len(right), wrong, (CONTROLLER, right, name), name)


def test_the_self_test_notices_a_broken_line_of_every_function(tmp_path: Path) -> None:
    """What sets limits, shifts the frame, takes over, turns a heading or ends an outage."""
    bench = SelfTestBench(EVERY_FUNCTION, tmp_path)
    text = bench.files[CONTROLLER]
    assert {name: text.count(right) for name, (right, _) in BREAKS.items()} == dict.fromkeys(BREAKS, 1)
    lines = [change(text, text.index(right), right, wrong, name) for name, (right, wrong) in BREAKS.items()]
    noticed = bench.noticed(lines)
    assert len(noticed) == len(lines)
    assert [one.wrong_line for one, by in noticed.items() if by is Noticed.NEVER] == []


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", TABLED)
def test_the_self_test_at_start_up_uses_every_number_of_every_table(name: str, tmp_path: Path) -> None:
    """Each number of the tables of trigonometry, attitude, observer, thrust and solution, 3 % larger.

    A start-up of seconds does not use the rows of the target's observer for every length of memory.
    """
    settings, tables = TABLED[name]
    bench = SelfTestBench(settings, tmp_path)
    text = bench.files[CONTROLLER]
    found = [table for table in _TABLE.finditer(text) if table[1] not in _UNUSED]
    assert {table[1] for table in found} == tables
    lines = [
        change(text, number.start(), number[0], _larger(number[0]), f"{table[1]}: {number[0]}")
        for table in found
        for number in _NUMBER.finditer(text, *table.span(2))
        if float(number[0].rstrip("f")) != 0
    ]
    noticed = bench.noticed(lines)
    assert len(noticed) == len(lines)
    assert [one.wrong_line for one, by in noticed.items() if by is not Noticed.AT_START_UP] == []


def _larger(number: str) -> str:
    """Return C for a number 3 % larger."""
    return f"({number} * 1.03f)" if "." in number else f"({number} + ({number} / 32) + 1)"


@pytest.mark.long
@pytest.mark.parametrize("settings", [EVERY_FUNCTION, EVERYTHING], ids=["height", "plane"])
def test_the_self_test_notices_a_wrong_sign_anywhere(settings: Settings, tmp_path: Path) -> None:
    """Each plus made a minus and the other way round, from the attitude model to the interface."""
    bench = SelfTestBench(settings, tmp_path)
    text = bench.files[CONTROLLER]
    start = text.index("/* ---- Attitude")
    lines = [
        mutant
        for mutant in mutants(CONTROLLER, text)
        if {text[mutant.start : mutant.end].strip(), mutant.wrong.strip()} == {"+", "-"}
        and mutant.start > start
        and can_share(text, mutant)
    ]
    assert len(lines) > 60
    assert [one.wrong_line for one, by in bench.noticed(lines).items() if by is Noticed.NEVER] == []


def test_the_reference_knows_how_many_calls_have_null_pointers() -> None:
    """The sum of their statuses is a word of the digest."""
    for settings in (EVERY_FUNCTION, EVERYTHING, ONE_NORM):
        text = render(settings, with_digest=False)[SELF_TEST]
        assert text.count("    refused += (unsigned long)nmpc_") == null_calls(method_of(settings))
