"""How numbers are spelled in tables and pages."""

import math

_DASH = "\N{EN DASH}"


def digits(value: float) -> str:
    """Spell a value with four digits, and a large one in full."""
    return f"{value:.0f}" if 1000 <= abs(value) < math.inf else f"{value:.4g}"


def three_digits(value: float) -> str:
    """Spell an index or a ratio with three digits, and a large one in full."""
    return f"{value:#.3g}".rstrip(".") if abs(value) < 1000 else f"{value:.0f}"


def digits_or_dash(value: float | None) -> str:
    """Spell a measured value with four digits, and what was not measured as a dash."""
    return _DASH if value is None or not math.isfinite(value) else digits(value)


def three_digits_or_dash(value: float | None) -> str:
    """Spell a ratio or a statistic with three digits, and what there is not as a dash."""
    return _DASH if value is None or not math.isfinite(value) else three_digits(value)


def fixed_or_dash(value: float, decimals: int) -> str:
    """Spell a value with so many decimals, and what is not a number as a dash."""
    return f"{value:.{decimals}f}" if math.isfinite(value) else _DASH
