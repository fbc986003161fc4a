"""Controller, link and drone as one periodic linear system: the closed loop of one axis at hover."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.experiment.margins.controller_jacobian import LinearController
from mambo_sil.experiment.margins.drone_jacobians import COMMAND, DEMAND, MOTOR, NOISE, PUSH, SEEN, TRUE

ComplexArray = NDArray[np.complex128]

AT_COMMAND, AT_MOTORS, BY_PUSH, BY_SEEN, BY_NOISE = 0, 1, 2, slice(3, 6), 6
"""Inputs of a loop: addition to the command; to the turning share of the motor commands; acceleration of the
drone; errors of the seen position, velocity and angle; standard normal noise of the sensors from column 6."""
SENT, TURNING, PLACE = 0, 1, 2
"""Outputs of a loop: command of the controller; share of the motor commands; true position."""

_ERRORS, _NOISE = slice(6, 13), 13
"""Columns of the inputs of both axes: errors of what the controller sees; noise of the sensors."""
_SEEN_OF: Final = ((1, 3, 4), (0, 2, 5))
"""Position, velocity and angle of roll and of pitch in the seen state."""
_NEGLIGIBLE: Final = 1e-9


@dataclass(frozen=True, eq=False)
class PeriodicLoop:
    """A linear system whose matrices repeat after some ticks; `sampled` (ticks, outputs) says when to look.

    transition (ticks, k, k), inputs (ticks, k, m), outputs (ticks, l, k), feed (ticks, l, m).
    """

    step_s: float
    transition: FloatArray
    inputs: FloatArray
    outputs: FloatArray
    feed: FloatArray
    sampled: NDArray[np.bool_]

    @property
    def period_s(self) -> float:
        """The time after which the matrices repeat."""
        return len(self.transition) * self.step_s

    def monodromy(self) -> FloatArray:
        """Return the transition (k, k) over one period."""
        whole = np.eye(self.transition.shape[1])
        for one in self.transition:
            whole = one @ whole
        return whole

    def response(self, rad_s: FloatArray) -> ComplexArray:
        """Return what a sine of each input gives at each output at the same frequency (f, l, m).

        Other frequencies, which sampling adds, are left out. It is the mean over the ticks at which the
        output is sampled; a system that is the same in each of them gives its transfer function.
        """
        z = np.exp(1j * rad_s * self.step_s)[:, np.newaxis, np.newaxis]
        ticks, k = self.transition.shape[:2]
        forced: ComplexArray = np.zeros((len(rad_s), k, self.inputs.shape[2]), np.complex128)
        turn = np.ones_like(z)
        for transition, inputs in zip(self.transition, self.inputs, strict=True):
            forced = np.asarray(transition @ forced + inputs * turn, np.complex128)
            turn = turn * z
        state = np.linalg.solve(turn * np.eye(k) - self.monodromy(), forced)
        answer, turn = 0.0, np.ones_like(z)
        counts = self.sampled.sum(axis=0)
        for tick in range(ticks):
            share = (self.sampled[tick] / counts)[:, np.newaxis]
            answer = answer + share * (self.outputs[tick] @ (state / turn) + self.feed[tick])
            state = self.transition[tick] @ state + self.inputs[tick] * turn
            turn = turn * z
        return np.asarray(answer, np.complex128)


def close_loop(
    controller: LinearController,
    drone: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    delay_ticks: int,
    ticks_per_update: int,
    step_s: float,
) -> PeriodicLoop:
    """Return both axes of a controller on one drone, whose matrices are those of `DroneJacobians`.

    Inputs and outputs are pairs, roll first, in the order of `AT_COMMAND` and `SENT`.
    """
    transition, inputs, outputs, feed = drone
    ticks, rows = transition.shape[:2]
    noises, memory = inputs.shape[2] - NOISE, len(controller.a)
    line = 2 * max(delay_ticks, 1)
    size = rows + memory + line
    of_drone, of_memory = slice(0, rows), slice(rows, rows + memory)
    newest, oldest = slice(size - line, size - line + 2), slice(size - 2, size)
    wide = _NOISE + noises
    found = PeriodicLoop(
        step_s,
        np.zeros((ticks, size, size)),
        np.zeros((ticks, size, wide)),
        np.zeros((ticks, 6, size)),
        np.zeros((ticks, 6, wide)),
        np.ones((ticks, 6), np.bool_),
    )
    for tick in range(ticks):
        a, b, c, d = (one[tick] for one in (found.transition, found.inputs, found.outputs, found.feed))
        sent, fed = np.zeros((2, size)), np.zeros((2, wide))
        called = tick % ticks_per_update == 0
        if called:
            sent[:, of_drone], sent[:, of_memory] = controller.d @ outputs[tick, SEEN], controller.c
            fed[:, _ERRORS], fed[:, _NOISE:] = controller.d, controller.d @ feed[tick, SEEN, NOISE:]
            c[0:2], d[0:2] = sent, fed
            a[of_memory, of_memory] = controller.a
            a[of_memory, of_drone] = controller.b @ outputs[tick, SEEN]
            b[of_memory, _ERRORS] = controller.b
            b[of_memory, _NOISE:] = controller.b @ feed[tick, SEEN, NOISE:]
            fed[:, 0:2] = np.eye(2)
            d[0:2, 0:2] = 0.0
        else:
            sent[:, newest] = np.eye(2)
            a[of_memory, of_memory] = np.eye(memory)
        found.sampled[tick, [0, 1, 4, 5]] = called
        arriving, arrived = sent, fed
        if delay_ticks:
            arriving, arrived = np.zeros((2, size)), np.zeros((2, wide))
            arriving[:, oldest] = np.eye(2)
        acting, wanted = inputs[tick][:, COMMAND], feed[tick][DEMAND, COMMAND]
        a[of_drone, of_drone] = transition[tick]
        a[of_drone] += acting @ arriving
        b[of_drone] = acting @ arrived
        b[of_drone, 2:4] += inputs[tick][:, MOTOR]
        b[of_drone, 4:6] += inputs[tick][:, PUSH]
        b[of_drone, _NOISE:] += inputs[tick][:, NOISE:]
        a[newest], b[newest] = sent, fed
        a[newest.stop :, newest.start : size - 2] = np.eye(line - 2)
        c[2:4, of_drone] = outputs[tick, DEMAND]
        c[2:4] += wanted @ arriving
        d[2:4] = wanted @ arrived
        d[2:4, _NOISE:] += feed[tick, DEMAND, NOISE:]
        c[4:6, of_drone] = outputs[tick, TRUE]
    return found


def axis_loop(both: PeriodicLoop, axis: int) -> PeriodicLoop:
    """Return roll (0) or pitch (1) of both axes: the states that its inputs move and its outputs show."""
    errors = [_ERRORS.start + column for column in _SEEN_OF[axis]]
    inputs = [axis, 2 + axis, 4 + axis, *errors, *range(_NOISE, both.inputs.shape[2])]
    return choose(both, inputs, [axis, 2 + axis, 4 + axis])


def choose(loop: PeriodicLoop, inputs: list[int], outputs: list[int]) -> PeriodicLoop:
    """Return a loop with some inputs and outputs, and the states that these move and show."""
    loop = PeriodicLoop(
        loop.step_s,
        loop.transition,
        loop.inputs[..., inputs],
        loop.outputs[:, outputs],
        loop.feed[:, outputs][..., inputs],
        loop.sampled[:, outputs],
    )
    moves = np.asarray((np.abs(loop.transition) > _NEGLIGIBLE).any(axis=0))
    moved = np.asarray((np.abs(loop.inputs) > _NEGLIGIBLE).any(axis=(0, 2)))
    shown = np.asarray((np.abs(loop.outputs) > _NEGLIGIBLE).any(axis=(0, 1)))
    for _ in range(len(moves)):
        moved, shown = moved | moves[:, moved].any(axis=1), shown | moves[shown].any(axis=0)
    kept = moved & shown
    return PeriodicLoop(
        loop.step_s,
        loop.transition[:, kept][:, :, kept],
        loop.inputs[:, kept],
        loop.outputs[:, :, kept],
        loop.feed,
        loop.sampled,
    )
