"""The script offboard.py in flight: its own loop, a radio with delay and losses, and our plant."""

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any, Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.controllers.thrust_controller import Applied
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.scenario import choose_sensors
from mambo_sil.flight.trajectories import Circle

TICK_S: Final = 0.002
LOG_TICKS: Final = 5
LEVEL_OUT_S: Final = 0.5
BEGIN_S: Final = 1.0
"""The script waits so long for its first state."""


@dataclass(frozen=True)
class Radio:
    """A radio: delays of the log and of the set-points in s, and the share of packets that each way loses."""

    down_s: float = 0.0
    up_s: float = 0.0
    lost: float = 0.0
    silent_s: tuple[float, float] = (math.inf, math.inf)
    """Begin and end of a time in which nothing arrives."""


@dataclass
class Air:
    """The controller of the closed loop: what the script sends through a radio. Its clock is the script's."""

    radio: Radio
    seed: int = 0
    sent: list[tuple[float, tuple[float, ...]]] = field(default_factory=list)
    """Set-points with the times at which the script sent them."""

    def __post_init__(self) -> None:
        self.time_s = 0.0
        self.deliver: Callable[[list[float]], None] | None = None
        self._random = np.random.default_rng(self.seed)
        self._down: list[tuple[float, list[float]]] = []
        self._up: list[tuple[float, FloatArray]] = []
        self._command, self._commanded_s = np.zeros(2), 0.0
        self._wake_s, self._tick = 0.0, 0
        self._script, self._plant = threading.Semaphore(0), threading.Semaphore(0)
        self.is_over = False

    def monotonic(self) -> float:
        """Return the time, as the module time does."""
        return self.time_s

    def sleep(self, duration_s: float) -> None:
        """Let the plant fly on."""
        self._wake_s = self.time_s + duration_s
        self._plant.release()
        self._script.acquire()

    def run(self, script: Callable[[], object]) -> None:
        """Run a script in the time that the plant gives it."""
        self._script.acquire()
        script()
        self.is_over = True
        self._plant.release()

    def _arrives(self) -> bool:
        silent = self.radio.silent_s[0] <= self.time_s < self.radio.silent_s[1]
        return not silent and float(self._random.random()) >= self.radio.lost

    def send_zdistance_setpoint(self, roll: float, pitch: float, yawrate: float, zdistance: float) -> None:
        """Take a set-point of the script."""
        self.sent.append((self.time_s, (roll, pitch, yawrate, zdistance)))
        if self._arrives():
            self._up.append((self.time_s + self.radio.up_s, np.radians([roll, pitch])))

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Applied:
        """Log the state, let the script run, and return what has arrived; called every tick."""
        del target, thrust_acceleration_m_s2
        self.time_s = self._tick * TICK_S
        if self._tick % LOG_TICKS == 0 and self._arrives():
            x, y, vx, vy, roll, pitch, yaw = (float(value) for value in state[0])
            angles = (math.degrees(angle) for angle in (roll, pitch, -yaw))
            self._down.append((self.time_s + self.radio.down_s, [x, -y, 0.0, vx, -vy, *angles]))
        while self._down and self._down[0][0] <= self.time_s + 1e-9:
            values = self._down.pop(0)[1]
            if self.deliver is not None:
                self.deliver(values)
        if not self.is_over and self.time_s >= max(BEGIN_S, self._wake_s) - 1e-9:
            self._script.release()
            self._plant.acquire()
        while self._up and self._up[0][0] <= self.time_s + 1e-9:
            self._commanded_s, self._command = self._up.pop(0)
        if self.time_s - self._commanded_s > LEVEL_OUT_S:
            self._command = np.zeros(2)
        self._tick += 1
        return Applied(self._command[np.newaxis], np.zeros(1, np.int64))


@dataclass(frozen=True)
class Flown:
    """A flight of the script: how it ended, what it sent, and its distance from the circle over time."""

    end: Any
    sent: list[tuple[float, tuple[float, ...]]]
    time_s: FloatArray
    error_m: FloatArray
    """From the begin of the script on."""


def fly_offboard(
    script: ModuleType, controller: Any, radio: Radio, source: Any = None, seed: int = 0
) -> Flown:
    """Fly the script with a controller of mambo_nmpc.

    `source` makes its function `newest` from one that returns position, angles, and when they came.
    """
    air, found = Air(radio, seed), list[object]()
    latest: list[Any] = [([], -math.inf)]
    air.deliver = lambda values: latest.__setitem__(0, (values, air.time_s))

    def read() -> Any:
        (values, came) = latest[0]
        return values[:3], values[5:], came

    def run() -> None:
        newest = source(read) if source else lambda: latest[0]
        found.append(script.fly(Radioed, controller, newest))

    vars(script)["time"] = air
    drone = Vehicle.of(vehicle_toml.load("crazyflie"))

    class Radioed:
        class cf:  # noqa: N801 -- as cflib's
            commander = air

        latest: Final = {"supervisor.info": 0, "pm.state": 0}

    thread = threading.Thread(target=air.run, args=(run,), daemon=True)
    thread.start()
    duration_s = BEGIN_S + script.FLIGHT_S + 2.0 * script.CLIMB_S + 1.0
    flight = Flight(
        Circle(1e-9, 1.0),
        duration_s=duration_s,
        vehicle=drone,
        update_period_s=TICK_S,
        sensors=choose_sensors("mocap", drone.drone),
        yaw_rad=np.array([-0.4]),
    )
    trace = fly(flight, air)
    thread.join(5.0)
    begun = trace.time_s >= BEGIN_S
    time_s = trace.time_s[begun] - BEGIN_S
    stop_s = script.CLIMB_S + script.FLIGHT_S
    wanted = np.array([script.position(min(float(now), stop_s), (0.0, 0.0)) for now in time_s])
    position = trace.position_m[begun, 0, :2] * (1.0, -1.0)
    return Flown(found[0] if found else None, air.sent, time_s, np.hypot(*(position - wanted).T))
