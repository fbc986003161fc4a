"""What a controller receives: the states of n drones and of their targets, in NED."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from mambo_sil.arguments import as_numbers
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.api.frames import FrameName, attitude_to_ned, horizontal_to_ned


@dataclass(frozen=True, eq=False, init=False)
class DroneState:
    """The states of n drones; for one drone the arrays may be (2,), (2,) and (3,).

    Raises ArgumentError, which names the array, for other shapes and for what is no number.
    """

    position_m: FloatArray
    """x and y (n, 2): north and east, or ahead and right of where yaw is 0."""
    velocity_m_s: FloatArray
    """Along the same axes (n, 2)."""
    attitude_rad: FloatArray
    """Roll (right side down), pitch (nose up), yaw (clockwise from above) (n, 3)."""

    def __init__(self, position_m: ArrayLike, velocity_m_s: ArrayLike, attitude_rad: ArrayLike) -> None:
        given = {"position_m": position_m, "velocity_m_s": velocity_m_s, "attitude_rad": attitude_rad}
        _fill(self, given, {"position_m": 2, "velocity_m_s": 2, "attitude_rad": 3})

    @classmethod
    def in_frame(
        cls, frame: FrameName, position_m: ArrayLike, velocity_m_s: ArrayLike, attitude_rad: ArrayLike
    ) -> Self:
        """Return the states of drones in another frame.

        Vectors are (n, 2) or (n, 3), of which z is left out, angles (n, 3).
        """
        return cls(
            horizontal_to_ned(frame, position_m, "position_m"),
            horizontal_to_ned(frame, velocity_m_s, "velocity_m_s"),
            attitude_to_ned(frame, attitude_rad),
        )


@dataclass(frozen=True, eq=False, init=False)
class TargetState:
    """Where n drones shall be now; for one drone the arrays may be (2,).

    Raises ArgumentError, which names the array, for other shapes and for what is no number.
    """

    position_m: FloatArray
    """x and y (n, 2)."""
    velocity_m_s: FloatArray
    """Along the same axes (n, 2)."""
    acceleration_m_s2: FloatArray | None
    """Along the same axes (n, 2); read, and then needed, with `target.acceleration = "given"` only."""

    def __init__(
        self, position_m: ArrayLike, velocity_m_s: ArrayLike, acceleration_m_s2: ArrayLike | None = None
    ) -> None:
        given = {"position_m": position_m, "velocity_m_s": velocity_m_s}
        if acceleration_m_s2 is None:
            object.__setattr__(self, "acceleration_m_s2", None)
        else:
            given["acceleration_m_s2"] = acceleration_m_s2
        _fill(self, given, dict.fromkeys(given, 2))

    @classmethod
    def in_frame(
        cls,
        frame: FrameName,
        position_m: ArrayLike,
        velocity_m_s: ArrayLike,
        acceleration_m_s2: ArrayLike | None = None,
    ) -> Self:
        """Return targets whose vectors (n, 2) or (n, 3) are in another frame."""
        return cls(
            horizontal_to_ned(frame, position_m, "position_m"),
            horizontal_to_ned(frame, velocity_m_s, "velocity_m_s"),
            None
            if acceleration_m_s2 is None
            else horizontal_to_ned(frame, acceleration_m_s2, "acceleration_m_s2"),
        )


def _fill(record: Any, fields: dict[str, ArrayLike], columns: dict[str, int]) -> None:
    """Set the fields of a record to arrays (n, columns); raises ArgumentError unless all have the same n."""
    n = None
    for name, values in fields.items():
        array = np.atleast_2d(as_numbers(name, values))
        n = len(array) if n is None else n
        if array.shape != (n, columns[name]):
            given = np.shape(values)
            raise ArgumentError(f"{name}: has shape {given}; it must be ({n}, {columns[name]})")
        object.__setattr__(record, name, array)
