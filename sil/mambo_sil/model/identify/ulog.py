"""Read a flight log of PX4 in the format ULog, with the optional package pyulog."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.errors import echo
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import LogError
from mambo_sil.model.identify.csv_log import LONGEST_PERIOD_S, demand_one_clock, reading
from mambo_sil.model.identify.signals import (
    GROUNDED,
    HEIGHT,
    LEVELLED,
    PARAMETER,
    SEEN,
    SHIFT,
    START_THRUST,
    START_TILTS,
    TAKE_OVERS,
    THRUST,
    THRUST_COMMAND,
    UPDATE,
    FlightLog,
    Signal,
    stamped,
    tilts_at_heading,
)

SETPOINT, ATTITUDE, MOTION = "vehicle_attitude_setpoint", "vehicle_attitude", "vehicle_local_position"
TRAJECTORY: Final = "trajectory_setpoint"
_MOTION: Final = {"x_m": "x", "y_m": "y", "z_m": "z", "vx_m_s": "vx", "vy_m_s": "vy"}
_TARGET: Final[dict[str, tuple[str, ...]]] = {
    "target_x_m": ("position[0]", "x"),
    "target_y_m": ("position[1]", "y"),
    "target_vx_m_s": ("velocity[0]", "vx"),
    "target_vy_m_s": ("velocity[1]", "vy"),
    "target_ax_m_s2": ("acceleration[0]",),
    "target_ay_m_s2": ("acceleration[1]",),
}
"""Fields of the target, since PX4 1.14 and before; NaN where PX4 was not given the quantity."""
VISION: Final = "vehicle_visual_odometry"
_NED: Final = 1
"""Its pose frame with the axes of the estimate."""
_ANGLES: Final = ("roll", "pitch", "yaw")
_THRUST: Final = "thrust_body[2]"
"""Commanded thrust along z of the body, which points down."""
_CLOCK: Final = "timestamp"
HOVER: Final = "hover_thrust_estimate"
STEPS: Final = "mc_nmpc_status"
"""What the module of `generate --for px4` logs of each step; its heights are up."""
_STEPS: Final[dict[str, tuple[str, float]]] = {
    "x_m": ("position[0]", 1.0),
    "y_m": ("position[1]", 1.0),
    "vx_m_s": ("velocity[0]", 1.0),
    "vy_m_s": ("velocity[1]", 1.0),
    "roll_rad": ("roll", 1.0),
    "pitch_rad": ("pitch", 1.0),
    "yaw_rad": ("yaw", 1.0),
    HEIGHT: ("height", -1.0),
    "vz_m_s": ("climb", -1.0),
    GROUNDED: ("grounded", 1.0),
    "target_x_m": ("target_position[0]", 1.0),
    "target_y_m": ("target_position[1]", 1.0),
    "target_vx_m_s": ("target_velocity[0]", 1.0),
    "target_vy_m_s": ("target_velocity[1]", 1.0),
    "target_ax_m_s2": ("target_acceleration[0]", 1.0),
    "target_ay_m_s2": ("target_acceleration[1]", 1.0),
    "target_height_m": ("target_height", 1.0),
    "target_climb_m_s": ("target_climb", 1.0),
    "target_climb_acceleration_m_s2": ("target_climb_acceleration", 1.0),
    "roll_command_rad": ("command_roll", 1.0),
    "pitch_command_rad": ("command_pitch", 1.0),
    THRUST: ("command_thrust", 1.0),
    LEVELLED: ("level", 1.0),
    UPDATE: ("step", 1.0),
    TAKE_OVERS: ("take_overs", 1.0),
    **dict(zip(START_TILTS, (("start_roll", 1.0), ("start_pitch", 1.0)), strict=True)),
    START_THRUST: ("start_thrust", 1.0),
    **{f"{SHIFT}_{k}": (f"shift[{k}]", 1.0) for k in range(3)},
    **{f"{SHIFT}_{3 + k}": (f"velocity_shift[{k}]", 1.0) for k in range(3)},
    f"{SHIFT}_6": ("heading_shift", 1.0),
}
_OBSERVED: Final[dict[str, tuple[str, float]]] = {
    "target_ahead_x_m_s2": ("target_ahead[0]", 1.0),
    "target_ahead_y_m_s2": ("target_ahead[1]", 1.0),
    "target_climb_ahead_m_s2": ("target_climb_ahead", 1.0),
    "target_known": ("target_known", 1.0),
}
"""What a module logs of what its targets know."""
_PARAMETERS: Final = "MC_NMPC_"
"""How the names of the module's parameters begin."""
_DAMAGED: Final = "the log is damaged, or of another version; log another flight"
_FASTER: Final = (
    "log at 50 Hz or more: SDLOG_PROFILE with high rate, or these lines, of topic and interval in ms, in "
    "etc/logging/logger_topics.txt on the SD card: "
    f"{SETPOINT} 10; {ATTITUDE} 10; {MOTION} 10; {HOVER} 100"
)


def read_ulog(path: Path, longest_period_s: float = LONGEST_PERIOD_S) -> FlightLog:
    """Read commanded and measured angles, motion and target; PX4 has the frames of this project.

    A log of the steps of our own flight mode is read in their place.
    Raises LogError for a file that is no ULog or lacks a topic or a field, or whose angles come less often
    than every `longest_period_s`, and if pyulog is not installed.
    """
    topics, parameters = _read(path)
    name = echo(str(path))
    steps = topics.get(STEPS)
    if steps is not None and (flies := steps["active"] > 0.0).any():
        lacks = f"{name}: has no parameters {_PARAMETERS}*: replayed with the limits of the settings"
        log = FlightLog(name, _steps(steps, flies) | parameters, () if parameters else (lacks,))
        return demand_one_clock(log, _CLOCK, f"log {STEPS} 0")
    return demand_one_clock(FlightLog(name, _signals(topics, name)), _CLOCK, _FASTER, longest_period_s)


def _signals(topics: Mapping[str, Mapping[str, FloatArray]], name: str) -> dict[str, Signal]:
    """Return the signals of PX4's own topics; raises LogError if some are missing or empty."""
    faults = [
        f"{name}: has no {topic}; log it (SDLOG_PROFILE, default set)"
        for topic in (SETPOINT, ATTITUDE)
        if topic not in topics
    ]
    if faults:
        raise LogError(tuple(faults))
    command, attitude = topics[SETPOINT], topics[ATTITUDE]
    signals = {}
    for angle, values in _commands(command, attitude).items():
        signals[f"{angle}_command_rad"] = stamped(command[_CLOCK], values, f"{SETPOINT}.{angle}")
    for angle, values in zip(_ANGLES, _euler_rad([attitude[f"q[{i}]"] for i in range(4)]), strict=True):
        values = np.unwrap(values) if angle == "yaw" else values  # noqa: PLW2901 - the same angle
        signals[f"{angle}_rad"] = stamped(attitude[_CLOCK], values, f"{ATTITUDE}.q")
    signals |= _thrust(command, topics.get(HOVER))
    if (motion := topics.get(MOTION)) is not None:
        for signal, field in _MOTION.items():
            signals[signal] = stamped(motion[_CLOCK], motion[field], f"{MOTION}.{field}")
    signals |= _seen(topics.get(VISION, {}))
    target = topics.get(TRAJECTORY, {})
    for signal, fields in _TARGET.items():
        for field in fields:
            if field in target and np.isfinite(target[field]).any():
                signals[signal] = stamped(target[_CLOCK], target[field], f"{TRAJECTORY}.{field}")
    return signals


def _seen(vision: Mapping[str, FloatArray]) -> dict[str, Signal]:
    """Return the positions that a camera measured, if their axes are those of the estimate."""
    if not (vision.get("pose_frame", np.zeros(0)) == _NED).any():
        return {}
    fields = [f"position[{axis}]" for axis in range(2)]
    return {
        signal: stamped(vision[_CLOCK], vision[field], f"{VISION}.{field}")
        for signal, field in zip(SEEN, fields, strict=True)
    }


class Topic(dict[str, FloatArray]):
    """The fields (k,) of a topic; one that the log lacks raises LogError."""

    def __init__(self, log: str, name: str, fields: Mapping[str, Any]) -> None:
        super().__init__({field: np.asarray(values, np.float64) for field, values in fields.items()})
        self._said = f"{log}: {name} has no field"

    def __missing__(self, field: str) -> FloatArray:
        raise LogError((f"{self._said} {field}; {_DAMAGED}",))


def _read(path: Path) -> tuple[dict[str, Topic], dict[str, Signal]]:
    """Return the fields of the first instance of each topic, and the parameters of our own flight mode.

    A topic without time stamps makes pyulog lose other topics; so it is looked for before.
    """
    name, wanted = echo(str(path)), [SETPOINT, ATTITUDE, MOTION, TRAJECTORY, HOVER, VISION, STEPS]
    with reading(path, "ULog", "pyulog"), path.open("rb") as file:
        from pyulog import ULog  # noqa: PLC0415 - an optional extra

        log: Any = ULog(file, wanted)
        for topic in wanted:
            fields = getattr(log.message_formats.get(topic), "fields", [(_CLOCK,)])
            if _CLOCK not in (field[-1] for field in fields):
                raise LogError((f"{name}: {topic} has no field {_CLOCK}; {_DAMAGED}",))
        topics = {
            each.name: Topic(name, each.name, each.data) for each in log.data_list if each.multi_id == 0
        }
        return topics, _parameters(log.initial_parameters, log.changed_parameters)


def _parameters(initial: Mapping[str, float], changes: Sequence[tuple[int, str, float]]) -> dict[str, Signal]:
    """Return the parameters of our own flight mode, at first from time 0 on, and at each change.

    A change has the time of the last sample before it.
    """
    found = {}
    for name, value in initial.items():
        if name.startswith(_PARAMETERS):
            later = {1e-6 * at_us: new for at_us, changed, new in changes if changed == name}
            times_s, values = zip(*sorted(({0.0: value} | later).items()), strict=True)
            signal = f"{PARAMETER}{name.removeprefix(_PARAMETERS)}"
            found[signal] = Signal(np.array(times_s), np.array(values, np.float64), name)
    return found


def _steps(steps: Mapping[str, FloatArray], flies: NDArray[np.bool_]) -> dict[str, Signal]:
    """Return the signals of the steps that were flown, over the times of the estimates."""
    time_s = 1e-6 * steps["timestamp_sample"][flies]
    logged = _STEPS | {signal: one for signal, one in _OBSERVED.items() if one[0] in steps}
    return {
        signal: Signal(time_s, sign * steps[field][flies], f"{STEPS}.{field}")
        for signal, (field, sign) in logged.items()
    }


def _commands(
    setpoint: Mapping[str, FloatArray], attitude: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Return the commanded roll and pitch: roll_body and pitch_body, or the angles of the quaternion q_d.

    They are those of the heading of the set-point, which the drone lags; returned are those of the drone's.
    """
    roll, pitch, yaw = (setpoint.get(f"{angle}_body") for angle in _ANGLES)
    if roll is None or pitch is None or not (np.isfinite(roll).any() and np.isfinite(pitch).any()):
        roll, pitch, yaw = _euler_rad([setpoint[f"q_d[{i}]"] for i in range(4)])
    if yaw is not None and attitude[_CLOCK].size:
        yaw_rad = _euler_rad([attitude[f"q[{i}]"] for i in range(4)])[2]
        roll, pitch = tilts_at_heading((roll, pitch, yaw), setpoint[_CLOCK], yaw_rad, attitude[_CLOCK])
    return {"roll": roll, "pitch": pitch}


def _thrust(setpoint: Mapping[str, FloatArray], hover: Mapping[str, FloatArray] | None) -> dict[str, Signal]:
    """Return the commanded thrust, up positive, if there is one.

    It is over mass if PX4 has estimated the thrust of hover, else in the unit of the set-point.
    """
    values = setpoint.get(_THRUST)
    if values is None or not np.isfinite(values).any():
        return {}
    if hover is None or not (valid := hover["valid"] > 0.0).any():
        return {THRUST_COMMAND: stamped(setpoint[_CLOCK], -values, f"-{SETPOINT}.{_THRUST}")}
    share = float(np.median(hover["hover_thrust"][valid]))
    column = f"-g*{SETPOINT}.{_THRUST}/{HOVER}"
    return {THRUST: stamped(setpoint[_CLOCK], -GRAVITY_M_S2 / share * values, column)}


def _euler_rad(q: list[FloatArray]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return roll, pitch, yaw, each (k,), of a quaternion w, x, y, z, each (k,), from body to NED."""
    w, x, y, z = q
    return (
        np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0)),
        np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )
