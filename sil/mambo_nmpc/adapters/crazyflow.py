"""crazyflow: the generated C flies all drones of a simulation, which has attitude control.

`attach` puts it into the compiled step of the simulation, before the attitude controller.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_nmpc.adapters import packages
from mambo_nmpc.adapters.contact import touches_floor
from mambo_nmpc.curves import Trajectory, sample
from mambo_sil.api.api_controller import Controller
from mambo_sil.api.frames import attitude_of_quaternion
from mambo_sil.api.states import DroneState, TargetState
from mambo_sil.arguments import require
from mambo_sil.errors import ArgumentError


class CrazyflowPilot:
    """Controllers for the drones of a simulation, which follow a curve; each starts afresh with its world."""

    def __init__(
        self, sim: Any, controller: Controller, trajectory: Trajectory, *, height_m: float, yaw_rad: float
    ) -> None:
        drones, ticks = sim.n_worlds * sim.n_drones, sim.freq * controller.update_period_s
        if controller.n != drones:
            raise ArgumentError(
                f"controller: was made for {controller.n} drones; the simulation has {drones}"
            )
        whole = round(ticks) >= 1 and abs(ticks - round(ticks)) < 1e-9
        require(whole, "sim.freq", sim.freq, f"be a multiple of {1.0 / controller.update_period_s:g} Hz")
        self.ticks = round(ticks)
        """Steps of the simulation from one command to the next."""
        self._controller, self._trajectory = controller, trajectory
        self._height_m, self._yaw_rad, self._freq_hz = height_m, yaw_rad, sim.freq
        self._mass_kg = float(np.ravel(np.asarray(sim.data.params.mass))[0])

    def command(self, steps: Any, position: Any, quaternion: Any, velocity: Any) -> NDArray[np.float32]:
        """Return roll, pitch, yaw in rad and thrust in N (worlds, drones, 4), for `Sim.attitude_control`.

        steps:                          of each world since its reset (worlds, 1), `sim.data.core.steps`.
        position, quaternion, velocity: (worlds, drones, 3 or 4), as in `sim.data.states`.
        """
        batch = np.shape(position)[:2]
        step = np.asarray(steps).reshape(batch[0], 1)
        begun = np.broadcast_to(step < self.ticks, batch)
        if begun.any():
            self._controller.reset(which=begun)
        now = sample(self._trajectory, step / self._freq_hz, "NWU", height_m=self._height_m)
        position_m, velocity_m_s, acceleration_m_s2 = (np.broadcast_to(part, (*batch, 3)) for part in now)
        goal = TargetState.in_frame("NWU", position_m, velocity_m_s, acceleration_m_s2, self._yaw_rad)
        seen = np.asarray(position), np.asarray(velocity), attitude_of_quaternion(np.asarray(quaternion))
        state = DroneState.in_frame("NWU", *seen, touches_floor(*seen[:2]))
        outcome = self._controller.step(state, goal)
        return outcome.attitude_thrust("NWU", mass_kg=self._mass_kg).astype(np.float32)


def attach(
    sim: Any, controller: Controller, trajectory: Trajectory, *, height_m: float = 1.0, yaw_rad: float = 0.0
) -> None:
    """Let a controller, made with `height`, fly all drones of a simulation along a curve from now on.

    The simulation has attitude control, a frequency that is a multiple of the controller's, and one step of
    all worlds at a time. Raises ArgumentError if they do not fit, PackageError without JAX.
    """
    jax = packages.load("jax", "pip install crazyflow jax jaxlib")
    callbacks = packages.load("jax.experimental", "pip install crazyflow jax jaxlib")
    pilot = CrazyflowPilot(sim, controller, trajectory, height_m=height_m, yaw_rad=yaw_rad)
    staged = sim.data.controls.attitude.staged_cmd
    shape = jax.ShapeDtypeStruct(staged.shape, np.float32)

    def fly(data: Any) -> Any:
        seen = data.core.steps, data.states.pos, data.states.quat, data.states.vel
        attitude = data.controls.attitude
        command = jax.lax.cond(
            data.core.steps[0, 0] % pilot.ticks == 0,
            lambda: callbacks.io_callback(pilot.command, shape, *seen).astype(staged.dtype),
            lambda: attitude.staged_cmd,
        )
        controls = data.controls.replace(attitude=attitude.replace(staged_cmd=command))
        return data.replace(controls=controls)

    sim.step_pipeline["mambo_nmpc"] = fly
    sim.step_pipeline.move_to_end("mambo_nmpc", last=False)
    sim.build_step_fn()
