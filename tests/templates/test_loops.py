"""Every loop of the generated C ends at a macro or literal, and no function calls itself."""

import re
from graphlib import CycleError, TopologicalSorter

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from tests.support.cases import SCALARS, settings_case
from tests.support.one_norm import ONE_NORM

NUMBER = r"\(?(?:NMPC_[A-Z_]+|\d+U?)(?: - \d+U?)?\)?"
STEPS = {"<": rf"\+\+|(?: \+= {NUMBER})", ">=": "--"}
"""How the counter changes in a loop with this comparison."""


def violations(files: dict[str, str]) -> list[str]:
    """Return what could make the work of the library's C unbounded."""
    texts = [text for path, text in files.items() if re.fullmatch(r"[^/]*\.[ch]", path)]
    code = re.sub(r"/\*.*?\*/|\"[^\"\n]*\"", "", "\n".join(texts), flags=re.DOTALL)
    macros = set(re.findall(r"^ *# *define (\w+)\(", code, re.MULTILINE))
    code = re.sub(r"^ *#(?:.*\\\n)*.*$", "", code, flags=re.MULTILINE)
    found = re.findall(r"\b(?:while|do|goto|continue|setjmp)\b", code)
    found += [loop[0] for loop in re.finditer(r"for \(([^{]*)\) \{", code) if not is_bounded(loop, code)]

    functions = re.findall(r"^[A-Za-z].*?\b(\w+)\([^;{}]*\)\n\{\n(.*?)^\}", code, re.MULTILINE | re.DOTALL)
    calls = {name: set(re.findall(r"\b(\w+)\(", body)) - macros for name, body in functions}
    known = calls.keys() | {
        "sizeof",
        "__builtin_ctzl",
        "__builtin_ctzll",
        "__builtin_fabs",
        "__builtin_fabsf",
    }
    found += [f"call of {name}" for name in set().union(*calls.values()) - known]
    try:
        TopologicalSorter(calls).prepare()
    except CycleError as error:
        found += error.args[1]
    return found


def is_bounded(loop: re.Match[str], code: str) -> bool:
    """Whether a loop counts from a number to a number, and nothing in its body changes that."""
    begin, test, step = loop[1].split("; ")
    counter = begin.partition(" = ")[0]
    counts = any(
        re.search(rf"^\(*{counter}(?: \+ 1U\))? {sign} {NUMBER}$", condition)
        and re.fullmatch(rf"{counter}(?:{change})", step)
        for condition in test.split(" && ")
        for sign, change in STEPS.items()
    )
    indent = re.search(r"[^\n]*$", code[: loop.start()])
    assert indent is not None
    body = code[loop.end() :].partition(f"\n{indent[0]}}}")[0]
    disturbed = re.search(
        rf"\b(?:break|return)\b|&{counter}\b|\b{counter} [-+*/]?= |\b{counter}(\+\+|--)", body
    )
    return bool(re.fullmatch(rf"{counter} = {NUMBER}", begin)) and counts and not disturbed


@pytest.mark.first_is_quick
@pytest.mark.parametrize("scalar", SCALARS)
def test_the_work_of_the_generated_c_is_bounded(scalar: str) -> None:
    """A preset of each method and corners of the horizon, in every scalar type."""
    quadratic = with_option(presets.load("mambo"), "code.scalar", scalar)
    for settings in (ONE_NORM, quadratic, *(settings_case(index, scalar) for index in (0, 1, 3))):
        files = render(settings, with_digest=False)
        assert sum(text.count("for (") for text in files.values()) > 15
        assert violations(files) == []


ITERATION = "for (iteration = 0; iteration < NMPC_ITERATIONS; iteration++) {"


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    "wrong",
    [
        ITERATION.replace("NMPC_ITERATIONS;", "self->iterations;"),
        ITERATION.replace("iteration = 0", "iteration = updates"),
        ITERATION.replace("iteration++", "iteration--"),
        f"{ITERATION} if (converged != 0) {{ break; }}",
        f"{ITERATION} if (converged != 0) {{ iteration = NMPC_ITERATIONS; }}",
        f"{ITERATION} while (converged != 0) {{ }}",
        f"{ITERATION} optimizer_minimize(self);",
        f"{ITERATION} usleep(1);",
    ],
)
def test_unbounded_work_is_found(wrong: str) -> None:
    """Each fault alone, in the loop of the search."""
    files = render(ONE_NORM, with_digest=False)
    path = "nmpc.c"
    assert files[path].count(ITERATION) == 1, "the template has changed: adapt the faults"
    assert violations(files | {path: files[path].replace(ITERATION, wrong)}) != []
