"""Controller with a quadratic cost: estimates the state, models the attitude loops, minimises the cost."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.quadratic.step import CheckedInputs, ControlStep
from mambo_codegen.methods.shared.inputs import Inputs, Rows, Status, choose, within
from mambo_codegen.methods.shared.limits import ActiveLimit, LimitsMemory
from mambo_codegen.methods.shared.limits_constants import LIMITS
from mambo_codegen.methods.shared.math import Real, clamp
from mambo_codegen.numbers.representation import COMMAND, THRUST
from mambo_codegen.port.row import BYTE, NUMBER

_AIMED_ELSEWHERE = int(ActiveLimit.SPEED | ActiveLimit.BRAKING | ActiveLimit.FENCE)
"""Limits with which no position error counts."""


@dataclass(frozen=True)
class QuadraticStep:
    """The result of one step of n controllers.

    status:      (n,) a `Status` each.
    command_rad: (n, 2) roll and pitch commands, in rad.
    steps_blind: (n,) control steps since the last good state.
    saturated:   (n,) whether the last command lies at the tilt limit.
    stored:      (n, k) all numbers of nmpc_t in their order, of the quantities `QuadraticConstants.stored`.
    active_limits: (n,) the limits that act, as `ActiveLimit`, but TILT.
    thrust_m_s2: (n,) commanded thrust over mass; None without a height.
    """

    status: NDArray[np.int64]
    command_rad: Real
    steps_blind: NDArray[np.int64]
    saturated: NDArray[np.bool_]
    stored: Real
    active_limits: NDArray[np.int64] | None = None
    thrust_m_s2: Real | None = None


class QuadraticController:
    """n controllers with a quadratic cost in NumPy that compute the bits of the generated C."""

    def __init__(self, constants: QuadraticConstants, n: int = 1) -> None:
        self.settings, self._constants = constants.settings, constants
        self._numbers, self._inputs = constants.numbers, Inputs(constants)
        self.parts = ControlStep(constants)
        self._limits, self._height, self._model = self.parts.limits, self.parts.height, self.parts.model
        self.scalar = self._numbers.scalar
        defaults = np.repeat(self._limits.defaults, n, axis=0)
        bounds = self._height.bounds(defaults[:, len(LIMITS) :])
        self.memory = self.parts.restarted(self._height.hover(n), self._limited(defaults), bounds)

    def reset(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Forget everything; the drones hold the attitudes of `command_rad` (n, 2), clamped to the limit.

        With a height (n, 3): they hold that thrust over mass too. Returns a status (n,); a command that is
        not finite, or beyond its range, changes nothing.
        """
        given, good = self._command(command_rad)
        memory = self.memory
        self.memory = choose(good, self.parts.restarted(given, memory.limits, memory.height_bounds), memory)
        return np.where(good, Status.OK, Status.BAD_COMMAND)

    def report_command(self, command_rad: ArrayLike) -> NDArray[np.int64]:
        """Tell the controllers that `command_rad` (n, 2) or (n, 3) was sent in place of the last command.

        Returns a status (n,) as `reset` does.
        """
        given, good = self._command(command_rad)
        self.memory = choose(good, self.parts.report_command(self.memory, given), self.memory)
        return np.where(good, Status.OK, Status.BAD_COMMAND)

    def report_thrust(self, thrust_m_s2: ArrayLike) -> NDArray[np.int64]:
        """Tell the controllers that the drones got thrusts over mass (n,) in place of those commanded.

        Returns a status (n,); a thrust that is not finite, or out of range, changes nothing.
        Raises ValueError without a height in the settings.
        """
        if not self._constants.has_height:
            raise ValueError("the settings have no height")
        memory = self.memory
        given = self._inputs.numbers(np.asarray(thrust_m_s2)[:, None], THRUST)
        good = within(given, self._inputs.limits.thrust_most)
        height = self._height.set_thrust(memory.height, self._height.limited(given))
        self.memory = choose(good, replace(memory, height=height), memory)
        return np.where(good, Status.OK, Status.BAD_THRUST)

    def set_position_measured(self, is_measured: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Tell the controllers whether a position is measured (n,); while none is, coarse gains correct.

        Returns a status (n,). Raises ValueError without a guard in the settings.
        """
        if self._constants.guard is None:
            raise ValueError("the settings have no guard")
        self.memory = replace(self.memory, is_coarse=np.logical_not(is_measured))
        return np.full(len(is_measured), Status.OK)

    def set_memories(self, memories: ArrayLike) -> NDArray[np.int64]:
        """Write memory and noise of the target's observer along each axis (n, 2 axes), as the self-test does.

        Returns a status (n,).
        """
        values = np.asarray(memories)
        found = self._numbers.quantize(values, ("whole", "velocity") * (values.shape[1] // 2))
        found = found.astype(self._numbers.computed)
        memory, rest = self.memory, found[:, 4:]
        target = replace(memory.target, memory=found[:, 0:4:2], noise=found[:, 1:4:2])
        height = memory.height
        if rest.shape[1]:
            height = replace(height, target=replace(height.target, memory=rest[:, 0:1], noise=rest[:, 1:2]))
        self.memory = replace(memory, target=target, height=height)
        return np.full(len(found), Status.OK)

    def frame_jumped(self, change: ArrayLike) -> NDArray[np.int64]:
        """Tell the controllers that their frames have jumped: `change` (n, 5), with a height (n, 7).

        The columns are changes of x and y (m), with a height of the height, up, too, as many of the
        velocities (m/s), and that of the heading (rad). Returns a status (n,); a change that is not finite,
        or out of range, changes nothing.
        """
        jump, good = self._inputs.shift(change)
        self.memory = choose(good, self.parts.shift(self.memory, jump), self.memory)
        return np.where(good, Status.OK, Status.BAD_JUMP)

    def set_limits(self, limits: ArrayLike) -> NDArray[np.int64]:
        """Replace the limits by `limits` (n, k), in the order of nmpc_limits_t; k is 7, or 11 with a height.

        Returns a status (n,); bad limits change nothing.
        """
        given, good = self._limits.read(limits)
        vertical = given[:, len(LIMITS) :]
        good = good & self._height.check_limits(vertical)
        memory, new = self.memory, self._limited(np.where(good[:, None], given, self._limits.defaults))
        kept = memory.limits
        limited = replace(
            memory,
            limits=replace(new, active=kept.active),
            command_rad=clamp(memory.command_rad, new.bounds.tilt_rad[:, None]),
            height_bounds=self._height.bounds(vertical),
        )
        self.memory = choose(good, limited, memory)
        return np.where(good, Status.OK, Status.BAD_LIMITS)

    def step(
        self, state: ArrayLike, target: ArrayLike, thrust_acceleration_m_s2: ArrayLike | None = None
    ) -> QuadraticStep:
        """Compute the next commands; the inputs are those of `ReferenceController.step`."""
        states, targets, thrusts = self._inputs.quantize(state, target, thrust_acceleration_m_s2)
        has_state, has_target, has_thrust = self._inputs.check(states, targets, thrusts)
        zero = self._numbers.computed(0)
        states = np.where(has_state[:, None], states, zero)
        targets = np.where(has_target[:, None], targets, zero)
        inputs = CheckedInputs(states, has_state, targets, has_target & has_thrust)
        memory = self.memory = self.parts.advance(self.memory, inputs)
        thrust = self._numbers.to_si(memory.height.thrust_m_s2, *THRUST)
        return QuadraticStep(
            status=self._inputs.status(has_state, has_target, has_thrust),
            command_rad=self._numbers.to_si(memory.command_rad, *COMMAND),
            steps_blind=memory.steps_blind,
            saturated=self.saturated,
            stored=self._numbers.to_si(self.stored, *self._constants.stored),
            active_limits=memory.limits.active,
            thrust_m_s2=thrust if self._constants.has_height else None,
        )

    def _limited(self, limits: Real) -> LimitsMemory:
        """Return the memory of limits (n, k), of the quantities LIMITS at first."""
        found = self._limits.memory(limits)
        most = self._model.command_limit_at(found.bounds.tilt_rad, self._inputs.limits.tilt)
        return replace(found, command_limit=most)

    def _command(self, command: ArrayLike) -> tuple[Real, Rows]:
        """Return commands (n, 2) or (n, 3) within their limits, and whether each may be set."""
        given, good = self._inputs.command(command)
        given = np.where(good[:, None], given, self._numbers.computed(0))
        angles = clamp(given[:, 0:2], self.memory.limits.bounds.tilt_rad[:, None])
        return np.column_stack([angles, self._height.limited(given[:, 2:])]), good

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """Whether roll or pitch (n,) of the last command is that of the largest move, or beyond."""
        return self.parts.saturated(self.memory)

    @property
    def outcome(self) -> dict[str, NDArray[Any]]:
        """What the last call left, in the numbers of the C."""
        memory = self.memory
        return {
            "steps_blind": memory.steps_blind,
            "saturated": self.saturated,
            "command_rad": memory.command_rad,
            **({"thrust_m_s2": memory.height.thrust_m_s2} if self._constants.has_height else {}),
            "stored": self.stored,
            "active_limits": memory.limits.active,
        }

    @property
    def last_estimate(self) -> Real:
        """All numbers of nmpc_estimate_t (n, k), in their order and in the numbers of the C."""
        return np.concatenate(self.parts.estimate(self.memory), axis=1)

    @property
    def deciding(self) -> NDArray[np.bool_]:
        """Which rows of the law decided the last moves (n, k), in place of a limit; last the coarse gains."""
        memory, plane, height = self.memory, self.parts.optimizer.deciding, self._height.deciding
        plane = plane & (memory.limits.active & _AIMED_ELSEWHERE == 0)[:, None]
        if self.parts.tilt_budget is not None:
            plane = plane & np.tile(self.parts.tilt_budget.is_enough, 4)
        is_free = self.parts.observer.is_free(memory.estimate)
        coarse = memory.is_coarse & (memory.steps_blind == 0) & is_free
        return np.column_stack([plane, np.broadcast_to(height, (len(plane), height.shape[1])), coarse])

    @property
    def has_estimate(self) -> NDArray[np.bool_]:
        """Whether the estimate is valid (n,)."""
        return self.parts.has_estimate(self.memory)

    @property
    def stored_limits(self) -> Real:
        """All numbers of nmpc_bounds_t (n, k), in their order."""
        columns = [np.zeros((len(self.memory.command_rad), 0), self._numbers.computed)]
        columns += self._limits.stored(self.memory.limits, has_command=True)
        if self._constants.has_height:
            bounds = self.memory.height_bounds
            columns.append(np.column_stack([bounds.floor_m, bounds.ceiling_m, bounds.up_m, bounds.down_m]))
        return np.concatenate(columns, axis=1)

    @property
    def stored(self) -> Real:
        """All numbers of nmpc_t (n, k), in their order and in the numbers of the C."""
        memory, port = self.memory, self._constants.port
        estimate, attitude = memory.estimate, memory.attitude
        of_records = {
            "observer": [estimate.position_m, estimate.velocity_m_step, estimate.disturbance_m_step2],
            "attitude": [
                *(attitude.tilt, attitude.integral, attitude.lagged, attitude.command),
                *(attitude.sine[:, None], attitude.cosine[:, None]),
            ],
            "tracker": self.parts.target_observer.stored(memory.target),
            "height": self._height.stored(memory.height),
            "bounds": [self.stored_limits],
        }
        columns: list[Real] = []
        for row in port.rows("controller"):
            if row.member in of_records:
                columns += of_records[row.member]
            elif row.kind == NUMBER:
                columns.append(getattr(memory, row.member))
            elif row.kind != BYTE:
                state = getattr(memory, row.member)
                columns += [getattr(state, one.member) for one in port.rows(row.kind)]
        return np.concatenate(columns, axis=1)
