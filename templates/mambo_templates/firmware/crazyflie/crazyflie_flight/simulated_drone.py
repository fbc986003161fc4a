"""The drone of `fly.py --simulate`.

It takes the calls of fly.py to cflib and plans as the firmware does; mambo-nmpc flies it.
"""

import math
from bisect import bisect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .calls import Packed, Rows, Watch
from .ends import RefusedError
from .figures import Motion, Piece, at, join, move
from .values import VALUES

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from mambo_nmpc import FlightResult


class Planned:
    """What the calls asked for over time: a trajectory of mambo_nmpc.fly, whose y has the other sign."""

    def __init__(self) -> None:
        self._starts_s, self._parts = [0.0], [[_rest(0.0, 0.0, 0.0)]]
        if VALUES.has_target_observer:
            self.known = 1
            """The app tells the controller the acceleration, not the one ahead."""

    def plan(self, time_s: float, pieces: Sequence[Piece]) -> None:
        """Fly pieces from a time on."""
        self._starts_s.append(time_s)
        self._parts.append([*pieces])

    def at(self, time_s: float) -> list[Motion]:
        """Return the motions of x, y, z and yaw at a time."""
        part = bisect(self._starts_s, time_s) - 1
        return at(self._parts[part], time_s - self._starts_s[part])

    def target(self, time_s: "ArrayLike") -> "NDArray[np.float64]":
        """Return [x, y, vx, vy] (..., 4)."""
        return self._table(time_s, lambda x, y, _: [x[0], -y[0], x[1], -y[1]])

    def acceleration(self, time_s: "ArrayLike") -> "NDArray[np.float64]":
        """Return [ax, ay] (..., 2)."""
        return self._table(time_s, lambda x, y, _: [x[2], -y[2]])

    def vertical(self, time_s: "ArrayLike") -> "NDArray[np.float64]":
        """Return height, climb and vertical acceleration (..., 3)."""
        return self._table(time_s, lambda _, __, z: z[:3])

    def _table(
        self, time_s: "ArrayLike", values: Callable[[Motion, Motion, Motion], list[float]]
    ) -> "NDArray[np.float64]":
        import numpy as np

        times_s = np.asarray(time_s, float)
        found = np.array([values(*self.at(float(now))[:3]) for now in times_s.ravel()])
        return found.reshape(*times_s.shape, -1)


@dataclass
class SimulatedMemory:
    """The memory of trajectories, which is also the list of all memories."""

    trajectory: list[Packed] = field(default_factory=list)
    written: dict[int, Piece] = field(default_factory=dict)

    def get_mems(self, _: int) -> list["SimulatedMemory"]:
        """Return this one."""
        return [self]

    def write_data(self, finished: Callable[..., None], _: Callable[..., None], address: int) -> None:
        """Keep a piece."""
        (piece,) = self.trajectory
        if isinstance(piece, Piece):
            self.written[address] = piece
        finished()


class SimulatedDrone:
    """A drone and its clock; `cf` takes the calls, `fly` flies what they ask for."""

    def __init__(self, folder: Path, vehicle: str, sensors: str | None = None) -> None:
        try:
            from mambo_nmpc import Controller, MamboNmpcError, Vehicle
        except ImportError as error:
            cure = "in the folder of its source, pip install ."
            raise RefusedError(f"--simulate needs mambo-nmpc ({error}): {cure}") from error
        try:
            self._controller = Controller.from_file(folder / "controller.toml")
            is_file = vehicle.endswith(".toml")
            self._vehicle = Vehicle.from_file(vehicle) if is_file else Vehicle.from_preset(vehicle)
        except MamboNmpcError as error:
            raise RefusedError(str(error)) from error
        digest = self._controller.settings.digest
        if not digest.startswith(VALUES.digest):
            ours = f"this folder {VALUES.digest[:8]}: run mambo-nmpc generate again"
            raise RefusedError(f"controller.toml has settings {digest[:8]}, {ours}")
        self._name, self._time_s = vehicle, 0.0
        self._sensors = sensors or self._vehicle.drone.sensors.kind
        self._pieces: list[Piece] = []
        self.planned = Planned()
        self.is_real, self.slowed, self.slow_until_s, self.accepted_s = False, 0, 0.0, 0.0
        self.latest: dict[str, float] = {}
        self.rows: Rows = {}
        self.mem = SimulatedMemory()
        self.cf = self.high_level_commander = self.commander = self

    def watch_by(self, watch: Watch | None) -> None:
        """Watch nothing: it flies after all calls."""

    def now(self) -> float:
        """Return the time in s."""
        return self._time_s

    def wait(self, duration_s: float) -> None:
        """Let time pass."""
        self._time_s += duration_s

    def _plan(self, *pieces: Piece) -> None:
        self.planned.plan(self._time_s, pieces)

    def takeoff(self, height: float, duration_s: float, /, *, yaw: float | None) -> None:  # noqa: ARG002 - it keeps its heading
        """Climb to a height."""
        x, y, z, _ = (axis[0] for axis in self.planned.at(self._time_s))
        self._plan(Piece(duration_s, [x], [y], move(duration_s, z, height), [0.0]))

    land = takeoff

    def go_to(self, x: float, y: float, z: float, yaw: float, duration_s: float, /) -> None:
        """Fly to a place."""
        now = self.planned.at(self._time_s)[:3]
        along_x, along_y, upwards = (
            join(duration_s, [*start[:3], 0.0], (end, 0.0, 0.0, 0.0))
            for start, end in zip(now, (x, y, z), strict=True)
        )
        self._plan(Piece(duration_s, along_x, along_y, upwards, [yaw]))

    def define_trajectory(self, _: int, __: int, pieces: int, /) -> None:
        """Make a trajectory of the first pieces in the memory."""
        written = self.mem.written
        self._pieces = [written[address] for address in sorted(written)[:pieces]]

    def start_trajectory(self, _: int, /) -> None:
        """Fly the trajectory."""
        self._plan(*self._pieces)

    def send_full_state_setpoint(
        self,
        position: list[float],
        velocity: list[float],
        acceleration: list[float],
        *_: object,
    ) -> None:
        """Carry a full state on."""
        x, y, z = ([p, v, a / 2.0] for p, v, a in zip(position, velocity, acceleration, strict=True))
        self._plan(Piece(math.inf, x, y, z, [0.0]))

    def send_notify_setpoint_stop(self) -> None:
        """Rest where the target is."""
        self._plan(_rest(*(axis[0] for axis in self.planned.at(self._time_s)[:3])))

    stop = send_stop_setpoint = send_notify_setpoint_stop

    def fly(self, heading: float) -> Rows:
        """Fly, print the errors, and return the rows of the log."""
        import numpy as np

        from mambo_nmpc import MamboNmpcError, fly

        sensors: Any = self._sensors  # `fly` says which names there are
        try:
            flown = fly(
                self._controller,
                self._vehicle,
                self.planned,
                duration_s=self._time_s,
                yaw_rad=-heading,
                sensors=sensors,
            )
        except MamboNmpcError as error:
            raise RefusedError(str(error)) from error
        trace = flown.trace
        errors = np.hypot(*(trace.position_m[:, 0, :2] - trace.target[:, 0, :2]).T)
        end = "it crashed" if flown.crashed[0] else "it landed"
        off = f"{100 * errors.mean():.1f} cm off in the mean, {100 * errors.max():.1f} cm at most"
        print(f"simulated on {self._name}, sensors {self._sensors}: {off}; {end}")
        return self._rows(flown)

    def _rows(self, flown: "FlightResult") -> Rows:
        trace: Any = flown.trace
        seen = trace if self._sensors == "true" else trace.as_seen()
        aims = zip(
            self.planned.acceleration(trace.time_s).tolist(),
            self.planned.vertical(trace.time_s).tolist(),
            strict=True,
        )
        return {
            round(1000 * time_s): _row(trace, seen, k, *aim)
            for k, (time_s, aim) in enumerate(zip(trace.time_s.tolist(), aims, strict=True))
        }


def _rest(x: float, y: float, z: float) -> Piece:
    """Return a piece without motion or end."""
    return Piece(math.inf, [x], [y], [z], [0.0])


def _row(trace: Any, seen: Any, k: int, acceleration: list[float], height: list[float]) -> dict[str, float]:
    """Return what the app would log of an update; on the ground no update is made up."""
    x, y, z = seen.position_m[k, 0].tolist()
    vx, vy, vz = seen.velocity_m_s[k, 0].tolist()
    roll, pitch, yaw = seen.euler_rad[k, 0].tolist()
    target_x, target_y, target_vx, target_vy = trace.target[k, 0, :4].tolist()
    out_roll, out_pitch = trace.command_rad[k, 0].tolist()
    values: dict[str, float] = {"x": x, "y": -y, "z": -z, "vx": vx, "vy": -vy, "vz": -vz}
    values |= {"inRoll": roll, "inPitch": pitch, "inYaw": -yaw, "outRoll": out_roll, "outPitch": out_pitch}
    values |= {"targetX": target_x, "targetY": -target_y, "targetVx": target_vx, "targetVy": -target_vy}
    values |= {"targetAx": acceleration[0], "targetAy": -acceleration[1]}
    values |= dict(zip(("targetZ", "targetVz", "targetAz"), height, strict=True))
    values |= {
        "step": k % 2**16,
        "status": int(trace.status[k, 0]),
        "outThrust": float(trace.thrust_acceleration_m_s2[k, 0]),
        "grounded": int(trace.position_m[k, 0, 2] >= 0.0),
    }
    if VALUES.has_target_observer:
        values["targetKnown"] = 1
    return {f"{VALUES.group}.{name}": value for name, value in values.items()} | {"stateEstimate.z": -z}
