"""Whole plans: flown by the drones that judge them, written as pieces, refused in words."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mambo_extensions.plan.course import course_of
from mambo_extensions.plan.heading import headings_of
from mambo_extensions.plan.limits import FlightLimit, figures_of, limits_of
from mambo_extensions.plan.plan_flight import Drones, FlownPlan, Waiting
from mambo_extensions.plan.plan_report import LegSummary, PlanSummary
from mambo_extensions.plan.planning import _missed_words, _Search
from mambo_extensions.plan.plans import Plan
from mambo_extensions.plan.solver import silent
from mambo_nmpc import Controller, PlanPoint, Vehicle, fly, plan
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import ArgumentError, PlanError, TrajectoryError
from mambo_sil.flight.polynomials import COLUMNS, POINT_COLUMNS, Piece, PiecesInSpace, read_course
from tests.support.command import run

POINTS = [(0.0, 0.0, 1.0), (0.8, 0.4, 1.1), (0.6, -0.6, 1.0)]


@pytest.fixture(scope="module")
def made() -> Plan:
    """Return a plan of a Crazyflie, judged by three drawn ones."""
    return plan(POINTS, Vehicle.from_preset("crazyflie"), drones=3)


def test_a_plan_is_flown_by_all_its_drones(made: Plan) -> None:
    """Verdict and figures are those of the flights, and `print` shows them."""
    summary = made.summary
    assert (summary.good, summary.flown, summary.passed) == (True, 4, 4)
    assert summary.largest_miss_m <= 0.1
    assert summary.time_s == pytest.approx(made.curve.duration_s)
    assert f"crazyflie: {summary.time_s:.2f} s through 3 points" in repr(made)


def test_thrust_and_tilt_are_those_of_the_plan(made: Plan) -> None:
    """Those of the run-in before it do not count: a slower plan takes less."""
    slow = plan(POINTS, Vehicle.from_preset("crazyflie"), drones=3, rate=0.3)
    assert slow.summary.largest_thrust_weights < 0.95 * made.summary.largest_thrust_weights
    assert slow.summary.largest_tilt_rad < 0.5 * made.summary.largest_tilt_rad


def test_another_flight_passes_the_points_too(made: Plan) -> None:
    """`fly` with the same settings and other noise, judged by the trace alone."""
    controller = Controller.from_vehicle("crazyflie")
    flown = fly(
        controller,
        Vehicle.from_preset("crazyflie"),
        made.curve,
        duration_s=made.curve.duration_s + 1.0,
        sensors="mocap",
        seeds=(11,),
    )
    path_m = flown.trace.position_m[:, 0] * [1.0, -1.0, -1.0]
    for point in POINTS[1:]:
        assert np.linalg.norm(path_m - point, axis=1).min() < 0.1


def test_the_file_reads_back_to_the_same_course(made: Plan, tmp_path: Path) -> None:
    """`read_course`, which `fly --trajectory` and `pilot` use, gives the curve of the plan."""
    path = tmp_path / "lap.csv"
    path.write_text(made.text, "utf-8")
    read, times_s = read_course(path), np.linspace(0.0, made.curve.duration_s, 50)
    np.testing.assert_array_equal(read.target(times_s), made.curve.target(times_s))
    np.testing.assert_array_equal(read.acceleration(times_s), made.curve.acceleration(times_s))
    assert isinstance(read, PiecesInSpace)
    assert read.points == made.curve.points
    assert [point and point.number for point in read.points] == [None, 2, None, 3]


@pytest.mark.parametrize(("legs", "pieces"), [(15, 30), (16, 16)])
def test_a_leg_has_two_pieces_if_a_crazyflie_holds_them(
    legs: int, pieces: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More than 15 legs have one each."""
    for name in ("first_course", "solve"):
        monkeypatch.setattr(f"mambo_extensions.plan.planning.{name}", lambda course, *_: course)
    points = tuple(PlanPoint(0.3 * k, 0.2 * (k % 2), 1.0) for k in range(legs + 1))
    drones = Drones((), Controller.from_vehicle("crazyflie").settings)
    search = _Search(points, course_of(points, closed=False), drones, 1.0, silent)
    begun = search._begin(0.7, [])
    assert len(begun.duration_s) == pieces
    assert (begun.choice.allowed == 0.7).all()


def test_the_command_writes_pieces_and_a_picture(tmp_path: Path) -> None:
    """Given times, at a rate: the pieces last as long as the times over the rate; `fly` takes the file."""
    points, lap = tmp_path / "points.csv", tmp_path / "lap.csv"
    points.write_text("x,y,z,time\n0,0,1,0\n0.8,0.4,1.1,2\n0.6,-0.6,1,4.5\n", "utf-8")
    arguments = "plan", str(points), "--vehicle", "crazyflie", "--rate", "0.9", "--drones", "2"
    printed, said = run(*arguments, "-o", str(lap))
    assert "crazyflie: 5.00 s through 3 points" in printed
    assert "lap.png" in said
    assert (tmp_path / "lap.png").is_file()
    title = "crazyflie: 5.00 s through 3 points; 3 of 3 drones fly it through all points"
    assert title in (tmp_path / "lap.svg").read_text("utf-8")
    assert len(lap.read_text("utf-8").splitlines()) == 3
    _, refused = run(*arguments, "-o", str(lap), code=2)
    assert "already exists" in refused
    flown = "fly", "crazyflie", "--vehicle", "crazyflie", "--trajectory", str(lap), "--no-pictures"
    assert "passes all 2 points" in run(*flown, "-o", str(tmp_path / "flown"))[0]
    assert json.loads((tmp_path / "flown/summary.json").read_text("utf-8"))["duration_s"] == 5.4
    pushed, _ = run(*flown, "--push", "5,0", "-o", str(tmp_path / "pushed"), code=1)
    assert re.search(r"MISSES \d of 2 points; the worst is point \d, passed \d+ cm away", pushed)
    half, _ = run(*flown, "--duration-s", "3", "-o", str(tmp_path / "half"))
    assert "passes all 1 points" in half


def test_the_desk_says_which_points_its_drone_missed(tmp_path: Path) -> None:
    """1.5 m ahead in 0.6 s is too quick for it: the exit code is 1, and `held` hides nothing."""
    there, within_s = 1.5, 0.6
    x = [0.0] * 4 + [k * there / within_s**power for power, k in enumerate((35, -84, 70, -20), start=4)]
    piece = [within_s, *x, *[0.0] * 8, 1.0, *[0.0] * 15]
    rows = (*COLUMNS, *POINT_COLUMNS), (*piece, 2, there, 0, 1, 0.1, "", "", "")
    lap = tmp_path / "lap.csv"
    lap.write_text("".join(",".join(map(str, row)) + "\n" for row in rows), "utf-8")
    flown = "fly", "--app", "crazyflie", "--trajectory", str(lap), "--no-pictures"
    said, _ = run(*flown, "-o", str(tmp_path / "desk"), code=1)
    assert "held" in said
    assert re.search(r"MISSES 1 of 1 points; the worst is point 2, passed \d+\s+cm\s+away", said)


@pytest.mark.parametrize("there", ["lap.csv", "lap.png", "lap.svg"])
def test_what_is_there_already_is_refused_before_the_search(tmp_path: Path, there: str) -> None:
    """Pieces and pictures: even points that cannot be planned are not read."""
    (tmp_path / there).touch()
    _, refused = run("plan", str(tmp_path / "none.csv"), "-o", str(tmp_path / "lap.csv"), code=2)
    assert f"{there}: already exists" in refused


def test_times_that_are_too_short_name_point_limit_and_rate() -> None:
    """Where, when, which limit, by how much; the rate that is offered does it."""
    points = [PlanPoint(*place, time_s=time_s) for place, time_s in zip(POINTS, (0.0, 0.5, 1.0), strict=True)]
    vehicle = Vehicle.from_preset("crazyflie")
    with pytest.raises(
        PlanError, match=r"(at|between) points? \d.* after the start: passes the limit of"
    ) as raised:
        plan(points, vehicle, drones=2)
    offered = re.search(r"--rate (0\.\d+) would do", str(raised.value))
    assert offered is not None
    assert plan(points, vehicle, drones=2, rate=float(offered[1])).curve.duration_s > 1.0


def test_a_rate_that_the_command_refuses_is_not_offered() -> None:
    """Times that are 50 times too short: what is said are the times that would do, and they do."""
    points = [PlanPoint(*place, time_s=0.04 * one) for one, place in enumerate(POINTS)]
    vehicle = Vehicle.from_preset("crazyflie")
    with pytest.raises(PlanError, match=r"times that are \d+ times as long would do") as raised:
        plan(points, vehicle, drones=1)
    longer = re.search(r"are (\d+) times", str(raised.value))
    assert longer is not None
    later = [replace(point, time_s=int(longer[1]) * float(point.time_s or 0.0)) for point in points]
    assert plan(later, vehicle, drones=1).curve.duration_s > 1.0


def test_a_speed_above_the_limit_is_named() -> None:
    """With the point and the limit, and before any search."""
    fast = [PlanPoint(0.0, 0.0, 1.0), PlanPoint(1.0, 0.0, 1.0, speed_m_s=50.0), PlanPoint(2.0, 0.0, 1.0)]
    with pytest.raises(
        PlanError, match=r"point 2: its speed in the plane, 50 m/s, is above limits.speed_m_s"
    ):
        plan(fast, Vehicle.from_preset("crazyflie"))


def test_a_crash_names_the_lowest_point() -> None:
    """It is the one that a higher place may help."""
    points = [PlanPoint(0.0, 0.0, 1.0), PlanPoint(1.0, 0.0, 0.2), PlanPoint(2.0, 0.0, 1.0)]
    course = course_of(points, closed=False)
    flown = FlownPlan(np.full((2, 2), 0.1), np.array([True, False]), *np.zeros((3, 2)))
    said = _missed_words(points, np.full(2, 0.1), course, flown)
    assert "1 of 2 drones crash" in said
    assert "point 2, z = 0.2, the lowest" in said


def test_a_point_behind_a_wall_is_refused() -> None:
    """The message names the point, the fence, and how far beyond it is."""
    fenced = Controller.from_preset("mambo", fence_m=(-1.0, 0.5, -2.0, 2.0))
    with pytest.raises(PlanError, match=r"point 2.*passes the limit of fence by 0\.[23]\d m"):
        plan(POINTS, Vehicle.from_preset("mambo"), fenced, drones=1)


def test_a_tolerance_below_the_noise_is_refused_with_one_that_would_do() -> None:
    """No plan is so slow that a drone seen with noise passes within a millimetre."""
    points = [PlanPoint(*place, tolerance_m=0.001) for place in POINTS[:2]]
    with pytest.raises(PlanError, match=r"point 2: \d of 2 drones pass it.* tolerance = 0\.\d+ would do"):
        plan(points, Vehicle.from_preset("crazyflie"), drones=1)


def test_a_turn_that_is_too_quick_is_refused(tmp_path: Path) -> None:
    """The heading turns by 4 rad/s at most, as it does at the rate that is offered; `fly` refuses turns."""
    points = [PlanPoint(0, 0, 1, time_s=0.0, yaw_rad=0.0), PlanPoint(0.3, 0, 1, time_s=1.2, yaw_rad=3.0)]
    vehicle = Vehicle.from_preset("crazyflie")
    with pytest.raises(TrajectoryError, match=r"points 1 to 2: a turn by 3\.00 rad in 1\.20 s") as raised:
        plan(points, vehicle, drones=1)
    offered = re.search(r"--rate (0\.\d+) would do", str(raised.value))
    assert offered is not None
    turning = plan(points, vehicle, drones=1, rate=float(offered[1]))
    assert "have headings" in repr(turning)
    lap = tmp_path / "lap.csv"
    lap.write_text(turning.text, "utf-8")
    with pytest.raises(TrajectoryError, match=r"line 2: yaw\^4 = .* must be 0: .*; plan without yaw"):
        read_course(lap)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ((None, 1.0, None), (1.0, 1.0, 1.0, 1.0)),
        ((None, 1.0, 2.0), (2.0, 1.0, 2.0, 2.0)),
        ((0.5, None, 6.5), (0.5, 0.5, 6.5 - math.tau, 0.5)),
        ((0.0, 2.0, 4.0), (0.0, 2.0, 4.0, math.tau)),
        ((None, None, None), (0.0, 0.0, 0.0, 0.0)),
    ],
)
def test_a_lap_ends_with_the_heading_it_began_with(
    given: tuple[float | None, ...], expected: tuple[float, ...]
) -> None:
    """A point without a heading keeps the last one, in a closed lap point 1 too; whole turns count."""
    points = [PlanPoint(*place, yaw_rad=yaw_rad) for place, yaw_rad in zip(POINTS, given, strict=True)]
    course = course_of(points, closed=True).slower(0.5)
    found = headings_of(points, course)
    np.testing.assert_allclose(found[:, 0], expected[:-1])
    powers = course.duration_s[:, np.newaxis] ** np.arange(8)
    np.testing.assert_allclose(np.sum(found * powers, axis=1), expected[1:], atol=1e-9)


def test_a_turn_goes_on_from_one_half_of_a_leg_to_the_other() -> None:
    """It is the same polynomial of the time."""
    points = [
        PlanPoint(*place, yaw_rad=yaw_rad) for place, yaw_rad in zip(POINTS, (0.3, 1.0, -0.5), strict=True)
    ]
    course = course_of(points, closed=False).slower(0.5)
    whole, halves = headings_of(points, course), headings_of(points, course.halved)
    for leg, leg_s in enumerate(course.duration_s):
        for half in range(2):
            since_s = np.linspace(0.0, leg_s / 2.0, 7)
            found = np.polynomial.Polynomial(halves[2 * leg + half])(since_s)
            expected = np.polynomial.Polynomial(whole[leg])(since_s + half * leg_s / 2.0)
            np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_heading_of_an_open_course_begins_at_0() -> None:
    """It turns on the way to the first point that has one."""
    points = [PlanPoint(0, 0, 1), PlanPoint(3, 0, 1, yaw_rad=1.0)]
    assert headings_of(points, course_of(points, closed=False))[0, 0] == 0.0


def test_a_lap_returns_to_point_1_in_words() -> None:
    """The last piece of a closed lap ends at point 1, not at one more."""
    course = course_of([PlanPoint(*place) for place in POINTS], closed=True)
    assert [course.choice.point_of(knot) for knot in range(4)] == [1, 2, 3, 1]
    turning = [PlanPoint(*place, yaw_rad=3.0 * (k == 0)) for k, place in enumerate(POINTS)]
    with pytest.raises(TrajectoryError, match=r"points 3 to 1: a turn by 3\.00 rad.*--rate 0\.\d\d would do"):
        headings_of(turning, replace(course, duration_s=np.array([2.0, 2.0, 0.5])))


def test_what_is_no_point_is_refused() -> None:
    """Two numbers are no point, a rate of 2 no rate."""
    vehicle = Vehicle.from_preset("crazyflie")
    for points, message in (
        ([(0.0, 1.0), (1.0, 1.0)], r"point 1 = \(0\.0, 1\.0\) must be a PlanPoint, or x, y and z"),
        (["123", "456"], "point 1 = .*123.* must be numbers"),
        (np.zeros(3), "point 1 = .* must be a PlanPoint, or x, y and z"),
        (np.zeros(()), "points: ndarray must be a file, or a sequence of points"),
        (7, "points: int must be a file, or a sequence of points"),
    ):
        with pytest.raises(ArgumentError, match=message):
            plan(points, vehicle)  # type: ignore[arg-type]
    with pytest.raises(TrajectoryError, match=r"point 2: must be 0\.01 m or more from the point before it"):
        plan(np.zeros((2, 3)), vehicle)
    with pytest.raises(TrajectoryError, match=r"point 3: must be 0\.01 m or more from the point before it"):
        plan([PlanPoint(0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1, 0, 1)], vehicle)
    with pytest.raises(ArgumentError, match=r"rate = 2\.0 must lie in"):
        plan(POINTS, vehicle, rate=2.0)


def test_a_larger_share_without_a_plan_leaves_the_one_that_flew() -> None:
    """From a share of 1.05 on a wall stands before the last point: a plan of a smaller share remains."""
    vehicle = Vehicle.from_preset("crazyflie")
    settings = Controller.from_vehicle("crazyflie").settings
    points = tuple(PlanPoint(*place) for place in POINTS[:2])
    search = _Search(points, course_of(points, closed=False), Drones([vehicle], settings), 1.0, silent)

    def wall(place_m: FloatArray, allowed: FloatArray) -> tuple[FloatArray, FloatArray]:
        stands_m = np.where(allowed > 1.05, 0.5, 5.0)
        return place_m[..., 0] - stands_m, np.broadcast_to(np.array([1.0, 0.0, 0.0]), place_m.shape)

    position = np.eye(5, 1) * np.ones(3)
    walled = FlightLimit("fence", position, np.zeros(3), wall)
    course, flown = search.quickest([*limits_of(figures_of(vehicle.drone, settings, vehicle)), walled])
    assert 1.0 <= course.choice.allowed[0] <= 1.05
    assert not flown.misses(np.array([0.1])).any()
    assert course.time_s > 0.5


def test_a_start_in_a_climb_near_the_ground_is_flown() -> None:
    """One piece, whose thrust between two samples passes the little that is spare, not the thrust itself."""
    climbing = PlanPoint(0.0, 0.0, 0.6, speed_m_s=0.5, direction=(1.0, 0.0, 1.0))
    made = plan([climbing, PlanPoint(1.0, 0.0, 1.1)], Vehicle.from_preset("crazyflie"), drones=4)
    assert (made.summary.passed, made.summary.flown) == (5, 5)
    assert made.summary.largest_miss_m < 0.1


@pytest.mark.parametrize(("climb_m_s", "lowest_m"), [(0.5, 0.3), (0.1, 0.4), (-0.5, 0.6), (2.0, 0.3)])
def test_the_run_in_stays_above_the_ground(climb_m_s: float, lowest_m: float) -> None:
    """A start in a climb comes from half its height at least, at the speed and climb of the first point."""
    piece = Piece(1.0, (1.0, 2.0, *[0.0] * 6), (0.0,) * 8, (0.6, climb_m_s, *[0.0] * 6))
    waiting = Waiting(PiecesInSpace((piece,)), 2.0)
    height, climb, _ = waiting.vertical(np.linspace(0.0, 2.0, 2001)).T
    assert height.min() == pytest.approx(lowest_m)
    np.testing.assert_allclose(np.gradient(height, 1e-3)[climb == 0.0][:-1], 0.0, atol=1e-9)
    assert (height[-1], climb[-1]) == pytest.approx((0.6, climb_m_s))
    assert waiting.target(0.0)[0] == pytest.approx(1.0 - 2.0 * 2.0)


def test_a_plan_that_begins_and_ends_in_flight_is_flown() -> None:
    """The drone comes at the speed of the first point, and passes the last one at the speed given there."""
    points = [
        PlanPoint(0.0, 0.0, 1.0, speed_m_s=1.0, direction=(1.0, 0.0, 0.0)),
        PlanPoint(1.0, 0.8, 1.1),
        PlanPoint(0.0, 1.6, 1.0, speed_m_s=0.8, direction=(-1.0, 0.0, 0.0)),
    ]
    made = plan(points, Vehicle.from_preset("crazyflie"), drones=2)
    ends = made.curve.target(np.array([0.0, made.curve.duration_s - 1e-9]))
    np.testing.assert_allclose(ends[:, 2:], [[1.0, 0.0], [-0.8, 0.0]], rtol=0.1, atol=1e-6)
    assert made.summary.passed == 3


@pytest.mark.parametrize("count", [30, 31])
def test_more_pieces_than_a_crazyflie_holds_with_a_descent_are_told(count: int) -> None:
    """Its script adds the descent to the memory's 31."""
    leg = LegSummary(number=1, duration_s=1.0, binding="tilt", share=1.0, allowed=1.0)
    numbers = dict.fromkeys(set(PlanSummary.model_fields) - {"generator", "vehicle", "legs"}, 1)
    summary = PlanSummary.model_validate(numbers | {"vehicle": "one", "legs": count * [leg]})
    told = f"{count} pieces: a Crazyflie's commander holds 30 and the descent of fly.py"
    assert any(told in str(block) for block in summary.result().blocks) is (count == 31)
