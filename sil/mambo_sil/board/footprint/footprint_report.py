"""Footprints: record and result."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

from mambo_codegen.errors import echo
from mambo_codegen.settings.model import Settings
from mambo_sil.board.firmware.gate import Forbidden
from mambo_sil.board.firmware.sizes import Parts
from mambo_sil.board.firmware.stack import Frame
from mambo_sil.board.footprint.counts import CycleCounts, InstructionCounts
from mambo_sil.board.footprint.measure import Footprint, Limit
from mambo_sil.board.footprint.on_board import BoardMeasurement
from mambo_sil.results.blocks import Block, CommandResult, Details, Facts, Note, ResultTable, Sentence
from mambo_sil.results.number_format import digits
from mambo_sil.results.summary import ReportedSummary

_FUNCTION_HEAD = ("function", "size B", "own frame B", "deepest B", "instructions")
_ABOUT = (
    "Sizes are the difference to the same program without the controller. Instructions are counted on an "
    "emulated core, including conditional ones that are not executed; times are estimates."
)
_HEAD = (
    "board",
    "flash B",
    "RAM B",
    "stack B",
    "instructions, mean / most",
    "cycles, most",
    "time, ms",
    "period",
    "",
)


@dataclass(frozen=True)
class FunctionFootprint:
    """A symbol of the program; a dash is what was not measured."""

    name: str
    size: int | str
    frame: int | str
    depth: int | str
    instructions: int | str


@dataclass(frozen=True)
class BoardFootprint:
    """The footprint on one board."""

    name: str
    title: str
    core: str
    compiler: str
    fits: bool
    complete: bool
    limits: tuple[Limit, ...]
    flash_bytes: Parts
    flash_sections: dict[str, int]
    ram_bytes: Parts
    instance_bytes: int
    stack_path: tuple[Frame, ...]
    instructions: InstructionCounts | None
    cycles: CycleCounts | None
    cycles_source: str
    cycles_estimate: tuple[float, float] | None
    time_s_estimate: tuple[float, float] | None
    forbidden: tuple[Forbidden, ...]
    functions: list[FunctionFootprint]
    notes: list[str]
    on_board: BoardMeasurement | None = None
    period_share: float | None = None
    """The time of the most expensive step over the update period."""

    @property
    def verdict(self) -> str:
        """Whether the controller fits."""
        return ("fits" if self.complete else "incomplete") if self.fits else "OVER"

    @property
    def answer(self) -> str:
        """Whether the controller fits, and what it takes."""
        found = f"{self.name}: {self.verdict}, {self.flash_bytes.total / 1000:.3g} KB of flash"
        return found if self.period_share is None else f"{found}, {self._period} of the period"

    @property
    def _period(self) -> str:
        return "-" if self.period_share is None else f"{100 * self.period_share:.2g} %"

    @property
    def _stack(self) -> str:
        return str(sum(frame.bytes for frame in self.stack_path)) if self.stack_path else "-"

    @property
    def row(self) -> tuple[str, ...]:
        """What the controller takes, as a row of a table."""
        counts, time_s, cycles = self.instructions, self.time_s_estimate, "-"
        if self.cycles is not None:
            cycles = str(self.cycles.most_met)
        elif self.cycles_estimate is not None:
            cycles = f"~{sum(self.cycles_estimate) / 2:.0f}"
        return (
            self.name,
            str(self.flash_bytes.total),
            str(self.ram_bytes.total),
            self._stack,
            "-" if counts is None else f"{counts.mean:.0f} / {counts.most_met}",
            cycles,
            "-" if time_s is None else f"{1000 * time_s[1]:.3g}",
            self._period,
            self.verdict,
        )

    @property
    def cycles_sentence(self) -> str:
        """What the cycles are, and the bounds of the most expensive step."""
        if self.cycles is None or self.cycles_estimate is None:
            return f"{self.name}: cycles are an {self.cycles_source} for the most expensive step found"
        low, high = (f"{limit:.0f}" for limit in self.cycles_estimate)
        bounds = low if low == high else f"{low} to {high} with the wait states of the flash"
        return (
            f"{self.name}: cycles are a {self.cycles_source}, without wait states; "
            f"the most expensive step found takes {bounds}"
        )

    @property
    def compared(self) -> list[tuple[str, str, str]]:
        """A head and rows: what the board at the port measured, beside what was counted or estimated."""
        board, counts = self.on_board, self.instructions
        if board is None:
            return []
        counted, per_instruction = ("-",) * 4, "-"
        if counts is not None and self.cycles_estimate is not None and self.time_s_estimate is not None:
            (low, high), time_ms = self.cycles_estimate, [1000 * limit for limit in self.time_s_estimate]
            counted = (
                f"{counts.least} / {counts.mean:.0f} / {counts.most_met}",
                f"{low:.0f}..{high:.0f}",
                f"{time_ms[0]:.3g}..{time_ms[1]:.3g}",
                f"{low / counts.most_met:.3g}..{high / counts.most_met:.3g}",
            )
            per_instruction = f"{board.mean_cycles / counts.mean:.3g}"
        cycles = (board.cycles.least, board.cycles.median, board.cycles.most)
        time_ms = [1000 * one / board.clock_hz for one in cycles]
        return [
            ("a step", "measured: least / median / most", "counted: least / mean / largest; estimated"),
            ("instructions", "-", counted[0]),
            ("cycles", " / ".join(f"{one:.0f}" for one in cycles), counted[1]),
            ("time, ms", " / ".join(f"{one:.3g}" for one in time_ms), counted[2]),
            ("cycles per instruction", per_instruction, counted[3]),
            ("stack, B", str(board.stack_bytes), self._stack),
        ]

    @property
    def function_table(self) -> ResultTable:
        """Size, frame, depth and instructions of every symbol."""
        return ResultTable(_FUNCTION_HEAD, [tuple(map(str, astuple(one))) for one in self.functions])

    def details(self, *, functions: bool) -> Details:
        """Return what only a page shows of the board: budgets, counts, and functions."""
        limits = [
            (f"{one.name}, {one.unit}", digits(one.value), digits(one.budget), f"{one.percent} %")
            for one in self.limits
        ]
        facts = {"core": self.core, "compiler": self.compiler}
        if self.instructions is not None:
            counts = self.instructions
            facts["instructions per step"] = (
                f"{counts.least} at least and {digits(counts.mean)} on average over {counts.ticks} "
                f"ticks of a flight; {counts.most_met} the most found, in {counts.searched} steps of a search"
            )
        if self.cycles is not None:
            facts["cycles per step"] = (
                f"a {self.cycles_source}, without wait states: {digits(self.cycles.least)} at least, "
                f"{digits(self.cycles.mean)} on average, {digits(self.cycles.most_met)} the most found"
            )
        table = ResultTable(("quantity", "measured", "budget", "share"), limits)
        return Details(self.title, [Facts(facts), table, *([self.function_table] if functions else [])])


class FootprintSummary(ReportedSummary):
    """Footprints on boards."""

    command = "footprint"

    source: str
    digest: str
    scalar: str
    optimisation: str
    boards: list[BoardFootprint]

    def result(self, _folder: Path, /) -> CommandResult:
        """Return the result: whether it fits each board, and what it takes there."""
        measured = (board.on_board for board in self.boards if board.on_board is not None)
        different = [f"OTHER BITS on {echo(one.board_says)}" for one in measured if one.different_steps]
        alone = len(self.boards) == 1
        blocks: list[Block] = [ResultTable(_HEAD, [board.row for board in self.boards], (0, -1))]
        for board in self.boards:
            if board.on_board is not None:
                head, *rows = board.compared
                blocks += [Sentence(board.on_board.sentence), ResultTable(head, rows)]
        if alone:
            blocks.append(self.boards[0].function_table)
        blocks += [
            Sentence(board.cycles_sentence) for board in self.boards if board.cycles_estimate is not None
        ]
        blocks += [Sentence(note) for board in self.boards for note in board.notes]
        about = f"{self.generator}, settings {self.digest}, {self.scalar}, {self.optimisation}. {_ABOUT}"
        return CommandResult(
            f"Footprint of {echo(self.source)}",
            all(board.fits for board in self.boards) and not different,
            [*(board.answer for board in self.boards), *different],
            [*blocks, *(board.details(functions=not alone) for board in self.boards), Note(about)],
        )


def summarise(footprints: Sequence[Footprint], source: str, settings: Settings) -> FootprintSummary:
    """Return everything that was measured."""
    return FootprintSummary(
        source=source,
        digest=settings.short_digest,
        scalar=settings.code.scalar,
        optimisation=footprints[0].optimisation,
        boards=[_board(footprint) for footprint in footprints],
    )


def _board(footprint: Footprint) -> BoardFootprint:
    return BoardFootprint(
        name=footprint.board.name,
        title=footprint.board.title,
        core=footprint.board.core.value,
        compiler=footprint.compiler,
        fits=footprint.fits,
        complete=footprint.complete,
        limits=footprint.limits,
        flash_bytes=footprint.added.flash,
        flash_sections=footprint.added.sections.flash,
        ram_bytes=footprint.added.ram,
        instance_bytes=footprint.instance_bytes,
        stack_path=() if footprint.stack is None else footprint.stack.path,
        instructions=footprint.counts,
        cycles=None if footprint.counts is None else footprint.counts.cycles,
        cycles_source=footprint.cycles_source,
        cycles_estimate=footprint.cycles,
        time_s_estimate=footprint.time_s,
        forbidden=footprint.forbidden,
        functions=_functions(footprint),
        notes=_notes(footprint),
        on_board=footprint.on_board,
        period_share=None if footprint.time_s is None else footprint.time_s[1] / footprint.update_period_s,
    )


def _functions(footprint: Footprint) -> list[FunctionFootprint]:
    """Return size, frame, depth and instructions of every symbol, most instructions first."""
    counts = footprint.counts.by_function if footprint.counts else {}
    frames, depths = (footprint.stack.frames, footprint.stack.depths) if footprint.stack else ({}, {})
    sizes = footprint.added.own | footprint.added.helpers
    names = dict.fromkeys([*counts, *sorted(sizes, key=lambda name: -sizes[name])])
    return [
        FunctionFootprint(
            name,
            sizes.get(name, "-"),
            frames.get(name, "-"),
            depths.get(name, "-"),
            round(counts[name]) if name in counts else "-",
        )
        for name in names
    ]


def _notes(footprint: Footprint) -> list[str]:
    """Return a line for each value over budget, forbidden function, and missing measurement."""
    name, notes = footprint.board.name, []
    for limit in footprint.limits:
        if limit.share > 1:
            value, budget, over = (
                _format(number, limit.unit)
                for number in (limit.value, limit.budget, limit.value - limit.budget)
            )
            notes.append(f"{name}: {limit.name} {value} is over its budget of {budget} by {over}")
    if not footprint.fits:
        sizes = Counter(footprint.added.own | footprint.added.helpers).most_common(5)
        largest = ", ".join(f"{symbol} {size} B" for symbol, size in sizes)
        notes.append(f"{name}: largest symbols: {largest}")
    for found in footprint.forbidden:
        callers = ", ".join(found.callers) or "an unknown function"
        notes.append(f"{name}: {found.symbol} ({found.kind}) must not be linked; called by {callers}")
    measured, clock_hz = footprint.on_board, footprint.board.clock_hz.value
    if measured is not None and measured.clock_hz != clock_hz:
        notes.append(
            f"{name}: measured at {measured.clock_hz / 1e6:g} MHz, estimated at {clock_hz / 1e6:g} MHz; "
            "compare cycles, not times"
        )
    if footprint.stack is None:
        core = footprint.board.core.value
        notes.append(f"{name}: stack is not measured: {core} cannot be disassembled")
    if footprint.counts is None:
        notes.append(f"{name}: instructions, cycles and time are not measured: {footprint.uncounted}")
    return notes


def _format(value: float, unit: str) -> str:
    return f"{value:.0f} {unit}" if unit == "B" else f"{value:.4g} {unit}"
