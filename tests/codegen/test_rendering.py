"""What templates write for a product; the cache of templates, which never changes what is rendered."""

from pathlib import Path

import jinja2
import pytest

from mambo_codegen.bundle.products import products, term
from mambo_codegen.bundle.template_cache import TemplateCache

FLOAT, FIXED = products(fixed=False), products(fixed=True)


def test_a_product_is_infix_in_floating_point_and_a_call_in_fixed_point() -> None:
    """With brackets round a factor that is an expression, and round a product within another."""
    assert FLOAT["gain_product"]("gain[0]", "-tilt_rad") == "gain[0] * -tilt_rad"
    assert FLOAT["tilt_product"]("GAIN", "roll_rad - TRIM") == "GAIN * (roll_rad - TRIM)"
    nested = [("rest", write["sine_product"]("square", "sine")) for write in (FLOAT, FIXED)]
    assert FLOAT["sine_product"](*nested[0]) == "rest * (square * sine)"
    assert FIXED["sine_product"](*nested[1]) == "sine_product(rest, sine_product(square, sine))"


@pytest.mark.parametrize(
    ("product", "operand"),
    [
        (FLOAT["gain_product"]("a", "b"), "(a * b)"),
        (FLOAT["sine_sum"]("a", "b", "c", "d"), "((a * b) + (c * d))"),
        (FLOAT["row_sum"]("sum"), "sum"),
        (FIXED["gain_product"]("a", "b"), "gain_product(a, b)"),
    ],
)
def test_an_operand_has_brackets_only_if_it_is_infix(product: str, operand: str) -> None:
    """A call, and a value that is written alone, need none."""
    assert term(product) == operand


def test_an_acceleration_is_weighed_only_if_something_weighs_it() -> None:
    """With a height it is times a weight, or over it, which is times the inverse; else it stays alone."""
    assert products(fixed=False, weighs=True)["weighed"]("limit") == "limit * weight"
    assert products(fixed=True, weighs=True)["over_weight"]("move") == "factor_product(move, inverse)"
    assert FLOAT["weighed"]("limit") == FIXED["over_weight"]("limit") == "limit"


def test_an_acceleration_has_a_learnt_gain_only_if_one_is_learnt() -> None:
    """Then it is times the share of the gain of its axis, as an operand if it is weighed too."""
    write = products(fixed=False, weighs=True, learns=True)
    gained = write["gained"]("limit", "RIGHT")
    assert gained == "limit * (tilt_gain_share(learnt, RIGHT))"
    assert write["weighed"](gained) == "(limit * (tilt_gain_share(learnt, RIGHT))) * weight"
    assert FLOAT["gained"]("limit", "RIGHT") == FIXED["gained"]("limit", "RIGHT") == "limit"


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
