"""The ground at height 0: it carries a drone that stands on it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.rigid_body import EULER, POSITION, RATES, VELOCITY, to_world
from mambo_sil.drone.plant.vehicle import VehicleState


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
