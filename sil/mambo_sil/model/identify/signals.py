"""The signals of a flight log, and the record of a log: what the readers write and the fits read."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.frames import turned_tilt
from mambo_sil.model.identify.resolution import Resolution

DEGREE: Final = math.pi / 180.0

TIME: Final = "time_s"
COMMANDS: Final = ("roll_command_rad", "pitch_command_rad")
TILTS: Final = ("roll_rad", "pitch_rad")
REQUIRED: Final = (*COMMANDS, *TILTS)
YAW: Final = "yaw_rad"
POSITION: Final = ("x_m", "y_m")
HEIGHT: Final = "z_m"
VELOCITY: Final = ("vx_m_s", "vy_m_s")
SEEN: Final = ("seen_x_m", "seen_y_m")
"""The position that a camera measured, beside the estimate."""
THRUST: Final = "thrust_acceleration_m_s2"
THRUST_COMMAND: Final = "thrust_command"
"""The commanded thrust in any unit; where a log has none, its `THRUST` is taken."""
TARGET: Final = ("target_x_m", "target_y_m", "target_vx_m_s", "target_vy_m_s")
TARGET_ACCELERATION: Final = ("target_ax_m_s2", "target_ay_m_s2")
TARGET_AHEAD: Final = ("target_ahead_x_m_s2", "target_ahead_y_m_s2")
TARGET_HEIGHT: Final = (
    *("target_height_m", "target_climb_m_s", "target_climb_acceleration_m_s2"),
    "target_climb_ahead_m_s2",
)
TARGET_KNOWN: Final = "target_known"
"""What the target of a step knows, 0 to 2."""
TAKE_OVERS: Final = "take_overs"
"""How often the controller has begun anew, at the present attitude or its `START_TILTS`."""
START_TILTS: Final = ("start_roll_rad", "start_pitch_rad")
"""The angles with which it did."""
START_THRUST: Final = "start_thrust_m_s2"
"""The thrust over mass with which it did; a log that has it says in `THRUST` what was commanded."""
JUMPS: Final = "estimator_jumps"
"""How often the frame of the estimates has jumped."""
JUMP: Final = (
    *("jump_x_m", "jump_y_m", "jump_z_m", "jump_vx_m_s", "jump_vy_m_s", "jump_vz_m_s", "jump_yaw_rad"),
)
"""By what it did last, as the controller was told."""
GROUNDED: Final = "on_ground"
"""Whether the controller was told that the floor may carry the drone."""
LEVELLED: Final = "levelled"
"""Whether its caller flew level instead of the tilt that it computed."""
SHIFT: Final = "shift"
"""By what the frame of a controller of the height jumped before the step: shift_0 .. shift_6, of position,
velocity (each x, y, up) and heading."""
PARAMETER: Final = "parameter_"
"""How signals of the parameters of our own flight mode begin; what follows is MC_NMPC_ in the log."""
OF_HEIGHTS: Final = (*START_TILTS, START_THRUST, GROUNDED, LEVELLED)
UPDATE: Final = "update"
"""The number of the update that the row is of, counted modulo `UPDATES`."""
UPDATES: Final = 2**16
OPTIONAL: Final = (
    YAW,
    *POSITION,
    HEIGHT,
    *VELOCITY,
    *SEEN,
    THRUST,
    THRUST_COMMAND,
    TAKE_OVERS,
    UPDATE,
    *OF_HEIGHTS,
    JUMPS,
    *JUMP,
    *TARGET_ACCELERATION,
    *TARGET_AHEAD,
    *TARGET_HEIGHT,
    TARGET_KNOWN,
)
"""Optional signals; all signals are in SI units, the world frame is NED, roll is positive to the right and
pitch is positive with the nose up."""


@dataclass(frozen=True, eq=False)
class Signal:
    """Values (k,) of a signal at increasing times (k,) in s, both finite, and the column they come from."""

    time_s: FloatArray
    value: FloatArray
    column: str
    resolution: Resolution | None = None
    """How the column is rounded; None for all digits."""


def stamped(time_us: FloatArray, values: FloatArray, column: str) -> Signal:
    """Return the finite values of a field over its time stamps."""
    there = np.isfinite(values)
    return Signal(1e-6 * time_us[there], values[there], column)


def tilts_at_heading(
    set_point_rad: Sequence[FloatArray], clock: FloatArray, yaw_rad: FloatArray, yaw_clock: FloatArray
) -> FloatArray:
    """Return roll and pitch (2, k) of set-points, roll, pitch and yaw (3, k), at the newest heading.

    Roll and pitch of a set-point are those of its own heading, which that of the drone, yaw_rad, lags.
    """
    roll, pitch, yaw = set_point_rad
    newest = np.maximum(np.searchsorted(yaw_clock, clock, side="right") - 1, 0)
    turns = np.nan_to_num(yaw_rad[newest] - yaw)
    known = [np.where(np.isfinite(each), each, np.nan).tolist() for each in (roll, pitch, turns)]
    return np.array([turned_tilt(*one) for one in zip(*known, strict=True)]).reshape(-1, 2).T


@dataclass(frozen=True, eq=False)
class FlightLog:
    """One log: signals by name, at least the `REQUIRED` ones."""

    name: str
    """Name of the file, fit for a message."""
    signals: Mapping[str, Signal]
    remarks: tuple[str, ...] = field(default=())
    """What the reader left out, in words."""
