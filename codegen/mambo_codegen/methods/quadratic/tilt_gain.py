"""Tilt gain: how much the drone tilts, over what the attitude model says, learnt in flight."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.thrust_vector import inverse, inverse_line
from mambo_codegen.methods.quadratic.tilt_gain_constants import (
    FREE_SHARE,
    LEAST_GAIN,
    MOST_GAIN,
    TiltGainConstants,
)
from mambo_codegen.methods.shared.inputs import Rows, choose
from mambo_codegen.methods.shared.math import Real, clamp, confine


@dataclass(frozen=True)
class TiltGainState:
    """The learnt gains of n controllers, (n, 2) each, roll and pitch; unused where none is learnt.

    Its members are those of nmpc_tilt_gain_t.

    quick_m_step2, slow_m_step2: means of the model's acceleration.
    seen_quick_m_step2, seen_slow_m_step2: the same of the measured tilt.
    gain: learnt over that of the settings.
    """

    quick_m_step2: Real
    slow_m_step2: Real
    seen_quick_m_step2: Real
    seen_slow_m_step2: Real
    gain: Real


def unknown_gain(zeros: Real, one: Any) -> TiltGainState:
    """Return that nothing is learnt; zeros is (n, 2), one the gain."""
    return TiltGainState(zeros, zeros, zeros, zeros, np.full_like(zeros, one))


class TiltGain:
    """The constants of the tilt gain, in the scalar type of the controller."""

    def __init__(self, found: TiltGainConstants, products: QuadraticArithmetic) -> None:
        constant = products.numbers.constant
        self._products = products
        self._quick, self._slow = (
            [constant(weight, "attitude") for weight in row] for row in (found.quick_row, found.slow_row)
        )
        self._least_m_step2 = constant(found.least_m_step2, "acceleration")
        self._most_m_step2 = constant(found.most_m_step2, "acceleration")
        self._rate: Any = constant(found.rate_step2_m, "learning")
        self._one, self._free = constant(1.0, "factor"), constant(FREE_SHARE, "factor")
        self._range = constant(LEAST_GAIN, "factor"), constant(MOST_GAIN, "factor")
        self._inverse = inverse_line(found.inverse, products)

    def share(self, state: TiltGainState) -> Real:
        """Return the gains (n, 2), but at most 1: by that the largest moves are smaller."""
        return np.where(state.gain < self._one, state.gain, self._one)

    def sent(self, state: TiltGainState, command_rad: Real) -> Real:
        """Return the commands (n, 2) that make the drone do what the model does with `command_rad`."""
        product = self._products.angle_product
        return product(inverse(self._products, self._inverse, state.gain), command_rad)

    def meant(self, state: TiltGainState, command_rad: Real) -> Real:
        """Return the commands (n, 2) of the model with which it does what the drone does."""
        return self._products.angle_product(state.gain, command_rad)

    def learn(
        self, state: TiltGainState, model: Real, seen: Real, command_rad: Real, tilt_limit_rad: Real
    ) -> TiltGainState:
        """Return the gains after accelerations (n, 2) of the model's and of the measured tilt.

        command_rad (n, 2) was sent before; the tilt limits are (n, 1).
        """
        products = self._products
        quick, slow = (
            self._mean(self._quick, state.quick_m_step2, model),
            self._mean(self._slow, state.slow_m_step2, model),
        )
        seen_quick = self._mean(self._quick, state.seen_quick_m_step2, seen)
        seen_slow = self._mean(self._slow, state.seen_slow_m_step2, seen)
        moved = quick - slow
        error = clamp((seen_quick - seen_slow) - moved, self._most_m_step2)
        change = products.nearest(self._rate * np.where(moved < 0, -error, error), "learning_product")
        learnt = confine(state.gain + products.factor_product(state.gain, change), *self._range)
        free = products.angle_product(self.share(state) - self._free, tilt_limit_rad)
        is_free = np.abs(self.meant(state, command_rad)) <= free
        learns = is_free & (np.abs(moved) >= self._least_m_step2)
        return TiltGainState(quick, slow, seen_quick, seen_slow, np.where(learns, learnt, state.gain))

    def restart(self, state: TiltGainState, model: Real, seen: Real, restarts: Rows) -> TiltGainState:
        """Return the states with means of the present accelerations (n, 2) where `restarts` (n,)."""
        return choose(restarts, TiltGainState(model, model, seen, seen, state.gain), state)

    def _mean(self, row: list[Any], mean: Real, value: Real) -> Real:
        return self._products.attitude_sum((row[0] * mean) + (row[1] * value))
