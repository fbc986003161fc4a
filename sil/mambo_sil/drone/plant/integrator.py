"""The Bogacki-Shampine method with fixed step: third order, three stages (Bogacki and Shampine 1989).

The commands run its equal in C, `flight/engine/vehicle.h`, which has the same bits.
"""

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray

NODES = np.array([0.0, 0.5, 0.75])
"""Times of the three stages, as fractions of the step."""

Input = TypeVar("Input")


def bogacki_shampine(
    derivative: Callable[[FloatArray, Input], FloatArray],
    state: FloatArray,
    inputs: tuple[Input, Input, Input],
    step_s: float,
) -> FloatArray:
    """Return the state one step later, with the input at each of the three `NODES`."""
    first = derivative(state, inputs[0])
    second = derivative(state + (step_s / 2.0) * first, inputs[1])
    third = derivative(state + (3.0 * step_s / 4.0) * second, inputs[2])
    return state + (step_s / 9.0) * (2.0 * first + 3.0 * second + 4.0 * third)
