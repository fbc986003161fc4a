"""Calls of the C interface as bytes, and what the reference returns for them.

A call is one byte and the numbers of a step in the controller's scalar type, which `fuzz/nmpc_fuzz.c` of a
bundle decodes. A tape is a sequence of calls of one controller, which is initialised before the first call.
"""

from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods import Method
from mambo_codegen.methods.shared.heading import slew_heading
from mambo_codegen.methods.shared.inputs import Status, choose
from mambo_codegen.numbers.representation import THRUST
from mambo_codegen.settings.model import Settings
from mambo_sil.verify.step_inputs import StepRows, method_of

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


class ApiCall(NamedTuple):
    """How calls of a function are written.

    quantities: of the numbers that it reads.
    pointers:   mask of its pointer arguments.
    written_as: function in bits 0 and 1 of a call's byte; two bits are too few, so bits 6 and 7 tell others.
    """

    quantities: tuple[str, ...]
    pointers: int
    written_as: int


_OTHER_BIT, _LAST_BIT = 64, 128


def api_of(method: Method) -> dict[ApiFunction, ApiCall]:
    """Return the functions of a controller's C; of two that are written at once, the later counts."""
    every = NULL_SELF | NULL_FIRST | NULL_SECOND | NULL_COMMAND
    step, reset, setter, init = ApiFunction.STEP, ApiFunction.RESET, ApiFunction.SET_WEIGHTS, ApiFunction.INIT
    functions = {
        step: ApiCall(StepRows(method).quantities, every, step),
        reset: ApiCall(method.command, NULL_SELF | NULL_FIRST, reset),
        setter: ApiCall(method.setter_quantities, NULL_SELF | NULL_FIRST, setter),
        init: ApiCall(method.command, NULL_SELF, init),
        ApiFunction.SHIFT: ApiCall(method.shift, NULL_SELF | NULL_FIRST | NULL_SECOND, step | _LAST_BIT),
    }
    if method.limiting is not None:
        limits = ApiCall(method.limiting.quantities, NULL_SELF | NULL_FIRST, setter | _OTHER_BIT)
        functions[ApiFunction.SET_LIMITS] = limits
    if method.has_height:
        functions[ApiFunction.SET_THRUST] = ApiCall(THRUST, NULL_SELF, init | _OTHER_BIT)
    functions[ApiFunction.SLEW_HEADING] = ApiCall(("yaw",) * 3, 0, reset | _OTHER_BIT)
    if method.guard is not None:
        functions[ApiFunction.SET_MEASURED] = ApiCall(("position",), NULL_SELF, step | _OTHER_BIT)
    return functions


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
    method = method_of(settings)
    called = api_of(method)[function]
    made = np.zeros(len(values), call_type(settings))
    made["call"] = called.written_as | (nulls << 2)
    quantities = called.quantities[: values.shape[1]]
    made["values"][:, : values.shape[1]] = method.numbers.quantize(values, quantities)
    return made


def tape_from(settings: Settings, content: bytes) -> Tape:
    """Return the complete calls in `content`; like the harness, ignore the bytes after them."""
    layout = call_type(settings)
    return np.frombuffer(content, layout, len(content) // layout.itemsize)


def answers(settings: Settings, tapes: Sequence[Tape]) -> list[Outcomes]:
    """Run each tape on its own reference controller, and return the outcomes.

    Tapes of alike lengths run at once; the few long ones run apart, so that the others end early.
    """
    lengths = np.array([len(tape) for tape in tapes], np.intp)
    is_long = lengths > 2 * (np.median(lengths) if len(tapes) else 0)
    found: dict[int, Outcomes] = {}
    for indices in filter(len, (np.flatnonzero(~is_long).tolist(), np.flatnonzero(is_long).tolist())):
        found |= zip(indices, _run_at_once(settings, [tapes[at] for at in indices]), strict=True)
    return [found[at] for at in range(len(tapes))]


def _run_at_once(settings: Settings, tapes: Sequence[Tape]) -> list[Outcomes]:
    """Run tapes side by side; those that have ended make calls that are refused."""
    longest = max(len(tape) for tape in tapes)
    padded = np.zeros((len(tapes), longest), call_type(settings))
    padded["call"] = ApiFunction.RESET | (NULL_SELF << 2)
    for row, tape in zip(padded, tapes, strict=True):
        row[: len(tape)] = tape
    runs = _Runs(settings, len(tapes))
    made = np.stack([runs.make(padded[:, at]) for at in range(longest)], axis=1) if longest else padded
    return [row[: len(tape)] for row, tape in zip(made, tapes, strict=True)]


class _Runs:
    """n reference controllers; at each call, each of them may have another function called.

    A function that is called for some is called for all; those that it is not meant for keep their memory.
    """

    def __init__(self, settings: Settings, n: int) -> None:
        self._settings = settings
        self._method = method_of(settings)
        self._api, self._rows = api_of(self._method), StepRows(self._method)
        self._controller: Any = self._method.reference_controller(n)
        self._fresh = self._controller.memory
        self._level: dict[str, Any] = {"command_rad": 0}
        if self._method.has_height:
            self._level["thrust_m_s2"] = self._controller.outcome["thrust_m_s2"][0]

    def make(self, now: Tape) -> Outcomes:
        """Make one call (n,) on each controller, and return the outcomes (n,)."""
        controller, method = self._controller, self._method
        function = np.zeros(len(now), np.uint8)
        for wanted, called in self._api.items():
            read = 3 | (called.written_as & ~3)
            function = np.where((now["call"] & read) == called.written_as, np.uint8(wanted), function)
        nulls = (now["call"] >> 2) & 15
        pointers = [self._api[one].pointers if one in self._api else 0 for one in ApiFunction]
        null = (nulls & np.array(pointers)[function]) != 0

        def step(values: NDArray[Any]) -> NDArray[np.int64]:
            inputs = self._rows.split(values)
            status: NDArray[np.int64] = controller.step(inputs.state, inputs.target, inputs.thrust).status
            return status

        runs: dict[ApiFunction, Callable[[NDArray[Any]], NDArray[np.int64]]] = {
            ApiFunction.RESET: controller.reset,
            ApiFunction.SET_WEIGHTS: getattr(controller, method.setter),
            ApiFunction.SET_LIMITS: controller.set_limits,
            ApiFunction.SET_THRUST: lambda values: controller.report_thrust(values[:, 0]),
            ApiFunction.SET_MEASURED: lambda values: controller.set_position_measured(values[:, 0] > 0),
            ApiFunction.SHIFT: controller.frame_jumped,
            ApiFunction.STEP: step,
        }
        status = np.zeros(len(now), np.int64)
        with np.errstate(all="ignore"):
            for wanted in (one for one in runs if one in self._api):
                before, is_made = controller.memory, (function == wanted) & ~null
                if is_made.any():
                    made = runs[wanted](self._si_values(now, wanted))
                    controller.memory = choose(is_made, controller.memory, before)
                    status = np.where(is_made, made, status)
            slewed = self._slewed(now)
        self._initialise((function == ApiFunction.INIT) & ~null)

        outcome = np.zeros(len(now), outcome_type(self._settings))
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

    def _si_values(self, now: Tape, function: ApiFunction) -> NDArray[Any]:
        """Return the numbers that a function reads, in SI units."""
        quantities = self._api[function].quantities
        return self._method.numbers.to_si(now["values"][:, : len(quantities)], *quantities)

    def _slewed(self, now: Tape) -> NDArray[Any]:
        """Return the headings (n,) of calls of nmpc_slew_heading, in the numbers of the C."""
        slewed = slew_heading(self._method, *self._si_values(now, ApiFunction.SLEW_HEADING).T)
        return self._method.numbers.quantize(slewed[:, np.newaxis], ("yaw",))[:, 0]

    def _initialise(self, chosen: NDArray[np.bool_]) -> None:
        self._controller.memory = choose(chosen, self._fresh, self._controller.memory)
