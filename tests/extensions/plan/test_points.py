"""Points of plans: files that are read, and what is said of those that cannot be."""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_extensions.plan.points import PlanPoint, check_points, read_points
from mambo_sil.errors import TrajectoryError


def written(tmp_path: Path, *lines: str, name: str = "points.csv") -> Path:
    """Return a file of lines."""
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


def test_all_columns_are_read_and_empty_fields_left_out(tmp_path: Path) -> None:
    """A gate, a speed with a direction, a heading, and points with nothing but a place."""
    path = written(
        tmp_path,
        "x,y,z,width,normal_x,normal_y,normal_z,speed,direction_x,direction_y,direction_z,yaw,tolerance",
        "0,0,1",
        "1,2,1.5,0.4,1,0,0,,,,,,",
        "2,2,1.5,,,,,1.2,0,1,0,0.5,0.2",
    )
    first, gate, last = read_points(path)
    assert first == PlanPoint(0, 0, 1)
    assert gate == PlanPoint(1, 2, 1.5, normal=(1, 0, 0), width_m=0.4)
    assert gate.reach_m == 0.2
    assert last == PlanPoint(2, 2, 1.5, 0.2, speed_m_s=1.2, direction=(0, 1, 0), yaw_rad=0.5)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (("x,y", "0,0"), "line 1: column z is missing; the header may name x,y,z,yaw,time"),
        (("x,y,z,colour", "0,0,1,2"), "line 1: column colour is none of x,y,z"),
        (("x,y,z", "0,0,1", "1,0,one"), "line 3: z = 'one' must be a number"),
        (("x,y,z", "0,0,1", "1,,1"), "line 3: y is missing"),
        (("x,y,z", "0,0,1", "1,0,nan"), "line 3: z = nan must lie in"),
        (("x,y,z", "0,0,1"), "holds 1 points; 2 to 1000 are needed"),
        (("x,y,z", "0,0,1", "0,0,1.001"), "line 3: must be 0.01 m or more from the point before it"),
        (("x,y,z,tolerance", "0,0,1,", "1,0,1,0"), "line 3: tolerance = 0 must lie in 0.001"),
        (("x,y,z,width", "0,0,1,", "1,0,1,0.4"), "line 3: width without normal_x,normal_y,normal_z"),
        (("x,y,z,time", "0,0,1,0", "1,0,1,"), "line 3: time is missing: give all points a time, or none"),
        (("x,y,z,time", "0,0,1,1", "1,0,1,1"), "line 3: time = 1 must be later than the 1 before it"),
        (("x,y,z,direction_x", "0,0,1,", "1,0,1,1"), "line 3: direction_y is missing"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, lines: tuple[str, ...], message: str) -> None:
    """File, line, column and rule."""
    with pytest.raises(TrajectoryError, match=re.escape(message)) as raised:
        read_points(written(tmp_path, *lines))
    assert "points.csv: " in str(raised.value)


def test_points_of_a_program_are_numbered() -> None:
    """Without a file the number of the point stands in the message."""
    with pytest.raises(TrajectoryError, match="point 2: direction must not be 0 along all axes"):
        check_points([PlanPoint(0, 0, 1), PlanPoint(1, 0, 1, direction=(0, 0, 0))])


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"x_m": "0"}, "point 1: x = '0' must be a number"),
        ({"z_m": None}, "point 1: z = None must be a number"),
        ({"tolerance_m": None}, "point 1: tolerance = None must be a number"),
        ({"speed_m_s": True}, "point 1: speed = True must be a number"),
        ({"normal": (1.0, 0.0), "width_m": 0.4}, "point 1: normal must be three numbers"),
        ({"direction": 1.0}, "point 1: direction must be three numbers"),
        ({"direction": ("1", 0.0, 0.0)}, "point 1: direction = '1' must be a number"),
    ],
)
def test_fields_of_another_type_are_refused(fields: dict[str, Any], message: str) -> None:
    """Text, nothing where a number is needed, and vectors of other lengths."""
    point = PlanPoint(**({"x_m": 0.0, "y_m": 0.0, "z_m": 1.0} | fields))
    with pytest.raises(TrajectoryError, match=re.escape(message)):
        check_points([point, PlanPoint(1.0, 0.0, 1.0)])


def test_arrays_are_vectors_and_their_numbers_sizes() -> None:
    """A direction as an array, a speed from one."""
    way: Any = np.array([1.0, 0.0, 0.0])
    check_points([PlanPoint(0.0, 0.0, 1.0, speed_m_s=way[0], direction=way), PlanPoint(1.0, 0.0, 1.0)])


def test_a_closed_lap_that_repeats_its_first_point_is_refused(tmp_path: Path) -> None:
    """An open course may end where it began."""
    path = written(tmp_path, "x,y,z", "0,0,1", "1,0,1", "0,0,1")
    assert len(read_points(path)) == 3
    with pytest.raises(TrajectoryError, match=r"line 4: is the first point again.*leave it out"):
        read_points(path, closed=True)


def mission(
    *places: tuple[float | None, float | None, float], frame: int = 3, radius: float | None = 0
) -> str:
    """Return a mission of QGroundControl with a take-off, waypoints and a return."""
    items: list[dict[str, object]] = [
        {"command": 22 if k == 0 else 16, "frame": frame, "params": [0, radius, 0, None, *place]}
        for k, place in enumerate(places)
    ]
    items.append({"command": 20, "frame": 2, "params": [0, 0, 0, 0, 0, 0, 0]})
    return json.dumps({"fileType": "Plan", "mission": {"items": items}})


def test_a_mission_is_metres_north_and_west_of_its_first_place(tmp_path: Path) -> None:
    """A minute of latitude is a nautical mile; of longitude it is less by the cosine of the latitude."""
    minute = 1.0 / 60.0
    text = mission((60.0, 10.0, 5.0), (60.0 + minute, 10.0, 6.0), (60.0, 10.0 + minute, 7.0), radius=2.5)
    first, north, east = read_points(written(tmp_path, text, name="mission.plan"))
    mile_m = 2.0 * math.pi * 6_371_000.0 / 360.0 / 60.0
    assert (first.position_m, first.tolerance_m) == ((0.0, 0.0, 5.0), 1.0)
    assert north.position_m == pytest.approx((mile_m, 0.0, 6.0), abs=0.1)
    assert east.position_m == pytest.approx((0.0, -mile_m / 2.0, 7.0), abs=0.1)
    assert north.tolerance_m == 2.5


@pytest.mark.parametrize("nowhere", [0.0, None])
def test_a_take_off_without_a_place_is_left_out(tmp_path: Path, nowhere: float | None) -> None:
    """The first waypoint is then the origin."""
    text = mission((nowhere, nowhere, 5.0), (60.0, 10.0, 6.0), (60.001, 10.0, 7.0))
    first, second = read_points(written(tmp_path, text, name="mission.plan"))
    assert first.position_m == (0.0, 0.0, 6.0)
    assert second.position_m == pytest.approx((111.2, 0.0, 7.0), abs=0.1)


def test_a_fault_of_a_mission_is_named_by_the_item_of_its_file(tmp_path: Path) -> None:
    """Items without a place count: the second waypoint stands behind a change of speed."""
    document = json.loads(mission((60.0, 10.0, 5.0), (60.0, 10.0, 5.0)))
    document["mission"]["items"].insert(1, {"command": 178, "frame": 2, "params": [1, 5, -1, 0, 0, 0, 0]})
    with pytest.raises(TrajectoryError, match=r"item 3: must be 0\.01 m or more from"):
        read_points(written(tmp_path, json.dumps(document), name="mission.plan"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "cannot be read as JSON"),
        ("{}", "has no mission.items"),
        ('{"mission": {"items": []}}', "has no waypoint in mission.items"),
        (mission((60, 10, 5), frame=0), "item 1: frame = 0 must be one of (3, 6)"),
        (mission((95, 10, 5)), "item 1: latitude and longitude must lie in"),
    ],
)
def test_other_missions_are_refused(tmp_path: Path, text: str, message: str) -> None:
    """Broken JSON, other documents, heights above the sea, places off the Earth."""
    with pytest.raises(TrajectoryError, match=re.escape(message)):
        read_points(written(tmp_path, text, name="mission.plan"))
