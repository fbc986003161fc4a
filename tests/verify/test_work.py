"""Constant work: what the reader of loops lets pass, what it does not, and what is counted in a step."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.codegen.toolchain import Toolchain
from mambo_nmpc.sil.verify import work
from mambo_nmpc.sil.verify.check import Outcome, Result, Subject
from mambo_nmpc.sil.verify.loops import Reading, read_loops, read_unit
from mambo_nmpc.sil.verify.passes import runs
from mambo_nmpc.sil.verify.work import Counted, judge
from tests.support.subjects import subject
from tests.support.tools import require

MAMBO = presets.load("mambo")
LOOP = "int f(int x)\n{\nint i;\nint sum = 0;\nfor (i = 0; i < 8; i++) {\nsum += x;\n}\nreturn sum;\n}\n"


def read(folder: Path, text: str, compiler: str = "gcc") -> Reading:
    """Read one file of C."""
    require(compiler, compiler)
    (folder / "a.c").write_text(text, "utf-8")
    return read_loops([read_unit("a.c", folder, Toolchain((compiler,)), folder)])


@pytest.mark.parametrize(
    ("head", "passes"),
    [
        ("i = 0; i < 8; i++", 8),
        ("i = 0; i <= 8; ++i", 9),
        ("i = 2; i < 9; i += 2", 4),
        ("i = 2; i < 10; i += 2", 4),
        ("i = (6 - 2); i >= 0; i--", 5),
        ("i = 9; i > 0; i -= 3", 3),
        ("i = 9; i >= 0; i -= 3", 4),
        ("i = -3; i < (2 * 3) % 4; i++", 5),
        ("i = 8; i < 8; i++", 0),
        ("i = 9; i <= 8; i++", 0),
        ("i = SIZE; i < SIZE * SIZE; i++", 6),
        ("i = 0; (x != 0) && (i < 8); i++", (0, 8)),
    ],
)
def test_passes_of_a_loop_are_those_of_python(
    tmp_path: Path, head: str, passes: int | tuple[int, int]
) -> None:
    """Every form that is allowed, counted by hand."""
    found = read(tmp_path, "#define SIZE 3\n" + LOOP.replace("i = 0; i < 8; i++", head))
    assert found.faults == ()
    assert list(found.trips.values()) == [passes if isinstance(passes, tuple) else (passes, passes)]


TWO_LOOPS = "for (i = 0; i < 3; i++) { } for (i = 0; i < 4; i++) { }"
FAULTS = {
    "a bound from data": ("i < 8", "i < x", "from a constant to a constant"),
    "a begin from data": ("i = 0", "i = x", "from a constant to a constant"),
    "a step from data": ("i++", "i += x", "from a constant to a constant"),
    "no step": ("i++", "", "from a constant to a constant"),
    "no end": ("i < 8", "", "go on while i"),
    "a second condition": ("i < 8", "(i < 8) && (sum < 9)", "go on while i"),
    "a second condition first": ("i < 8", "(sum < 9) && (i < 8)", "go on while i"),
    "a word that something is done to": ("i < 8", "(g(x) != 0) && (i < 8)", "go on while i"),
    "a word that has a certain value": ("i < 8", "(x != 1) && (i < 8)", "go on while i"),
    "an end by either of two": ("i < 8", "(x != 0) || (i < 8)", "go on while i"),
    "an end that may be missed": ("i < 8", "i != 8", "go on while i"),
    "away from its end": ("i++", "i--", "towards its end"),
    "another counter": ("i < 8", "x < 8", "go on while i"),
    "no begin": ("i = 0", "", "begin with counter"),
    "a counter of another type": ("int i;", "float i;", "must be a local int"),
    "a counter that wraps": ("int i;", "unsigned char i;", "must be a local int"),
    "a counter that lives on": ("int i;", "static int i;", "must be a local int"),
    "a counter that others write": ("int i;", "volatile int i;", "must be a local int"),
    "the argument as a counter": ("i = 0; i < 8; i++", "x = 0; x < 8; x++", "must be a local int"),
    "a written counter": ("sum += x;", "i = x;", "writes the counter"),
    "a skipping counter": ("sum += x;", "if (x) { i++; }", "may write the counter"),
    "a counter given away": ("sum += x;", "{ int *p = &i; *p = x; }", "may write the counter"),
    "a hidden counter": ("sum += x;", "{ int i = x; sum += i; }", "declares another"),
    "an inner loop of the same counter": ("sum += x;", "for (i = 0;\n i < 2; i++) { }", "writes the counter"),
    "a break": ("sum += x;", "if (x) { break; }", "by break"),
    "a break after a switch": ("sum += x;", "switch (x) { case 1: break; }\n if (x) { break; }", "by break"),
    "a return": ("sum += x;", "if (x) { return 1; }", "by return"),
    "a return from a switch": ("sum += x;", "switch (x) { case 1: return 1; }", "by return"),
    "a continue": ("sum += x;", "if (x) { continue; } sum++;", "by continue"),
    "a while": ("return sum;", "while (sum > x) { sum--; } return sum;", "by while"),
    "a do": ("return sum;", "do { sum--; } while (sum > x); return sum;", "by do"),
    "a goto": ("return sum;", "again: if (sum > x) { sum--; goto again; } return sum;", "by goto"),
    "recursion": ("sum += x;", "sum += f(x - 1);", "f calls itself"),
    "a library function": ("sum += x;", "sum += abs(x);", "does not define"),
    "a function pointer": ("int f(int x)", "int f(int x, int (*g)(int))", "does not define"),
    "two loops a line": ("sum += x;\n}", f"}} {TWO_LOOPS}", "on a line"),
}  # fmt: skip
"""What in LOOP becomes what, and what is said of it."""


@pytest.mark.parametrize("name", FAULTS)
def test_what_could_make_a_loop_run_otherwise_is_found(tmp_path: Path, name: str) -> None:
    """Each seeded fault alone, named with its line."""
    right, wrong, word = FAULTS[name]
    assert LOOP.count(right) == 1
    text = LOOP.replace(right, wrong)
    if name == "a function pointer":
        text = text.replace("sum += x;", "sum += g(x);")
    found = read(tmp_path, text)
    assert any(word in fault for fault in found.faults), found.faults
    assert all("a.c:" in fault for fault in found.faults if "calls itself" not in fault)


def test_recursion_through_others_is_found(tmp_path: Path) -> None:
    """Each function of the circle is named, and nobody else."""
    circle = "int f(int x); int g(int x) { return f(x); }\nint f(int x) { return g(x); }\n"
    text = circle + "int h(int x) { return g(x); }\n"
    assert read(tmp_path, text).faults == ("g calls itself", "f calls itself")


def test_a_switch_and_an_inner_loop_may_stand_in_a_loop(tmp_path: Path) -> None:
    """A break that leaves a switch leaves no loop."""
    body = "int k;\nfor (k = 0; k < 3; k++) {\nswitch (x) {\ncase 1: sum++;\nbreak;\ndefault: break;\n}\n}"
    found = read(tmp_path, LOOP.replace("sum += x;", body))
    assert found.faults == ()
    assert sorted(found.trips.values()) == [(3, 3), (8, 8)]


RUNS = """
static int one(int x) { return x; }
static int two(int x) { return one(x) + one(x); }
int f(int x)
{
    int i;
    int sum = 0;
    for (i = 0; i < 3; i++) {
        sum += (x > 0) ? two(x) : one(x);
        if ((x > 1) && (one(x) > 2)) {
            sum += one(x);
        } else {
            sum += two(x);
        }
    }
    if (x > 5) {
        return sum;
    }
    switch (x) {
    case 1: sum += two(x); break;
    default: break;
    }
    return one(sum);
}
"""


def test_runs_are_counted_over_every_way(tmp_path: Path) -> None:
    """Least and most of each function, by hand."""
    least, most = runs(read(tmp_path, RUNS), "f")
    assert (least["f"], least["two"], least["one"]) == (1, 0, 3 * (1 + 1))
    assert (most["f"], most["two"], most["one"]) == (1, 3 * 2 + 1, 3 * (2 + 1 + 2) + 2 + 1)
    assert [count for place, count in least.items() if "a.c" in place] == [3]


def test_a_loop_that_may_end_sooner_may_make_no_pass(tmp_path: Path) -> None:
    """What it calls runs as often as it makes a pass."""
    text = RUNS.replace("i = 0; i < 3", "i = 0; (x != 0) && (i < 3)")
    least, most = runs(read(tmp_path, text), "f")
    assert (least["one"], most["one"]) == (0, 3 * (2 + 1 + 2) + 2 + 1)
    assert [count for place, count in most.items() if "a.c" in place] == [3]


def test_operations_of_the_compiler_are_no_calls(tmp_path: Path) -> None:
    """Any other builtin is."""
    text = "int f(unsigned long x) { return __builtin_ctzl(x); }\n"
    assert read(tmp_path, text).faults == ()
    found = read(tmp_path, text.replace("ctzl", "popcountl"))
    assert ["does not define" in fault for fault in found.faults] == [True]


def checked(chosen: Subject) -> Result:
    """Check, and write the figures as JSON on the way."""
    require("cc", "gcc")
    found = work.check(chosen)
    json.dumps(found.figures, allow_nan=False)
    return found


def other(**sections: dict[str, Any]) -> Settings:
    """Return preset mambo with other keys."""
    document = MAMBO.model_dump()
    for section, keys in sections.items():
        document[section] |= keys
    return Settings.model_validate(document)


@pytest.mark.parametrize(
    "settings",
    [
        pytest.param(MAMBO, id="mambo"),
        pytest.param(
            other(code={"scalar": "float64", "prefix": "plan"}, optimizer={"variant": "irprop-"}),
            id="prefix plan",
            marks=pytest.mark.long,
        ),
        pytest.param(
            other(horizon={"prediction": 1, "control": 1}, optimizer={"iterations": 1}),
            id="shortest",
            marks=pytest.mark.long,
        ),
        pytest.param(
            other(horizon={"prediction": 7, "control": 7}, optimizer={"iterations": 4, "tolerance": 1e5}),
            id="soon at rest",
            marks=pytest.mark.long,
        ),
    ],
)
def test_the_generated_c_works_the_same_in_every_step(settings: Settings, tmp_path: Path) -> None:
    """Also with another prefix, at the corners of the horizon, and where the cost comes to rest at once."""
    found = checked(subject(settings, tmp_path))
    assert found.outcome is Outcome.PASSED, found.evidence
    assert f"{settings.optimizer.iterations} evaluations in each of" in found.evidence
    assert found.figures["accepted"] > 15_000
    assert found.figures["refused"] > 100
    assert found.figures["fewest_passes"] <= found.figures["most_passes"]


ITERATION = "for (iteration = 0; iteration < NMPC_ITERATIONS; iteration++) {"
OPTIMIZER = "src/nmpc_optimizer.c"
VIOLATIONS = {
    "it stops at rest": (
        OPTIMIZER,
        ITERATION,
        ITERATION.replace("NMPC_ITERATIONS;", "NMPC_ITERATIONS && self->converged == 0U;"),
        "go on while",
    ),
    "it breaks at rest": (
        OPTIMIZER,
        ITERATION,
        f"{ITERATION} if (self->converged != 0U) {{ break; }}",
        "by break",
    ),
    "it skips to the end": (
        OPTIMIZER,
        ITERATION,
        f"{ITERATION} if (self->converged != 0U) {{ iteration = NMPC_ITERATIONS; }}",
        "writes the counter",
    ),
    "one iteration too few": (
        OPTIMIZER,
        ITERATION,
        ITERATION.replace("iteration = 0", "iteration = 1"),
        "runs 4 to 4 times a step, not 5",
    ),
    "no search where the plan is at rest": (
        "src/nmpc.c",
        "        nmpc_optimizer_minimize(self);",
        "        if (state->position_m[0] != target->position_m[0]) { nmpc_optimizer_minimize(self); }",
        "nmpc_optimizer_minimize ran 0 to 1 times",
    ),
    "a search for nothing": (
        "src/nmpc.c",
        "    if (status == NMPC_OK) {",
        "    if (status != NMPC_NULL_POINTER) {",
        "ran in a refused step",
    ),
    "assembly": (OPTIMIZER, ITERATION, '__asm__("nop"); ' + ITERATION, "does not define"),
}


COUNTED_ONLY = {"no search where the plan is at rest", "a search for nothing"}


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.long] if name in COUNTED_ONLY else []) for name in VIOLATIONS],
)
def test_a_seeded_violation_fails_the_check(name: str, tmp_path: Path) -> None:
    """On the whole library, by what the source says or by what is counted."""
    path, right, wrong, word = VIOLATIONS[name]
    found = checked(subject(MAMBO, tmp_path, (path, right, wrong)))
    assert found.outcome is Outcome.FAILED
    assert word in found.evidence


COUNTED = """
int nmpc_cost_evaluate(int x) { return x; }
int nmpc_predictor_prepare(int x) { return x; }
int nmpc_optimizer_minimize(int x)
{
    int i;
    for (i = 0; i < 5; i++) {
        x = nmpc_cost_evaluate(x);
    }
    return x;
}
int nmpc_step(int x) { return (x > 0) ? nmpc_optimizer_minimize(nmpc_predictor_prepare(x)) : 0; }
"""
PLACES = ("nmpc_optimizer_minimize", "nmpc_predictor_prepare", "nmpc_cost_evaluate", "nmpc_step", "a.c:7")
GOOD, REFUSED = (1, 1, 5, 1, 5), (0, 0, 0, 1, 0)


@pytest.mark.parametrize(
    ("accepted", "refused", "same_bits", "word"),
    [
        (GOOD, REFUSED, True, "5 evaluations in each of 2"),
        (GOOD, REFUSED, False, "commands otherwise"),
        ((1, 1, 4, 1, 5), REFUSED, True, "nmpc_cost_evaluate ran 4 to 5 times"),
        ((1, 1, 5, 1, 6), REFUSED, True, "a.c:7 ran 5 to 6 times"),
        (GOOD, (0, 1, 0, 1, 0), True, "nmpc_predictor_prepare ran in a refused step"),
    ],
)
def test_counts_are_held_against_the_source(
    tmp_path: Path, accepted: Any, refused: Any, same_bits: bool, word: str
) -> None:
    """One step among good ones that counts otherwise is enough."""
    counts = np.array([GOOD, accepted, refused], np.uint32)
    counted = Counted(PLACES, np.array([True, True, False]), counts, same_bits)
    found = judge(read(tmp_path, COUNTED), counted, MAMBO)
    good = (accepted, refused, same_bits) == (GOOD, REFUSED, True)
    assert found.outcome is (Outcome.PASSED if good else Outcome.FAILED)
    assert word in found.evidence


def test_without_the_names_of_the_sub_blocks_nothing_is_said(tmp_path: Path) -> None:
    """A library whose search has another name cannot be judged."""
    reading = read(tmp_path, COUNTED.replace("optimizer_minimize", "optimizer_search"))
    found = judge(reading, Counted((), np.array([True]), np.zeros((1, 0), np.uint32), True), MAMBO)
    assert found.outcome is Outcome.INCOMPLETE
    assert "nmpc_optimizer_minimize" in found.evidence


def test_both_compilers_leave_the_same_loops(tmp_path: Path) -> None:
    """Standard headers included, which pycparser would not read as they are."""
    text = "#include <stdint.h>\n#include <string.h>\n" + LOOP
    assert read(tmp_path, text, "gcc").trips == read(tmp_path, text, "clang").trips == {"a.c:7": (8, 8)}
