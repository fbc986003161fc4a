"""What a closed-loop run leaves behind, and how it is written down."""

import csv
import zipfile
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sil.arrays import FloatArray, IntArray
from sil.errors import TraceError

CSV_COLUMNS = (
    *("time_s", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s", "roll_rad", "pitch_rad", "yaw_rad"),
    *("target_x_m", "target_y_m", "target_vx_m_s", "target_vy_m_s"),
    *("roll_command_rad", "pitch_command_rad", "thrust_acceleration_m_s2", "status"),
)


@dataclass(frozen=True, eq=False)
class Trace:
    """The record of n flights at k instants, one for each step of the position controller.

    Instants before t = 0 belong to the take-off. A flight that diverged is NaN from there on.
    """

    time_s: FloatArray
    """Time on the trajectory's clock (k,)."""
    position_m: FloatArray
    """Position in the world frame (k, n, 3), z down."""
    velocity_m_s: FloatArray
    """Velocity in the world frame (k, n, 3)."""
    euler_rad: FloatArray
    """Roll, pitch, yaw (k, n, 3)."""
    target: FloatArray
    """Target [x, y, vx, vy] in m and m/s (k, n, 4)."""
    command_rad: FloatArray
    """Roll and pitch commanded from this instant to the next (k, n, 2)."""
    thrust_acceleration_m_s2: FloatArray
    """Thrust that the altitude loop asks for, over the nominal mass (k, n)."""
    status: IntArray
    """Status of the position controller (k, n)."""

    def same_bits(self, other: "Trace") -> bool:
        """Tell whether every array equals that of another trace, bit for bit."""
        return all(getattr(self, f.name).tobytes() == getattr(other, f.name).tobytes() for f in fields(self))

    @property
    def flights(self) -> int:
        """Number of flights n."""
        return int(self.status.shape[1])

    @property
    def diverged(self) -> NDArray[np.bool_]:
        """Whether each flight was lost before its end (n,)."""
        return np.asarray(np.isnan(self.position_m[-1]).any(axis=-1))


def write_csv(trace: Trace, path: Path, flight: int = 0) -> None:
    """Write one flight of a trace with the columns `CSV_COLUMNS`; numbers read back to the same bits."""
    numbers = np.column_stack(
        [
            trace.time_s,
            trace.position_m[:, flight],
            trace.velocity_m_s[:, flight],
            trace.euler_rad[:, flight],
            trace.target[:, flight],
            trace.command_rad[:, flight],
            trace.thrust_acceleration_m_s2[:, flight],
        ]
    )
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(CSV_COLUMNS)
        writer.writerows(
            [*row, status]
            for row, status in zip(numbers.tolist(), trace.status[:, flight].tolist(), strict=True)
        )


def write_npz(trace: Trace, path: Path) -> None:
    """Write all flights of a trace, one array for each field."""
    with path.open("wb") as file:
        np.savez_compressed(file, **{field.name: getattr(trace, field.name) for field in fields(Trace)})


def read_npz(path: Path) -> Trace:
    """Read what `write_npz` wrote; raises `TraceError`."""
    try:
        with path.open("rb") as file, np.load(file) as arrays:
            return Trace(**{field.name: arrays[field.name] for field in fields(Trace)})
    except (OSError, ValueError, TypeError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise TraceError(f"{path}: is no trace: {error}") from error
