"""No height: what stands for the third axis of a controller that has none."""

import numpy as np

from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.quadratic.height import HeightBounds, HeightState, Lift, unknown_height
from mambo_codegen.methods.shared.inputs import FrameShift, Rows
from mambo_codegen.methods.shared.math import Real


class NoHeight:
    """Nothing to estimate, nothing to command, and tilts count as in hover: the interface of `HeightAxis`."""

    def __init__(self, constants: QuadraticConstants) -> None:
        self._computed = constants.numbers.computed
        self.deciding: Rows = np.zeros((1, 0), np.bool_)

    def hover(self, n: int) -> Real:
        """Return level commands (n, 2)."""
        return np.zeros((n, 2), self._computed)

    def bounds(self, limits: Real) -> HeightBounds:
        """Return zeros (n,)."""
        zeros = np.zeros(len(limits), limits.dtype)
        return HeightBounds(zeros, zeros, zeros, zeros)

    def check_limits(self, limits: Real) -> Rows:
        """Return that limits may be set (n,)."""
        return np.ones(len(limits), np.bool_)

    def share(self, tilt_rad: Real) -> Real:
        """Return zeros (n,)."""
        return np.zeros_like(tilt_rad[:, 0])

    def steady(self, thrust_m_s2: Real, share: Real) -> HeightState:
        """Return zeros."""
        del thrust_m_s2
        return unknown_height(share)

    def limited(self, thrust_m_s2: Real) -> Real:
        """Return the thrusts (n, 0)."""
        return thrust_m_s2

    def set_command(self, state: HeightState, thrust_m_s2: Real) -> HeightState:
        """Return zeros."""
        del thrust_m_s2
        return state

    set_thrust = set_command

    def observe(
        self, state: HeightState, measured: Real, share: Real, has_state: Rows, none_yet: Rows
    ) -> Lift:
        """Return zeros, on no floor."""
        del measured, share, none_yet
        return Lift(state, np.zeros_like(has_state), None)

    def command_weight(self, state: HeightState) -> None:
        """Return that a tilt counts no more than in hover."""

    def spare(self, state: HeightState) -> None:
        """Return that no thrust limits the tilt."""

    def aim(
        self, state: HeightState, target: Real, measured: Real, follows: Rows, bounds: HeightBounds
    ) -> tuple[HeightState, Rows]:
        """Return zeros, and that no limit acts (n,)."""
        del target, measured, bounds
        return state, np.zeros_like(follows)

    def predict(self, state: HeightState, lies_on_floor: Rows) -> HeightState:
        """Return zeros."""
        del lies_on_floor
        return state

    def shift(self, state: HeightState, jump: FrameShift) -> HeightState:
        """Return zeros."""
        del jump
        return state

    def turn(self, state: HeightState) -> HeightState:
        """Return zeros."""
        return state

    def clear_target(self, state: HeightState, cleared: Rows) -> HeightState:
        """Return zeros."""
        del cleared
        return state

    def over_weight(self, acceleration: Real, weight: Real | None) -> Real:
        """Return the accelerations."""
        del weight
        return acceleration

    def stored(self, state: HeightState) -> list[Real]:
        """Return no columns: there is no nmpc_height_t."""
        del state
        return []

    def estimate(self, state: HeightState) -> list[Real]:
        """Return no columns: nmpc_estimate_t has no height."""
        del state
        return []
