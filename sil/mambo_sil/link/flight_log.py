"""The log of a flight over a link: a row for each step, as `identify` and `replay` read it."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from mambo_sil.link.steady_frame import FrameJump
from mambo_sil.link.steering import Update
from mambo_sil.model.identify.signals import JUMP, JUMPS, START_THRUST, TAKE_OVERS, THRUST, THRUST_COMMAND

COLUMNS: Final = (
    *("time_s", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s", "roll_rad", "pitch_rad", "yaw_rad"),
    *("target_x_m", "target_y_m", "target_height_m", "target_vx_m_s", "target_vy_m_s", "target_climb_m_s"),
    *("target_ax_m_s2", "target_ay_m_s2", "target_climb_acceleration_m_s2", "target_yaw_rad"),
    *("roll_command_rad", "pitch_command_rad", THRUST, THRUST_COMMAND, "status"),
    *(TAKE_OVERS, START_THRUST, JUMPS, *JUMP),
)
"""The target is the one that the controller got: off by what remains of the jumps of the estimator."""


def write_log(updates: Sequence[Update], path: Path) -> None:
    """Write the steps of a flight as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(map(_row, updates))


def _row(update: Update) -> list[float]:
    estimate, target = update.estimate, update.target
    x, y, z = target.position_m.tolist()
    vx, vy, vz = target.velocity_m_s.tolist()
    ax, ay, az = (0.0, 0.0, 0.0) if target.acceleration_m_s2 is None else target.acceleration_m_s2.tolist()
    return [
        estimate.time_s,
        *(*estimate.position_m.tolist(), *estimate.velocity_m_s.tolist(), *estimate.attitude_rad.tolist()),
        *(x, y, -z, vx, vy, -vz, ax, ay, -az),
        0.0 if target.yaw_rad is None else float(target.yaw_rad),
        *(*update.command_rad, update.thrust_m_s2, update.thrust, update.status),
        *(update.take_overs, update.start_thrust_m_s2, update.jumps),
        *_jump(update.jump),
    ]


def _jump(jump: FrameJump | None) -> list[float]:
    """Return the columns of a jump, zeros of none."""
    if jump is None:
        return [0.0] * len(JUMP)
    return [*jump.position_m.tolist(), *jump.velocity_m_s.tolist(), jump.heading_rad]
