"""What a controller receives: the states of n drones and of their targets, in NED."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.numbers.representation import PREVIEW_TIMES
from mambo_sil.api.frames import FrameName, attitude_to_ned, vectors_to_ned, yaw_to_ned
from mambo_sil.arguments import as_numbers, require
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import ArgumentError


@dataclass(frozen=True, eq=False, init=False)
class DroneState:
    """The states of drones, in batches of any shape: () for one drone, (n,), (worlds, drones).

    Raises ArgumentError, which names the array, for other shapes and for what is no number.
    """

    position_m: FloatArray
    """x and y (..., 2), north and east, or ahead and right of where yaw is 0; or x, y, z (..., 3), z down."""
    velocity_m_s: FloatArray
    """Along the same axes (..., 2) or (..., 3)."""
    attitude_rad: FloatArray
    """Roll (right side down), pitch (nose up), yaw (clockwise from above) (..., 3)."""
    grounded: NDArray[np.bool_]
    """Whether the drone touches the floor (...); read with `[height]` in the settings only."""

    def __init__(
        self,
        position_m: ArrayLike,
        velocity_m_s: ArrayLike,
        attitude_rad: ArrayLike,
        grounded: ArrayLike = False,
    ) -> None:
        position = _vectors("position_m", position_m)
        batch = position.shape[:-1]
        object.__setattr__(self, "position_m", position)
        object.__setattr__(self, "velocity_m_s", _vectors("velocity_m_s", velocity_m_s, batch))
        attitude = as_numbers("attitude_rad", attitude_rad)
        _require_shape("attitude_rad", attitude, (*batch, 3))
        object.__setattr__(self, "attitude_rad", attitude)
        contact = np.asarray(grounded)
        good = contact.dtype == np.bool_ and contact.shape in ((), batch)
        require(good, "grounded", grounded, f"be a truth value, or such of shape {batch}")
        object.__setattr__(self, "grounded", np.broadcast_to(contact, batch))

    @classmethod
    def in_frame(
        cls,
        frame: FrameName,
        position_m: ArrayLike,
        velocity_m_s: ArrayLike,
        attitude_rad: ArrayLike,
        grounded: ArrayLike = False,
    ) -> Self:
        """Return the states of drones in another frame; the arrays have the shapes of a DroneState."""
        return cls(
            vectors_to_ned(frame, position_m, "position_m"),
            vectors_to_ned(frame, velocity_m_s, "velocity_m_s"),
            attitude_to_ned(frame, attitude_rad),
            grounded,
        )

    def as_in_frame(self, frame: FrameName) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return position, velocity and attitude in another frame."""
        return (
            vectors_to_ned(frame, self.position_m),
            vectors_to_ned(frame, self.velocity_m_s),
            attitude_to_ned(frame, self.attitude_rad),
        )

    @property
    def batch(self) -> tuple[int, ...]:
        """The shape of the batch."""
        return self.position_m.shape[:-1]


@dataclass(frozen=True, eq=False, init=False)
class TargetState:
    """Where drones shall be now, in batches of the same shape as their states.

    Raises ArgumentError, which names the array, for other shapes and for what is no number.
    """

    position_m: FloatArray
    """x and y (..., 2), or x, y, z (..., 3), z down."""
    velocity_m_s: FloatArray
    """Along the same axes (..., 2) or (..., 3)."""
    acceleration_m_s2: FloatArray | None
    """Along the same axes (..., 2) or (..., 3). Read, and then needed, with `target.acceleration = "given"`
    or `"preview"` only, z of it with `[height]`; z is read by the altitude loop too, if there."""
    yaw_rad: FloatArray | None
    """Heading (...), or None to keep the one of the first step."""
    preview_m_s2: FloatArray | None
    """Accelerations 0.05, 0.1 .. 0.3 s ahead (..., 6, 3), z down. Read, and then needed, with
    `target.acceleration = "preview"` only."""

    def __init__(
        self,
        position_m: ArrayLike,
        velocity_m_s: ArrayLike,
        acceleration_m_s2: ArrayLike | None = None,
        yaw_rad: ArrayLike | None = None,
        *,
        preview_m_s2: ArrayLike | None = None,
    ) -> None:
        position = _vectors("position_m", position_m)
        batch = position.shape[:-1]
        acceleration, yaw, preview = acceleration_m_s2, yaw_rad, preview_m_s2
        if preview is not None:
            preview = as_numbers("preview_m_s2", preview)
            _require_shape("preview_m_s2", preview, (*batch, PREVIEW_TIMES, 3))
        if acceleration is not None:
            acceleration = _vectors("acceleration_m_s2", acceleration, batch)
        if yaw is not None:
            yaw = as_numbers("yaw_rad", yaw)
            _require_shape("yaw_rad", yaw, (), batch)
            yaw = np.broadcast_to(yaw, batch)
        object.__setattr__(self, "position_m", position)
        object.__setattr__(self, "velocity_m_s", _vectors("velocity_m_s", velocity_m_s, batch))
        object.__setattr__(self, "acceleration_m_s2", acceleration)
        object.__setattr__(self, "yaw_rad", yaw)
        object.__setattr__(self, "preview_m_s2", preview)

    @classmethod
    def in_frame(
        cls,
        frame: FrameName,
        position_m: ArrayLike,
        velocity_m_s: ArrayLike,
        acceleration_m_s2: ArrayLike | None = None,
        yaw_rad: ArrayLike | None = None,
        *,
        preview_m_s2: ArrayLike | None = None,
    ) -> Self:
        """Return targets in another frame; the arrays have the shapes of a TargetState."""
        acceleration, yaw, preview = acceleration_m_s2, yaw_rad, preview_m_s2
        return cls(
            vectors_to_ned(frame, position_m, "position_m"),
            vectors_to_ned(frame, velocity_m_s, "velocity_m_s"),
            None if acceleration is None else vectors_to_ned(frame, acceleration, "acceleration_m_s2"),
            None if yaw is None else yaw_to_ned(frame, yaw),
            preview_m_s2=None if preview is None else vectors_to_ned(frame, preview, "preview_m_s2"),
        )

    @property
    def batch(self) -> tuple[int, ...]:
        """The shape of the batch."""
        return self.position_m.shape[:-1]


def _vectors(name: str, values: ArrayLike, batch: tuple[int, ...] | None = None) -> FloatArray:
    """Return vectors (*batch, 2) or (*batch, 3), without a batch of any; raises ArgumentError for others."""
    array = as_numbers(name, values)
    if batch is not None:
        _require_shape(name, array, (*batch, 2), (*batch, 3))
    elif array.ndim == 0 or array.shape[-1] not in (2, 3):
        raise ArgumentError(f"{name}: has shape {array.shape}; it must be (..., 2) or (..., 3)")
    return array


def _require_shape(name: str, array: FloatArray, *shapes: tuple[int, ...]) -> None:
    if array.shape not in shapes:
        raise ArgumentError(f"{name}: has shape {array.shape}; it must be {' or '.join(map(str, shapes))}")
