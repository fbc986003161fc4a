"""Traces in NPZ and CSV files."""

import csv
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from mambo_sil.drone.sensors.instruments import Sensors
from mambo_sil.errors import TraceError
from mambo_sil.flight.controllers.pd import PdController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.traces import (
    CSV_COLUMNS,
    HEIGHT_COLUMNS,
    SEEN_COLUMNS,
    SensedTrace,
    Trace,
    read_npz,
    write_csv,
    write_npz,
)
from mambo_sil.flight.trajectories import CURVES, Bernoulli, Circle, Trajectories


@pytest.fixture(scope="module")
def trace() -> SensedTrace:
    """Return the trace of two different flights of half a second, with sensors."""
    both = Trajectories((Bernoulli(2.0, 0.5), Circle(1.0, 0.5)))
    flight = Flight(both, duration_s=0.5, flights=2, yaw_rad=0.3, sensors=Sensors())
    flown = fly(flight, PdController())
    assert isinstance(flown, SensedTrace)
    return replace(flown, status=np.arange(flown.status.size).reshape(flown.status.shape))


def test_npz_reads_back_as_it_was_written(trace: SensedTrace, tmp_path: Path) -> None:
    """Every array reads back with the same bits and type."""
    write_npz(trace, tmp_path / "trace.npz")
    again = read_npz(tmp_path / "trace.npz")
    assert isinstance(again, SensedTrace)
    for field in fields(SensedTrace):
        before, after = getattr(trace, field.name), getattr(again, field.name)
        np.testing.assert_array_equal(after, before, strict=True)


def test_the_estimated_flight_is_a_trace_of_its_own(trace: SensedTrace) -> None:
    """`as_seen` replaces the true state by the estimates and keeps times and targets."""
    seen = trace.as_seen()
    for name in ("position_m", "velocity_m_s", "euler_rad"):
        np.testing.assert_array_equal(getattr(seen, name), getattr(trace, f"seen_{name}"))
    np.testing.assert_array_equal(seen.target, trace.target)
    assert not trace.same_bits(seen)


def test_csv_holds_the_chosen_flight_bit_for_bit(trace: SensedTrace, tmp_path: Path) -> None:
    """There is one row per sample and one named column per number, none rounded."""
    write_csv(trace, tmp_path / "trace.csv", flight=1)
    with (tmp_path / "trace.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = list(csv.reader(file))
    assert tuple(header) == (*CSV_COLUMNS, *SEEN_COLUMNS)
    columns = dict(zip(header, np.array(rows, dtype=np.float64).T, strict=True))
    for name, values in {
        "time_s": trace.time_s,
        "x_m": trace.position_m[:, 1, 0],
        "vz_m_s": trace.velocity_m_s[:, 1, 2],
        "yaw_rad": trace.euler_rad[:, 1, 2],
        "target_vy_m_s": trace.target[:, 1, 3],
        "pitch_command_rad": trace.command_rad[:, 1, 1],
        "thrust_acceleration_m_s2": trace.thrust_acceleration_m_s2[:, 1],
        "status": trace.status[:, 1],
        "seen_x_m": trace.seen_position_m[:, 1, 0],
        "seen_yaw_rad": trace.seen_euler_rad[:, 1, 2],
    }.items():
        np.testing.assert_array_equal(columns[name], values, err_msg=name)
    write_csv(trace, tmp_path / "first.csv")
    write_csv(trace, tmp_path / "zero.csv", flight=0)
    assert (tmp_path / "first.csv").read_bytes() == (tmp_path / "zero.csv").read_bytes()


def test_file_that_holds_no_trace_is_refused(tmp_path: Path) -> None:
    """Missing, foreign and incomplete files raise `TraceError`, which names the file."""
    (tmp_path / "text.npz").write_text("time_s,x_m\n", encoding="utf-8")
    np.savez(tmp_path / "other.npz", time_s=np.zeros(3))
    np.save(tmp_path / "array.npy", np.zeros(3))
    for name in ("absent.npz", "text.npz", "other.npz", "array.npy"):
        with pytest.raises(TraceError, match=name):
            read_npz(tmp_path / name)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"status": np.zeros(51)}, r"time_s \(51,\) and status \(51,\) disagree"),
        ({"status": np.zeros((50, 2))}, r"time_s \(51,\) and status \(50, 2\) disagree"),
        ({"status": np.zeros((51, 0))}, r"time_s \(51,\) and status \(51, 0\) disagree"),
        ({"time_s": np.zeros((51, 1))}, r"time_s \(51, 1\) and status \(51, 2\) disagree"),
        ({"position_m": np.zeros((51, 2, 2))}, r"position_m has the shape \(51, 2, 2\)"),
        ({"command_rad": np.zeros((51, 1, 2))}, r"command_rad has the shape \(51, 1, 2\)"),
        ({"target": np.zeros((51, 2, 4), np.complex128)}, "target has the shape"),
        ({"seen_euler_rad": np.zeros((51, 2, 4))}, r"seen_euler_rad has the shape \(51, 2, 4\)"),
        ({"target": np.full((51, 2, 4), np.nan)}, "time and target must be finite"),
        ({"time_s": np.append(np.arange(50.0), np.inf)}, "time and target must be finite"),
        ({"time_s": np.repeat(np.arange(26.0), 2)[:51]}, "time must rise"),
    ],
)
def test_arrays_that_do_not_fit_together_are_refused(
    change: dict[str, np.ndarray], message: str, trace: SensedTrace, tmp_path: Path
) -> None:
    """The message names the file, the array and what is wrong."""
    path = tmp_path / "bad.npz"
    np.savez(path, **{field.name: getattr(trace, field.name) for field in fields(trace)} | change)
    with pytest.raises(TraceError, match=rf"bad\.npz: is no trace: {message}"):
        read_npz(path)


def test_a_lost_flight_and_integers_are_a_trace(trace: SensedTrace, tmp_path: Path) -> None:
    """NaN in the motion is a lost flight, and arrays of integers are numbers."""
    position_m = np.full_like(trace.position_m, np.nan)
    write_npz(
        replace(trace, position_m=position_m, target=np.zeros((51, 2, 4), np.int64)), tmp_path / "lost.npz"
    )
    read = read_npz(tmp_path / "lost.npz")
    assert read.diverged.all()
    assert read.flights == 2


def test_a_flight_that_ends_as_nan_is_lost(trace: SensedTrace) -> None:
    """One axis of the last sample decides, flight by flight."""
    for axis in range(3):
        position_m = trace.position_m.copy()
        position_m[-1, 1, axis] = np.nan
        assert replace(trace, position_m=position_m).diverged.tolist() == [False, True]
    assert trace.diverged.tolist() == [False, False]


def test_a_trace_without_sensors_has_no_estimates(trace: SensedTrace, tmp_path: Path) -> None:
    """Its NPZ reads back as a plain trace, and its CSV ends with the status."""
    plain = fly(Flight(Circle(1.0, 0.5), duration_s=0.05), PdController())
    write_npz(plain, tmp_path / "plain.npz")
    read = read_npz(tmp_path / "plain.npz")
    assert read.same_bits(plain)
    assert not read.same_bits(trace)
    arrays = {field.name: getattr(trace, field.name) for field in fields(Trace)}
    assert not Trace(**arrays).same_bits(trace)
    write_csv(plain, tmp_path / "plain.csv")
    assert (tmp_path / "plain.csv").read_text().splitlines()[0] == ",".join(CSV_COLUMNS)


def test_a_course_with_a_height_has_two_columns_more(tmp_path: Path) -> None:
    """Height and climb of the target follow its horizontal velocity, in NPZ and CSV."""
    both = Trajectories((CURVES["helix"](1.0, 1.0), Circle(1.0, 0.5)))
    flown = fly(Flight(both, duration_s=0.05, flights=2), PdController())
    assert flown.spatial
    assert flown.target.shape == (6, 2, 6)
    write_npz(flown, tmp_path / "space.npz")
    assert read_npz(tmp_path / "space.npz").same_bits(flown)
    write_csv(flown, tmp_path / "space.csv")
    header, *rows = (tmp_path / "space.csv").read_text().splitlines()
    names = header.split(",")
    assert names == [*CSV_COLUMNS[:14], *HEIGHT_COLUMNS, *CSV_COLUMNS[14:]]
    assert float(rows[-1].split(",")[14]) == flown.target_height_m[-1, 0] > HOVER_HEIGHT_M
    alone = fly(Flight(Circle(1.0, 0.5), duration_s=0.05), PdController())
    assert (alone.spatial, alone.target_height_m.tolist()) == (False, [[HOVER_HEIGHT_M]] * 6)
    assert alone.digest() == flown.digest(1)
    assert flown.digest(0) != flown.digest(1)


@pytest.mark.parametrize("name", [field.name for field in fields(SensedTrace)])
def test_one_changed_bit_of_an_array_changes_the_digest(name: str, trace: SensedTrace) -> None:
    """The digest covers times and every array of its flight, and nothing of the other."""
    values = getattr(trace, name).copy()
    values.view(np.uint64)[(-1,) * values.ndim] ^= np.uint64(1)
    changed = replace(trace, **{name: values})
    assert changed.digest(1) != trace.digest(1)
    assert (changed.digest(0) == trace.digest(0)) == (name != "time_s")
    assert not changed.same_bits(trace)
    assert trace.digest() == trace.digest(0)
