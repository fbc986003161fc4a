"""What pilot and autopilot send to each other, as records; `messages` turns them into MAVLink and back.

Positions, velocities and angles are in NED, SI units, time is the autopilot's since its start.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from mambo_sil.drone.plant.arrays import FloatArray


class Stream(IntEnum):
    """MAVLink messages that the pilot asks the autopilot for."""

    ATTITUDE_QUATERNION = 31
    LOCAL_POSITION_NED = 32
    EXTENDED_SYS_STATE = 245
    ODOMETRY = 331


@dataclass(frozen=True)
class Stack:
    """What differs between two autopilots."""

    name: str
    ident: int
    """MAV_AUTOPILOT in its heartbeat."""
    guided: int
    """The mode in which it obeys set-points: custom_mode of its heartbeat, as `land`."""
    land: int
    hold: int
    """What it does by itself if it is told nothing."""
    modes: Mapping[int, str]
    hover_parameter: str
    """Share of the largest thrust that carries the drone."""
    streams: tuple[Stream, ...]
    """The messages that carry its state."""
    climbs_by_set_points: bool
    """Whether it takes off in its guided mode towards a position, or by a command."""
    obeys_after_s: float
    """How long it wants set-points before it accepts the guided mode."""
    needs: Mapping[str, int]
    """Bits that parameters must have, by name."""


def px4_mode(main: int, sub: int = 0) -> int:
    """Return PX4's custom_mode: main mode in byte 2, sub-mode in byte 3."""
    return main << 16 | sub << 24


PX4: Final = Stack(
    name="PX4",
    ident=12,
    guided=px4_mode(6),
    land=px4_mode(4, 6),
    hold=px4_mode(4, 3),
    modes={
        px4_mode(1): "MANUAL",
        px4_mode(2): "ALTITUDE",
        px4_mode(3): "POSITION",
        px4_mode(4, 2): "TAKEOFF",
        px4_mode(4, 3): "HOLD",
        px4_mode(4, 4): "MISSION",
        px4_mode(4, 5): "RETURN",
        px4_mode(4, 6): "LAND",
        px4_mode(5): "ACRO",
        px4_mode(6): "OFFBOARD",
        px4_mode(7): "STABILIZED",
    },
    hover_parameter="MPC_THR_HOVER",
    streams=(Stream.ODOMETRY,),
    climbs_by_set_points=True,
    obeys_after_s=1.2,
    needs={},
)
ARDUCOPTER: Final = Stack(
    name="ArduCopter",
    ident=3,
    guided=4,
    land=9,
    hold=4,
    modes={
        0: "STABILIZE",
        1: "ACRO",
        2: "ALT_HOLD",
        3: "AUTO",
        4: "GUIDED",
        5: "LOITER",
        6: "RTL",
        9: "LAND",
        16: "POSHOLD",
        17: "BRAKE",
        20: "GUIDED_NOGPS",
    },
    hover_parameter="MOT_THST_HOVER",
    streams=(Stream.LOCAL_POSITION_NED, Stream.ATTITUDE_QUATERNION),
    climbs_by_set_points=False,
    obeys_after_s=0.0,
    needs={"GUID_OPTIONS": 8},
)
STACKS: Final = {"px4": PX4, "ardupilot": ARDUCOPTER}
"""Autopilots by the name of an option; the only ones that are flown."""
MULTICOPTERS: Final = (2, 3, 13, 14, 15)
"""MAV_TYPE of a quadrotor, coaxial, hexarotor, octorotor and tricopter."""
COMPANION: Final = 18
"""MAV_TYPE of an onboard controller, which sends set-points."""


SET_MODE: Final = 176
"""Number of the command that sets a mode."""

# What the autopilot sends.


@dataclass(frozen=True)
class Heartbeat:
    """That a component is there: its MAV_AUTOPILOT, its MAV_TYPE, whether it is armed, and its mode."""

    system: int
    component: int
    autopilot: int
    vehicle: int
    armed: bool
    mode: int


@dataclass(frozen=True, eq=False)
class EstimatedState:
    """The estimated state."""

    time_s: float
    position_m: FloatArray
    """(3,), z down."""
    velocity_m_s: FloatArray
    """(3,)."""
    attitude_rad: FloatArray
    """Roll, pitch, yaw (3,)."""
    resets: int | None = None
    """How often the estimator has moved its state by a jump; None if it does not say."""
    rates_rad_s: FloatArray | None = None
    """About the axes of the body (3,); None of an estimate that was read."""


@dataclass(frozen=True)
class Parameter:
    """The value of a parameter."""

    name: str
    value: float


@dataclass(frozen=True)
class Answer:
    """Whether the autopilot accepts a command, by its number."""

    command: int
    accepted: bool


@dataclass(frozen=True)
class OnGround:
    """Whether the autopilot takes itself for landed."""

    landed: bool


@dataclass(frozen=True)
class Battery:
    """The share of the battery that remains."""

    share: float


@dataclass(frozen=True)
class Text:
    """A message to people."""

    text: str


@dataclass(frozen=True)
class Echo:
    """The answer to a `Ping`, with its number."""

    number: int


Record = Heartbeat | EstimatedState | Parameter | Answer | OnGround | Battery | Text | Echo


# What the pilot sends.


@dataclass(frozen=True)
class Beat:
    """The heartbeat of the pilot."""


@dataclass(frozen=True)
class SetRate:
    """Send a message at a rate."""

    stream: Stream
    rate_hz: float


@dataclass(frozen=True)
class AskParameter:
    """Send a parameter."""

    name: str


@dataclass(frozen=True)
class Ping:
    """Answer at once with the same number, 1 or more."""

    number: int


@dataclass(frozen=True)
class SetMode:
    """Change to a mode."""

    mode: int


@dataclass(frozen=True)
class Arm:
    """Arm or disarm; by force also in the air, where the drone then falls."""

    arm: bool
    force: bool = False


@dataclass(frozen=True)
class TakeOff:
    """Climb to a height above the place of take-off."""

    height_m: float


@dataclass(frozen=True, eq=False)
class SetPosition:
    """Go to a position with a heading, by the autopilot's own controller."""

    time_s: float
    position_m: FloatArray
    yaw_rad: float


@dataclass(frozen=True, eq=False)
class SetAttitude:
    """Fly roll, pitch, yaw (3,) with a share of the largest thrust."""

    time_s: float
    attitude_rad: FloatArray
    thrust: float


Order = Beat | SetRate | AskParameter | Ping | SetMode | Arm | TakeOff | SetPosition | SetAttitude
