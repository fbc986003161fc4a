"""What these scripts call of cflib, which has no types.

And what a drone, a real or a simulated one, is for a flight.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol


class Packed(Protocol):
    """A piece of a trajectory."""

    def pack(self) -> bytes:
        """Return the bytes that the firmware keeps of it."""
        ...


class HighLevelCommander(Protocol):
    """The firmware's planner."""

    def takeoff(self, height: float, duration_s: float, /, *, yaw: float | None) -> None:
        """Climb to a height; None: with the present heading."""
        ...

    def land(self, height: float, duration_s: float, /, *, yaw: float | None) -> None:
        """Descend to a height."""
        ...

    def go_to(self, x: float, y: float, z: float, yaw: float, duration_s: float, /) -> None:
        """Fly to a place."""
        ...

    def define_trajectory(self, number: int, offset: int, pieces: int, /) -> None:
        """Make a trajectory of pieces in the memory."""
        ...

    def start_trajectory(self, number: int, /) -> None:
        """Fly a trajectory."""
        ...

    def stop(self) -> None:
        """Stop the motors, if no set-points come."""
        ...


class Commander(Protocol):
    """Takes set-points."""

    def send_full_state_setpoint(
        self,
        position: list[float],
        velocity: list[float],
        acceleration: list[float],
        quaternion: list[float],
        /,
        *rates: float,
    ) -> None:
        """Send a full state; the rates of roll, pitch and yaw come last."""
        ...

    def send_stop_setpoint(self) -> None:
        """Stop the motors."""
        ...

    def send_notify_setpoint_stop(self) -> None:
        """Hand over to the high-level commander."""
        ...


class AngleCommander(Commander, Protocol):
    """Takes set-points of angles, too."""

    def send_zdistance_setpoint(
        self, roll_deg: float, pitch_deg: float, yaw_rate: float, height: float, /
    ) -> None:
        """Send angles and a height."""
        ...


class Memory(Protocol):
    """The memory of trajectories."""

    trajectory: list[Packed]

    def write_data(
        self, finished: Callable[..., None], failed: Callable[..., None], address: int, /
    ) -> object:
        """Write `trajectory` from an address on, and call one of both functions when that has ended."""
        ...


class Memories(Protocol):
    """All memories."""

    def get_mems(self, kind: int, /) -> Sequence[Memory]:
        """Return those of a kind."""
        ...


class Calls(Protocol):
    """What flies a drone."""

    @property
    def high_level_commander(self) -> HighLevelCommander:
        """The firmware's planner."""
        ...

    @property
    def commander(self) -> Commander:
        """Takes set-points."""
        ...

    @property
    def mem(self) -> Memories:
        """All memories."""
        ...


class Crazyflie(Calls, Protocol):
    """A Crazyflie behind a link; what has no type here is cflib's."""

    @property
    def commander(self) -> AngleCommander:
        """Takes set-points."""
        ...

    @property
    def param(self) -> Any:
        """Parameters."""
        ...

    @property
    def log(self) -> Any:
        """Logs."""
        ...

    @property
    def supervisor(self) -> Any:
        """What arms it."""
        ...

    @property
    def connection_lost(self) -> Any:
        """Callbacks."""
        ...


class Link(Protocol):
    """A link to a Crazyflie."""

    @property
    def cf(self) -> Crazyflie:
        """The drone at its other end."""
        ...

    def open_link(self) -> None:
        """Connect."""
        ...

    def close_link(self) -> None:
        """Disconnect."""
        ...


Rows = dict[int, dict[str, float]]
"""The rows of a log: values by their names, by time stamps in ms."""


class Drone(Protocol):
    """A drone and its clock, as a flight sees them."""

    is_real: bool
    """Whether it flies while it is called, and may be wrong about its heading."""
    slowed: int
    """How often a figure was slowed down."""
    slow_until_s: float
    """Time of the figure until which it is not slowed down again."""

    @property
    def cf(self) -> Calls:
        """Takes the calls."""
        ...

    @property
    def latest(self) -> Mapping[str, float]:
        """The latest values of the logs."""
        ...

    @property
    def accepted_s(self) -> float:
        """When the controller accepted its inputs last."""
        ...

    @property
    def rows(self) -> Rows:
        """The rows of the logs."""
        ...

    def watch_by(self, watch: "Watch | None") -> None:
        """Call a function while waiting in flight; None: none."""
        ...

    def now(self) -> float:
        """Return the time in s."""
        ...

    def wait(self, duration_s: float) -> None:
        """Let time pass; raises LinkLostError, and TroubleError in a flight that is watched."""
        ...


Watch = Callable[["Drone"], None]
"""Raises TroubleError if the drone should not fly on."""
