"""A log flown in a simulator of others, and the drone that `identify` finds in it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
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
    """Return the targets (k, 9) of the manoeuvre of `identify`, in NWU, every 10 ms."""
    times_s = np.asarray(STEP_S * np.arange(round(DURATION_S / STEP_S) + 1), np.float64)
    north_m, east_m = reference_m(times_s)
    targets = np.zeros((len(times_s), 9))
    for axis, values in enumerate((north_m, -east_m)):
        targets[:, axis] = values
        targets[:, 3 + axis] = np.gradient(values, STEP_S)
    targets[:, 2] = height_m
    return targets


def identified(rows: Sequence[LogRow], path: Path, mass_kg: float, known: VehicleFile) -> str:
    """Return the vehicle.toml of a log with the sensors, and with what the log does not show of a known one.

    That is its altitude loop, and the response of its thrust if the log does not show it. Writes the log to
    `path`. Raises ValueError if the log is not good enough.
    """
    lines = [",".join(COLUMNS), *(",".join(f"{value:.7g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", "utf-8")
    logs, left_out = read_logs([path], {})
    summary, _ = identify(logs, left_out)
    if not summary.good:
        raise ValueError(f"{path}: {summary.verdicts}")
    assert known.thrust is not None
    text = vehicle_text(summary, mass_kg)
    sections = {"altitude": known.altitude.model_dump(), "thrust": known.thrust.model_dump()}
    lines = [text, SENSORS]
    for name, keys in sections.items():
        if f"[{name}]" in text:
            continue
        lines += [f"[{name}]", *(f"{key} = {value}" for key, value in keys.items()), ""]
    return "\n".join(lines)
