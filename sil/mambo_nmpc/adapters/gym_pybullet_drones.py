"""gym-pybullet-drones: the generated C in place of the position loop of its PID controller."""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from mambo_nmpc.adapters import demand_period, load, touches_floor
from mambo_sil.api.api_controller import Controller
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.frames import attitude_of_quaternion
from mambo_sil.flight.states import DroneState, TargetState

INSTALL: Final = "pip install git+https://github.com/utiasDSL/gym-pybullet-drones"
"""It is not on PyPI."""


def pybullet_control(drone_model: Any, controller: Controller) -> Any:
    """Return a `BaseControl` for one drone: the generated C commands the attitude loop of `DSLPIDControl`.

    drone_model: `DroneModel.CF2X` or `DroneModel.CF2P`.
    controller:  made with `height`; its steps have the control frequency of the environment.
    Raises PackageError without gym-pybullet-drones, ArgumentError for a controller of several drones.
    """
    if controller.n != 1:
        raise ArgumentError(f"controller: was made for {controller.n} drones; a BaseControl flies one")
    base = load("gym_pybullet_drones.control.DSLPIDControl", INSTALL).DSLPIDControl

    class NmpcControl(base):  # type: ignore[misc, valid-type] # a class of an untyped package
        """A position controller with the interface `BaseControl`."""

        def reset(self) -> None:
            """Forget the past."""
            super().reset()
            controller.reset()

        def _dslPIDPositionControl(  # noqa: N802, PLR0917 - as in the base class
            self,
            control_timestep: float,
            cur_pos: NDArray[np.float64],
            cur_quat: NDArray[np.float64],
            cur_vel: NDArray[np.float64],
            target_pos: NDArray[np.float64],
            target_rpy: NDArray[np.float64],
            target_vel: NDArray[np.float64],
        ) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
            """Return thrust (PWM), attitude (intrinsic X-Y-Z, rad) and position error (m)."""
            demand_period("control_timestep", control_timestep, controller)
            length_m, offset_m = map(self._getURDFParameter, ("length", "collision_z_offset"))
            contact = touches_floor(cur_pos, cur_vel, length_m / 2.0 - offset_m)
            state = DroneState.in_frame("NWU", cur_pos, cur_vel, attitude_of_quaternion(cur_quat), contact)
            target = TargetState.in_frame("NWU", target_pos, target_vel, yaw_rad=float(target_rpy[2]))
            mass_kg = float(self._getURDFParameter("m"))
            command = controller.step(state, target).attitude_thrust("NWU", mass_kg=mass_kg)
            speed_rpm = math.sqrt(command[3] / (4.0 * self.KF))
            thrust_pwm = (speed_rpm - self.PWM2RPM_CONST) / self.PWM2RPM_SCALE
            angles_rad = Rotation.from_euler("xyz", command[:3]).as_euler("XYZ")
            return thrust_pwm, angles_rad, np.asarray(target_pos) - np.asarray(cur_pos)

    return NmpcControl(drone_model=drone_model)
