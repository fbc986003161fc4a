"""Flights with every effect of a fault, which use every line of the wrappers in the engine."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.experiment.faults.fault import (
    Alteration,
    Fault,
    FreezeState,
    KeepInputs,
    ScaleState,
    SetState,
    SetThrust,
    ShiftState,
    ShiftTarget,
    WrapYaw,
    move_target,
    shift_yaw,
)
from mambo_sil.experiment.faults.injection import FaultyController, LevellingCaller
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.adjusted import AdjustedController, Adjustment
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.trajectories import Bernoulli

UPDATES: Final = 101

ALTERATIONS: Final[tuple[Alteration, ...]] = (
    KeepInputs(),
    FreezeState(),
    SetState(range(7), math.nan, on=3, of=10),
    SetState(range(3, 4), -math.inf),
    SetState(range(4, 6), 0.05, on=2, of=3),
    ScaleState((0.9, 1.1, 0.8, 1.2, 0.7, 1.3, 1.4)),
    shift_yaw(math.pi),
    ShiftState((0.1, 0.2, -0.3, 0.4, -0.05, 0.06, 0.7)),
    WrapYaw(),
    move_target(0.5),
    ShiftTarget((0.1, 0.2, -0.3, 0.4, -0.5, 0.6)),
    SetThrust(5.0),
    SetThrust(math.nan),
)
"""Every effect; on every number that it changes."""

FAULTS: Final[tuple[Fault | None, ...]] = (
    None,
    *(Fault(20, 60, alter) for alter in ALTERATIONS),
    Fault(0, 30, FreezeState()),
    Fault(20, 60, drop_every=1),
    Fault(20, 60, drop_every=3),
    Fault(20, 60, late_updates=1),
    Fault(20, 60, late_updates=7),
    Fault(3, 90, late_updates=20),
    Fault(20, 60, SetState(range(1), math.nan), 4, 5),
)
"""Faults of the inputs, from the first update on, missing updates, late commands, and all of these."""

CHANGES: Final = (
    Adjustment(1, 10, "set_weights", (math.nan, 1.0)),
    Adjustment(4, 0, "set_weights", (0.0, 0.0)),
    Adjustment(1, 30, "set_weights", (1.0, 0.5)),
)
"""New weights of a 1-norm, of which the first are refused."""

PATIENCE: Final = tuple(1 + row % 4 if row % 2 else 2**31 for row in range(len(FAULTS)))

SHOWN: Final = tuple(fault for fault in FAULTS if fault is not None)
"""The same for inputs of any numbers."""


def any_inputs() -> FloatArray:
    """Return states, targets and thrusts (UPDATES, 14) of any numbers, NaN and infinity among them."""
    rng = np.random.default_rng(3)
    inputs = rng.normal(0.0, 4.0, (UPDATES, 14))
    inputs[rng.random(inputs.shape) < 0.05] *= 1e3
    for number in (np.nan, np.inf, -np.inf, 0.0, -0.0, np.pi, -np.pi):
        inputs[rng.random(inputs.shape) < 0.01] = number
    return inputs


def faulty_flight(faults: Sequence[Fault | None]) -> Flight:
    """Return turning flights, one for each fault, whose heading passes south."""
    return Flight(
        Bernoulli(2.0, 0.5),
        duration_s=0.01 * (UPDATES - 1),
        flights=len(faults),
        yaw_rad=np.linspace(2.8, 3.0, len(faults)),
        yaw_rate_rad_s=2.0,
    )


def faulty_controller(
    settings: Settings,
    faults: Sequence[Fault | None],
    changes: Sequence[Adjustment],
    patience: Sequence[int],
) -> tuple[FaultyController, AdjustedController]:
    """Return controllers with all wrappers, and that of them which has the answers to new weights."""
    compiled = CompiledController(settings, len(faults))
    adjusted = AdjustedController(compiled, len(faults), changes)
    caller = LevellingCaller(adjusted, compiled, np.array(patience))
    return FaultyController(caller, faults, compiled.instances), adjusted
