"""Quantiles of drawn parameters: every bit, against integrals and powers in more digits."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest

from mambo_sil.experiment.campaign.distributions import Distribution, Domain, parse

DIGITS = 85
PI = Decimal("3.141592653589793238462643383279502884197169399375105820974944592307816406286208998628034825")
LEAST_SHARE = Decimal("1e-16")
STANDARD = parse({"normal": [0.0, 1.0]}, Domain(-1e3, 1e3))
UPPER_HALF = parse({"normal": [0.0, 1.0]}, Domain(0.0, 1e3))
LOWER_HALF = parse({"normal": [0.0, 1.0]}, Domain(-1e3, 0.0))
RANDOM = np.random.default_rng(0)


def share_below(z: Decimal) -> Decimal:
    """Return the integral of the standard normal density up to z, by its Taylor series about 0."""
    total, term, count = Decimal(0), z, 0
    while total + term / (2 * count + 1) != total:
        total, count = total + term / (2 * count + 1), count + 1
        term *= -z * z / (2 * count)
    return Decimal("0.5") + total / (2 * PI).sqrt()


def assert_is_quantile(found: float, share: Decimal) -> None:
    """Assert that `found` is the float64 nearest to the quantile of `share`."""
    with localcontext() as context:
        context.prec = DIGITS
        least, most = (
            share_below((Decimal(found) + Decimal(math.nextafter(found, side))) / 2)
            for side in (-math.inf, math.inf)
        )
        assert least <= share <= most, f"{found!r} is not the quantile of {share}"


TAILS = [2.0**-exponent for exponent in range(2, 54)] + [1e-16, 1e-15, 3e-14, 1e-3, 0.025, 0.3]
SHARES = [*TAILS, *(1.0 - tail for tail in TAILS), 0.5, *RANDOM.random(50).tolist()]


@pytest.mark.parametrize("distribution", [STANDARD, UPPER_HALF, LOWER_HALF], ids=["whole", "upper", "lower"])
def test_the_quantile_of_a_normal_distribution_is_rounded_once(distribution: Distribution) -> None:
    """From tail to tail: whole, and of each half alone, whose shares have more digits than a float64."""
    below, width = {
        STANDARD: (Decimal(0), Decimal(1)),
        UPPER_HALF: (Decimal("0.5"), Decimal("0.5")),
        LOWER_HALF: (Decimal(0), Decimal("0.5")),
    }[distribution]
    for share in SHARES:
        with localcontext() as context:
            context.prec = DIGITS
            inner = below + width * Decimal(share)
            inner = min(max(inner, LEAST_SHARE), 1 - LEAST_SHARE)
        assert_is_quantile(distribution.quantile(share), inner)


@pytest.mark.parametrize(
    ("share", "expected"),
    [(0.975, 1.959963984540054), (0.995, 2.5758293035489004), (0.9, 1.2815515655446004), (0.5, 0.0)],
)
def test_the_quantiles_are_the_tabulated_ones(share: float, expected: float) -> None:
    """To the last digit but one, which the share's own rounding may change."""
    assert STANDARD.quantile(share) == pytest.approx(expected, rel=4e-16)
    assert STANDARD.quantile(1.0 - share) == pytest.approx(-expected, rel=4e-15)


def test_shares_beyond_the_farthest_tail_are_drawn_at_it() -> None:
    """A share of 0 has no finite quantile: 1e-16 takes its place, and its complement that of 1."""
    farthest = 8.222082216130435
    assert STANDARD.quantile(0.0) == STANDARD.quantile(1e-17) == -farthest
    assert UPPER_HALF.quantile(1.0 - 2.0**-53) == farthest


def test_a_truncated_normal_distribution_has_the_quantiles_of_its_part() -> None:
    """Mean 2 and deviation 0.5 within 1 .. 2.5: shares are those between -2 and 1 deviations."""
    cut = parse({"normal": [2.0, 0.5]}, Domain(1.0, 2.5))
    for share in [0.0, 1e-9, *RANDOM.random(20).tolist(), 1.0 - 1e-9]:
        with localcontext() as context:
            context.prec = DIGITS
            below, above = share_below(Decimal(-2)), share_below(Decimal(1))
            inner = below + Decimal(share) * (above - below)
            found = (Decimal(cut.quantile(share)) - 2) / Decimal("0.5")
            assert abs(share_below(found) - inner) < Decimal("1e-15")


def test_the_quantile_of_a_log_uniform_distribution_is_rounded_once() -> None:
    """It is low times (high / low) to the power of the share."""
    for low, high in ((0.5, 2.0), (1e-3, 7.0), (0.3, 0.3)):
        spread = parse({"log_uniform": [low, high]}, Domain(0.0, 10.0))
        for share in [0.0, 0.5, *RANDOM.random(100).tolist(), 1.0 - 2.0**-53]:
            with localcontext() as context:
                context.prec = DIGITS
                expected = float(Decimal(low) ** (1 - Decimal(share)) * Decimal(high) ** Decimal(share))
            assert spread.quantile(share) == expected


@pytest.mark.parametrize("written", [{"normal": [0.0, 1.0]}, {"log_uniform": [0.5, 2.0]}], ids=str)
def test_draws_do_not_depend_on_the_decimal_context(written: dict[str, list[float]]) -> None:
    """A caller's precision changes no bit."""
    distribution = parse(written, Domain(-1e3, 1e3))
    expected = distribution.quantile(0.3)
    with localcontext() as context:
        context.prec = 6
        assert distribution.quantile(0.3) == expected
