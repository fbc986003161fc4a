"""MAVLink messages of records, and records of messages, for both sides of the link.

`mav` is pymavlink's MAVLink object of the sender. Source of the fields: MAVLink's message definitions
(common.xml); of modes and thrust: PX4's manual (offboard mode) and ArduPilot's (Copter commands in guided
mode).
"""

import math
from collections import deque
from typing import Any, Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import sine_cosine
from mambo_sil.drone.plant.rigid_body import to_world
from mambo_sil.errors import ArgumentError
from mambo_sil.flight.frames import attitude_of_quaternion
from mambo_sil.life.records import (
    COMPANION,
    SET_MODE,
    STACKS,
    Answer,
    Arm,
    AskParameter,
    Battery,
    Beat,
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
    Text,
)

ARMED: Final = 128
"""Bit of a heartbeat's base_mode."""
CUSTOM_MODE: Final = 1
"""Bit of base_mode: the mode is in custom_mode."""
NO_AUTOPILOT: Final = 8
ACTIVE: Final = 4

TAKE_OFF, ARM, SET_INTERVAL = 22, 400, 511
"""Numbers of commands, beside `SET_MODE`."""
BY_FORCE: Final = 21196.0
"""Parameter 2 of the command to arm or disarm without checks."""

ANSWERED: Final = 1
"""Time of an answer to TIMESYNC: any but 0, which is that of a question."""
ACCEPTED, DENIED = 0, 2
"""Results of a command."""

LOCAL_NED, BODY_FRD = 1, 12
"""Frames of an ODOMETRY: NED at the local origin, forward-right-down of the body."""
ON_GROUND, IN_AIR = 1, 2
"""Landed states."""
NO_RATES: Final = 0b111
"""Type mask of SET_ATTITUDE_TARGET: ignore the body rates."""
POSITION_AND_YAW: Final = 0b100111111000
"""Type mask of SET_POSITION_TARGET_LOCAL_NED: ignore velocity, acceleration and yaw rate."""
REAL32: Final = 9


def send_order(mav: Any, order: Order, system: int, stack: Stack) -> None:
    """Send an order to component 1 of a system."""
    match order:
        case Beat():
            mav.heartbeat_send(COMPANION, NO_AUTOPILOT, 0, 0, ACTIVE)
        case AskParameter():
            mav.param_request_read_send(system, 1, order.name.encode(), -1)
        case Ping():
            mav.timesync_send(0, order.number)
        case SetAttitude():
            q = quaternion(order.attitude_rad)
            ms = _milliseconds(order.time_s)
            mav.set_attitude_target_send(ms, system, 1, NO_RATES, q, 0.0, 0.0, 0.0, order.thrust)
        case SetPosition():
            mav.set_position_target_local_ned_send(
                *(_milliseconds(order.time_s), system, 1, LOCAL_NED, POSITION_AND_YAW),
                *order.position_m.tolist(),
                *(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, order.yaw_rad, 0.0),
            )
        case _:
            number, *values = _command(order, stack)
            values += [0.0] * (7 - len(values))
            mav.command_long_send(system, 1, number, 0, *values)


def _command(order: SetRate | SetMode | Arm | TakeOff, stack: Stack) -> list[Any]:
    """Return the number and the first parameters of a command."""
    match order:
        case SetRate():
            return [SET_INTERVAL, float(order.stream), 1e6 / order.rate_hz]
        case SetMode():
            main, sub = _mode_parts(order.mode, stack)
            return [SET_MODE, float(CUSTOM_MODE), main, sub]
        case Arm():
            return [ARM, float(order.arm), BY_FORCE if order.force else 0.0]
        case TakeOff():
            return [TAKE_OFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, order.height_m]


def _mode_parts(mode: int, stack: Stack) -> tuple[float, float]:
    """Return parameters 2 and 3 of the command that sets a mode: PX4's main mode and sub-mode."""
    return (float(mode >> 16 & 255), float(mode >> 24)) if stack.name == "PX4" else (float(mode), 0.0)


def read_order(message: Any, stack: Stack) -> Order | None:
    """Return the order in a message; None for another one."""
    match message.get_type():
        case "PARAM_REQUEST_READ" | "TIMESYNC":
            return _read_question(message)
        case "SET_ATTITUDE_TARGET" if message.type_mask == NO_RATES:
            attitude_rad = _attitude(message.q)
            if attitude_rad is None:
                return None
            return SetAttitude(message.time_boot_ms / 1e3, attitude_rad, message.thrust)
        case "SET_POSITION_TARGET_LOCAL_NED" if message.type_mask == POSITION_AND_YAW:
            position_m = np.array([message.x, message.y, message.z])
            return SetPosition(message.time_boot_ms / 1e3, position_m, message.yaw)
        case "COMMAND_LONG":
            return _read_command(message, stack)
    return None


def _read_question(message: Any) -> Order | None:
    if message.get_type() == "PARAM_REQUEST_READ":
        return AskParameter(message.param_id)
    return Ping(message.ts1) if message.tc1 == 0 else None


def _read_command(message: Any, stack: Stack) -> Order | None:
    match message.command:
        case command if command == TAKE_OFF:
            return TakeOff(message.param7)
        case command if command == SET_MODE:
            if stack.name == "PX4":
                return SetMode(int(message.param2) << 16 | int(message.param3) << 24)
            return SetMode(int(message.param2))
        case command if command == ARM:
            return Arm(message.param1 == 1.0, message.param2 == BY_FORCE)
        case command if command == SET_INTERVAL and message.param1 in tuple(Stream) and message.param2 > 0.0:
            return SetRate(Stream(int(message.param1)), 1e6 / message.param2)
    return None


def send_record(mav: Any, record: Record, stream: Stream | None = None) -> None:
    """Send a record; an estimate as the message `stream`."""
    match record:
        case Heartbeat():
            mode = CUSTOM_MODE | (ARMED if record.armed else 0)
            mav.heartbeat_send(record.vehicle, record.autopilot, mode, record.mode, ACTIVE)
        case Parameter():
            mav.param_value_send(record.name.encode(), record.value, REAL32, 1, 0)
        case Answer():
            mav.command_ack_send(record.command, ACCEPTED if record.accepted else DENIED)
        case OnGround():
            mav.extended_sys_state_send(0, ON_GROUND if record.landed else IN_AIR)
        case Battery():
            share = round(100.0 * record.share)
            mav.sys_status_send(0, 0, 0, 0, 12000, -1, share, 0, 0, 0, 0, 0, 0)
        case Text():
            mav.statustext_send(4, record.text.encode())
        case Echo():
            mav.timesync_send(ANSWERED, record.number)
        case EstimatedState():
            _send_estimate(mav, record, stream)


def _send_estimate(mav: Any, estimate: EstimatedState, stream: Stream | None) -> None:
    position, velocity = estimate.position_m.tolist(), estimate.velocity_m_s.tolist()
    q, ms = quaternion(estimate.attitude_rad), _milliseconds(estimate.time_s)
    match stream:
        case Stream.ATTITUDE_QUATERNION:
            rates_rad_s = (0.0, 0.0, 0.0) if estimate.rates_rad_s is None else estimate.rates_rad_s.tolist()
            mav.attitude_quaternion_send(ms, *q, *rates_rad_s)
        case Stream.LOCAL_POSITION_NED:
            mav.local_position_ned_send(ms, *position, *velocity)
        case Stream.ODOMETRY:
            unknown, resets = [math.nan] * 21, (estimate.resets or 0) % 256
            mav.odometry_send(
                *(round(1e6 * estimate.time_s), LOCAL_NED, LOCAL_NED, *position, q, *velocity),
                *(0.0, 0.0, 0.0, unknown, unknown, resets, 8),
            )


def _read_record(message: Any) -> Record | None:
    """Return the record in a message, but for estimates; None for another one."""
    found: Record | None = None
    match message.get_type():
        case "HEARTBEAT":
            sender = message.get_srcSystem(), message.get_srcComponent()
            armed = bool(message.base_mode & ARMED)
            found = Heartbeat(*sender, message.autopilot, message.type, armed, message.custom_mode)
        case "PARAM_VALUE":
            found = Parameter(message.param_id, message.param_value)
        case "COMMAND_ACK":
            found = Answer(message.command, message.result == ACCEPTED)
        case "EXTENDED_SYS_STATE" if message.landed_state:
            found = OnGround(message.landed_state == ON_GROUND)
        case "SYS_STATUS" if message.battery_remaining >= 0:
            found = Battery(message.battery_remaining / 100.0)
        case "STATUSTEXT":
            found = Text(message.text)
        case "TIMESYNC" if message.tc1:
            found = Echo(message.ts1)
    return found


class RecordReader:
    """Reads records from messages; a position and the attitude nearest to it in time make an estimate.

    The attitude turns with its rates to the time of the position.
    Estimates are read only from the streams that the autopilot is asked for, by the stack of its heartbeat.
    """

    def __init__(self, streams: tuple[Stream, ...] = ()) -> None:
        self._streams = streams
        self._attitudes: deque[Any] = deque(maxlen=ATTITUDES)

    def read(self, message: Any) -> Record | None:
        """Return the record in a message; None for one that is of no use."""
        if message.get_type() == "HEARTBEAT" and not self._streams:
            idents = {stack.ident: stack.streams for stack in STACKS.values()}
            self._streams = idents.get(message.autopilot, ())
        return _read_record(message) or self._estimate(message)

    def _estimate(self, message: Any) -> EstimatedState | None:
        if message.get_msgId() not in self._streams:
            return None
        match message.get_type():
            case "ODOMETRY":
                return _read_odometry(message)
            case "ATTITUDE_QUATERNION":
                if _turned(message, message.time_boot_ms / 1e3) is not None:
                    self._attitudes.append(message)
            case "LOCAL_POSITION_NED":
                return self._with_attitude(message)
        return None

    def _with_attitude(self, message: Any) -> EstimatedState | None:
        """Return the estimate of a position; None if no attitude is near to it in time."""
        time_s = message.time_boot_ms / 1e3
        nearest = min(
            self._attitudes, key=lambda one: abs(one.time_boot_ms - message.time_boot_ms), default=None
        )
        if nearest is None or abs(nearest.time_boot_ms / 1e3 - time_s) > OLDEST_ATTITUDE_S:
            return None
        attitude_rad = _turned(nearest, time_s)
        if attitude_rad is None:
            return None
        position, velocity = (message.x, message.y, message.z), (message.vx, message.vy, message.vz)
        return _finite(EstimatedState(time_s, np.array(position), np.array(velocity), attitude_rad))


ATTITUDES: Final = 10
"""How many attitudes are kept."""
OLDEST_ATTITUDE_S: Final = 0.1
"""Largest time between a position and the attitude that goes with it."""


def _read_odometry(message: Any) -> EstimatedState | None:
    """Return the estimate of an ODOMETRY; None in frames other than NED."""
    attitude_rad = _attitude(message.q)
    velocity = np.array([message.vx, message.vy, message.vz])
    if attitude_rad is None or message.frame_id != LOCAL_NED:
        return None
    if message.child_frame_id == BODY_FRD:
        velocity = to_world(*sine_cosine(attitude_rad), velocity)
    elif message.child_frame_id != LOCAL_NED:
        return None
    position = np.array([message.x, message.y, message.z])
    return _finite(
        EstimatedState(message.time_usec / 1e6, position, velocity, attitude_rad, message.reset_counter)
    )


def _finite(estimate: EstimatedState) -> EstimatedState | None:
    """Return an estimate of finite numbers, None for another."""
    return estimate if np.isfinite([estimate.position_m, estimate.velocity_m_s]).all() else None


def _turned(message: Any, time_s: float) -> FloatArray | None:
    """Return roll, pitch, yaw of an ATTITUDE_QUATERNION, turned to a time; None if they are not finite."""
    half = (time_s - message.time_boot_ms / 1e3) / 2.0
    p, q, r = (half * rate for rate in (message.rollspeed, message.pitchspeed, message.yawspeed))
    w, x, y, z = message.q1, message.q2, message.q3, message.q4
    size = math.sqrt(p * p + q * q + r * r)
    share = math.sin(size) / size if size else 1.0
    c, p, q, r = math.cos(size), share * p, share * q, share * r
    return _attitude(
        [
            w * c - x * p - y * q - z * r,
            w * p + x * c + y * r - z * q,
            w * q - x * r + y * c + z * p,
            w * r + x * q - y * p + z * c,
        ]
    )


def _attitude(q: Any) -> FloatArray | None:
    """Return roll, pitch, yaw of a quaternion w, x, y, z; None for one of another length."""
    w, x, y, z = q
    try:
        attitude_rad = attitude_of_quaternion([x, y, z, w])
    except ArgumentError:
        return None
    return attitude_rad if np.isfinite(attitude_rad).all() else None


def quaternion(attitude_rad: FloatArray) -> list[float]:
    """Return the quaternion w, x, y, z of roll, pitch, yaw (3,)."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(a / 2.0), math.cos(a / 2.0)) for a in attitude_rad.tolist())
    return [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]


def _milliseconds(time_s: float) -> int:
    return round(1e3 * time_s) % 2**32
