"""A log flown in a simulator of others, the drone that `identify` finds in it, and the settings for it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.model.derive.derived_settings import controller_text
from mambo_sil.model.identify.identify import identify, read_logs
from mambo_sil.model.identify.identify_report import vehicle_text
from mambo_sil.model.identify.manoeuvre import DURATION_S, reference_m

STEP_S: Final = 0.01
COLUMNS: Final = (
    *("time_s", "roll_command_rad", "pitch_command_rad", "roll_rad", "pitch_rad", "yaw_rad"),
    *("vx_m_s", "vy_m_s", "z_m", "thrust_acceleration_m_s2"),
)
SENSORS: Final = """
[sensors]  # those of the flights, as who flies knows them
kind = "mocap"
position_rate_hz = 100
position_noise_m = 0.001
position_delay_s = 0.01
velocity_filter_s = 0.03
attitude_noise_rad = 0.003
"""
LogRow = Sequence[float]


def manoeuvre(height_m: float) -> FloatArray:
    """Return the targets (k, 10) of the manoeuvre of `identify`, in NWU, every 10 ms."""
    times_s = np.asarray(STEP_S * np.arange(round(DURATION_S / STEP_S) + 1), np.float64)
    north_m, east_m = reference_m(times_s)
    targets = np.zeros((len(times_s), 10))
    for axis, values in enumerate((north_m, -east_m)):
        targets[:, axis] = values
        targets[:, 3 + axis] = np.gradient(values, STEP_S)
    targets[:, 2] = height_m
    return targets


def identified(rows: Sequence[LogRow], path: Path, mass_kg: float) -> tuple[str, Settings]:
    """Return the vehicle.toml of a log, with the sensors, and the settings that `design` derives from it.

    Writes the log to `path`. Raises ValueError if the log is not good enough.
    """
    lines = [",".join(COLUMNS), *(",".join(f"{value:.7g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", "utf-8")
    logs, left_out = read_logs([path], {})
    summary, _ = identify(logs, left_out)
    if not summary.good:
        raise ValueError(f"{path}: {summary.verdicts}")
    text = vehicle_text(summary, mass_kg) + SENSORS
    return text, identified_settings(text)


def identified_settings(text: str) -> Settings:
    """Return the settings that `design` derives from a vehicle.toml."""
    drone = vehicle_toml.parse(text, "identified", "identified")
    return controller_toml.parse(controller_text(drone, "identified"), "identified")
