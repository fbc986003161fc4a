"""Readers: CSV in three dialects, ULog, and a message for whatever is no log."""

import os
from pathlib import Path

import numpy as np
import pytest

from mambo_sil.errors import LogError
from mambo_sil.model.identify.columns import KNOWN, parse_columns
from mambo_sil.model.identify.csv_log import LARGEST_FILE_BYTES, read_csv
from mambo_sil.model.identify.identify import identify, read_logs
from mambo_sil.model.identify.signals import DEGREE, FlightLog
from tests.support.logs import Flown, Truth, crazyflie_columns, fly, log_of, ulog, write_log

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

FLOWN = fly(Truth(), Flown(duration_s=20.0), 1)[0]
REQUIRED = "time_s,roll_command_rad,pitch_command_rad,roll_rad,pitch_rad"


def read(path: Path, columns: str = "") -> FlightLog:
    """Read one CSV file."""
    return read_csv(path, parse_columns(columns))


def demand_same(log: FlightLog, within: float = 1e-7) -> None:
    """Demand the signals of `FLOWN`."""
    for name, signal in log_of(FLOWN).signals.items():
        np.testing.assert_allclose(log.signals[name].value, signal.value, rtol=0, atol=within)


def faults_of(path: Path, text: str | bytes, columns: str = "") -> tuple[str, ...]:
    """Write a file, and return the faults that reading it raises, without the file's name."""
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(LogError) as raised:
        read(Path(path.name), columns)
    return tuple(fault.removeprefix(f"{path.name}: ") for fault in raised.value.faults)


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_the_documented_header_is_read(delimiter: str, tmp_path: Path) -> None:
    """Separated by commas, semicolons or tabs, with a byte order mark, columns in any order, blank lines."""
    path = write_log(dict(reversed(FLOWN.items())), tmp_path / "log.csv")
    path.write_text("\ufeff" + path.read_text("utf-8").replace(",", delimiter) + "\n\n", "utf-8")
    demand_same(read(path))


def test_the_log_of_the_crazyflie_client_is_read(tmp_path: Path) -> None:
    """Degrees, ms, y and yaw with the other sign; a row with one block only has empty cells."""
    path = write_log(crazyflie_columns(FLOWN), tmp_path / "log.csv")
    log = read(path)
    demand_same(log, 1e-6)
    assert log.signals["roll_rad"].column == "deg*stateEstimate.roll"
    lines = path.read_text("utf-8").splitlines()
    lines[5] = lines[5].rpartition(",")[0]
    lines[7] = lines[7].split(",")[0] + "," * 9
    path.write_text("\n".join(lines), "utf-8")
    sparse = read(Path("log.csv"))
    assert len(sparse.signals["vy_m_s"].value) == len(FLOWN["time_s"]) - 2
    assert len(sparse.signals["roll_rad"].value) == len(FLOWN["time_s"]) - 2
    names = ("controller.roll", "controller.pitch", "stateEstimate.roll", "stateEstimate.pitch")
    assert sparse.remarks == (
        "log.csv: 1 rows with fewer cells than the header are left out, the first in line 6",
        *(f"log.csv: 1 of 1999 rows have no {name}" for name in names),
    )


def test_rows_and_cells_that_are_no_samples_are_counted(tmp_path: Path) -> None:
    """A lost cell moves the others to the left, so its row is left out; inf and nan are missing."""
    path = write_log(FLOWN, tmp_path / "log.csv")
    lines = path.read_text("utf-8").splitlines()
    cells = [line.split(",") for line in lines]
    del cells[100][2], cells[101][0]
    cells[200][1], cells[300][3], cells[400][3] = "inf", "nan", "-Infinity"
    path.write_text("\n".join(map(",".join, cells)), "utf-8")
    log = read(Path("log.csv"))
    assert log.remarks[:2] == (
        "log.csv: 2 rows with fewer cells than the header are left out, the first in line 101",
        "log.csv: 3 cells without a finite number are taken as missing, the first in line 201",
    )
    assert len(log.signals["roll_rad"].value) == len(FLOWN["time_s"]) - 4
    whole = log_of(FLOWN).signals["roll_rad"]
    kept = np.isin(np.round(whole.time_s, 6), np.round(log.signals["roll_rad"].time_s, 6))
    np.testing.assert_allclose(log.signals["roll_rad"].value, whole.value[kept], atol=1e-7)


def test_a_bad_file_of_a_pool_is_left_out(tmp_path: Path) -> None:
    """With its fault; but a path without a file is a mistake of the command line."""
    path, broken = write_log(FLOWN, tmp_path / "log.csv"), tmp_path / "broken.csv"
    broken.write_text("no log", "utf-8")
    (log,), left_out = read_logs([broken, path], {})
    assert log.name.endswith("log.csv")
    assert left_out[0].endswith(
        "broken.csv: has no column for time_s (time_s, Timestamp); name it: --columns time_s=COLUMN"
    )
    with pytest.raises(LogError, match="no such file"):
        read_logs([path, tmp_path / "no.csv"], {})


def test_the_estimate_of_a_trace_goes_before_the_truth(tmp_path: Path) -> None:
    """A real drone logs no truth; --columns may name it."""
    both = FLOWN | {"seen_roll_rad": FLOWN["roll_rad"] + 0.1}
    path = write_log(both, tmp_path / "trace.csv")
    assert read(path).signals["roll_rad"].column == "seen_roll_rad"
    demand_same(read(path, "roll_rad=roll_rad"))


def test_columns_may_have_signs_and_factors(tmp_path: Path) -> None:
    """-deg*name, 0.001*name, -name."""
    path = write_log(FLOWN, tmp_path / "log.csv")
    log = read(path, "roll_rad=-deg*pitch_rad, time_s = 2e0*time_s ,y_m=-x_m")
    np.testing.assert_allclose(log.signals["roll_rad"].value, -DEGREE * FLOWN["pitch_rad"], atol=1e-9)
    np.testing.assert_allclose(log.signals["y_m"].value, -FLOWN["x_m"], atol=1e-7)
    np.testing.assert_allclose(log.signals["roll_rad"].time_s, 2.0 * FLOWN["time_s"])
    assert log.signals["roll_rad"].column == "-deg*pitch_rad"


def test_all_faults_of_columns_are_told_at_once() -> None:
    """What is no signal, no column, twice, or has a bad factor."""
    with pytest.raises(LogError) as raised:
        parse_columns("rol_rad=a,roll_rad,pitch_rad=,y_m=a,y_m=b,x_m=rad*x,z_m=0*z,vx_m_s=nan*v")
    faults = raised.value.faults
    assert len(faults) == 7
    assert faults[0] == "--columns rol_rad=a must begin with roll_rad"
    for fault in faults[1:3]:
        assert "must be SIGNAL=COLUMN, as in roll_rad=deg*att.roll" in fault
    assert "names y_m a second time" in faults[3]
    assert "factor rad; it must be deg or a number" in faults[4]
    assert "number other than 0" in faults[5]


def test_all_missing_columns_are_told_at_once(tmp_path: Path) -> None:
    """With the names that would do, those that are there, and how to name another one."""
    faults = faults_of(tmp_path / "a.csv", "t,roll_rad,roll_rad,att.pitch\n0,0,0,0\n", "yaw_rad=psi")
    assert len(faults) == 7
    assert faults[0] == "has no column for time_s (time_s, Timestamp); name it: --columns time_s=COLUMN"
    assert "roll_command_rad" in faults[1]
    assert "controller.pitch" in faults[2]
    assert faults[3] == "has the column roll_rad 2 times"
    assert faults[5] == "has no column psi, which --columns names for yaw_rad"
    assert faults[6] == "has the columns t, roll_rad, roll_rad, att.pitch"


def test_positions_are_no_commanded_angles(tmp_path: Path) -> None:
    """What the Crazyflie logs with controllers other than the PID."""
    header = "Timestamp,ctrltarget.x,stateEstimate.roll,stateEstimate.pitch"
    assert any("only the PID controller" in fault for fault in faults_of(tmp_path / "a.csv", f"{header}\n"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("\n\n\n", "is empty"),
        (b"\xff\xfe\x00\x80", "line 1: is not UTF-8"),
        (f"{REQUIRED}\n0,0,0,0,0\n0.01,a,b,0,0\n", "line 3: roll_command_rad = a must be a number"),
        (f"{REQUIRED}\n0,nan,,0,0\n", "column roll_command_rad holds no number"),
        (f"{REQUIRED}\n" + "".join(f"{10 * n},1,1,1,1\n" for n in range(9)), "a sample every 10 s"),
        (f"{REQUIRED}\n" + "".join(f"{n % 5},1,1,1,1\n" for n in range(9)), "falls from 4 to 0 s"),
        (f"{REQUIRED}\n5,1,1,1,1\n", "has a sample every 0 s"),
        (f"{REQUIRED}\n0,1e999,-inf,1,1\n", "holds no number"),
        (f"{REQUIRED}\n0,\0,0,0,0\n", "must be a number"),
        (b"\0" * 2000, "has no column"),
        (f"{REQUIRED}\n0,0,0,0,0\n0.01,0,0,0,0,0\n", "line 3: has 6 cells, the header 5; delete the line"),
    ],
)
def test_what_is_no_log_is_told(text: str | bytes, words: str, tmp_path: Path) -> None:
    """The line, the column, the rule."""
    assert words in "\n".join(faults_of(tmp_path / "a.csv", text))


def test_many_faults_of_a_file_are_counted(tmp_path: Path) -> None:
    """The first five fields that are no number, and how many more there are."""
    text = f"{REQUIRED}\n" + "0,x,x,x,x\n" * 1000
    faults = faults_of(tmp_path / "a.csv", text)
    assert len(faults) == 6
    assert faults[-1] == "and 3995 more faults of rows and cells"


def test_rare_signals_are_left_out(tmp_path: Path) -> None:
    """A yaw with every twentieth row, which is said."""
    path = write_log(FLOWN, tmp_path / "log.csv")
    lines = [line.split(",") for line in path.read_text("utf-8").splitlines()]
    place = lines[0].index("yaw_rad")
    for number, line in enumerate(lines[1:]):
        line[place] = line[place] if number % 20 == 0 else ""
    path.write_text("\n".join(map(",".join, lines)), "utf-8")
    log = read(Path("log.csv"))
    assert "yaw_rad" not in log.signals
    assert log.remarks == (
        "log.csv: yaw_rad has a sample every 0.2 s by the time time_s: left out, because that is too rare",
    )


def test_a_log_counts_once(tmp_path: Path) -> None:
    """Twice the same would halve the intervals; and a ULog has no columns to name."""
    path = write_log(FLOWN, tmp_path / "log.csv")
    with pytest.raises(LogError, match=r"log.csv: is named twice"):
        read_logs([path, Path("log.csv")], {})
    with pytest.raises(LogError, match="--columns is for CSV files"):
        read_logs([Path("log.ulg")], parse_columns("x_m=x"))


def test_a_file_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    """Missing, a folder, a pipe, too large; all logs' faults at once."""
    huge, pipe = tmp_path / "huge.csv", tmp_path / "pipe.csv"
    with huge.open("wb") as file:
        file.truncate(LARGEST_FILE_BYTES + 1)
    os.mkfifo(pipe)
    with pytest.raises(LogError) as raised:
        read_logs([tmp_path / "no.csv", tmp_path, pipe, huge, tmp_path / "no.ulg"], {})
    words = ("no such file", "is a folder", "pipe or a device", "larger than 100 MB", "cannot be read")
    for fault, word in zip(raised.value.faults, words, strict=True):
        assert word in fault


@pytest.mark.parametrize("quaternion", [False, True])
def test_a_ulog_is_read(quaternion: bool, tmp_path: Path) -> None:
    """With angles or a quaternion as set-point; and the fit is that of the CSV."""
    path = tmp_path / "log.ulg"
    path.write_bytes(ulog(FLOWN, quaternion=quaternion))
    (log,), _ = read_logs([path], {})
    demand_same(log, 1e-6)
    assert log.signals["z_m"].value[0] == -1.0
    found, wanted = identify([log])[0], identify([log_of(FLOWN)])[0]
    assert found.roll.fitted is not None
    assert wanted.roll.fitted is not None
    assert abs(found.roll.fitted.sum_s.value - wanted.roll.fitted.sum_s.value) < 1e-4


def test_what_is_no_ulog_is_told(tmp_path: Path) -> None:
    """Garbage, an empty file, one without the topics, and one cut short."""
    path = tmp_path / "log.ulg"
    whole = ulog({name: values[:600] for name, values in FLOWN.items()}, quaternion=False)
    for content, words in (
        (b"garbage" * 9, "is no ULog"),
        (b"", "is no ULog"),
        (whole[:16], "has no vehicle_attitude_setpoint"),
    ):
        path.write_bytes(content)
        with pytest.raises(LogError, match=words):
            read_logs([path], {})
    path.write_bytes(whole[: len(whole) // 2 + 1])
    (log,), _ = read_logs([path], {})
    assert len(log.signals["roll_rad"].value) < 400


def test_every_signal_has_the_documented_column() -> None:
    """The header that the documentation names, and trace.csv has."""
    for signal, known in KNOWN.items():
        assert signal in [column.name for column in known if column.factor == 1.0]
