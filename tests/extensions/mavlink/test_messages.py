"""The fields of the messages, as the definitions of MAVLink and the manuals of the autopilots name them."""

import math
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink
from scipy.spatial.transform import Rotation

from mambo_extensions.mavlink.messages import RecordReader, read_order, send_order, send_record
from mambo_sil.life.records import (
    ARDUCOPTER,
    PX4,
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


class Sender:
    """Pymavlink's codec, and the messages that it has sent, as the other side reads them."""

    def __init__(self) -> None:
        self.mav: Any = mavlink.MAVLink(self, 1, 1)
        self._data = b""

    def write(self, data: bytes) -> None:
        """Keep what is sent."""
        self._data += data

    def messages(self) -> list[Any]:
        """Return what was sent."""
        return list(mavlink.MAVLink(None).parse_buffer(self._data))


def sent(order: Order, stack: Stack = PX4) -> Any:
    """Return the message of an order."""
    sender = Sender()
    send_order(sender.mav, order, 7, stack)
    (message,) = sender.messages()
    return message


def test_an_attitude_is_a_quaternion_with_a_share_of_the_thrust() -> None:
    """Rolled by 90 degrees: w and x are alike. The rates are to be ignored, bits 0 to 2 of the mask."""
    message = sent(SetAttitude(1.25, np.array([math.pi / 2.0, 0.0, 0.0]), 0.4))
    assert message.get_type() == "SET_ATTITUDE_TARGET"
    assert (message.target_system, message.target_component, message.time_boot_ms) == (7, 1, 1250)
    np.testing.assert_allclose(message.q, [math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0], atol=1e-7)
    assert (message.type_mask, message.thrust) == (7, pytest.approx(0.4))


@pytest.mark.parametrize(
    ("axis", "place"), [([0.0, 0.4, 0.0], 2), ([0.0, 0.0, 0.4], 3)], ids=["pitch", "yaw"]
)
def test_pitch_and_yaw_turn_about_y_and_z(axis: list[float], place: int) -> None:
    """Of the quaternion w, x, y, z."""
    q = sent(SetAttitude(0.0, np.array(axis), 0.5)).q
    assert q[0] == pytest.approx(math.cos(0.2))
    assert q[place] == pytest.approx(math.sin(0.2))


def test_a_position_is_one_in_the_local_frame_with_a_heading() -> None:
    """LOCAL_NED; ignored are velocity, acceleration and yaw rate, bits 3 to 8 and 11."""
    message = sent(SetPosition(2.0, np.array([1.0, 2.0, -3.0]), 0.5))
    assert (message.x, message.y, message.z, message.yaw) == (1.0, 2.0, -3.0, 0.5)
    assert message.coordinate_frame == 1
    assert message.type_mask == sum(1 << bit for bit in (3, 4, 5, 6, 7, 8, 11))


@pytest.mark.parametrize(
    ("order", "stack", "fields"),
    [
        (SetMode(PX4.guided), PX4, (176, 1.0, 6.0, 0.0)),
        (SetMode(PX4.land), PX4, (176, 1.0, 4.0, 6.0)),
        (SetMode(ARDUCOPTER.guided), ARDUCOPTER, (176, 1.0, 4.0, 0.0)),
        (SetMode(ARDUCOPTER.land), ARDUCOPTER, (176, 1.0, 9.0, 0.0)),
        (Arm(arm=True), PX4, (400, 1.0, 0.0, 0.0)),
        (Arm(arm=False, force=True), PX4, (400, 0.0, 21196.0, 0.0)),
        (SetRate(Stream.ODOMETRY, 100.0), PX4, (511, 331.0, 10000.0, 0.0)),
    ],
    ids=str,
)
def test_commands_have_their_numbers(order: Order, stack: Stack, fields: tuple[float, ...]) -> None:
    """Modes: main mode and sub-mode of PX4, custom mode of ArduCopter; an interval in us."""
    message = sent(order, stack)
    assert (message.command, message.param1, message.param2, message.param3) == fields
    assert (message.target_system, message.target_component) == (7, 1)


def test_a_take_off_has_its_height_last() -> None:
    """In parameter 7."""
    message = sent(TakeOff(1.5), ARDUCOPTER)
    assert (message.command, message.param7) == (22, 1.5)


def test_the_pilot_is_an_onboard_computer() -> None:
    """Without an autopilot of its own."""
    message = sent(Beat())
    assert (message.get_type(), message.type, message.autopilot) == ("HEARTBEAT", 18, 8)


ORDERS: list[tuple[Order, Stack]] = [
    (SetMode(PX4.land), PX4),
    (SetMode(ARDUCOPTER.land), ARDUCOPTER),
    (Arm(arm=True), PX4),
    (Arm(arm=False, force=True), ARDUCOPTER),
    (SetRate(Stream.ODOMETRY, 50.0), PX4),
    (TakeOff(2.0), ARDUCOPTER),
    (AskParameter("MPC_THR_HOVER"), PX4),
    (Ping(12), ARDUCOPTER),
]


@pytest.mark.parametrize(("order", "stack"), ORDERS, ids=str)
def test_the_simulated_autopilot_reads_each_order(order: Order, stack: Stack) -> None:
    """As it was given."""
    assert read_order(sent(order, stack), stack) == order


RECORDS: list[Record] = [
    Heartbeat(1, 1, 12, 2, armed=True, mode=PX4.guided),
    Parameter("MPC_THR_HOVER", 0.5),
    Answer(176, accepted=False),
    OnGround(landed=True),
    Battery(0.42),
    Text("Preflight Fail"),
    Echo(12),
]


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: type(record).__name__)
def test_the_pilot_reads_each_record(record: Record) -> None:
    """As it was given."""
    sender = Sender()
    send_record(sender.mav, record)
    assert [RecordReader().read(one) for one in sender.messages()] == [record]


def test_a_position_and_an_attitude_make_an_estimate() -> None:
    """LOCAL_POSITION_NED with the attitude before it; alone, or with an old attitude, it makes none."""
    sender, reader = Sender(), RecordReader(ARDUCOPTER.streams)
    sender.mav.local_position_ned_send(1000, 1.0, 2.0, -3.0, 0.1, 0.2, -0.3)
    sender.mav.attitude_quaternion_send(1000, math.cos(0.1), math.sin(0.1), 0.0, 0.0, 0.0, 0.0, 0.0)
    sender.mav.local_position_ned_send(1010, 1.0, 2.0, -3.0, 0.1, 0.2, -0.3)
    sender.mav.local_position_ned_send(1200, 1.0, 2.0, -3.0, 0.1, 0.2, -0.3)
    first, attitude, estimate, late = map(reader.read, sender.messages())
    assert (first, attitude, late) == (None, None, None)
    assert isinstance(estimate, EstimatedState)
    assert (estimate.time_s, estimate.resets) == (1.01, None)
    np.testing.assert_allclose(estimate.position_m, [1.0, 2.0, -3.0])
    np.testing.assert_allclose(estimate.velocity_m_s, [0.1, 0.2, -0.3], atol=1e-7)
    np.testing.assert_allclose(estimate.attitude_rad, [0.2, 0.0, 0.0], atol=1e-7)


@pytest.mark.parametrize("after_s", [0.05, -0.05])
def test_an_attitude_turns_with_its_rates_to_the_time_of_the_position(after_s: float) -> None:
    """By the rotation of the body, about an axis that is none of its own; a rate of NaN makes no estimate."""
    sender, reader = Sender(), RecordReader(ARDUCOPTER.streams)
    attitude, rates_rad_s = Rotation.from_euler("ZYX", [2.0, -0.3, 0.5]), np.array([2.0, -3.0, 1.0])
    x, y, z, w = attitude.as_quat()
    sender.mav.attitude_quaternion_send(1000, w, x, y, z, *rates_rad_s)
    sender.mav.local_position_ned_send(1000 + round(1e3 * after_s), 1.0, 2.0, -3.0, 0.1, 0.2, -0.3)
    sender.mav.attitude_quaternion_send(2000, w, x, y, z, math.nan, 0.0, 0.0)
    sender.mav.local_position_ned_send(2000, 1.0, 2.0, -3.0, 0.1, 0.2, -0.3)
    _, estimate, _, without = map(reader.read, sender.messages())
    assert isinstance(estimate, EstimatedState)
    turned = attitude * Rotation.from_rotvec(after_s * rates_rad_s)
    np.testing.assert_allclose(estimate.attitude_rad[::-1], turned.as_euler("ZYX"), atol=1e-6)
    assert without is None


@pytest.mark.parametrize(("child", "velocity"), [(1, [0.5, 0.0, 0.0]), (12, [0.0, 0.5, 0.0])])
def test_an_odometry_has_its_velocity_in_either_frame(child: int, velocity: list[float]) -> None:
    """In NED, or forward-right-down: the drone flies ahead with its nose to the east."""
    sender = Sender()
    half, unknown = math.sqrt(0.5), [math.nan] * 21
    sender.mav.odometry_send(
        *(2_000_000, 1, child, 1.0, 2.0, -3.0, [half, 0.0, 0.0, half], 0.5, 0.0, 0.0),
        *(0.0, 0.0, 0.0, unknown, unknown, 4, 8),
    )
    (estimate,) = map(RecordReader(PX4.streams).read, sender.messages())
    assert isinstance(estimate, EstimatedState)
    assert (estimate.time_s, estimate.resets) == (2.0, 4)
    np.testing.assert_allclose(estimate.velocity_m_s, velocity, atol=1e-7)
    np.testing.assert_allclose(estimate.attitude_rad, [0.0, 0.0, math.pi / 2.0], atol=1e-6)


@pytest.mark.parametrize("broken", ["position", "attitude", "frame"])
def test_what_is_no_estimate_is_left_out(broken: str) -> None:
    """NaN, a quaternion of length 0, another frame."""
    sender = Sender()
    unknown, x = [math.nan] * 21, math.nan if broken == "position" else 1.0
    q = [0.0] * 4 if broken == "attitude" else [1.0, 0.0, 0.0, 0.0]
    sender.mav.odometry_send(
        *(2_000_000, 20 if broken == "frame" else 1, 1, x, 2.0, -3.0, q, 0.0, 0.0, 0.0),
        *(0.0, 0.0, 0.0, unknown, unknown, 0, 8),
    )
    assert [RecordReader(PX4.streams).read(one) for one in sender.messages()] == [None]
