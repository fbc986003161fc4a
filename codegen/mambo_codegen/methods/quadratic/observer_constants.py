"""Constants of the observer: a Kalman filter with fixed gains, for each axis of the world.

The state is position, velocity and a disturbance, an acceleration that the tilt does not explain. White noise
of given densities enters velocity, disturbance and both measurements.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.quadratic.riccati import hold, mp, solve_riccati
from mambo_codegen.settings.sections import Sections


@dataclass(frozen=True)
class ObserverConstants:
    """Constants of the observer, float64, with lengths in m and times in steps of an update period.

    gain:                  (3, 2) corrections of position, velocity and disturbance by the innovations of
                           position and velocity.
    disturbance_limit_m_step2: largest disturbance.
    velocity_limit_m_step: largest velocity, that of the input range.
    drag_1_step:           acceleration by drag per velocity.
    age_steps:             age of the measurements.
    outage_steps:          control steps without a good measurement over which the observer predicts.
    steps_per_s, steps2_per_s2: make velocities and accelerations SI units again.
    """

    gain: NDArray[np.float64]
    disturbance_limit_m_step2: float
    velocity_limit_m_step: float
    drag_1_step: float
    age_steps: float
    outage_steps: int
    steps_per_s: float
    steps2_per_s2: float


def observer_constants(settings: Sections) -> ObserverConstants:
    """Derive the constants of the observer."""
    observer, update_s = settings.observer, settings.horizon.update_period_s
    period_s = mp.mpf(update_s)
    return ObserverConstants(
        gain=_gain(settings),
        disturbance_limit_m_step2=float(mp.mpf(observer.disturbance_limit_m_s2) * period_s**2),
        velocity_limit_m_step=float(mp.mpf(settings.ranges.velocity_m_s) * period_s),
        drag_1_step=float(mp.mpf(settings.model.drag_1_s) * period_s),
        age_steps=float(mp.mpf(observer.age_s) / period_s),
        outage_steps=round(observer.outage_s / update_s),
        steps_per_s=1 / update_s,
        steps2_per_s2=1 / (update_s * update_s),
    )


def _gain(settings: Sections) -> NDArray[np.float64]:
    """Return the gain (3, 2) of the stationary Kalman filter, for velocities in m/step and so on."""
    observer, period_s = settings.observer, mp.mpf(settings.horizon.update_period_s)

    def density(value: float) -> object:
        return mp.mpf(value) ** 2

    transition, _ = hold(mp.matrix([[0, 1, 0], [0, 0, 1], [0, 0, 0]]), mp.zeros(3, 1), period_s)
    measured = mp.matrix([[1, 0, 0], [0, 1, 0]])
    process = mp.diag(
        [
            mp.mpf(0),
            density(observer.acceleration_noise) * period_s,
            density(observer.disturbance_noise) * period_s,
        ]
    )
    noise = mp.diag(
        [density(observer.position_noise) / period_s, density(observer.velocity_noise) / period_s]
    )
    spread = solve_riccati(transition.T, measured.T, process, noise)
    gain = spread * measured.T * mp.inverse((measured * spread * measured.T) + noise)
    return np.array(
        [[float(gain[row, column] * period_s ** (row - column)) for column in range(2)] for row in range(3)]
    )
