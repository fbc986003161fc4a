"""Attitude model: how the drone accelerates in answer to the commands."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.quadratic.thrust_vector import ThrustVector
from mambo_codegen.methods.shared.inputs import Rows
from mambo_codegen.methods.shared.math import Real, clamp


@dataclass(frozen=True)
class AttitudeState:
    """The models of n controllers, (n, 2) along right and forward, in m/step^2.

    tilt, integral, lagged and command are a, i, c, u of the attitude model in nmpc.c; sine and cosine (n,)
    are those of the heading.
    """

    tilt: Real
    integral: Real
    lagged: Real
    command: Real
    sine: Real
    cosine: Real


AXES: Final = np.array([[True, False], [False, True]])
"""Right and forward, as masks of a pair."""


class AttitudeModel:
    """The constants of the attitude model, in the scalar type of the controller."""

    def __init__(self, constants: QuadraticConstants, arithmetic: QuadraticArithmetic) -> None:
        constant, attitude = arithmetic.numbers.constant, constants.attitude
        self._products = arithmetic
        self._one = constant(1.0, "sine")

        def both(values: Any, quantity: str) -> Real:
            return np.array([constant(value, quantity) for value in values])

        self._tilt_rows = np.array([both(row, "attitude") for row in attitude.tilt_row])
        self._integral_rows = np.array([both(row, "attitude") for row in attitude.integral_row])
        self._lagged_rows = np.array([both(row, "attitude") for row in attitude.lagged_row])
        self._gain = constant(attitude.gain_m_step2_rad, "gain")
        self._command_gain = both(attitude.command_gain_m_step2_rad, "gain")
        self._command_rad = both(attitude.command_rad_step2_m, "command")
        self._trim = both(attitude.trim_rad, "angle")
        self._trim_command = both(attitude.trim_command_rad, "angle")
        found = constants.thrust_vector
        self.vector = ThrustVector(found, attitude, arithmetic) if found else None
        """The direction of the thrust; None with small angles."""
        self._limit = constant(attitude.limit_m_step2, "acceleration")
        self._numbers = arithmetic.numbers
        limit = both(attitude.command_limit_m_step2, "move")
        self.command_limit = limit if found else self._admitted(limit, constants.limits.tilt)
        """The largest moves (2,), right and forward: with small angles no command for one exceeds the tilt
        limit."""

    def set_command(
        self, attitude: AttitudeState, command_rad: Real, weight: Real | None = None
    ) -> AttitudeState:
        """Set the last commands to `command_rad` (n, 2), roll and pitch.

        Here and below the accelerations of tilts count `weight` (n,) times as much, if there is one.
        """
        if self.vector is not None:
            given = self._commanded(self.vector, command_rad, weight)
            return replace(attitude, command=clamp(given, self._limit))
        product = self._products.tilt_product(self._command_gain, command_rad - self._trim_command)
        product = self.weighed(product, weight)
        return replace(attitude, command=np.stack([product[:, 0], -product[:, 1]], axis=1))

    def change_command(
        self,
        attitude: AttitudeState,
        before_rad: Real,
        after_rad: Real,
        weight: Real | None = None,
        meant: Callable[[Real], Real] | None = None,
    ) -> AttitudeState:
        """Change the last commands from `before_rad` to `after_rad` (n, 2), roll and pitch.

        `meant` turns commands that are sent into those of the model, if they differ.
        """
        if self.vector is not None:
            sides_rad = [before_rad, after_rad]
            if meant is not None:
                sides_rad = [meant(side) for side in sides_rad]
            before, after = (self._commanded(self.vector, side, weight) for side in sides_rad)
            return replace(attitude, command=clamp(attitude.command + (after - before), self._limit))
        change_rad = after_rad - before_rad
        if meant is not None:
            change_rad = meant(change_rad)
        product = self.weighed(self._products.tilt_product(self._command_gain, change_rad), weight)
        change = np.stack([product[:, 0], -product[:, 1]], axis=1)
        return replace(attitude, command=clamp(attitude.command + change, self._limit))

    def _commanded(self, vector: ThrustVector, command_rad: Real, weight: Real | None) -> Real:
        """Return the accelerations (n, 2) of the attitude that commands (n, 2) lead to."""
        _, slope = vector.of_command(command_rad)
        return self.accelerations(slope, weight)

    def accelerations(self, slope: Real, weight: Real | None) -> Real:
        """Return the accelerations (n, 2), right and forward, of a thrust with slopes (n, 2)."""
        return self.weighed(self._products.slope_acceleration(self._gain, slope), weight)

    def command_limit_at(self, tilt_rad: Real, generated_rad: Any) -> Real:
        """Return the largest moves (n, 2) at tilt limits (n,); those of the settings at `generated_rad`."""
        largest_rad = tilt_rad[:, None] - np.abs(self._trim_command)
        if self.vector is not None:
            product = self._products.slope_acceleration(self._gain, self.vector.largest(largest_rad))
            moves = clamp(self._products.to_move(product), self.command_limit)
        else:
            moves = self._products.to_move(self._products.tilt_product(self._command_gain, largest_rad))
        return np.where(tilt_rad[:, None] == generated_rad, self.command_limit, moves)

    def weighed(self, acceleration: Real, weight: Real | None) -> Real:
        """Return accelerations (n, 2) or (2,) times `weight` (n,), if there is one."""
        return (
            acceleration if weight is None else self._products.factor_product(acceleration, weight[:, None])
        )

    def steady(self, command_rad: Real, weight: Real | None = None) -> AttitudeState:
        """Return the model at the steady attitude of the commands (n, 2)."""
        zeros = np.zeros_like(command_rad)
        sine = zeros[:, 0]
        level = AttitudeState(zeros, zeros, zeros, zeros, sine, sine)
        command = self.set_command(level, command_rad, weight).command
        return AttitudeState(command, zeros, command, command, sine, np.full_like(sine, self._one))

    def advance(self, attitude: AttitudeState) -> AttitudeState:
        """Let the model answer the last commands over one control step."""
        state = np.stack([attitude.tilt, attitude.integral, attitude.lagged, attitude.command], axis=2)
        lagged = (self._lagged_rows[:, 0] * attitude.lagged) + (self._lagged_rows[:, 1] * attitude.command)
        return replace(
            attitude,
            tilt=self._next(self._tilt_rows, state),
            integral=self._next(self._integral_rows, state),
            lagged=self._products.attitude_sum(lagged),
        )

    def turn(self, attitude: AttitudeState, sine: Real, cosine: Real, is_followed: Rows) -> AttitudeState:
        """Turn tilts to headings of sine and cosine (n,); commands too where a new one follows."""
        by_sine = self._products.sine_difference(sine, attitude.cosine, cosine, attitude.sine)
        by_cosine = self._products.sine_sum(cosine, attitude.cosine, sine, attitude.sine)

        def turned(vector: Real) -> Real:
            return self._products.turn(vector, by_sine, by_cosine)

        command = clamp(turned(attitude.command), self._limit)
        return replace(
            attitude,
            tilt=turned(attitude.tilt),
            command=np.where(is_followed[:, None], command, attitude.command),
            sine=sine,
            cosine=cosine,
        )

    def turn_to_world(self, attitude: AttitudeState, heading: Real) -> Real:
        """Return vectors (n, 2) along x and y from those along right and forward."""
        return self._products.turn(heading[:, ::-1], attitude.sine, attitude.cosine)

    def turn_to_heading(self, attitude: AttitudeState, world: Real) -> Real:
        """Return vectors (n, 2) along right and forward from those along x and y."""
        return self._products.turn(world[:, ::-1], attitude.sine, attitude.cosine)

    def shift(self, attitude: AttitudeState, sine: Real, cosine: Real) -> AttitudeState:
        """Turn the frame by the angles of sine and cosine (n,), and leave the axes of the body in it."""
        before, products = (attitude.sine, attitude.cosine), self._products
        return replace(
            attitude,
            sine=clamp(products.sine_sum(before[0], cosine, before[1], sine), self._one),
            cosine=clamp(products.sine_difference(before[1], cosine, before[0], sine), self._one),
        )

    def measure(self, tilt_rad: Real, weight: Real | None = None) -> Real:
        """Return the accelerations (n, 2), right and forward, of measured roll and pitch (n, 2)."""
        product = self.weighed(self._products.tilt_product(self._gain, tilt_rad - self._trim), weight)
        return np.stack([product[:, 0], -product[:, 1]], axis=1)

    def command_rad(self, command: Real) -> Real:
        """Return roll and pitch (n, 2) that stand for commands (n, 2), right and forward."""
        if self.vector is not None:
            return self.vector.command_rad(command)
        product = self._products.command_product(self._command_rad, command)
        roll, pitch = product[:, 0], -product[:, 1]
        if self._trim_command[0] != 0:
            roll = roll + self._trim_command[0]
        if self._trim_command[1] != 0:
            pitch = self._trim_command[1] - product[:, 1]
        return np.stack([roll, pitch], axis=1)

    def largest_commands(
        self, limit: Real, tilt_rad: Real, sent: Callable[[Real], Real] | None = None
    ) -> tuple[Real, Real]:
        """Return the largest and the least roll and pitch (n, 2) of moves along one axis.

        The moves are at most `limit` (n, 2); with the thrust vector the angles are at most tilt_rad (n,), and
        with a learnt gain, by which `sent` turns the model's commands into those that are sent.
        """
        most, zero = self._products.move_acceleration(limit), np.zeros_like(limit)
        both = [
            np.stack(
                [self.command_rad(np.where(axis, side, zero))[:, k] for k, axis in enumerate(AXES)], axis=1
            )
            for side in (most, -most)
        ]
        if sent is not None:
            both = [sent(side) for side in both]
        if self.vector is not None or sent is not None:
            both = [clamp(side, tilt_rad[:, None]) for side in both]
        return np.maximum(*both), np.minimum(*both)

    def _admitted(self, limit: Real, tilt_limit: Any) -> Real:
        """Lower move limits (2,) by the last digit until no command exceeds the tilt limit by rounding."""
        while True:
            moves = np.stack([limit, -limit])
            angles = self.command_rad(self._products.move_acceleration(moves))
            beyond = (np.abs(angles) > tilt_limit).any(axis=0)
            if not beyond.any():
                return limit
            below = limit - 1 if self._numbers.bits else np.nextafter(limit, limit.dtype.type(0))
            limit = np.where(beyond, below, limit)

    def _next(self, rows: Real, state: Real) -> Real:
        """Return the next a or i from states (n, 2, 4)."""
        total = rows[:, 0] * state[:, :, 0]
        for k in range(1, rows.shape[1]):
            total = total + (rows[:, k] * state[:, :, k])
        return clamp(self._products.attitude_sum(total), self._limit)
