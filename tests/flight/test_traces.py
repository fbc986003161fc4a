"""Traces in NPZ and CSV files."""

import csv
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from mambo_nmpc.sil.controllers.pd import PdController
from mambo_nmpc.sil.errors import TraceError
from mambo_nmpc.sil.flight.loop import Flight, fly
from mambo_nmpc.sil.flight.traces import (
    CSV_COLUMNS,
    SEEN_COLUMNS,
    SensedTrace,
    read_npz,
    write_csv,
    write_npz,
)
from mambo_nmpc.sil.flight.trajectories import Bernoulli, Circle, Trajectories
from mambo_nmpc.sil.sensors.instruments import Sensors


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
    np.testing.assert_array_equal(seen.position_m, trace.seen_position_m)
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


def test_file_that_holds_no_trace_is_refused(tmp_path: Path) -> None:
    """Missing, foreign and incomplete files raise `TraceError`, which names the file."""
    (tmp_path / "text.npz").write_text("time_s,x_m\n", encoding="utf-8")
    np.savez(tmp_path / "other.npz", time_s=np.zeros(3))
    np.save(tmp_path / "array.npy", np.zeros(3))
    for name in ("absent.npz", "text.npz", "other.npz", "array.npy"):
        with pytest.raises(TraceError, match=name):
            read_npz(tmp_path / name)
