"""Logs of autopilots: DataFlash, the thrust in those of PX4, and how their estimators err."""

import sys
from pathlib import Path

import numpy as np
import pytest

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Seen
from mambo_sil.drone.sensors.drift import DriftingEstimate, DriftSuite
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import AutopilotSensors
from mambo_sil.errors import LogError
from mambo_sil.flight.frames import turned_tilt
from mambo_sil.model.identify.estimator import estimator_errors
from mambo_sil.model.identify.identify import identify, read_logs
from mambo_sil.model.identify.identify_report import vehicle_text
from mambo_sil.model.identify.signals import POSITION, SEEN, THRUST, THRUST_COMMAND, FlightLog, Signal
from mambo_sil.results.terminal import result_text
from tests.support.logs import Flown, Lifting, Truth, dataflash, fly, heading_later_rad, lift, log_of, ulog

TRUTH = Truth()
FLOWN = fly(TRUTH, Flown(duration_s=20.0, yaw_rate_rad_s=0.4), 1)[0]
HOVER = 0.37
LIFTING = Lifting(hover_command=HOVER)
DURATION_S, STEP_S, CAMERA_M = 90.0, 0.02, 0.002
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


@pytest.mark.parametrize("kind", ["ulg", "bin"])
def test_commands_are_read_at_the_heading_of_the_drone(kind: str, tmp_path: Path) -> None:
    """It lags that of the set-point, by up to 1.5 rad here, to which roll and pitch of the log belong.

    With ArduPilot it is the one at which the drone follows.
    """
    lead_rad = 1.5 * np.sin(FLOWN["time_s"])
    tilts = zip(FLOWN["roll_command_rad"], FLOWN["pitch_command_rad"], lead_rad, strict=True)
    names = ("roll_command_rad", "pitch_command_rad")
    sent = dict(zip(names, np.array([turned_tilt(*one) for one in tilts]).T, strict=True))
    heading_rad = heading_later_rad(FLOWN) if kind == "bin" else FLOWN["yaw_rad"]
    flown = FLOWN | sent | {"yaw_command_rad": heading_rad + lead_rad}
    path = tmp_path / f"log.{kind}"
    path.write_bytes(dataflash(flown) if kind == "bin" else ulog(flown, quaternion=True))
    (log,), _ = read_logs([path], {})
    for name in names:
        np.testing.assert_allclose(log.signals[name].value, FLOWN[name], atol=2e-6)


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


def test_rare_angles_name_the_bit_that_ardupilot_needs(tmp_path: Path) -> None:
    """At 5 Hz; the 10 Hz of its default are taken."""
    path = tmp_path / "log.bin"
    path.write_bytes(dataflash(FLOWN, every=20))
    with pytest.raises(LogError, match=r"has a sample every 0.2 s .*LOG_BITMASK: add 1"):
        read_logs([path], {})
    path.write_bytes(dataflash(FLOWN, every=10))
    (log,), _ = read_logs([path], {})
    fit = identify([log])[0].roll.fitted
    assert fit is not None
    assert abs(fit.sum_s.value - TRUTH.lag_s[0] - TRUTH.delay_s[0]) <= fit.sum_s.within < 0.03


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


@pytest.mark.parametrize(
    ("name", "module", "words"),
    [
        (
            "log.bin",
            "pymavlink.DFReader",
            "DataFlash needs pymavlink; install it: .* -m pip install pymavlink",
        ),
        ("log.ulg", "pyulog", "ULog needs pyulog; install it: .* -m pip install pyulog"),
    ],
)
def test_a_package_that_is_missing_is_named(
    name: str, module: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the command that installs it, as the pilot does."""
    (tmp_path / name).write_bytes(b"")
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(LogError, match=f"reading {words}$"):
        read_logs([tmp_path / name], {})


def errors_m(sensors: AutopilotSensors, seed: int, jump_m: float = 0.0) -> FloatArray:
    """Return estimate less seen position (2, m): it errs so, jumps after 35 s, and is 1 m off; with noise."""
    suite, true = (
        DriftSuite(DriftingEstimate(sensors), (seed,), STEP_S),
        Seen(*(np.zeros((3, 1)) for _ in range(4))),
    )
    drift = [suite.estimate(true).position_m[:2, 0] for _ in range(round(DURATION_S / STEP_S))]
    found = np.array(drift).T + 1.0 + CAMERA_M * np.random.default_rng(seed).standard_normal((2, len(drift)))
    found[:, round(35.0 / STEP_S) :] += jump_m
    return found


def log_with(error_m: FloatArray) -> FlightLog:
    """Return a log of a drone that stands still."""
    time_s = np.asarray(STEP_S * np.arange(error_m.shape[1]), np.float64)
    signals = {name: Signal(time_s, values, name) for name, values in zip(POSITION, error_m, strict=True)}
    return FlightLog("made", signals | {name: Signal(time_s, 0.0 * time_s, name) for name in SEEN})


@pytest.mark.parametrize(("error_m_s", "lasts_s"), [(0.12, 0.7), (0.2, 0.4), (0.06, 1.2)])
def test_the_errors_are_found_in_what_the_camera_saw(error_m_s: float, lasts_s: float) -> None:
    """Of six flights together, within a quarter; an offset of the frames and a jump do not count."""
    sensors = AutopilotSensors(velocity_error_m_s=error_m_s, velocity_error_s=lasts_s)
    logs = [log_with(errors_m(sensors, seed, 0.3 if seed == 3 else 0.0)) for seed in range(1, 7)]
    found = estimator_errors(logs, [[(0.0, DURATION_S)]] * 6)
    assert found is not None
    assert found.velocity_m_s == pytest.approx(error_m_s, rel=0.25)
    assert found.correlation_s == pytest.approx(lasts_s, rel=0.25)
    assert estimator_errors(logs, [[(0.0, 15.0)]] * 6) is None


def test_a_ulog_gives_a_vehicle_with_its_sensors(tmp_path: Path) -> None:
    """The file is a vehicle.toml; without what the camera measured it has no sensors."""
    columns = fly(Truth(), Flown(duration_s=40.0), 1)[0]
    error_m = errors_m(AutopilotSensors(), 1)
    own_s = STEP_S * np.arange(error_m.shape[1]) + columns["time_s"][0]
    seen = {
        name: columns[estimated] - np.interp(columns["time_s"], own_s, error)
        for name, estimated, error in zip(SEEN, POSITION, error_m, strict=True)
    }
    path = tmp_path / "log.ulg"
    path.write_bytes(ulog(columns | seen, quaternion=True))
    summary = identify(read_logs([path], {})[0])[0]
    assert "error of the estimated velocity" in result_text(summary.result(tmp_path))
    written = tmp_path / "vehicle.toml"
    written.write_text(vehicle_text(summary, 0.5), "utf-8")
    found = vehicle_toml.load(str(written)).sensors
    assert isinstance(found, AutopilotSensors)
    assert found.velocity_error_m_s == pytest.approx(0.12, rel=0.5)
    path.write_bytes(ulog(columns, quaternion=True))
    (log,) = read_logs([path], {})[0]
    assert estimator_errors([log], [[(0.0, 1e9)]]) is None
    assert "[sensors]" not in vehicle_text(summary.model_copy(update={"estimator": None}), 0.5)


def test_a_camera_alone_is_no_estimator() -> None:
    """Noise, and an estimate that equals what was seen, show nothing."""
    noise_m = np.random.default_rng(1).standard_normal((2, round(DURATION_S / STEP_S)))
    for error_m in (noise_m, 0.0 * noise_m):
        assert estimator_errors([log_with(error_m)], [[(0.0, DURATION_S)]]) is None
