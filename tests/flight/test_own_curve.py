"""Curves of one's own: files that are loaded, and what is wrong with them, in one sentence."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mambo_sil.errors import FlightError, TrajectoryError
from mambo_sil.flight.own_curve import check_curve, curve_named, is_curve_file, load_curve
from mambo_sil.flight.polynomials import Piece, PiecesInSpace
from mambo_sil.flight.trajectories import CURVES, PositionStep, Trajectories, Waypoints

REST = (0.0,) * 8


class Spiral:
    """A circle that widens and climbs; the velocity of an axis has a factor."""

    def __init__(self, x: float = 1.0, y: float = 1.0, climb: float = 1.0, jumps_s: float = np.inf) -> None:
        self._factors, self._climb, self._jumps_s = (x, y), climb, jumps_s

    def target(self, time_s: Any) -> Any:
        """Return [x, y, vx, vy]."""
        t, cosine, sine = np.asarray(time_s), np.cos(time_s), np.sin(time_s)
        after = 3.0 * (t >= self._jumps_s)
        vx, vy = 0.1 * cosine - 0.1 * t * sine, 0.1 * sine + 0.1 * t * cosine
        x, y = self._factors
        return np.stack([0.1 * t * cosine + after, 0.1 * t * sine, x * vx, y * vy], axis=-1)

    def acceleration(self, time_s: Any) -> Any:
        """Return zeros, which nobody compares."""
        return np.zeros((len(time_s), 2))

    def vertical(self, time_s: Any) -> Any:
        """Return height, climb and vertical acceleration."""
        t = np.asarray(time_s)
        return np.stack([1.0 + 0.1 * t, np.full_like(t, 0.1 * self._climb), np.zeros_like(t)], axis=-1)


GOOD: dict[str, Any] = {
    **{name: curve(2.0, 0.5) for name, curve in CURVES.items()},
    "spiral": Spiral(),
    "jump": Spiral(jumps_s=2.125),
    "jump at an odd time": Spiral(jumps_s=np.pi),
    "waypoints": Waypoints(((0.0, 0.0, 0.0), (0.7, 1.0, 0.0), (0.75, -1.0, 3.0))),
    "pieces": PiecesInSpace((Piece(1.3, (0.0, 1.0, *REST[2:]), REST, (1.0, *REST[1:])),)),
    "of two flights": Trajectories((Spiral(), PositionStep(1.0, 1.0))),
}


@pytest.mark.parametrize("name", GOOD)
def test_a_curve_whose_velocity_is_that_of_its_position_is_good(name: str) -> None:
    """Each that is shipped, one that jumps, pieces, and several."""
    check_curve(name, GOOD[name], 20.0)


def test_a_velocity_of_the_wrong_sign_is_named_with_its_axis_and_the_time_of_the_largest_difference() -> None:
    """In one sentence."""
    with pytest.raises(TrajectoryError) as found:
        check_curve("mine", Spiral(y=-1.0), 10.0)
    words = str(found.value)
    assert words.startswith("mine: at 9.63 s"), words  # there t sin t = 2 cos t
    assert "its velocity along y is 0.96" in words
    assert "but its position changes by -0.96" in words
    assert words.endswith(" m/s: give the derivative of the position")
    with pytest.raises(TrajectoryError, match="its velocity along x is 0 m/s, but"):
        check_curve("mine", Spiral(x=0.0), 10.0)
    with pytest.raises(TrajectoryError, match=r"its velocity along the height is -0\.1 m/s, but"):
        check_curve("mine", Spiral(climb=-1.0), 10.0)
    with pytest.raises(TrajectoryError, match="its velocity along y"):
        check_curve("mine", Trajectories((PositionStep(1.0, 1.0), Spiral(y=-1.0))), 10.0)


class Broken(Spiral):
    """A spiral whose acceleration is another."""

    def __init__(self, found: Any) -> None:
        super().__init__()
        self._found = found

    def acceleration(self, time_s: Any) -> Any:
        """Return or raise what was given."""
        return self._found(np.asarray(time_s))


def _late_nan(time_s: Any) -> Any:
    return np.where(time_s[:, np.newaxis] > 4.0, np.nan, np.zeros((len(time_s), 2)))


def _missing(time_s: Any) -> Any:
    raise KeyError(f"table at {time_s[0]:.3f}")


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (_late_nan, r"mine: is not finite at 4\.0"),
        (_missing, r"mine: KeyError: 'table at 0\.00"),
        (lambda time_s: np.zeros(len(time_s)), r"mine: acceleration\(\) has shape \(800,\) for 800 times"),
        (lambda _: "none", r"mine: trajectory\.acceleration\(\) = .* must be numbers"),
    ],
)
def test_a_curve_that_is_no_curve_is_told_why(found: Any, words: str) -> None:
    """At any time of the flight."""
    with pytest.raises(TrajectoryError, match=words):
        check_curve("mine", Broken(found), 10.0)


def test_a_file_holds_a_class_or_points(tmp_path: Path) -> None:
    """Its hash is that of the text, and of a module beside it."""
    (tmp_path / "size.py").write_text("RADIUS_M = 0.5\n", "utf-8")
    own = tmp_path / "own.py"
    own.write_text(
        "from size import RADIUS_M\nfrom mambo_nmpc.curves import Circle\n\n\nclass Small(Circle):\n"
        "    def __init__(self):\n        super().__init__(RADIUS_M, 1.0)\n\n\nNUMBER = int\n",
        "utf-8",
    )
    points = tmp_path / "points.csv"
    points.write_text("time_s,x_m,y_m\n0,0,0\n1,1,0\n", "utf-8")
    curve, before = load_curve(f"{own}:Small")
    assert curve.target(np.zeros(1)).tolist() == [[0.5, 0.0, -0.0, 0.5]]
    (tmp_path / "size.py").write_text("RADIUS_M = 0.6\n", "utf-8")
    assert load_curve(f"{own}:Small")[1] != before
    assert curve_named(str(points), 2.0, 0.5).target(np.array([0.5])).tolist() == [[0.5, 0.0, 1.0, 0.0]]
    assert is_curve_file("own.py:Small")
    assert is_curve_file("Points.CSV")
    assert not is_curve_file("circle")
    with pytest.raises(TrajectoryError, match="NUMBER has no methods target"):
        load_curve(f"{own}:NUMBER")
    with pytest.raises(FlightError, match=r"own\.py:Large: the file has no Large"):
        load_curve(f"{own}:Large")
    with pytest.raises(FlightError, match="there is no file"):
        load_curve(f"{tmp_path / 'other.py'}:Small")
