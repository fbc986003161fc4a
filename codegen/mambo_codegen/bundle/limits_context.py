"""What the templates of the limits insert."""

import math
from typing import Final

from mambo_codegen.methods.interface import Method
from mambo_codegen.methods.shared.limits import ActiveLimit
from mambo_codegen.methods.shared.limits_arithmetic import (
    FIXED_ITERATIONS,
    FIXED_START,
    ROOT_ERROR,
    STARTS,
    TERMS,
    TURN_BITS,
    limits_shifts,
)
from mambo_codegen.methods.shared.limits_constants import (
    LEAST_TURN_M2_S2,
    SPELLING,
    TURN_SHARE,
    stored_quantities,
)
from mambo_codegen.numbers import literals
from mambo_codegen.settings.fields import SMALLEST_LIMIT

LEAST_SQUARE: Final = 1e-9
"""In floating point every square whose root the C takes is at least this, m^2 or m^2/s^2."""


def limits_context(method: Method) -> dict[str, object]:
    """Return what the templates of the limits insert; nothing without limits."""
    limiting, numbers = method.limiting, method.numbers
    if limiting is None:
        return {}
    scalar = method.settings.code.scalar
    fixed = numbers.bits is not None
    start = (
        FIXED_START if fixed else f"0x{STARTS[numbers.scalar][1]:X}{'UL' if scalar == 'float32' else 'ULL'}"
    )
    stored = method.reference_controller().stored_limits[0].tolist()
    bounds = [str(number) if fixed else literals.real(float(number), scalar) for number in stored]
    others = bounds[len(stored_quantities()) :]
    return {
        "limit_bits": {limit.name: limit.value for limit in ActiveLimit},
        "smallest_limit": SMALLEST_LIMIT,
        "braking_slope": SPELLING * limiting.tilted.slope_m_s2_rad,
        "root_error": f"{ROOT_ERROR[scalar]:g}",
        "root_start": start,
        "root_iterations": FIXED_ITERATIONS,
        "root_terms": () if fixed else TERMS[numbers.scalar],
        "limits_shifts": limits_shifts(numbers.bits) if numbers.bits is not None else None,
        "default_bounds": bounds,
        "default_target_bounds": _target_bounds(method, others),
        "turning": limiting.turn_m_s_rad is not None,
        "turn_zeros": others[-3:],
        "turn_share": TURN_SHARE,
        "turn_bits": TURN_BITS,
        "least_turn": LEAST_TURN_M2_S2,
        "default_height_bounds": others[-4:],
        "outage_steps": method.outage_steps,
        "least_square": LEAST_SQUARE,
        "root_limit": 2 / math.sqrt(LEAST_SQUARE),
    }


def _target_bounds(method: Method, others: list[str]) -> list[str]:
    """Return what stands for the target's velocity before the first step, of the last bounds `others`."""
    if method.limiting is not None and method.limiting.turn_m_s_rad is not None:
        return others[:2]
    return others[-6:-4] if method.has_height else others[-2:]
