"""The self-test digest: a checksum of many control steps; a build with other bits has another digest.

An episode is TICKS steps of one controller after nmpc_init, with calls of the other functions between them
(`episodes.py`). Its inputs come from an integer random number generator, so that C and NumPy draw the same
ones (`draws.py`). The C (`nmpc_self_test.c.j2`) runs the episodes one after the other; this module runs them
in parallel arrays when the C is generated.
"""

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.bundle.draws import HOVER, Words, fold, input_scales, tiny_m
from mambo_codegen.bundle.episodes import (
    CALLS_IN_TURN,
    TICKS_PER_INPUT,
    WITH_NULLS,
    Episodes,
    EpisodeStep,
    OtherCall,
    null_calls,
)
from mambo_codegen.kept import keep
from mambo_codegen.methods import Method, method_of
from mambo_codegen.methods.shared.heading import slew_heading
from mambo_codegen.methods.shared.inputs import Rows, Status, choose
from mambo_codegen.methods.shared.math import Real
from mambo_codegen.settings.model import Settings

TICKS: Final = 100
"""Steps of an episode."""
START_UP_STEPS: Final = 1 + (10 * TICKS_PER_INPUT)
"""Steps of the self-test at start-up: one with a tiny error, and those of an episode up to each function."""

_FLAGS: Final = 64
"""More than all flags of a step together, and than a status."""
_OFTEN: Final = 3
"""So many uses of a row are enough."""
_MOST_USED: Final = 1 << 10
"""More than _OFTEN times the rows of all tables."""
_CANDIDATES: Final = 512
"""The start-up test is one of so many episodes."""
_MOST_EPISODES: Final = 1000
_USUAL_WORK: Final = 100
"""Largest Np x Nc x iterations for which the digest covers _MOST_EPISODES."""
_LEAST_WORK: Final = 20
"""Np x Nc below which the reference is not faster, because NumPy's overhead per operation dominates."""

StepInputs = tuple[Real, Real, Real | None]
"""States, targets and thrusts of one step of n controllers, as in `ReferenceController.step`."""

Outcome = Mapping[str, NDArray[Any]]
"""What calls of n controllers have left, as in `ReferenceController.outcome`."""


def episode_count(method: Method) -> int:
    """Return how many episodes the digest covers: fewer for long horizons, which keeps the run time equal."""
    states, iterations = method.work
    work = max(states, _LEAST_WORK) * iterations
    return max(1, min(_MOST_EPISODES, _MOST_EPISODES * _USUAL_WORK // work))


def kept_digest(method: Method) -> int:
    """Return the self-test digest over the episodes of a bundle's self-test; it is kept."""
    count = episode_count(method)
    inputs = method.settings.model_dump(mode="json"), count
    return int(keep("self-test digest", inputs, lambda: self_test_digest(method, count)))


def self_test_digest(method: Method, count: int) -> int:
    """Run the first `count` episodes on the reference controller, and return their digest of 32 bits."""
    digest = np.zeros(1, np.uint32)
    episodes = np.arange(count, dtype=np.uint32)
    run = _Run(method, count)
    for step in Episodes(method, episodes).steps(TICKS):
        run.make(step)
    for word in run.digests:
        digest = fold(digest, word)
    return int(digest[0])


def episode_inputs(method: Method, episodes: Words) -> Iterator[StepInputs]:
    """Yield the inputs of each of TICKS steps; `episodes` (n,) are the indices of the episodes."""
    for step in Episodes(method, episodes).steps(TICKS):
        yield step.state, step.target, step.thrust


def start_up_test(settings: Settings) -> dict[str, Any]:
    """Return the self-test at start-up: an episode, and the digests up to each of its steps; it is kept."""
    kept: dict[str, Any] = keep(
        "start-up test", settings.model_dump(mode="json"), lambda: _start_up_test(method_of(settings))
    )
    return kept


def _start_up_test(method: Method) -> dict[str, Any]:
    """Find of some episodes the first with the most rows, uses and ways to end.

    Its first step has a position error below the smallest normal number, so that a board that flushes such
    numbers to zero fails.
    """
    run, episodes = _Run(method, _CANDIDATES), Episodes(method, np.arange(_CANDIDATES, dtype=np.uint32))
    run.make_tiny()
    digests, ways, uses = [run.digests], list[NDArray[Any]](), list[NDArray[Any]]()
    for step in episodes.steps(START_UP_STEPS - 1):
        ways += run.make(step)
        uses.append(run.rows_used)
        digests.append(run.digests)
    kinds = np.array([len(set(one)) for one in np.array(ways).T.tolist()])
    often = np.minimum(np.sum(uses, axis=0), _OFTEN)
    found = (_MOST_USED * np.sum(often > 0, axis=1)) + np.sum(often, axis=1)
    best = int(np.argmax((_FLAGS * found) + kinds))
    return {"episode": best, "digests": [int(one[best]) for one in digests]}


class _Run:
    """n reference controllers in their episodes.

    digests: (n,) of all results so far.
    """

    def __init__(self, method: Method, n: int) -> None:
        self._method, self._controller = method, method.reference_controller(n)
        self.digests: Words = np.zeros(n, np.uint32)
        self._is_good: Rows = np.zeros(n, np.bool_)
        self._fresh = self._controller.outcome
        self._quantities = {one.name: one.quantities for one in method.results}

    def make_tiny(self) -> None:
        """Make a step of drones almost at their targets."""
        method, n = self._method, len(self.digests)
        state, target = np.zeros((n, len(method.state))), np.zeros((n, len(method.target)))
        state[:, 0] = tiny_m(method)
        thrust = None if method.has_height else np.full(n, input_scales(method).of[HOVER][0])
        self._step(state, target, thrust)

    def make(self, step: EpisodeStep) -> list[NDArray[Any]]:
        """Make the calls and the step; return a number for each way (n,) in which one of them can end."""
        ways = []
        if step.index is not None:
            self._ask(step.headings)
            turn = step.index % CALLS_IN_TURN
            if turn == WITH_NULLS:
                self._refuse_nulls(step.calls)
            status = self._call(step.call, step.calls) if step.call else np.zeros_like(self.digests)
            ways.append((_FLAGS * (1 + turn)) + status)
            self._fold(status)
            self._fold_controller(self._controller.outcome)
        return [*ways, self._step(step.state, step.target, step.thrust)]

    @property
    def rows_used(self) -> NDArray[np.bool_]:
        """Which rows of the tables show in the last step (n, k)."""
        return self._controller.deciding & self._is_good[:, None]

    def _refuse_nulls(self, is_made: Rows) -> None:
        """Make the calls with null pointers: a step without a controller commands what a new one holds."""
        before = self.digests
        self._fold_command(self._fresh)
        self._fold_command(self._controller.outcome)
        self._fold(np.full_like(self.digests, null_calls(self._method)))
        self.digests = np.where(is_made, self.digests, before)

    def _ask(self, headings: Real) -> None:
        """Make the calls that change nothing."""
        with np.errstate(all="ignore"):
            slewed = slew_heading(self._method, *headings.T)[:, None]
        self._fold_numbers(self._method.numbers.quantize(slewed, ("yaw",)), "yaw")
        estimate = self._controller.last_estimate
        if estimate.size:
            self._fold_numbers(estimate, "position")
            self._fold(self._controller.has_estimate)

    def _call(self, call: OtherCall, is_made: Rows) -> NDArray[Any]:
        """Make another call, and return its status (n,)."""
        controller, before, values = self._controller, self._controller.memory, call.values
        if values.shape[1] == 1:
            values = values[:, 0]
        with np.errstate(all="ignore"):  # what is refused is computed too
            made = getattr(controller, call.function)(values)
        controller.memory = choose(is_made, controller.memory, before)
        status: NDArray[Any] = np.where(is_made, made, Status.OK)
        return status

    def _step(self, state: Real, target: Real, thrust: Real | None) -> NDArray[Any]:
        status = self._controller.step(state, target, thrust).status
        self._fold(status)
        left = self._controller.outcome
        self._fold_command(left)
        flags = self._fold_controller(left)
        ways: NDArray[Any] = (_FLAGS * (1 + CALLS_IN_TURN)) + (_FLAGS * status) + flags
        self._is_good = status == Status.OK
        return ways

    def _fold_command(self, left: Outcome) -> None:
        """Fold in the last command."""
        self._fold_numbers(left["command_rad"], "angle")
        if "thrust_m_s2" in left:
            self._fold_numbers(left["thrust_m_s2"], "thrust")

    def _fold_controller(self, left: Outcome) -> NDArray[Any]:
        """Fold in what a call has left, and return flags (n,): the limits that act, 8 for saturation."""
        saturated = left["saturated"]
        active: NDArray[Any] = left.get("active_limits", 0) + (8 * saturated)
        self._fold(saturated)
        if self._method.has_limits:
            self._fold(active)
        for name in filter(left.__contains__, self._method.digested):
            if self._quantities[name]:
                self._fold_numbers(left[name], self._quantities[name][0])
            else:
                self._fold(left[name])
        return active

    def _fold(self, values: NDArray[Any]) -> None:
        self.digests = fold(self.digests, values.astype(np.uint32))

    def _fold_numbers(self, values: Real, quantity: str) -> None:
        """Fold in numbers of the C (n, ...); of 64 bits the upper word comes first."""
        rows = values.reshape(len(self.digests), -1).astype(self._method.numbers.type_of(quantity))
        for word in rows.astype(rows.dtype.newbyteorder(">")).view(">u4").astype(np.uint32).T:
            self.digests = fold(self.digests, word)
