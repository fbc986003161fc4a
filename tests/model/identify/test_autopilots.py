"""Logs of autopilots: DataFlash of ArduPilot, and the thrust in those of PX4."""

import sys
from pathlib import Path

import numpy as np
import pytest

from mambo_sil.errors import LogError
from mambo_sil.model.identify.identify import identify, read_logs
from mambo_sil.model.identify.signals import THRUST, THRUST_COMMAND
from tests.support.logs import Flown, Lifting, Truth, dataflash, fly, lift, log_of, ulog

FLOWN = fly(Truth(), Flown(duration_s=20.0, yaw_rate_rad_s=0.4), 1)[0]
HOVER = 0.37
LIFTING = Lifting(hover_command=HOVER)
PLACE = ("x_m", "y_m", "vx_m_s", "vy_m_s", "yaw_rad")


def lifted() -> dict[str, np.ndarray[tuple[int, ...], np.dtype[np.float64]]]:
    """Return the columns of a drone that was moved up and down on the spot."""
    columns = lift(LIFTING)
    return dict.fromkeys(PLACE, np.zeros_like(columns["time_s"])) | columns


@pytest.mark.parametrize("angles", ["ANG", "ATT"])
def test_a_dataflash_log_is_read(angles: str, tmp_path: Path) -> None:
    """Degrees, a heading of 0 to 360 and the first of two estimators; the fit is that of the CSV.

    ArduCopter 4.7 logs fast angles as ANG, those before it as ATT.
    """
    path = tmp_path / "00000012.BIN"
    path.write_bytes(dataflash(FLOWN, angles=angles))
    (log,), faults = read_logs([path], {})
    assert not faults
    for name in ("roll_command_rad", "roll_rad", "pitch_rad", "x_m", "vy_m_s"):
        np.testing.assert_allclose(log.signals[name].value, FLOWN[name], atol=2e-6)
    turned_rad = log.signals["yaw_rad"].value
    np.testing.assert_allclose(turned_rad - turned_rad[0], FLOWN["yaw_rad"] - FLOWN["yaw_rad"][0], atol=1e-5)
    found, wanted = identify([log])[0], identify([log_of(FLOWN)])[0]
    assert found.roll.fitted is not None
    assert wanted.roll.fitted is not None
    assert abs(found.roll.fitted.sum_s.value - wanted.roll.fitted.sum_s.value) < 1e-3
    assert abs(found.roll.fitted.gain.value - wanted.roll.fitted.gain.value) < 1e-3


def test_the_thrust_is_over_mass_where_hover_is_estimated(tmp_path: Path) -> None:
    """The mass is not in the log; the gain is that of the estimate, and the lag is that of the drone."""
    path = tmp_path / "log.ulg"
    columns = lifted()
    path.write_bytes(ulog(columns, quaternion=True, hover=HOVER))
    (log,), _ = read_logs([path], {})
    assert THRUST_COMMAND not in log.signals
    thrust_m_s2 = log.signals[THRUST].value
    np.testing.assert_allclose(thrust_m_s2, 9.81 / HOVER * columns["thrust_command"], rtol=1e-5)


@pytest.mark.parametrize("kind", ["bin", "ulg"])
def test_without_an_estimate_of_hover_the_thrust_has_its_own_unit(kind: str, tmp_path: Path) -> None:
    """As of ArduCopter, whose set-points of thrust teach it no hover."""
    path = tmp_path / f"log.{kind}"
    path.write_bytes(dataflash(lifted()) if kind == "bin" else ulog(lifted(), quaternion=True))
    (log,), _ = read_logs([path], {})
    assert THRUST not in log.signals
    np.testing.assert_allclose(log.signals[THRUST_COMMAND].value, lifted()["thrust_command"], rtol=1e-5)


def test_rare_angles_name_the_lines_that_px4_needs(tmp_path: Path) -> None:
    """Of its default profile: a sample every 48 ms."""
    path = tmp_path / "log.ulg"
    rare = {name: values[::5] for name, values in FLOWN.items()}
    path.write_bytes(ulog(rare, quaternion=True))
    with pytest.raises(LogError) as raised:
        read_logs([path], {})
    for line in (
        "vehicle_attitude_setpoint 10",
        "vehicle_attitude 10",
        "vehicle_local_position 10",
        "hover_thrust_estimate 100",
    ):
        assert line in str(raised.value)
    assert "logger_topics.txt" in str(raised.value)


def test_rare_angles_name_the_bit_that_ardupilot_needs(tmp_path: Path) -> None:
    """Its default is 10 Hz."""
    path = tmp_path / "log.bin"
    path.write_bytes(dataflash(FLOWN, every=10))
    with pytest.raises(LogError, match=r"has a sample every 0.1 s .*LOG_BITMASK: add 1"):
        read_logs([path], {})


def test_a_log_without_set_points_is_refused(tmp_path: Path) -> None:
    """Of another mode, whose DesRoll is smoothed: what follows it is quicker than the drone."""
    path = tmp_path / "log.bin"
    path.write_bytes(dataflash(FLOWN, guided=False))
    with pytest.raises(LogError, match=r"log\.bin: has no GUIA: .* log a flight of mambo-nmpc pilot"):
        read_logs([path], {})


@pytest.mark.parametrize("content", [b"", b"garbage" * 100, dataflash(FLOWN)[:200]])
def test_what_is_no_dataflash_log_is_told(content: bytes, tmp_path: Path) -> None:
    """An empty file, garbage, one cut short."""
    path = tmp_path / "log.bin"
    path.write_bytes(content)
    with pytest.raises(LogError, match=r"log\.bin: (is no DataFlash log|has no ATT)"):
        read_logs([path], {})


def test_dataflash_without_pymavlink_names_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the pilot does."""
    (tmp_path / "log.bin").write_bytes(b"")
    monkeypatch.setitem(sys.modules, "pymavlink.DFReader", None)
    with pytest.raises(
        LogError, match=r"reading DataFlash needs pymavlink; install it: .* -m pip install pymavlink"
    ):
        read_logs([tmp_path / "log.bin"], {})
