"""Footprints as a record, as text, as a page and as a section of the report."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

from mambo_codegen.settings.model import Settings
from mambo_sil.board.firmware.gate import Forbidden
from mambo_sil.board.firmware.sizes import Parts
from mambo_sil.board.firmware.stack import Frame
from mambo_sil.board.footprint.counts import CycleCounts, InstructionCounts
from mambo_sil.board.footprint.measure import Footprint, Limit
from mambo_sil.board.footprint.on_board import BoardMeasurement
from mambo_sil.results.html_page import render_page
from mambo_sil.results.summary import ReportedSummary, Section
from mambo_sil.results.terminal import sentence, table

_FUNCTION_HEAD = ("function", "size B", "own frame B", "deepest B", "instructions")
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
        stack = str(sum(frame.bytes for frame in self.stack_path)) if self.stack_path else "-"
        return [
            ("a step", "measured: least / median / most", "counted: least / mean / largest; estimated"),
            ("instructions", "-", counted[0]),
            ("cycles", " / ".join(f"{one:.0f}" for one in cycles), counted[1]),
            ("time, ms", " / ".join(f"{one:.3g}" for one in time_ms), counted[2]),
            ("cycles per instruction", per_instruction, counted[3]),
            ("stack, B", str(board.stack_bytes), stack),
        ]


class FootprintSummary(ReportedSummary):
    """Footprints on boards."""

    command = "footprint"

    source: str
    digest: str
    scalar: str
    optimisation: str
    boards: list[BoardFootprint]

    def section(self, _folder: Path) -> Section:
        """Return the section of the report on these footprints."""
        fits = sum(board.fits for board in self.boards)
        finding = f"fits {fits} of {len(self.boards)} boards"
        measured = [board.on_board for board in self.boards if board.on_board is not None]
        different = [one.board_says for one in measured if one.different_steps]
        if different:
            finding += f"; other bits on {different[0]}"
        good = fits == len(self.boards) and not different
        return Section("footprint", f"Footprint of {self.source}", good, finding, self)


def summarise(footprints: Sequence[Footprint], source: str, settings: Settings) -> FootprintSummary:
    """Return everything that was measured."""
    return FootprintSummary(
        source=source,
        digest=settings.short_digest,
        scalar=settings.code.scalar,
        optimisation=footprints[0].optimisation,
        boards=[_board(footprint) for footprint in footprints],
    )


def text(footprints: Sequence[Footprint]) -> str:
    """Return the answer, a table of the boards, the functions if there is one board, and notes."""
    lines = [*map(_answer, footprints), "", *table(_HEAD, list(map(_row, footprints)), (0, -1))]
    if len(footprints) == 1:
        if footprints[0].on_board is not None:
            compared = _board(footprints[0]).compared
            lines += ["", sentence(footprints[0].on_board.sentence), *table(compared[0], compared[1:])]
        functions = [tuple(map(str, astuple(one))) for one in _functions(footprints[0])]
        lines += ["", *table(_FUNCTION_HEAD, functions)]
    cycles = [_board(footprint).cycles_sentence for footprint in footprints if footprint.cycles]
    lines += ["", *map(sentence, cycles)] if cycles else []
    notes = [note for footprint in footprints for note in _notes(footprint)]
    return "\n".join([*lines, *(["", *map(sentence, notes)] if notes else [])])


def _answer(footprint: Footprint) -> str:
    """Return whether the controller fits a board, and what it takes."""
    verdict = ("fits" if footprint.complete else "incomplete") if footprint.fits else "OVER"
    found = f"{footprint.board.name}: {verdict}, {footprint.added.flash.total / 1000:.3g} KB of flash"
    if footprint.time_s is None:
        return found
    return f"{found}, {100 * footprint.time_s[1] / footprint.update_period_s:.2g} % of the period"


def page(summary: FootprintSummary) -> str:
    """Render the summary as one HTML page that needs no other file."""
    return render_page("footprint.html.j2", {"summary": summary})


def _row(footprint: Footprint) -> tuple[str, ...]:
    counts, time_s = footprint.counts, footprint.time_s
    return (
        footprint.board.name,
        str(footprint.added.flash.total),
        str(footprint.added.ram.total),
        "-" if footprint.stack is None else str(footprint.stack.bytes),
        "-" if counts is None else f"{counts.mean:.0f} / {counts.most_met}",
        _cycles_cell(footprint),
        "-" if time_s is None else f"{1000 * time_s[1]:.3g}",
        "-" if time_s is None else f"{100 * time_s[1] / footprint.update_period_s:.2g} %",
        ("fits" if footprint.complete else "incomplete") if footprint.fits else "OVER",
    )


def _cycles_cell(footprint: Footprint) -> str:
    """Return the modelled cycles of the most expensive step, or their estimate."""
    modelled = _modelled(footprint)
    if modelled is not None:
        return str(modelled.most_met)
    return "-" if footprint.cycles is None else f"~{sum(footprint.cycles) / 2:.0f}"


def _modelled(footprint: Footprint) -> CycleCounts | None:
    return None if footprint.counts is None else footprint.counts.cycles


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
        cycles=_modelled(footprint),
        cycles_source=footprint.cycles_source,
        cycles_estimate=footprint.cycles,
        time_s_estimate=footprint.time_s,
        forbidden=footprint.forbidden,
        functions=_functions(footprint),
        notes=_notes(footprint),
        on_board=footprint.on_board,
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
