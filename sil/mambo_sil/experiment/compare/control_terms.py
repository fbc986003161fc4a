"""The law and the observer of a quadratic cost in control terms: gains and closed-loop poles, in SI units."""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray

AXES: Final = ("roll", "pitch")

LEAST_SHARE: Final = 0.05
_DEAD: Final = 1e-9
"""A pole of this magnitude decays in the step it is excited."""


class AxisLaw(BaseModel):
    """The first free move along one axis without limits, command = -gain state, and the loop it closes.

    Gains are of the command in rad, for the drone's position and velocity relative to the target; that of the
    disturbance, less the target's acceleration, is per m/s^2. The dominant pole is the slowest to decay of
    those with a share of `LEAST_SHARE` or more in the answer to an initial position error.
    """

    model_config = ConfigDict(frozen=True)

    position_gain_rad_m: float
    velocity_gain_rad_s_m: float
    disturbance_gain_rad_s2_m: float
    dominant_rad_s: float
    """Natural frequency of the dominant pole."""
    dominant_damping: float
    poles: list[tuple[float, float]]
    """Natural frequency in rad/s and damping of every pole, the slowest first."""


class ObserverGains(BaseModel):
    """Corrections by the innovations of position and velocity, in a control step."""

    model_config = ConfigDict(frozen=True)

    position: tuple[float, float]
    """In m per m, and m per m/s."""
    velocity_1_s: tuple[float, float]
    """In m/s per m, and m/s per m/s."""
    disturbance_1_s2: tuple[float, float]
    """In m/s^2 per m, and m/s^2 per m/s."""


def axis_laws(settings: Settings) -> tuple[AxisLaw, AxisLaw] | None:
    """Return the laws of roll and pitch; None for commands that are not linear in the state."""
    law, period_s = method_of(settings).linear_law, settings.horizon.update_period_s
    if law is None:
        return None
    return _axis_law(law.gain[0], law.loops[0], period_s), _axis_law(law.gain[1], law.loops[1], period_s)


def observer_gains(settings: Settings) -> ObserverGains | None:
    """Return the gains of the observer; None without one."""
    law = method_of(settings).linear_law
    if law is None:
        return None
    position, velocity, disturbance = ((float(row[0]), float(row[1])) for row in law.observer_gain)
    return ObserverGains(position=position, velocity_1_s=velocity, disturbance_1_s2=disturbance)


def _axis_law(gain: FloatArray, loop: FloatArray, period_s: float) -> AxisLaw:
    poles, shares = _poles(loop)
    log = np.log(poles)
    frequency_rad_s, damping = np.abs(log) / period_s, -log.real / np.abs(log)
    dominant = int(np.argmax(np.where(shares >= LEAST_SHARE, np.abs(poles), 0.0)))
    slowest = sorted(zip(frequency_rad_s.tolist(), damping.tolist(), strict=True))
    position, velocity, disturbance = gain.tolist()
    return AxisLaw(
        position_gain_rad_m=position,
        velocity_gain_rad_s_m=velocity,
        disturbance_gain_rad_s2_m=disturbance,
        dominant_rad_s=float(frequency_rad_s[dominant]),
        dominant_damping=float(damping[dominant]),
        poles=slowest,
    )


def _poles(loop: FloatArray) -> tuple[NDArray[np.complex128], FloatArray]:
    """Return the poles of the states that act on the position, and their shares of an initial error."""
    poles, vectors = np.linalg.eig(loop)
    first = np.zeros(len(loop))
    first[0] = 1.0
    shares = np.abs(vectors[0] * np.linalg.solve(vectors, first))
    alive = np.abs(poles) > _DEAD
    return poles[alive].astype(np.complex128), shares[alive]
