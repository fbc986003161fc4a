"""A Crazyflie behind cflib's interface, as far as the scripts of the app use it, on a clock of its own.

Calls have the signatures of cflib 0.1.34, as far as the scripts use them, and refuse what it refuses: an
unknown parameter or log variable, a log block of more than 26 bytes. What is sent without a link is lost.
"""

import sys
import types
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import pytest

ARMED, CAN_FLY, FLYING = 2, 8, 16
SIZES: Final = {
    "tooQuick": 1,
    "status": 1,
    "saturated": 1,
    "lost": 1,
    "refused": 4,
    "step": 2,
    "age": 2,
    "takeOvers": 1,
    "targetKnown": 1,
    "grounded": 1,
    "level": 1,
    "info": 2,
    "state": 1,
}
"""Bytes of log variables that are no floats, by their names without group."""
MEMORY_BYTES: Final = 4096
PART_BYTES: Final = 25
"""What cflib writes into a memory by one packet."""
PART_S: Final = 0.005
LOG_BYTES: Final = 26
TRAJECTORY_MEMORY: Final = 0x12


@dataclass
class Clock:
    """What the scripts take for the module time; events happen while they sleep."""

    time_s: float = 0.0
    events: list[tuple[float, Callable[[], None]]] = field(default_factory=list)
    sleeping: list[Callable[[], None]] = field(default_factory=list)
    """Called after each sleep."""

    def monotonic(self) -> float:
        """Return the time."""
        return self.time_s

    def sleep(self, duration_s: float) -> None:
        """Let time pass, and events happen in it."""
        end_s = self.time_s + duration_s
        while self.events and min(self.events, key=lambda event: event[0])[0] <= end_s:
            event = min(self.events, key=lambda one: one[0])
            self.events.remove(event)
            self.time_s = max(self.time_s, event[0])
            event[1]()
        self.time_s = end_s
        for called in self.sleeping:
            called()


class Caller:
    """Callbacks, as cflib keeps them."""

    def __init__(self) -> None:
        self._callbacks: list[Callable[..., None]] = []

    def add_callback(self, callback: Callable[..., None]) -> None:
        """Add a callback."""
        self._callbacks.append(callback)

    def call(self, *arguments: Any) -> None:
        """Call all of them."""
        for callback in self._callbacks:
            callback(*arguments)


class LogConfig:
    """A block of log variables."""

    def __init__(self, name: str, period_in_ms: int) -> None:
        self.name, self.period_in_ms = name, period_in_ms
        self.names: list[str] = []
        self.sizes: list[int] = []
        self.data_received_cb = Caller()
        self.is_started = False

    def add_variable(self, name: str, fetch_as: str | None = None) -> None:
        """Add a variable in the type that it is stored in, or as FP16."""
        self.names.append(name)
        stored = SIZES.get(name.rpartition(".")[2], 4)
        self.sizes.append({None: stored, "FP16": 2, "float": 4}[fetch_as])

    def start(self) -> None:
        """Start the block."""
        self.is_started = True


@dataclass
class Drone:
    """The drone at the other end: what it logs, its parameters, and all calls with their times."""

    clock: Clock
    logged: dict[str, float]
    parameters: dict[str, float]
    calls: list[tuple[float, str, tuple[Any, ...]]] = field(default_factory=list)
    has_link: bool = True
    """Whether the radio reaches it."""
    is_open: bool = False
    failing_uploads: bool = False
    sends_parameters: bool = True
    first_tick: int = 0
    """Time of its logs in ms at the beginning of the clock."""
    arms: bool = True
    blocks: list[LogConfig] = field(default_factory=list)
    lost_callbacks: Caller = field(default_factory=Caller)
    memory: bytearray = field(default_factory=lambda: bytearray(MEMORY_BYTES))
    lost_after: int | None = None
    """Parts of a write after which the link is lost."""

    def note(self, name: str, *arguments: Any) -> None:
        """Note a call, unless it is lost."""
        if self.is_open:
            self.calls.append((self.clock.time_s, name, arguments))

    def names(self) -> list[str]:
        """Return the names of the calls, each once in a row."""
        names = [name for _, name, _ in self.calls]
        return [name for k, name in enumerate(names) if k == 0 or name != names[k - 1]]

    def of(self, name: str) -> list[tuple[float, tuple[Any, ...]]]:
        """Return time and arguments of the calls with a name."""
        return [(time_s, arguments) for time_s, called, arguments in self.calls if called == name]

    def write(self, address: int, data: bytes) -> None:
        """Take a part of a write."""
        self.memory[address : address + len(data)] = data
        if self.lost_after is not None:
            self.lost_after -= 1
            if self.lost_after == 0:
                self.lose()

    def set_state(self, bit: int, *, on: bool) -> None:
        """Set or clear a bit of the supervisor's word."""
        word = int(self.logged["supervisor.info"])
        self.logged["supervisor.info"] = word | bit if on else word & ~bit

    def log(self) -> None:
        """Send all blocks."""
        if self.is_open:
            for block in self.blocks:
                if block.is_started:
                    values = {name: self.logged[name] for name in block.names}
                    ticks = (self.first_tick + round(1000 * self.clock.time_s)) % 2**24
                    block.data_received_cb.call(ticks, values, block)

    def lose(self, until_s: float = 1e9) -> None:
        """Lose the link until some time."""
        self.has_link = self.is_open = False
        self.clock.events.append((until_s, self._come_back))
        self.lost_callbacks.call("radio://0", "Too many packets lost")

    def _come_back(self) -> None:
        self.has_link = True


class HighLevelCommander:
    """Takes calls as cflib's."""

    def __init__(self, drone: Drone) -> None:
        self._drone = drone

    def takeoff(self, absolute_height_m: float, duration_s: float, *, yaw: float | None = 0.0) -> None:
        """Take off."""
        self._drone.note("takeoff", absolute_height_m, duration_s, yaw)
        self._drone.set_state(FLYING, on=True)

    def land(self, absolute_height_m: float, duration_s: float, *, yaw: float | None = 0.0) -> None:
        """Land."""
        self._drone.note("land", absolute_height_m, duration_s, yaw)

    def stop(self) -> None:
        """Stop the motors."""
        self._drone.note("stop")
        if self._drone.is_open:
            self._drone.set_state(FLYING, on=False)

    def go_to(
        self,
        x: float,
        y: float,
        z: float,
        yaw: float,
        duration_s: float,
    ) -> None:
        """Go to a point."""
        self._drone.note("go_to", x, y, z, yaw, duration_s)

    def define_trajectory(self, trajectory_id: int, offset: int, n_pieces: int) -> None:
        """Define a trajectory in the memory."""
        assert offset + 132 * n_pieces <= MEMORY_BYTES
        self._drone.note("define_trajectory", trajectory_id, offset, n_pieces)

    def start_trajectory(self, trajectory_id: int) -> None:
        """Start one."""
        self._drone.note("start_trajectory", trajectory_id)


class Commander:
    """Takes set-points as cflib's."""

    def __init__(self, drone: Drone) -> None:
        self._drone = drone

    def send_notify_setpoint_stop(self) -> None:
        """Hand over to the high-level commander."""
        self._drone.note("notify")

    def send_stop_setpoint(self) -> None:
        """Stop the motors."""
        self._drone.note("stop_setpoint")

    def send_zdistance_setpoint(self, roll: float, pitch: float, yawrate: float, zdistance: float) -> None:
        """Send angles and height."""
        self._drone.note("zdistance", roll, pitch, yawrate, zdistance)

    def send_full_state_setpoint(  # noqa: PLR0917 -- as cflib has it
        self,
        pos: list[float],
        vel: list[float],
        acc: list[float],
        orientation: list[float],
        rollrate: float,
        pitchrate: float,
        yawrate: float,
    ) -> None:
        """Send a full state, in integers of 16 bits."""
        assert all(abs(1000 * value) < 2**15 for value in (*pos, *vel, *acc, rollrate, pitchrate, yawrate))
        self._drone.note("full_state", pos, vel, acc, orientation)


class Memory:
    """The memory of the high-level commander."""

    def __init__(self, drone: Drone) -> None:
        self._drone, self.trajectory = drone, []  # type: ignore[var-annotated] # what the script puts there

    def write_data(
        self,
        write_finished_cb: Callable[..., None],
        write_failed_cb: Callable[..., None] | None = None,
        start_addr: int = 0,
    ) -> int:
        """Write the trajectory in parts, one after the other."""
        data = b"".join(piece.pack() for piece in self.trajectory)
        assert start_addr + len(data) <= MEMORY_BYTES
        assert write_failed_cb is not None, (
            "a write that fails must not be taken for one that is not answered"
        )
        drone, failed = self._drone, write_failed_cb

        def send(begin: int) -> None:
            if not drone.is_open:
                return
            if drone.failing_uploads:
                failed(self, start_addr)
                return
            drone.write(start_addr + begin, data[begin : begin + PART_BYTES])
            if begin + PART_BYTES < len(data):
                later(begin + PART_BYTES)
            elif drone.is_open:
                drone.note("upload", len(data))
                write_finished_cb(self, start_addr)

        def later(begin: int) -> None:
            drone.clock.events.append((drone.clock.time_s + PART_S, lambda: send(begin)))

        later(0)
        return len(data)


def contents_of(names: Iterable[str]) -> dict[str, dict[str, None]]:
    """Return names as a table of contents: by group."""
    groups: dict[str, dict[str, None]] = {}
    for name in names:
        group, _, short = name.partition(".")
        groups.setdefault(group, {})[short] = None
    return groups


class Parameters:
    """Parameters as cflib's: values are text."""

    def __init__(self, drone: Drone) -> None:
        self._drone = drone
        self.toc = types.SimpleNamespace(toc=contents_of(drone.parameters))

    def get_value(self, complete_name: str) -> str:
        """Return a value; raises KeyError, and Exception after a minute without one."""
        if not self._drone.sends_parameters:
            raise Exception("Connection timed out")
        return str(self._drone.parameters[complete_name])

    def set_value(self, complete_name: str, value: str) -> None:
        """Set a value; raises KeyError."""
        if complete_name not in self._drone.parameters:
            raise KeyError(f"{complete_name} not in param TOC")
        self._drone.parameters[complete_name] = float(value) if "." in value else int(value)
        self._drone.note("set_value", complete_name, value)


class Log:
    """The log of a drone."""

    def __init__(self, drone: Drone) -> None:
        self._drone = drone
        self.toc = types.SimpleNamespace(toc=contents_of(drone.logged))

    def add_config(self, logconf: LogConfig) -> None:
        """Add a block; raises KeyError and AttributeError."""
        for name in logconf.names:
            if name not in self._drone.logged:
                raise KeyError(f"Variable {name} not in TOC")
        if sum(logconf.sizes) > LOG_BYTES:
            raise AttributeError("The log configuration is too large")
        self._drone.blocks.append(logconf)


class Supervisor:
    """Arms the drone."""

    def __init__(self, drone: Drone) -> None:
        self._drone = drone

    def send_arming_request(self, do_arm: bool) -> None:
        """Arm, half a second later."""
        self._drone.note("arm", do_arm)
        if self._drone.arms:
            self._drone.clock.events.append(
                (
                    self._drone.clock.time_s + 0.5,
                    lambda: self._drone.set_state(ARMED | CAN_FLY, on=do_arm),
                )
            )


def package_of(drone: Drone) -> Mapping[str, types.ModuleType]:
    """Return the modules of cflib, with the drone at every URI."""

    class Crazyflie:
        def __init__(self, rw_cache: str) -> None:
            assert rw_cache == "./cache"
            self.connection_lost = drone.lost_callbacks
            self.high_level_commander = HighLevelCommander(drone)
            self.commander, self.supervisor = Commander(drone), Supervisor(drone)
            self.param, self.log = Parameters(drone), Log(drone)
            memory = Memory(drone)
            self.mem = types.SimpleNamespace(get_mems=lambda kind: (memory,) * (kind == TRAJECTORY_MEMORY))

    class SyncCrazyflie:
        def __init__(self, link_uri: str, cf: Crazyflie) -> None:
            assert link_uri.startswith("radio://")
            self.cf = cf

        def open_link(self) -> None:
            if not drone.has_link:
                raise Exception("Too many packets lost")
            drone.is_open = True

        def close_link(self) -> None:
            drone.note("close")
            drone.is_open = False

        def __enter__(self) -> "SyncCrazyflie":
            self.open_link()
            return self

        def __exit__(self, *_: object) -> None:
            self.close_link()

    contents: dict[str, dict[str, Any]] = {
        "cflib": {},
        "cflib.crtp": {"init_drivers": lambda: None},
        "cflib.crazyflie": {"Crazyflie": Crazyflie},
        "cflib.crazyflie.log": {"LogConfig": LogConfig},
        "cflib.crazyflie.syncCrazyflie": {"SyncCrazyflie": SyncCrazyflie},
    }
    modules = {}
    for name, values in contents.items():
        modules[name] = types.ModuleType(name)
        vars(modules[name]).update(values)
        parent, _, short = name.rpartition(".")
        if parent:
            setattr(modules[parent], short, modules[name])
    return modules


def install(drone: Drone, patch: pytest.MonkeyPatch) -> None:
    """Make the drone what scripts reach through cflib."""
    for name, module in package_of(drone).items():
        patch.setitem(sys.modules, name, module)
    drone.clock.sleeping.append(drone.log)
