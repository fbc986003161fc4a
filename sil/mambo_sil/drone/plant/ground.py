"""The ground at height 0: it carries a drone that stands on it, and raises the thrust of rotors near it.

The commands run its equal in C, `flight/engine/ground.h`, which has the same bits.
"""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray, PerFlight
from mambo_sil.drone.plant.rigid_body import EULER, POSITION, RATES, VELOCITY, to_world
from mambo_sil.drone.plant.vehicle import VehicleState

ROTOR_HEIGHT_M: Final = 0.03
"""Height of the rotors above the feet."""


def ground_effect(height_m: FloatArray, radius_m: PerFlight) -> FloatArray:
    """Return thrust near the ground over that far from it (n,), at the same power, for feet at heights (n,).

    1 / (1 - (R / 4 z)^2), z the height of the rotors: Cheeseman and Bennett, The Effect of the Ground on a
    Helicopter Rotor in Forward Flight, ARC R&M 3021 (1955). Below z = R / 2, where the formula ends, it stays
    the same. R is the radius of one rotor; for four it lies between that radius and its double.
    """
    rotor_height_m = np.maximum(height_m + ROTOR_HEIGHT_M, radius_m / 2.0)
    ratio = radius_m / (4.0 * rotor_height_m)
    return np.where(np.asarray(radius_m) > 0.0, 1.0 / (1.0 - ratio * ratio), 1.0)


def carry_on_ground(state: VehicleState, there: NDArray[np.bool_]) -> VehicleState:
    """Return the state of n drones with none below the ground, where `there` (n,) is any.

    A drone on the ground that does not rise comes to rest, level, at once: feet neither bounce nor slide.
    Its rotors and its heading stay.
    """
    low = there & (state.body[POSITION][2] >= 0.0)
    if not low.any():
        return state
    body: FloatArray = state.body.copy()
    body[POSITION][2] = np.where(low, 0.0, body[POSITION][2])
    down_m_s = to_world(*state.sine_cosine, body[VELOCITY])[2]
    resting = low & (down_m_s >= 0.0)
    for rows in (VELOCITY, RATES, slice(EULER.start, EULER.start + 2)):
        body[rows] = np.where(resting, 0.0, body[rows])
    return replace(state, body=body)
