"""An autopilot of our own behind MAVLink: modes, arming, streams and time-outs of PX4 or ArduCopter.

It flies our plant. Nothing of it is theirs but the messages, as their manuals document them.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_extensions.mavlink.messages import read_order, send_record
from mambo_extensions.mavlink.sockets import Address, MavlinkSocket
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.disturbances import Disturbances, World
from mambo_sil.drone.plant.ground import carry_on_ground
from mambo_sil.drone.plant.vehicle import Seen, Vehicle, truth
from mambo_sil.drone.sensors.suites import suite_of
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.frames import turned_tilt, wrapped
from mambo_sil.flight.names import DEFAULT_SENSORS
from mambo_sil.flight.scenario import choose_sensors
from mambo_sil.life.records import (
    SET_MODE,
    Answer,
    Arm,
    AskParameter,
    Battery,
    Echo,
    EstimatedState,
    Heartbeat,
    OnGround,
    Order,
    Parameter,
    Ping,
    Record,
    SetAttitude,
    SetMode,
    SetPosition,
    SetRate,
    Stack,
    Stream,
    TakeOff,
)

STARTS_M: Final = (0.7, -0.4, 0.0)
"""Where the drone stands; its estimator has another origin, as that of a real one."""
SILENT_S: Final = {"PX4": 1.0, "ArduCopter": 3.0}
"""Time without set-points: PX4 leaves OFFBOARD then (COM_OF_LOSS_T), ArduCopter is level (GUID_TIMEOUT)."""
CLIMB_M_S, DESCENT_M_S, SPEED_M_S = 1.0, 0.7, 1.5
POSITION_1_S, VELOCITY_1_S, WIND_1_S2 = 0.9, 2.0, 1.0
LARGEST_TILT_RAD: Final = 0.35
DISARMS_S: Final = 1.0
"""Time on the ground after which it disarms by itself."""
BATTERY: Final = 0.9
"""The share that remains."""
ALWAYS: Final = {Stream.EXTENDED_SYS_STATE: 1.0}
"""Rates of the streams that nobody asked for."""


@dataclass(frozen=True)
class Condition:
    """What the simulated drone is like beside its vehicle.

    hover_thrust: the share of the largest thrust that carries it, and `believed` the one in its parameter.
    """

    hover_thrust: float = 0.52
    believed: float = 0.5
    yaw_rad: float = 0.3
    seed: int = 0


class SimulatedAutopilot:
    """An autopilot and its drone, which sends to `pilot`; call `tick` for each of its ticks."""

    def __init__(
        self, stack: Stack, drone: VehicleFile, pilot: tuple[str, int], condition: Condition | None = None
    ) -> None:
        self.stack, self.drone, self.condition = stack, drone, condition or Condition()
        self.socket = MavlinkSocket(Address(pilot[0], 0), pilot, source=(1, 1))
        self.time_s, self.armed, self.mode = 0.0, False, stack.hold
        self.orders: list[Order] = []
        """What was ordered since the start, without heartbeats."""
        self.drift_m_s: FloatArray = np.zeros(3)
        """Error of the estimated velocity, with which the estimated position drifts away."""
        self.error_m: FloatArray = np.zeros(3)
        """Error of the estimated position."""
        self._error_rad, self._resets = 0.0, 0
        self.silent = False
        """Whether it sends nothing."""
        seeds = (self.condition.seed,)
        vehicle = Vehicle.of(drone)
        sensors = choose_sensors(DEFAULT_SENSORS[drone.sensors.kind], drone)
        self._vehicle, self._there = vehicle, np.ones(1, np.bool_)
        self._state = vehicle.at_rest(np.array(STARTS_M)[:, np.newaxis], self.condition.yaw_rad, 0.0)
        self._suite = suite_of(sensors, seeds, truth(self._state), drone.step_s)
        self._seeds = seeds
        self.blow((0.0, 0.0))
        self._rates: dict[Stream, float] = dict(ALWAYS)
        self._due: dict[object, float] = {}
        self._set_point: SetAttitude | SetPosition | None = None
        self._set_point_s, self._landed_s = -math.inf, 0.0
        self._aim_m: FloatArray = np.array(STARTS_M)
        self._yaw_rad = self.condition.yaw_rad
        self._wind_m_s2: FloatArray = np.zeros(2)
        """What its own controller has learnt to lean against."""

    @property
    def true(self) -> Seen:
        """The true state."""
        return truth(self._state)

    @property
    def is_on_ground(self) -> bool:
        """Whether the feet touch the ground."""
        return bool(self._state.body[2, 0] >= 0.0)

    def blow(self, push_m_s2: tuple[float, float]) -> None:
        """Push the drone with a steady wind from now on, along x and y."""
        self._world = World(Disturbances(push_m_s2=push_m_s2), self._vehicle, self._seeds, 1.0)

    def reset_estimator(self, by_m: FloatArray, by_rad: float = 0.0) -> None:
        """Move the estimate by a jump; the velocity is right from now on."""
        self.error_m, self._error_rad = self.error_m + by_m, self._error_rad + by_rad
        self.drift_m_s = np.zeros(3)
        self._resets += 1

    def tick(self) -> None:
        """Obey what has come, move on by a tick, and send what is due."""
        for message, _ in self.socket.receive(0.0):
            order = read_order(message, self.stack)
            if order is not None:
                self.orders.append(order)
                self._obey(order)
        seen = self.true if self._suite is None else self._suite.estimate(self.true)
        estimate = self._estimate(seen)
        self.error_m = self.error_m + self.drone.step_s * self.drift_m_s
        self._fall_back()
        with np.errstate(all="ignore"):
            self._advance(seen, estimate)
        self.time_s += self.drone.step_s
        if not self.silent:
            self._send(estimate)

    def _estimate(self, seen: Seen) -> EstimatedState:
        """Return the estimate, with the jumps of its frame; its origin is where the drone starts."""
        attitude_rad = seen.euler_rad[:, 0] + np.array([0.0, 0.0, self._error_rad])
        attitude_rad[2] = float(wrapped(attitude_rad[2]))
        position_m = seen.position_m[:, 0] - np.array(STARTS_M) + self.error_m
        velocity_m_s = seen.velocity_m_s[:, 0] + self.drift_m_s
        rates_rad_s = seen.rates_rad_s[:, 0]
        return EstimatedState(self.time_s, position_m, velocity_m_s, attitude_rad, self._resets, rates_rad_s)

    def _obey(self, order: Order) -> None:
        match order:
            case SetAttitude() | SetPosition():
                self._set_point, self._set_point_s = order, self.time_s
            case SetMode():
                self._emit(Answer(SET_MODE, self._change_mode(order.mode)))
            case Arm():
                self._arm(order)
            case TakeOff() if self.armed and self.mode == self.stack.guided:
                self._set_point = None
                self._aim_m = self._aim_m - np.array([0.0, 0.0, order.height_m + self._aim_m[2]])
            case SetRate():
                self._rates[order.stream] = order.rate_hz
            case AskParameter():
                self._send_parameter(order.name)
            case Ping():
                self._emit(Echo(order.number))

    def _change_mode(self, mode: int) -> bool:
        """Change the mode; PX4 refuses OFFBOARD without set-points."""
        if mode == self.stack.guided and self.stack.climbs_by_set_points and not self._is_guided:
            return False
        if mode != self.mode:
            self.mode = mode
            self._aim_m = self._state.body[:3, 0].copy()
        return True

    def _arm(self, order: Arm) -> None:
        if order.arm or order.force or self.is_on_ground:
            if order.arm and not self.armed:
                self._aim_m = self._state.body[:3, 0].copy()
            self.armed = order.arm

    @property
    def _is_guided(self) -> bool:
        """Whether set-points come."""
        return self.time_s - self._set_point_s <= SILENT_S[self.stack.name]

    def _fall_back(self) -> None:
        """Do without set-points if they fail to come, and disarm on the ground after landing."""
        if self.mode == self.stack.guided and self._set_point is not None and not self._is_guided:
            self._set_point = None
            self._aim_m = self._state.body[:3, 0].copy()
            if self.stack.climbs_by_set_points:
                self._change_mode(self.stack.hold)
        if not (self.armed and self.mode == self.stack.land and self.is_on_ground):
            self._landed_s = self.time_s
        elif self.time_s - self._landed_s > DISARMS_S:
            self.armed = False

    def _advance(self, seen: Seen, estimate: EstimatedState) -> None:
        """Move the plant by a tick."""
        self._state, moment = self._world.tick(self._state, self.time_s)
        if not self.armed and self.is_on_ground:
            return
        now_rad = float(self._state.body[8, 0])
        if not self.armed:
            command_rad, thrust_n = np.zeros(2), 0.0
        elif self.mode == self.stack.guided and isinstance(self._set_point, SetAttitude):
            roll_rad, pitch_rad, yaw_rad = self._set_point.attitude_rad.tolist()
            self._yaw_rad = yaw_rad - self._error_rad
            command_rad = np.array(turned_tilt(roll_rad, pitch_rad, now_rad - self._yaw_rad))
            thrust_n = self._set_point.thrust / self.condition.hover_thrust * self.drone.hover_demand_n
        else:
            command_rad, thrust_n = self._hold(estimate)
        thrust = np.array([min(thrust_n, self.drone.altitude.thrust_max_n)])
        reference_rad = now_rad + float(wrapped(self._yaw_rad - now_rad))
        self._state, _ = self._vehicle.advance(
            self._state, command_rad[:, np.newaxis], thrust, reference_rad, seen=seen, moment=moment
        )
        self._state = carry_on_ground(self._state, self._there)

    def _hold(self, estimate: EstimatedState) -> tuple[FloatArray, float]:
        """Return roll, pitch (2,) and thrust in N towards its own aim, by its own controller, a PID."""
        if self.mode == self.stack.guided and isinstance(self._set_point, SetPosition):
            self._aim_m = self._set_point.position_m + np.array(STARTS_M) - self.error_m
        place_m = estimate.position_m + np.array(STARTS_M) - self.error_m
        velocity_m_s = estimate.velocity_m_s - self.drift_m_s
        wanted_m_s = np.clip(POSITION_1_S * (self._aim_m - place_m), -SPEED_M_S, SPEED_M_S)
        wanted_m_s[2] = np.clip(wanted_m_s[2], -CLIMB_M_S, DESCENT_M_S)
        if self.mode == self.stack.land:
            wanted_m_s[2] = DESCENT_M_S
        error_m_s = wanted_m_s - velocity_m_s
        learnt_m_s2 = self._wind_m_s2 + self.drone.step_s * WIND_1_S2 * error_m_s[:2]
        self._wind_m_s2 = np.zeros(2) if self.is_on_ground else learnt_m_s2
        north, east, down = (VELOCITY_1_S * error_m_s + np.array([*self._wind_m_s2, 0.0])).tolist()
        yaw_rad = float(estimate.attitude_rad[2]) - self._error_rad
        ahead = north * math.cos(yaw_rad) + east * math.sin(yaw_rad)
        right = east * math.cos(yaw_rad) - north * math.sin(yaw_rad)
        tilt_rad = np.clip(np.array([right, -ahead]) / GRAVITY_M_S2, -LARGEST_TILT_RAD, LARGEST_TILT_RAD)
        share = min(max(1.0 - down / GRAVITY_M_S2, 0.2), 1.8)
        return tilt_rad, share * self.drone.hover_demand_n

    def _send(self, estimate: EstimatedState) -> None:
        """Send what is due."""
        if self._is_due("heartbeat", 1.0):
            self._emit(Heartbeat(1, 1, self.stack.ident, 2, self.armed, self.mode))
            self._emit(Battery(BATTERY))
        for stream, rate_hz in self._rates.items():
            if self._is_due(stream, 1.0 / rate_hz):
                landed = stream is Stream.EXTENDED_SYS_STATE
                self._emit(OnGround(self.is_on_ground) if landed else estimate, stream)

    def _is_due(self, what: object, period_s: float) -> bool:
        """Return whether a period is over; the times are multiples of it, to the next tick."""
        due_s = self._due.get(what, self.time_s)
        if self.time_s < due_s - 1e-9:
            return False
        self._due[what] = max(due_s + period_s, self.time_s)
        return True

    def _send_parameter(self, name: str) -> None:
        values = {self.stack.hover_parameter: self.condition.believed, **self.stack.needs}
        if name in values:
            self._emit(Parameter(name, values[name]))

    def _emit(self, record: Record, stream: Stream | None = None) -> None:
        mav: Any = self.socket.mav
        if isinstance(record, EstimatedState) and self.stack.name != "PX4":
            record = replace(record, resets=None)
        send_record(mav, record, stream)
