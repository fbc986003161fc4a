"""The attitude model of a drone whose inner loops are known: fitted to its simulated answer to a step."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from mambo_sil.drone.plant import loops
from mambo_sil.drone.plant.airframe import airframe_of
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.rigid_body import EULER
from mambo_sil.drone.plant.vehicle import Vehicle, truth
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import FirstOrderAttitude
from mambo_sil.model.identify.axis import WORTH
from mambo_sil.model.identify.response import FittedResponse, fit_response, residuals, root_mean_square
from mambo_sil.model.identify.segments import PERIOD_S, SETTLE_S, HeldCommand, Segment
from mambo_sil.model.identify.signals import Signal

STEP_RAD: Final = 0.1
"""Size of the step: large against friction, small enough that no limit of a loop binds."""
DURATION_S: Final = 3.0
_BEFORE_S: Final = SETTLE_S + 0.5
"""Rest before the step, of which the fit leaves out `SETTLE_S`."""


@dataclass(frozen=True)
class StepFit:
    """The model of one axis, and the rms of what it leaves of a unit step."""

    lag_s: float
    delay_s: float
    integral_1_s: float
    error: float


@lru_cache(maxsize=64)  # a program derives the same drone with several options
def fit_steps(drone: VehicleFile) -> tuple[StepFit, StepFit]:
    """Return the models of roll and pitch of a drone that hovers without disturbance."""
    roll, pitch = _answers(drone)
    return (
        _fit(roll, drone.step_s, integrates=_integrates(drone, "roll")),
        _fit(pitch, drone.step_s, integrates=_integrates(drone, "pitch")),
    )


def _integrates(drone: VehicleFile, axis: str) -> bool:
    """Return whether the loop of an axis has an integral part."""
    attitude = drone.attitude
    if isinstance(attitude, FirstOrderAttitude):
        return False
    gains = getattr(attitude, axis).model_dump()
    return any(gains.get(name, 0.0) > 0.0 for name in ("i_n_m_s", "i_1_s2", "rate_i_1_rad"))


def _answers(drone: VehicleFile) -> FloatArray:
    """Return the answers (2, ticks + 1) of roll and pitch to a step of their own command, over its size."""
    vehicle = Vehicle.of(drone)
    state = vehicle.at_rest(np.zeros((3, 2)), 0.0, airframe_of(drone).hover_command)
    command_rad = STEP_RAD * np.eye(2)
    answers = [np.zeros(2)]
    for _ in range(round(DURATION_S / drone.step_s)):
        seen = truth(state)
        thrust_n = loops.altitude_thrust(drone, 0.0, seen.position_m[2], seen.velocity_m_s[2])
        state, _ = vehicle.advance(state, command_rad, thrust_n, 0.0, seen=seen)
        answers.append(state.body[EULER][[0, 1], [0, 1]] / STEP_RAD)
    return np.stack(answers, axis=1)


def _fit(answer: FloatArray, step_s: float, *, integrates: bool) -> StepFit:
    """Return the model of an axis.

    With an integrator if the loop `integrates` and that lowers the error as in an identification: of a loop
    without one it mends the shape of the step, and bends slow curves.
    """
    first, last = -round(_BEFORE_S / PERIOD_S), round(DURATION_S / PERIOD_S)
    time_s = PERIOD_S * np.arange(first, last + 1, dtype=np.float64)
    tilt = np.interp(time_s, step_s * np.arange(len(answer)), answer)
    step = HeldCommand.of(Signal(np.array([time_s[0], 0.0]), np.array([0.0, 1.0]), "step"))
    still = np.zeros_like(time_s)
    segment = Segment("step", time_s, (step, step), np.stack([tilt, tilt]), still, None, None)

    def fit(*, integrator: bool) -> tuple[FittedResponse, float]:
        found = fit_response([segment], 0, [segment.counted], integrator=integrator)
        return found, root_mean_square(residuals(found, [segment], 0, [segment.counted]))

    chosen, error = fit(integrator=False)
    if integrates:
        richer, richer_error = fit(integrator=True)
        if richer_error < WORTH * error:
            chosen, error = richer, richer_error
    return StepFit(chosen.lag_s, chosen.delay_s, chosen.integral_1_s, error)
