"""Worst and median of many drones against plain loops over drawn figures."""

import csv
import math
import statistics
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from mambo_sil.experiment.campaign.campaign_file import default
from mambo_sil.experiment.margins.axis_margins import AxisMargins, HeightMargins, Margins, Poles
from mambo_sil.experiment.margins.loop_margins import LoopMargins
from mambo_sil.experiment.margins.many_drones import (
    MeasuredDrone,
    _of_a_drone,
    summarise_drones,
    write_drones,
)
from mambo_sil.experiment.margins.margins_record import MarginSpread

FIGURES: Final = {
    "gain margin": "gain_up",
    "phase margin": "phase_deg",
    "delay margin": "delay_s",
    "largest sensitivity": "sensitivity",
}


def drawn_loop(rng: np.random.Generator) -> LoopMargins:
    """Return a loop with other figures, each of its own size."""
    return LoopMargins(**{name: float(rng.uniform(1, 2)) for name in LoopMargins.model_fields})


def drawn_axis(rng: np.random.Generator, name: str, *, motors: bool, unstable: float) -> Margins:
    """Return an axis; `unstable` is the share of unstable loops."""
    stable = bool(rng.random() > unstable)
    poles = Poles(least_damping=rng.uniform(-1, 1), least_damped_rad_s=1.0, slowest_s=1.0, growth_1_s=-1.0)
    shared: dict[str, Any] = {
        "stable": stable,
        "command": drawn_loop(rng) if stable else None,
        "poles": poles,
        "gust_to_place_s2": 1.0,
        "noise": {},
    }
    if name == "height":
        return HeightMargins(**shared, gust_to_thrust=1.0, sensed_variation_m_s2=None)
    at_motors = drawn_loop(rng) if stable and motors else None
    return AxisMargins(
        **shared, axis=name, motors=at_motors, gust_to_command_rad_s2_m=1.0, sensed_variation_rad=None
    )


def drawn(seed: int, *, motors: bool = True, unstable: float = 1 / 6) -> list[MeasuredDrone]:
    """Return eleven drones with three axes."""
    rng = np.random.default_rng(seed)
    return [
        MeasuredDrone(
            {"number": float(number)},
            tuple(
                drawn_axis(rng, name, motors=motors, unstable=unstable)
                for name in ("roll", "pitch", "height")
            ),
        )
        for number in range(11)
    ]


def figure(axis: Margins, place: str, key: str, worst: float) -> float:
    """Return a figure of a place of an axis: the worst one of an unstable loop."""
    if not axis.stable:
        return worst
    loop = getattr(axis, place)
    return math.nan if loop is None else float(getattr(loop, key))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("motors", [True, False])
def test_worst_and_median_are_those_of_all_drones(seed: int, motors: bool) -> None:
    """The least of a margin, the largest of a sensitivity; an unstable loop is the worst."""
    drones = drawn(seed, motors=motors)
    summary = summarise_drones(drones, "drawn")
    expected: list[tuple[str, str | None, str, float, list[float]]] = []
    for number, name in enumerate(("roll", "pitch", "height")):
        axes = [drone.axes[number] for drone in drones]
        for place in ("command", "motors") if name != "height" and motors else ("command",):
            for said, key in FIGURES.items():
                larger = said == "largest sensitivity"
                values = [figure(axis, place, key, math.inf if larger else 0.0) for axis in axes]
                expected.append((name, place, said, max(values) if larger else min(values), values))
        damping = [axis.poles.least_damping for axis in axes]
        expected.append((name, None, "least damping", min(damping), damping))
    found: dict[Any, MarginSpread] = {(one.axis, one.place, one.figure): one for one in summary.spreads}
    if motors:
        assert len(found) == len(expected)
    for *where, worst, values in expected:
        one = found[tuple(where)]
        assert (one.worst, one.median) == (worst, statistics.median(values))
        assert one.drone == values.index(worst)
    assert summary.unstable == sum(any(not axis.stable for axis in drone.axes) for drone in drones)
    assert (summary.drones, summary.origin) == (11, "drawn")


@pytest.mark.parametrize("unstable", [0.0, 1 / 6])
@pytest.mark.parametrize("seed", range(5))
def test_the_worst_drone_has_the_largest_sensitivity(seed: int, unstable: float) -> None:
    """Of all places and axes; the first unstable one, if any."""
    drones = drawn(seed, unstable=unstable)
    sizes = [
        max(
            math.inf
            if not axis.stable
            else max(loop.sensitivity for loop in (axis.command, axis.motors) if loop is not None)
            for axis in drone.axes
        )
        for drone in drones
    ]
    summary = summarise_drones(drones, "drawn")
    assert summary.worst_drone == sizes.index(max(sizes))
    assert summary.worst_values == {"number": float(summary.worst_drone)}


def test_a_row_of_the_file_has_the_figures_of_its_drone(tmp_path: Path) -> None:
    """With six digits; 0 for an unstable axis, and its margins as the worst."""
    drones = drawn(3)
    write_drones(drones, tmp_path / "drones.csv")
    rows = list(csv.DictReader((tmp_path / "drones.csv").read_text("utf-8").splitlines()))
    for number, (row, drone) in enumerate(zip(rows, drones, strict=True)):
        assert (row["drone"], float(row["number"])) == (str(number), float(number))
        for axis in drone.axes:
            assert row[f"{axis.axis}_stable"] == str(int(axis.stable))
            for key in FIGURES.values():
                expected = figure(axis, "command", key, math.inf if key == "sensitivity" else 0.0)
                assert float(row[f"{axis.axis}_command_{key}"]) == pytest.approx(expected, rel=1e-5)
            assert float(row[f"{axis.axis}_pole_least_damping"]) == pytest.approx(
                axis.poles.least_damping, rel=1e-5
            )


def test_what_distinguishes_a_drone_is_what_was_drawn() -> None:
    """The draws on which margins depend, each by its own name."""
    values = default().draw(0)
    found = _of_a_drone(values)
    assert {"mass_kg", "inertia_scale_x", "inertia_scale_y", "motor_lag_s", "command_delay_ticks"} < set(
        found
    )
    assert found == {name: values[name] for name in found}
    assert len(found) == 8
