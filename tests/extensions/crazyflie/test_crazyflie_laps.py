"""The laps of `plan` that fly.py uploads and slows down, and a link that is lost meanwhile."""

import math
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from mambo_extensions.plan.hermite import pieces_of
from mambo_sil.flight.polynomials import COLUMNS, POINT_COLUMNS
from tests.extensions.crazyflie.support import radio
from tests.extensions.crazyflie.support.radio import Drone
from tests.extensions.crazyflie.support.scripts import (
    PLACE,
    at_call,
    change_values,
    evaluate,
    figure_of,
    run,
    uploaded,
)

PREPARED = ["set_value", "stop"]
LANDED = ["notify", "land", "stop", "close"]


POINT = (2, 0.0, 0.0, 1.0, 0.1, "", "", "")
"""What the columns of a point hold, which nothing of it reads."""


def lap(
    tmp_path: Path,
    count: int,
    *,
    start_m_s: float = 0.0,
    end_m_s: float = 0.0,
    heights_m: tuple[float, float] = (0.8, 0.8),
    **numbers: str,
) -> str:
    """Write a lap of pieces of 1 s as `plan` does, from (2, 3) along y with heading 0.2; return its name.

    numbers: what stands in a column of the first piece instead.
    """
    knots = np.zeros((count + 1, 4, 3))
    knots[:, 0] = [
        (2.0, 3.0 + 0.1 * k, height) for k, height in enumerate(np.linspace(*heights_m, count + 1))
    ]
    knots[:, 1, 1] = [start_m_s, *(count - 1) * [0.1], end_m_s]
    heading = [0.2, *7 * [0.0]]
    rows = [
        [
            str(number)
            for number in (1.0, *piece.north, *(-one for one in piece.east), *piece.height, *heading, *POINT)
        ]
        for piece in pieces_of(knots, np.ones(count)).pieces
    ]
    for name, text in numbers.items():
        rows[0][COLUMNS.index(name)] = text
    (tmp_path / "lap.csv").write_text(
        "\n".join(map(",".join, [(*COLUMNS, *POINT_COLUMNS), *rows])) + "\n", "utf-8"
    )
    return str(tmp_path / "lap.csv")


def test_a_lap_of_plan_is_uploaded_from_where_the_drone_stands(
    scripts: dict[str, ModuleType], drone: Drone, tmp_path: Path
) -> None:
    """Its first point is above the drone, as high above the floor as in the file; a descent comes last."""
    assert run(scripts, lap(tmp_path, 2)) == 0
    pieces = uploaded(drone)
    assert len(pieces) == 3
    x, y, z, yaw = evaluate(pieces, 0.0)
    assert (x, y, z, yaw) == pytest.approx((1.0, -0.5, 0.9, math.radians(30.0)), abs=1e-6)
    assert evaluate(pieces[:1], 1.0)[1] == pytest.approx(-0.4, abs=1e-6)
    assert evaluate(pieces, pieces[:, 32].sum())[2] == pytest.approx(PLACE[2], abs=1e-5)


def test_a_lap_that_cannot_be_flown_is_refused(
    scripts: dict[str, ModuleType], drone: Drone, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """More pieces than the memory holds, in motion at an end, too low, too high, too long."""
    for count, options, message in (
        (31, {}, "the lap has 32 pieces with its descent, and the drone's memory holds 31"),
        (2, {"start_m_s": 0.1}, "the lap begins or ends in flight: plan it without --closed"),
        (2, {"end_m_s": 0.1}, "the lap begins or ends in flight"),
        (2, {"heights_m": (0.1, 0.8)}, "the lap flies at 0.1 to 0.8 m, and 0.2 to 5 m above the floor"),
        (9, {"heights_m": (0.8, 6.0)}, "the lap flies at 0.8 to 6 m"),
        (2, {"duration": "1e9"}, "240 s are what a battery surely gives: plan a shorter lap"),
    ):
        assert run(scripts, lap(tmp_path, count, **options)) == 1
        assert message in capsys.readouterr().err
    assert drone.names() == []


@pytest.mark.parametrize(
    ("number", "message"),
    [
        ({"duration": "0"}, "finite numbers, and durations above 0"),
        ({"duration": "-1"}, "finite numbers, and durations above 0"),
        ({"duration": "nan"}, "finite numbers, and durations above 0"),
        ({"x^3": "nan"}, "finite numbers, and durations above 0"),
        ({"yaw^0": "inf"}, "finite numbers, and durations above 0"),
        ({"z^0": "quick"}, "could not convert string to float: 'quick'"),
        ({"y^0": "1,1"}, "a lap has rows of a duration and 8 coefficients"),
    ],
)
def test_a_file_that_is_no_lap_is_refused(
    number: dict[str, str],
    message: str,
    scripts: dict[str, ModuleType],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Before anything is connected: what is not a number would stop the motors in the air."""
    with pytest.raises(SystemExit):
        run(scripts, lap(tmp_path, 2, **number))  # type: ignore[arg-type] # of numbers
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--size", "--height", "--rate", "--laps"])
def test_an_option_of_a_figure_is_refused_with_a_lap(
    option: str, scripts: dict[str, ModuleType], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The lap has its own."""
    with pytest.raises(SystemExit):
        run(scripts, lap(tmp_path, 2), option, "1")
    assert f"{option} is for hover, goto, eight, circle; " in capsys.readouterr().err


def test_a_descent_is_as_long_as_its_height_asks_for(
    scripts: dict[str, ModuleType], drone: Drone, tmp_path: Path
) -> None:
    """At 0.9 m/s or less from where a lap ends, and where the script lands it from where it is highest."""
    assert run(scripts, lap(tmp_path, 6, heights_m=(0.5, 3.0))) == 0
    assert uploaded(drone)[-1, 32] == pytest.approx(7.5)
    assert drone.of("land")[0][1][1] == pytest.approx(7.5, abs=0.05)


def test_a_lap_may_ask_for_all_that_tilt_and_thrust_give(
    scripts: dict[str, ModuleType], drone: Drone, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was flown before it was called good; more is refused, with the share of its rate that would fly."""
    asked = scripts["figures"].fastest(scripts["figures"].read_lap(lap(tmp_path, 2)))[1]
    change_values(scripts, flown_m_s2=0.96 * asked, lap_m_s2=1.01 * asked)
    assert run(scripts, lap(tmp_path, 2)) == 0
    change_values(scripts, lap_m_s2=0.8 * asked)
    begun = len(drone.calls)
    assert run(scripts, lap(tmp_path, 2)) == 1
    assert "plan it at 0.89 of its present --rate" in capsys.readouterr().err
    assert len(drone.calls) == begun


def too_quick(scripts: dict[str, ModuleType], drone: Drone) -> Any:
    """Let the drone say after 5 s of its eight that it is too quick; return its pieces (n, 33)."""
    vars(scripts["radio"])["APP_CHECKS"] = ("nmpc.tooQuick",)
    drone.logged["nmpc.tooQuick"] = 0
    at_call(drone, "start_trajectory", 5.0, lambda: drone.logged.update({"nmpc.tooQuick": 1}))
    figure = figure_of(scripts, "eight")
    found = scripts["figures"].pieces_of(figure, (*PLACE, math.radians(30.0)))
    return np.frombuffer(b"".join(piece.pack() for piece in found), "<f4").astype(float).reshape(-1, 33)


@pytest.mark.parametrize("parts", [7, 12, 50])
def test_a_link_lost_while_a_figure_is_slowed_down_tears_one_piece(
    parts: int, scripts: dict[str, ModuleType], drone: Drone
) -> None:
    """Those before it are as they were, those behind it slower: what is torn flies as late as can be."""
    before = too_quick(scripts, drone)
    at_call(drone, "start_trajectory", 4.0, lambda: setattr(drone, "lost_after", parts))
    assert run(scripts, "eight") == 1
    now = uploaded(drone)
    torn = len(now) - 1 - (parts - 1) // 6
    assert (now[:torn] == before[:torn]).all()
    assert now[torn + 1 : -1, 32] == pytest.approx(before[torn + 1 : -1, 32] / 0.8)
    assert (now[torn] != before[torn]).any()


@pytest.mark.parametrize("fault", ["fails", "is late"])
def test_a_figure_that_cannot_be_slowed_down_is_ended(
    fault: str,
    scripts: dict[str, ModuleType],
    drone: Drone,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """No piece that flies changes, and the drone lands."""
    before = too_quick(scripts, drone)
    if fault == "fails":
        at_call(drone, "start_trajectory", 4.0, lambda: setattr(drone, "failing_uploads", True))
    else:
        at_call(drone, "start_trajectory", 4.0, lambda: monkeypatch.setattr(radio, "PART_S", 0.02))
    assert run(scripts, "eight") == 1
    assert "The drone lands: the figure could not be slowed down in time." in capsys.readouterr().err
    assert [name for name in drone.names() if name != "upload"][-4:] == LANDED
    flown_s = drone.of("land")[0][0] - drone.of("start_trajectory")[0][0]
    changed = np.flatnonzero((uploaded(drone) != before).any(axis=1))
    assert len(changed) == 0 if fault == "fails" else before[: changed[0], 32].sum() > flown_s


def test_a_figure_that_stays_too_quick_is_slowed_down_three_times(
    scripts: dict[str, ModuleType], drone: Drone, capsys: pytest.CaptureFixture[str]
) -> None:
    """Then the drone lands: a figure has an end."""
    before = too_quick(scripts, drone)
    assert run(scripts, "eight") == 1
    said = capsys.readouterr()
    assert said.out.count("The figure is too quick for the thrust") == 3
    assert "The drone lands: the figure was slowed down 3 times" in said.err
    slower = uploaded(drone)
    assert slower[-2, 32] == pytest.approx(before[-2, 32] / 0.8**3)
