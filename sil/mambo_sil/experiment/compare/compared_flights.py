"""How a controller flies its vehicle: its answer to a step forward and to the right, and the eight."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from pydantic import BaseModel, ConfigDict

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.crashes import detect_crashes
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import horizontal_error_m, measure
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import STEP_TIME_S, Bernoulli, PositionStep, Trajectories
from mambo_sil.results.summary import Number

STEP_M: Final = 1.0
STEP_DURATION_S: Final = 10.0
EIGHT_S: Final = 100.0
SETTLED_SHARE: Final = 0.05
"""The step has settled when the error stays within this share of it."""


class StepAnswer(BaseModel):
    """The answer to a step of the target of `STEP_M` in hover, over `STEP_DURATION_S`."""

    model_config = ConfigDict(frozen=True)

    settling_s: Number | None
    """Time until the error stays within `SETTLED_SHARE` of the step; None if it does not."""
    overshoot: Number
    """Share of the step by which the drone passes the target."""
    iae_m_s: Number


class EightAnswer(BaseModel):
    """The metrics of the eight of the command `fly`."""

    model_config = ConfigDict(frozen=True)

    iae_m_s: Number
    max_error_m: Number
    command_variation_rad: Number
    crashed: bool


@dataclass(frozen=True, eq=False)
class Answers:
    """What one controller flies; `steps` is the trace of two flights: axis 0 right (roll), 1 forward."""

    steps: Trace
    step: tuple[StepAnswer, StepAnswer]
    eight: EightAnswer


def answers(settings: Settings, drone: VehicleFile) -> Answers:
    """Fly steps and eight with the compiled controller, without disturbance or sensor noise.

    Raises FlightError, and the errors of building the C.
    """
    vehicle, period_s = Vehicle.of(drone), settings.horizon.update_period_s
    both = Trajectories((PositionStep(0.0, STEP_M), PositionStep(STEP_M, 0.0)))
    step = Flight(
        both,
        duration_s=STEP_TIME_S + STEP_DURATION_S,
        flights=2,
        vehicle=vehicle,
        update_period_s=period_s,
    )
    eight = Flight(Bernoulli(2.0, 0.5), duration_s=EIGHT_S, vehicle=vehicle, update_period_s=period_s)
    steps = fly(step, CompiledController(settings, 2))
    flown = fly(eight, CompiledController(settings))
    metrics = measure(flown)
    return Answers(
        steps,
        (_step_answer(steps, 0), _step_answer(steps, 1)),
        EightAnswer(
            iae_m_s=float(metrics.iae_m_s[0]),
            max_error_m=float(metrics.max_error_m[0]),
            command_variation_rad=float(metrics.command_variation_rad[0]),
            crashed=bool(detect_crashes(flown, drone)[0]),
        ),
    )


def along_step_m(trace: Trace) -> FloatArray:
    """Return the positions (k, 2) of both flights along their steps."""
    return np.stack([trace.position_m[:, 0, 1], trace.position_m[:, 1, 0]], axis=1)


def _step_answer(trace: Trace, flight: int) -> StepAnswer:
    time_s, error_m = trace.time_s - STEP_TIME_S, horizontal_error_m(trace)[:, flight]
    outside = np.flatnonzero(~(error_m <= SETTLED_SHARE * STEP_M))
    settled = outside[-1] + 1 < len(time_s)
    return StepAnswer(
        settling_s=float(time_s[outside[-1] + 1]) if settled else None,
        overshoot=float(np.maximum(0.0, along_step_m(trace)[:, flight].max() / STEP_M - 1.0)),
        iae_m_s=float(measure(trace, STEP_TIME_S).iae_m_s[flight]),
    )
