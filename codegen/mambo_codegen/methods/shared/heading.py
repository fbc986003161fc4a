"""The slewed set-point of a heading, as `nmpc_slew_heading` computes it."""

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from mambo_codegen.methods.shared.constants import Constants
from mambo_codegen.methods.shared.math import Real, clamp, rounded

TURN_RAD: Final = 2 * math.pi
TURNS_PER_RAD: Final = 1 / TURN_RAD


def slew_heading(
    constants: Constants, previous_rad: ArrayLike, wanted_rad: ArrayLike, most_change_rad: ArrayLike
) -> Real:
    """Return the next headings (n,), rad, on the shortest ways to the wanted ones, with the bits of the C."""
    numbers = constants.numbers
    previous, wanted, most = (
        numbers.quantize(np.asarray(given)[:, None], ("yaw",)).astype(numbers.computed)[:, 0]
        for given in (previous_rad, wanted_rad, most_change_rad)
    )
    reach, zero, turn = constants.limits.yaw, numbers.computed(0), numbers.constant(TURN_RAD, "yaw")
    is_good = (previous >= -reach) & (previous <= reach)
    moves = is_good & (wanted >= -reach) & (wanted <= reach) & (most > zero)
    previous = np.where(is_good, previous, zero)
    change = np.where(moves, wanted, previous) - previous
    if numbers.bits is not None:
        found = constants.trigonometry
        turns = rounded(change * found.quarter_turns_per_rad, found.quarter_turns_bits + 2)
    else:
        rounding = numbers.scalar(constants.trigonometry.rounding)
        turns = ((change * numbers.scalar(TURNS_PER_RAD)) + rounding) - rounding
    change = clamp(change - (turns * turn), np.where(moves, most, zero))
    slewed = previous + change
    slewed = np.where(slewed > reach, slewed - turn, np.where(slewed < -reach, slewed + turn, slewed))
    return numbers.to_si(np.where(moves, clamp(slewed, reach), previous).astype(numbers.scalar), "yaw")
