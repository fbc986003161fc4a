"""Products as templates write them: `a * b` in floating point, the call of a function in fixed point."""

import pytest

from mambo_codegen.bundle.products import products, term

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
