"""What a controller takes of a board: flash, RAM, stack, instructions, time; and where it goes."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from pydantic import computed_field

from mambo_nmpc.codegen.boards import Board
from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.controllers.compiled import plainly_named
from mambo_nmpc.sil.controllers.emulated import build_guest
from mambo_nmpc.sil.controllers.pd import PdController
from mambo_nmpc.sil.errors import EmulatorError
from mambo_nmpc.sil.files.summary import Number
from mambo_nmpc.sil.firmware.build import ENTRY, PREFIX, Builder, builder
from mambo_nmpc.sil.firmware.disassembly import is_readable
from mambo_nmpc.sil.firmware.elf import load
from mambo_nmpc.sil.firmware.gate import Forbidden, forbidden
from mambo_nmpc.sil.firmware.sizes import Added, added
from mambo_nmpc.sil.firmware.stack import StackReport, worst_case
from mambo_nmpc.sil.flight.loop import Flight, fly
from mambo_nmpc.sil.flight.traces import Trace
from mambo_nmpc.sil.flight.trajectories import Bernoulli
from mambo_nmpc.sil.footprint.counts import InstructionCounts, count_instructions, in_flight, spread

COUNTED_STEPS: Final = 300
"""Steps that are counted: a sixth in flight, a third from everywhere, half in search of the worst."""
_FEWEST_STEPS: Final = 6
_USUAL_WORK: Final = 1000
"""Predicted steps times moves times iterations up to which all steps are counted."""
_FLIGHT_S: Final = 20.0


@dataclass(frozen=True)
class Limit:
    """One measured value against its budget; `unit` is of both."""

    name: str
    value: Number
    budget: Number
    unit: str

    @computed_field  # type: ignore[prop-decorator] # mypy knows no decorated property
    @property
    def share(self) -> float:
        """The value as a share of the budget."""
        return self.value / self.budget

    @computed_field  # type: ignore[prop-decorator] # likewise
    @property
    def percent(self) -> str:
        """The share in %, with three digits."""
        return f"{100 * self.share:.3g}"

    @computed_field  # type: ignore[prop-decorator] # likewise
    @property
    def width(self) -> float:
        """The width of the bar on a page, in %."""
        return min(100, round(100 * self.share, 1))


@dataclass(frozen=True)
class Footprint:
    """The measured controller on one board.

    `added` is what it adds to a program without it, its instance in static memory included. `stack` is None
    where the code of the processor cannot be taken apart here, `counts` where it cannot be emulated, and then
    `uncounted` says why.
    """

    board: Board
    compiler: str
    optimisation: str
    scalar: str
    added: Added
    instance_bytes: int
    stack: StackReport | None
    counts: InstructionCounts | None
    uncounted: str
    forbidden: tuple[Forbidden, ...]
    update_period_s: float

    @property
    def cycles(self) -> tuple[float, float] | None:
        """An estimate of the clock cycles of the most expensive step: least and most."""
        if self.counts is None:
            return None
        cycles, error = self.board.cycles.per_instruction * self.counts.most, self.board.cycles.error_share
        return (1 - error) * cycles, (1 + error) * cycles

    @property
    def time_s(self) -> tuple[float, float] | None:
        """An estimate of the time of the most expensive step, in seconds: least and most."""
        clock_hz = self.board.clock_hz.value
        return None if self.cycles is None else (self.cycles[0] / clock_hz, self.cycles[1] / clock_hz)

    @property
    def limits(self) -> tuple[Limit, ...]:
        """Every measured value that has a budget."""
        budget = self.board.budget
        limits = [
            Limit("flash", self.added.flash.total, budget.flash_bytes, "B"),
            Limit("RAM", self.added.ram.total, budget.ram_bytes, "B"),
        ]
        if self.stack is not None:
            limits.append(Limit("stack", self.stack.bytes, budget.stack_bytes, "B"))
        if self.time_s is not None:
            period_ms = 1000 * self.update_period_s
            time_ms = float(f"{1000 * self.time_s[1]:.4g}")  # an estimate has no more digits
            limits.append(Limit("time", time_ms, budget.period_share * period_ms, "ms"))
        return tuple(limits)

    @property
    def complete(self) -> bool:
        """Tell whether everything that has a budget was measured."""
        return self.stack is not None and self.counts is not None

    @property
    def fits(self) -> bool:
        """Tell whether all that was measured is within budget, and nothing is linked that must not be."""
        return not self.forbidden and all(limit.share <= 1 for limit in self.limits)

    def largest(self, count: int) -> list[tuple[str, int]]:
        """Return the largest symbols of flash and RAM, own and the compiler's."""
        everything = self.added.own | self.added.helpers
        return sorted(everything.items(), key=lambda item: -item[1])[:count]


def measure_footprint(
    settings: Settings, board: Board, optimisation: str = "-O2", counted_steps: int = COUNTED_STEPS
) -> Footprint:
    """Build the C of `settings` for `board` and measure it.

    Raises BuildError if there is no compiler, FootprintError if the stack has no provable bound.
    """
    found = builder(board, optimisation)
    files = render(plainly_named(settings), with_digest=False)
    with tempfile.TemporaryDirectory(prefix="mambo-nmpc-") as work:
        folder = Path(work)
        firmware = found.firmware(files, folder)
        image = load(firmware)
        readable = is_readable(image)
        sizes = added(firmware, found.firmware(files, folder, empty=True), PREFIX)
        counts, uncounted = _counts(settings, found, folder, counted_steps)
        return Footprint(
            board=board,
            compiler=found.compiler,
            optimisation=optimisation,
            scalar=settings.code.scalar,
            added=sizes,
            instance_bytes=image.symbol("nmpc_controller").size_bytes,
            stack=worst_case(image, ENTRY) if readable else None,
            counts=counts,
            uncounted=uncounted,
            forbidden=forbidden(image, settings.code.scalar),
            update_period_s=settings.horizon.update_period_s,
        )


@lru_cache(maxsize=1)
def _flight() -> Trace:
    """Fly the figure of eight with the PD: what a controller meets in flight, tracking well or not."""
    return fly(Flight(Bernoulli(2.0, 0.5), duration_s=_FLIGHT_S), PdController())


def _counts(
    settings: Settings, found: Builder, folder: Path, steps: int
) -> tuple[InstructionCounts | None, str]:
    """Count steps in flight, steps from everywhere, and steps in search of the worst; fewer of long ones.

    Returns None, and why, where the board cannot be emulated here.
    """
    work = settings.horizon.prediction * settings.horizon.control * settings.optimizer.iterations
    steps = max(_FEWEST_STEPS, min(steps, steps * _USUAL_WORK // work))
    trace = _flight()
    inputs = in_flight(trace, every=len(trace.time_s) * 6 // steps) + spread(settings, steps // 3)
    elf = build_guest(settings, found, folder)
    try:
        return count_instructions(settings, elf, found.board.emulated_core.value, inputs, steps // 2), ""
    except EmulatorError as error:
        return None, str(error)


def measure_boards(
    settings: Settings, boards: Sequence[Board], optimisation: str, progress: Callable[[float], None]
) -> tuple[list[Footprint], list[str]]:
    """Measure on every board that has a compiler here; returns footprints, and what is missing for others.

    Raises BuildError if there is no compiler for any.
    """
    measured: list[Footprint] = []
    missing: list[str] = []
    for index, board in enumerate(boards):
        try:
            measured.append(measure_footprint(settings, board, optimisation))
        except BuildError as error:
            missing.append(str(error))
        progress((index + 1) / len(boards))
    if not measured:
        raise BuildError("\n".join(missing))
    return measured, missing
