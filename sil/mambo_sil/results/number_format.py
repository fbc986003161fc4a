"""Format of numbers in tables and pages."""

import math

_DASH = "\N{EN DASH}"


def digits(value: float | None) -> str:
    """Format a value with four significant digits, and one of 1000 or more as a whole number."""
    if value is None:
        return "-"
    return f"{value:.0f}" if 1000 <= abs(value) < math.inf else f"{value:.4g}"


def three_digits(value: float | None) -> str:
    """Format a value with three significant digits, from 1000 on as a whole number; a dash if not finite."""
    if value is None or not math.isfinite(value):
        return _DASH
    return f"{value:#.3g}".rstrip(".") if abs(value) < 1000 else f"{value:.0f}"


def distance(value_m: float) -> str:
    """Format a distance in cm with two significant digits, in m from 1 m on."""
    if not math.isfinite(value_m):
        return _DASH
    value, unit = (value_m, "m") if abs(value_m) >= 0.995 else (100.0 * value_m, "cm")
    return f"{float(f'{value:.2g}'):g} {unit}" if value else f"0 {unit}"
