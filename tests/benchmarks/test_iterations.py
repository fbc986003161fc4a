"""The excess by iterations is that of `benchmarks.optimum`, and of the input that the controller received."""

import numpy as np
import pytest

from benchmarks import optimum
from benchmarks.iterations import RecordingController, describe, excess_of_set
from benchmarks.ours import PEERS_MODEL
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.board.footprint.counts import FLIGHT
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.loop import Flight, fly
from tests.support.one_norm import ONE_NORM
from tests.support.tools import require

INPUTS = np.random.default_rng(0).uniform(-1, 1, (40, 6)) * [0.5, 1.0, 0.5, 1.0, 0.1, 0.1]


@pytest.fixture(autouse=True)
def _gcc() -> None:
    require("gcc", "gcc")


def test_the_excess_is_that_of_the_plan_for_its_input() -> None:
    """For errors, each with its last command; more iterations leave less."""
    medians = []
    for iterations in (5, 20):
        settings = with_option(PEERS_MODEL, "code.scalar", "float64")
        settings = with_option(settings, "optimizer.iterations", iterations)
        x, vx, y, vy, roll, pitch = INPUTS.T
        level = np.zeros(len(INPUTS))
        controller = CompiledController(settings, len(INPUTS))
        controller.reset(INPUTS[:, 4:])
        state = np.column_stack([x, y, vx, vy, roll, pitch, level])
        plan = controller.step(state, np.zeros((len(INPUTS), 4)), level + 9.81).plan_rad
        expected = optimum.excess("1-norm", settings, INPUTS, np.asarray(plan).reshape(-1, 4))
        found = excess_of_set(settings, "W", INPUTS.astype(np.float32))
        np.testing.assert_allclose(found, expected[::5], rtol=1e-4)
        medians.append(np.median(found))
    assert medians[0] > 2 * medians[1]


def test_the_last_command_of_a_flight_is_the_one_before() -> None:
    """A plan is never better than the optimum for its own input, and recording does not change the flight."""
    settings = with_option(ONE_NORM, "code.scalar", "float64")
    recorder = RecordingController(settings)
    flight = Flight(FLIGHT, duration_s=0.5)
    trace = fly(flight, recorder)
    assert trace.same_bits(fly(flight, CompiledController(settings)))
    np.testing.assert_array_equal(recorder.last_rad, trace.command_rad[-1, 0])
    excess = recorder.excess(settings, 1)
    assert len(excess) == 51
    assert excess.min() > -1e-6


def test_a_cell_has_median_percentile_and_share() -> None:
    """In % above the optimum; the share is of states within 1 %."""
    assert describe(np.array([0.0, 0.005, 0.02, 0.03, 12.0])) == "2 / 721 %, 40 %"
