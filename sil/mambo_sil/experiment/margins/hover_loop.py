"""Controller, link and drone as one periodic linear system: the closed loop of one axis at hover."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import schur

from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.experiment.margins.controller_jacobian import LinearController, linear_controller
from mambo_sil.experiment.margins.drone_jacobians import (
    LEVEL_AXES,
    DroneJacobians,
    Signals,
    drone_jacobians,
    hover_thrust_n,
)
from mambo_sil.flight.loop import Flight

ComplexArray = NDArray[np.complex128]

AT_COMMAND, AT_MOTORS, BY_PUSH, BY_SEEN = 0, 1, 2, 3
"""Inputs of a loop: addition to the command; to its share of the motor commands; acceleration of the drone;
errors of what is seen of the axis from column 3 on, as in `SEEN_OF`; then the noise of the sensors."""
SENT, TURNING, PLACE = 0, 1, 2
"""Outputs of a loop: command of the controller; share of the motor commands; true position."""

SEEN_OF: Final = ((1, 3, 4), (0, 2, 5), (7, 8))
"""Position, velocity and angle of roll and of pitch in the seen state; height and climb."""
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
        lifted = self._lifted
        z = np.exp(1j * rad_s * self.step_s)
        turns = z[:, np.newaxis] ** np.arange(len(self.transition))
        forced = np.tensordot(turns, lifted.inputs, axes=1)
        state = _solve_triangular(lifted.triangle, turns[:, -1] * z, forced)
        shown = np.tensordot(turns.conj(), lifted.outputs, axes=1)
        return np.asarray(shown @ state + np.tensordot(turns.conj(), lifted.impulse, axes=1), np.complex128)

    @cached_property
    def _lifted(self) -> "_LiftedLoop":
        """The loop over one period, from the state at its beginning."""
        shares = (self.sampled / self.sampled.sum(axis=0))[:, :, np.newaxis]
        outputs, feed = shares * self.outputs, shares * self.feed
        triangle, turned = schur(self.monodromy(), output="complex")
        ticks, k = self.transition.shape[:2]
        before = np.eye(k, dtype=np.complex128) @ turned
        shown, moved, impulse = [], np.zeros((0, k, self.inputs.shape[2])), np.zeros_like(feed)
        impulse[0] = feed.sum(axis=0)
        for tick in range(ticks):
            shown.append(outputs[tick] @ before)
            impulse[1 : tick + 1] += (outputs[tick] @ moved)[::-1]
            before = self.transition[tick] @ before
            moved = np.concatenate([self.transition[tick] @ moved, self.inputs[tick : tick + 1]])
        return _LiftedLoop(triangle, turned.conj().T @ moved, np.array(shown), impulse)


@dataclass(frozen=True, eq=False)
class _LiftedLoop:
    """A loop over one period: triangle (k, k) is its transition, from a state that is turned to make it one.

    inputs (ticks, k, m): what an input in each tick does to the state at the end of the period;
    outputs (ticks, l, k): each share of the mean output by the state at the beginning;
    impulse (ticks, l, m): the mean output that many ticks after an input, within the period.
    """

    triangle: ComplexArray
    inputs: ComplexArray
    outputs: ComplexArray
    impulse: FloatArray


def _solve_triangular(triangle: ComplexArray, z: ComplexArray, forced: ComplexArray) -> ComplexArray:
    """Return x (f, k, m) of (z I - triangle) x = forced, for every z (f,).

    A pole at z itself is one that drifts: what neither moves nor shows it counts as at rest.
    """
    x = np.empty_like(forced)
    for row in range(len(triangle) - 1, -1, -1):
        above = np.tensordot(x[:, row + 1 :], triangle[row, row + 1 :], axes=(1, 0))
        away = z - triangle[row, row]
        drifts = np.abs(away) < _NEGLIGIBLE
        share = np.where(drifts, 0.0, 1.0 / np.where(drifts, 1.0, away))
        x[:, row] = (forced[:, row] + above) * share[:, np.newaxis]
    return x


Loops = tuple[PeriodicLoop, ...]
"""The loops of roll and pitch and, with a height, of the height."""


def hover_loops(settings: Settings, flight: Flight) -> Iterator[Loops]:
    """Yield the loops of a controller, whose law is linear, on each drone of a flight.

    With a height the controller has learnt the thrust of hover of that drone.
    Raises BuildError, CacheError.
    """
    commands_thrust, drone = settings.height is not None, flight.vehicle.drone
    found = drone_jacobians(flight, LEVEL_AXES + commands_thrust)
    loads = hover_thrust_n(flight.vehicle) / drone.weight_n if commands_thrust else 1.0
    delays, loads = np.broadcast_arrays(flight.link.delay_ticks, loads, np.zeros(flight.flights))[:2]
    controller = None if commands_thrust else linear_controller(settings)
    for number, (delay_ticks, load) in enumerate(zip(delays.tolist(), loads.tolist(), strict=True)):
        whole = close_loop(
            controller or linear_controller(settings, load),
            found.drone(number),
            delay_ticks,
            flight.ticks_per_update,
            drone.step_s,
        )
        yield tuple(axis_loop(whole, found.signals, axis) for axis in range(found.signals.axes))


def close_loop(
    controller: LinearController,
    drone: DroneJacobians,
    delay_ticks: int,
    ticks_per_update: int,
    step_s: float,
) -> PeriodicLoop:
    """Return all axes of a controller on one drone, as `DroneJacobians.drone` returns it.

    Inputs and outputs have one place for each axis, roll first, in the order of `AT_COMMAND` and `SENT`. The
    errors of all that is seen follow the inputs, then noise.
    """
    signals, transition, inputs, outputs, feed = (
        drone.signals,
        drone.transition,
        drone.inputs,
        drone.outputs,
        drone.feed,
    )
    ticks, rows = transition.shape[:2]
    axes, memory = signals.axes, len(controller.a)
    line = axes * max(delay_ticks, 1)
    size = rows + memory + line
    of_drone, of_memory = slice(0, rows), slice(rows, rows + memory)
    newest, oldest = slice(size - line, size - line + axes), slice(size - axes, size)
    errors = _errors(signals)
    noise, wide = errors.stop, errors.stop + inputs.shape[2] - signals.noise
    at_command, at_motors, by_push = (slice(first, first + axes) for first in (0, axes, 2 * axes))
    found = PeriodicLoop(
        step_s,
        np.zeros((ticks, size, size)),
        np.zeros((ticks, size, wide)),
        np.zeros((ticks, 3 * axes, size)),
        np.zeros((ticks, 3 * axes, wide)),
        np.ones((ticks, 3 * axes), np.bool_),
    )
    for tick in range(ticks):
        a, b, c, d = (one[tick] for one in (found.transition, found.inputs, found.outputs, found.feed))
        sent, fed = np.zeros((axes, size)), np.zeros((axes, wide))
        called = tick % ticks_per_update == 0
        if called:
            seen, noisy = outputs[tick, signals.seen], feed[tick, signals.seen, signals.noise :]
            sent[:, of_drone], sent[:, of_memory] = controller.d @ seen, controller.c
            fed[:, errors], fed[:, noise:] = controller.d, controller.d @ noisy
            c[at_command], d[at_command] = sent, fed
            a[of_memory, of_memory] = controller.a
            a[of_memory, of_drone] = controller.b @ seen
            b[of_memory, errors] = controller.b
            b[of_memory, noise:] = controller.b @ noisy
            fed[:, at_command] = np.eye(axes)
        else:
            sent[:, newest] = np.eye(axes)
            a[of_memory, of_memory] = np.eye(memory)
        found.sampled[tick, at_command] = found.sampled[tick, by_push] = called
        arriving, arrived = sent, fed
        if delay_ticks:
            arriving, arrived = np.zeros((axes, size)), np.zeros((axes, wide))
            arriving[:, oldest] = np.eye(axes)
        acting, wanted = inputs[tick][:, signals.command], feed[tick][signals.demand, signals.command]
        a[of_drone, of_drone] = transition[tick]
        a[of_drone] += acting @ arriving
        b[of_drone] = acting @ arrived
        b[of_drone, at_motors] += inputs[tick][:, signals.motor]
        b[of_drone, by_push] += inputs[tick][:, signals.push]
        b[of_drone, noise:] += inputs[tick][:, signals.noise :]
        a[newest], b[newest] = sent, fed
        a[newest.stop :, newest.start : size - axes] = np.eye(line - axes)
        c[at_motors, of_drone] = outputs[tick, signals.demand]
        c[at_motors] += wanted @ arriving
        d[at_motors] = wanted @ arrived
        d[at_motors, noise:] += feed[tick, signals.demand, signals.noise :]
        c[by_push, of_drone] = outputs[tick, signals.true]
    return found


def _errors(signals: Signals) -> slice:
    """Return the inputs of all axes that are errors of what the controller sees."""
    return slice(3 * signals.axes, 3 * signals.axes + signals.seen.stop)


def axis_loop(whole: PeriodicLoop, signals: Signals, axis: int) -> PeriodicLoop:
    """Return roll (0), pitch (1) or height (2): the states that its inputs move and its outputs show."""
    three = [axis, signals.axes + axis, 2 * signals.axes + axis]
    errors = [_errors(signals).start + column for column in SEEN_OF[axis]]
    return choose(whole, [*three, *errors, *range(_errors(signals).stop, whole.inputs.shape[2])], three)


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
