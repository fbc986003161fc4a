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
from mambo_codegen.methods.inputs import Status, choose
from mambo_codegen.methods.limits_constants import LIMITS
from mambo_codegen.numbers.representation import ACCELERATION, COMMAND, STATE, TARGET, THRUST
from mambo_codegen.settings.model import Settings

Tape = NDArray[Any]
"""A sequence of calls, an array of `call_type`."""

Outcomes = NDArray[Any]
"""The outcomes of the calls of a tape, an array of `outcome_type`."""

UNWRITTEN_RAD: Final = 9.0
"""Value of the command before each call; it remains if the call does not write."""

NULL_SELF: Final = 1
NULL_FIRST: Final = 2
NULL_SECOND: Final = 4
NULL_COMMAND: Final = 8


class ApiFunction(IntEnum):
    """The function of the C interface that a call calls.

    SET_WEIGHTS is there with a 1-norm, SET_COMMAND with a quadratic cost, SET_LIMITS with limits.
    """

    STEP = 0
    RESET = 1
    SET_WEIGHTS = 2
    SET_COMMAND = 2
    INIT = 3
    SET_LIMITS = 4


_POINTERS: Final = {
    ApiFunction.STEP: NULL_SELF | NULL_FIRST | NULL_SECOND | NULL_COMMAND,
    ApiFunction.RESET: NULL_SELF | NULL_FIRST,
    ApiFunction.SET_WEIGHTS: NULL_SELF | NULL_FIRST,
    ApiFunction.INIT: NULL_SELF,
    ApiFunction.SET_LIMITS: NULL_SELF | NULL_FIRST,
}

_LIMITS_BIT: Final = 64
"""SET_LIMITS is written as SET_WEIGHTS with this bit."""


def step_quantities(method: Method) -> tuple[str, ...]:
    """Return the quantities of a step's numbers: state, target, thrust, and the acceleration if given."""
    return (*STATE, *TARGET, *THRUST, *(ACCELERATION if len(method.target) > len(TARGET) else ()))


def _quantities(method: Method) -> dict[ApiFunction, tuple[str, ...]]:
    """Return the quantities of the numbers that each function reads."""
    return {
        ApiFunction.STEP: step_quantities(method),
        ApiFunction.RESET: COMMAND,
        ApiFunction.SET_WEIGHTS: method.setter_quantities,
        ApiFunction.INIT: COMMAND,
        ApiFunction.SET_LIMITS: LIMITS,
    }


def call_type(settings: Settings) -> np.dtype[Any]:
    """Return the layout of a call: function in bits 0 and 1 of the byte, null pointers in bits 2 to 5."""
    method = method_of(settings)
    return np.dtype([("call", np.uint8), ("values", method.numbers.scalar, len(step_quantities(method)))])


def outcome_type(settings: Settings) -> np.dtype[Any]:
    """Return the layout of an outcome, as `replay.c` writes it: status, counts and flags, numbers."""
    method = method_of(settings)
    quantity = {one.name: one.quantities for one in method.results}
    left = method.reference_controller().outcome
    return np.dtype(
        [("status", np.int32)]
        + [
            (name, method.numbers.type_of(quantity[name][0]), values[0].size)
            if quantity.get(name)
            else (name, np.int32)
            for name, values in left.items()
        ]
    )


def calls(settings: Settings, function: ApiFunction, values: NDArray[Any], nulls: int = 0) -> Tape:
    """Return a call of `function` for each row of values (n, k); `nulls` is the mask of null pointers."""
    made = np.zeros(len(values), call_type(settings))
    code = ApiFunction.SET_WEIGHTS | _LIMITS_BIT if function == ApiFunction.SET_LIMITS else function
    made["call"] = code | (nulls << 2)
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
        self._quantities = _quantities(self._method)
        self._controller: Any = self._method.reference_controller(n)
        self._fresh = self._controller.memory

    def make(self, now: Tape) -> Outcomes:
        """Make one call (n,) on each controller, and return the outcomes (n,)."""
        controller = self._controller
        function = now["call"] & 3
        if self._method.limiting is not None:
            is_limits = (function == ApiFunction.SET_WEIGHTS) & ((now["call"] & _LIMITS_BIT) != 0)
            function = np.where(is_limits, np.uint8(ApiFunction.SET_LIMITS), function)
        nulls = (now["call"] >> 2) & 15
        null = (nulls & np.array([_POINTERS[f] for f in ApiFunction])[function]) != 0

        def call(wanted: ApiFunction, made: Callable[[NDArray[Any]], NDArray[np.int64]]) -> NDArray[np.int64]:
            before, quantities = controller.memory, self._quantities[wanted]
            values = now["values"][:, : len(quantities)]
            status = made(self._method.numbers.to_si(values, *quantities))
            controller.memory = choose((function == wanted) & ~null, controller.memory, before)
            return status

        def step(values: NDArray[Any]) -> NDArray[np.int64]:
            target = np.concatenate([values[:, 7:11], values[:, 12:]], axis=1)
            status: NDArray[np.int64] = controller.step(values[:, 0:7], target, values[:, 11]).status
            return status

        set_other = getattr(controller, self._method.setter)
        outcome = np.zeros(len(now), outcome_type(self._settings))
        with np.errstate(all="ignore"):
            resets = call(ApiFunction.RESET, controller.reset)
            others = call(ApiFunction.SET_WEIGHTS, set_other)
            limits = np.zeros_like(others)
            if self._method.limiting is not None:
                limits = call(ApiFunction.SET_LIMITS, controller.set_limits)
            steps = call(ApiFunction.STEP, step)
        self._initialise((function == ApiFunction.INIT) & ~null)

        status = np.choose(function, [steps, resets, others, np.zeros_like(steps), limits])
        outcome["status"] = np.where(null & (function != ApiFunction.INIT), Status.NULL_POINTER, status)
        for name, values in controller.outcome.items():
            outcome[name] = values.reshape(outcome[name].shape)
        writes = (function == ApiFunction.STEP) & ((nulls & NULL_COMMAND) == 0)
        level = ((nulls & NULL_SELF) != 0)[:, None]
        sent_rad = np.where(level, 0, outcome["command_rad"])
        outcome["command_rad"] = np.where(writes[:, None], sent_rad, UNWRITTEN_RAD)
        return outcome

    def _initialise(self, chosen: NDArray[np.bool_]) -> None:
        self._controller.memory = choose(chosen, self._fresh, self._controller.memory)
