"""How often float32 or fixed point decides otherwise than float64, and what becomes of it in flight.

RPROP reads only the signs of a gradient, and a sign can depend on the last bit. Reference controllers in
both scalar types get the same inputs and the same memory, exact in the type of fewer bits, so that decisions
differ by rounding alone. Flights of Table II with the C show the effect in closed loop.

`python -m benchmarks.sign_decisions` prints the tables of docs/evidence/sign-decisions.md; it takes about a
minute.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from benchmarks.markdown import table
from mambo_codegen.design import Design
from mambo_codegen.numbers.representation import COMMAND, STATE, TARGET, THRUST
from mambo_codegen.reference import ReferenceController, Status, Step
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.experiment.table2.table2 import CASES, DURATION_S
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.inner_steps import InnerSteps, step_watched
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight, Outcome
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.trajectories import Trajectories
from mambo_sil.verify.inputs import random_inputs

RANDOM_STEPS: Final = 100_000
EDGE_SEEDS: Final = 10_000
EDGE_SPAN_M: Final = 0.5
_HALVINGS: Final = 40
"""Enough to bring two positions in float32 or fixed point next to each other."""


@dataclass(frozen=True, eq=False)
class Moments:
    """Inputs and memory of n controllers before a step.

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

    def at(self, x_m: NDArray[Any]) -> "Moments":
        """Return the same moments with other positions along x."""
        return replace(self, state=np.column_stack([x_m, self.state[:, 1:]]))


@dataclass(frozen=True)
class Disagreement:
    """How often two scalar types decide differently, over the accepted steps of one kind of input.

    decisions:          signs compared: one for each step, iteration and move.
    differing:          of these, how many differ.
    first_by_iteration: steps whose first differing sign falls into iteration 1, 2, ...
    command_rad:        median, 99 % and largest change of the command in steps that differ.
    rounding_rad:       largest change of the command in steps that agree in every decision.
    """

    inputs: str
    steps: int
    decisions: int
    differing: int
    first_by_iteration: tuple[int, ...]
    command_rad: tuple[float, float, float]
    rounding_rad: float

    @property
    def differing_steps(self) -> int:
        """Steps with any differing decision."""
        return sum(self.first_by_iteration)


def in_float64(settings: Settings) -> Settings:
    """Return `settings` with the scalar type float64."""
    return with_option(settings, "code.scalar", "float64")


def random_moments(settings: Settings, n: int, rng: np.random.Generator) -> Moments:
    """Draw inputs and a random memory; every other command is the first move of its plan."""
    drawn = random_inputs(settings, n, rng)
    state, target, thrust = (
        np.asarray(values, np.float32) for values in (drawn.state, drawn.target, drawn.thrust)
    )
    limit = settings.limits.tilt_rad
    plan = rng.uniform(-limit, limit, (n, settings.horizon.control, 2)).astype(np.float32)
    command = plan[:, 0].copy()
    command[::2] = rng.uniform(-limit, limit, command[::2].shape)
    tilt = np.float32(limit)
    moments = Moments(state, target, thrust, np.clip(command, -tilt, tilt), np.clip(plan, -tilt, tilt))
    return moments.exact(settings)


def at_the_edge(settings: Settings, moments: Moments) -> Moments:
    """Move each position along x to where float64 decides otherwise at the next number of `settings`.

    Bisection between the position and one EDGE_SPAN_M beside it finds two such neighbours, if the decisions
    differ between those two; moments without such an edge are left out.
    """
    many = in_float64(settings)
    far = moments.at(moments.state[:, 0] + np.float32(EDGE_SPAN_M)).exact(settings)
    here = _decisions(many, moments)
    edged = (here != _decisions(many, far)).any(axis=1)
    near = Moments(*(getattr(moments, field.name)[edged] for field in fields(Moments)))
    near_m, far_m, here = near.state[:, 0], far.state[edged, 0], here[edged]
    for _ in range(_HALVINGS):
        middle = near.at((near_m + far_m) * np.float32(0.5)).exact(settings)
        same = (_decisions(many, middle) == here).all(axis=1)
        near_m = np.where(same, middle.state[:, 0], near_m)
        far_m = np.where(same, far_m, middle.state[:, 0])
    return near.at(near_m)


def _decisions(settings: Settings, moments: Moments) -> NDArray[np.int8]:
    """Return status and decisions of every moment as a row."""
    step, inner = _steps(settings, moments)
    decisions = np.moveaxis(inner.decisions(settings), 0, 1).reshape(len(moments.state), -1)
    return np.concatenate([step.status.astype(np.int8)[:, np.newaxis], decisions], axis=1)


def _steps(settings: Settings, moments: Moments) -> tuple[Any, InnerSteps]:
    design = Design(settings)
    numbers = design.numbers
    memory = replace(
        ReferenceController(design, len(moments.state)).memory,
        command_rad=numbers.quantize(moments.command_rad, COMMAND).astype(numbers.computed),
        plan_rad=numbers.quantize(moments.plan_rad, COMMAND).astype(numbers.computed),
    )
    return step_watched(settings, memory, moments.state, moments.target, moments.thrust_acceleration_m_s2)


def disagreement(settings: Settings, inputs: str, moments: Moments) -> Disagreement:
    """Make the same steps in both scalar types and compare every decision."""
    many_settings = in_float64(settings)
    few_step, few = _steps(settings, moments)
    many_step, many = _steps(many_settings, moments)
    accepted = (few_step.status == Status.OK) & (many_step.status == Status.OK)
    differs = (few.decisions(settings) != many.decisions(many_settings))[:, accepted]
    any_move = differs.any(axis=(2, 3))
    differing = any_move.any(axis=0)
    change_rad = np.abs(few_step.command_rad.astype(np.float64) - many_step.command_rad).max(axis=1)[accepted]
    changed_rad = change_rad[differing] if differing.any() else np.zeros(1)
    return Disagreement(
        inputs=inputs,
        steps=int(accepted.sum()),
        decisions=differs.size,
        differing=int(differs.sum()),
        first_by_iteration=tuple(
            np.bincount(np.argmax(any_move, axis=0)[differing], minlength=len(differs)).tolist()
        ),
        command_rad=(
            float(np.median(changed_rad)),
            float(np.quantile(changed_rad, 0.99)),
            float(changed_rad.max()),
        ),
        rounding_rad=float(change_rad[~differing].max(initial=0.0)),
    )


class _RecordingController:
    """A compiled controller that records each moment before it steps."""

    def __init__(self, settings: Settings, n: int) -> None:
        self._controller, self._settings = CompiledController(settings, n), settings
        self._command, self._plan = np.zeros((n, 2)), np.zeros((n, settings.horizon.control, 2))
        self.moments: list[Moments] = []

    def step(self, state: Any, target: Any, thrust_acceleration_m_s2: Any) -> Outcome:
        """Record, and step."""
        moments = Moments(state, target[:, :4], thrust_acceleration_m_s2, self._command, self._plan)
        self.moments.append(moments.exact(self._settings))
        step: Step = self._controller.step(state, target, thrust_acceleration_m_s2)
        self._command, self._plan = step.command_rad, step.plan_rad
        return step


def compare_flights(settings: Settings) -> tuple[str, Moments]:
    """Fly Table II in both scalar types; return a Markdown table and the moments of the first."""
    n = len(CASES)
    flight = Flight(
        Trajectories(tuple(CASES.values())),
        duration_s=DURATION_S,
        flights=n,
        update_period_s=settings.horizon.update_period_s,
    )
    recording = _RecordingController(settings, n)
    few, many = fly(flight, recording), fly(flight, CompiledController(in_float64(settings), n))
    apart_m = np.hypot(*np.moveaxis((few.position_m - many.position_m)[..., :2], -1, 0)).max(axis=0)
    indices = [(m.iae_m_s, m.ise_m2_s, m.itse_m2_s2, m.itae_m_s2) for m in map(measure, (few, many))]
    few_scalar = settings.code.scalar
    rows = []
    for row, case in enumerate(CASES):
        iae, *others = ((f"{a[row]:.4g}", f"{b[row]:.4g}") for a, b in zip(*indices, strict=True))
        rows.append(
            {"Table II case": case, f"IAE {few_scalar}": iae[0], "IAE float64": iae[1]}
            | {name: " / ".join(both) for name, both in zip(("ISE", "ITSE", "ITAE"), others, strict=True)}
            | {"paths apart, m": f"{apart_m[row]:.3f}"}
        )
    moments = Moments(
        *(np.concatenate([getattr(m, field.name) for m in recording.moments]) for field in fields(Moments))
    )
    return table(rows), moments


def decision_table(found: Sequence[Disagreement]) -> str:
    """Return a Markdown table with a row for each kind of input."""
    return table(
        [
            {
                "inputs": one.inputs,
                "steps": f"{one.steps}",
                "of these decide otherwise": f"{one.differing_steps}",
                "first in iteration 1, 2, ...": ", ".join(map(str, one.first_by_iteration)),
                "decisions that differ": f"{one.differing} of {one.decisions}",
                "command changes by: median, 99 %, largest, rad": (
                    ", ".join(f"{rad:.3f}" for rad in one.command_rad) if one.differing_steps else "-"
                ),
                "by rounding alone, rad": f"{one.rounding_rad:.1e}",
            }
            for one in found
        ]
    )


def main() -> None:
    """Print both tables for two presets in float32 and in fixed point."""
    for name in ("mambo-1norm", "table1"):
        for scalar in ("float32", "fixed"):
            settings = with_option(presets.load(name), "code.scalar", scalar)
            flights, flown = compare_flights(settings)
            rng = np.random.default_rng(0)
            inputs = {
                "random": random_moments(settings, RANDOM_STEPS, rng),
                "at an edge": at_the_edge(settings, random_moments(settings, EDGE_SEEDS, rng)),
                "in flight": flown,
            }
            decisions = decision_table([disagreement(settings, kind, m) for kind, m in inputs.items()])
            print(f"## Preset {name}, {scalar}\n\n{decisions}\n\n{flights}\n")


if __name__ == "__main__":
    main()
