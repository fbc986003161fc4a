"""The periodic loop against simulations in the time domain, and what a delay of the link does to it."""

from typing import Any

import numpy as np
import pytest

from mambo_codegen.settings.presets import preset
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.experiment.margins.controller_jacobian import linear_controller
from mambo_sil.experiment.margins.drone_jacobians import drone_jacobians
from mambo_sil.experiment.margins.hover_loop import (
    AT_COMMAND,
    SEEN_OF,
    SENT,
    PeriodicLoop,
    axis_loop,
    choose,
    close_loop,
)
from mambo_sil.experiment.margins.loop_margins import open_loop, sensitivity, sensitivity_of
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.trajectories import Hover
from tests.support.height_settings import height_settings

TICKS, K, INPUTS, OUTPUTS = 3, 5, 2, 4


def drawn_loop(seed: int) -> PeriodicLoop:
    """Return a stable system whose matrices differ in three ticks; each output is sampled in some of them."""
    rng = np.random.default_rng(seed)
    transition = rng.normal(0, 1, (TICKS, K, K))
    transition *= 0.8 / np.abs(np.linalg.eigvals(transition)).max()
    sampled = np.array([[1, 1, 1, 0], [1, 0, 0, 1], [1, 0, 1, 0]], np.bool_)
    return PeriodicLoop(
        0.01,
        transition,
        rng.normal(0, 1, (TICKS, K, INPUTS)),
        rng.normal(0, 1, (TICKS, OUTPUTS, K)),
        rng.normal(0, 1, (TICKS, OUTPUTS, INPUTS)),
        sampled,
    )


def simulated(loop: PeriodicLoop, rad_s: float, column: int) -> Any:
    """Return the answers (l,) to exp(i w t) at one input: the mean of what each output has beside that.

    Steady after 600 ticks, over whole numbers of periods, at the ticks at which the output is sampled.
    """
    state, found = np.zeros(K, np.complex128), []
    for tick in range(900):
        phase, turn = tick % TICKS, np.exp(1j * rad_s * loop.step_s * tick)
        given = turn * np.eye(INPUTS)[column]
        found.append((loop.outputs[phase] @ state + loop.feed[phase] @ given) / turn)
        state = loop.transition[phase] @ state + loop.inputs[phase] @ given
    late = np.array(found[600:]).reshape(-1, TICKS, OUTPUTS).mean(axis=0)
    return np.average(late, axis=0, weights=loop.sampled)


@pytest.mark.parametrize("seed", range(3))
def test_responses_are_those_of_a_simulation(seed: int) -> None:
    """At other frequencies than those of the period, for every input and output."""
    loop, frequencies = drawn_loop(seed), np.array([0.7, 20.0, 150.0, 310.0])
    found = loop.response(frequencies)
    for row, rad_s in enumerate(frequencies.tolist()):
        for column in range(INPUTS):
            assert found[row, :, column] == pytest.approx(simulated(loop, rad_s, column), rel=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_the_transition_over_a_period_is_that_of_its_ticks(seed: int) -> None:
    """One tick after the other; the period is their time."""
    loop = drawn_loop(seed)
    state = start = np.random.default_rng(seed).normal(0, 1, K)
    for one in loop.transition:
        state = one @ state
    assert loop.monodromy() @ start == pytest.approx(state, rel=1e-12)
    assert loop.period_s == pytest.approx(0.03)


def test_choosing_leaves_out_only_what_does_not_matter() -> None:
    """States that no chosen input moves, directly or through others, or that no chosen output shows."""
    loop = drawn_loop(7)
    transition, inputs, outputs = loop.transition.copy(), loop.inputs.copy(), loop.outputs.copy()
    transition[:, 0, 1:] = transition[:, 1:4, 4] = transition[:, 2:, 0] = transition[:, 3, 1] = 0.0
    transition[:, 1, 2] = transition[:, 2, 1] = 0.0
    inputs[:, :, 0] = outputs[:, 0] = 0.0
    inputs[1, 3, 0] = outputs[2, 0, 1] = 1.0
    whole = PeriodicLoop(loop.step_s, transition, inputs, outputs, loop.feed, loop.sampled)
    frequencies = np.array([0.5, 30.0])
    for columns, rows in (([0], [0]), ([1], [0, 3]), ([0, 1], [1, 2]), ([1, 0], [3, 1])):
        small = choose(whole, columns, rows)
        expected = whole.response(frequencies)[:, rows][..., columns]
        assert small.response(frequencies) == pytest.approx(expected, rel=1e-9)
    assert choose(whole, [0], [0]).transition.shape[1] < K


@pytest.mark.parametrize("seed", range(3))
def test_poles_and_zeros_give_the_sensitivity(seed: int) -> None:
    """Of a loop that is broken and looked at in the first of its ticks; another one is left to `response`."""
    drawn, first = drawn_loop(seed), np.array([[1], [0], [0]], np.bool_)
    inputs, outputs, feed = drawn.inputs[..., :1], drawn.outputs[:, :1], drawn.feed[:, :1, :1]
    only = first[:, :, np.newaxis]
    once = PeriodicLoop(0.01, drawn.transition, inputs * only, outputs * only, feed * only, first)
    rad_s = np.array([0.1, 3.0, 20.0, 100.0])
    assert sensitivity_of(once)(rad_s) == pytest.approx(sensitivity(once, rad_s), rel=1e-9)
    always = PeriodicLoop(0.01, drawn.transition, inputs, outputs, feed, first)
    assert sensitivity_of(always)(rad_s) == pytest.approx(sensitivity(always, rad_s), rel=1e-9)
    assert abs(sensitivity(always, rad_s) - sensitivity(once, rad_s)).max() > 0.01


def test_a_drift_that_nothing_moves_is_at_rest() -> None:
    """Also at the frequency at which it would ring, pi in a step: the rest of the loop answers as alone."""
    loop = drawn_loop(0)
    shape = (TICKS, K + 1, K + 1)
    whole = np.zeros(shape)
    whole[:, :K, :K], whole[:, K, K], whole[:, :K, K] = loop.transition, -1.0, 0.3
    inputs = np.concatenate([loop.inputs, np.zeros((TICKS, 1, INPUTS))], axis=1)
    outputs = np.concatenate([loop.outputs, np.ones((TICKS, OUTPUTS, 1))], axis=2)
    drifting = PeriodicLoop(0.01, whole, inputs, outputs, loop.feed, loop.sampled)
    rad_s = np.array([1.0, np.pi / 0.01])
    assert drifting.response(rad_s) == pytest.approx(loop.response(rad_s), rel=1e-9)


@pytest.mark.parametrize("updates", [1, 3])
def test_a_delay_of_whole_updates_turns_the_open_loop_back(updates: int) -> None:
    """By its angle at every frequency, for roll and pitch."""
    settings, vehicle = preset("mambo"), Vehicle.from_preset("mambo")
    period_s = settings.horizon.update_period_s
    flight = Flight(Hover(), vehicle=vehicle, update_period_s=period_s)
    controller, drones = linear_controller(settings), drone_jacobians(flight)
    frequencies = np.geomspace(0.3, 250.0, 40)

    def opened(delay_ticks: int, axis: int) -> Any:
        whole = close_loop(
            controller, drones.drone(0), delay_ticks, flight.ticks_per_update, vehicle.drone.step_s
        )
        loop = choose(axis_loop(whole, drones.signals, axis), [AT_COMMAND], [SENT])
        return open_loop(sensitivity(loop, frequencies))

    turn = np.exp(-1j * frequencies * updates * period_s)
    for axis in range(2):
        late = opened(updates * flight.ticks_per_update, axis)
        assert late == pytest.approx(opened(0, axis) * turn, rel=1e-6)


def test_a_command_depends_on_the_seen_numbers_of_its_axis() -> None:
    """By the C: position, velocity and angle of roll and pitch, height and climb; and on no others."""
    system = linear_controller(height_settings())
    for axis, columns in enumerate(SEEN_OF):
        read = np.flatnonzero(np.abs(system.d[axis]) > 1e-6 * np.abs(system.d[axis]).max())
        assert {*columns[:2]} <= set(read.tolist()) <= set(columns)
