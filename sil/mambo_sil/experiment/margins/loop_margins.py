"""The margins of a loop that is broken at one place."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from pydantic import BaseModel, ConfigDict
from scipy.optimize import elementwise

from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.experiment.margins.hover_loop import ComplexArray, PeriodicLoop
from mambo_sil.results.summary import Number

LEAST_GAIN = 1e-3
"""Below it a loop's gain counts as 0: no gain margin above 1000 is found."""


class LoopMargins(BaseModel):
    """The margins of one loop; NaN, null in JSON, where there is no such bound."""

    model_config = ConfigDict(frozen=True)

    gain_up: Number
    """Factor on the loop's gain at which it oscillates; infinity if none above 1 does."""
    gain_down: Number
    """The same below 1; 0 if none does."""
    phase_deg: Number
    """Least phase margin of all crossovers."""
    crossover_rad_s: Number
    """Frequency of that phase margin."""
    delay_s: Number
    """Least additional delay at which the loop oscillates."""
    delay_updates: Number
    """The same in update periods of the controller."""
    sensitivity: Number
    """Largest magnitude of the sensitivity S = 1 / (1 + L)."""
    sensitivity_rad_s: Number
    complementary: Number
    """Largest magnitude of T = L / (1 + L)."""
    bandwidth_rad_s: Number
    """Frequency above which |S| exceeds 1 / sqrt(2) for the first time."""


def sensitivity(loop: PeriodicLoop, rad_s: FloatArray) -> ComplexArray:
    """Return S (f,) of a loop whose input is an addition at the break, and its output what returns there."""
    answer: ComplexArray = 1.0 + loop.response(rad_s)[:, 0, 0]
    return answer


def sensitivity_of(loop: PeriodicLoop) -> Callable[[FloatArray], ComplexArray]:
    """Return S as a function of frequencies (f,), as `sensitivity` has it.

    By poles and zeros, which is quick, if the loop is broken and looked at in the first tick of a period.
    """
    acting = np.flatnonzero(np.abs(loop.inputs).max(axis=(1, 2)) + np.abs(loop.feed).max(axis=(1, 2)))
    sampled = np.flatnonzero(loop.sampled[:, 0])
    if sampled.tolist() != [0] or not set(acting.tolist()) <= {0}:
        return partial(sensitivity, loop)
    transition, feed = loop.monodromy(), 1.0 + float(loop.feed[0, 0, 0])
    moved = loop.inputs[0]
    for one in loop.transition[1:]:
        moved = one @ moved
    poles = np.linalg.eigvals(transition)
    zeros = np.linalg.eigvals(transition - moved @ loop.outputs[0] / feed)

    def by_factors(rad_s: FloatArray) -> ComplexArray:
        z = np.exp(1j * rad_s * loop.period_s)[:, np.newaxis]
        return np.asarray(feed * np.prod((z - zeros) / (z - poles), axis=1), np.complex128)

    return by_factors


def open_loop(sensitivity: ComplexArray) -> ComplexArray:
    """Return L = 1 / S - 1, of negative feedback."""
    return 1.0 / sensitivity - 1.0


def measure_loop(loop: PeriodicLoop, rad_s: FloatArray, update_period_s: float) -> LoopMargins:
    """Return the margins of a closed loop with one input and output as in `sensitivity`.

    It looks at frequencies (f,), which increase, and between them where a margin lies.
    """
    sensed = sensitivity_of(loop)

    def opened(at: FloatArray) -> ComplexArray:
        return open_loop(sensed(at.reshape(-1))).reshape(at.shape)

    def at_roots(
        function: Callable[[FloatArray], FloatArray], values: FloatArray, ok: FloatArray
    ) -> FloatArray:
        left = np.flatnonzero((values[:-1] > 0.0) != (values[1:] > 0.0))
        left = left[(ok[left] > 0.0) & (ok[left + 1] > 0.0)]
        if not len(left):
            return np.zeros(0)
        found = elementwise.find_root(function, (rad_s[left], rad_s[left + 1]))
        # A value that is 0 but for rounding may have another sign alone than among others.
        nearer = np.where(np.abs(values[left]) < np.abs(values[left + 1]), rad_s[left], rad_s[left + 1])
        return np.where(np.isfinite(found.x), found.x, nearer)

    def peak(function: Callable[[FloatArray], FloatArray], values: FloatArray) -> tuple[float, float]:
        top = int(np.argmax(values))
        if not 0 < top < len(rad_s) - 1:
            return float(values[top]), float(rad_s[top])
        found = elementwise.find_minimum(
            lambda at: -function(at), (rad_s[top - 1], rad_s[top], rad_s[top + 1])
        )
        return -float(found.f_x), float(found.x)

    s = sensed(rad_s)
    grid, all_of_it = open_loop(s), np.ones(len(rad_s))
    crossovers = at_roots(
        lambda at: np.log(np.abs(opened(at))), np.log(np.maximum(np.abs(grid), 1e-300)), all_of_it
    )
    phases = np.mod(np.angle(opened(crossovers)) + math.pi, 2.0 * math.pi) if len(crossovers) else crossovers
    leads = np.minimum(phases, 2.0 * math.pi - phases)
    turning = at_roots(lambda at: opened(at).imag, grid.imag, -grid.real)
    gains = np.append(np.abs(opened(turning)) if len(turning) else turning, -grid[-1].real)
    factors = 1.0 / gains[gains > LEAST_GAIN]
    largest, at_rad_s = peak(lambda at: np.abs(1.0 / (1.0 + opened(at))), np.abs(s))
    complementary, _ = peak(lambda at: np.abs(1.0 - 1.0 / (1.0 + opened(at))), np.abs(1.0 - s))
    closed = at_roots(
        lambda at: np.abs(1.0 / (1.0 + opened(at))) - math.sqrt(0.5), np.abs(s) - math.sqrt(0.5), all_of_it
    )
    least = int(np.argmin(leads)) if len(leads) else None
    delay_s = float(np.min(phases / crossovers)) if len(crossovers) else math.inf
    return LoopMargins(
        gain_up=min(factors[factors > 1.0], default=math.inf),
        gain_down=max(factors[factors < 1.0], default=0.0),
        phase_deg=math.inf if least is None else math.degrees(leads[least]),
        crossover_rad_s=math.nan if least is None else crossovers[least],
        delay_s=delay_s,
        delay_updates=delay_s / update_period_s,
        sensitivity=largest,
        sensitivity_rad_s=at_rad_s,
        complementary=complementary,
        bandwidth_rad_s=closed[0] if len(closed) else math.nan,
    )
