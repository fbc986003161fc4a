"""Episodes of the self-test: the inputs of their control steps, and the other calls between them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from mambo_codegen.bundle.draws import EpisodeDraws, InputScales, Words, input_scales
from mambo_codegen.methods import Method
from mambo_codegen.methods.shared.inputs import Rows
from mambo_codegen.methods.shared.math import Real
from mambo_codegen.numbers.representation import PREVIEW_TIMES, THRUST

TICKS_PER_INPUT: Final = 4
"""Steps for which an input is held, long enough for plans to reach their limits and for costs to converge."""

CALLS_IN_TURN: Final = 16
"""The other calls come in turn: each input has the one of its number modulo this."""
WITH_NULLS: Final = 6
"""The turn of calls with null pointers."""
FIRST_LOST: Final = 1
_MOST_LOST: Final = 22
"""With TICKS_PER_INPUT so many steps that the usual outage ends, and the drone comes to rest."""
_FEWEST_LOST: Final = 1


@dataclass(frozen=True)
class OtherCall:
    """A call of n controllers between two steps.

    function: of the reference controller.
    values:   (n, k) its arguments, in SI units.
    """

    function: str
    values: Real


@dataclass(frozen=True)
class EpisodeStep:
    """A control step of n controllers, and the calls before it.

    state, target, thrust: as in `ReferenceController.step`.
    index:                 number of the input if it is new; then there are calls before. Else None.
    headings:              (n, 3) arguments of nmpc_slew_heading, in SI units.
    calls:                 (n,) whether other functions are called that change a controller.
    call:                  one of a function that changes the controller; None if there is none.
    """

    state: Real
    target: Real
    thrust: Real | None
    index: int | None
    headings: Real
    calls: Rows
    call: OtherCall | None


@dataclass(frozen=True)
class _Input:
    """Inputs of n controllers, and changes of the targets from step to step, in numbers of the C."""

    state: Real
    target: Real
    thrust: Real
    change: Real


def lost_inputs(method: Method) -> int:
    """Return how many inputs in a row have no good state in an outage; few for a method that holds on."""
    return _MOST_LOST if method.outage_steps else _FEWEST_LOST


def null_calls(method: Method) -> int:
    """Return how many calls with a null pointer the C makes."""
    own = 3 if method.setter == "set_command" else 1
    return 9 + own + method.has_limits + method.has_height + (method.guard is not None)


class Episodes:
    """n episodes, which run side by side: that outweighs NumPy's overhead for each operation."""

    def __init__(self, method: Method, episodes: Words) -> None:
        """`episodes` (n,) are their numbers."""
        self._method, self._numbers = method, method.numbers
        self._scales: InputScales = input_scales(method)
        self._draws = EpisodeDraws(episodes, method.numbers)
        self._lost = lost_inputs(method)
        self._is_lost = episodes % 8 == 7
        self._aim: Real = np.zeros(0)
        """Place and velocity of the targets along each axis when their input began (k, n)."""

    def steps(self, ticks: int) -> Iterator[EpisodeStep]:
        """Yield the first `ticks` steps, a multiple of TICKS_PER_INPUT."""
        method = self._method
        for index in range(ticks // TICKS_PER_INPUT):
            given = self._next_input(index)
            headings, call = self._next_headings(), self._next_call(index)
            for tick in range(TICKS_PER_INPUT):
                if tick == TICKS_PER_INPUT - 1:
                    given = self._spoilt(given)
                yield EpisodeStep(
                    self._numbers.to_si(given.state, *method.state),
                    self._numbers.to_si(given.target, *method.target),
                    None if method.has_height else self._numbers.to_si(given.thrust, *THRUST),
                    index if tick == 0 else None,
                    headings,
                    ~self._is_lost,
                    call if tick == 0 else None,
                )
                given = replace(given, target=given.target + given.change)

    def _next_input(self, index: int) -> _Input:
        """Draw the next inputs.

        The target's velocity changes for a tracker that measures the acceleration by it. With a height one
        drone in eight touches the floor.
        """
        method, numbers, limits, scales = self._method, self._numbers, self._method.limits, self._scales
        choice = self._draws.next()
        draw, rests = self._draw, self._is_lost & (index < FIRST_LOST + self._lost)
        size = np.where(rests, 3, choice & 3)

        def moving(scale: float, quantity: str) -> Real:
            return self._draws.draw(
                np.where(rests, numbers.constant(0.0, quantity), numbers.constant(scale, quantity))
            )

        def error(sizes: tuple[float, ...], quantity: str) -> Real:
            return self._draws.draw(np.array([numbers.constant(one, quantity) for one in sizes])[size])

        jumps, axes = (size == 0) | (index == 0), 3 if method.has_height else 2
        aim = np.stack(
            [
                moving(*one)
                for _ in range(axes)
                for one in (
                    (scales.target_position_m, "position"),
                    (scales.target_velocity_m_s, "velocity"),
                )
            ]
        )
        self._aim = np.where(jumps, aim, self._aim if index else aim)
        target = [*self._aim[0:4:2], *self._aim[1:4:2]]
        state: list[Real] = [target[axis] + error(scales.error_position_m, "position") for axis in (0, 1)]
        state += [target[axis] + error(scales.error_velocity_m_s, "velocity") for axis in (2, 3)]
        state += [draw(scales.attitude_rad, "angle") for _ in range(2)]
        state += [draw(scales.yaw_rad, "yaw")]
        thrust = np.full_like(state[0], limits.thrust_least)
        if not method.has_height:
            thrust = numbers.constant(scales.hover_m_s2, "thrust") + draw(scales.thrust_m_s2, "thrust")
            thrust = np.minimum(np.maximum(thrust, limits.thrust_least), limits.thrust_most)
        change = [np.zeros_like(thrust)] * len(method.target)
        is_given = method.settings.target.gives_acceleration
        has_motion, quantity = method.tracker is not None or is_given, "thrust" if is_given else "velocity"
        if has_motion:
            motion = [(draw if is_given else moving)(scales.target_motion, quantity) for _ in range(2)]
            if is_given:
                target += motion
            else:
                change[2:4] = motion
        if method.has_height:
            target += [*self._aim[4:]]
            state += [target[-2] + error(scales.error_position_m, "position")]
            state += [target[-1] + error(scales.error_velocity_m_s, "velocity")]
            state += [((choice >> 14) & 7 == 0).astype(numbers.computed)]
            vertical = [(draw if is_given else moving)(scales.climb_motion, quantity)] if has_motion else []
            if len(method.target) > len(target):
                target += vertical
            else:
                change[-1:] = vertical or change[-1:]
        motions = scales.target_motion, scales.target_motion, scales.climb_motion
        target += [draw(scale, quantity) for scale in motions * PREVIEW_TIMES * method.has_preview]
        if index >= FIRST_LOST:
            state[0] = np.where(rests, self._draws.beyond(np.zeros(1, np.uint32)), state[0])
        return _Input(np.stack(state, axis=1), np.stack(target, axis=1), thrust, np.stack(change, axis=1))

    def _spoilt(self, given: _Input) -> _Input:
        """Return inputs of which one in four is out of range."""
        spoil, last = self._draws.spoil, 9 if self._method.has_height else 7
        state = np.column_stack([spoil(given.state[:, :last]), given.state[:, last:]])
        target = spoil(given.target)
        thrust = given.thrust if self._method.has_height else spoil(given.thrust[:, None])[:, 0]
        return replace(given, state=state, target=target, thrust=thrust)

    def _next_headings(self) -> Real:
        scales = self._scales
        columns = [self._draw(scales.heading_rad, "yaw") for _ in range(2)]
        columns += [self._share(scales.turn_rad, "yaw")]
        return self._arguments(columns, ("yaw",) * 3)

    def _next_call(self, index: int) -> OtherCall | None:
        """Return the other call before input number `index`; None if there is none."""
        method = self._method
        calls: dict[int, tuple[str, Callable[[], Real]]] = {
            1: ("shift", lambda: self._shift(turns=index & 8 != 0)),
            5: ("reset", self._command),
            2: (method.setter, self._weights if method.weight_limits else self._command),
        }
        if method.limiting is not None:
            calls[0] = "set_limits", self._limits
        if method.has_height:
            calls[3] = "set_thrust", lambda: self._command()[:, 2:]
        if method.guard is not None:
            calls[4] = "set_position_measured", lambda: (self._draws.next() & 1)[:, None]
        turn, before = index % CALLS_IN_TURN, self._draws.last
        name, arguments = calls.get(turn % 8 if turn < 13 else turn, ("", None))
        if arguments is None or (name == "reset" and turn > 8):
            return None
        values = arguments()
        self._draws.restore(self._is_lost, before)
        return OtherCall(name, values)

    def _command(self) -> Real:
        scales = self._scales
        columns = [self._draw(scales.attitude_rad, "angle") for _ in range(2)]
        columns += [self._share(scales.thrust_m_s2, "thrust")] if self._method.has_height else []
        return self._arguments(columns, self._method.command)

    def _weights(self) -> Real:
        quantities = self._method.setter_quantities
        columns = [self._share(*one) for one in zip(self._scales.weights, quantities, strict=True)]
        return self._arguments(columns, quantities)

    def _shift(self, *, turns: bool) -> Real:
        scales, axes = self._scales, 3 if self._method.has_height else 2
        columns = []
        for _ in range(axes):
            columns.append(self._draw(scales.target_position_m, "position"))
            columns.append(self._draw(scales.target_velocity_m_s, "velocity"))
        heading = self._draw(scales.yaw_rad, "yaw") if turns else np.zeros_like(columns[0])
        return self._arguments([*columns[::2], *columns[1::2], heading], self._method.shift)

    def _limits(self) -> Real:
        limiting, numbers = self._method.limiting, self._numbers
        assert limiting is not None, "asked for with limits only"
        choice = self._draws.next()
        defaults = numbers.quantize([limiting.limits], limiting.quantities).astype(numbers.computed)[0]
        columns = []
        for k, one in enumerate(zip(self._scales.limits, limiting.quantities, strict=True)):
            columns.append(np.where((choice >> k) & 1 == 1, self._share(*one), defaults[k]))
        return self._arguments(columns, limiting.quantities)

    def _arguments(self, columns: list[Real], quantities: tuple[str, ...]) -> Real:
        """Return arguments of a call, one of which may be out of range, in SI units."""
        return self._numbers.to_si(self._draws.spoil(np.stack(columns, axis=1)), *quantities)

    def _draw(self, scale: float, quantity: str) -> Real:
        return self._draws.draw(self._numbers.constant(scale, quantity))

    def _share(self, scale: float, quantity: str) -> Real:
        return self._draws.share(self._numbers.constant(scale, quantity))
