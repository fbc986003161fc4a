"""Mutants are made of every line, judged by bits, and none that survives goes unexplained."""

import json
from pathlib import Path

import pytest

from benchmarks.sign_decisions import ScalarName, in_scalar
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.sil.verify.check import Outcome
from tests.support import mutation
from tests.support.mutants import Mutant, mutants
from tests.support.mutation import Bench, Fate, Judged, summary
from tests.support.mutation_reasons import REASONS
from tests.support.subjects import subject
from tests.support.tools import require


def faults(text: str) -> set[str]:
    """Return the lines into which the mutants of some C turn its lines."""
    return {mutant.wrong_line for mutant in mutants("src/nmpc_x.c", text, "nmpc")}


def in_function(line: str) -> set[str]:
    """Return the faults of a line in a function."""
    return faults(f"static void f(nmpc_t *self, int k)\n{{\n    {line}\n}}\n")


@pytest.mark.parametrize(
    ("line", "wrong"),
    [
        ("a = b + c;", {"a = b - c;", ";"}),
        ("a = -b * c;", {"a = b * c;", "a = -b + c;", ";"}),
        ("a += b;", {"a -= b;", ";"}),
        ("g(a[k]);", {"g(a[k + 1]);", "g(a[k - 1]);", ";"}),
        ("a[1] = b;", {"a[0] = b;", "a[2] = b;", ";"}),
        ("return (nmpc_real_t)2;", {"return (nmpc_real_t)1;", "return (nmpc_real_t)3;", ";"}),
        ("const int *a = &b[k];", {"const int *a = &b[k + 1];", "const int *a = &b[k - 1];"}),
        ("nmpc_real_t a[NMPC_MOVES];", set()),
        ("if (a && b) { }", {"if (!(a && b)) { }", "if (a || b) { }"}),
        ("if (!a) { }", {"if (!(!a)) { }", "if (a) { }"}),
        ("a = b <= c;", {"a = b < c;", "a = b > c;", ";"}),
        ("a = b == c;", {"a = b != c;", ";"}),
        ("a = 0.5f;", {"a = 0.50000006f;", "a = (-0.5f);", ";"}),
        ("a = 0.5;", {"a = 0.5000000000000001;", "a = (-0.5);", ";"}),
        ("a = 0U;", {"a = 1U;", ";"}),
        ("/* a + 1 */ g();", {"/* a + 1 */ ;"}),
        ('g("a + 1");', {";"}),
        ("#if A > 1\n#endif", set()),
        ("NMPC_UNROLL\n    for (;;) { g(); }", {"for (;;) { ; }"}),
        ("switch (k) { case 1U: g(); break; default: break; }", {
            "switch (k) { case 0U: g(); break; default: break; }",
            "switch (k) { case 2U: g(); break; default: break; }",
            "switch (k) { case 1U: ; break; default: break; }",
            "switch (k) { case 1U: g(); ; default: break; }",
            "switch (k) { case 1U: g(); break; default: ; }",
        }),
    ],
)  # fmt: skip
def test_every_small_fault_of_a_line_is_made(line: str, wrong: set[str]) -> None:
    """Operators, constants, indices, conditions, statements; nothing in a comment, a text, a declarator."""
    assert in_function(line) == wrong


def test_tables_and_macros_are_mutated_and_declarations_are_not() -> None:
    """A number outside of functions counts where it is a value."""
    assert faults("static const nmpc_real_t a[2] = { -0.5f, 3 };") == {
        "static const nmpc_real_t a[2] = { 0.5f, 3 };",
        "static const nmpc_real_t a[2] = { -0.5004883f, 3 };",
        "static const nmpc_real_t a[2] = { -(-0.5f), 3 };",
        "static const nmpc_real_t a[2] = { -0.5f, 2 };",
        "static const nmpc_real_t a[2] = { -0.5f, 4 };",
    }
    assert faults("#define A 1\n") == {"#define A 0", "#define A 2"}
    assert faults("typedef struct {\n    int a[2];\n} nmpc_t;\nint f(const int a[2]);\n") == set()
    assert faults('extern "C" {\nint f(void)\n{\n    g();\n}\n}\n') == {";"}


def test_keys_are_unique_and_know_neither_prefix_nor_real_numbers() -> None:
    """A reason holds for one mutant, whatever the name of the controller and its settings."""
    for name in ("src/nmpc.c", "src/nmpc_math.c", "include/nmpc_config.h"):
        text = render(presets.load("mambo"))[name]
        keys = [mutant.key for mutant in mutants(name, text, "nmpc")]
        assert len(set(keys)) == len(keys)
    (left,) = mutants("src/left_x.c", "#define LEFT_A 0.0f", "left")
    (plain,) = mutants("src/nmpc_x.c", "#define NMPC_A 0.0", "nmpc")
    assert left.key == plain.key


def some(path: str, wrong_line: str) -> Mutant:
    """Return the first mutant of preset mambo that makes a line wrong in this way."""
    made = mutants(path, render(presets.load("mambo"))[path], "nmpc")
    return next(mutant for mutant in made if mutant.wrong_line == wrong_line)


def test_mutants_meet_their_fate(tmp_path: Path) -> None:
    """Caught by bits or by sanitizers alone, refused, or the same after all; and the C is put right."""
    require("gcc", "gcc")
    bench = Bench(subject(presets.load("mambo"), tmp_path))
    assert bench.original_fault() is None
    for path, wrong, fate in (
        ("src/nmpc.c", "self->command_rad[1] = self->plan_rad[2];", Fate.KILLED),
        ("include/nmpc_config.h", "#define NMPC_POSITION_RANGE_M 1000.00006f", Fate.KILLED),
        ("src/nmpc.c", "for (k = 0; k <= NMPC_AXES; k++) {", Fate.WATCHED),
        ("include/nmpc_config.h", "#define NMPC_ITERATIONS 4", Fate.KILLED),
        ("include/nmpc_config.h", "#define NMPC_INSTANCE_BYTES 119", Fate.REFUSED),
        ("include/nmpc_config.h", "#define NMPC_UPDATE_PERIOD_S 0.010000001f", Fate.SAME),
    ):
        assert bench.judge(some(path, wrong)).fate is fate, wrong
    assert bench.original_fault() is None


def test_a_survivor_without_a_reason_fails_the_check(tmp_path: Path) -> None:
    """The evidence names it, and the file beside it has its diff and a row to paste."""
    made = subject(presets.load("mambo"), tmp_path)
    killed, survivor = mutants("src/nmpc.c", "#define A 1\n", "nmpc")
    result = summary(made, [Judged(killed, Fate.KILLED), Judged(survivor, Fate.SURVIVED)], {})
    assert result.outcome is Outcome.FAILED
    assert "src/nmpc.c:1: #define A 2" in result.evidence
    assert json.loads(json.dumps(result.figures)) == result.figures
    listed = (made.folder / "survivors.txt").read_text()
    assert "- #define A 1\n+ #define A 2\n" in listed
    assert "Reason(\n        'src/nmpc.c',\n        '#define A 1',\n        '1 -> 2',\n" in listed
    explained = [Judged(killed, Fate.KILLED), Judged(survivor, Fate.EXPLAINED, "A is not read")]
    assert summary(made, explained, {}).outcome is Outcome.PASSED


def test_unharmed_code_that_differs_is_not_mutated(tmp_path: Path) -> None:
    """Where the C is wrong to begin with, every mutant would count as caught."""
    require("gcc", "gcc")
    fault = (
        "src/nmpc.c",
        "self->command_rad[1] = self->plan_rad[1];",
        "self->command_rad[1] = self->plan_rad[0];",
    )
    result = mutation.check(subject(presets.load("mambo"), tmp_path, fault))
    assert result.outcome is Outcome.FAILED
    assert "the unharmed C" in result.evidence


def test_every_reason_is_of_a_mutant_that_there_is() -> None:
    """No row outlives the line that it explains."""
    mambo, table1 = presets.load("mambo"), presets.load("table1")
    fixed = (in_scalar(settings, "fixed") for settings in (mambo, table1))
    chosen = (mambo, table1, in_scalar(mambo, "float64"), *fixed)
    bundles = [render(settings, with_digest=False) for settings in chosen]
    keys = {
        mutant.key
        for files in bundles
        for path in {reason.file for reason in REASONS} & files.keys()
        for mutant in mutants(path, files[path], "nmpc")
    }
    assert {(reason.file, reason.line, reason.what) for reason in REASONS} <= keys


@pytest.mark.long
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_every_fault_is_caught_or_explained(tmp_path: Path, scalar: ScalarName) -> None:
    """All mutants of preset mambo."""
    require("gcc", "gcc")
    result = mutation.check(subject(in_scalar(presets.load("mambo"), scalar), tmp_path))
    assert result.outcome is Outcome.PASSED, result.evidence
    assert result.figures["mutants"] > 500


def test_without_gcc_the_check_is_incomplete(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It names what to install, and never passes."""
    made = subject(presets.load("mambo"), tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    result = mutation.check(made)
    assert result.outcome is Outcome.INCOMPLETE
    assert "Debian's package gcc" in result.evidence
