"""Trajectories: shapes, velocities, rest before t = 0, and waypoint files."""

import os
import re
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_nmpc import curves
from mambo_sil.errors import TrajectoryError
from mambo_sil.flight.height_profiles import (
    HOVER_HEIGHT_M,
    Climb,
    HeightProfile,
    Swing,
    TakeOffAndLanding,
    UpAndDown,
    helix_climb,
)
from mambo_sil.flight.names import CURVE_NAMES, IN_SPACE, SIZED, TIMED, CurveName
from mambo_sil.flight.trajectories import CURVES as CURVES_BY_NAME
from mambo_sil.flight.trajectories import (
    Bernoulli,
    Circle,
    Gerono,
    Hover,
    InSpace,
    Lissajous,
    PositionStep,
    Trajectories,
    Trajectory,
    Waypoints,
    is_spatial,
    vertical_of,
)

CURVES: list[Trajectory] = [
    Bernoulli(2.0, 0.5),
    Gerono(1.5, 0.25),
    Lissajous(1.0, 0.7),
    Circle(0.8, 1.1),
    Waypoints(((0.0, 0.0, 0.0), (2.0, 1.0, -1.0), (5.0, 1.0, 3.0), (9.0, -2.0, 0.5))),
]

AWAY = Waypoints(((-10.0, 1.0, -0.5), (30.0, 2.0, -2.0)))
"""It begins before t = 0, and is away from both axes."""

ALL: list[Trajectory] = [*CURVES, Hover(), PositionStep(1.0, -0.5), AWAY]

TIMES_S = np.arange(0.005, 20.0, 0.0101)


@pytest.mark.parametrize("trajectory", CURVES, ids=lambda each: type(each).__name__)
def test_velocity_is_the_derivative_of_the_position(trajectory: Trajectory) -> None:
    """Analytic velocities agree with central differences of the positions."""
    half_s = 1e-6
    ahead, behind = trajectory.target(TIMES_S + half_s), trajectory.target(TIMES_S - half_s)
    differences = (ahead[:, :2] - behind[:, :2]) / (2.0 * half_s)
    np.testing.assert_allclose(trajectory.target(TIMES_S)[:, 2:], differences, atol=1e-8)


@pytest.mark.parametrize("trajectory", ALL, ids=lambda each: type(each).__name__)
def test_acceleration_is_the_derivative_of_the_velocity(trajectory: Trajectory) -> None:
    """Analytic accelerations agree with central differences of the velocities."""
    half_s = 1e-6
    ahead, behind = trajectory.target(TIMES_S + half_s), trajectory.target(TIMES_S - half_s)
    differences = (ahead[:, 2:] - behind[:, 2:]) / (2.0 * half_s)
    np.testing.assert_allclose(trajectory.acceleration(TIMES_S), differences, atol=1e-8)


@pytest.mark.parametrize("trajectory", ALL, ids=lambda each: type(each).__name__)
def test_accelerations_have_the_shape_of_the_times_and_begin_at_the_start(trajectory: Trajectory) -> None:
    """One time gives (2,), k times (k, 2), n trajectories (k, n, 2); before t = 0 all are 0."""
    many = trajectory.acceleration(TIMES_S)
    assert many.shape == (len(TIMES_S), 2)
    np.testing.assert_allclose(trajectory.acceleration(float(TIMES_S[700])), many[700], rtol=1e-14)
    np.testing.assert_array_equal(Trajectories((Hover(), trajectory)).acceleration(TIMES_S)[:, 1], many)
    np.testing.assert_array_equal(trajectory.acceleration(np.array([-5.0, -0.01])), 0.0)


@pytest.mark.parametrize("trajectory", ALL, ids=lambda each: type(each).__name__)
def test_target_rests_on_the_first_point_before_the_start(trajectory: Trajectory) -> None:
    """Before t = 0 the position is that at t = 0 and the velocity is 0."""
    before = trajectory.target(np.array([-5.0, -0.01]))
    np.testing.assert_array_equal(before[:, :2], np.tile(trajectory.target(0.0)[:2], (2, 1)))
    np.testing.assert_array_equal(before[:, 2:], 0.0)


@pytest.mark.parametrize("trajectory", ALL, ids=lambda each: type(each).__name__)
def test_one_time_gives_the_row_of_many(trajectory: Trajectory) -> None:
    """A single time returns (4,), an array of times (k, 4) with the same rows."""
    many = trajectory.target(TIMES_S)
    assert many.shape == (len(TIMES_S), 4)
    assert trajectory.target(0.5).shape == (4,)
    np.testing.assert_allclose(trajectory.target(float(TIMES_S[700])), many[700], rtol=1e-14)


def test_bernoulli_is_the_lemniscate_of_its_half_width() -> None:
    """(x^2 + y^2)^2 = a^2 (x^2 - y^2) with extremes x = +/- a; it starts at the origin towards +x."""
    x, y, _, _ = Bernoulli(2.0, 0.5).target(TIMES_S).T
    np.testing.assert_allclose((x**2 + y**2) ** 2, 4.0 * (x**2 - y**2), atol=1e-12)
    assert (x.max(), x.min()) == (pytest.approx(2.0, abs=1e-4), pytest.approx(-2.0, abs=1e-4))
    np.testing.assert_allclose(Bernoulli(2.0, 0.5).target(0.0), [0.0, 0.0, 0.5, 0.5])
    np.testing.assert_allclose(Bernoulli(2.0, 0.5).target(np.pi)[:2], [2.0, 0.0], atol=1e-12)


def test_gerono_is_the_lemniscate_of_its_half_width() -> None:
    """x^4 = a^2 (x^2 - y^2); the curve turns to +y first, and reaches x = a after a quarter of its period."""
    x, y, _, _ = Gerono(1.5, 0.25).target(TIMES_S).T
    np.testing.assert_allclose(x**4, 1.5**2 * (x**2 - y**2), atol=1e-12)
    np.testing.assert_allclose(y, x * np.cos(0.25 * TIMES_S), atol=1e-12)
    np.testing.assert_allclose(Gerono(1.5, 0.25).target(2.0 * np.pi)[:2], [1.5, 0.0], atol=1e-12)


def test_lissajous_is_as_high_as_it_is_wide() -> None:
    """The curve is x = a sin(w t), y = a sin(2 w t)."""
    x, y, _, _ = Lissajous(1.0, 0.7).target(TIMES_S).T
    np.testing.assert_allclose(x, np.sin(0.7 * TIMES_S), rtol=1e-15)
    np.testing.assert_allclose(y, np.sin(1.4 * TIMES_S), rtol=1e-15)


def test_circle_keeps_its_radius_and_its_speed() -> None:
    """The speed is radius times rate; the circle starts at (radius, 0) towards +y."""
    x, y, vx, vy = Circle(0.8, 1.1).target(TIMES_S).T
    np.testing.assert_allclose(np.hypot(x, y), 0.8, rtol=1e-14)
    np.testing.assert_allclose(np.hypot(vx, vy), 0.88, rtol=1e-14)
    np.testing.assert_allclose(Circle(0.8, 1.1).target(0.0), [0.8, 0.0, 0.0, 0.88], rtol=1e-15)


def test_step_jumps_at_one_second() -> None:
    """The target is the origin before t = 1 s and the other point from then on, always at rest."""
    targets = PositionStep(1.0, -0.5).target(np.array([0.0, 0.99, 1.0, 50.0]))
    np.testing.assert_array_equal(targets[:2], 0.0)
    np.testing.assert_array_equal(targets[2:], [[1.0, -0.5, 0.0, 0.0]] * 2)


def test_curves_have_names_sizes_and_rates() -> None:
    """Hovering has neither size nor rate; a step goes along x, whatever the rate."""
    assert {name: curve(2.0, 0.5) for name, curve in CURVES_BY_NAME.items()} == {
        "bernoulli": Bernoulli(2.0, 0.5),
        "gerono": Gerono(2.0, 0.5),
        "lissajous": Lissajous(2.0, 0.5),
        "circle": Circle(2.0, 0.5),
        "hover": Hover(),
        "step": PositionStep(2.0, 0.0),
        "tilted-circle": InSpace(Circle(2.0, 0.5), Swing(0.3, 0.5)),
        "helix": InSpace(Circle(2.0, 0.5), Climb(0.5 * 0.5 / (2.0 * np.pi))),
        "swinging-eight": InSpace(Bernoulli(2.0, 0.5), Swing(0.3, 1.0)),
        "height-step": InSpace(Hover(), UpAndDown(2.0)),
        "take-off-and-landing": InSpace(Hover(), TakeOffAndLanding(2.0)),
    }
    assert helix_climb(-0.5, 0.5) == helix_climb(0.5, 0.5)


def test_every_curve_has_its_name_its_class_and_its_row() -> None:
    """The command line has its name, Python its class, and the page of the plant a row of its table."""
    assert tuple(CURVES_BY_NAME) == CURVE_NAMES
    made = (curve(1.0, 1.0) for curve in CURVES_BY_NAME.values())
    assert {type(getattr(one, "plan", one)).__name__ for one in made} <= set(curves.__all__)
    page = (Path(__file__).parents[2] / "docs" / "explanation" / "plant.md").read_text("utf-8")
    table = page.partition("\n| curve | course | height |\n")[2].partition("\n\n")[0]
    named = [name for row in table.splitlines() for name in re.findall("`([^`]+)`", row.split("|")[1])]
    assert sorted(named) == sorted(CURVE_NAMES)


def test_hover_stays_at_the_origin() -> None:
    """Position and velocity are zero at all times."""
    np.testing.assert_array_equal(Hover().target(TIMES_S), np.zeros((len(TIMES_S), 4)))


def test_waypoints_are_joined_by_straight_lines_and_held() -> None:
    """The target moves at constant speed between waypoints and rests before the first and after the last."""
    waypoints = Waypoints(((1.0, 0.0, 2.0), (3.0, 4.0, 2.0), (4.0, 4.0, 1.0)))
    targets = waypoints.target(np.array([0.5, 1.0, 2.0, 3.5, 4.0, 60.0]))
    expected = [
        [0.0, 2.0, 0.0, 0.0],
        [0.0, 2.0, 2.0, 0.0],
        [2.0, 2.0, 2.0, 0.0],
        [4.0, 1.5, 0.0, -1.0],
        [4.0, 1.0, 0.0, 0.0],
        [4.0, 1.0, 0.0, 0.0],
    ]
    np.testing.assert_allclose(targets, expected, rtol=1e-15)


def test_a_target_of_many_waypoints_is_as_cheap_as_of_few() -> None:
    """A pilot asks for hundreds a second: the points are not copied for each."""
    waypoints = Waypoints(tuple((0.01 * number, 0.0, 0.0) for number in range(5000)))
    waypoints.target(0.0)
    tracemalloc.start()
    waypoints.target(20.0)
    most_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most_bytes < 5000


def test_waypoints_are_read_from_a_file_by_column_name(tmp_path: Path) -> None:
    """Columns may be in any order, with spaces in the header; other columns are ignored."""
    path = tmp_path / "route.csv"
    path.write_text("y_m,note, time_s ,x_m\n0.5,start,0,1\n-0.5,end,2.5,1e-1\n", encoding="utf-8")
    assert Waypoints.read(path) == Waypoints(((0.0, 1.0, 0.5), (2.5, 0.1, -0.5)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: column time_s is missing; the header must name time_s,x_m,y_m"),
        ("time_s,x_m\n0,1\n", "line 1: column y_m is missing"),
        ("time_s,x_m,y_m,x_m\n0,1,2,3\n", "line 1: column x_m appears more than once"),
        ("time_s,x_m,y_m\n", "holds no waypoint"),
        ("time_s,x_m,y_m\n0,0,0\n\n1,two,0\n", "line 4: x_m = two must be a number"),
        ("time_s,x_m,y_m\n0,0,0\n1,2\n", "line 3: y_m is missing"),
        ("time_s,x_m,y_m\n0,,0\n", "line 2: x_m is missing"),
        ("time_s,x_m,y_m\n0,0,0,5\n", "line 2: has more fields than the 3 of the header"),
        ('time_s,x_m,y_m\n0,0,"0\n', "line 2: is not CSV"),
        ("time_s,x_m,y_m\n0,0,0\n1,nan,0\n", r"line 3: x_m = nan must be a finite number"),
        ("time_s,x_m,y_m\n0,0,1e5\n", r"line 2: y_m = 100000.0 must be .* of magnitude 10000 or less"),
        ("time_s,x_m,y_m\n0,0,0\n1,0,0\n1,2,0\n", "line 4: time_s = 1.0 must be later than the 1.0 before"),
        ("time_s,x_m,y_m\n2,0,0\n1,2,0\n", "line 3: time_s = 1.0 must be later than the 2.0 before"),
    ],
)
def test_bad_waypoint_file_is_refused_with_file_line_and_rule(
    tmp_path: Path, text: str, message: str
) -> None:
    """The reader rejects waypoints that cannot be flown; its message names file, line and rule."""
    path = tmp_path / "route.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(TrajectoryError, match=rf"^[^:]*route\.csv: {message}"):
        Waypoints.read(path)


def test_waypoints_at_their_limits_are_accepted_and_beyond_them_refused() -> None:
    """Times up to 1e6 s, coordinates up to 10 km on either side, legs of 1 us and more."""
    corner = (1e6, 1e4, -1e4)
    assert Waypoints((corner,)).points == (corner,)
    for column in range(3):
        beyond = tuple(value * (1.0 + 1e-15 * (column == place)) for place, value in enumerate(corner))
        with pytest.raises(TrajectoryError, match=r"point 1: .* must be a finite number"):
            Waypoints(((beyond[0], beyond[1], beyond[2]),))
    assert len(Waypoints(((0.0, 0.0, 0.0), (1e-6, 1.0, 1.0))).points) == 2
    with pytest.raises(
        TrajectoryError, match=r"point 2: time_s = 9e-07 must be later than the 0\.0 before it"
    ):
        Waypoints(((0.0, 0.0, 0.0), (0.9e-6, 1.0, 1.0)))


def test_waypoint_file_of_ten_megabytes_is_read(tmp_path: Path) -> None:
    """The limit of 10 MB is inclusive."""
    path = tmp_path / "long.csv"
    content = b"time_s,x_m,y_m\n0,1,2\n"
    path.write_bytes(content + b"\n" * (10_000_000 - len(content)))
    assert Waypoints.read(path).points == ((0.0, 1.0, 2.0),)
    path.write_bytes(path.read_bytes() + b"\n")
    with pytest.raises(TrajectoryError, match="larger than 10 MB"):
        Waypoints.read(path)


def test_unreadable_waypoint_file_is_refused(tmp_path: Path) -> None:
    """A file that is missing, not text or above 10 MB raises `TrajectoryError`, which names it once."""
    with pytest.raises(TrajectoryError, match=r"absent\.csv: cannot be read: No such file or directory$"):
        Waypoints.read(tmp_path / "absent.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(TrajectoryError, match=r"binary\.csv: is not UTF-8"):
        Waypoints.read(tmp_path / "binary.csv")
    (tmp_path / "zero.csv").touch()
    os.truncate(tmp_path / "zero.csv", 2**40)
    with pytest.raises(TrajectoryError, match=r"zero\.csv: is larger than 10 MB"):
        Waypoints.read(tmp_path / "zero.csv")


def test_flights_may_follow_different_trajectories() -> None:
    """`Trajectories` returns the target of each flight's own trajectory."""
    both = Trajectories((Bernoulli(2.0, 0.5), Hover(), Circle(1.0, 1.0)))
    assert both.target(1.0).shape == (3, 4)
    targets = both.target(TIMES_S)
    assert targets.shape == (len(TIMES_S), 3, 4)
    for flight, each in enumerate(both.each):
        np.testing.assert_array_equal(targets[:, flight], each.target(TIMES_S))


PROFILES: list[HeightProfile] = [Swing(0.3, 1.5), Climb(0.4), UpAndDown(-0.5), TakeOffAndLanding(1.2)]


@pytest.mark.parametrize("profile", PROFILES, ids=lambda each: type(each).__name__)
def test_climb_and_acceleration_are_the_derivatives_of_the_height(profile: HeightProfile) -> None:
    """Analytic values agree with central differences; before t = 0 the target rests at the first height."""
    half_s = 1e-6
    rates = (profile.vertical(TIMES_S + half_s) - profile.vertical(TIMES_S - half_s)) / (2.0 * half_s)
    np.testing.assert_allclose(profile.vertical(TIMES_S)[:, 1:], rates[:, :2], atol=1e-8)
    before = profile.vertical(np.array([-5.0, -0.01]))
    np.testing.assert_array_equal(before[:, 0], profile.vertical(0.0)[0])
    np.testing.assert_array_equal(before[:, 1:], 0.0)
    assert profile.vertical(0.5).shape == (3,)
    np.testing.assert_allclose(profile.vertical(float(TIMES_S[700])), profile.vertical(TIMES_S)[700])


def test_heights_go_where_their_names_say() -> None:
    """A swing of 0.3 m, a climb, up at 1 s and down at 6 s, from the ground and back to it, at rest."""
    swing, climb, step, landing = (
        profile.vertical(np.array([0.0, 0.9, 1.0, 3.0, 5.9, 6.0, 8.0, 9.0])) for profile in PROFILES
    )
    assert np.abs(Swing(0.3, 1.5).vertical(TIMES_S)[:, 0] - HOVER_HEIGHT_M).max() == pytest.approx(0.3, 1e-4)
    assert swing[0].tolist() == [HOVER_HEIGHT_M, pytest.approx(0.45), 0.0]
    np.testing.assert_allclose(climb[3], [HOVER_HEIGHT_M + 1.2, 0.4, 0.0])
    np.testing.assert_allclose(step[:, 0], HOVER_HEIGHT_M - 0.5 * np.array([0, 0, 1, 1, 1, 0, 0, 0]))
    np.testing.assert_allclose(landing[:, 0], [0, 0, 0, 1.2, 1.2, 1.2, 0, 0], atol=1e-15)
    np.testing.assert_allclose(landing[:, 1:], 0.0, atol=1e-12)


@pytest.mark.parametrize("name", CURVES_BY_NAME)
def test_lists_of_names_say_what_a_curve_has(name: CurveName) -> None:
    """A height, a size, an angular rate."""

    def flown(size_m: float, rate_rad_s: float) -> list[Any]:
        curve = CURVES_BY_NAME[name](size_m, rate_rad_s)
        return [curve.target(TIMES_S), vertical_of(curve, TIMES_S)]

    def differs(size_m: float, rate_rad_s: float) -> bool:
        pairs = zip(flown(1.0, 1.0), flown(size_m, rate_rad_s), strict=True)
        return not all(np.array_equal(one, other) for one, other in pairs)

    assert is_spatial(CURVES_BY_NAME[name](1.0, 1.0)) is (name in IN_SPACE)
    assert differs(2.0, 1.0) is (name in SIZED)
    assert differs(1.0, 2.0) is (name in TIMED)


def test_level_and_spatial_trajectories_fly_together() -> None:
    """A level one has the hover height; an attribute that only looks like a height makes none spatial."""
    space = CURVES_BY_NAME["helix"](1.0, 1.0)
    both = Trajectories((Lissajous(1.0, 0.5), space))
    assert [is_spatial(one) for one in (Lissajous(1.0, 0.5), space, both, Trajectories((Hover(),)))] == [
        False,
        True,
        True,
        False,
    ]
    heights = vertical_of(both, TIMES_S)
    assert heights.shape == (len(TIMES_S), 2, 3)
    np.testing.assert_array_equal(heights[:, 0], np.tile([HOVER_HEIGHT_M, 0.0, 0.0], (len(TIMES_S), 1)))
    np.testing.assert_array_equal(heights[:, 1], vertical_of(space, TIMES_S))
    np.testing.assert_array_equal(space.target(TIMES_S), Circle(1.0, 1.0).target(TIMES_S))
    np.testing.assert_array_equal(space.acceleration(TIMES_S), Circle(1.0, 1.0).acceleration(TIMES_S))
