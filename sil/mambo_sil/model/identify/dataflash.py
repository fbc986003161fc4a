"""Read a DataFlash log of ArduPilot's copter (.bin), with the reader of the optional package pymavlink.

Its angles are in degrees, with the signs and the frame of this project. The commands are the set-points of
GUIDED (GUIA), at the heading of the drone that follows them: DesRoll and DesPitch follow them smoothly, as
ATC_INPUT_TC says, 0.15 s later, so that they show a drone that is quicker than it is. The thrust is theirs, a
share of the largest: the hover thrust that ArduCopter learns is not that of such a flight.
"""

import contextlib
from pathlib import Path
from typing import Any, Final

import numpy as np

from mambo_codegen.errors import echo
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import LogError
from mambo_sil.model.identify.csv_log import LONGEST_PERIOD_S, demand_one_clock, reading
from mambo_sil.model.identify.signals import (
    COMMANDS,
    DEGREE,
    THRUST_COMMAND,
    FlightLog,
    Signal,
    stamped,
    tilts_at_heading,
)

ATTITUDES: Final = ("ANG", "ATT")
"""Angles, at the rate of the loop if that is there; those of ATT come 10 times a second where ANG exists."""
SET_POINTS, MOTION = "GUIA", "XKF1"
_ANGLES: Final = {"roll_rad": "Roll", "pitch_rad": "Pitch", "yaw_rad": "Yaw"}
_MOTION: Final = {"x_m": "PN", "y_m": "PE", "z_m": "PD", "vx_m_s": "VN", "vy_m_s": "VE"}
_BEGINS: Final = b"\xa3\x95\x80"
"""The definition of a message, which comes first."""
_CLOCK: Final = "TimeUS"
FOLLOWS_S: Final = 0.15
"""Time in which the thrust follows a set-point, to where it points in the world, while the heading turns on.

At the heading of the command the lag of a drone that turns at 1 rad/s seems 110 ms, at that of the set-point
200; it is 158.
"""
_DAMAGED: Final = "the log is damaged, or of another version; log another flight"
_FASTER: Final = "log attitude fast (LOG_BITMASK: add 1, ATTITUDE_FAST)"
_NO_SET_POINTS: Final = (
    f"has no {SET_POINTS}: without set-points of the attitude it shows only how the drone follows "
    "ArduCopter's own smooth target, not a command; log a flight of mambo-nmpc pilot"
)

Columns = dict[str, FloatArray]


def read_dataflash(path: Path, longest_period_s: float = LONGEST_PERIOD_S) -> FlightLog:
    """Read commanded and measured angles, motion and thrust.

    Raises LogError for a file that is no DataFlash log or lacks a message or a field, or whose angles come
    less often than every `longest_period_s`, and if pymavlink is not installed.
    """
    name = echo(str(path))
    messages = _messages(path)
    kind = next((one for one in ATTITUDES if one in messages), None)
    if kind is None:
        raise LogError((f"{name}: has no {ATTITUDES[-1]}; it is no DataFlash log of a copter, or {_FASTER}",))
    if (set_points := messages.get(SET_POINTS)) is None:
        raise LogError((f"{name}: {_NO_SET_POINTS}",))
    attitude, signals = messages[kind], {}
    sent_rad = [DEGREE * set_points[field] for field in _ANGLES.values()]
    follows_us = set_points[_CLOCK] + 1e6 * FOLLOWS_S
    tilts_rad = tilts_at_heading(sent_rad, follows_us, DEGREE * attitude["Yaw"], attitude[_CLOCK])
    for signal, field, values in zip(COMMANDS, _ANGLES.values(), tilts_rad, strict=False):
        signals[signal] = stamped(set_points[_CLOCK], values, f"deg*{SET_POINTS}.{field}")
    for signal, field in _ANGLES.items():
        values = DEGREE * attitude[field]
        values = np.unwrap(values) if signal == "yaw_rad" else values
        signals[signal] = stamped(attitude[_CLOCK], values, f"deg*{kind}.{field}")
    if (motion := messages.get(MOTION)) is not None:
        for signal, field in _MOTION.items():
            signals[signal] = stamped(motion[_CLOCK], motion[field], f"{MOTION}.{field}")
    signals[THRUST_COMMAND] = stamped(set_points[_CLOCK], set_points["Thrust"], f"{SET_POINTS}.Thrust")
    signals = _between(signals, *(1e-6 * set_points[_CLOCK][[0, -1]]).tolist())
    return demand_one_clock(FlightLog(name, signals), _CLOCK, _FASTER, longest_period_s)


def _messages(path: Path) -> dict[str, Columns]:
    """Return the columns of each kind of message; of the motion those of the first estimator."""
    with reading(path, "DataFlash log", "pymavlink"):
        from pymavlink.DFReader import DFReader_binary  # noqa: PLC0415 - an optional extra

        with path.open("rb") as file:
            if file.read(len(_BEGINS)) != _BEGINS:
                raise LogError((f"{echo(str(path))}: is no DataFlash log: it begins otherwise",))
        reader: Any = DFReader_binary(str(path))
        with contextlib.closing(reader.filehandle), contextlib.closing(reader.data_map):
            return _columns(reader, echo(str(path)))


def _columns(reader: Any, name: str) -> dict[str, Columns]:
    """Return the columns of each kind; raises LogError for one without a field that is needed."""
    wanted = {
        **dict.fromkeys(ATTITUDES, (_CLOCK, *_ANGLES.values())),
        SET_POINTS: (_CLOCK, *_ANGLES.values(), "Thrust"),
        MOTION: (_CLOCK, *_MOTION.values()),
    }
    found: dict[str, list[list[float]]] = {}
    while (message := reader.recv_match(type=list(wanted))) is not None:
        kind = message.get_type()
        if kind not in found and (lost := set(wanted[kind]) - set(message.get_fieldnames())):
            fields = ", ".join(sorted(lost))
            raise LogError((f"{name}: {kind} has no field {fields}; {_DAMAGED}",))
        if kind != MOTION or getattr(message, "C", 0) == 0:
            row = [float(getattr(message, field)) for field in wanted[kind]]
            found.setdefault(kind, []).append(row)
    return {kind: dict(zip(wanted[kind], np.array(rows).T, strict=True)) for kind, rows in found.items()}


def _between(signals: dict[str, Signal], first_s: float, last_s: float) -> dict[str, Signal]:
    """Return what lies between two times."""
    cut = {}
    for name, signal in signals.items():
        inside = (signal.time_s >= first_s) & (signal.time_s <= last_s)
        cut[name] = Signal(signal.time_s[inside], signal.value[inside], signal.column)
    return cut
