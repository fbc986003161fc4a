"""crazyflow: the generated C flies all drones of a simulation, which has attitude control.

`attach` lets it command the drones whenever the simulation steps.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_nmpc.adapters import touches_floor
from mambo_nmpc.adapters.crazyflow_calls import CrazyflowCalls, can_call
from mambo_nmpc.curves import Trajectory, sample
from mambo_sil.api.api_controller import Controller
from mambo_sil.arguments import require
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.frames import attitude_of_quaternion, yaw_to_ned
from mambo_sil.flight.states import DroneState, TargetState

States = tuple[Any, Any, Any]
"""Positions (worlds, drones, 3), quaternions (worlds, drones, 4) and velocities, as in `sim.data.states`."""


class CrazyflowPilot:
    """Controllers for the drones of a simulation, which follow curves; each starts afresh with its world.

    trajectory: one curve for all drones, or one for each drone of a world.
    height_m:   height of curves that have none.
    yaw_rad:    heading of the targets, one for all or (worlds, drones); may be changed between commands.

    `mass_kg`, which may be changed too, scales the thrust: at first the masses of the simulation.
    """

    def __init__(
        self,
        sim: Any,
        controller: Controller,
        trajectory: Trajectory | Sequence[Trajectory],
        *,
        height_m: float = 1.0,
        yaw_rad: ArrayLike = 0.0,
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
        curves = trajectory if isinstance(trajectory, Sequence) else [trajectory]
        if len(curves) not in (1, sim.n_drones):
            raise ArgumentError(f"trajectory: has {len(curves)} curves; a world has {sim.n_drones} drones")
        self._batch = sim.n_worlds, sim.n_drones
        self._controller, self._curves, self._freq_hz = controller, curves, sim.freq
        self._height_m, self.yaw_rad = height_m, yaw_rad
        mass_kg = np.asarray(sim.data.params.mass, np.float64)
        self.mass_kg: ArrayLike = mass_kg.reshape(mass_kg.shape[:2] if mass_kg.size > 1 else ())

    def command(self, steps: Any, position: Any, quaternion: Any, velocity: Any) -> NDArray[np.float32]:
        """Return roll, pitch, yaw in rad and thrust in N (worlds, drones, 4), for `Sim.attitude_control`.

        steps:                          of each world since its reset (worlds, 1), `sim.data.core.steps`.
        position, quaternion, velocity: (worlds, drones, 3 or 4), as in `sim.data.states`.
        """
        step = np.asarray(steps).reshape(self._batch[0])
        begun = step < self.ticks
        if begun.any():
            self._controller.reset(which=np.broadcast_to(begun[:, np.newaxis], self._batch))
        seen = np.asarray(position), np.asarray(velocity), attitude_of_quaternion(np.asarray(quaternion))
        state = DroneState.in_frame("NWU", *seen, touches_floor(*seen[:2]))
        outcome = self._controller.step(state, self._target(step))
        command = outcome.attitude_thrust("NWU")
        command[..., 3] *= self.each(self.mass_kg)
        return command.astype(np.float32)

    def targets(self, ages: NDArray[Any]) -> TargetState:
        """Return where the drones shall be after steps (...): (..., 1) with one curve, or (..., drones)."""
        times_s = ages[..., np.newaxis] / self._freq_hz
        points = [sample(curve, times_s, height_m=self._height_m) for curve in self._curves]
        return TargetState(*(np.concatenate(part, axis=-2) for part in zip(*points, strict=True)))

    def wanted_rad(self) -> NDArray[np.float64]:
        """Return the headings of the targets (worlds, drones), in NED."""
        return self.each(yaw_to_ned("NWU", self.yaw_rad))

    def each(self, values: ArrayLike) -> NDArray[np.float64]:
        """Return numbers (worlds, drones) of one or of such."""
        return np.array(np.broadcast_to(np.asarray(values, np.float64), self._batch))

    def _target(self, step: NDArray[Any]) -> TargetState:
        """Return where the drones shall be after steps (worlds,)."""
        found = self.targets(ages_of(step))
        position_m, velocity_m_s, acceleration_m_s2 = (
            np.broadcast_to(part, (*self._batch, 3))
            for part in (found.position_m, found.velocity_m_s, found.acceleration_m_s2)
            if part is not None
        )
        return TargetState(position_m, velocity_m_s, acceleration_m_s2, self.wanted_rad())


def ages_of(step: NDArray[Any]) -> NDArray[Any]:
    """Return the ages of worlds (w,), or (1,) if all are of one age and need one target only."""
    return step[:1] if (step == step[0]).all() else step


def attach(
    sim: Any,
    controller: Controller,
    trajectory: Trajectory | Sequence[Trajectory],
    *,
    height_m: float = 1.0,
    yaw_rad: ArrayLike = 0.0,
    measure: Callable[[Any, Any, Any], States] | None = None,
) -> CrazyflowPilot:
    """Let a controller that commands the thrust fly all drones of a simulation along curves from now on.

    trajectory, yaw_rad: as for `CrazyflowPilot`, which is returned: there a heading is changed in flight.
                         A point of a curve may be asked for a second or more before it is flown.
    measure:             returns what the drones measure of positions, quaternions and velocities, arrays as
                         in `sim.data.states`, at every command; without it they know them.

    The simulation has attitude control and a frequency that is a multiple of the controller's. Its `step`
    then commands the drones before the steps in which that is due, by the age of the first world. Raises
    ArgumentError if they do not fit.
    """
    pilot = CrazyflowPilot(sim, controller, trajectory, height_m=height_m, yaw_rad=yaw_rad)
    advance = type(sim).step
    calls = None
    if measure is None and can_call(sim, controller):
        calls = CrazyflowCalls(controller, pilot.targets, pilot.ticks)

    def step(n_steps: int = 1) -> None:
        """Simulate all drones in all worlds for n time steps, and command them."""
        while n_steps > 0:
            steps = np.asarray(sim.data.core.steps)
            past = int(steps[0, 0]) % pilot.ticks
            if past == 0 and calls is not None:
                numbers = pilot.wanted_rad(), pilot.each(pilot.mass_kg)
                n_steps -= calls.advance(sim, n_steps, ages_of(steps.reshape(-1)), *numbers)
                continue
            if past == 0:
                seen = sim.data.states.pos, sim.data.states.quat, sim.data.states.vel
                if measure is not None:
                    seen = measure(*map(np.asarray, seen))
                sim.attitude_control(pilot.command(steps, *seen))
            count = min(n_steps, pilot.ticks - past)
            advance(sim, count)
            n_steps -= count

    sim.step = step
    return pilot
