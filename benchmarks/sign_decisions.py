"""Where float64 and fewer bits go different ways: RPROP reads signs, and a sign can hang on the last bit.

A controller in float32 or fixed point is compared with float64, one in float64 with float32. Both reference
controllers are given the same numbers, exact in the type of fewer bits, and the same memory, so a decision
that differs differs by rounding alone. Whole flights say what becomes of it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.reference import ReferenceController, Status
from mambo_nmpc.codegen.representation import COMMAND, STATE, TARGET, THRUST
from mambo_nmpc.codegen.settings.controller_toml import with_option
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.controllers.inner_steps import InnerSteps, step_watched
from mambo_nmpc.sil.flight.loop import Flight, Outcome, fly
from mambo_nmpc.sil.flight.metrics import measure
from mambo_nmpc.sil.flight.traces import Trace
from mambo_nmpc.sil.flight.trajectories import Trajectories
from mambo_nmpc.sil.paper.table2 import CASES, DURATION_S

ScalarName = Literal["float32", "float64", "fixed"]
MANY: Final[ScalarName] = "float64"

Make = Callable[[Settings, int], CompiledController]
"""Settings and n -> n controllers of their C."""


@dataclass(frozen=True, eq=False)
class Moments:
    """n control steps about to be made: what the controller is handed and what it remembers.

    state (n, 7), target (n, 4), thrust_acceleration_m_s2 (n,), command_rad (n, 2), plan_rad (n, control, 2).
    """

    state: NDArray[Any]
    target: NDArray[Any]
    thrust_acceleration_m_s2: NDArray[Any]
    command_rad: NDArray[Any]
    plan_rad: NDArray[Any]

    def exact(self, settings: Settings) -> "Moments":
        """Round every number to the nearest that a controller with `settings` can hold."""
        numbers = Design(settings).numbers

        def exact(values: NDArray[Any], quantities: Sequence[str]) -> NDArray[Any]:
            return numbers.to_si(numbers.quantize(values, quantities), *quantities)

        return Moments(
            exact(self.state, STATE),
            exact(self.target, TARGET),
            exact(self.thrust_acceleration_m_s2[:, None], THRUST)[:, 0],
            exact(self.command_rad, COMMAND),
            exact(self.plan_rad, COMMAND),
        )


@dataclass(frozen=True)
class Disagreement:
    """How often both scalar types decide differently, over the accepted steps of one kind of input.

    decisions:         signs compared: one for each step, iteration and move.
    differing:         of these, how many differ.
    first_by_iteration: steps whose first differing sign falls into iteration 1, 2, ...
    command_rad:       median, 99 % and largest change of the command in steps that differ.
    rounding_rad:      largest change of the command in steps that agree in every decision.
    moved:             steps whose command changes by more than half the initial step.
    """

    inputs: str
    steps: int
    decisions: int
    differing: int
    first_by_iteration: tuple[int, ...]
    command_rad: tuple[float, float, float]
    rounding_rad: float
    moved: int

    @property
    def differing_steps(self) -> int:
        """Steps with any differing decision."""
        return sum(self.first_by_iteration)


@dataclass(frozen=True)
class Flown:
    """One case of Table II with both scalar types: IAE, ISE, ITSE, ITAE, and how far apart they flew."""

    case: str
    few: tuple[float, ...]
    many: tuple[float, ...]
    apart_m: float
    largest_error_m: tuple[float, float]


def in_scalar(settings: Settings, scalar: ScalarName) -> Settings:
    """Return `settings` with another scalar type."""
    return with_option(settings, "code.scalar", scalar)


def with_few(settings: Settings) -> Settings:
    """Return `settings` with the scalar type of fewer bits that is compared with float64."""
    return settings if settings.code.scalar == "fixed" else in_scalar(settings, "float32")


def disagreement(settings: Settings, inputs: str, moments: Moments) -> Disagreement:
    """Let both scalar types make the same steps, and compare every decision."""
    few_settings, many_settings = with_few(settings), in_scalar(settings, MANY)
    few_step, few = _steps(few_settings, moments)
    many_step, many = _steps(many_settings, moments)
    accepted = (few_step.status == Status.OK) & (many_step.status == Status.OK)
    differs = (few.decisions(few_settings) != many.decisions(many_settings))[:, accepted]
    differs = differs.reshape(*differs.shape[:2], -1)
    any_move = differs.any(axis=2)
    steps_differing = any_move.any(axis=0)
    first = np.argmax(any_move, axis=0)[steps_differing]
    change_rad = np.abs(few_step.command_rad.astype(np.float64) - many_step.command_rad).max(axis=1)[accepted]
    changed_rad = change_rad[steps_differing]
    return Disagreement(
        inputs=inputs,
        steps=int(accepted.sum()),
        decisions=differs.size,
        differing=int(differs.sum()),
        first_by_iteration=tuple(np.bincount(first, minlength=len(differs)).tolist()),
        command_rad=_spread(changed_rad),
        rounding_rad=float(change_rad[~steps_differing].max(initial=0.0)),
        moved=int((change_rad > settings.optimizer.initial_step_rad / 2.0).sum()),
    )


def _steps(settings: Settings, moments: Moments) -> tuple[Any, InnerSteps]:
    design = Design(settings)
    numbers = design.numbers
    fresh = ReferenceController(design, len(moments.state)).memory
    memory = replace(
        fresh,
        command_rad=numbers.quantize(moments.command_rad, COMMAND).astype(numbers.computed),
        plan_rad=numbers.quantize(moments.plan_rad, COMMAND).astype(numbers.computed),
    )
    return step_watched(settings, memory, moments.state, moments.target, moments.thrust_acceleration_m_s2)


def _spread(values: NDArray[np.float64]) -> tuple[float, float, float]:
    if not len(values):
        return 0.0, 0.0, 0.0
    return float(np.median(values)), float(np.quantile(values, 0.99)), float(values.max())


def with_random_memory(settings: Settings, inputs: tuple[Any, Any, Any], rng: np.random.Generator) -> Moments:
    """Give states, targets and thrusts a random memory; every other command is the first move of its plan.

    All is exact in the type of fewer bits.
    """
    state, target, thrust = (np.asarray(values, np.float32) for values in inputs)
    limit = settings.limits.tilt_rad
    plan = rng.uniform(-limit, limit, (len(state), settings.horizon.control, 2)).astype(np.float32)
    command = plan[:, 0].copy()
    command[::2] = rng.uniform(-limit, limit, command[::2].shape)
    tilt = np.float32(limit)
    moments = Moments(state, target, thrust, np.clip(command, -tilt, tilt), np.clip(plan, -tilt, tilt))
    return moments.exact(with_few(settings))


EDGE_SPAN_M: Final = 0.5
_HALVINGS: Final = 40
"""More than it takes to bring two positions of float32 or fixed point next to each other."""


def at_the_edge(settings: Settings, moments: Moments) -> Moments:
    """Move each position to where a decision changes: the adversary's inputs.

    Between a position and one EDGE_SPAN_M beside it the decisions of float64 differ somewhere; halving finds
    two neighbouring numbers of the type of fewer bits between which they do. Moments without such an edge are
    left out.
    """
    few, settings = with_few(settings), in_scalar(settings, MANY)
    near, far = moments, _moved(moments, moments.state[:, 0] + np.float32(EDGE_SPAN_M)).exact(few)
    here = _pattern(settings, near)
    edged = (here != _pattern(settings, far)).any(axis=1)
    near, far, here = _chosen(near, edged), _chosen(far, edged), here[edged]
    for _ in range(_HALVINGS):
        middle = _moved(near, (near.state[:, 0] + far.state[:, 0]) * np.float32(0.5)).exact(few)
        same = (_pattern(settings, middle) == here).all(axis=1)
        near = _moved(near, np.where(same, middle.state[:, 0], near.state[:, 0]))
        far = _moved(far, np.where(same, far.state[:, 0], middle.state[:, 0]))
    return near


def _moved(moments: Moments, x_m: NDArray[Any]) -> Moments:
    state = moments.state.copy()
    state[:, 0] = x_m
    return replace(moments, state=state)


def _chosen(moments: Moments, rows: NDArray[np.bool_]) -> Moments:
    return Moments(
        moments.state[rows],
        moments.target[rows],
        moments.thrust_acceleration_m_s2[rows],
        moments.command_rad[rows],
        moments.plan_rad[rows],
    )


def _pattern(settings: Settings, moments: Moments) -> NDArray[np.int8]:
    """Return the decisions of every moment as a row, with the status before them."""
    step, inner = _steps(settings, moments)
    decisions = np.moveaxis(inner.decisions(settings), 0, 1).reshape(len(moments.state), -1)
    return np.concatenate([step.status.astype(np.int8)[:, np.newaxis], decisions], axis=1)


class _Recording:
    """A controller that writes down each moment before it steps."""

    def __init__(self, controller: CompiledController, settings: Settings, n: int) -> None:
        self._controller, self._settings = controller, settings
        self._command, self._plan = np.zeros((n, 2)), np.zeros((n, settings.horizon.control, 2))
        self.moments: list[Moments] = []

    def step(self, state: Any, target: Any, thrust_acceleration_m_s2: Any) -> Outcome:
        """Write down, and step."""
        moments = Moments(state, target, thrust_acceleration_m_s2, self._command, self._plan)
        self.moments.append(moments.exact(self._settings))
        step = self._controller.step(state, target, thrust_acceleration_m_s2)
        self._command, self._plan = step.command_rad, step.plan_rad
        return step


def fly_both(settings: Settings, make: Make) -> tuple[list[Flown], Moments]:
    """Fly the cases of Table II with both scalar types.

    Returns what came of it, and the moments of the type of fewer bits.
    """
    cases = len(CASES)
    flight = Flight(
        Trajectories(tuple(CASES.values())),
        duration_s=DURATION_S,
        flights=cases,
        update_period_s=settings.horizon.update_period_s,
    )
    few, many = with_few(settings), in_scalar(settings, MANY)
    recording = _Recording(make(few, cases), few, cases)
    traces = fly(flight, recording), fly(flight, make(many, cases))
    moments = Moments(
        *(
            np.concatenate([getattr(one, field.name) for one in recording.moments])
            for field in fields(Moments)
        )
    )
    return _compared(*traces), moments


def _compared(few: Trace, many: Trace) -> list[Flown]:
    apart_m = np.hypot(*np.moveaxis((few.position_m - many.position_m)[..., :2], -1, 0)).max(axis=0)
    indices: list[Sequence[Sequence[float]]] = []
    for trace in (few, many):
        found = measure(trace)
        values = (found.iae_m_s, found.ise_m2_s, found.itse_m2_s2, found.itae_m_s2)
        indices.append(np.stack(values, axis=1).tolist())
    largest = [measure(trace).max_error_m for trace in (few, many)]
    return [
        Flown(
            case=case,
            few=tuple(indices[0][row]),
            many=tuple(indices[1][row]),
            apart_m=float(apart_m[row]),
            largest_error_m=(float(largest[0][row]), float(largest[1][row])),
        )
        for row, case in enumerate(CASES)
    ]
