"""What the templates of the limits insert."""

import math

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
)
from mambo_codegen.numbers import literals
from mambo_codegen.settings.fields import SMALLEST_LIMIT


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
    numbers_of_c = method.reference_controller().stored_limits[0].tolist()
    stored = [str(number) if fixed else literals.real(float(number), scalar) for number in numbers_of_c]
    shifts = limits_shifts(numbers.bits) if numbers.bits is not None else {}
    return {
        "limit_bits": {limit.name: limit.value for limit in ActiveLimit},
        "smallest_limit": SMALLEST_LIMIT,
        "braking_slope": SPELLING * limiting.tilted.slope_m_s2_rad,
        "root_error": f"{ROOT_ERROR[scalar]:g}",
        "root_start": start,
        "root_iterations": FIXED_ITERATIONS,
        "root_terms": () if fixed else TERMS[numbers.scalar],
        "limits_shifts": shifts,
        "root_up": max(0, -shifts.get("speed", 0)),
        "root_down": max(0, shifts.get("speed", 0)),
        "default_bounds": _bounds(method, stored),
        "turning": limiting.turn_m_s_rad is not None,
        "turn_share": TURN_SHARE,
        "turn_bits": TURN_BITS,
        "least_turn": LEAST_TURN_M2_S2,
        "outage_steps": method.outage_steps,
        "least_square": method.least_square,
        "root_limit": 2 / math.sqrt(method.least_square),
    }


def _bounds(method: Method, stored: list[str]) -> list[dict[str, str]]:
    """Return name and initial value of each member of nmpc_bounds_t, whose numbers are `stored`."""
    left, port = iter(stored), method.port
    values = {row.member: [next(left) for _ in range(port.count(row))] for row in port.rows("bounds")}
    return [
        {"name": name, "value": f"{{ {', '.join(value)} }}" if len(value) > 1 else value[0]}
        for name, value in values.items()
    ]
