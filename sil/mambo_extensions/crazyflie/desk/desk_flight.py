"""One flight of a generated app on the desk, driven as a pilot and a radio drive a Crazyflie.

Frames are the firmware's: x forward, y left, z up; roll right side down, pitch nose up, yaw to the left.
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any, Final

import numpy as np

from mambo_extensions.crazyflie.desk.desk_library import interface, load_copy
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import FlightError

Three = tuple[float, float, float]

MEMORY_PIECES: Final = 31
"""Pieces in the memory of the high-level commander."""


class DeskSensors(IntEnum):
    """What measures the position: motion capture, the flow deck, or sweeps of two Lighthouse stations."""

    MOCAP = 0
    FLOW_DECK = 1
    LIGHTHOUSE = 2


@dataclass(frozen=True)
class DeskConditions:
    """The drone, what measures, and the clocks of a flight; the members of `desk_flight_t`.

    The default is a Crazyflie of 30 g, in still air, seen by cameras 100 times a second, 10 ms late, with a
    millimetre of noise.
    """

    seed: int = 0
    mass_kg: float = 0.03
    rotor_lag_s: float = 0.072
    drag_1_s: float = 0.244
    wind_m_s: tuple[float, float] = (0.0, 0.0)
    thrust_gain: float = 1.0
    motor_gains: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    sag_1_s: float = 0.0
    centre_m: tuple[float, float] = (0.0, 0.0)
    heading_rad: float = 0.0
    table_m: float = 0.0
    table_radius_m: float = 0.0
    gyroscope_bias_rad_s: Three = (0.0, 0.0, 0.0)
    accelerometer_bias_g: Three = (0.0, 0.0, 0.0)
    sensors: DeskSensors = DeskSensors.MOCAP
    camera_period_ms: int = 10
    camera_delay_ms: int = 10
    camera_offset_ms: int = 0
    camera_noise_m: float = 0.001
    camera_outliers: float = 0.0
    camera_outlier_m: float = 0.0
    flow_noise_counts: float = 2.0
    sweep_reflections: float = 0.0
    initial_yaw_rad: float = 0.0
    lost_ticks: float = 0.0


@dataclass(frozen=True)
class DeskState:
    """The true state: position in m, velocity in m/s, angles in rad, motors as shares of the most.

    touch_m_s: the fastest descent at which the drone has met the floor, 0 if it never did.
    """

    position_m: FloatArray
    velocity_m_s: FloatArray
    angles_rad: FloatArray
    motors: FloatArray
    touch_m_s: float


class Desk:
    """A drone on the floor with an app that has started."""

    def __init__(self, library: Path, conditions: DeskConditions) -> None:
        """Start the app of a library; raises FlightError if its self-test fails, and CacheError."""
        self._ffi = interface()
        self._c: Any = load_copy(library)
        flight = self._ffi.new("desk_flight_t *")
        for name, value in vars(conditions).items():
            setattr(flight, name, list(value) if isinstance(value, tuple) else value)
        self._state = self._ffi.new("desk_state_t *")
        if not self._c.desk_start(flight):
            raise FlightError(f"the app's self-test fails on this machine: {self.console.strip()}")

    def run(self, milliseconds: int) -> None:
        """Let time pass."""
        self._c.desk_run(milliseconds)

    @property
    def state(self) -> DeskState:
        """The true state."""
        self._c.desk_state(self._state)
        of = self._state
        parts = (of.position_m, of.velocity_m_s, of.angles_rad, of.motors)
        position, velocity, angles, motors = (np.array(list(part)) for part in parts)
        return DeskState(position, velocity, angles, motors, float(of.touch_m_s))

    @property
    def console(self) -> str:
        """What was printed."""
        printed: bytes = self._ffi.string(self._c.desk_console())
        return printed.decode()

    @property
    def group(self) -> str:
        """The group of the app's log variables and parameters: `code.prefix` of its settings."""
        name: bytes = self._ffi.string(self._c.desk_group())
        return name.decode()

    def log(self, name: str) -> float:
        """Return a log variable as `group.name`; NaN if there is none."""
        return float(self._c.desk_log(name.encode()))

    def set(self, name: str, value: float) -> None:
        """Set a parameter as `group.name`; raises FlightError if there is none."""
        if not self._c.desk_set(name.encode(), value):
            raise FlightError(f"{name} is not a parameter of this app")

    def full_state(self, motion: FloatArray, yaw_rad: float = 0.0) -> None:
        """Send position, velocity and acceleration, (3, 3), rounded to millimetres as cflib does."""
        sent = (self._vector(_millimetres(part)) for part in motion)
        self._c.desk_full_state(*sent, yaw_rad)

    def stop(self) -> None:
        """Send the set-point that stops the motors."""
        self._c.desk_stop()

    def yield_(self) -> None:
        """Say that no set-points follow: the high-level commander flies."""
        self._c.desk_yield()

    def take_off(self, height_m: float, duration_s: float, yaw_rad: float = 0.0) -> None:
        """Take off by a plan."""
        self._c.desk_take_off(height_m, yaw_rad, duration_s)

    def land(self, duration_s: float, height_m: float = 0.0, yaw_rad: float = 0.0) -> None:
        """Land by a plan, at whose end the motors stop."""
        self._c.desk_land(height_m, yaw_rad, duration_s)

    def go_to(self, position_m: Three, duration_s: float, yaw_rad: float = 0.0) -> None:
        """Fly to a place by a plan."""
        self._c.desk_go_to(self._vector(position_m), yaw_rad, duration_s)

    def write_pieces(self, pieces: FloatArray, first: int = 0) -> None:
        """Write pieces of a trajectory (n, 33), 8 coefficients of x, y, z and yaw and the duration.

        Raises FlightError for more than the memory holds.
        """
        if not 0 <= first <= first + len(pieces) <= MEMORY_PIECES:
            raise FlightError(
                f"pieces {first + 1} to {first + len(pieces)}: the memory holds {MEMORY_PIECES}"
            )
        written = self._ffi.new("double[]", [float(value) for value in pieces.reshape(-1)])
        self._c.desk_write_pieces(first, written, len(pieces))

    def start_trajectory(self, count: int) -> None:
        """Fly the first pieces in memory."""
        self._c.desk_start_trajectory(count)

    def measure(self, *, on: bool) -> None:
        """Let the camera, the flow deck or the base stations measure, or not."""
        self._c.desk_measure(on)

    def switch(self, sensors: DeskSensors) -> None:
        """Let others measure from now on."""
        self._c.desk_switch(sensors)

    def jump(self, jump_m: Three, frames: int) -> None:
        """Let the camera's next frames be off by a jump, which may be NaN."""
        self._c.desk_jump(self._vector(jump_m), frames)

    def kick(self, velocity_m_s: Three) -> None:
        """Change the velocity at once."""
        self._c.desk_kick(self._vector(velocity_m_s))

    def hit(self, rates_rad_s: Three) -> None:
        """Change the rates about the body's axes at once."""
        self._c.desk_hit(self._vector(rates_rad_s))

    def push(self, force_n: Three, duration_s: float) -> None:
        """Push the drone for a time."""
        self._c.desk_push(self._vector(force_n), round(1000.0 * duration_s))

    def _vector(self, values: Any) -> Any:
        return self._ffi.new("double[3]", [float(value) for value in values])


def _millimetres(values: FloatArray) -> list[float]:
    """Round numbers towards zero to thousandths within 16 bits; NaN stays."""
    return [v if math.isnan(v) else int(min(max(1000.0 * v, -32767.0), 32767.0)) / 1000.0 for v in values]
