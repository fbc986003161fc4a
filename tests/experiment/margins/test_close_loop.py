"""The closed loop against its parts, stepped one after the other, and which states of it are kept."""

from typing import Final

import numpy as np
import pytest

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.experiment.margins.controller_jacobian import LinearController
from mambo_sil.experiment.margins.drone_jacobians import DroneJacobians, Signals
from mambo_sil.experiment.margins.hover_loop import (
    AT_COMMAND,
    AT_MOTORS,
    BY_PUSH,
    BY_SEEN,
    PLACE,
    SENT,
    TURNING,
    PeriodicLoop,
    axis_loop,
    choose,
    close_loop,
)

TICKS, TICKS_PER_UPDATE, ROWS, MEMORY, NOISES = 6, 3, 5, 4, 2
SEEN: Final = {2: 7, 3: 9}
"""How many numbers a controller sees of a drone with so many axes."""
SPARSE: Final = (((2, 8, 8), 0.09), ((2, 8, 1), 0.15), ((2, 1, 8), 0.15))
"""Shapes of matrices, and the share of their numbers that are not 0."""


def drawn_parts(axes: int) -> tuple[LinearController, DroneJacobians]:
    """Return a controller and a drone; the drone's seen numbers have noise, and no command acts at once."""
    rng, seen = np.random.default_rng(axes), SEEN[axes]
    outputs, columns = seen + 2 * axes, 3 * axes + NOISES
    feed = np.zeros((TICKS, outputs, columns))
    feed[:, : seen + axes, 3 * axes :] = rng.normal(0, 1, (TICKS, seen + axes, NOISES))
    feed[:, seen : seen + axes, :axes] = rng.normal(0, 1, (TICKS, axes, axes))
    shapes = ((MEMORY, MEMORY), (MEMORY, seen), (axes, MEMORY), (axes, seen))
    controller = LinearController(*(rng.normal(0, 0.3, shape) for shape in shapes))
    drone = DroneJacobians(
        Signals(axes),
        rng.normal(0, 0.3, (TICKS, ROWS, ROWS)),
        rng.normal(0, 0.3, (TICKS, ROWS, columns)),
        rng.normal(0, 1, (TICKS, outputs, ROWS)),
        feed,
    )
    return controller, drone


def stepped(
    controller: LinearController, drone: DroneJacobians, delay_ticks: int, given: FloatArray
) -> list[FloatArray]:
    """Return command, share of the motors and place in each tick, of inputs (ticks, columns) from rest.

    The inputs are additions to the command and to the motors, pushes, errors of what is seen, then noise.
    """
    axes, seen = len(controller.c), controller.d.shape[1]
    state, memory, held, found = np.zeros(ROWS), np.zeros(MEMORY), np.zeros(axes), []
    on_the_way = [np.zeros(axes)] * delay_ticks
    for tick, values in enumerate(given):
        a, b, c, d = (
            one[tick % TICKS] for one in (drone.transition, drone.inputs, drone.outputs, drone.feed)
        )
        added, motors, push, errors, noise = np.split(values, [axes, 2 * axes, 3 * axes, 3 * axes + seen])
        command = np.zeros(axes)
        if tick % TICKS_PER_UPDATE == 0:
            sees = c[:seen] @ state + d[:seen, 3 * axes :] @ noise + errors
            command = controller.c @ memory + controller.d @ sees
            memory = controller.a @ memory + controller.b @ sees
            held = command + added
        on_the_way.append(held)
        arriving = on_the_way.pop(0)
        shown = c @ state + d @ np.concatenate([arriving, motors, push, noise])
        found.append(np.concatenate([command, shown[seen:]]))
        state = a @ state + b @ np.concatenate([arriving, motors, push, noise])
    return found


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize("delay_ticks", [0, 1, 2, 4])
def test_the_closed_loop_is_its_parts_stepped_one_after_the_other(axes: int, delay_ticks: int) -> None:
    """From every input to every output; command and place are sampled at updates, the motors always."""
    controller, drone = drawn_parts(axes)
    loop = close_loop(controller, drone, delay_ticks, TICKS_PER_UPDATE, 0.01)
    columns, size = 3 * axes + SEEN[axes] + NOISES, ROWS + MEMORY + axes * max(delay_ticks, 1)
    assert loop.transition.shape == (TICKS, size, size)
    assert loop.inputs.shape == (TICKS, size, columns)
    assert loop.outputs.shape == (TICKS, 3 * axes, size)
    assert loop.feed.shape == (TICKS, 3 * axes, columns)
    assert loop.step_s == 0.01
    given = np.random.default_rng(9).normal(0, 1, (4 * TICKS, columns))
    state = np.zeros(size)
    for tick, expected in enumerate(stepped(controller, drone, delay_ticks, given)):
        phase = tick % TICKS
        shown = loop.outputs[phase] @ state + loop.feed[phase] @ given[tick]
        assert shown == pytest.approx(expected, rel=1e-9, abs=1e-12)
        state = loop.transition[phase] @ state + loop.inputs[phase] @ given[tick]
        called = tick % TICKS_PER_UPDATE == 0
        assert loop.sampled[phase].tolist() == [called] * axes + [True] * axes + [called] * axes


@pytest.mark.parametrize(
    ("axes", "axis", "columns", "rows"),
    [
        (2, 0, [0, 2, 4, 7, 9, 10, 13, 14], [0, 2, 4]),
        (2, 1, [1, 3, 5, 6, 8, 11, 13, 14], [1, 3, 5]),
        (3, 0, [0, 3, 6, 10, 12, 13, 18, 19], [0, 3, 6]),
        (3, 1, [1, 4, 7, 9, 11, 14, 18, 19], [1, 4, 7]),
        (3, 2, [2, 5, 8, 16, 17, 18, 19], [2, 5, 8]),
    ],
)
def test_the_loop_of_an_axis_has_its_own_places(
    axes: int, axis: int, columns: list[int], rows: list[int]
) -> None:
    """Command, motors, push; the seen position, velocity and angle of the axis; all noise."""
    whole = close_loop(*drawn_parts(axes), 1, TICKS_PER_UPDATE, 0.01)
    found = axis_loop(whole, Signals(axes), axis)
    assert np.array_equal(found.inputs, whole.inputs[..., columns])
    assert np.array_equal(found.outputs, whole.outputs[:, rows])
    assert np.array_equal(found.feed, whole.feed[:, rows][..., columns])
    assert np.array_equal(found.sampled, whole.sampled[:, rows])
    places = [AT_COMMAND, AT_MOTORS, BY_PUSH, BY_SEEN]
    assert np.array_equal(found.inputs[..., places], whole.inputs[..., columns[:4]])
    assert np.array_equal(found.outputs[:, [SENT, TURNING, PLACE]], whole.outputs[:, rows])


@pytest.mark.parametrize("seed", range(20))
def test_states_that_are_kept_are_moved_and_shown(seed: int) -> None:
    """By paths of any length over the ticks: those of the powers of a matrix that says what moves what."""
    rng, k = np.random.default_rng(seed), 8
    sizes = (rng.choice([0.0, 1e-3], shape, p=[1 - share, share]) for shape, share in SPARSE)
    transition, inputs, outputs = (np.asarray(one, np.float64) for one in sizes)
    loop = PeriodicLoop(0.01, transition, inputs, outputs, np.zeros((2, 1, 1)), np.ones((2, 1), np.bool_))
    reached = np.linalg.matrix_power(np.eye(k) + transition.max(axis=0), k) > 0.0
    moved, shown = reached @ inputs.max(axis=0)[:, 0], outputs.max(axis=0)[0] @ reached
    kept = moved * shown > 0.0
    assert np.array_equal(choose(loop, [0], [0]).transition, transition[:, kept][..., kept])
