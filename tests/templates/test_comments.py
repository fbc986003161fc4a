"""Comments of generated C fit in 120 columns, whatever words the settings put into them."""

import pytest

from mambo_codegen.bundle.comments import LONGEST, fitted
from mambo_codegen.bundle.render import render
from tests.support.options import OPTIONS

WORDS = " ".join(["word"] * 30)


def test_what_is_too_long_begins_the_next_line() -> None:
    """Of the same paragraph; before a formula, a list and the end it has a line of its own."""
    text = f"/* {WORDS}\n * and more.\n * {WORDS}\n *     a = b\n * {WORDS} */\nint a;\n"
    lines = fitted(text).split("\n")
    assert max(map(len, lines)) <= LONGEST
    assert " ".join(fitted(text).replace(" * ", " ").split()) == " ".join(text.replace(" * ", " ").split())
    assert lines[1].startswith(" * word word")
    assert lines[1].endswith("word and more.")
    assert " *     a = b" in lines
    assert [line for line in lines if line.endswith("*/")] == [lines[-3]]


def test_what_fits_stays() -> None:
    """Code is as it was, however long."""
    text = "/* A comment.\n *\n * Of two paragraphs. */\n" + "int a" + "a" * 200 + ";\n"
    assert fitted(text) == text


@pytest.mark.sampled(4)
@pytest.mark.parametrize("name", OPTIONS)
def test_no_comment_of_a_bundle_is_too_long(name: str) -> None:
    """Of any option."""
    files = render(OPTIONS[name].settings, with_digest=False)
    lines = [line for path, text in files.items() if path.endswith((".c", ".h")) for line in text.split("\n")]
    long = [line for line in lines if len(line) > LONGEST and line.startswith((" * ", "/* "))]
    assert [line for line in long if not line.startswith(" *  ")] == []
