"""The study of sign decisions: edges are where decisions change, and every count is consistent."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.sign_decisions import (
    Disagreement,
    Moments,
    at_the_edge,
    decision_table,
    disagreement,
    in_float64,
    random_moments,
)
from mambo_codegen.design import Design
from mambo_codegen.reference import ReferenceController
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.flight.controllers.inner_steps import step_watched
from tests.support.one_norm import ONE_NORM

MAMBO = ONE_NORM
FIXED = with_option(MAMBO, "code.scalar", "fixed")
both = pytest.mark.parametrize("settings", [MAMBO, FIXED], ids=["float32", "fixed"])


def moments(settings: Settings, n: int = 300) -> Moments:
    """Draw steps with a random memory."""
    return random_moments(settings, n, np.random.default_rng(0))


@both
def test_an_edge_is_where_the_next_number_decides_otherwise(settings: Settings) -> None:
    """One number of the type of fewer bits further along x, the decisions of float64 are others."""
    many, bits = in_float64(settings), Design(settings).numbers.bits
    edge = at_the_edge(settings, moments(settings))
    x_m = edge.state[:, 0]
    beside = edge.at(x_m + 2.0 ** -bits["position"] if bits else np.nextafter(x_m, np.float32(np.inf)))
    memory = replace(
        ReferenceController(Design(many), len(x_m)).memory,
        command_rad=edge.command_rad.astype(np.float64),
        plan_rad=edge.plan_rad.astype(np.float64),
    )
    (here, inner), (there, inner_there) = (
        step_watched(many, memory, one.state, one.target, one.thrust_acceleration_m_s2)
        for one in (edge, beside)
    )
    assert len(x_m) > 30
    changed = (inner.decisions(many) != inner_there.decisions(many)).any(axis=(0, 2, 3))
    assert np.all(changed | (here.status != there.status))


@both
def test_the_scalar_types_disagree_at_edges(settings: Settings) -> None:
    """There some decisions differ; every count is consistent with the others."""
    found = disagreement(settings, "edge", at_the_edge(settings, moments(settings, 1000)))
    assert 0 < found.differing_steps < found.steps
    assert found.differing_steps <= found.differing <= found.decisions
    assert found.decisions == found.steps * MAMBO.optimizer.iterations * 2 * MAMBO.horizon.control
    median, most, largest = found.command_rad
    assert 0 < median <= most <= largest <= 2 * 0.0745  # both ways, five growing steps of RPROP
    assert found.rounding_rad < 1e-6


def test_steps_far_from_any_tie_agree() -> None:
    """No decision differs, and refused steps are left out."""
    given = moments(MAMBO, 40)
    state, target = np.zeros((40, 7), np.float32), np.zeros((40, 4), np.float32)
    state[:, 0:2] = 5
    state[::4, 0] = np.nan
    thrust = np.full(40, 9.81, np.float32)
    found = disagreement(MAMBO, "far", Moments(state, target, thrust, given.command_rad, given.plan_rad))
    assert (found.steps, found.differing, found.differing_steps) == (30, 0, 0)
    assert found.command_rad == (0.0, 0.0, 0.0)


def test_the_table_has_every_count() -> None:
    """A row for each kind of input."""
    spelled = decision_table([Disagreement("random", 10, 200, 2, (1, 0, 0, 0, 0), (0.01, 0.02, 0.03), 4e-8)])
    assert "| random | 10 | 1 | 1, 0, 0, 0, 0 | 2 of 200 | 0.010, 0.020, 0.030 | 4.0e-08 |" in spelled
