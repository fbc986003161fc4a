"""The columns of a flight log that a replay reads, by signal."""

from typing import Final

from mambo_codegen.port.port import ControllerPort
from mambo_sil.model.identify.columns import KNOWN, Column
from mambo_sil.model.identify.signals import (
    DEGREE,
    GROUNDED,
    HEIGHT,
    JUMP,
    JUMPS,
    LEVELLED,
    POSITION,
    START_THRUST,
    TAKE_OVERS,
    TARGET,
    TARGET_ACCELERATION,
    TARGET_AHEAD,
    TARGET_HEIGHT,
    TARGET_KNOWN,
    THRUST,
    TILTS,
    UPDATE,
    VELOCITY,
    YAW,
)

DOWNWARD: Final = (HEIGHT, "vz_m_s")
"""Signals of a state whose z points down; those of a target point up."""
_MEMBERS: Final = {
    "state": {
        "position_m": POSITION,
        "velocity_m_s": VELOCITY,
        "height_m": DOWNWARD[:1],
        "climb_m_s": DOWNWARD[1:],
        **{name: (name,) for name in (*TILTS, YAW)},
    },
    "target": {
        "position_m": TARGET[:2],
        "velocity_m_s": TARGET[2:],
        "acceleration_m_s2": TARGET_ACCELERATION,
        "ahead_m_s2": TARGET_AHEAD,
        **{name.removeprefix("target_"): (name,) for name in TARGET_HEIGHT},
    },
}
"""The signals of the members of a state and of a target; another one is read from the column of its name."""
ASKED: Final = (*TARGET_ACCELERATION, *TARGET_AHEAD, *TARGET_HEIGHT, "vz_m_s")
"""Signals that are read only where the controller needs them."""
APP_GROUP: Final = "nmpc."
"""The group of the app's logs, if the prefix of its names is that by default."""
_APP: Final = {
    "x_m": Column("nmpc.x"),
    "y_m": Column("nmpc.y", -1.0),
    "vx_m_s": Column("nmpc.vx"),
    "vy_m_s": Column("nmpc.vy", -1.0),
    "roll_rad": Column("nmpc.inRoll"),
    "pitch_rad": Column("nmpc.inPitch"),
    "yaw_rad": Column("nmpc.inYaw", -1.0),
    "target_x_m": Column("nmpc.targetX"),
    "target_y_m": Column("nmpc.targetY", -1.0),
    "target_vx_m_s": Column("nmpc.targetVx"),
    "target_vy_m_s": Column("nmpc.targetVy", -1.0),
    "target_ax_m_s2": Column("nmpc.targetAx"),
    "target_ay_m_s2": Column("nmpc.targetAy", -1.0),
    HEIGHT: Column("nmpc.z", -1.0),
    "vz_m_s": Column("nmpc.vz", -1.0),
    "target_height_m": Column("nmpc.targetZ"),
    "target_climb_m_s": Column("nmpc.targetVz"),
    "target_climb_acceleration_m_s2": Column("nmpc.targetAz"),
    "roll_command_rad": Column("nmpc.outRoll"),
    "pitch_command_rad": Column("nmpc.outPitch"),
    THRUST: Column("nmpc.outThrust"),
    TAKE_OVERS: Column("nmpc.takeOvers"),
    UPDATE: Column("nmpc.step"),
    START_THRUST: Column("nmpc.startThrust"),
    GROUNDED: Column("nmpc.grounded"),
    LEVELLED: Column("nmpc.level"),
    TARGET_KNOWN: Column("nmpc.targetKnown"),
}
"""What the app of the Crazyflie logs of each step."""
_OTHER: Final[dict[str, tuple[Column, ...]]] = {
    **KNOWN,
    "target_x_m": (Column("target_x_m"), Column("ctrltarget.x")),
    "target_y_m": (Column("target_y_m"), Column("ctrltarget.y", -1.0)),
    "target_vx_m_s": (Column("target_vx_m_s"), Column("ctrltarget.vx")),
    "target_vy_m_s": (Column("target_vy_m_s"), Column("ctrltarget.vy", -1.0)),
    "target_ax_m_s2": (Column("target_ax_m_s2"), Column("ctrltarget.ax")),
    "target_ay_m_s2": (Column("target_ay_m_s2"), Column("ctrltarget.ay", -1.0)),
    "vz_m_s": (Column("seen_vz_m_s"), Column("vz_m_s"), Column("stateEstimate.vz", -1.0)),
    "target_height_m": (Column("target_height_m"), Column("ctrltarget.z")),
    "target_climb_m_s": (Column("target_climb_m_s"), Column("ctrltarget.vz")),
    "target_climb_acceleration_m_s2": (Column("target_climb_acceleration_m_s2"), Column("ctrltarget.az")),
    "target_climb_ahead_m_s2": (Column("target_climb_ahead_m_s2"),),
    **{name: (Column(name),) for name in (*TARGET_AHEAD, TARGET_KNOWN)},
    "roll_command_rad": (Column("roll_command_rad"), Column("nmpc.roll", DEGREE)),
    "pitch_command_rad": (Column("pitch_command_rad"), Column("nmpc.pitch", DEGREE)),
    GROUNDED: (Column(GROUNDED), Column("grounded")),
    **{name: (Column(name),) for name in (TAKE_OVERS, UPDATE, START_THRUST, LEVELLED, JUMPS, *JUMP)},
}
SIGNALS: Final[dict[str, tuple[Column, ...]]] = {
    name: (
        *(column for column in columns if "." not in column.name),
        *((_APP[name],) if name in _APP else ()),
        *(column for column in columns if "." in column.name and column != _APP.get(name)),
    )
    for name, columns in _OTHER.items()
}
"""Known columns of each signal, the first one that a file has is read: of trace.csv, of the app's
steps, and of the Crazyflie, whose y has the other sign. The commands are the controller's own."""


def signals_of(port: ControllerPort, record: str) -> tuple[str, ...]:
    """Return the signals of the numbers of a state or target, in their order, but of integers."""
    return tuple(
        _MEMBERS[record].get(one.row.member, (f"{record}_{one.member}",) * (one.axis + 1))[one.axis]
        for one in port.reals(record)
    )
