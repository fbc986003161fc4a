"""The trace of a simulation: its arrays, digest, CSV and NPZ files."""

import hashlib
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray, IntArray
from mambo_sil.errors import TraceError
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M

CSV_COLUMNS = (
    *("time_s", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s", "roll_rad", "pitch_rad", "yaw_rad"),
    *("target_x_m", "target_y_m", "target_vx_m_s", "target_vy_m_s"),
    *("roll_command_rad", "pitch_command_rad", "thrust_acceleration_m_s2", "status"),
)
SEEN_COLUMNS = (
    *("seen_x_m", "seen_y_m", "seen_z_m", "seen_vx_m_s", "seen_vy_m_s", "seen_vz_m_s"),
    *("seen_roll_rad", "seen_pitch_rad", "seen_yaw_rad"),
)
"""Columns that follow `CSV_COLUMNS` in a flight with sensors."""

HEIGHT_COLUMNS = ("target_height_m", "target_climb_m_s")
"""Columns that follow `target_vy_m_s` where the course has a height."""

TARGET_COLUMNS: Final = 4
SPATIAL_TARGET_COLUMNS: Final = 6

AXES: Final[dict[str, tuple[int, ...]]] = {
    "position_m": (3,),
    "velocity_m_s": (3,),
    "euler_rad": (3,),
    "target": (TARGET_COLUMNS,),
    "command_rad": (2,),
    "thrust_acceleration_m_s2": (),
}
"""Axes of each array after sample and flight; `seen_position_m` has the axes of `position_m`, and so on.

A course with a height has a target of `SPATIAL_TARGET_COLUMNS`.
"""


@dataclass(frozen=True, eq=False)
class Trace:
    """n flights, sampled at the k updates of the position controller.

    Samples before t = 0 belong to the take-off. A flight that is lost is NaN from then on.
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
    """Target [x, y, vx, vy] in m and m/s (k, n, 4), or with [height, climb] (k, n, 6) in space."""
    command_rad: FloatArray
    """Roll and pitch command, held until the next sample (k, n, 2)."""
    thrust_acceleration_m_s2: FloatArray
    """Thrust demanded by the altitude loop, divided by the nominal mass (k, n)."""
    status: IntArray
    """Status of the position controller (k, n)."""

    def same_bits(self, other: "Trace") -> bool:
        """Return whether every array equals another trace's, bit for bit."""
        return type(self) is type(other) and all(
            getattr(self, f.name).tobytes() == getattr(other, f.name).tobytes() for f in fields(self)
        )

    def digest(self, flight: int = 0) -> str:
        """Return the SHA-256 of times and arrays of one flight; the height of a level course is left out."""
        hasher = hashlib.sha256(self.time_s.tobytes())
        for column in fields(self):
            if column.name != "time_s":
                array = (
                    self._target_of(flight)
                    if column.name == "target"
                    else getattr(self, column.name)[:, flight]
                )
                hasher.update(np.ascontiguousarray(array).data)
        return hasher.hexdigest()

    def _target_of(self, flight: int) -> FloatArray:
        """Return the target (k, 4 or 6) of one flight: on a level course that which the flight has alone."""
        target: FloatArray = self.target[:, flight]
        level = self.spatial and (target[:, TARGET_COLUMNS:] == (HOVER_HEIGHT_M, 0.0)).all()
        return target[:, :TARGET_COLUMNS] if level else target

    @property
    def spatial(self) -> bool:
        """Whether the course of any flight has a height."""
        return int(self.target.shape[-1]) == SPATIAL_TARGET_COLUMNS

    @property
    def target_height_m(self) -> FloatArray:
        """Height of the target above the ground (k, n)."""
        if self.spatial:
            return np.asarray(self.target[..., TARGET_COLUMNS])
        return np.full(self.status.shape, HOVER_HEIGHT_M)

    def in_space(self) -> Self:
        """Return the trace with the height of its course, also of a level one."""
        if self.spatial:
            return self
        level = np.broadcast_to((HOVER_HEIGHT_M, 0.0), (*self.status.shape, 2))
        return replace(self, target=np.concatenate([self.target, level], axis=-1))

    @property
    def flights(self) -> int:
        """Number of flights n."""
        return int(self.status.shape[1])

    @property
    def diverged(self) -> NDArray[np.bool_]:
        """Whether each flight was lost (n,)."""
        return np.asarray(np.isnan(self.position_m[-1]).any(axis=-1))


@dataclass(frozen=True, eq=False)
class SensedTrace(Trace):
    """A trace with sensors: the fields of `Trace` hold the true state, these the controllers' estimates."""

    seen_position_m: FloatArray
    """Estimated position in the world frame (k, n, 3)."""
    seen_velocity_m_s: FloatArray
    """Estimated velocity in the world frame (k, n, 3)."""
    seen_euler_rad: FloatArray
    """Estimated roll, pitch, yaw (k, n, 3)."""

    def as_seen(self) -> Trace:
        """Return a trace with the estimates in place of the true state."""
        return replace(
            self,
            position_m=self.seen_position_m,
            velocity_m_s=self.seen_velocity_m_s,
            euler_rad=self.seen_euler_rad,
        )


def write_csv(
    trace: Trace, path: Path, flight: int = 0, others: Mapping[str, FloatArray] | None = None
) -> None:
    """Write one flight as CSV with the columns `CSV_COLUMNS` and, with sensors, `SEEN_COLUMNS`.

    `others` are further columns (k,) by name.

    Every number is spelled so that it reads back to the same bits.
    """
    columns = [trace.time_s.tolist()]
    for name in (field.name for field in fields(trace) if field.name != "time_s"):
        columns += getattr(trace, name)[:, flight].reshape(len(trace.time_s), -1).T.tolist()
    names: tuple[str, ...] = CSV_COLUMNS
    if trace.spatial:
        place = names.index("target_vy_m_s") + 1
        names = names[:place] + HEIGHT_COLUMNS + names[place:]
    names += SEEN_COLUMNS if isinstance(trace, SensedTrace) else ()
    if others:
        names += tuple(others)
        columns += [column.tolist() for column in others.values()]
    spelled = zip(*(map(repr, column) for column in columns), strict=True)
    lines = (",".join(names), *map(",".join, spelled), "")
    with path.open("w", newline="", encoding="utf-8") as file:
        file.write("\n".join(lines))


def write_npz(trace: Trace, path: Path) -> None:
    """Write all flights of a trace as NPZ, one array per field."""
    with path.open("wb") as file:
        arrays: dict[str, Any] = {f.name: np.ascontiguousarray(getattr(trace, f.name)) for f in fields(trace)}
        np.savez(file, **arrays)


def read_npz(path: Path) -> Trace:
    """Read a trace that `write_npz` wrote.

    Raises `TraceError` for a file that cannot be read, lacks an array, or whose arrays do not fit together.
    """
    try:
        with path.open("rb") as file, np.load(file) as arrays:
            kind = SensedTrace if "seen_position_m" in arrays else Trace
            trace = kind(**{field.name: arrays[field.name] for field in fields(kind)})
    except (OSError, ValueError, TypeError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise TraceError(f"{path}: is no trace: {error}; run its command again") from error
    steps = trace.status.shape
    if len(steps) != 2 or 0 in steps or trace.time_s.shape != steps[:1]:
        raise TraceError(f"{path}: is no trace: time_s {trace.time_s.shape} and status {steps} disagree")
    for name in (field.name for field in fields(trace) if field.name not in ("time_s", "status")):
        array, axes = getattr(trace, name), AXES[name.removeprefix("seen_")]
        if name == "target" and array.shape[-1:] == (SPATIAL_TARGET_COLUMNS,):
            axes = (SPATIAL_TARGET_COLUMNS,)
        if array.shape != (*steps, *axes) or array.dtype.kind not in "fi":
            raise TraceError(f"{path}: is no trace: {name} has the shape {array.shape}")
    if not (np.isfinite(trace.target).all() and np.isfinite(trace.time_s).all()):
        raise TraceError(f"{path}: is no trace: time and target must be finite")
    if not (np.diff(trace.time_s) > 0.0).all():
        raise TraceError(f"{path}: is no trace: time must rise")
    return trace
