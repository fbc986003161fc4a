"""Check: a step does the same work whatever it is handed; read off the source, and counted as it runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pycparser.c_parser import ParseError

from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.codegen.toolchain import host_toolchain
from mambo_nmpc.sil.verify.bundle import controller, library
from mambo_nmpc.sil.verify.check import Outcome, Result, Subject
from mambo_nmpc.sil.verify.counting import TOGETHER, count, counting_program, places
from mambo_nmpc.sil.verify.inputs import random_inputs
from mambo_nmpc.sil.verify.loops import Reading, read_loops, read_unit
from mambo_nmpc.sil.verify.passes import Count, runs

STEPS: Final = 20_000


def check(subject: Subject) -> Result:
    """Read every loop of the bundle's C, and count passes over random and corner inputs.

    Raises BuildError and CacheError.
    """
    toolchain = host_toolchain()
    tools = {
        "compiler": toolchain.identity().splitlines()[0],
        "pycparser": metadata.version("pycparser"),
    }
    sources = sorted(path for path in library(subject) if path.startswith("src/") and path.endswith(".c"))
    try:
        units = [read_unit(path, subject.bundle, toolchain, subject.folder) for path in sources]
    except ParseError as error:
        return Result(Outcome.FAILED, f"no C99 that can be read: {error}", {}, tools)
    reading = read_loops(units)
    if reading.faults:
        return Result(Outcome.FAILED, "; ".join(reading.faults), {"faults": list(reading.faults)}, tools)
    program = counting_program(units, subject.settings, subject.bundle, subject.folder, toolchain)
    counted = _count(subject, program, places(units))
    result = judge(reading, counted, subject.settings)
    return Result(result.outcome, result.evidence, result.figures, tools)


@dataclass(frozen=True, eq=False)
class Counted:
    """What was counted: accepted (n,) steps, counts (n, places), and whether commands kept their bits."""

    places: Sequence[str]
    accepted: NDArray[np.bool_]
    counts: NDArray[np.uint32]
    same_bits: bool


def _count(subject: Subject, program: Path, counted_places: Sequence[str]) -> Counted:
    settings = subject.settings
    rng = np.random.default_rng(0)
    drawn = random_inputs(settings, STEPS, rng)
    inputs = np.concatenate([drawn.state, drawn.target, drawn.thrust[:, np.newaxis]], axis=1)
    status, command, counts = count(program, settings, len(counted_places), inputs)
    plain = controller(subject, TOGETHER)
    expected = [plain.step(now[:, :7], now[:, 7:11], now[:, 11]) for now in inputs.reshape(-1, TOGETHER, 12)]
    same = np.array_equal(status, np.concatenate([step.status for step in expected]))
    bits = command.tobytes() == np.concatenate([step.command_rad for step in expected]).tobytes()
    return Counted(counted_places, status == 0, counts, same and bits)


def judge(reading: Reading, counted: Counted, settings: Settings) -> Result:
    """Hold what was counted against what the source says.

    An accepted step evaluates the cost exactly `optimizer.iterations` times, and runs everything else as
    often as the source allows; a refused one searches nothing.
    """
    prefix = settings.code.prefix
    search, prepare, evaluate, step = (
        f"{prefix}_{name}" for name in ("optimizer_minimize", "predictor_prepare", "cost_evaluate", "step")
    )
    missing = [name for name in (search, prepare, evaluate, step) if name not in reading.defined]
    if missing:
        return Result(Outcome.INCOMPLETE, f"the library defines no {', '.join(missing)}")
    least = runs(reading, search)[0] + runs(reading, prepare)[0]
    most = runs(reading, step)[1]
    iterations = settings.optimizer.iterations
    wrong = []
    if (least[evaluate], most[evaluate]) != (iterations, iterations):
        wrong.append(f"{evaluate} runs {least[evaluate]} to {most[evaluate]} times a step, not {iterations}")
    if not counted.same_bits:
        wrong.append("the counting build commands otherwise than the plain one")
    seen = _seen(counted, counted.accepted)
    refused = _seen(counted, ~counted.accepted)
    for one, (fewest, highest) in seen.items():
        if not least[one] <= fewest <= highest <= most[one]:
            wrong.append(
                f"{one} ran {fewest} to {highest} times, where the source has {least[one]} to {most[one]}"
            )
    wrong += [f"{one} ran in a refused step" for one in (search, prepare, evaluate) if refused[one][1]]
    is_loop = [one in reading.trips for one in counted.places]
    together = counted.counts[counted.accepted][:, is_loop].sum(axis=1)
    figures = {
        "accepted": int(counted.accepted.sum()),
        "refused": int((~counted.accepted).sum()),
        "fewest_passes": int(together.min(initial=2**31)),
        "most_passes": int(together.max(initial=0)),
        "loops": _loops(reading, least, most, seen),
        "wrong": wrong,
    }
    if wrong:
        return Result(Outcome.FAILED, "; ".join(wrong), figures)
    return Result(
        Outcome.PASSED,
        f"{len(reading.trips)} loops, each bounded by a constant; {iterations} evaluations in "
        f"each of {figures['accepted']} accepted steps, none in {figures['refused']} refused; "
        f"{figures['fewest_passes']} to {figures['most_passes']} passes of all loops in a step",
        figures,
    )


def _seen(counted: Counted, chosen: NDArray[np.bool_]) -> Mapping[str, tuple[int, int]]:
    counts = counted.counts[chosen]
    return {
        one: (int(counts[:, column].min(initial=2**31)), int(counts[:, column].max(initial=0)))
        for column, one in enumerate(counted.places)
    }


def _loops(
    reading: Reading, least: Count, most: Count, seen: Mapping[str, tuple[int, int]]
) -> list[dict[str, Any]]:
    """Return for every loop of a step how often it may run, and ran."""
    return [
        {
            "loop": loop,
            "passes": list(trips),
            "least": least[loop],
            "most": most[loop],
            "seen": list(seen[loop]),
        }
        for loop, trips in reading.trips.items()
        if most[loop]
    ]
