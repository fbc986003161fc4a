"""Attitude loop and mixer of a vehicle.toml, for worlds that have motors only: Drake, MuJoCo, your own."""

from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_sil.arguments import of_shape, require, require_choice
from mambo_sil.drone.plant.airframe import airframe_of
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.first_order import FirstOrderDrone
from mambo_sil.drone.plant.loops import Demand, MotorLoop
from mambo_sil.drone.plant.rotors import limit_commands
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.frames import FRAMES, FrameName, attitude_of_quaternion, attitude_to_ned, wrapped

ROTORS: Final = 4
_FLIPPED: Final = np.array([1.0, -1.0, -1.0])
"""From a body with axes forward, left, up to one with axes forward, right, down, and back."""


class Motors:
    """What turns attitude and thrust of n drones into the thrusts of their rotors, once in every tick.

    vehicle:  the file whose [attitude] is the loop, of kind "mambo" (a PID to torques) or "cascade", with the
              [rotors], which limit the motors, and the inertia.
    frame:    of the world; the body is forward, left, up with "NWU" and "ENU", else forward, right, down.
    rotors_m: (4, 2) where the rotors are along the first two axes of the body; without it the X of the file:
              front left, front right, rear right, rear left.
    reaction: (4,) 1 for a rotor whose torque turns the drone about the third axis of the body, else -1;
              without it that of the X.

    Raises ArgumentError for a vehicle without such a loop, and for rotors that cannot turn the drone about
    each axis.
    """

    def __init__(
        self,
        vehicle: str | Path | Vehicle,
        n: int = 1,
        *,
        frame: FrameName = "NWU",
        rotors_m: ArrayLike | None = None,
        reaction: ArrayLike | None = None,
    ) -> None:
        require_choice("frame", frame, FRAMES)
        if not isinstance(vehicle, Vehicle):
            vehicle = Vehicle.of(vehicle_toml.load(str(vehicle)))
        loop = vehicle.loop
        if isinstance(loop, FirstOrderDrone):
            kind = vehicle.drone.attitude.kind
            raise ArgumentError(
                f'vehicle: {vehicle.drone.name} has attitude.kind = "{kind}"; it must be "mambo" or '
                '"cascade", with [rotors]'
            )
        self.n, self.tick_s = n, vehicle.drone.step_s
        self._loop: MotorLoop = loop
        self._nominal = airframe_of(vehicle.drone)
        self._frame, self._signs = frame, np.ones(3) if frame == "NED" else _FLIPPED
        self._shares = self._mixer(rotors_m, reaction)
        self._memory = np.zeros((loop.rows, n))

    def reset(self, which: ArrayLike | None = None) -> None:
        """Forget the integrals of all drones, or of those that `which` (n,) chooses."""
        chosen = np.ones(self.n, np.bool_) if which is None else np.asarray(which)
        good = chosen.dtype == np.bool_ and chosen.shape == (self.n,)
        require(good, "which", which, f"be {self.n} truth values, one for each drone")
        self._memory = np.where(chosen, 0.0, self._memory)

    def thrusts_n(
        self, command: ArrayLike, quaternion: ArrayLike, rates_rad_s: ArrayLike
    ) -> NDArray[np.float64]:
        """Return the thrust of each rotor in N (n, 4), of a single drone (4,); call it every `tick_s`.

        command:     (n, 4) roll, pitch, yaw and thrust in N, as `StepOutcome.attitude_thrust` gives them in
                     this frame with `mass_kg`.
        quaternion:  (n, 4) x, y, z, w of the attitude, in this frame.
        rates_rad_s: (n, 3) about the axes of the body.
        Raises ArgumentError for other shapes.
        """
        batch = () if self.n == 1 and np.ndim(command) == 1 else (self.n,)
        asked = of_shape("command", command, (*batch, 4)).reshape(self.n, 4)
        turned = of_shape("quaternion", quaternion, (*batch, 4)).reshape(self.n, 4)
        rates = of_shape("rates_rad_s", rates_rad_s, (*batch, 3)).reshape(self.n, 3)
        angles = attitude_to_ned(self._frame, attitude_of_quaternion(turned))
        wanted = attitude_to_ned(self._frame, asked[:, :3])
        demand = Demand(
            command_rad=np.ascontiguousarray(wanted[:, :2].T),
            yaw_rad=angles[:, 2] + wrapped(wanted[:, 2] - angles[:, 2]),
            thrust_n=asked[:, 3],
            angles_rad=np.ascontiguousarray(angles.T),
            rates_rad_s=np.ascontiguousarray((rates * self._signs).T),
        )
        wrench, self._memory = self._loop.demand_wrench(demand, self._memory)
        commands = limit_commands(self._nominal, self._shares[:, :, np.newaxis] * wrench[:, np.newaxis, :])
        return (self._nominal.thrust_per_command_n * commands.T).reshape((*batch, ROTORS))

    def _mixer(self, rotors_m: ArrayLike | None, reaction: ArrayLike | None) -> FloatArray:
        """Return the motor commands (wrench, rotors) of a thrust, and of torques forward, right, down."""
        nominal = self._nominal
        flips = self._signs[1]
        if rotors_m is None:
            arm = nominal.rotor_offset_m
            places = np.array([[arm, -arm], [arm, arm], [-arm, arm], [-arm, -arm]])
        else:
            places = of_shape("rotors_m", rotors_m, (ROTORS, 2)) * [1.0, flips]
        if reaction is None:
            turns = np.array([-1.0, 1.0, -1.0, 1.0])
        else:
            turns = of_shape("reaction", reaction, (ROTORS,)) * flips
        require(bool((np.abs(turns) == 1.0).all()), "reaction", reaction, "be 1 or -1 of each rotor")
        wrench = np.stack(
            [np.ones(ROTORS), -places[:, 1], places[:, 0], turns * float(nominal.torque_per_thrust_m)]
        )
        if np.linalg.matrix_rank(wrench) < ROTORS:
            raise ArgumentError("rotors_m, reaction: two of thrust, roll, pitch and yaw are one")
        return np.linalg.inv(wrench).T / nominal.thrust_per_command_n
