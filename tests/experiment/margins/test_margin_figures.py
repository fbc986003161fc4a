"""Figures of margins in words: numbers, units and places."""

import math
from pathlib import Path
from typing import Any

import pytest

from mambo_sil.experiment.margins.axis_margins import (
    AxisMargins,
    HeightMargins,
    Margins,
    NoiseGain,
    Poles,
)
from mambo_sil.experiment.margins.loop_margins import LoopMargins
from mambo_sil.experiment.margins.margin_figures import figure_rows, figure_table, number, verdict
from mambo_sil.experiment.margins.margins_record import RESPONSES, ManyDrones, MarginSpread, MarginsSummary
from mambo_sil.results.blocks import Details, ResultTable

LOOP = LoopMargins(
    gain_up=2.04,
    gain_down=0.5,
    phase_deg=31.0,
    crossover_rad_s=4.0,
    delay_s=0.125,
    delay_updates=12.5,
    sensitivity=1.75,
    sensitivity_rad_s=6.0,
    complementary=1.25,
    bandwidth_rad_s=3.0,
)
POLES = Poles(least_damping=0.3, least_damped_rad_s=7.0, slowest_s=1.5, growth_1_s=0.5)
ROWS = [
    ("gain margin up", 2.04, "times"),
    ("gain margin down", 0.5, "times"),
    ("phase margin", 31.0, "degrees"),
    ("its crossover", 4.0, "rad/s"),
    ("delay margin", 125.0, "ms"),
    ("delay margin", 12.5, "update periods"),
    ("largest sensitivity", 1.75, ""),
    ("its frequency", 6.0, "rad/s"),
    ("largest complementary sensitivity", 1.25, ""),
    ("bandwidth", 3.0, "rad/s"),
]
POLE_ROWS = [
    ("least damped pole: damping", 0.3, ""),
    ("least damped pole: frequency", 7.0, "rad/s"),
    ("slowest pole: time constant", 1.5, "s"),
    ("gust to position", 0.25, "m per m/s^2"),
]


def noise(*names: str) -> dict[Any, NoiseGain]:
    """Return gains that differ."""
    return {name: NoiseGain(to_place=0.1 + place, to_command=0.2 + place) for place, name in enumerate(names)}


def roll(command: LoopMargins | None = LOOP, motors: LoopMargins | None = LOOP, **more: Any) -> AxisMargins:
    """Return the figures of roll."""
    given: dict[str, Any] = {"stable": True, "gust_to_command_rad_s2_m": 0.75, "sensed_variation_rad": 0.05}
    return AxisMargins(
        axis="roll",
        command=command,
        motors=motors,
        poles=POLES,
        gust_to_place_s2=0.25,
        noise=noise("position", "velocity", "angle"),
        **given | more,
    )


def height(variation_m_s2: float | None = None) -> HeightMargins:
    """Return the figures of the height."""
    return HeightMargins(
        stable=True,
        command=LOOP,
        poles=POLES,
        gust_to_place_s2=0.25,
        gust_to_thrust=0.5,
        noise=noise("position", "velocity"),
        sensed_variation_m_s2=variation_m_s2,
    )


def test_rows_of_an_axis_have_its_figures_and_units() -> None:
    """Those of each place where a loop is broken, of poles, gust, and noise; SI units, delays in ms too."""
    tilt = [
        ("gust to command", 0.75, "rad per m/s^2"),
        ("noise of position to position", 0.1, "m per m"),
        ("noise of position to command", 0.2, "rad per m"),
        ("noise of velocity to position", 1.1, "m per m/s"),
        ("noise of velocity to command", 1.2, "rad per m/s"),
        ("noise of angle to position", 2.1, "m per rad"),
        ("noise of angle to command", 2.2, "rad per rad"),
    ]
    at = [(f"{place}: {name}", *rest) for place in ("command", "motors") for name, *rest in ROWS]
    assert list(figure_rows(roll(sensed_variation_rad=None))) == [*at, *POLE_ROWS, *tilt]
    assert list(figure_rows(roll()))[-1] == ("sensors' noise to change of command", 0.05, "rad")
    lift = [
        ("gust to command", 0.5, "m/s^2 per m/s^2"),
        ("noise of position to position", 0.1, "m per m"),
        ("noise of position to command", 0.2, "m/s^2 per m"),
        ("noise of velocity to position", 1.1, "m per m/s"),
        ("noise of velocity to command", 1.2, "m/s^2 per m/s"),
    ]
    assert list(figure_rows(height())) == [*at[: len(ROWS)], *POLE_ROWS, *lift]
    assert list(figure_rows(height(0.07)))[-1] == ("sensors' noise to change of command", 0.07, "m/s^2")


@pytest.mark.parametrize("axes", [[roll(), height(0.07)], [height(0.07), roll()]])
def test_the_table_has_a_column_for_each_axis(axes: list[Margins]) -> None:
    """Figures of one name stand together; a dash where an axis has none of that unit."""
    table = figure_table(axes)
    rows = {(name, unit): values for name, values, unit in table}
    assert len(rows) == len(table)
    known = [{(name, unit): value for name, value, unit in figure_rows(axis)} for axis in axes]
    assert rows == {
        key: [number(one[key]) if key in one else "\N{EN DASH}" for one in known]
        for key in {key for one in known for key in one}
    }
    names = [name for name, _, _ in table]
    assert names == sorted(names, key=names.index)
    assert names[0] == "command: gain margin up"
    assert names.index("motors: bandwidth") < names.index("slowest pole: time constant")


def test_numbers_have_three_digits_or_a_sign() -> None:
    """Infinity, and a dash for what is not there."""
    assert [number(value) for value in (2.041, math.inf, math.nan)] == ["2.04", "\N{INFINITY}", "\N{EN DASH}"]


@pytest.mark.parametrize(
    ("axis", "said"),
    [
        (roll(motors=None), "roll: tolerates 2 times the gain or 125 ms more delay"),
        (
            roll(motors=LOOP.model_copy(update={"gain_up": 3.14, "delay_s": math.inf})),
            "roll: tolerates 2 times the gain or 125 ms more delay; at the motors' torque 3.1 times the gain "
            "or any delay",
        ),
        (
            roll(command=LOOP.model_copy(update={"gain_up": math.inf}), motors=None),
            "roll: tolerates any gain or 125 ms more delay",
        ),
        (height(), "height: tolerates 2 times the gain or 125 ms more delay"),
        (roll(None, None, stable=False), "roll: UNSTABLE, grows e-fold in 2.00 s"),
    ],
)
def test_the_verdict_says_how_far_the_edge_is(axis: Margins, said: str) -> None:
    """Gain and delay at each place; the time of growth of an unstable loop."""
    assert verdict(axis) == said


def many_drones() -> ManyDrones:
    """Return figures of four drones, of each place and axis one."""
    spread: dict[str, Any] = {"worst": 0.0125, "median": 0.25, "drone": 3}
    return ManyDrones(
        origin="drawn",
        drones=4,
        unstable=0,
        spreads=[
            MarginSpread(axis="roll", place="command", figure="delay margin", **spread),
            MarginSpread(axis="pitch", place="motors", figure="gain margin", **spread),
            MarginSpread(axis="height", place=None, figure="least damping", **spread),
        ],
        worst_drone=3,
        worst_values={},
    )


def test_a_row_of_many_drones_has_worst_and_median() -> None:
    """Delays in milliseconds, the others as they are; with the place where the loop is broken."""
    delay = tuple(number(1e3 * value) for value in (0.0125, 0.25))
    plain = tuple(number(value) for value in (0.0125, 0.25))
    table = many_drones().blocks[1]
    assert isinstance(table, ResultTable)
    assert table.rows == [
        ("roll: delay margin at the command, ms", *delay, "3"),
        ("pitch: gain margin at the motors' torque", *plain, "3"),
        ("height: least damping", *plain, "3"),
    ]


def summary_of(axes: list[Margins] | None, many: ManyDrones | None = None) -> MarginsSummary:
    """Return the record of a controller on a drone."""
    return MarginsSummary(
        source="mine",
        settings="0",
        vehicle="mine",
        sensors="true",
        update_period_s=0.01,
        axes=axes,
        many=many,
        reason="why" if axes is None else None,
    )


@pytest.mark.parametrize(
    ("axes", "stable", "verdicts"),
    [
        (None, True, ["why"]),
        ([roll(), height()], True, [verdict(roll()), verdict(height())]),
        ([height(), roll(stable=False)], False, [verdict(height()), verdict(roll(stable=False))]),
    ],
)
def test_a_summary_is_stable_if_all_axes_are(
    axes: list[Margins] | None, stable: bool, verdicts: list[str]
) -> None:
    """It has a verdict for each axis, or a reason."""
    assert summary_of(axes).stable == stable
    assert summary_of(axes).verdicts == verdicts
    assert summary_of(axes).result(Path("missing")).good == (None if axes is None else stable)


def test_a_result_has_figures_and_says_what_is_missing(tmp_path: Path) -> None:
    """Without the responses it has no pictures; without axes it needs none; many drones have a table."""
    result = summary_of([roll(), height()], many_drones()).result(tmp_path)
    assert result.missing == [RESPONSES]
    assert not result.pictures[0].drawable
    (spreads,) = (one for one in result.blocks if isinstance(one, ResultTable))
    (folded,) = (one for one in result.blocks if isinstance(one, Details))
    (figures,) = folded.blocks
    assert isinstance(figures, ResultTable)
    assert figures.heads == ("broken at", "roll", "height", "")
    rows = figure_table([roll(), height()])
    assert figures.rows == [(name, *values, unit) for name, values, unit in rows]
    assert figures.texts == (0, -1)
    assert spreads == many_drones().blocks[1]
    assert len(summary_of([roll()]).result(tmp_path).blocks) == 2
    without = summary_of(None).result(tmp_path)
    assert (without.missing, without.blocks) == ([], [])


def test_all_figures_unfold_where_they_are_asked_for(tmp_path: Path) -> None:
    """That is no figure itself: a file of a summary does not have it."""
    summary = summary_of([roll()]).model_copy(update={"all_figures": True})
    assert not any(isinstance(one, Details) for one in summary.result(tmp_path).blocks)
    assert any(isinstance(one, ResultTable) for one in summary.result(tmp_path).blocks)
    assert "all_figures" not in summary.model_dump()
