"""Which column of a CSV file holds which signal, in which unit: known names, and --columns."""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from mambo_codegen.errors import echo
from mambo_sil.errors import LogError
from mambo_sil.model.identify.signals import DEGREE, OPTIONAL, REQUIRED, START_THRUST, TIME

_DEGREES: Final = "deg"
_MOST_SHOWN: Final = 20


@dataclass(frozen=True)
class Column:
    """A column and the factor to the SI unit and the sign of the signal."""

    name: str
    factor: float = 1.0

    @property
    def text(self) -> str:
        """The column as --columns spells it."""
        sign = "-" if self.factor < 0.0 else ""
        size = abs(self.factor)
        unit = "" if size == 1.0 else f"{_DEGREES}*" if size == DEGREE else f"{size:g}*"
        return f"{sign}{unit}{self.name}"


KNOWN: Final[dict[str, tuple[Column, ...]]] = {
    TIME: (Column(TIME), Column("Timestamp", 0.001)),
    "roll_command_rad": (
        *(Column("roll_command_rad"), Column("controller.roll", DEGREE), Column("nmpc.outRoll")),
    ),
    "pitch_command_rad": (
        *(Column("pitch_command_rad"), Column("controller.pitch", DEGREE), Column("nmpc.outPitch")),
    ),
    "roll_rad": (
        *(Column("seen_roll_rad"), Column("roll_rad")),
        *(Column("stateEstimate.roll", DEGREE), Column("stabilizer.roll", DEGREE)),
        Column("nmpc.inRoll"),
    ),
    "pitch_rad": (
        *(Column("seen_pitch_rad"), Column("pitch_rad")),
        *(Column("stateEstimate.pitch", DEGREE), Column("stabilizer.pitch", DEGREE)),
        Column("nmpc.inPitch"),
    ),
    "yaw_rad": (
        *(Column("seen_yaw_rad"), Column("yaw_rad")),
        *(Column("stateEstimate.yaw", -DEGREE), Column("stabilizer.yaw", -DEGREE)),
        Column("nmpc.inYaw", -1.0),
    ),
    "x_m": (Column("seen_x_m"), Column("x_m"), Column("stateEstimate.x"), Column("nmpc.x")),
    "y_m": (Column("seen_y_m"), Column("y_m"), Column("stateEstimate.y", -1.0), Column("nmpc.y", -1.0)),
    "z_m": (Column("seen_z_m"), Column("z_m"), Column("stateEstimate.z", -1.0), Column("nmpc.z", -1.0)),
    "vx_m_s": (Column("seen_vx_m_s"), Column("vx_m_s"), Column("stateEstimate.vx"), Column("nmpc.vx")),
    "vy_m_s": (
        Column("seen_vy_m_s"),
        Column("vy_m_s"),
        Column("stateEstimate.vy", -1.0),
        Column("nmpc.vy", -1.0),
    ),
    "thrust_acceleration_m_s2": (Column("thrust_acceleration_m_s2"),),
    START_THRUST: (Column(START_THRUST),),
    "thrust_command": (
        Column("thrust_command"),
        Column("controller.cmd_thrust"),
        Column("stabilizer.thrust"),
    ),
}
"""Known columns of each signal, the first one that a file has is read: of trace.csv, where the estimate
(seen_) is what a real drone would log, and of the Crazyflie, whose y, z and yaw have the other sign."""


def parse_columns(text: str, signals: Mapping[str, object] = KNOWN) -> dict[str, Column]:
    """Return the columns that the option --columns names for `signals`.

    Its form is SIGNAL=COLUMN,... where COLUMN may have a sign and a factor, as in -deg*pitch or 0.001*t.
    Raises LogError with all faults.
    """
    found: dict[str, Column] = {}
    faults = []
    for part in filter(None, (part.strip() for part in text.split(","))):
        signal, equals, column = (word.strip() for word in part.partition("="))
        try:
            if not equals or not column:
                raise ValueError("must be SIGNAL=COLUMN, as in roll_rad=deg*att.roll")
            if signal not in signals:
                near = difflib.get_close_matches(signal, signals, n=1)
                raise ValueError(f"must begin with {near[0] if near else 'one of ' + ', '.join(signals)}")
            if signal in found:
                raise ValueError(f"names {signal} a second time")
            found[signal] = _parse_column(column)
        except ValueError as error:
            faults.append(f"--columns {echo(part)} {error}")
    if faults:
        raise LogError(tuple(faults))
    return found


def _parse_column(text: str) -> Column:
    """Return a column with its sign and factor; raises ValueError."""
    sign = -1.0 if text.startswith("-") else 1.0
    before, star, after = text.removeprefix("-").partition("*")
    if not star:
        return Column(before.strip(), sign)
    try:
        factor = DEGREE if before.strip() == _DEGREES else float(before)
    except ValueError:
        raise ValueError(f"has the factor {echo(before)}; it must be {_DEGREES} or a number") from None
    if not 0.0 < abs(factor) < 1e9:
        raise ValueError(f"has the factor {echo(before)}; it must be a number other than 0")
    return Column(after.strip(), sign * factor)


def choose_columns(
    header: Sequence[str], chosen: Mapping[str, Column], signals: Mapping[str, Sequence[Column]]
) -> tuple[dict[str, Column], list[str]]:
    """Return the column of each signal that a file with this header has, and all faults.

    `chosen` goes before the known columns of `signals`.
    """
    found: dict[str, Column] = {}
    faults = []
    for signal, known in signals.items():
        if signal in chosen:
            column: Column | None = chosen[signal]
            if chosen[signal].name not in header:
                faults.append(
                    f"has no column {echo(chosen[signal].name)}, which --columns names for {signal}"
                )
                continue
        else:
            column = next((each for each in known if each.name in header), None)
        if column is None:
            if signal not in OPTIONAL:
                names = ", ".join(each.name for each in known)
                faults.append(f"has no column for {signal} ({names}); name it: --columns {signal}=COLUMN")
        elif header.count(column.name) > 1:
            faults.append(f"has the column {echo(column.name)} {header.count(column.name)} times")
        else:
            found[signal] = column
    missing = any(signal not in found for signal in (TIME, *REQUIRED))
    if faults and missing:
        shown = ", ".join(echo(name) for name in header[:_MOST_SHOWN])
        faults.append(f"has the columns {shown}{', ...' if len(header) > _MOST_SHOWN else ''}")
    if missing and any(name.startswith("ctrltarget.") for name in header):
        faults.append(
            "has ctrltarget.*, which is a position; the commanded angles are controller.roll and "
            "controller.pitch, which only the PID controller of the Crazyflie logs"
        )
    return found, faults
