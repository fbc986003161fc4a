"""The verification cases notice every small fault of the C, except those with a reason.

python -m tests.mutation.test_mutation   try every fault, print which go unnoticed without a reason
"""

import zlib
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.mutation.mutants import Mutant, mutants
from tests.mutation.mutation import FILES, Bench, Fate
from tests.mutation.reasons import is_explained, survivors
from tests.support.one_norm import ONE_NORM
from tests.support.subjects import subject
from tests.support.tools import require

REASONS = survivors("c_survivors.txt")
MAMBO, TRACKED = ONE_NORM, presets.load("mambo-1norm")
STRIDE: Final = 50
"""The test tries one fault in so many, others when the C changes; all of them take a quarter of an hour."""


def in_scalar(settings: Settings, scalar: str) -> Settings:
    """Return `settings` with another scalar type."""
    return with_option(settings, "code.scalar", scalar, "test")


def faults(text: str) -> set[str]:
    """Return the lines into which the mutants of some C turn its lines."""
    return {mutant.wrong_line for mutant in mutants("nmpc_x.c", text)}


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


def test_a_key_names_one_mutant_whatever_the_settings() -> None:
    """Keys of a file are unique, and real numbers are left out."""
    for name in FILES:
        keys = [mutant.key for mutant in mutants(name, render(MAMBO)[name])]
        assert len(set(keys)) == len(keys)
    assert mutants("a.h", "#define A 0.0f")[0].key == mutants("a.h", "#define A 0.0")[0].key


@pytest.mark.long
def test_mutants_meet_their_fate(tmp_path: Path) -> None:
    """Other bits, undefined behaviour, refused, or the same machine code; then the C is restored."""
    require("gcc", "gcc")
    bench = Bench(subject(MAMBO, tmp_path))
    for path, wrong, fate in (
        ("nmpc.c", "self->command_rad[1] = self->plan_rad[2];", Fate.OTHER_BITS),
        ("nmpc.h", "#define NMPC_POSITION_RANGE_M 1000.00006f", Fate.OTHER_BITS),
        ("nmpc.c", "for (k = 0; k <= NMPC_ANGLES; k++) {", Fate.UNDEFINED),
        ("nmpc.h", "#define NMPC_INSTANCE_BYTES 119", Fate.REFUSED),
        (
            "nmpc.h",
            "#define NMPC_UPDATE_PERIOD_S 0.010000001f "
            "/* for the caller: from one call of nmpc_step() to the next */",
            Fate.SAME,
        ),
    ):
        mutant = next(one for one in bench.mutants_of(path) if one.wrong_line == wrong)
        assert bench.fate(mutant) is fate, wrong
    assert bench.difference() is None


@pytest.mark.long
def test_every_reason_is_of_a_mutant_that_there_is() -> None:
    """A row whose line is gone is removed."""
    floats = (MAMBO, TRACKED, presets.load("table1"), in_scalar(MAMBO, "float64"))
    chosen = (*floats, *(in_scalar(settings, "fixed") for settings in floats[:3]))
    keys = {
        mutant.key
        for files in (render(settings, with_digest=False) for settings in chosen)
        for path in {file for file, _, _ in REASONS} & files.keys()
        for mutant in mutants(path, files[path])
    }
    assert REASONS.keys() <= keys


def unexplained(bench: Bench, tried: list[Mutant]) -> list[Mutant]:
    """Return the faults that go unnoticed without a reason."""
    unnoticed = bench.unnoticed(tried)
    found = [one for one in unnoticed if not is_explained(one.key, REASONS, bench.settings)]
    return [one for one in found if bench.fate(one) is Fate.SURVIVED]


@pytest.mark.long
@pytest.mark.parametrize("settings", [MAMBO, TRACKED], ids=["mambo", "mambo-1norm"])
@pytest.mark.parametrize("scalar", ["float32", "fixed"])
def test_a_fault_is_noticed_or_explained(tmp_path: Path, scalar: str, settings: Settings) -> None:
    """Without a target's acceleration and with it; the message has the survivors."""
    require("gcc", "gcc")
    its = subject(in_scalar(settings, scalar), tmp_path)
    bench = Bench(its)
    assert bench.difference() is None
    found = [mutant for path in FILES for mutant in bench.mutants_of(path)]
    keys = [mutant.key for mutant in found if mutant.file == "nmpc.c"]  # the same in every version
    tried = found[zlib.crc32(repr(keys).encode()) % STRIDE :: STRIDE]
    assert [one.key for one in unexplained(bench, tried)] == []


def main() -> None:
    """Try every fault of both settings in both scalar types."""
    for settings in (MAMBO, TRACKED):
        for scalar in ("float32", "fixed"):
            with TemporaryDirectory() as folder:
                bench = Bench(subject(in_scalar(settings, scalar), Path(folder)))
                tried = [mutant for path in FILES for mutant in bench.mutants_of(path)]
                for one in unexplained(bench, tried):
                    print(scalar, *one.key, one.wrong_line, flush=True)


if __name__ == "__main__":
    main()
