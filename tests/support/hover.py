"""A controller and a drone at hover: linear systems joined by python-control, and flights near hover."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import control
import numpy as np
from numpy.typing import NDArray

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.link import Link
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.experiment.margins.axis_margins import measure_loops
from mambo_sil.experiment.margins.controller_jacobian import linear_controller
from mambo_sil.experiment.margins.drone_jacobians import drone_jacobians
from mambo_sil.experiment.margins.hover_loop import AT_COMMAND, SENT, PeriodicLoop, choose, hover_loops
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.thrust_controller import Applied, adapted, hover_command, numbers_of
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import HEIGHT_REFERENCE_M, Flight, Offset, PositionController
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import Hover


def margins_of(settings: Settings, vehicle: Vehicle) -> Any:
    """Return the margins of all axes of a controller on a drone, with the true state."""
    flight = Flight(Hover(), vehicle=vehicle, update_period_s=settings.horizon.update_period_s)
    (loops,) = hover_loops(settings, flight)
    return measure_loops(loops, flight)


def height_loop(settings: Settings, vehicle: Vehicle) -> PeriodicLoop:
    """Return the loop of the height, broken at the command."""
    flight = Flight(Hover(), vehicle=vehicle, update_period_s=settings.horizon.update_period_s)
    (loops,) = hover_loops(settings, flight)
    return choose(loops[2], [AT_COMMAND], [SENT])


def opened_at_the_command(settings: Settings, vehicle: Vehicle, axis: int) -> Any:
    """Return the loop of an axis from command to command, of negative feedback, as a system of `control`.

    The drone is advanced from update to update by powers of its matrices, without the project's loop.
    """
    period_s = settings.horizon.update_period_s
    flight = Flight(Hover(), vehicle=vehicle, update_period_s=period_s)
    axes = 2 if settings.height is None else 3
    found, controller = drone_jacobians(flight, axes), linear_controller(settings)
    signals = found.signals
    a, b, c = (
        found.transition[0, 0],
        found.inputs[0, 0][:, signals.command],
        found.outputs[0, 0][signals.seen],
    )
    held, whole = np.zeros_like(b), np.eye(len(a))
    for _ in range(flight.ticks_per_update):
        held, whole = a @ held + b, a @ whole
    drone = control.ss(whole, held, c, np.zeros((len(c), axes)), period_s)
    law = control.ss(controller.a, controller.b, controller.c, controller.d, period_s)
    return -(law * drone)[axis, axis]


@dataclass(frozen=True, eq=False)
class Scaled:
    """Controllers whose commands reach their drones with the difference from hover times factors (n, 3)."""

    controller: PositionController
    factors: NDArray[np.float64]

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Any:
        """Return the outcome of the controller with other commands."""
        outcome = self.controller.step(state, target, thrust_acceleration_m_s2)
        numbers = numbers_of(outcome)
        hover = np.array(hover_command(self.controller))
        factors = self.factors[:, : numbers.shape[1]]
        return Applied.of(hover + factors * (numbers - hover), outcome.status)


def grows(settings: Settings, vehicle: Vehicle, axis: int, *, delay_ticks: int = 0) -> bool:
    """Return whether a displacement of 1 mm along an axis grows in a flight with the true state."""
    flight = _hover(settings, vehicle, axis, delay_ticks=delay_ticks)
    (grown,) = _grown(fly(flight, CompiledController(settings)), settings, axis)
    return grown


def grows_with_gains(settings: Settings, vehicle: Vehicle, axis: int, gains: Sequence[float]) -> list[bool]:
    """Return the same of flights whose commands of that axis are multiplied by gains."""
    flight, found = _hover(settings, vehicle, axis), []
    for gain in gains:
        factors = np.ones((1, 3))
        factors[:, axis] = gain
        trace = fly(flight, Scaled(adapted(CompiledController(settings)), factors))
        found += _grown(trace, settings, axis)
    return found


_OFFSETS_M: Final = ((0.0, 1e-3, 0.0), (1e-3, 0.0, 0.0), (0.0, 0.0, -1e-3))


def _hover(settings: Settings, vehicle: Vehicle, axis: int, *, delay_ticks: int = 0) -> Flight:
    return Flight(
        Hover(),
        duration_s=30.0,
        vehicle=vehicle,
        update_period_s=settings.horizon.update_period_s,
        offset=Offset(_OFFSETS_M[axis]),
        link=Link(delay_ticks),
    )


def _grown(trace: Trace, settings: Settings, axis: int) -> list[bool]:
    """Compare the largest displacement in the last fifth of each flight with that in the second fifth.

    A flight ends before a command reaches half the tilt limit, or half the largest loss of thrust.
    """
    found, limits = [], [settings.limits.tilt_rad] * 2
    commands, moves_m = trace.command_rad, trace.position_m[..., [1, 0, 2]]
    if settings.height is not None:
        thrust_m_s2 = trace.thrust_acceleration_m_s2[..., np.newaxis] - GRAVITY_M_S2
        commands = np.concatenate([commands, thrust_m_s2], axis=2)
        limits = [*limits, GRAVITY_M_S2 - settings.height.thrust_min_m_s2]
        moves_m = moves_m - (0.0, 0.0, HEIGHT_REFERENCE_M)
    for index in range(trace.command_rad.shape[1]):
        large = np.flatnonzero((np.abs(commands[:, index]) > 0.5 * np.array(limits)).any(axis=1))
        moved_m = np.abs(moves_m[: large[0] if len(large) else None, index, axis])
        fifth = len(moved_m) // 5
        found.append(bool(moved_m[-fifth:].max() > moved_m[fifth : 2 * fifth].max()))
    return found
