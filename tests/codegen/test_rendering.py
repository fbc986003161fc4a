"""Products with operators; the cache of templates, which never changes what is rendered."""

from pathlib import Path

import jinja2
import pytest

from mambo_codegen.bundle.products import infix
from mambo_codegen.bundle.template_cache import TemplateCache


@pytest.mark.parametrize(
    ("kernel", "expected"),
    [
        ("a = gain_product(b, c);", "a = b * c;"),
        ("return sine_product(y, c) - sine_product(x, s);", "return (y * c) - (x * s);"),
        ("a = tilt_product(GAIN, roll - TRIM);", "a = GAIN * (roll - TRIM);"),
        ("f(factor_product(a, share(&b, axis)), -halved(c));", "f(a * share(&b, axis), -(NMPC_HALF * c));"),
        ("a = sine_product(x, sine_product(y, z));", "a = x * (y * z);"),
        ("if (squared(a) <= squared(b)) {", "if ((a * a) <= (b * b)) {"),
        ("a = (b < c) ? gain_product(b, d) : c;", "a = (b < c) ? (b * d) : c;"),
        ("a[k] = to_move(spare(b, c)) + row_sum(d);", "a[k] = spare(b, c) + d;"),
        ("a = sine_sum(\n    a, b,\n    c, d);", "a = (a * b) + (c * d);"),
        ("{ gain_product(a, b), gain_product(c, d) }", "{ a * b, c * d }"),
    ],
)
def test_calls_of_products_are_written_with_operators(kernel: str, expected: str) -> None:
    """With brackets round operands alone, whether what calls it has one or several lines."""
    assert infix(f"{kernel}\n") == f"{expected}\n"


def test_what_is_no_product_stays() -> None:
    """Names that only contain one, declarations, comments, and lines that are long for other reasons."""
    text = f"my_gain_products(a, b); /* gain_product */\n/* {'x' * 150} */\n"
    assert infix(text) == text


def test_a_call_that_does_not_end_is_an_error() -> None:
    """The message has what stands there."""
    with pytest.raises(ValueError, match=r"a call that does not end: a, b;"):
        infix("gain_product(a, b;\n")


def test_a_line_that_is_too_long_with_operators_is_wrapped() -> None:
    """Before the operator outside of most brackets, or behind a comma, below what it goes on with."""
    name = "position_of_a_very_long_name_m"
    assert infix(
        f"    error[axis] = squared({name}_a) + squared({name}_b) - gain_product({name}, {name});\n"
    ) == (
        f"    error[axis] = ({name}_a * {name}_a)\n"
        f"                  + ({name}_b * {name}_b)\n"
        f"                  - ({name} * {name});\n"
    )
    assert infix(f"    call_it({name}, squared({name}), squared({name}));\n") == (
        f"    call_it({name}, {name} * {name},\n            {name} * {name});\n"
    )


def rendered(text: str) -> str:
    """Render a template in a new environment, which knows no template yet."""
    loader = jinja2.DictLoader({"one.j2": text})
    return (
        jinja2.Environment(loader=loader, bytecode_cache=TemplateCache()).get_template("one.j2").render(x=3)
    )


def test_a_template_is_compiled_once(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Then its code comes from the cache; a changed text is compiled again."""
    assert rendered("{{ x + 1 }}") == "4"
    assert len(list((empty_cache / "templates").iterdir())) == 1
    with monkeypatch.context() as patch:
        patch.setattr(jinja2.Environment, "compile", None)
        assert rendered("{{ x + 1 }}") == "4"
    assert rendered("{{ x + 2 }}") == "5"
