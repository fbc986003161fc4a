"""Flight logs with a known truth: a drone with gain, lag and dead time, flown in closed loop with noise.

The commands come from a PD controller that tracks a figure of eight through noisy estimates, with a sum of
sines on top. All arrays are (k,) or (k, n) for n flights at once.
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.random import Generator, default_rng
from numpy.typing import NDArray

from mambo_nmpc.sil.identify.signals import FlightLog, Signal
from mambo_nmpc.sil.identify.ulog import TRAJECTORY

Array = NDArray[np.float64]

G: Final = 9.81
NAMES: Final = (
    *("roll_command_rad", "pitch_command_rad", "roll_rad", "pitch_rad", "yaw_rad"),
    *("x_m", "y_m", "vx_m_s", "vy_m_s"),
)
"""Columns of a log after its time."""

TICK_S: Final = 0.005
TICKS: Final = 2
"""Ticks of the drone for each update of the controller, which is a row of the log."""
NOISE: Final = np.array([[0.004], [0.004], [0.02], [0.02]])
"""Standard deviation of the estimated position in m and velocity in m/s, correlated over 0.1 s."""
SINES_HZ: Final = (0.5, 0.9, 1.6, 2.6, 3.7, 5.1)


@dataclass(frozen=True)
class Truth:
    """The drone; pairs are roll, pitch."""

    gain: tuple[float, float] = (0.83, 0.81)
    lag_s: tuple[float, float] = (0.05, 0.045)
    delay_s: tuple[float, float] = (0.09, 0.09)
    acceleration_per_tilt: float = 0.88
    drag_1_s: float = 0.15
    trim_rad: tuple[float, float] = (0.01, -0.006)


@dataclass(frozen=True)
class Flown:
    """How it is flown and measured."""

    duration_s: float = 30.0
    size_m: float = 0.8
    """Half-width of the figure of eight; 0 is hover."""
    height: float = 0.35
    """Its height over its width."""
    rate_rad_s: float = 1.2
    sines_rad: float = 0.0175
    """Rms of the sum of sines on each command."""
    yaw_rad: float = 0.0
    yaw_rate_rad_s: float = 0.0
    white_rad: float = 0.0017
    """White noise of the measured tilt."""
    slow_rad: float = 0.007
    """Noise of the measured tilt with a correlation time of 0.3 s."""
    gusts_m_s2: float = 0.08
    estimate_noise: float = 1.0
    """Factor on the noise of estimated position and velocity."""


def fly(truth: Truth, flown: Flown, seeds: int, seed: int = 1) -> list[dict[str, Array]]:
    """Fly `seeds` flights; return the columns of each by the names of the documented CSV."""
    random = default_rng(seed)
    n, rows = seeds, round((flown.duration_s) / (TICK_S * TICKS))
    keep = np.exp(-TICK_S / np.array(truth.lag_s))[:, np.newaxis]
    gain = np.array(truth.gain)[:, np.newaxis]
    trim = np.array(truth.trim_rad)[:, np.newaxis]
    late = [round(delay / TICK_S) for delay in truth.delay_s]
    queue = [np.zeros((2, n)) for _ in range(max(late) + 1)]
    phases = random.uniform(0.0, 2.0 * np.pi, (len(SINES_HZ), 2, n))
    tilt, position, velocity, gust = (np.zeros((2, n)) for _ in range(4))
    seen_error, slow = np.zeros((4, n)), np.zeros((2, n))
    logged: list[Array] = []
    for row in range(rows):
        time_s = row * TICKS * TICK_S
        yaw = flown.yaw_rad + flown.yaw_rate_rad_s * time_s
        sine, cosine = np.sin(yaw), np.cos(yaw)
        seen_error = 0.9 * seen_error + 0.44 * random.normal(size=(4, n)) * flown.estimate_noise * NOISE
        target, speed, pull = _eight(time_s, flown)
        wanted = 2.0 * (target - position - seen_error[:2]) + 1.8 * (speed - velocity - seen_error[2:]) + pull
        ahead, right = cosine * wanted[0] + sine * wanted[1], cosine * wanted[1] - sine * wanted[0]
        command = np.clip(np.stack([right, -ahead]) / G, -0.35, 0.35)
        waves = [
            np.sin(2.0 * np.pi * hz * time_s + phase) for hz, phase in zip(SINES_HZ, phases, strict=True)
        ]
        command = command + flown.sines_rad * np.sqrt(2.0 / len(SINES_HZ)) * np.sum(waves, axis=0)
        slow = 0.967 * slow + flown.slow_rad * np.sqrt(1.0 - 0.967**2) * random.normal(size=(2, n))
        measured = tilt + slow + flown.white_rad * random.normal(size=(2, n))
        seen_v = velocity + seen_error[2:]
        seen_p = position + seen_error[:2]
        logged.append(np.stack([*command, *measured, np.full(n, yaw), *seen_p, *seen_v]))
        for _ in range(TICKS):
            queue = [command, *queue[:-1]]
            acting = np.stack([queue[late[0]][0], queue[late[1]][1]])
            tilt = keep * tilt + (1.0 - keep) * gain * acting
            gust = (
                gust + flown.gusts_m_s2 * np.sqrt(TICK_S) * random.normal(size=(2, n)) - 0.5 * TICK_S * gust
            )
            a_right, a_ahead = truth.acceleration_per_tilt * G * (tilt - trim) * [[1.0], [-1.0]]
            push = np.stack([cosine * a_ahead - sine * a_right, sine * a_ahead + cosine * a_right])
            velocity = velocity + TICK_S * (push - truth.drag_1_s * velocity + gust)
            position = position + TICK_S * velocity
    table = np.stack(logged)
    time: Array = TICKS * TICK_S * np.arange(rows, dtype=np.float64)
    return [
        {"time_s": time} | {name: table[:, place, flight] for place, name in enumerate(NAMES)}
        for flight in range(n)
    ]


def _eight(time_s: float, flown: Flown) -> tuple[Array, Array, Array]:
    """Return position, velocity and acceleration (2, 1) on the figure of eight."""
    a, b, w = flown.size_m, flown.height * flown.size_m, flown.rate_rad_s
    s, c, s2, c2 = np.sin(w * time_s), np.cos(w * time_s), np.sin(2.0 * w * time_s), np.cos(2.0 * w * time_s)
    rows = ((a * s, b * s2), (a * w * c, 2.0 * b * w * c2), (-a * w * w * s, -4.0 * b * w * w * s2))
    found = [np.array(row)[:, np.newaxis] for row in rows]
    return found[0], found[1], found[2]


def drop_and_jitter(columns: Mapping[str, Array], random: Generator) -> dict[str, Array]:
    """Return a log without 10 % of its rows, with times wrong by 3 ms (rms) and another zero of time."""
    time = columns["time_s"]
    kept = random.uniform(size=len(time)) > 0.1
    late = np.sort(time + 0.003 * random.normal(size=len(time)) + 98765.0)
    return {name: (late if name == "time_s" else values)[kept] for name, values in columns.items()}


def log_of(columns: Mapping[str, Array], name: str = "made.csv") -> FlightLog:
    """Return columns as a log."""
    time = columns["time_s"]
    signals = {key: Signal(time, values, key) for key, values in columns.items() if key != "time_s"}
    return FlightLog(name, signals)


def write_log(columns: Mapping[str, Array], path: Path) -> Path:
    """Write columns as CSV."""
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, "%.9g", ",", header=",".join(columns), comments="")
    return path


def crazyflie_columns(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return a log as the Crazyflie's client writes it: ms, degrees, y and z up, yaw to the left."""
    degrees = 180.0 / np.pi
    names = {
        "roll_command_rad": ("controller.roll", degrees),
        "pitch_command_rad": ("controller.pitch", degrees),
        "roll_rad": ("stateEstimate.roll", degrees),
        "pitch_rad": ("stateEstimate.pitch", degrees),
        "yaw_rad": ("stateEstimate.yaw", -degrees),
        "x_m": ("stateEstimate.x", 1.0),
        "y_m": ("stateEstimate.y", -1.0),
        "vx_m_s": ("stateEstimate.vx", 1.0),
        "vy_m_s": ("stateEstimate.vy", -1.0),
    }
    found = {"Timestamp": np.round(1e3 * columns["time_s"]) + 4711.0}
    return found | {name: factor * columns[key] for key, (name, factor) in names.items()}


def ulog(columns: Mapping[str, Array], *, quaternion: bool, target: Sequence[str] = ()) -> bytes:
    """Return a log in PX4's format ULog; `quaternion` is for a set-point without roll_body and pitch_body.

    `target` names the columns of position, velocity and acceleration of the target, as far as it has them.
    """
    setpoint = "float[4] q_d" if quaternion else "float roll_body;float pitch_body"
    formats = {
        "vehicle_attitude_setpoint": f"uint64_t timestamp;{setpoint};",
        "vehicle_attitude": "uint64_t timestamp;float[4] q;",
        "vehicle_local_position": "uint64_t timestamp;float x;float y;float z;float vx;float vy;",
    }
    roll, pitch, yaw = (columns[f"{name}_rad"] for name in ("roll", "pitch", "yaw"))
    commands = [columns["roll_command_rad"], columns["pitch_command_rad"]]
    motion = [columns[name] for name in ("x_m", "y_m")] + [0.0 * roll - 1.0]
    motion += [columns[name] for name in ("vx_m_s", "vy_m_s")]
    topics = [
        _quaternion(commands[0], commands[1], yaw) if quaternion else commands,
        _quaternion(roll, pitch, yaw),
        motion,
    ]
    if target:
        formats[TRAJECTORY] = "uint64_t timestamp;float[3] position;float[3] velocity;float[3] acceleration;"
        nothing = np.full_like(roll, np.nan)
        given = [columns[name] for name in target] + [nothing] * (6 - len(target))
        topics.append(
            [each for x, y in zip(given[::2], given[1::2], strict=True) for each in (x, y, nothing)]
        )

    def message(kind: bytes, content: bytes) -> bytes:
        return struct.pack("<Hc", len(content), kind) + content

    parts = [b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 0)]
    parts += [message(b"F", f"{name}:{fields}".encode()) for name, fields in formats.items()]
    parts += [message(b"A", struct.pack("<BH", 0, n) + name.encode()) for n, name in enumerate(formats)]
    for row, time_s in enumerate(columns["time_s"].tolist()):
        for number, values in enumerate(topics):
            numbers = [float(value[row]) for value in values]
            data = struct.pack(f"<HQ{len(numbers)}f", number, round(1e6 * time_s) + 10**7, *numbers)
            parts.append(message(b"D", data))
    return b"".join(parts)


def _quaternion(roll: Array, pitch: Array, yaw: Array) -> list[Array]:
    """Return w, x, y, z of 3-2-1 Euler angles."""
    (cr, cp, cy), (sr, sp, sy) = (
        [function(0.5 * angle) for angle in (roll, pitch, yaw)] for function in (np.cos, np.sin)
    )
    return [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]
