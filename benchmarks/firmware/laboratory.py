"""A flight of the firmware on the desk, driven by packets as cflib sends them."""

import struct
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import Any

import cffi
import numpy as np

from benchmarks.firmware.build import HERE
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M

_INTERFACE: Any = cffi.FFI()
_INTERFACE.cdef(
    "".join(
        line
        for line in (HERE / "desk/laboratory.h").read_text("utf-8").splitlines(keepends=True)
        if not line.startswith("#")
    )
)

_GENERIC, _HIGH_LEVEL = 7, 8
"""Ports of set-points and of the high-level commander."""


class ControllerNumber(IntEnum):
    """Values of the parameter stabilizer.controller."""

    PID = 1
    MELLINGER = 2
    INDI = 3
    BRESCIANINI = 4
    LEE = 5
    APP = 6


@dataclass(frozen=True)
class LaboratoryConditions:
    """Drone, camera and clocks of a flight.

    camera_offset_ms: of the camera's clock against the estimator's.
    app_offset_ms:    of the app's clock against the estimator's.
    lost_ticks:       share of the stabilizer's ticks that are lost.
    """

    seed: int = 0
    mass_kg: float = 0.03
    rotor_lag_s: float = 0.072
    drag_1_s: float = 0.244
    wind_m_s: tuple[float, float] = (0.0, 0.0)
    camera_period_ms: int = 10
    camera_delay_ms: int = 10
    camera_noise_m: float = 0.001
    camera_sees_attitude: bool = False
    camera_offset_ms: int = 0
    app_offset_ms: int = 0
    lost_ticks: float = 0.0
    parameters: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Place:
    """Where a flight begins, in the firmware's frame."""

    x_m: float = 0.0
    y_m: float = 0.0
    heading_rad: float = 0.0


class Laboratory:
    """The firmware, started on the floor. It can be started once in a process."""

    def __init__(
        self, library: Path, controller: ControllerNumber, conditions: LaboratoryConditions, place: Place
    ) -> None:
        self._library: Any = _INTERFACE.dlopen(str(library))
        self._state = np.zeros(13)
        flight: Any = _INTERFACE.new("laboratory_flight_t *")
        flight.seed = conditions.seed
        flight.controller = int(controller)
        for name in ("mass_kg", "rotor_lag_s", "drag_1_s", "camera_period_ms", "camera_offset_ms"):
            setattr(flight, name, getattr(conditions, name))
        for name in ("camera_delay_ms", "camera_noise_m", "camera_sees_attitude", "lost_ticks"):
            setattr(flight, name, getattr(conditions, name))
        flight.wind_m_s = list(conditions.wind_m_s)
        flight.place_m = [place.x_m, place.y_m]
        flight.heading_rad = place.heading_rad
        self.time_ms = 0
        self.is_good = bool(self._library.laboratory_start(flight))
        for parameter, value in conditions.parameters.items():
            self.set(parameter, value)

    def run(self, milliseconds: int) -> None:
        """Let time pass."""
        self._library.laboratory_run(milliseconds)
        self.time_ms += milliseconds

    @property
    def state(self) -> FloatArray:
        """True position, velocity, roll, pitch (nose up), yaw, and thrusts of the motors as shares, (13,)."""
        self._library.laboratory_state(_INTERFACE.from_buffer("double[13]", self._state))
        return self._state.copy()

    @property
    def console(self) -> str:
        """What the firmware has printed."""
        printed: bytes = _INTERFACE.string(self._library.laboratory_console())
        return printed.decode()

    def log(self, name: str) -> float:
        """Return a log variable as `group.name`; NaN if there is none."""
        return float(self._library.laboratory_log(name.encode()))

    def set(self, name: str, value: float) -> None:
        """Set a parameter as `group.name`; raises KeyError if there is none."""
        if not self._library.laboratory_set(name.encode(), value):
            raise KeyError(name)

    def switch_camera(self, *, on: bool) -> None:
        """Let measurements of the position come, or not."""
        self._library.laboratory_switch_camera(on)

    def _send(self, port: int, content: bytes, channel: int = 0) -> None:
        self._library.laboratory_send(port, channel, content, len(content))

    # Set-points

    def full_state(
        self,
        position_m: FloatArray,
        velocity_m_s: FloatArray,
        acceleration_m_s2: FloatArray,
        yaw_rad: float = 0.0,
    ) -> None:
        """Send position, velocity and acceleration (3,), rounded to millimetres as cflib does."""
        numbers = np.concatenate([position_m, velocity_m_s, acceleration_m_s2])
        millimetres = np.clip(1000.0 * numbers, -32767, 32767).astype(int)
        self._send(_GENERIC, struct.pack("<B9hI3h", 6, *millimetres, _compressed_heading(yaw_rad), 0, 0, 0))

    def position(self, x_m: float, y_m: float, z_m: float, yaw_deg: float = 0.0) -> None:
        """Send a position."""
        self._send(_GENERIC, struct.pack("<B4f", 7, x_m, y_m, z_m, yaw_deg))

    def hover(self, vx_m_s: float, vy_m_s: float, z_m: float) -> None:
        """Send velocities in the body's frame, and a height."""
        self._send(_GENERIC, struct.pack("<B4f", 10, vx_m_s, vy_m_s, 0.0, z_m))

    def stop_set_points(self) -> None:
        """Say that no set-points follow: the high-level commander flies."""
        self._send(_GENERIC, struct.pack("<BI", 0, 0), channel=1)

    # High-level commander

    def take_off(
        self, height_m: float = HOVER_HEIGHT_M, duration_s: float = 2.0, yaw_rad: float = 0.0
    ) -> None:
        """Take off."""
        self._send(_HIGH_LEVEL, struct.pack("<BBff?f", 7, 0, height_m, yaw_rad, False, duration_s))

    def land(self, duration_s: float = 2.0, yaw_rad: float = 0.0) -> None:
        """Land."""
        self._send(_HIGH_LEVEL, struct.pack("<BBff?f", 8, 0, 0.0, yaw_rad, False, duration_s))

    def go_to(self, position_m: tuple[float, float, float], duration_s: float, yaw_rad: float = 0.0) -> None:
        """Fly to a place in a time."""
        self._send(_HIGH_LEVEL, struct.pack("<BBBB5f", 12, 0, 0, 0, *position_m, yaw_rad, duration_s))


def _compressed_heading(yaw_rad: float) -> int:
    """Return the quaternion of a heading in 32 bits: index of the largest part, then the others."""
    quaternion = [0.0, 0.0, float(np.sin(0.5 * yaw_rad)), float(np.cos(0.5 * yaw_rad))]
    largest = max(range(4), key=lambda k: abs(quaternion[k]))
    word = largest
    for k, part in enumerate(quaternion):
        if k != largest:
            is_negative = (part < 0.0) != (quaternion[largest] < 0.0)
            word = (word << 10) | (is_negative << 9) | round(511.0 * abs(part) * 2.0**0.5)
    return word
