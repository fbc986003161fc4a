"""Measure the footprint of a controller on a board: flash, RAM, stack, instructions, time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from pydantic import computed_field

from mambo_codegen.boards import Board
from mambo_codegen.bundle.render import render
from mambo_codegen.errors import BuildError
from mambo_codegen.settings.model import Settings
from mambo_sil.board.emulated import build_guest
from mambo_sil.board.firmware.disassembly import is_readable
from mambo_sil.board.firmware.elf import load
from mambo_sil.board.firmware.firmware_build import ENTRY, PREFIX, Builder, builder
from mambo_sil.board.firmware.gate import Forbidden, find_forbidden
from mambo_sil.board.firmware.sizes import Added, measure_added
from mambo_sil.board.firmware.stack import StackReport, bound_stack
from mambo_sil.board.footprint.counts import InstructionCounts, count_instructions
from mambo_sil.board.footprint.cycles import MODELS
from mambo_sil.board.footprint.on_board import BoardMeasurement
from mambo_sil.errors import EmulatorError, FlightError
from mambo_sil.flight.controllers.controller_library import with_default_prefix
from mambo_sil.results.build_folders import scratch_folder
from mambo_sil.results.summary import Number

COUNTED_TICKS: Final = 300
"""Consecutive ticks of the flight to count; the search for a more expensive step takes half as many."""
_FEWEST_TICKS: Final = 4
_USUAL_WORK: Final = 1000
"""Prediction steps x moves x iterations above which fewer ticks are counted."""


@dataclass(frozen=True)
class Limit:
    """A measured value and its budget, both in `unit`."""

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
    """Footprint of one controller on one board.

    `added` is the difference between programs with and without the controller and its instance. `stack` is
    None if the code cannot be disassembled, `counts` if it cannot be emulated, for the reason `uncounted`.
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
    on_board: BoardMeasurement | None = None
    """What the board at a port measured, if there is one."""

    @property
    def cycles_source(self) -> str:
        """Where `cycles` are from: the manual of a model, or an estimate."""
        if self.board.cycles is None:
            return f"model: {MODELS[self.board.emulated_core.value].source}"
        estimate = self.board.cycles
        return f"estimate: {estimate.per_instruction:g} per instruction, +/- {100 * estimate.error_share:g} %"

    @property
    def cycles(self) -> tuple[float, float] | None:
        """Clock cycles of the most expensive step met, lower and upper end, modelled or estimated."""
        if self.counts is None:
            return None
        if self.board.cycles is None:
            modelled = self.counts.cycles
            return None if modelled is None else (modelled.fewest, modelled.most_with_wait)
        estimate = self.board.cycles
        cycles = estimate.per_instruction * self.counts.most_met
        return (1 - estimate.error_share) * cycles, (1 + estimate.error_share) * cycles

    @property
    def time_s(self) -> tuple[float, float] | None:
        """Time of the most expensive step met in seconds, lower and upper end, by `cycles`."""
        clock_hz = self.board.clock_hz.value
        return None if self.cycles is None else (self.cycles[0] / clock_hz, self.cycles[1] / clock_hz)

    @property
    def limits(self) -> tuple[Limit, ...]:
        """All measured values that have a budget; time in ms, upper end of the band."""
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
        """Whether everything that has a budget was measured."""
        return self.stack is not None and self.counts is not None

    @property
    def fits(self) -> bool:
        """Whether all measured values are within budget and nothing forbidden is linked."""
        return not self.forbidden and all(limit.share <= 1 for limit in self.limits)

    @property
    def good(self) -> bool:
        """Whether it fits, and a board at a port has the bits of this machine."""
        return self.fits and (self.on_board is None or not self.on_board.different_steps)


def measure_footprint(
    settings: Settings, board: Board, optimisation: str = "-O2", counted_ticks: int = COUNTED_TICKS
) -> Footprint:
    """Build the C of `settings` for `board` and measure it.

    Raises BuildError if the compiler is missing or fails, FootprintError if no stack bound can be proven.
    """
    found = builder(board, optimisation)
    files = render(with_default_prefix(settings), with_digest=False)
    with scratch_folder() as folder:
        firmware = found.firmware(files, folder)
        image = load(firmware)
        readable = is_readable(image)
        sizes = measure_added(firmware, found.firmware(files, folder, empty=True), PREFIX)
        counts, uncounted = _counts(settings, found, folder, counted_ticks)
        return Footprint(
            board=board,
            compiler=found.compiler,
            optimisation=optimisation,
            scalar=settings.code.scalar,
            added=sizes,
            instance_bytes=image.symbol("nmpc_controller").size_bytes,
            stack=bound_stack(image, ENTRY) if readable else None,
            counts=counts,
            uncounted=uncounted,
            forbidden=find_forbidden(image, settings.code.scalar),
            update_period_s=settings.horizon.update_period_s,
        )


def usual_ticks(settings: Settings, ticks: int = COUNTED_TICKS) -> int:
    """Return how many ticks of the flight are counted: `ticks`, or fewer if one takes long."""
    work = settings.horizon.prediction * settings.horizon.control * settings.optimizer.iterations
    return max(_FEWEST_TICKS, min(ticks, ticks * _USUAL_WORK // work))


def _counts(
    settings: Settings, found: Builder, folder: Path, ticks: int
) -> tuple[InstructionCounts | None, str]:
    """Count the `usual_ticks` of a flight, and the steps of the search.

    Returns None and the reason if the board cannot be emulated, or the controller refuses the whole flight.
    """
    ticks = usual_ticks(settings, ticks)
    elf = build_guest(settings, found, folder)
    board = found.board
    try:
        counts = count_instructions(
            settings,
            elf,
            board.emulated_core.value,
            ticks,
            ticks // 2,
            modelled=board.cycles is None,
            flash=board.flash_wait,
        )
    except (EmulatorError, FlightError) as error:
        return None, str(error)
    return counts, ""


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
