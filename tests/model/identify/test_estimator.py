"""How the estimator of an autopilot errs, from logs with what its camera measured."""

from pathlib import Path

import numpy as np
import pytest

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.sensors.autopilot import EstimatorErrors
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import AutopilotSensors
from mambo_sil.model.identify.estimator import estimator_errors
from mambo_sil.model.identify.identify import identify, read_logs
from mambo_sil.model.identify.identify_report import vehicle_text
from mambo_sil.model.identify.signals import POSITION, SEEN, FlightLog, Signal
from mambo_sil.results.terminal import result_text
from tests.support.logs import Flown, Truth, fly, ulog

DURATION_S, STEP_S, CAMERA_M = 90.0, 0.02, 0.002


def errors_m(sensors: AutopilotSensors, seed: int, jump_m: float = 0.0) -> FloatArray:
    """Return estimate less seen position (2, m): it errs so, jumps after 35 s, and is 1 m off; with noise."""
    errors, drift = EstimatorErrors(sensors, seed, STEP_S), []
    for _ in range(round(DURATION_S / STEP_S)):
        errors.advance()
        drift.append(errors.position_m[:2])
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
