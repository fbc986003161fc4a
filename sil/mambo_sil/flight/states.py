"""What n controllers receive, the states of drones and of their targets in NED, and what a step returns."""

import math
from dataclasses import dataclass
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_sil.arguments import of_shape, require, require_number
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Seen, beside
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.frames import (
    FrameName,
    attitude_to_ned,
    body_to_ned,
    command_in_frame,
    vectors_to_ned,
    with_columns,
    yaw_to_ned,
)


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
    on_ground: NDArray[np.bool_]
    """Whether the drone touches the floor (...); read with `[height]` in the settings only."""
    rates_rad_s: FloatArray | None = None
    """About the axes of the body, forward, right, down (..., 3); read where `sensors.lever_m` of the vehicle
    is not 0, or None."""

    def __init__(
        self,
        position_m: ArrayLike,
        velocity_m_s: ArrayLike,
        attitude_rad: ArrayLike,
        on_ground: ArrayLike = False,
        *,
        rates_rad_s: ArrayLike | None = None,
    ) -> None:
        position = _vectors("position_m", position_m)
        batch = position.shape[:-1]
        object.__setattr__(self, "position_m", position)
        object.__setattr__(self, "velocity_m_s", _vectors("velocity_m_s", velocity_m_s, batch))
        object.__setattr__(self, "attitude_rad", of_shape("attitude_rad", attitude_rad, (*batch, 3)))
        contact = np.asarray(on_ground)
        good = contact.dtype == np.bool_ and contact.shape in ((), batch)
        require(good, "on_ground", on_ground, f"be a truth value, or such of shape {batch}")
        object.__setattr__(self, "on_ground", np.broadcast_to(contact, batch))
        rates = None if rates_rad_s is None else of_shape("rates_rad_s", rates_rad_s, (*batch, 3))
        object.__setattr__(self, "rates_rad_s", rates)

    @classmethod
    def in_frame(
        cls,
        frame: FrameName,
        position_m: ArrayLike,
        velocity_m_s: ArrayLike,
        attitude_rad: ArrayLike,
        on_ground: ArrayLike = False,
        *,
        rates_rad_s: ArrayLike | None = None,
    ) -> Self:
        """Return the states of drones in another frame; the arrays have the shapes of a DroneState."""
        return cls(
            vectors_to_ned(frame, position_m, "position_m"),
            vectors_to_ned(frame, velocity_m_s, "velocity_m_s"),
            attitude_to_ned(frame, attitude_rad),
            on_ground,
            rates_rad_s=None if rates_rad_s is None else body_to_ned(frame, rates_rad_s),
        )

    def at_centre(self, lever_m: tuple[float, float, float]) -> Self:
        """Return the states at the centre of mass of drones that are measured `lever_m` (body) from it.

        Raises ArgumentError without rates.
        """
        if self.rates_rad_s is None:
            raise ArgumentError(
                f"state: rates_rad_s is missing; sensors.lever_m = {list(lever_m)} of the vehicle wants it; "
                "leave lever_m out where position and velocity are those of the centre of mass"
            )
        axes = self.position_m.shape[-1]
        columns = [np.zeros((3, math.prod(self.batch))) for _ in range(2)]
        for column, vectors in zip(columns, (self.position_m, self.velocity_m_s), strict=True):
            column[:axes] = vectors.reshape(-1, axes).T
        turned = (vectors.reshape(-1, 3).T for vectors in (self.attitude_rad, self.rates_rad_s))
        x, y, z = lever_m
        centre = beside(Seen(*columns, *map(np.ascontiguousarray, turned)), (-x, -y, -z))
        position_m, velocity_m_s = (
            np.ascontiguousarray(moved[:axes].T).reshape(self.position_m.shape)
            for moved in (centre.position_m, centre.velocity_m_s)
        )
        return type(self)(
            position_m, velocity_m_s, self.attitude_rad, self.on_ground, rates_rad_s=self.rates_rad_s
        )

    def to_frame(self, frame: FrameName) -> tuple[FloatArray, FloatArray, FloatArray]:
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
    """Along the same axes (..., 2) or (..., 3), or None if it is not known. Read with a quadratic cost, z
    of it with `[height]`; z is read by the altitude loop too, if there."""
    ahead_m_s2: FloatArray | None
    """The acceleration 0.05 s later, or None if it is not known. Read likewise."""
    yaw_rad: FloatArray | None
    """Heading (...), or None to keep the one of the first step."""

    def __init__(
        self,
        position_m: ArrayLike,
        velocity_m_s: ArrayLike,
        acceleration_m_s2: ArrayLike | None = None,
        yaw_rad: ArrayLike | None = None,
        *,
        ahead_m_s2: ArrayLike | None = None,
    ) -> None:
        position = _vectors("position_m", position_m)
        batch = position.shape[:-1]
        acceleration, yaw = acceleration_m_s2, yaw_rad
        if acceleration is not None:
            acceleration = _vectors("acceleration_m_s2", acceleration, batch)
        elif ahead_m_s2 is not None:
            raise ArgumentError("target: ahead_m_s2 wants acceleration_m_s2 beside it")
        ahead = None if ahead_m_s2 is None else _vectors("ahead_m_s2", ahead_m_s2, batch)
        if yaw is not None:
            yaw = np.broadcast_to(of_shape("yaw_rad", yaw, (), batch), batch)
        object.__setattr__(self, "position_m", position)
        object.__setattr__(self, "velocity_m_s", _vectors("velocity_m_s", velocity_m_s, batch))
        object.__setattr__(self, "acceleration_m_s2", acceleration)
        object.__setattr__(self, "ahead_m_s2", ahead)
        object.__setattr__(self, "yaw_rad", yaw)

    @classmethod
    def in_frame(
        cls,
        frame: FrameName,
        position_m: ArrayLike,
        velocity_m_s: ArrayLike,
        acceleration_m_s2: ArrayLike | None = None,
        yaw_rad: ArrayLike | None = None,
        *,
        ahead_m_s2: ArrayLike | None = None,
    ) -> Self:
        """Return targets in another frame; the arrays have the shapes of a TargetState."""
        acceleration, ahead, yaw = acceleration_m_s2, ahead_m_s2, yaw_rad
        return cls(
            vectors_to_ned(frame, position_m, "position_m"),
            vectors_to_ned(frame, velocity_m_s, "velocity_m_s"),
            None if acceleration is None else vectors_to_ned(frame, acceleration, "acceleration_m_s2"),
            None if yaw is None else yaw_to_ned(frame, yaw),
            ahead_m_s2=None if ahead is None else vectors_to_ned(frame, ahead, "ahead_m_s2"),
        )

    @property
    def known(self) -> int:
        """0 if position and velocity are known, 1 if the acceleration is, 2 if the one ahead is too."""
        return (self.acceleration_m_s2 is not None) + (self.ahead_m_s2 is not None)

    @property
    def batch(self) -> tuple[int, ...]:
        """The shape of the batch."""
        return self.position_m.shape[:-1]


@dataclass(frozen=True, eq=False)
class StepOutcome:
    """The commands of one step, in batches of the shape of the states.

    command_rad: (..., 2) roll and pitch, never beyond the tilt limit.
    status:      (...) 0, or why an input was refused, such as NaN or a position out of range
                 (`mambo_codegen.methods.shared.inputs.Status`).
    saturated:   (...) whether a command lies at the tilt limit; None with a 1-norm.
    cost:        (...) of the plan; None with a quadratic cost, as the next.
    plan_rad:    (..., control, 2) the moves.
    active_limits: (...) the limits that act (`mambo_codegen.methods.shared.limits.ActiveLimit`), if any.
    thrust_m_s2: (...) thrust over mass; None without `[height]` in the settings and `height`, as the next.
    yaw_rad:     (...) heading.
    """

    command_rad: NDArray[Any]
    status: NDArray[np.int64]
    saturated: NDArray[np.bool_] | None = None
    cost: NDArray[Any] | None = None
    plan_rad: NDArray[Any] | None = None
    active_limits: NDArray[np.int64] | None = None
    thrust_m_s2: NDArray[Any] | None = None
    yaw_rad: FloatArray | None = None

    def attitude_thrust(
        self, frame: FrameName, *, mass_kg: float | None = None, most_thrust_m_s2: float | None = None
    ) -> FloatArray:
        """Return roll, pitch, yaw and thrust (..., 4), angles in a frame by name.

        The thrust is over the mass, in m/s^2; with `mass_kg` in N; with `most_thrust_m_s2`, the largest
        thrust over the mass, a share of it, at most 1. Raises ArgumentError without a thrust.
        """
        if self.thrust_m_s2 is None or self.yaw_rad is None:
            raise ArgumentError(
                'attitude_thrust needs settings with [height], or a controller made with height = "pid", say'
            )
        if mass_kg is not None and most_thrust_m_s2 is not None:
            raise ArgumentError(f"mass_kg = {mass_kg!r} must be left out with most_thrust_m_s2, or that")
        thrust = np.asarray(self.thrust_m_s2, np.float64)
        if mass_kg is not None:
            require_number("mass_kg", mass_kg, 0.001, 1000.0)
            thrust = thrust * mass_kg
        if most_thrust_m_s2 is not None:
            require_number("most_thrust_m_s2", most_thrust_m_s2, 1.0, 1000.0)
            thrust = np.minimum(thrust / most_thrust_m_s2, 1.0)
        command = np.empty((*thrust.shape, 4))
        command[..., :2] = command_in_frame(frame, self.command_rad)
        command[..., 2] = yaw_to_ned(frame, self.yaw_rad)
        command[..., 3] = thrust
        return command


State = TypeVar("State", DroneState, TargetState)


def unchecked(kind: type[State], **members: Any) -> State:
    """Return a state or target whose members are known to be right; checks take longer than a step."""
    found = object.__new__(kind)
    for name, value in members.items():
        object.__setattr__(found, name, value)
    return found


def _vectors(name: str, values: ArrayLike, batch: tuple[int, ...] | None = None) -> FloatArray:
    """Return vectors (*batch, 2) or (*batch, 3), without a batch of any; raises ArgumentError for others."""
    if batch is None:
        return with_columns(name, values, 2, 3)
    return of_shape(name, values, (*batch, 2), (*batch, 3))
