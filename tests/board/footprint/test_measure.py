"""Footprints of the presets on the boards, and reports of exceeded budgets."""

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import product
from pathlib import Path

import pytest

from mambo_codegen import boards
from mambo_codegen.bundle.render import render
from mambo_codegen.errors import BuildError
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.board.firmware.elf import load
from mambo_sil.board.firmware.gate import Forbidden, find_forbidden
from mambo_sil.board.footprint import footprint_report
from mambo_sil.board.footprint.measure import Footprint, measure_footprint
from mambo_sil.results.html_page import results_page
from mambo_sil.results.terminal import result_text
from tests.support.command import unwrapped
from tests.support.one_norm import ONE_NORM
from tests.support.tools import board_builder, only

MAMBO = ONE_NORM
COST = {
    "float32": "return (weight.tracking * distance_m)",
    "fixed": "return tracking_cost(weight.tracking, distance_m)",
}
WIDENED = "1.0000001 *"
DIVIDED = "distance_m / weight.effort +"


@lru_cache
def measure_once(board: str, preset: str = "mambo", steps: int = 300) -> Footprint:
    """Measure a preset on a board, once."""
    board_builder(board)
    return measure_footprint(presets.load(preset), boards.load(board), counted_ticks=steps)


def text_of(footprints: Sequence[Footprint]) -> str:
    """Return what the command prints of footprints."""
    summary = footprint_report.summarise(footprints, "mambo", presets.load("mambo"))
    return result_text(summary.result(Path()))


@pytest.mark.long
def test_the_crazyflie_keeps_its_promises() -> None:
    """Preset mambo: 8.2 KiB of flash, 236 B of RAM, 280 B of stack, 900 instructions, at most 1,200."""
    footprint = measure_once("crazyflie")
    assert footprint.added.flash.total <= 8400
    assert footprint.added.ram.total <= 236
    assert footprint.added.ram.own == footprint.instance_bytes
    limits = {limit.name: limit.value for limit in footprint.limits}
    assert (limits["flash"], limits["RAM"]) == (footprint.added.flash.total, footprint.added.ram.total)
    assert footprint.stack is not None
    assert footprint.stack.bytes <= 280
    assert footprint.counts is not None
    assert footprint.counts.mean <= 900
    assert footprint.counts.most_met <= 1200
    assert footprint.counts.ticks == 300
    assert footprint.fits


@pytest.mark.first_is_quick
@pytest.mark.parametrize(("preset", "spread"), [("mambo", 1.65), ("mambo-1norm", 1.25), ("table1", 1.15)])
def test_the_work_of_a_step_hardly_depends_on_its_input(preset: str, spread: float) -> None:
    """Most instructions met over least, on the Cortex-M4F; where a limit acts, as in mambo, it does."""
    counts = measure_once("crazyflie", preset).counts
    assert counts is not None
    assert counts.most_met <= spread * counts.least


@pytest.mark.long
def test_table_1_runs_on_the_mambo_in_75_000_instructions() -> None:
    """Every step of the paper's controller, all floating point of the ARM926 in software."""
    counts = measure_once("mambo", "table1", steps=100).counts
    assert counts is not None
    assert counts.most_met <= 75_000
    assert counts.by_function["__addsf3"] + counts.by_function["__mulsf3"] > counts.mean / 2


@pytest.mark.long
def test_an_estimated_time_follows_from_instructions_clock_and_band() -> None:
    """Time = instructions x cycles per instruction / clock, with the board's band."""
    footprint = measure_once("teensy41")
    board, counts, time_s = footprint.board, footprint.counts, footprint.time_s
    assert counts is not None
    assert time_s is not None
    assert board.cycles is not None
    middle_s = counts.most_met * board.cycles.per_instruction / board.clock_hz.value
    assert time_s == pytest.approx(
        (middle_s * (1 - board.cycles.error_share), middle_s * (1 + board.cycles.error_share))
    )
    time = next(limit for limit in footprint.limits if limit.name == "time")
    assert (time.value, time.budget) == pytest.approx((1000 * time_s[1], 1.0), rel=1e-3)  # four digits


@pytest.mark.long
def test_the_report_says_whether_cycles_are_modelled_or_estimated() -> None:
    """In the table, below it, in the summary and on the page."""
    modelled, estimated = measure_once("crazyflie"), measure_once("teensy41")
    assert modelled.counts is not None
    assert estimated.counts is not None
    cycles = modelled.counts.cycles
    assert cycles is not None
    text = text_of([modelled, estimated])
    text = unwrapped(text)
    assert f" {cycles.most_met} " in text
    bounds = f"{cycles.fewest} to {cycles.most_with_wait} with the wait states of the flash"
    assert "crazyflie: cycles are a model: Cortex-M4 TRM, ARM DDI 0439D, without wait states; the " in text
    assert f"most expensive step found takes {bounds}" in text
    assert f" ~{estimated.counts.most_met} " in text
    assert "teensy41: cycles are an estimate: 1 per instruction, +/- 40 % for the most expensive" in text
    summary = footprint_report.summarise([modelled, estimated], "mambo", presets.load("mambo"))
    assert [board.cycles for board in summary.boards] == [cycles, None]
    assert [board.cycles_source.partition(":")[0] for board in summary.boards] == ["model", "estimate"]
    page = results_page([("out", summary.result(Path()))], [summary.generator])
    assert f"takes {bounds}" in page
    assert "an estimate: 1 per instruction, +/- 40 %" in page


@pytest.mark.long
def test_the_mega_is_measured_whole() -> None:
    """On AVR everything is measured, and avr-libc's arithmetic takes many of the instructions."""
    footprint = measure_once("mega", steps=6)
    assert footprint.complete
    assert footprint.stack is not None
    assert footprint.counts is not None
    assert footprint.stack.bytes <= footprint.board.budget.stack_bytes
    assert footprint.counts.by_function["__addsf3x"] > footprint.counts.mean / 5


def test_a_missing_measurement_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without an emulator there are no instruction counts and no limit on time, and the report says why."""
    board_builder("mega")
    monkeypatch.setenv("PATH", only(tmp_path, "avr-*"))
    monkeypatch.delenv("CC", raising=False)
    footprint = measure_footprint(MAMBO, boards.load("mega"), counted_ticks=6)
    assert footprint.stack is not None
    assert (footprint.counts, footprint.time_s) == (None, None)
    assert [limit.name for limit in footprint.limits] == ["flash", "RAM", "stack"]
    text = text_of([footprint])
    assert re.search(
        " mega: instructions, cycles and time are not measured: .*no C compiler found", unwrapped(text)
    )
    assert "incomplete" in text


def test_a_tiny_budget_is_exceeded_everywhere() -> None:
    """Each exceeded limit is reported with its excess, then the largest symbols."""
    tiny = {"flash_bytes": 2_000, "ram_bytes": 100, "stack_bytes": 50, "period_share": 0.0005}
    whole = measure_once("crazyflie")
    small = {"name": "tiny", "budget": whole.board.budget.model_copy(update=tiny)}
    footprint = replace(whole, board=whole.board.model_copy(update=small))
    assert not footprint.fits
    text = text_of([footprint])
    assert re.search(r"^tiny .* OVER$", text, re.MULTILINE)
    for limit, budget in (("flash", 2000), ("RAM", 100), ("stack", 50)):
        found = re.search(rf"^tiny: {limit} (\d+) B is over its budget of {budget} B by (\d+) B$", text, re.M)
        assert found, text
        assert int(found[1]) == budget + int(found[2]) > budget
    assert re.search(r"^tiny: time 0\.0\d+ ms is over its budget of 0\.005 ms by 0\.0\d+ ms$", text, re.M)
    largest = re.search(r"^tiny: largest symbols: (.*)$", text, re.MULTILINE)
    assert largest
    sizes = [int(size) for size in re.findall(r" (\d+) B", largest[1])]
    assert sizes == sorted(sizes, reverse=True)
    assert "nmpc_step" in largest[1]


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("name", "scalar", "wrong", "kind"),
    [
        ("crazyflie", "float32", WIDENED, "double precision"),
        ("mambo", "float32", WIDENED, "double precision"),
        ("rp2040", "float32", WIDENED, "double precision"),
        ("rv32", "float32", WIDENED, "double precision"),
        ("mambo", "fixed", WIDENED, "floating point"),
        ("rp2040", "fixed", WIDENED, "floating point"),
        ("rp2040", "fixed", DIVIDED, "division"),
        ("rv32", "fixed", DIVIDED, "division"),
    ],
)
def test_wider_arithmetic_is_reported_with_its_caller(
    name: str, scalar: str, wrong: str, kind: str, tmp_path: Path
) -> None:
    """The generated C links none; one unsuffixed literal, float or division in it is reported."""
    files = render(with_option(MAMBO, "code.scalar", scalar), with_digest=False)
    source = files["nmpc.c"]
    assert source.count(COST[scalar]) == 1
    changed = files | {
        "nmpc.c": source.replace(COST[scalar], COST[scalar].replace("return", f"return {wrong}"))
    }
    build = board_builder(name)
    assert find_forbidden(load(build.firmware(files, tmp_path / "good")), scalar) == ()
    image = load(build.firmware(changed, tmp_path / "wrong"))
    found = find_forbidden(image, scalar)
    assert {one.kind for one in found} == {kind}
    callers = {caller.partition(".")[0] for one in found for caller in one.callers}
    assert callers & {"cost_evaluate", "advance", "nmpc_step"}, "the function, or one that it is inlined into"
    if scalar == "float32":
        labels = {label for one in found for label in image.symbol(one.symbol).labels}
        assert labels & {"__aeabi_dmul", "__muldf3"}
        assert find_forbidden(image, "float64") == ()


@pytest.mark.first_is_quick
@pytest.mark.parametrize(("preset", "most"), [("mambo", 2100), ("mambo-1norm", 5100), ("table1", 4400)])
def test_fixed_point_keeps_its_promises(preset: str, most: int) -> None:
    """A tenth of the instructions of float32 on the Mambo, where a limit acts a seventh; 480 B of stack."""
    settings = with_option(presets.load(preset), "code.scalar", "fixed")
    board_builder("mambo")
    footprint = measure_footprint(settings, boards.load("mambo"), counted_ticks=150)
    assert footprint.counts is not None
    assert footprint.counts.most_met <= most
    assert footprint.stack is not None
    assert footprint.stack.bytes <= 480
    assert footprint.forbidden == ()


def test_what_must_not_be_linked_is_over_whatever_the_sizes() -> None:
    """The report has the symbol, its kind and its callers."""
    footprint = measure_once("crazyflie")
    assert footprint.fits
    found = Forbidden("__aeabi_dmul", "double precision", ("cost_evaluate",))
    wrong = replace(footprint, forbidden=(found,))
    assert not wrong.fits
    text = text_of([wrong])
    assert "__aeabi_dmul (double precision) must not be linked; called by cost_evaluate" in unwrapped(text)
    assert "OVER" in text


def test_sizes_of_five_digits_are_written_out() -> None:
    """Bytes are not printed in exponential notation."""
    footprint = measure_once("crazyflie")
    added = footprint.added
    large = replace(added, flash=replace(added.flash, own=123_456, helpers=0, grown=0, unnamed=0))
    text = text_of([replace(footprint, added=large)])
    assert "crazyflie: flash 123456 B is over its budget of 16384 B by 107072 B" in text


@pytest.mark.long
def test_doubles_may_be_linked_for_float64() -> None:
    """On a core with single precision only, double arithmetic is the compiler's and counts as flash."""
    settings = with_option(MAMBO, "code.scalar", "float64")
    board_builder("crazyflie")
    footprint = measure_footprint(settings, boards.load("crazyflie"), counted_ticks=6)
    assert footprint.forbidden == ()
    assert footprint.added.flash.helpers > 500
    assert footprint.instance_bytes > measure_once("crazyflie").instance_bytes


def test_float64_is_refused_where_double_has_32_bits() -> None:
    """avr-gcc's double has 32 bits, so a static assertion of the C fails."""
    settings = with_option(MAMBO, "code.scalar", "float64")
    board_builder("mega")
    with pytest.raises(BuildError, match="nmpc_assert_scalar_has_8_bytes"):
        measure_footprint(settings, boards.load("mega"), counted_ticks=6)


@pytest.mark.parametrize("name", boards.names())
def test_a_missing_compiler_is_named(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names board, compilers and Debian packages."""
    monkeypatch.setenv("PATH", str(tmp_path))
    board = boards.load(name)
    with pytest.raises(BuildError) as caught:
        measure_footprint(MAMBO, board)
    for word in (board.title, *board.compiler.candidates, *board.compiler.packages):
        assert word in str(caught.value)


@pytest.mark.sampled(6)
@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "scalar", "optimisation"),
    [
        *product(boards.names(), ("float32",), ("-O0", "-O2", "-O3", "-Os")),
        *product([name for name in boards.names() if name != "mega"], ("float64",), ("-O0", "-Os")),
    ],
)
def test_every_build_can_be_measured(name: str, scalar: str, optimisation: str) -> None:
    """The stack has a bound at every optimisation, and with float64 at the least and the most of it."""
    board_builder(name)
    settings = with_option(MAMBO, "code.scalar", scalar)
    footprint = measure_footprint(settings, boards.load(name), optimisation, counted_ticks=6)
    assert footprint.complete
    assert footprint.added.flash.total == sum(footprint.added.sections.flash.values())
    assert footprint.forbidden == ()
