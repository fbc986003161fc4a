"""Sign decisions: what is seen of the optimizer's inner steps, and where the scalar types part."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.sign_decisions import (
    MANY,
    Disagreement,
    Flown,
    Moments,
    ScalarName,
    at_the_edge,
    disagreement,
    in_scalar,
    with_few,
    with_random_memory,
)
from benchmarks.signs import check, judge, text
from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.reference import ReferenceController, Status
from mambo_nmpc.codegen.settings import presets
from mambo_nmpc.codegen.settings.controller_toml import with_option
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.controllers.inner_steps import watched_step
from mambo_nmpc.sil.verify.check import Outcome
from mambo_nmpc.sil.verify.inputs import random_inputs
from tests.support.subjects import subject

MAMBO = presets.load("mambo")
FIXED = in_scalar(MAMBO, "fixed")
SETTINGS = {
    "float32": MAMBO,
    "float64": in_scalar(MAMBO, MANY),
    "fixed": FIXED,
    "table1": presets.load("table1"),
}
N = 300


def moments(settings: Settings, n: int = N, seed: int = 0) -> Moments:
    """Draw steps with a random memory."""
    rng = np.random.default_rng(seed)
    drawn = random_inputs(settings, n, rng)
    return with_random_memory(settings, (drawn.state, drawn.target, drawn.thrust), rng)


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
def test_watching_changes_no_bit(settings: Settings) -> None:
    """The watched step is the step, and the last iteration it saw is the one that the step reports."""
    given = moments(settings)
    plain = ReferenceController(Design(settings), N)
    for _ in range(2):
        memory = plain.memory
        expected = plain.step(given.state, given.target, given.thrust_acceleration_m_s2)
        step, inner = watched_step(
            settings, memory, given.state, given.target, given.thrust_acceleration_m_s2
        )
        for name in ("status", "command_rad", "cost", "gradient", "plan_rad", "iterations", "converged"):
            assert getattr(step, name).tobytes() == getattr(expected, name).tobytes(), name
        good = step.status == Status.OK
        assert len(inner.cost) == settings.optimizer.iterations
        assert np.array_equal(inner.cost[-1][good], step.cost[good])
        assert np.array_equal(inner.gradient[-1][good], step.gradient[good])


@pytest.mark.parametrize("settings", [MAMBO, FIXED], ids=["float32", "fixed"])
def test_moves_go_where_the_decisions_say(settings: Settings) -> None:
    """A decision that agrees with the one before moves its move against the slope, unless at the limit."""
    given = moments(settings)
    plain = ReferenceController(Design(settings), N)
    _, inner = watched_step(settings, plain.memory, given.state, given.target, given.thrust_acceleration_m_s2)
    decisions = inner.decisions(settings).astype(np.int64)
    moved = np.sign(np.diff(inner.plan_rad, axis=0))
    first = decisions[0]
    assert np.array_equal(moved[0], -first)  # from level, far from the limit
    onward = (decisions[1:-1] * decisions[:-2]) > 0
    inside = np.abs(inner.plan_rad[2:]) < MAMBO.limits.tilt_rad * 0.99
    assert (onward & inside).sum() > N
    assert np.array_equal(moved[1:][onward & inside], -decisions[1:-1][onward & inside])


@pytest.mark.parametrize("settings", [MAMBO, FIXED], ids=["float32", "fixed"])
def test_steps_of_the_search_are_as_long_as_they_are_told(settings: Settings) -> None:
    """The first moves by the first step size, the next by that which the second decision left."""
    given = moments(settings)
    plain = ReferenceController(Design(settings), N)
    _, inner = watched_step(settings, plain.memory, given.state, given.target, given.thrust_acceleration_m_s2)
    sizes, decisions = inner.step_sizes_rad(settings), inner.decisions(settings)
    assert sizes.dtype == inner.plan_rad.dtype
    onward = (decisions[1:-1] * decisions[:-2]) > 0
    inside = np.abs(inner.plan_rad[2:]) < settings.limits.tilt_rad * 0.99
    walked = np.abs(np.diff(inner.plan_rad.astype(np.float64), axis=0))[1:]
    assert (onward & inside).sum() > N
    assert np.allclose(walked[onward & inside], sizes[1:-1][onward & inside], rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("settings", [MAMBO, FIXED], ids=["float32", "fixed"])
def test_a_cost_at_rest_decides_nothing(settings: Settings) -> None:
    """With a huge tolerance all decisions after the first are 0."""
    resting = with_option(settings, "optimizer.tolerance", 1e6)
    given = moments(resting)
    step, inner = watched_step(
        resting,
        ReferenceController(Design(resting), N).memory,
        given.state,
        given.target,
        given.thrust_acceleration_m_s2,
    )
    decisions = inner.decisions(resting)[:, (step.status == Status.OK) & (inner.cost[0] < 1e5)]
    assert decisions[0].any()
    assert not decisions[1:].any()


@pytest.mark.parametrize("settings", [MAMBO, FIXED], ids=["float32", "fixed"])
def test_an_edge_is_where_the_next_number_decides_otherwise(settings: Settings) -> None:
    """One float32, or one number of fixed point, further along x the decisions of float64 are others."""
    many, bits = in_scalar(settings, MANY), Design(settings).numbers.bits
    edge = at_the_edge(settings, moments(settings))
    beside, x_m = edge.state.copy(), edge.state[:, 0]
    beside[:, 0] = x_m + 2.0 ** -bits["position"] if bits else np.nextafter(x_m, np.float32(np.inf))
    memory = replace(
        ReferenceController(Design(many), len(beside)).memory,
        command_rad=edge.command_rad.astype(np.float64),
        plan_rad=edge.plan_rad.astype(np.float64),
    )
    found = []
    for state in (edge.state, beside):
        step, inner = watched_step(many, memory, state, edge.target, edge.thrust_acceleration_m_s2)
        found.append((step.status, inner.decisions(many)))
    assert len(beside) > N // 10
    changed = (found[0][1] != found[1][1]).any(axis=(0, 2, 3)) | (found[0][0] != found[1][0])
    assert changed.all()


@pytest.mark.parametrize("settings", [MAMBO, FIXED], ids=["float32", "fixed"])
def test_the_scalar_types_part_at_edges(settings: Settings) -> None:
    """There some decisions differ; every count is consistent with the others."""
    found = disagreement(settings, "edge", at_the_edge(settings, moments(settings, 1000)))
    assert 0 < found.differing_steps < found.steps
    assert found.differing_steps <= found.differing <= found.decisions
    assert found.decisions == found.steps * MAMBO.optimizer.iterations * 2 * MAMBO.horizon.control
    assert 0 < found.moved <= found.differing_steps
    median, most, largest = found.command_rad
    assert 0 < median <= most <= largest <= 2 * 0.0745  # both ways, five growing steps of RPROP
    assert found.rounding_rad < 1e-6


def test_steps_that_agree_are_counted_as_such() -> None:
    """Far from any tie nothing differs; refused steps are left out."""
    given = moments(MAMBO, 40)
    state = given.state.copy()
    state[:] = 0
    state[:, 0:2] = given.target[:, 0:2] + np.float32(5)
    state[::4, 0] = np.nan
    target = np.nan_to_num(given.target, nan=0, posinf=0, neginf=0).clip(-10, 10)
    state[:, 0:2] = np.where(np.isnan(state[:, 0:2]), np.nan, target[:, 0:2] + np.float32(5))
    thrust = np.full(40, 9.81, np.float32)
    found = disagreement(MAMBO, "far", Moments(state, target, thrust, given.command_rad, given.plan_rad))
    assert (found.steps, found.differing, found.differing_steps) == (30, 0, 0)
    assert found.command_rad == (0.0, 0.0, 0.0)


AGREES = Disagreement("random", 10, 200, 2, (1, 0, 0, 0, 0), (0.01, 0.02, 0.03), 4e-8, 1)
ALIKE = Flown("eight", (1.91, 1, 1, 1), (1.92, 1, 1, 1), 0.01, (0.2, 0.2))


@pytest.mark.parametrize(
    ("one", "flight", "outcome", "word"),
    [
        ({}, {}, Outcome.PASSED, "1 of 10 random"),
        ({"rounding_rad": 1e-4}, {}, Outcome.FAILED, "0.0001 rad apart"),
        ({}, {"few": (2.1, 1, 1, 1)}, Outcome.FAILED, "IAE 2.1 in float32"),
        ({}, {"few": (np.nan, 1, 1, 1)}, Outcome.FAILED, "IAE nan"),
        ({}, {"few": (2.1, 1, 1, 1), "largest_error_m": (99.0, np.nan)}, Outcome.INCOMPLETE, "strays"),
    ],
)
def test_a_check_fails_where_the_scalar_types_do_not_fly_alike(
    one: dict[str, Any], flight: dict[str, Any], outcome: Outcome, word: str
) -> None:
    """Each rule alone; the figures are JSON."""
    found = judge([replace(AGREES, **one)], [replace(ALIKE, **flight)], MAMBO)
    assert found.outcome is outcome
    assert word in found.evidence
    json.dumps(found.figures, allow_nan=False)


def test_the_tables_hold_every_count() -> None:
    """A row for each kind of input and each flight."""
    spelled = text([AGREES], [ALIKE], MAMBO)
    assert "| random | 10 | 1 | 1, 0, 0, 0, 0 | 2 of 200 | 0.010, 0.020, 0.030 | 4.0e-08 |" in spelled
    assert "| eight | 1.91 | 1.92 | 1 / 1 | 1 / 1 | 1 / 1 | 0.010 |" in spelled
    assert "IAE float32 | IAE float64" in spelled
    assert "IAE fixed | IAE float64" in text([AGREES], [ALIKE], FIXED)


@pytest.mark.long
@pytest.mark.parametrize("settings", [MAMBO, FIXED], ids=["float32", "fixed"])
@pytest.mark.parametrize(
    ("right", "wrong", "outcome"),
    [
        ("", "", Outcome.PASSED),
        ("effort = nmpc_effort_slope(", "effort = 900 * nmpc_effort_slope(", Outcome.FAILED),
    ],
    ids=["as generated", "a weight"],
)
def test_the_check_flies_the_c_of_the_bundle(
    tmp_path: Path, settings: Settings, right: str, wrong: str, outcome: Outcome
) -> None:
    """A controller that pays 900 times for effort does not fly like the other scalar type."""
    harms = [("src/nmpc_cost.c", right, wrong)] if right else []
    chosen = subject(settings, tmp_path, *harms)
    found = check(chosen)
    assert found.outcome is outcome, found.evidence
    assert "in flight" in (chosen.folder / "signs.md").read_text("utf-8")


@pytest.mark.parametrize(("scalar", "few"), [("float32",) * 2, ("float64", "float32"), ("fixed",) * 2])
def test_the_type_of_fewer_bits_holds_the_moments(scalar: ScalarName, few: str) -> None:
    """Rounding them to it changes none: both types are handed the same numbers."""
    settings = in_scalar(MAMBO, scalar)
    assert with_few(settings).code.scalar == few
    given = moments(settings)
    again = given.exact(with_few(settings))
    assert all(getattr(again, name).tobytes() == values.tobytes() for name, values in vars(given).items())
