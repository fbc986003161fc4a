"""PyFlyt: the generated C as a controller of a quadrotor, on its loops of the body rates (mode 0)."""

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from mambo_nmpc.adapters import demand_period
from mambo_sil.api.api_controller import Controller
from mambo_sil.arguments import require_number
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.frames import wrapped
from mambo_sil.flight.states import DroneState, TargetState

BASE_MODE: Final = 0
"""The mode below: rates of roll, pitch and yaw, and a throttle; no mode takes attitude and thrust."""
RATE_GAIN_1_S: Final = 20.0
"""Default of the gain from an error of the attitude to a rate, for which vehicle `cf2x-pyflyt` is fitted."""
MOST_RATE_RAD_S: Final = 8.0


def pyflyt_controller(drone: Any, controller: Controller, *, rate_gain_1_s: float = RATE_GAIN_1_S) -> type:
    """Return a controller class for `drone.register_controller(8, ..., base_mode=0)`.

    drone:         a `QuadX` of an `Aviary`; its control frequency is that of the controller.
    controller:    made with the true state's sensors, and with `height` unless its settings have `[height]`.
    rate_gain_1_s: rate over error of the attitude: that of the proportional loop which PyFlyt lacks.

    The set-point is that of mode 7, x, y, yaw, z, or these and the velocity (7,). `set_mode` starts afresh.
    Raises ArgumentError for a controller of several drones, or of another frequency.
    """
    require_number("rate_gain_1_s", rate_gain_1_s, 0.1, 100.0)
    if controller.n != 1:
        raise ArgumentError(f"controller: was made for {controller.n} drones; a ControlClass flies one")
    demand_period("control_period", drone.control_period, controller)
    mass_kg = float(drone.p.getDynamicsInfo(drone.Id, -1)[0])
    motors = drone.motors
    most_n = float(np.sum(np.ravel(motors.thrust_coef) * np.ravel(motors.max_rpm) ** 2))

    class PyflytControl:
        """A controller with the interface of `ControlClass`."""

        def __init__(self) -> None:
            self.reset()

        def reset(self) -> None:
            """Forget the past."""
            controller.reset()

        def step(self, state: NDArray[np.float64], setpoint: NDArray[np.float64]) -> NDArray[np.float64]:
            """Return rates of roll, pitch and yaw in rad/s and a throttle in 0..1 (4,).

            state: body rates, roll-pitch-yaw, velocity in the body and position (4, 3).
            """
            _, attitude_rad, body_m_s, position_m = state
            velocity_m_s = Rotation.from_euler("xyz", attitude_rad).apply(body_m_s)
            contact = bool(drone.p.getContactPoints(drone.Id))
            seen = DroneState.in_frame("NWU", position_m, velocity_m_s, attitude_rad, contact)
            x_m, y_m, yaw_rad, z_m, *rates_m_s = setpoint
            goal_m_s = rates_m_s or np.zeros(3)
            target = TargetState.in_frame("NWU", [x_m, y_m, z_m], goal_m_s, yaw_rad=yaw_rad)
            *angles_rad, thrust_n = controller.step(seen, target).attitude_thrust("NWU", mass_kg=mass_kg)
            error_rad = wrapped(np.asarray(angles_rad) - attitude_rad)
            rates_rad_s = np.clip(rate_gain_1_s * error_rad, -MOST_RATE_RAD_S, MOST_RATE_RAD_S)
            throttle = math.sqrt(min(max(thrust_n / most_n, 0.0), 1.0))
            return np.array([*rates_rad_s, throttle])

    return PyflytControl
