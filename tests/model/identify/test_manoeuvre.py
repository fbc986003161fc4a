"""The manoeuvre: waypoints and script are the same figure, and a flight of it shows the drone."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.errors import FileExistsRefusedError, UnwritableError
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.errors import TrajectoryError
from mambo_sil.flight.trajectories import Waypoints
from mambo_sil.model.identify.manoeuvre import (
    DURATION_S,
    HEIGHT_M,
    SINES_RAD,
    SIZE_M,
    crazyflie_script,
    reference_m,
    waypoints_csv,
    write_manoeuvre,
)
from mambo_sil.model.identify.signals import DEGREE


def test_the_figure_tilts_by_more_than_two_degrees() -> None:
    """Rms of the tilt that each axis needs; with at most 1.5 m/s, within the room that is named."""
    step_s = 0.001
    time_s = np.arange(0.0, DURATION_S, step_s)
    for along, half_width in zip(reference_m(time_s), (SIZE_M, HEIGHT_M), strict=True):
        tilt = np.gradient(np.gradient(along, step_s), step_s) / GRAVITY_M_S2
        assert 3.0 * DEGREE < tilt.std() < 10.0 * DEGREE
        assert tilt.std() > 2.0 * SINES_RAD
        assert np.abs(np.gradient(along, step_s)).max() < 1.5
        assert half_width < np.abs(along).max() < half_width + 0.05
        assert abs(along[0]) < 1e-12
        assert abs(along[-1]) < 1e-5


def test_waypoints_can_be_flown(tmp_path: Path) -> None:
    """Those of the file that `fly --trajectory` reads."""
    path = tmp_path / "eight.csv"
    said = write_manoeuvre(path)
    assert "44 s of waypoints" in said
    assert path.read_text("utf-8") == waypoints_csv()
    times = np.array([0.0, 10.0, 21.5, 44.0])
    target = Waypoints.read(path).target(times)
    np.testing.assert_allclose(target[:, :2], np.stack(reference_m(times), axis=1), atol=1e-3)


def test_the_script_flies_the_same_figure() -> None:
    """It is Python, imports no library before it connects, and leads the velocity by the acceleration."""
    names: dict[str, object] = {"__name__": "script"}
    exec(compile(crazyflie_script(), "eight.py", "exec"), names)
    reference, velocity = names["reference_m"], names["velocity_m_s"]
    assert callable(reference)
    assert callable(velocity)
    for time_s in (0.0, 1.3, 17.0, 43.0, 44.0):
        wanted = [float(each) for each in reference_m(np.array(time_s))]
        np.testing.assert_allclose(reference(time_s), wanted, atol=1e-4)
    here = reference(20.0)
    ahead, behind = velocity(20.0, here), velocity(20.0, [here[0] + 0.1, here[1]])
    assert behind[0] - ahead[0] == pytest.approx(-0.15)
    assert behind[1] == ahead[1]


def test_the_script_logs_what_identify_reads() -> None:
    """Every block within the 26 bytes of a packet."""
    names: dict[str, object] = {"__name__": "script"}
    exec(compile(crazyflie_script(), "eight.py", "exec"), names)
    blocks = names["BLOCKS"]
    assert isinstance(blocks, tuple)
    assert all(4 * len(block) <= 26 for block in blocks)
    flat = [name for block in blocks for name in block]
    assert {"controller.roll", "controller.pitch", "stateEstimate.roll", "stateEstimate.pitch"} < set(flat)
    assert len(next(csv.reader(io.StringIO(",".join(flat))))) == 10


def test_a_manoeuvre_overwrites_nothing(tmp_path: Path) -> None:
    """Nor is it written under another ending, or where nothing can be."""
    path = tmp_path / "eight.py"
    path.write_text("mine", "utf-8")
    with pytest.raises(FileExistsRefusedError, match=r"eight.py: exists; name another file"):
        write_manoeuvre(path)
    assert path.read_text("utf-8") == "mine"
    with pytest.raises(TrajectoryError, match=r"must end in \.csv for waypoints, or in \.py"):
        write_manoeuvre(tmp_path / "eight.txt")
    with pytest.raises(UnwritableError, match="cannot be written"):
        write_manoeuvre(path / "under" / "a-file.csv")
