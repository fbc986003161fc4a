"""Episodes of the self-test: the inputs of their control steps, and the other calls between them."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.bundle.draws import HOVER, EpisodeDraws, InputScales, Words, input_scales
from mambo_codegen.methods import Method
from mambo_codegen.methods.shared.inputs import Rows
from mambo_codegen.methods.shared.math import Real
from mambo_codegen.numbers.representation import THRUST
from mambo_codegen.port.row import AIM, BESIDE, CHANCE, COUNT, SHARE, PortRow

TICKS_PER_INPUT: Final = 4
"""Steps for which an input is held, long enough for plans to reach their limits and for costs to converge."""

CALLS_IN_TURN: Final = 16
"""The other calls come in turn: each input has the one of its number modulo this."""
WITH_NULLS: Final = 6
"""The turn of calls with null pointers."""
FIRST_LOST: Final = 1
_MOST_LOST: Final = 22
"""With TICKS_PER_INPUT so many steps that the usual outage ends, and the drone comes to rest."""
_FEW_LOST: Final = (1, 2)


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


@dataclass(frozen=True)
class _Drawn:
    """What is drawn of an input of n controllers as a whole.

    choice:   random bits.
    rests:    whether the target rests.
    is_there: whether the drone is at its target, and level.
    size:     of the errors of position and velocity.
    """

    choice: Words
    rests: Rows
    is_there: Rows
    size: NDArray[Any]

    @classmethod
    def anywhere(cls) -> "_Drawn":
        """Return that of numbers that do not depend on it."""
        none = np.zeros(1, np.uint32)
        return cls(none, none > 0, none > 0, none)


def lost_inputs(method: Method) -> tuple[int, int]:
    """Return how many inputs in a row have no good state in an outage of each kind; few if commands hold."""
    steps = method.outage_steps
    if not steps:
        return _FEW_LOST
    return _MOST_LOST, min(_MOST_LOST - 1, 1 + math.ceil(steps / TICKS_PER_INPUT))


def null_calls(method: Method) -> int:
    """Return how many calls with a null pointer the C makes."""
    own = 3 if method.setter == "report_command" else 1
    return 9 + own + method.has_limits + method.has_height + (method.guard is not None)


def target_moves(method: Method) -> bool:
    """Return whether targets change their velocity from step to step: of interest where that is measured."""
    return bool({"tracker", "target_observer"} & method.parts)


class Episodes:
    """n episodes, which run side by side: that outweighs NumPy's overhead for each operation."""

    def __init__(self, method: Method, episodes: Words) -> None:
        """`episodes` (n,) are their numbers."""
        self._method, self._numbers = method, method.numbers
        self._scales: InputScales = input_scales(method)
        self._draws = EpisodeDraws(episodes, method.numbers)
        self._lost = lost_inputs(method)
        self._is_lost = episodes % 8 == 7
        self._is_brief = self._is_lost & (episodes & 8 != 0)
        self._aim: Real = np.zeros(0)
        """Place and velocity of the targets along each axis when their input began (k, n)."""

    def steps(self, ticks: int) -> Iterator[EpisodeStep]:
        """Yield the first `ticks` steps, a multiple of TICKS_PER_INPUT."""
        method = self._method
        for index in range(ticks // TICKS_PER_INPUT):
            given = self._next_input(index)
            headings, call = self._next_headings(), self._next_call(index)
            first_bad = TICKS_PER_INPUT - 1 - (2 * (index % 2))
            for tick in range(TICKS_PER_INPUT):
                if tick == first_bad:
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
                if self._moves and tick < first_bad:
                    given = replace(given, target=given.target + given.change)

    def _next_input(self, index: int) -> _Input:
        """Draw the next inputs.

        The target's velocity changes for a tracker that measures the acceleration by it. One drone in 16 is
        at its target, and level. With a height one in eight touches the floor.
        """
        port, choice = self._method.port, self._draws.next()
        early = [index < FIRST_LOST + lost for lost in self._lost]
        rests = self._is_lost & ~self._is_brief & early[0]
        is_early = rests | (self._is_brief & early[1])
        is_there = (choice >> 2) & 15 == 0
        drawn = _Drawn(choice, rests, is_there, np.where(rests, 3, np.where(is_there, 4, choice & 3)))
        self._aim = self._next_aim(rests, (drawn.size == 0) | (index == 0))
        target, state, change = self._aims(), dict[str, list[Real]](), dict[str, list[Real]]()
        thrust = np.zeros(0)
        for upward in (False, True):
            for row in (one for one in port.rows("state") if one.is_upward == upward):
                state[row.member] = self._row(row, drawn, target)
            if not upward:
                thrust = self._next_thrust(state["position_m"][0], (choice >> 6) & 15)
                change = {name: [np.zeros_like(thrust)] * len(each) for name, each in target.items()}
            for row in (one for one in port.rows("target") if one.is_upward == upward):
                if row.draw is not AIM:
                    target[row.member] = self._row(row, drawn, target)
                    change[row.member] = [np.zeros_like(thrust)] * port.count(row)
            if self._moves and (port.axes > 2 or not upward):
                scale, member, count = (
                    ("CLIMB_CHANGE_M_S", "climb_m_s", 1) if upward else ("CHANGE_M_S", "velocity_m_s", 2)
                )
                change[member] = [self._moving(rests, scale) for _ in range(count)]
        if index >= FIRST_LOST:
            first = state["position_m"]
            first[0] = np.where(is_early, self._draws.beyond(np.zeros(1, np.uint32)), first[0])
        return _Input(
            np.stack([one for row in port.rows("state") for one in state[row.member]], axis=1),
            np.stack([one for row in port.rows("target") for one in target[row.member]], axis=1),
            thrust,
            np.stack([one for row in port.rows("target") for one in change[row.member]], axis=1),
        )

    def _aims(self) -> dict[str, list[Real]]:
        """Return the numbers of the targets that the aim has, by member: position and velocity by axis."""
        rows = [row for row in self._method.port.rows("target") if row.draw is AIM]
        places = {name: iter(self._aim[k::2]) for k, name in enumerate(("position", "velocity"))}
        return {
            row.member: [next(places[row.quantity]) for _ in range(self._method.port.count(row))]
            for row in rows
        }

    def _row(self, row: PortRow, drawn: "_Drawn", target: Mapping[str, list[Real]]) -> list[Real]:
        """Draw the numbers of a row of the port."""
        assert row.draw is not None, "a row of a state or target"
        if row.draw is BESIDE:
            return self._beside(target[row.member], row.quantity, drawn.size)
        if row.draw is CHANCE:
            return [((drawn.choice >> 14) & 7 == 0).astype(self._numbers.computed)]
        if row.draw is COUNT:
            count, kept = (drawn.choice >> 17) & 3, (drawn.choice >> 19) & 7 == 0
            refused = np.where((drawn.choice >> 22) & 1 == 1, -1, 3)
            return [np.where(count < 3, count, np.where(kept, refused, 0)).astype(self._numbers.computed)]
        scale = self._numbers.constant(*self._scales.of[row.draw.scale])
        if row.draw.rests:
            scale = np.where(drawn.is_there, np.zeros_like(scale), scale)
        draw = self._draws.share if row.draw.way == SHARE else self._draws.draw
        return [draw(scale) for _ in range(self._method.port.count(row))]

    @property
    def _moves(self) -> bool:
        """Whether targets change their velocity from step to step; a change of 0 would make a -0 a 0."""
        return target_moves(self._method)

    def _next_aim(self, rests: Rows, jumps: Rows) -> Real:
        """Draw place and velocity of the targets along each axis (k, n): new ones of those that jump."""
        pairs = ("TARGET_M", "TARGET_M_S") * self._method.port.axes
        aim = np.stack([self._moving(rests, scale) for scale in pairs])
        return np.where(jumps, aim, self._aim if self._aim.size else aim)

    def _beside(self, target: list[Real], quantity: str, size: Words) -> list[Real]:
        """Draw positions or velocities near those of targets, by sizes of the errors."""
        scales = self._scales
        sizes = scales.error_position_m if quantity == "position" else scales.error_velocity_m_s
        errors = np.array([self._numbers.constant(one, quantity) for one in sizes])
        return [place + self._draws.draw(errors[size]) for place in target]

    def _next_thrust(self, like: Real, case: NDArray[Any]) -> Real:
        """Draw thrusts within their range, at its ends in cases 0 and 1; none for one of the height."""
        limits = self._method.limits
        if self._method.has_height:
            return np.full_like(like, limits.thrust_least)
        thrust = self._numbers.constant(*self._scales.of[HOVER]) + self._draw("THRUST_M_S2")
        is_least = (case == 0) | (thrust < limits.thrust_least)
        is_most = (case == 1) | (thrust > limits.thrust_most)
        drawn: Real = np.where(is_least, limits.thrust_least, np.where(is_most, limits.thrust_most, thrust))
        return drawn

    def _moving(self, rests: Rows, scale: str) -> Real:
        """Draw a number of targets, 0 for those that rest."""
        constant, (value, quantity) = self._numbers.constant, self._scales.of[scale]
        return self._draws.draw(np.where(rests, constant(0.0, quantity), constant(value, quantity)))

    def _spoilt(self, given: _Input) -> _Input:
        """Return inputs of which one in four is out of range."""
        spoil = self._draws.spoil

        def spoilt(record: str, numbers: Real) -> Real:
            last = len(self._method.port.reals(record))
            return np.column_stack([spoil(numbers[:, :last]), numbers[:, last:]])

        state, target = spoilt("state", given.state), spoilt("target", given.target)
        thrust = given.thrust if self._method.has_height else spoil(given.thrust[:, None])[:, 0]
        return replace(given, state=state, target=target, thrust=thrust)

    def _next_headings(self) -> Real:
        columns = [self._draw("HEADING_RAD") for _ in range(2)]
        columns += [self._share(*self._scales.of["TURN_RAD"])]
        return self._arguments(columns, ("yaw",) * 3)

    def _next_call(self, index: int) -> OtherCall | None:
        """Return the other call before input number `index`; None if there is none."""
        method = self._method
        setter = method.setter, self._weights if method.weight_limits else self._command
        calls: dict[int, tuple[str, Callable[[], Real]]] = {
            1: ("frame_jumped", lambda: self._shift(turns=False)),
            9: ("frame_jumped", lambda: self._shift(turns=True)),
            5: ("reset", self._command),
        } | dict.fromkeys((2, 10), setter)
        if method.limiting is not None:
            calls |= dict.fromkeys((0, 8), ("set_limits", self._limits))
        if method.has_height:
            calls |= dict.fromkeys((3, 11), ("report_thrust", lambda: self._command()[:, 2:]))
        if method.guard is not None:
            measured = "set_position_measured", lambda: (self._draws.next() & 1)[:, None]
            calls |= dict.fromkeys((4, 12), measured)
        if method.target_observer is not None:
            calls |= dict.fromkeys((7, 13), ("set_memories", self._memories))
        turn, before = index % CALLS_IN_TURN, self._draws.last
        if turn not in calls:
            return None
        name, arguments = calls[turn]
        values = arguments()
        self._draws.restore(self._is_lost, before)
        return OtherCall(name, values)

    def _memories(self) -> Real:
        """Draw memory and noise along each axis (n, 2 axes): few steps in a row would not reach every row."""
        observer, columns = self._method.target_observer, list[Real]()
        rows = np.uint32(observer.longest - observer.least + 1)
        for _ in range(self._method.port.axes):
            counted = observer.least_drawn + (self._draws.next() % rows)
            few, many = (self._scales.of[name] for name in ("NOISE_M_S", "MOST_NOISE_M_S"))
            scale = np.where(counted & 1 == 0, *(self._numbers.constant(*one) for one in (few, many)))
            columns += [counted.astype(self._numbers.computed), self._draws.share(scale)]
        return self._numbers.to_si(np.stack(columns, axis=1), *("whole", "velocity") * self._method.port.axes)

    def _command(self) -> Real:
        return self._drawn_record("command")

    def _weights(self) -> Real:
        return self._drawn_record("weights")

    def _drawn_record(self, record: str) -> Real:
        """Draw the numbers of a record whose rows have scales."""
        port, drawn = self._method.port, _Drawn.anywhere()
        columns = [one for row in port.rows(record) for one in self._row(row, drawn, {})]
        return self._arguments(columns, port.quantities(record))

    def _shift(self, *, turns: bool) -> Real:
        columns = []
        for _ in range(self._method.port.axes):
            columns.append(self._draw("TARGET_M"))
            columns.append(self._draw("TARGET_M_S"))
        heading = self._draw("YAW_RAD") if turns else np.zeros_like(columns[0])
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

    def _draw(self, scale: str) -> Real:
        return self._draws.draw(self._numbers.constant(*self._scales.of[scale]))

    def _share(self, scale: float, quantity: str) -> Real:
        return self._draws.share(self._numbers.constant(scale, quantity))
