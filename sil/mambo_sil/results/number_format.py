"""Format of numbers in tables and pages."""

import math

_DASH = "\N{EN DASH}"


def digits(value: float) -> str:
    """Format a value with four significant digits, and one of 1000 or more as a whole number."""
    return f"{value:.0f}" if 1000 <= abs(value) < math.inf else f"{value:.4g}"


def three_digits(value: float) -> str:
    """Format a value with three significant digits, and one of 1000 or more as a whole number."""
    return f"{value:#.3g}".rstrip(".") if abs(value) < 1000 else f"{value:.0f}"


def digits_or_dash(value: float | None) -> str:
    """Format a value as `digits` does, and None, NaN and infinity as a dash."""
    return _DASH if value is None or not math.isfinite(value) else digits(value)


def three_digits_or_dash(value: float | None) -> str:
    """Format a value as `three_digits` does, and None, NaN and infinity as a dash."""
    return _DASH if value is None or not math.isfinite(value) else three_digits(value)


def fixed_or_dash(value: float, decimals: int) -> str:
    """Format a value with a number of decimals, and NaN and infinity as a dash."""
    return f"{value:.{decimals}f}" if math.isfinite(value) else _DASH
