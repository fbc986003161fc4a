"""Controllers of the height, which command the thrust, as the closed loop calls them.

    state  [x, y, vx, vy, roll, pitch, yaw, height, climb, contact with the floor]   (n, 10)
    target the columns of `flight/columns.py`                                        (n, 13)
    thrust what the drones got in the last update period over the nominal mass       (n,)

The thrust is NaN where it is what the controller had commanded.
"""

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods import method_of
from mambo_codegen.numbers.gravity import hover_thrust
from mambo_sil.drone.plant.arrays import FloatArray, IntArray
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.columns import COMMAND, LEVEL, SPACE, Columns, own_columns

CAPPED_SHARE: Final = 1e-6
"""A difference of this share of the weight is no rounding error: the thrust is another one than commanded."""


@dataclass(frozen=True, eq=False)
class Applied:
    """What reaches the drone: command (n, 2), status (n,), and the thrust (n,) of a controller of the height.

    The status is NOT_CALLED where the controller did not run.
    """

    command_rad: NDArray[np.floating[Any]]
    status: IntArray
    thrust_m_s2: NDArray[np.floating[Any]] | None = None

    @classmethod
    def of(cls, numbers: FloatArray, status: IntArray) -> "Applied":
        """Return what has the numbers (n, 2), or with a thrust (n, 3)."""
        return cls(numbers[:, :2], status, numbers[:, 2] if numbers.shape[1] > 2 else None)


def numbers_of(outcome: Any) -> FloatArray:
    """Return the numbers of a command: roll and pitch (n, 2), with a thrust (n, 3)."""
    thrust_m_s2 = getattr(outcome, "thrust_m_s2", None)
    parts = (
        [outcome.command_rad] if thrust_m_s2 is None else [outcome.command_rad, thrust_m_s2[:, np.newaxis]]
    )
    return np.concatenate(parts, axis=1, dtype=np.float64)


class LoopController:
    """n controllers, compiled or in NumPy, that want some of the columns of the closed loop."""

    def __init__(self, controller: Any) -> None:
        self.controller = controller
        port = method_of(controller.settings).port
        self._state, self._target = own_columns(port, "state"), own_columns(port, "target")

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Any:
        """Return the next commands."""
        return self.controller.step(*self._own(state, target), thrust_acceleration_m_s2)

    def _own(self, state: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.ascontiguousarray(state[:, self._state]), np.ascontiguousarray(target[:, self._target])

    def wrap(self, _engine: Any, inner: Any) -> Any:
        """Return the same in the engine: `nmpc_host_step` has this interface."""
        return replace(inner, columns=columns_of(self))


class ThrustController(LoopController):
    """n controllers of the height behind the interface of the closed loop."""

    columns = SPACE

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Any:
        """Tell the controllers the thrusts that are no NaN, and return the next commands."""
        if not np.isnan(thrust_acceleration_m_s2).all():
            self.controller.report_thrust(thrust_acceleration_m_s2)
        return self.controller.step(*self._own(state, target))


def adapted(controller: Any) -> Any:
    """Return a controller as the closed loop calls it."""
    settings = getattr(controller, "settings", None)
    if settings is None:
        return controller
    if settings.height is not None:
        return ThrustController(controller)
    own = [own_columns(method_of(settings).port, record) for record in ("state", "target")]
    are_first = all(columns == list(range(len(columns))) for columns in own)
    return controller if are_first else LoopController(controller)


def innermost(controller: Any) -> Any:
    """Return the controller inside all wrappers."""
    while hasattr(controller, "controller"):
        controller = controller.controller
    return controller


def columns_of(controller: Any) -> Columns:
    """Return the columns of a controller, as the closed loop calls it: those that it has, else LEVEL."""
    while not hasattr(controller, "columns"):
        if not hasattr(controller, "controller"):
            return LEVEL
        controller = controller.controller
    columns: Columns = controller.columns
    return columns


def hover_command(controller: Any) -> tuple[float, ...]:
    """Return roll and pitch of hover and, of a controller that commands the thrust, the thrust over mass."""
    command = np.zeros(columns_of(controller).command)
    if columns_of(controller).commands_thrust:
        command[COMMAND["thrust_m_s2"]] = hover_thrust(innermost(controller).settings)
    return tuple(command.tolist())


class ThrustDelivery:
    """The thrusts over the nominal mass that n drones get in an update period: a mixer may cap them."""

    def __init__(self, drone: VehicleFile, flights: int) -> None:
        self._mass_kg, self._least_n = drone.body.mass_kg, CAPPED_SHARE * drone.weight_n
        self._flights = flights
        self._begin()

    def _begin(self) -> None:
        self._ticks, self._sum_n = 0, np.zeros(self._flights)
        self._capped = np.zeros(self._flights, np.bool_)

    def forget(self, chosen: NDArray[np.bool_]) -> None:
        """Report no thrust of the drones that are `chosen` (n,) for this period."""
        self._capped &= ~chosen

    def note(self, wanted_n: FloatArray, given_n: FloatArray) -> None:
        """Note the thrusts (n,) that arrived at a tick, and those that the motors were commanded."""
        self._ticks += 1
        self._sum_n = self._sum_n + given_n
        self._capped |= np.abs(given_n - wanted_n) > self._least_n

    def report(self) -> FloatArray:
        """Return the mean since the last call (n,), NaN where the motors were commanded what arrived."""
        reported = np.full(self._flights, np.nan)
        if self._ticks:
            reported = np.where(self._capped, self._sum_n / self._ticks / self._mass_kg, np.nan)
        self._begin()
        return reported
