"""Floating point shows its products as plain C, in the order of the calls."""

import pytest

from mambo_codegen.bundle.infix import infix


@pytest.mark.parametrize(
    ("call", "plain"),
    [
        ("a = nmpc_gain_product(b[0], c);", "a = b[0] * c;"),
        ("a = -nmpc_gain_product(b, c);", "a = -(b * c);"),
        ("a = b + nmpc_share_product(c, d);", "a = b + (c * d);"),
        ("f(nmpc_step_product(b, c), d);", "f(b * c, d);"),
        ("return nmpc_sine_product(b, nmpc_sine_product(c, d));", "return b * (c * d);"),
        ("return nmpc_sine_product(b, c + d);", "return b * (c + d);"),
        ("a = nmpc_distance_gradient(b, c,\n    d, e);", "a = (b * c) + (d * e);"),
        ("a = -nmpc_effort_gradient(b.c);", "a = -b.c;"),
        ("a = nmpc_clamp(b, c);", "a = nmpc_clamp(b, c);"),
    ],
)
def test_a_call_becomes_its_product(call: str, plain: str) -> None:
    """In brackets where it is part of an expression; other functions stay."""
    assert infix(call) == plain
