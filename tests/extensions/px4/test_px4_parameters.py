"""Parameters of flight mode MPC in a ULog: `replay` flies with the limits that they made."""

import struct
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Final

import pytest

from mambo_codegen.settings.controller_toml import to_toml
from tests.extensions.px4.support import MPC, px4_settings, status_ulog
from tests.extensions.px4.support.px4_desk import Px4Desk, build_px4
from tests.support.command import run

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

Change = tuple[int, str, float]
"""A row, a parameter without MC_NMPC_, and its value from then on."""
TIGHT: Final = {"TILT": 0.2, "SPEED": 1.0, "X_MAX": 0.8}
CHANGES: Final = ((150, "SPEED", 0.4), (400, "TILT", 0.1), (401, "Z_MIN", 5000.0), (550, "SPEED", 0.0))
"""The third one is refused, and with the last one the settings say the speed."""
LACKS: Final = "flight.ulg: has no parameters MC_NMPC_*: replayed with the limits of the settings"


@cache
def flown(*changes: Change) -> bytes:
    """Fly to and fro by the sticks, with tight parameters and changes of them; return a ULog without them."""
    desk = Px4Desk(build_px4(px4_settings()))
    for name, value in TIGHT.items():
        desk.set(f"px4.{name}", value)
    desk.run(100)
    desk.select(MPC, 0)
    desk.set("px4.sticks", 1)
    rows: list[dict[str, float]] = []
    for millisecond in range(7000):
        desk.set("px4.pitch", 0.9 if millisecond % 2800 < 1400 else -0.9)
        before = desk["s.step"]
        desk.run(1)
        if desk["s.step"] == before:
            continue
        rows.append(desk.status())
        for row, name, value in changes:
            if row == len(rows):
                desk.set(f"px4.{name}", value)
    return status_ulog(rows, desk.fields)


def with_parameters(
    log: bytes, initial: Mapping[str, float], changes: tuple[Change, ...] = (), late: int = 0
) -> bytes:
    """Return a ULog with parameters at its beginning, and changes behind rows, `late` rows too late."""

    def message(name: str, value: float) -> bytes:
        key = f"float MC_NMPC_{name}".encode()
        content = struct.pack("<B", len(key)) + key + struct.pack("<f", value)
        return struct.pack("<Hc", len(content), b"P") + content

    parts, place, row = [log[:16]], 16, 0
    while place < len(log):
        size, kind = struct.unpack_from("<Hc", log, place)
        if kind == b"A":
            parts += [message(*each) for each in initial.items()]
        parts.append(log[place : place + 3 + size])
        place += 3 + size
        if kind == b"D":
            row += 1
            parts += [message(name, value) for at, name, value in changes if at + late == row]
    return b"".join(parts)


def replayed(log: bytes, code: int = 0) -> str:
    """Return what the replay of a ULog prints, in one line."""
    Path("flight.ulg").write_bytes(log)
    Path("controller.toml").write_text(to_toml(px4_settings()), "utf-8")
    return " ".join(run("replay", "flight.ulg", "controller.toml", code=code)[0].split())


@pytest.mark.parametrize("late", [-2, 0, 2])
def test_parameters_are_read_from_a_ulog_with_their_changes(late: int) -> None:
    """All commands are repeated in every bit; the log may say a change some steps too early or too late."""
    printed = replayed(with_parameters(flown(*CHANGES), TIGHT, CHANGES, late))
    assert "commands of the log are those of this controller, bit for bit" in printed
    assert LACKS not in printed


def test_a_ulog_without_parameters_says_so() -> None:
    """The limits that flew are not those of the settings, and the log does not have them."""
    printed = replayed(flown(), code=1)
    assert printed.startswith("NOT THIS CONTROLLER")
    assert LACKS in printed


def test_parameters_that_did_not_fly_are_told() -> None:
    """A log that says the default, of a flight with another limit, is not one of this controller."""
    default = {"SPEED": px4_settings().limits.speed_m_s}
    assert LACKS not in replayed(with_parameters(flown(), default), code=1)
