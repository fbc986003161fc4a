"""The Crazyflie's firmware on the desk: flown where a clone is named, else checked without one."""

import functools
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.firmware.__main__ import VARIABLE
from benchmarks.firmware.build import NoFirmwareError, build
from benchmarks.firmware.flight_log import write_log
from benchmarks.firmware.laboratory import ControllerNumber, LaboratoryConditions
from benchmarks.firmware.one_process import each_in_a_process
from benchmarks.firmware.stream import OFFSETS, Job, Stream, fly, judge
from mambo_codegen.settings import presets
from mambo_sil.flight.trajectories import Bernoulli, Circle
from mambo_sil.model.replay.log_replay import replay_log
from tests.support.tools import require

ROOT = Path(__file__).parents[2]
SETTINGS = presets.preset("crazyflie")
CIRCLE = Stream(Circle(1.0, 1.5), duration_s=8.0)


@pytest.fixture(scope="module")
def job() -> Job:
    """Return a flight of the app; CI has no clone, so that the skip is not a failure there."""
    clone = os.environ.get(VARIABLE)
    if clone is None:
        pytest.skip(f"needs a clone of the Crazyflie's firmware: set {VARIABLE}, as --firmware does")
    require("gcc", "gcc")
    return Job(build(Path(clone), SETTINGS), ControllerNumber.APP, CIRCLE, LaboratoryConditions(), OFFSETS[4])


def test_a_flight_is_the_same_on_every_run(job: Job) -> None:
    """Equal in every bit of the path, and close to the circle; at another offset it is another flight."""
    one, again, other = each_in_a_process(fly, [job, job, replace(job, offset=OFFSETS[5])])
    assert np.array_equal(one.path, again.path)
    assert not np.array_equal(one.path, other.path)
    assert not one.crashed
    assert one.largest_m < 0.03


def test_offsets_of_the_clocks_hardly_change_a_flight(job: Job) -> None:
    """The app dates the estimated position."""
    iae_m_s = [flight.iae_m_s for flight in each_in_a_process(fly, [replace(job, offset=o) for o in OFFSETS])]
    assert max(iae_m_s) - min(iae_m_s) < 0.05


def test_a_log_is_replayed_in_every_bit(job: Job, tmp_path: Path) -> None:
    """All steps of 30 s."""
    path = tmp_path / "flight.csv"
    each_in_a_process(functools.partial(write_log, job), [path])
    replay = replay_log(path, {}, SETTINGS)
    assert len(replay.time_s) == 3000
    assert np.array_equal(replay.replayed_rad, replay.logged_rad)


def test_a_folder_without_firmware_is_refused(tmp_path: Path) -> None:
    """By its name."""
    with pytest.raises(NoFirmwareError, match=f"{tmp_path}: is no clone of https://github.com/bitcraze"):
        build(tmp_path, SETTINGS)


@pytest.mark.long
def test_the_command_asks_for_a_clone() -> None:
    """By the option and the variable."""
    environment = {name: value for name, value in os.environ.items() if name != VARIABLE}
    ran = subprocess.run(
        [sys.executable, "-m", "benchmarks.firmware"],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 2
    assert f"name it by --firmware or {VARIABLE}" in ran.stderr


def test_there_are_nine_offsets() -> None:
    """Every offset of the camera with every one of the app."""
    assert len({(one.camera_ms, one.app_ms) for one in OFFSETS}) == len(OFFSETS) == 9


def test_measures_of_a_path_that_is_known() -> None:
    """A drone 10 cm ahead along x, 2 cm too high, with motors that change by 0.01 each in 10 ms."""
    times_s = 0.01 * np.arange(1, 1001)
    target_m = Stream(Bernoulli(2.0, 0.5)).motion(times_s)[:, 0]
    states = np.zeros((1000, 13))
    states[:, :3] = target_m + np.array([0.1, 0.0, 0.02])
    states[:, 3] = 1.5
    states[:, 9:] = 0.5 + 0.01 * (np.arange(1000) % 2)[:, np.newaxis]
    flown = judge(times_s, states, target_m, crashed=False)
    assert flown.iae_m_s == pytest.approx(1.0)
    assert (flown.largest_m, flown.past_m, flown.height_m) == pytest.approx((0.1, 0.1, 0.02))
    assert (flown.busy, flown.speed_m_s, flown.height_rms_m) == pytest.approx((0.04, 1.5, 0.02))
    assert flown.settled_s == pytest.approx(10.0)
