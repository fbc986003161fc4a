"""Check: the controller decides like one of another precision but for ties, and flies alike."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Final

import numpy as np

from benchmarks.sign_decisions import (
    MANY,
    Disagreement,
    Flown,
    Moments,
    at_the_edge,
    disagreement,
    fly_both,
    with_few,
    with_random_memory,
)
from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.codegen.toolchain import host_toolchain
from mambo_nmpc.sil.controllers.compiled import CompiledController
from mambo_nmpc.sil.faults.flights import STRAY_M
from mambo_nmpc.sil.files.folders import finite
from mambo_nmpc.sil.verify.bundle import controller
from mambo_nmpc.sil.verify.check import Outcome, Result, Subject
from mambo_nmpc.sil.verify.inputs import random_inputs

RANDOM_STEPS: Final = 100_000
EDGE_SEEDS: Final = 10_000
ALIKE: Final = 0.05
"""Largest relative difference of the IAE that still counts as flying alike."""


def check(subject: Subject) -> Result:
    """Compare both scalar types on random, adversarial and flown steps, and in flight.

    Raises BuildError, CacheError and FlightError.
    """
    settings = subject.settings

    def make(chosen: Settings, n: int) -> CompiledController:
        own = chosen.code.scalar == settings.code.scalar
        return controller(subject, n) if own else CompiledController(chosen, n)

    flown, moments = fly_both(settings, make)
    rng = np.random.default_rng(0)
    found = (
        disagreement(settings, "random", _random(settings, RANDOM_STEPS, rng)),
        disagreement(settings, "at an edge", at_the_edge(settings, _random(settings, EDGE_SEEDS, rng))),
        disagreement(settings, "in flight", moments),
    )
    (subject.folder / "signs.md").write_text(text(found, flown, settings), "utf-8")
    return judge(found, flown, settings)


def _random(settings: Settings, n: int, rng: np.random.Generator) -> Moments:
    drawn = random_inputs(settings, n, rng)
    return with_random_memory(settings, (drawn.state, drawn.target, drawn.thrust), rng)


def judge(found: Sequence[Disagreement], flown: Sequence[Flown], settings: Settings) -> Result:
    """Judge: steps that decide alike command alike but for rounding, and the flights differ by ALIKE at most.

    A controller that strays in both scalar types cannot show that it flies alike: INCOMPLETE.
    """
    few, rounding_rad = with_few(settings).code.scalar, _rounding_rad(settings)
    wrong = [
        f"{one.inputs}: commands {one.rounding_rad:.2g} rad apart without a differing decision"
        for one in found
        if not one.rounding_rad <= rounding_rad
    ]
    strays = all(not error_m <= STRAY_M for one in flown for error_m in one.largest_error_m)
    if not strays:
        wrong += [
            f"{one.case}: IAE {one.few[0]:.4g} in {few}, {one.many[0]:.4g} in {MANY}"
            for one in flown
            if not abs(one.few[0] / one.many[0] - 1.0) <= ALIKE
        ]
    figures = finite(
        {
            "decisions": [asdict(one) for one in found],
            "flights": [asdict(one) for one in flown],
            "wrong": wrong,
        }
    )
    tools = {"numpy": np.__version__, "compiler": host_toolchain().identity().splitlines()[0]}
    if wrong:
        return Result(Outcome.FAILED, "; ".join(wrong), figures, tools)
    if strays:
        return Result(Outcome.INCOMPLETE, "strays in both scalar types, nothing to compare", figures, tools)
    evidence = "steps with another decision: " + ", ".join(
        f"{one.differing_steps} of {one.steps} {one.inputs}" for one in found
    )
    worst = max(abs(one.few[0] / one.many[0] - 1.0) for one in flown)
    return Result(
        Outcome.PASSED, f"{evidence}; IAE of whole flights within {100 * worst:.1f} %", figures, tools
    )


def _rounding_rad(settings: Settings) -> float:
    """Return what rounding can change a command by: four units in the last place for each iteration.

    That of the largest angle; in fixed point all have the same, and it grows with the steps of the search.
    """
    optimizer, bits = settings.optimizer, Design(with_few(settings)).numbers.bits
    if bits is None:
        largest_rad = max(settings.limits.tilt_rad, optimizer.step_max_rad)
        return 4 * optimizer.iterations * float(np.finfo(np.float32).eps) * largest_rad
    growth = optimizer.increase ** (optimizer.iterations - 1)
    growth = min(growth, optimizer.step_max_rad / optimizer.initial_step_rad)
    return 4 * optimizer.iterations * 2.0 ** -bits["angle"] * growth


def text(found: Sequence[Disagreement], flown: Sequence[Flown], settings: Settings) -> str:
    """Spell both comparisons as Markdown tables."""
    lines = [
        "| inputs | steps | of these decide otherwise | first in iteration 1, 2, ... "
        "| decisions that differ | command changes by: median, 99 %, largest, rad | by rounding alone, rad |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for one in found:
        spread = ", ".join(f"{value:.3f}" for value in one.command_rad) if one.differing_steps else "-"
        lines.append(
            f"| {one.inputs} | {one.steps} | {one.differing_steps} | "
            f"{', '.join(map(str, one.first_by_iteration))} | {one.differing} of {one.decisions} | "
            f"{spread} | {one.rounding_rad:.1e} |"
        )
    few = with_few(settings).code.scalar
    lines += [
        "",
        f"| Table II case | IAE {few} | IAE {MANY} | ISE | ITSE | ITAE | paths apart, m |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for case in flown:
        pairs = [f"{few:.4g} / {many:.4g}" for few, many in zip(case.few[1:], case.many[1:], strict=True)]
        iae = f"{case.few[0]:.4g} | {case.many[0]:.4g}"
        lines.append(f"| {case.case} | {iae} | {' | '.join(pairs)} | {case.apart_m:.3f} |")
    return "\n".join(lines) + "\n"
