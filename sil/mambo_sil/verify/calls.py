"""Calls of the C interface as bytes, and what the reference returns for them.

A call is one byte and the numbers of a step in the controller's scalar type, which `fuzz/nmpc_fuzz.c` of a
bundle decodes. A tape is a sequence of calls of one controller, which is initialised before the first call.
"""

from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods import Method, method_of
from mambo_codegen.methods.shared.heading import slew_heading
from mambo_codegen.methods.shared.inputs import Status, choose
from mambo_codegen.numbers.representation import THRUST
from mambo_codegen.settings.model import Settings
from mambo_sil.verify.step_rows import StepRows

Tape = NDArray[Any]
"""A sequence of calls, an array of `call_type`."""

Outcomes = NDArray[Any]
"""The outcomes of the calls of a tape, an array of `outcome_type`."""

UNWRITTEN: Final = 9.0
"""Value of the command before each call, in the numbers of the C; it remains if the call does not write."""

NULL_SELF: Final = 1
NULL_FIRST: Final = 2
NULL_SECOND: Final = 4
NULL_COMMAND: Final = 8


class ApiFunction(IntEnum):
    """The function of the C interface that a call calls.

    SET_WEIGHTS is there with a 1-norm, SET_COMMAND with a quadratic cost, SET_LIMITS with limits, SET_THRUST
    with a height, SET_MEASURED with a guard.
    """

    STEP = 0
    RESET = 1
    SET_WEIGHTS = 2
    SET_COMMAND = 2
    INIT = 3
    SET_LIMITS = 4
    SET_THRUST = 5
    SLEW_HEADING = 6
    SET_MEASURED = 7
    SHIFT = 8


_POINTERS: Final = {
    ApiFunction.STEP: NULL_SELF | NULL_FIRST | NULL_SECOND | NULL_COMMAND,
    ApiFunction.RESET: NULL_SELF | NULL_FIRST,
    ApiFunction.SET_WEIGHTS: NULL_SELF | NULL_FIRST,
    ApiFunction.INIT: NULL_SELF,
    ApiFunction.SET_LIMITS: NULL_SELF | NULL_FIRST,
    ApiFunction.SET_THRUST: NULL_SELF,
    ApiFunction.SLEW_HEADING: 0,
    ApiFunction.SET_MEASURED: NULL_SELF,
    ApiFunction.SHIFT: NULL_SELF | NULL_FIRST | NULL_SECOND,
}

_OTHER_BIT, _LAST_BIT = 64, 128
_WRITTEN_AS: Final = {
    ApiFunction.SHIFT: ApiFunction.STEP | _LAST_BIT,
    ApiFunction.SET_LIMITS: ApiFunction.SET_WEIGHTS | _OTHER_BIT,
    ApiFunction.SET_THRUST: ApiFunction.INIT | _OTHER_BIT,
    ApiFunction.SLEW_HEADING: ApiFunction.RESET | _OTHER_BIT,
    ApiFunction.SET_MEASURED: ApiFunction.STEP | _OTHER_BIT,
}
"""How functions are written for which two bits are too few; of two that are written at once, the later."""


def _quantities(method: Method) -> dict[ApiFunction, tuple[str, ...]]:
    """Return the quantities of the numbers that each function reads."""
    return {
        ApiFunction.STEP: StepRows(method).quantities,
        ApiFunction.RESET: method.command,
        ApiFunction.SET_WEIGHTS: method.setter_quantities,
        ApiFunction.INIT: method.command,
        ApiFunction.SET_LIMITS: method.limiting.quantities if method.limiting else (),
        ApiFunction.SET_THRUST: THRUST,
        ApiFunction.SLEW_HEADING: ("yaw",) * 3,
        ApiFunction.SET_MEASURED: ("position",),
        ApiFunction.SHIFT: method.shift,
    }


def call_type(settings: Settings) -> np.dtype[Any]:
    """Return the layout of a call: function in bits 0 and 1 of the byte, null pointers in bits 2 to 5."""
    method = method_of(settings)
    return np.dtype([("call", np.uint8), ("values", method.numbers.scalar, len(StepRows(method).quantities))])


def outcome_type(settings: Settings) -> np.dtype[Any]:
    """Return the layout of an outcome, as `replay.c` writes it: status, counts and flags, numbers."""
    method = method_of(settings)
    quantity = {one.name: one.quantities for one in method.results}
    left = method.reference_controller().outcome
    return np.dtype(
        [("status", np.int32)]
        + [
            (name, method.numbers.type_of(quantity[name][0]), (values[0].size,))
            if quantity.get(name)
            else (name, np.int32)
            for name, values in left.items()
        ]
    )


def calls(settings: Settings, function: ApiFunction, values: NDArray[Any], nulls: int = 0) -> Tape:
    """Return a call of `function` for each row of values (n, k); `nulls` is the mask of null pointers."""
    made = np.zeros(len(values), call_type(settings))
    made["call"] = _WRITTEN_AS.get(function, function) | (nulls << 2)
    method = method_of(settings)
    quantities = _quantities(method)[function][: values.shape[1]]
    made["values"][:, : values.shape[1]] = method.numbers.quantize(values, quantities)
    return made


def tape_from(settings: Settings, content: bytes) -> Tape:
    """Return the complete calls in `content`; like the harness, ignore the bytes after them."""
    layout = call_type(settings)
    return np.frombuffer(content, layout, len(content) // layout.itemsize)


def answers(settings: Settings, tapes: Sequence[Tape]) -> list[Outcomes]:
    """Run all `tapes` at once, each on its own reference controller, and return the outcomes."""
    longest = max((len(tape) for tape in tapes), default=0)
    padded = np.zeros((len(tapes), longest), call_type(settings))
    padded["call"] = ApiFunction.RESET | (NULL_SELF << 2)
    for row, tape in zip(padded, tapes, strict=True):
        row[: len(tape)] = tape
    runs = _Runs(settings, len(tapes))
    made = np.stack([runs.make(padded[:, at]) for at in range(longest)], axis=1) if longest else padded
    return [row[: len(tape)] for row, tape in zip(made, tapes, strict=True)]


class _Runs:
    """n reference controllers; at each call, each of them may have another function called.

    Every function is called for all controllers; those that it is not meant for keep their memory.
    """

    def __init__(self, settings: Settings, n: int) -> None:
        self._settings = settings
        self._method = method_of(settings)
        self._quantities, self._rows = _quantities(self._method), StepRows(self._method)
        self._controller: Any = self._method.reference_controller(n)
        self._fresh = self._controller.memory
        self._others = {
            function: written
            for function, written in _WRITTEN_AS.items()
            if {
                ApiFunction.SET_LIMITS: self._method.limiting is not None,
                ApiFunction.SET_THRUST: self._method.has_height,
                ApiFunction.SLEW_HEADING: True,
                ApiFunction.SET_MEASURED: self._method.guard is not None,
                ApiFunction.SHIFT: True,
            }[function]
        }
        self._level: dict[str, Any] = {"command_rad": 0}
        if self._method.has_height:
            self._level["thrust_m_s2"] = self._controller.outcome["thrust_m_s2"][0]

    def make(self, now: Tape) -> Outcomes:
        """Make one call (n,) on each controller, and return the outcomes (n,)."""
        controller = self._controller
        function = now["call"] & 3
        for wanted, written in self._others.items():
            read = 3 | (written & ~3)
            function = np.where((now["call"] & read) == written, np.uint8(wanted), function)
        nulls = (now["call"] >> 2) & 15
        null = (nulls & np.array([_POINTERS[f] for f in ApiFunction])[function]) != 0

        def call(wanted: ApiFunction, made: Callable[[NDArray[Any]], NDArray[np.int64]]) -> NDArray[np.int64]:
            before, quantities = controller.memory, self._quantities[wanted]
            values = now["values"][:, : len(quantities)]
            status = made(self._method.numbers.to_si(values, *quantities))
            controller.memory = choose((function == wanted) & ~null, controller.memory, before)
            return status

        def step(values: NDArray[Any]) -> NDArray[np.int64]:
            inputs = self._rows.split(values)
            status: NDArray[np.int64] = controller.step(inputs.state, inputs.target, inputs.thrust).status
            return status

        set_other = getattr(controller, self._method.setter)
        outcome = np.zeros(len(now), outcome_type(self._settings))
        with np.errstate(all="ignore"):
            resets = call(ApiFunction.RESET, controller.reset)
            others = call(ApiFunction.SET_WEIGHTS, set_other)
            limits, thrusts, measured = (np.zeros_like(others) for _ in range(3))
            if ApiFunction.SET_LIMITS in self._others:
                limits = call(ApiFunction.SET_LIMITS, controller.set_limits)
            if ApiFunction.SET_THRUST in self._others:
                thrusts = call(ApiFunction.SET_THRUST, lambda values: controller.set_thrust(values[:, 0]))
            if ApiFunction.SET_MEASURED in self._others:
                measured = call(
                    ApiFunction.SET_MEASURED,
                    lambda values: controller.set_position_measured(values[:, 0] > 0),
                )
            shifts = call(ApiFunction.SHIFT, controller.shift)
            steps = call(ApiFunction.STEP, step)
            none, slewed = np.zeros_like(steps), self._slewed(now)
        self._initialise((function == ApiFunction.INIT) & ~null)

        status = np.choose(function, [steps, resets, others, none, limits, thrusts, none, measured, shifts])
        outcome["status"] = np.where(null & (function != ApiFunction.INIT), Status.NULL_POINTER, status)
        for name, values in controller.outcome.items():
            outcome[name] = values.reshape(outcome[name].shape)
        writes = (function == ApiFunction.STEP) & ((nulls & NULL_COMMAND) == 0)
        for name, level in self._level.items():
            column = (slice(None), *[None] * (outcome[name].ndim - 1))
            sent = np.where(((nulls & NULL_SELF) != 0)[column], level, outcome[name])
            outcome[name] = np.where(writes[column], sent, UNWRITTEN)
        turns = function == ApiFunction.SLEW_HEADING
        outcome["command_rad"][:, 0] = np.where(turns, slewed, outcome["command_rad"][:, 0])
        return outcome

    def _slewed(self, now: Tape) -> NDArray[Any]:
        """Return the headings (n,) of calls of nmpc_slew_heading, in the numbers of the C."""
        numbers, quantities = self._method.numbers, self._quantities[ApiFunction.SLEW_HEADING]
        given = numbers.to_si(now["values"][:, : len(quantities)], *quantities)
        slewed = slew_heading(self._method, *given.T)
        return numbers.quantize(slewed[:, np.newaxis], quantities[:1])[:, 0]

    def _initialise(self, chosen: NDArray[np.bool_]) -> None:
        self._controller.memory = choose(chosen, self._fresh, self._controller.memory)
