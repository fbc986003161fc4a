"""Logs of autopilots that lack a field: refused in one sentence that names the file and the field."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from mambo_sil.errors import LogError
from mambo_sil.model.identify.identify import read_logs
from tests.support.logs import Flown, Truth, dataflash, fly, ulog

FLOWN = fly(Truth(), Flown(duration_s=2.0), 1)[0]
WHOLE = FLOWN | {
    "thrust_command": np.full(len(FLOWN["time_s"]), 0.4),
    "seen_x_m": FLOWN["x_m"],
    "seen_y_m": FLOWN["y_m"],
}
ULOG = ulog(WHOLE, quaternion=True, target=("x_m", "y_m", "vx_m_s", "vy_m_s"), hover=0.4)
OPTIONAL = {
    *(("vehicle_attitude_setpoint", "thrust_body"), ("vehicle_visual_odometry", "pose_frame")),
    *(("trajectory_setpoint", name) for name in ("position", "velocity", "acceleration")),
}
"""Fields that not every version of PX4 has, and that `identify` does not need."""


def without_a_field() -> Iterator[tuple[str, str, bytes]]:
    """Yield topic, field, and a ULog in which the field has another name."""
    for found in re.finditer(rb"(vehicle|trajectory|hover)_\w*:(?:[\w\[\]]+ \w+;)+", ULOG):
        topic, _, fields = found[0].partition(b":")
        for field in re.findall(rb" (\w+);", fields):
            lost = found[0].replace(b" " + field + b";", b" " + field[:-1] + b"Q;")
            yield topic.decode(), field.decode(), ULOG.replace(found[0], lost)


def refusal(path: Path, content: bytes) -> str | None:
    """Return why a log is refused, or None."""
    path.write_bytes(content)
    try:
        read_logs([path], {})
    except LogError as error:
        return " | ".join(error.faults)
    return None


def test_a_ulog_without_a_field_is_refused_in_one_sentence(tmp_path: Path) -> None:
    """Each field of each topic that is read, time stamps too; only those of other versions may be missing."""
    seen = set()
    for topic, field, content in without_a_field():
        seen.add(topic)
        said = refusal(tmp_path / "log.ulg", content)
        if (topic, field) in OPTIONAL:
            assert said is None, said
        else:
            assert said is not None, (topic, field)
            assert re.search(rf"log\.ulg: {topic} has no field {field}(\[0\])?; [^|]*$", said), said
    assert len(seen) == 6


@pytest.mark.parametrize(
    ("kind", "labels"),
    [
        ("ANG", "TimeUS,DesRoll,Roll,DesPitch,Pitch,Yaw"),
        ("XKF1", "TimeUS,C,VN,VE,PN,PE,PD"),
        ("GUIA", "TimeUS,Type,Roll,Pitch,Yaw,Thrust"),
    ],
)
def test_a_dataflash_log_without_a_field_is_refused_in_one_sentence(
    kind: str, labels: str, tmp_path: Path
) -> None:
    """Each field that is read."""
    content = dataflash(WHOLE)
    unread = {"DesRoll", "DesPitch", "C", "Type"}
    for field in labels.split(","):
        lost = f"{labels},".replace(f",{field},", f",{field[:-1]}q,").removesuffix(",")
        lost = lost.replace("TimeUS", "Timeus") if field == "TimeUS" else lost
        said = refusal(tmp_path / "log.bin", content.replace(labels.encode(), lost.encode()))
        if field in unread:
            assert said is None, said
        else:
            assert said is not None, field
            assert re.search(rf"log\.bin: {kind} has no field {field}; [^|]*$", said), said


def test_a_signal_without_a_number_is_left_out_or_refused(tmp_path: Path) -> None:
    """The height of a ULog is left out with a remark; without measured angles there is no model."""
    nothing = np.full_like(FLOWN["roll_rad"], np.nan)
    path = tmp_path / "log.ulg"
    path.write_bytes(ulog(FLOWN | {"z_m": nothing}, quaternion=True))
    (log,), _ = read_logs([path], {})
    assert "z_m" not in log.signals
    assert any("vehicle_local_position.z holds no number: left out" in said for said in log.remarks)
    said = refusal(path, ulog(FLOWN | {"roll_rad": nothing}, quaternion=True))
    assert said is not None
    assert "vehicle_attitude.q holds no number; roll_rad is needed" in said
