"""RotorPy: the generated C as a controller of its simulator, with the control abstraction `cmd_ctatt`."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from mambo_nmpc.adapters import touches_floor
from mambo_sil.api.api_controller import Controller
from mambo_sil.arguments import require_kind, require_number
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.frames import attitude_of_quaternion
from mambo_sil.flight.states import DroneState, TargetState


class RotorpyController:
    """What `rotorpy.environments.Environment` and `simulate` call at every step, instead of `SE3Control`.

    The simulation has the rate of the controller: `sim_rate=100` for one with steps of 10 ms.
    With `enable_ground` the vehicle has the ground of that argument of `Multirotor`, at height 0.
    Raises ArgumentError for a controller of several drones, or another mass than a number.
    """

    def __init__(self, controller: Controller, mass_kg: float, *, enable_ground: bool = False) -> None:
        require_kind("controller", controller, Controller, "a Controller")
        require_number("mass_kg", mass_kg, 0.001, 1000.0)
        if controller.n != 1:
            raise ArgumentError(f"controller: was made for {controller.n} drones; RotorPy simulates one")
        self._controller, self._mass_kg, self._enable_ground = controller, mass_kg, enable_ground

    def update(self, t: float, state: Mapping[str, Any], flat_output: Mapping[str, Any]) -> dict[str, Any]:
        """Return the commands for the vehicle: `cmd_thrust` in N and the attitude `cmd_q` [x, y, z, w].

        t:           time in s; at 0 the controller starts afresh.
        state:       `x`, `v` and `q` of the drone.
        flat_output: `x`, `x_dot`, `x_ddot` and `yaw` of the trajectory.
        The other commands, which RotorPy records, are 0.
        """
        if t == 0.0:
            self._controller.reset()
        contact = self._enable_ground & touches_floor(state["x"], state["v"])
        attitude = attitude_of_quaternion(state["q"])
        seen = DroneState.in_frame("NWU", state["x"], state["v"], attitude, contact)
        goal = TargetState.in_frame(
            "NWU",
            flat_output["x"],
            flat_output["x_dot"],
            flat_output.get("x_ddot"),
            flat_output.get("yaw", 0.0),
        )
        outcome = self._controller.step(seen, goal)
        *angles_rad, thrust_n = outcome.attitude_thrust("NWU", mass_kg=self._mass_kg)
        return {
            "cmd_motor_speeds": np.zeros(4),
            "cmd_motor_thrusts": np.zeros(4),
            "cmd_thrust": float(thrust_n),
            "cmd_moment": np.zeros(3),
            "cmd_q": Rotation.from_euler("xyz", angles_rad).as_quat(),
            "cmd_w": np.zeros(3),
            "cmd_v": np.zeros(3),
            "cmd_acc": np.zeros(3),
        }
