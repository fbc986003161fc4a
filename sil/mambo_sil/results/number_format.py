"""Format of numbers in tables and pages."""

import math

_DASH = "\N{EN DASH}"


def digits(value: float) -> str:
    """Format a value with four significant digits, and one of 1000 or more as a whole number."""
    return f"{value:.0f}" if 1000 <= abs(value) < math.inf else f"{value:.4g}"


def three_digits(value: float) -> str:
    """Format a value with three significant digits, and one of 1000 or more as a whole number."""
    return f"{value:#.3g}".rstrip(".") if abs(value) < 1000 else f"{value:.0f}"


def distance(value_m: float) -> str:
    """Format a distance in cm with two significant digits, in m from 1 m on."""
    if not math.isfinite(value_m):
        return _DASH
    value, unit = (value_m, "m") if abs(value_m) >= 0.995 else (100.0 * value_m, "cm")
    return f"{float(f'{value:.2g}'):g} {unit}" if value else f"0 {unit}"


def digits_or_dash(value: float | None) -> str:
    """Format a value as `digits` does, and None, NaN and infinity as a dash."""
    return _DASH if value is None or not math.isfinite(value) else digits(value)


def three_digits_or_dash(value: float | None) -> str:
    """Format a value as `three_digits` does, and None, NaN and infinity as a dash."""
    return _DASH if value is None or not math.isfinite(value) else three_digits(value)


def fixed_or_dash(value: float, decimals: int) -> str:
    """Format a value with a number of decimals, and NaN and infinity as a dash."""
    return f"{value:.{decimals}f}" if math.isfinite(value) else _DASH
