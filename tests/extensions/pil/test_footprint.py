"""`footprint --port`: cycles and stack that a board measures, beside those counted for it."""

import json
from pathlib import Path

import pytest

from mambo_codegen import boards
from mambo_codegen.settings import presets
from mambo_extensions.pil.on_board import choose_board
from mambo_sil.errors import BoardError
from tests.extensions.pil.support.serial_line import build_firmware, edited, serial_line
from tests.support.command import run, unwrapped
from tests.support.tools import board_builder, without_compilers_of_boards

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

SETTINGS = presets.preset("mambo")
ALL = [boards.load(name) for name in boards.names()]


@pytest.mark.long
def test_the_firmware_names_the_board_and_measures_the_counted_steps(tmp_path: Path) -> None:
    """STM32F405 is the crazyflie: both sides over 300 ticks, in text, JSON, page and report."""
    board_builder("crazyflie")
    slow = edited("board_crazyflie.c", "#define FLIGHT_HZ 168000000UL", "#define FLIGHT_HZ 16000000UL")
    with serial_line(build_firmware(SETTINGS, "crazyflie", tmp_path / "pil", slow)) as line:
        said, _ = run("footprint", "--port", line.port, "-o", "out")
    (board,) = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))["boards"]
    measured, counts = board["on_board"], board["instructions"]
    assert (board["name"], measured["board_says"]) == ("crazyflie", "STM32F405")
    assert measured["ticks"] == counts["ticks"] == 300
    assert measured["different_steps"] == 0
    cycles = measured["cycles"]
    assert 0 < cycles["median"] <= cycles["most"] < 2**24
    assert 0 <= cycles["least"] <= cycles["median"], "QEMU's counter now and then stands still for a step"
    assert cycles["least"] <= measured["mean_cycles"] <= cycles["most"]
    bound = sum(frame["bytes"] for frame in board["stack_path"])
    assert bound / 2 <= measured["stack_bytes"], "no limit acts in these steps, which takes the deepest path"
    assert measured["stack_bytes"] <= bound or measured["link_faults"], "a repeated request interrupts a step"

    assert "300 steps of the counted flight, all bits equal those of this machine" in " ".join(said.split())
    run("report", "out", "-o", "report.html")
    pages = [Path(name).read_text("utf-8") for name in ("out/footprint.html", "report.html")]
    rows = (
        f"{counts['least']} / {counts['mean']:.0f} / {counts['most_met']}",
        f"{cycles['least']:.0f} / {cycles['median']:.0f} / {cycles['most']:.0f}",
        f"{measured['mean_cycles'] / counts['mean']:.3g}",
        "crazyflie: measured at 16 MHz, estimated at 168 MHz",
    )
    for shown in (said, *pages):
        assert all(row in shown for row in rows)


@pytest.mark.long
def test_a_flight_on_a_known_board_has_the_count_beside_the_cycles(tmp_path: Path) -> None:
    """That of `footprint`; of a board that footprint does not know there is none."""
    board_builder("crazyflie")
    run("footprint", "--board", "crazyflie", "-o", "counted")
    (counted,) = json.loads(Path("counted/summary.json").read_text("utf-8"))["boards"]
    for board, known in (("crazyflie", True), ("host", False)):
        with serial_line(build_firmware(SETTINGS, board, tmp_path / board)) as line:
            said, _ = run(
                "fly", "--port", line.port, "--duration-s", "0.1", "--no-pictures", "-o", f"on-{board}"
            )
        emulated = json.loads(Path(f"on-{board}/summary.json").read_text("utf-8"))["emulated"]
        assert ("instructions (least, mean, largest)" in unwrapped(said)) == known
        if known:
            counts = {name: counted["instructions"][name] for name in ("least", "mean", "most_met")}
            assert emulated == {"board": "crazyflie", **counts}
        else:
            assert emulated is None


@pytest.mark.long
def test_a_flight_says_why_there_is_no_count(tmp_path: Path) -> None:
    """Without the compiler of the board it flies all the same."""
    board_builder("crazyflie")
    elf = build_firmware(SETTINGS, "crazyflie", tmp_path / "pil")
    with serial_line(elf) as line, without_compilers_of_boards():
        said, _ = run("fly", "--port", line.port, "--duration-s", "0.1", "--no-pictures")
    assert " emulated not counted: no compiler for " in unwrapped(said)


@pytest.mark.long
def test_a_process_needs_the_name_of_a_board(tmp_path: Path) -> None:
    """Without, exit 2 and no results; with one, its own steps beside the count of that board."""
    board_builder("crazyflie")
    with serial_line(build_firmware(SETTINGS, "host", tmp_path / "pil")) as line:
        _, refused = run("footprint", "--port", line.port, "-o", "out", code=2)
        assert "is that of host process, which names none of crazyflie, mambo, " in refused
        assert not (tmp_path / "out").exists()
        summary = json.loads(run("footprint", "--port", line.port, "--board", "crazyflie", "--json")[0])
    (board,) = summary["boards"]
    assert (board["on_board"]["board_says"], board["on_board"]["clock_hz"]) == ("host process", 10**9)
    assert board["on_board"]["port"] == line.port
    assert board["on_board"]["ticks"] == board["instructions"]["ticks"]


@pytest.mark.long
def test_other_bits_fail(tmp_path: Path) -> None:
    """Exit 1, in capitals in the text; the report calls it a failure."""
    board_builder("crazyflie")
    bend = edited("pil.c", "    ended =", "    command.roll_rad *= 0.999f;\n    ended =")
    with serial_line(build_firmware(SETTINGS, "host", tmp_path / "pil", bend)) as line:
        said, _ = run("footprint", "--port", line.port, "--board", "crazyflie", "-o", "out", code=1)
    assert "STEPS HAVE OTHER BITS THAN ON THIS MACHINE" in unwrapped(said)
    run("report", "out", "-o", "report.html")
    assert "of the period; OTHER BITS on host process" in Path("report.html").read_text("utf-8")


@pytest.mark.parametrize(("says", "name"), [("STM32F405", "crazyflie"), ("Arduino Mega 2560", "mega")])
def test_every_shipped_firmware_is_known(says: str, name: str) -> None:
    """By its own name, alone or confirmed by --board."""
    assert choose_board(ALL, "x", says).name == name
    assert choose_board([boards.load(name)], "x", says).name == name
    assert choose_board([boards.load("rv32"), boards.load(name)], "x", says).name == name


def test_a_board_of_ones_own_is_taken() -> None:
    """Its file may describe the part that the firmware names, or one that no shipped file describes."""
    own = boards.load("crazyflie").model_copy(update={"name": "own"})
    assert choose_board([own], "x", "STM32F405") is own
    assert choose_board([own], "x", "my board") is own


@pytest.mark.parametrize("says", ["", "my board", "Cortex-M"])
def test_a_firmware_that_names_no_board_is_refused(says: str) -> None:
    """Nor is a name taken that several boards have."""
    with pytest.raises(BoardError, match=r"^--port x: .*; say with one --board which to compare it with$"):
        choose_board(ALL, "x", says)


def test_another_board_than_the_firmware_names_is_refused() -> None:
    """With the right one."""
    with pytest.raises(BoardError, match=r"^--board mega is not the board at x, .*: give --board crazyflie"):
        choose_board([boards.load("mega")], "x", "STM32F405")
