"""A controller and a drone at hover: linear systems joined by python-control, and flights near hover."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import control
import numpy as np
from numpy.typing import NDArray

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.link import Link
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.experiment.margins.controller_jacobian import LinearController, linear_controller
from mambo_sil.experiment.margins.drone_jacobians import COMMAND, SEEN, drone_jacobians
from mambo_sil.experiment.margins.hover_margins import hover_loops, measure_loops
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine import simulate
from mambo_sil.flight.loop import Flight, Offset, PositionController, fly
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import Hover


def linear(settings: Settings) -> LinearController:
    """Return a controller as a linear system, which it must be."""
    found = linear_controller(settings)
    assert found is not None
    return found


def margins_of(settings: Settings, vehicle: Vehicle) -> Any:
    """Return the margins of roll and pitch of a controller on a drone, with the true state."""
    flight = Flight(Hover(), vehicle=vehicle, update_period_s=settings.horizon.update_period_s)
    (loops,) = hover_loops(linear(settings), flight)
    return measure_loops(loops, flight)


def opened_at_the_command(settings: Settings, vehicle: Vehicle, axis: int) -> Any:
    """Return the loop of an axis from command to command, of negative feedback, as a system of `control`.

    The drone is advanced from update to update by powers of its matrices, without the project's loop.
    """
    period_s = settings.horizon.update_period_s
    flight = Flight(Hover(), vehicle=vehicle, update_period_s=period_s)
    found, controller = drone_jacobians(flight), linear(settings)
    a, b, c = found.transition[0, 0], found.inputs[0, 0][:, COMMAND], found.outputs[0, 0][SEEN]
    held, whole = np.zeros_like(b), np.eye(len(a))
    for _ in range(flight.ticks_per_update):
        held, whole = a @ held + b, a @ whole
    drone = control.ss(whole, held, c, np.zeros((7, 2)), period_s)
    law = control.ss(controller.a, controller.b, controller.c, controller.d, period_s)
    return -(law * drone)[axis, axis]


@dataclass(frozen=True, eq=False)
class Scaled:
    """Controllers whose commands reach their drones times factors (n, 2) of roll and pitch."""

    controller: PositionController
    factors: NDArray[np.float64]

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Any:
        """Return the outcome of the controller with other commands."""
        outcome = self.controller.step(state, target, thrust_acceleration_m_s2)
        return _Sent(np.asarray(outcome.command_rad) * self.factors, outcome.status)


@dataclass(frozen=True, eq=False)
class _Sent:
    command_rad: NDArray[np.float64]
    status: NDArray[np.int64]


def grows(settings: Settings, vehicle: Vehicle, axis: int, *, delay_ticks: int = 0) -> bool:
    """Return whether a displacement of 1 mm along an axis grows in a flight with the true state."""
    flight = _hover(settings, vehicle, axis, delay_ticks=delay_ticks)
    (grown,) = _grown(simulate.fly(flight, CompiledController(settings)), settings, axis)
    return grown


def grows_with_gains(settings: Settings, vehicle: Vehicle, axis: int, gains: Sequence[float]) -> list[bool]:
    """Return the same of flights side by side, whose commands of that axis are multiplied by gains."""
    flight = _hover(settings, vehicle, axis, flights=len(gains))
    factors = np.ones((len(gains), 2))
    factors[:, axis] = gains
    trace = fly(flight, Scaled(CompiledController(settings, len(gains)), factors))
    return _grown(trace, settings, axis)


def _hover(
    settings: Settings, vehicle: Vehicle, axis: int, *, delay_ticks: int = 0, flights: int = 1
) -> Flight:
    return Flight(
        Hover(),
        duration_s=30.0,
        vehicle=vehicle,
        update_period_s=settings.horizon.update_period_s,
        offset=Offset((0.0, 1e-3, 0.0) if axis == 0 else (1e-3, 0.0, 0.0)),
        link=Link(delay_ticks),
        flights=flights,
    )


def _grown(trace: Trace, settings: Settings, axis: int) -> list[bool]:
    """Compare the largest displacement in the last fifth of each flight with that in the second fifth.

    A flight ends before a command reaches half the tilt limit.
    """
    found = []
    for index in range(trace.command_rad.shape[1]):
        large = np.flatnonzero(
            np.abs(trace.command_rad[:, index]).max(axis=1) > 0.5 * settings.limits.tilt_rad
        )
        moved_m = np.abs(trace.position_m[: large[0] if len(large) else None, index, 1 - axis])
        fifth = len(moved_m) // 5
        found.append(bool(moved_m[-fifth:].max() > moved_m[fifth : 2 * fifth].max()))
    return found
