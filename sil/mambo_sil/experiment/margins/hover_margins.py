"""The margins of a controller on the drones of a flight."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.first_order import FirstOrderDrone
from mambo_sil.experiment.margins.axis_margins import TILT_AXES, Margins, measure_axis, measure_height
from mambo_sil.experiment.margins.controller_jacobian import linear_controller
from mambo_sil.experiment.margins.drone_jacobians import LEVEL_AXES, drone_jacobians, hover_thrust_n
from mambo_sil.experiment.margins.hover_loop import PeriodicLoop, axis_loop, close_loop
from mambo_sil.flight.loop import Flight

NOT_SMOOTH: Final = (
    "the law of a 1-norm follows the signs of slopes: its command is no smooth function of the state. "
    "No linear margin describes it, and a describing function would hold for one amplitude and one kind of "
    "motion only, so none is given"
)
"""Why a controller without a linear law has no margins."""


Loops = tuple[PeriodicLoop, ...]
"""The loops of roll and pitch and, with a height, of the height."""


def hover_loops(settings: Settings, flight: Flight) -> Iterator[Loops]:
    """Yield the loops of a controller, whose law is linear, on each drone of a flight.

    With a height the controller has learnt the thrust of hover of that drone.
    Raises BuildError, CacheError.
    """
    commands_thrust, drone = settings.height is not None, flight.vehicle.drone
    found = drone_jacobians(flight, LEVEL_AXES + commands_thrust)
    loads = hover_thrust_n(flight.vehicle) / drone.weight_n if commands_thrust else 1.0
    delays, loads = np.broadcast_arrays(flight.link.delay_ticks, loads, np.zeros(flight.flights))[:2]
    controller = None if commands_thrust else linear_controller(settings)
    for number, (delay_ticks, load) in enumerate(zip(delays.tolist(), loads.tolist(), strict=True)):
        whole = close_loop(
            controller or linear_controller(settings, load),
            found.drone(number),
            delay_ticks,
            flight.ticks_per_update,
            drone.step_s,
        )
        yield tuple(axis_loop(whole, found.signals, axis) for axis in range(found.signals.axes))


def measure_loops(loops: Loops, flight: Flight, *, count: int = 400) -> tuple[Margins, ...]:
    """Return the margins of the loops of a drone of a flight, from `count` frequencies."""
    motors = not isinstance(flight.vehicle.loop, FirstOrderDrone)
    period_s = flight.update_period_s
    tilts = tuple(
        measure_axis(loop, name, period_s, motors=motors, count=count)
        for name, loop in zip(TILT_AXES, loops, strict=False)
    )
    return (*tilts, *(measure_height(loop, period_s, count=count) for loop in loops[len(tilts) :]))
