"""The kernel is plain C: a compiler reads a chapter as it stands, and Jinja hands out the same lines."""

import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import jinja2
import numpy as np
import pytest

from mambo_codegen.bundle.flags import COMPILE_FLAGS, WARNING_FLAGS
from mambo_codegen.bundle.kernel import with_head, with_tags
from mambo_codegen.bundle.render import render
from mambo_codegen.methods import method_of
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from tests.support.bundles import place
from tests.support.cases import settings_case
from tests.support.height import HEIGHT_CORNERS, height_case
from tests.support.height_settings import height_settings
from tests.support.kernel import CHAPTERS, as_it_stands, defines, parts_of
from tests.support.quadratic import CORNER_SETTINGS, ONE_MOVE, TWO_MOVES, quadratic_case, settings_of
from tests.support.tools import require, require_file

SHAPES: dict[str, Settings] = {
    "mambo": presets.preset("mambo"),
    "all options": with_option(height_case(6, "float32"), "observer.tilt_gain", "learnt"),
    "fixed": height_case(4, "fixed"),
    "double": settings_of(TWO_MOVES | {"observer.tilt_gain": "learnt", "code.scalar": "float64"}),
    "least": settings_of(ONE_MOVE),
    "old and trimmed": with_option(
        with_option(
            with_option(height_settings(learnt="acceleration"), "observer.measurement_age_s", 0.02),
            "model.roll_trim_rad",
            0.01,
        ),
        "model.pitch_trim_rad",
        -0.02,
    ),
    "height": height_settings(),
    "table1": presets.preset("table1"),
    "1-norm": presets.preset("mambo-1norm"),
    "1-norm fixed": settings_case(0, "fixed"),
    "1-norm long": settings_case(3, "float64"),
    "1-norm hover": with_option(settings_case(6, "float32"), "model.thrust", "hover"),
}
"""Shapes of either method that every condition on its parts divides; one has none of the parts."""
MANY = [
    *(pytest.param("gcc", settings, id=f"gcc {name}") for name, settings in SHAPES.items()),
    *(
        pytest.param(compiler, case(index, scalar), marks=[pytest.mark.long, pytest.mark.thorough])
        for compiler in ("gcc", "clang")
        for case, count in (
            (quadratic_case, len(CORNER_SETTINGS)),
            (height_case, len(HEIGHT_CORNERS)),
            (settings_case, 20),
        )
        for index in range(count)
        for scalar in ("float32", "float64", "fixed")
    ),
]
CONDITION = r"(?:not )?WITH_\w+(?: (?:and|or) (?:not )?WITH_\w+)*"
MAIN = """
#include <stdio.h>
#include "nmpc_self_test.h"
int main(void)
{
    static nmpc_t controller;
    unsigned long digest = 0UL;
    int episode;

    for (episode = 0; episode < NMPC_SELF_TEST_EPISODES; episode++) {
        digest = nmpc_self_test_episode(&controller, episode, digest);
    }
    printf("%s", (digest == NMPC_SELF_TEST_DIGEST) ? "same bits" : "other bits");
    return nmpc_self_test(&controller);
}
"""


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("compiler", "settings"), MANY)
def test_a_compiler_reads_the_kernel_as_it_stands(compiler: str, settings: Settings, tmp_path: Path) -> None:
    """Beside header and other chapters of a shape, without a word, with the bits of the reference."""
    settings = with_option(settings, "code.prefix", "nmpc")
    place(as_it_stands(settings) | {"main.c": MAIN}, tmp_path)
    flags = [*COMPILE_FLAGS, *WARNING_FLAGS, "-Werror", *defines(parts_of(settings))]
    line = [require(compiler, compiler), *flags, "nmpc.c", "nmpc_self_test.c", "main.c", "-o", "main"]
    subprocess.run(line, cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True)
    assert done.stdout == "same bits"


def test_the_shapes_divide_every_condition() -> None:
    """Each part is there in one of them, and absent from another."""
    found: dict[str, set[bool]] = {}
    for settings in SHAPES.values():
        for name, is_there in parts_of(settings).items():
            found.setdefault(name, set()).add(is_there)
    assert [name for name, values in found.items() if len(values) == 1] == []


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda path: f"{path.parent.name} {path.stem}")
def test_a_chapter_has_no_hole_and_bare_conditions(chapter: Path) -> None:
    """C and Jinja read them alike: `not A == B`, a call or a bracket they would not."""
    text = chapter.read_text("utf-8")
    assert re.search(r"\{\{|\{%|\{#", text) is None
    lines = [line for line in text.splitlines() if "WITH_" in line]
    assert [line for line in lines if re.fullmatch(rf"#(?:if|elif) {CONDITION}", line) is None] == []


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda path: f"{path.parent.name} {path.stem}")
def test_a_chapter_has_the_layout_of_clang_format(chapter: Path) -> None:
    """What an editor that formats as it saves would leave."""
    formatter = require_file(Path(sys.executable).with_name("clang-format"), "pip install clang-format")
    done = subprocess.run([formatter, "--style=file", chapter], capture_output=True, text=True, check=True)
    assert done.stdout == chapter.read_text("utf-8")


def kept(text: str, parts: Mapping[str, bool]) -> str:
    """Return what gcc's preprocessor keeps of a chapter, without blanks."""
    line = [require("gcc", "gcc"), "-E", "-P", *defines(dict(parts)), "-"]
    done = subprocess.run(line, input=text, capture_output=True, text=True, check=True)
    return "".join(done.stdout.split())


@pytest.mark.sampled(3)
@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda path: f"{path.parent.name} {path.stem}")
def test_jinja_and_the_preprocessor_keep_the_same_lines(chapter: Path) -> None:
    """With any parts, together or not."""
    text, rng = re.sub(r'#include ".*\n', "", chapter.read_text("utf-8")), np.random.default_rng(0)
    names = sorted(set(re.findall(r"WITH_\w+", text)))
    template = jinja2.Environment(trim_blocks=True, undefined=jinja2.StrictUndefined).from_string(
        with_tags(text)
    )
    for draw in rng.random((20, len(names))) < rng.random((20, 1)):
        parts = dict(zip(names, draw.tolist(), strict=True))
        found = template.render(parts)
        assert "WITH_" not in found
        assert kept(found, {}) == kept(text, parts)


def test_only_conditions_on_parts_become_tags() -> None:
    """Every other directive is the user's, also within a part, and each line keeps its number."""
    text = (
        "#if WITH_GUARD and not WITH_FIXED\n#if defined(__AVR__)\nint avr;\n#else\nint other;\n#endif\n"
        "#elif WITH_FIXED\n#define WITHOUT 1\n#else\n# ifdef __cplusplus\n# endif\n#endif\n"
    )
    expected = (
        "{% if WITH_GUARD and not WITH_FIXED %}\n#if defined(__AVR__)\nint avr;\n#else\nint other;\n#endif\n"
        "{% elif WITH_FIXED %}\n#define WITHOUT 1\n{% else %}\n# ifdef __cplusplus\n# endif\n{% endif %}\n"
    )
    assert with_tags(text) == expected


def test_an_include_of_a_chapter_becomes_the_template_of_its_constants() -> None:
    """That of the same folder; a header of C stays."""
    text = '#include <stddef.h>\n#include "limits.h"\n'
    assert with_head(text, "common") == '#include <stddef.h>\n{% include "common/limits.h.j2" %}\n'


@pytest.mark.parametrize("settings", SHAPES.values(), ids=SHAPES)
def test_a_bundle_has_no_condition_and_no_line_of_the_kernel_is_too_long(settings: Settings) -> None:
    """And in floating point no product is a call."""
    text = render(with_option(settings, "code.prefix", "nmpc"), with_digest=False)["nmpc.c"]
    assert "WITH_" not in text
    folders = ("common", method_of(settings).folder)
    headings = [path.read_text("utf-8").split("\n")[0] for path in CHAPTERS if path.parent.name in folders]
    begins = [text.index(heading) for heading in headings if heading in text]
    chapters = "".join(text[begin:].partition("\n/* ---- ")[0] for begin in begins)
    assert max(map(len, chapters.splitlines())) <= 120
    assert ("_product(" in chapters) == (method_of(settings).numbers.formats is not None)


@pytest.mark.parametrize("settings", SHAPES.values(), ids=SHAPES)
def test_the_index_has_the_headings_of_the_chapters(settings: Settings) -> None:
    """In their order."""
    text = render(settings, with_digest=False)["nmpc.c"]
    index = [line[5:23].strip() for line in text.partition("*/")[0].splitlines() if line.startswith(" *   ")]
    assert index == [one.lower() for one in re.findall(r"^/\* ---- (.+?) -+$", text, re.MULTILINE)]
