"""The margins of a controller on the drones of a flight."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from mambo_sil.drone.plant.first_order import FirstOrderDrone
from mambo_sil.experiment.margins.axis_margins import AxisMargins, measure_axis
from mambo_sil.experiment.margins.controller_jacobian import LinearController
from mambo_sil.experiment.margins.drone_jacobians import drone_jacobians
from mambo_sil.experiment.margins.hover_loop import PeriodicLoop, axis_loop, close_loop
from mambo_sil.flight.loop import Flight

NOT_SMOOTH: Final = (
    "the law of a 1-norm follows the signs of slopes: its command is no smooth function of the state. "
    "No linear margin describes it, and a describing function would hold for one amplitude and one kind of "
    "motion only, so none is given"
)
"""Why a controller without a linear law has no margins."""


def hover_loops(controller: LinearController, flight: Flight) -> Iterator[tuple[PeriodicLoop, PeriodicLoop]]:
    """Yield the loops of roll and pitch of each drone of a flight."""
    found = drone_jacobians(flight)
    delays = np.broadcast_to(flight.link.delay_ticks, flight.flights)
    for number, delay_ticks in enumerate(delays.tolist()):
        drone = tuple(one[number] for one in (found.transition, found.inputs, found.outputs, found.feed))
        step_s = flight.vehicle.drone.step_s
        both = close_loop(controller, drone, delay_ticks, flight.ticks_per_update, step_s)
        yield axis_loop(both, 0), axis_loop(both, 1)


def measure_loops(
    loops: tuple[PeriodicLoop, PeriodicLoop], flight: Flight, *, count: int = 400
) -> tuple[AxisMargins, AxisMargins]:
    """Return the margins of the loops of roll and pitch of a drone of a flight, from `count` frequencies."""
    motors = not isinstance(flight.vehicle.loop, FirstOrderDrone)
    roll, pitch = (
        measure_axis(loop, axis, flight.update_period_s, motors=motors, count=count)
        for axis, loop in enumerate(loops)
    )
    return roll, pitch
