"""Constants of the observer: a Kalman filter with fixed gains, for each axis of the world.

The state is position, velocity and a disturbance, an acceleration that the tilt does not explain. White noise
of given densities enters velocity, disturbance and both measurements.
"""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.kept import keep
from mambo_codegen.settings.sections import Sections


@dataclass(frozen=True)
class ObserverConstants:
    """Constants of the observer, float64, with lengths in m and times in steps of an update period.

    gain:                  (3, 2) corrections of position, velocity and disturbance by the innovations of
                           position and velocity.
    coarse_gain:           the same while no position is measured; None without a guard.
    disturbance_limit_m_step2: largest disturbance.
    velocity_limit_m_step: largest velocity, that of the input range.
    drag_1_step:           acceleration by drag per velocity.
    age_steps:             age of the measurements.
    outage_steps:          control steps without a good measurement over which the observer predicts.
    steps_per_s, steps2_per_s2: make velocities and accelerations SI units again.
    """

    gain: NDArray[np.float64]
    coarse_gain: NDArray[np.float64] | None
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
    period_s = Fraction(update_s)
    return ObserverConstants(
        gain=observer_gain(settings, observer.disturbance_noise),
        coarse_gain=_coarse_gain(settings),
        disturbance_limit_m_step2=float(Fraction(observer.disturbance_limit_m_s2) * period_s**2),
        velocity_limit_m_step=float(Fraction(settings.ranges.velocity_m_s) * period_s),
        drag_1_step=float(Fraction(settings.model.drag_1_s) * period_s),
        age_steps=float(Fraction(observer.measurement_age_s) / period_s),
        outage_steps=round(observer.outage_s / update_s),
        steps_per_s=1 / update_s,
        steps2_per_s2=1 / (update_s * update_s),
    )


def observer_gain(
    settings: Sections, disturbance_noise: float, position_noise: float | None = None
) -> NDArray[np.float64]:
    """Return the gain (3, 2) of the stationary Kalman filter, for velocities in m/step and so on.

    `disturbance_noise` is that along the axis, `position_noise` in place of observer.position_noise; the
    other noises are those of all axes.
    """
    observer, period_s = settings.observer, settings.horizon.update_period_s
    noise = (
        observer.acceleration_noise,
        disturbance_noise,
        position_noise or observer.position_noise,
        observer.velocity_noise,
    )

    def solve() -> list[list[float]]:
        from mambo_codegen.methods.quadratic.solutions import solve_observer  # noqa: PLC0415 - imports mpmath

        return solve_observer(period_s, noise)

    return np.array(keep("observer", (period_s, noise), solve))


def _coarse_gain(settings: Sections) -> NDArray[np.float64] | None:
    """Return the gain (3, 2) while no position is measured; None without a guard."""
    if settings.guard is None:
        return None
    noise = max(settings.guard.position_noise, settings.observer.position_noise)
    return observer_gain(settings, settings.observer.disturbance_noise, noise)
