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
from scipy.signal import lfilter

from mambo_sil.model.identify.dataflash import FOLLOWS_S
from mambo_sil.model.identify.signals import FlightLog, Signal
from mambo_sil.model.identify.ulog import TRAJECTORY

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
    push_m_s2: tuple[float, float] = (0.0, 0.0)
    """Steady push of a wind, north and east."""
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
    times_s = TICKS * TICK_S * np.arange(rows, dtype=np.float64)
    draws = random.normal(size=(rows, 8 + 2 * TICKS, n))
    yaw = flown.yaw_rad + flown.yaw_rate_rad_s * times_s
    sines, cosines = np.sin(yaw), np.cos(yaw)
    angles = 2.0 * np.pi * np.multiply.outer(times_s, SINES_HZ)[..., np.newaxis, np.newaxis] + phases
    waves = flown.sines_rad * np.sqrt(2.0 / len(SINES_HZ)) * np.sin(angles).sum(axis=1)
    seen_errors = _correlated(0.9, 0.44 * flown.estimate_noise * NOISE * draws[:, :4])
    slow = _correlated(0.967, flown.slow_rad * np.sqrt(1.0 - 0.967**2) * draws[:, 4:6])
    error = slow + flown.white_rad * draws[:, 6:8]
    gusts = flown.gusts_m_s2 * np.sqrt(TICK_S) * draws[:, 8:]
    eight = _eight(times_s, flown)
    tilt, position, velocity, gust = (np.zeros((2, n)) for _ in range(4))
    table = np.empty((rows, len(NAMES), n))
    table[:, 4] = yaw[:, np.newaxis]
    command, push = np.empty((2, n)), np.empty((2, n))
    pull_m_s2 = truth.acceleration_per_tilt * G
    wind = np.array(flown.push_m_s2)[:, np.newaxis]
    for row, (sine, cosine) in enumerate(zip(sines.tolist(), cosines.tolist(), strict=True)):
        target, speed, pull = eight[row]
        seen_p, seen_v = position + seen_errors[row, :2], velocity + seen_errors[row, 2:]
        wanted = 2.0 * (target - seen_p) + 1.8 * (speed - seen_v) + pull
        command[0], command[1] = cosine * wanted[1] - sine * wanted[0], -cosine * wanted[0] - sine * wanted[1]
        sent = np.minimum(np.maximum(command / G, -0.35), 0.35) + waves[row]
        logged = table[row]
        logged[:2], logged[2:4], logged[5:7], logged[7:] = sent, tilt + error[row], seen_p, seen_v
        for tick in range(TICKS):
            queue = [sent, *queue[:-1]]
            acting = np.stack([queue[late[0]][0], queue[late[1]][1]])
            tilt = keep * tilt + (1.0 - keep) * gain * acting
            gust = gust + gusts[row, 2 * tick : 2 * tick + 2] - 0.5 * TICK_S * gust
            right, back = pull_m_s2 * (tilt - trim)
            push[0], push[1] = -cosine * back - sine * right, cosine * right - sine * back
            velocity = velocity + TICK_S * (push - truth.drag_1_s * velocity + gust + wind)
            position = position + TICK_S * velocity
    return [
        {"time_s": times_s} | {name: table[:, place, flight] for place, name in enumerate(NAMES)}
        for flight in range(n)
    ]


@dataclass(frozen=True)
class Lifting:
    """A drone that is moved up and down, and how it is measured."""

    hover_command: float = 33550.0
    """Command that carries the weight at first."""
    lag_s: float = 0.07
    falling: float = 1.0
    """Lag of a falling thrust over that of a rising one."""
    of_speed: bool = False
    """Whether it is the rotor speed that lags, whose square is the thrust; else the thrust lags."""
    power: float = 1.0
    """Exponent of the thrust over its command; 1 if they are in proportion."""
    delay_s: float = 0.01
    drag_1_s: float = 0.4
    battery_sag_1_s: float = 0.0
    step_m: float = 0.25
    """Height of a step up or down; 0 is hover."""
    step_s: float = 1.5
    """Time between steps."""
    level_s: float = 0.0
    """Time of level flight before the steps, tilting by 0.1 rad."""
    duration_s: float = 20.0
    age_s: float = 0.0
    """Age of the measured height."""
    noise_m: float = 0.001
    gusts_m_s2: float = 0.03
    error_m_s: float = 0.0
    """Standard deviation of the error of the estimated climb, which lasts for 0.7 s and moves the height."""

    @property
    def gain(self) -> float:
        """Thrust over mass per unit of the command at hover, in the middle of what is fitted, from 2 s on."""
        middle_s = 0.5 * (2.0 + self.duration_s)
        fresh = 1.0 - self.battery_sag_1_s * middle_s
        return float(G / self.hover_command * fresh ** (1.0 / self.power))

    @property
    def late_s(self) -> float:
        """Lag, dead time and age together."""
        return 0.5 * self.lag_s * (1.0 + self.falling) + self.delay_s + self.age_s


def lift(truth: Lifting, seed: int = 1) -> dict[str, Array]:
    """Move a drone up and down by a PD controller on what is measured; return the columns of a log.

    The velocity is that of the measured heights behind a filter of 30 ms. The slower the drone, the lower are
    the gains.
    """
    random = default_rng(seed)
    tick_s, ticks = 0.002, 5
    row_s = ticks * tick_s
    rows = round(truth.duration_s / row_s)
    time_s = row_s * np.arange(rows, dtype=np.float64)
    frequency_rad_s = min(3.9, 0.42 / (truth.late_s + 0.03))
    rising, falling = (float(np.exp(-tick_s / (truth.lag_s * share))) for share in (1.0, truth.falling))
    queue = [1.0] * (round(truth.delay_s / tick_s) + 1)
    heights_m = [1.0] * (round(truth.age_s / tick_s) + 1)
    tilts_rad = np.where(time_s < truth.level_s, 0.1 * np.sin(1.2 * time_s), 0.0)
    steps = np.floor((time_s - truth.level_s) / truth.step_s) % 2
    targets_m = 1.0 + truth.step_m * np.where(time_s < truth.level_s, 0.0, steps)
    draws = random.normal(size=(rows, 1 + ticks))
    gusts = truth.gusts_m_s2 * np.sqrt(tick_s) * draws[:, 1:]
    height, climb, state, gust, seen_climb = 1.0, 0.0, 1.0, 0.0, 0.0
    noises_m = (truth.noise_m * draws[:, 0]).tolist()
    errors = _estimate_errors(truth.error_m_s, row_s, rows, seed)
    seen = height + noises_m[0]
    table = np.empty((rows, 2))
    inputs = zip(
        targets_m.tolist(), np.cos(tilts_rad).tolist(), noises_m, errors, gusts.tolist(), strict=True
    )
    for row, (target_m, level, noise_m, (error_m_s, error_m), pushes) in enumerate(inputs):
        before, seen = seen, heights_m[-1] + noise_m
        seen_climb += row_s / (row_s + 0.03) * ((seen - before) / row_s - seen_climb)
        off_m, climbs_m_s = target_m - seen - error_m, seen_climb + error_m_s
        wanted = frequency_rad_s * (frequency_rad_s * off_m - 1.8 * climbs_m_s)
        sent = min(max((1.0 + wanted / G) / level, 0.2), 1.8)
        table[row] = truth.hover_command * sent, seen + error_m
        for tick, push in enumerate(pushes):
            queue = [sent**truth.power, *queue[:-1]]
            target = queue[-1] ** 0.5 if truth.of_speed else queue[-1]
            keep = rising if target > state else falling
            state = keep * state + (1.0 - keep) * target
            thrust = state * state if truth.of_speed else state
            fresh = 1.0 - truth.battery_sag_1_s * tick_s * (ticks * row + tick)
            gust += push - 0.5 * tick_s * gust
            climb += tick_s * (G * (fresh * thrust * level - 1.0) + gust - truth.drag_1_s * climb)
            height += tick_s * climb
            heights_m = [height, *heights_m[:-1]]
    flat = dict.fromkeys(NAMES[:4], np.zeros(rows)) | {"roll_rad": tilts_rad}
    return {"time_s": time_s} | flat | {"thrust_command": table[:, 0], "z_m": -table[:, 1]}


def _estimate_errors(error_m_s: float, row_s: float, rows: int, seed: int) -> list[tuple[float, float]]:
    """Return the errors of climb and height in each row, as an autopilot's estimator makes them."""
    keep = float(np.exp(-row_s / 0.7))
    draws = error_m_s * np.sqrt(1.0 - keep * keep) * default_rng([seed, 1]).normal(size=(rows, 1, 1))
    climbs = _correlated(keep, draws)
    heights = _correlated(keep, row_s * climbs)
    return list(zip(climbs[:, 0, 0].tolist(), heights[:, 0, 0].tolist(), strict=True))


def draw_lifting(random: Generator) -> Lifting:
    """Draw a drone, with or without each of the ways in which it may depart from a thrust that lags."""
    often = random.uniform(size=5) < (0.4, 0.4, 0.3, 0.4, 0.3)
    return Lifting(
        hover_command=float(np.exp(random.uniform(np.log(0.3), np.log(4e4)))),
        lag_s=float(np.exp(random.uniform(np.log(0.03), np.log(0.18)))),
        falling=float(random.uniform(0.6, 1.4)) if often[0] else 1.0,
        of_speed=bool(often[1]),
        power=float(random.uniform(0.7, 1.6)) if often[2] else 1.0,
        delay_s=float(random.uniform(0.0, 0.03)),
        drag_1_s=float(random.uniform(0.0, 0.8)),
        battery_sag_1_s=float(random.uniform(0.0, 0.001)),
        step_s=float(random.uniform(1.2, 2.5)),
        level_s=20.0 if often[3] else 0.0,
        duration_s=40.0 if often[3] else 20.0,
        age_s=float(random.uniform(0.0, 0.04)),
        noise_m=float(np.exp(random.uniform(np.log(0.0005), np.log(0.004)))),
        gusts_m_s2=float(random.uniform(0.0, 0.06)),
    )


def _eight(times_s: Array, flown: Flown) -> Array:
    """Return position, velocity and acceleration (k, 3, 2, 1) on the figure of eight."""
    a, b, w = flown.size_m, flown.height * flown.size_m, flown.rate_rad_s
    s, c = np.sin(w * times_s), np.cos(w * times_s)
    s2, c2 = np.sin(2.0 * w * times_s), np.cos(2.0 * w * times_s)
    rows = ((a * s, b * s2), (a * w * c, 2.0 * b * w * c2), (-a * w * w * s, -4.0 * b * w * w * s2))
    return np.moveaxis(np.array(rows), -1, 0)[..., np.newaxis]


def _correlated(keep: float, noise: Array) -> Array:
    """Return noise (k, m, n) through x' = keep x + noise, from 0."""
    found: Array = lfilter([1.0], [1.0, -keep], noise, axis=0)
    return found


def filter_velocity(columns: Mapping[str, Array], lag_s: float) -> dict[str, Array]:
    """Return a log whose velocity went through a low-pass."""
    keep = np.exp(-TICKS * TICK_S / lag_s)
    return {
        name: lfilter([1.0 - keep], [1.0, -keep], values, zi=[keep * values[0]])[0]
        if name in ("vx_m_s", "vy_m_s")
        else values
        for name, values in columns.items()
    }


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


def ulog(
    columns: Mapping[str, Array], *, quaternion: bool, target: Sequence[str] = (), hover: float | None = None
) -> bytes:
    """Return a log in PX4's format ULog; `quaternion` is for a set-point without roll_body and pitch_body.

    Where the columns have a seen position, the camera measured it, in the axes of the estimate; a commanded
    heading is that of the set-point.

    `target` names the columns of position, velocity and acceleration of the target, as far as it has them;
    `hover` is the estimated share of the thrust in hover, where the columns have a thrust.
    """
    setpoint = "float[4] q_d" if quaternion else "float roll_body;float pitch_body"
    thrust = [np.zeros_like(columns["time_s"])] * 2 + [-columns.get("thrust_command", columns["time_s"])]
    setpoint += ";float[3] thrust_body" if "thrust_command" in columns else ""
    formats = {
        "vehicle_attitude_setpoint": f"uint64_t timestamp;{setpoint};",
        "vehicle_attitude": "uint64_t timestamp;float[4] q;",
        "vehicle_local_position": "uint64_t timestamp;float x;float y;float z;float vx;float vy;",
    }
    roll, pitch, yaw = (columns[f"{name}_rad"] for name in ("roll", "pitch", "yaw"))
    roll_command, pitch_command = columns["roll_command_rad"], columns["pitch_command_rad"]
    motion = [columns[name] for name in ("x_m", "y_m")] + [columns.get("z_m", 0.0 * roll - 1.0)]
    motion += [columns[name] for name in ("vx_m_s", "vy_m_s")]
    topics = [
        (
            _quaternion(roll_command, pitch_command, columns.get("yaw_command_rad", yaw))
            if quaternion
            else [roll_command, pitch_command]
        )
        + (thrust if "thrust_command" in columns else []),
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

    if "seen_x_m" in columns:
        formats["vehicle_visual_odometry"] = "uint64_t timestamp;float[2] position;float pose_frame;"
        topics.append([columns["seen_x_m"], columns["seen_y_m"], np.ones_like(roll)])
    if hover is not None:
        formats["hover_thrust_estimate"] = "uint64_t timestamp;float hover_thrust;float valid;"
        topics.append([np.full_like(roll, hover), np.ones_like(roll)])

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


def heading_later_rad(columns: Mapping[str, Array]) -> Array:
    """Return the heading that a drone has when it follows the command of each row."""
    time_s = columns["time_s"]
    return columns["yaw_rad"][np.searchsorted(time_s, time_s + FOLLOWS_S + 1e-6, side="right") - 1]


def dataflash(
    columns: Mapping[str, Array],
    *,
    every: int = 1,
    angles: str = "ANG",
    guided: bool = True,
) -> bytes:
    """Return a log in ArduPilot's format DataFlash: set-points if guided, angles, motion.

    The angles come in every n-th row, beside a rare ATT; their DesRoll and DesPitch follow the drone. The
    motion is that of two estimators. A row a second before the set-points is of something else. A commanded
    heading is that of the set-point, by default the one at which the drone follows it.
    """
    des, labels = "Qfffff", "TimeUS,DesRoll,Roll,DesPitch,Pitch,Yaw"
    kinds = {
        129: (angles, des, labels),
        130: ("XKF1", "QBfffff", "TimeUS,C,VN,VE,PN,PE,PD"),
        132: ("GUIA", "QBffff", "TimeUS,Type,Roll,Pitch,Yaw,Thrust"),
        133: ("ATT" if angles != "ATT" else "OLD", des, labels),
    }
    layouts = {number: "<" + form for number, (_, form, _) in kinds.items()}

    def message(number: int, *values: float) -> bytes:
        return b"\xa3\x95" + bytes([number]) + struct.pack(layouts[number], *values)

    parts = []
    for number, (name, form, fields) in kinds.items():
        size = 3 + struct.calcsize(layouts[number])
        head = struct.pack("<BB4s16s64s", number, size, name.encode(), form.encode(), fields.encode())
        parts.append(b"\xa3\x95\x80" + head)
    names = ("roll_command_rad", "pitch_command_rad", "roll_rad", "pitch_rad", "yaw_rad")
    to_roll, to_pitch, roll, pitch, yaw = (np.degrees(columns[name]) for name in names)
    to_yaw = np.degrees(columns.get("yaw_command_rad", heading_later_rad(columns)))
    level = np.zeros_like(columns["time_s"])
    motion = [columns.get(name, level) for name in ("vx_m_s", "vy_m_s", "x_m", "y_m", "z_m")]
    throttle = columns.get("thrust_command", level + 0.4)
    parts.append(message(129, 9 * 10**6, 1.0, 2.0, 3.0, 4.0, 5.0))
    parts.append(message(130, 9 * 10**6, 0, 1.0, 2.0, 3.0, 4.0, 5.0))
    for row, time_s in enumerate(columns["time_s"].tolist()):
        stamp = round(1e6 * time_s) + 10**7
        if guided:
            parts.append(message(132, stamp, 6, to_roll[row], to_pitch[row], to_yaw[row], throttle[row]))
        attitude = roll[row], roll[row], pitch[row], pitch[row], yaw[row] % 360.0
        if row % every == 0:
            parts.append(message(129, stamp, *attitude))
        if row % 10 == 0:
            parts.append(message(133, stamp, *attitude))
        parts.append(message(130, stamp, 0, *(each[row] for each in motion)))
        parts.append(message(130, stamp, 1, *(each[row] + 9.0 for each in motion)))
    return b"".join(parts)
