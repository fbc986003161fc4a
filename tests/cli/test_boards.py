"""The commands about boards, used as a person would: what they print, write, and say when it goes wrong."""

import json
import shutil
from pathlib import Path

import pytest

from mambo_codegen import boards
from mambo_codegen.settings import presets
from mambo_sil.board.footprint.footprint_plots import draw_footprints
from mambo_sil.board.footprint.measure import measure_footprint
from tests.support.command import command, run, unwrapped, without
from tests.support.tools import board_builder, only, require

HOSTILE = '<img src=x onerror="alert(1)">&.toml'


@pytest.fixture
def _crazyflie() -> None:
    """Skip without a compiler for the Crazyflie."""
    compiler = boards.load("crazyflie").compiler
    if not any(shutil.which(candidate) for candidate in compiler.candidates):
        require(compiler.candidates[0], compiler.packages[0])


@pytest.mark.long
@pytest.mark.usefixtures("_crazyflie")
def test_a_footprint_leaves_page_and_pictures_and_prints_json(tmp_path: Path) -> None:
    """PNG, SVG, HTML and the summary, which stdout repeats; a hostile name is text on the page."""
    (tmp_path / HOSTILE).write_text("[horizon]\ncontrol = 2\n")
    said, _ = run("footprint", HOSTILE, "--board", "crazyflie", "--json", "-o", "out")
    out = tmp_path / "out"
    names = {"footprint.png", "footprint.svg", "footprint.html", "summary.json"}
    assert {path.name for path in out.iterdir()} == names
    assert (out / "footprint.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (out / "footprint.svg").read_text("utf-8")

    assert said == (out / "summary.json").read_text("utf-8")
    summary = json.loads(said, parse_constant=pytest.fail)
    (board,) = summary["boards"]
    assert (summary["source"], summary["scalar"], board["name"]) == (HOSTILE, "float32", "crazyflie")
    values = {limit["name"]: limit["value"] for limit in board["limits"]}
    assert values.keys() == {"flash", "RAM", "stack", "time"}
    assert values["flash"] == sum(board["flash_sections"].values()) == sum(board["flash_bytes"].values())
    assert values["stack"] == sum(frame["bytes"] for frame in board["stack_path"])
    counts = board["instructions"]
    assert 0 < counts["least"] <= counts["mean"] <= counts["most_met"] < board["cycles"]["most_met"]

    page = (out / "footprint.html").read_text("utf-8")
    assert "<img" not in page
    assert "&lt;img src=x onerror=" in page
    assert "src=" not in page.replace("img src=x", "")
    assert "href=" not in page
    for word in ("Bitcraze Crazyflie 2.1", "nmpc_step", str(values["flash"]), summary["digest"]):
        assert word in page


@pytest.mark.long
@pytest.mark.usefixtures("_crazyflie")
def test_over_budget_is_exit_1_with_names_and_excess(tmp_path: Path) -> None:
    """A board of one's own with little flash: the answer says OVER, a line below by how much."""
    text = (Path(boards.__file__).parent / "data" / "boards" / "crazyflie.toml").read_text("utf-8")
    (tmp_path / "own.toml").write_text(text.replace("flash_bytes = 16_384", "flash_bytes = 2_000"))
    said, talk = run("footprint", "--board", "own.toml", code=1)
    assert talk == ""
    lines = said.splitlines()
    assert lines[0].startswith("own: OVER, ")
    flash = next(int(line.split()[1]) for line in lines if line.startswith("own  "))
    assert f"own: flash {flash} B is over its budget of 2000 B by {flash - 2000} B" in lines
    assert not any("RAM" in line or "stack" in line for line in lines[2:] if "budget" in line)


@pytest.mark.long
@pytest.mark.usefixtures("_crazyflie")
def test_the_name_of_a_board_is_no_formula(tmp_path: Path) -> None:
    """Nor is it markup: a board's file may have any name."""
    odd = boards.load("crazyflie").model_copy(update={"name": r"$\frac{$ <b>"})
    measured = measure_footprint(presets.load("table1"), odd, counted_ticks=6)
    draw_footprints([measured], tmp_path / "footprint")
    assert r"$\frac{$ &lt;b&gt;  flash" in (tmp_path / "footprint.svg").read_text("utf-8")


@pytest.mark.long
def test_what_has_a_compiler_is_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The others are named on stderr; the table and the exit code are about what was measured."""
    require("avr-gcc", "gcc-avr")
    (tmp_path / "bin").mkdir()
    monkeypatch.setenv("PATH", only(tmp_path / "bin", "avr-*"))
    said, talk = run("footprint", "mambo-1norm")
    assert [line.split()[0] for line in said.splitlines()[:5] if line] == ["mega:", "flash", "board", "mega"]
    for package in ("gcc-arm-none-eabi", "gcc-arm-linux-gnueabi", "gcc-riscv64-unknown-elf"):
        assert package in talk


@pytest.mark.usefixtures("_crazyflie")
def test_flying_on_a_board_is_the_flight_of_this_machine(tmp_path: Path) -> None:
    """Every tick of both has the same bits, which the command says."""
    said, _ = run("fly", "--on", "crazyflie", "--duration-s", "1", "--no-pictures")
    assert "crazyflie" in said
    summary = json.loads((tmp_path / "flight" / "summary.json").read_text("utf-8"))
    assert (summary["board"], summary["same_bits_as_host"]) == ("crazyflie", True)
    plain = json.loads(run("fly", "--duration-s", "1", "--json", "--no-pictures", "-o", "plain")[0])
    assert plain["same_bits_as_host"] is None
    assert plain["metrics"] == summary["metrics"]
    assert (tmp_path / "plain" / "trace.csv").read_bytes() == (tmp_path / "flight" / "trace.csv").read_bytes()


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    "command", [["fly", "--on", "mega"], ["check-bits", "--board", "mega", "--steps", "100"]]
)
def test_a_missing_emulator_is_named(
    command: list[str], tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was looked for, and what brings it: an error of a flight, a reason for one build among many."""
    board_builder("mega")
    monkeypatch.setenv("PATH", only(tmp_path_factory.mktemp("bin"), "avr-*"))
    said, talk = run(*command, code=2 if command[0] == "fly" else 0)
    assert "simavr, needed to emulate an ATmega2560, cannot be built here" in unwrapped(said + talk)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["fly", "--on", "crazyfly"], "did you mean crazyflie?"),
        (["fly", "--on", "crazyflie", "--controller", "pd"], "use it with --controller nmpc only"),
        (["footprint", "--board", "teensy"], "did you mean teensy41?"),
        (["footprint", "mamba"], "did you mean mambo"),
        (["footprint", "--board", "odd.toml"], "odd.toml: title is missing; add it: the name of the board"),
        (["check-bits", "--board", "mambo", "--board", "none"], "none is neither a board nor a file"),
    ],
)
def test_bad_input_gets_a_message_and_exit_2(arguments: list[str], message: str, tmp_path: Path) -> None:
    """Nothing is written."""
    (tmp_path / "odd.toml").write_text("")
    assert message in run(*arguments, code=2)[1]
    assert [path.name for path in tmp_path.iterdir()] == ["odd.toml"]


@pytest.mark.usefixtures("_no_tool")
def test_a_folder_of_other_work_is_refused_before_measuring(tmp_path: Path) -> None:
    """Nobody waits for a measurement that has nowhere to go."""
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "thesis.tex").write_text("years of work")
    said, talk = run("footprint", "-o", "taken", code=2)
    assert said == ""
    assert "taken: holds files that are not results of mambo-nmpc" in talk


@pytest.mark.usefixtures("_no_tool")
def test_two_boards_are_measured_each_once() -> None:
    """In the order in which they are named; without compilers each is missing."""
    line = ["--board", "teensy41", "--board", "mega", "--board", "teensy41"]
    missing = run("footprint", *line, code=2)[1].splitlines()
    assert [text.partition(" found")[0] for text in missing] == [
        "no compiler for PJRC Teensy 4.1",
        "no compiler for Arduino Mega 2560",
    ]


@pytest.mark.usefixtures("_no_tool")
def test_same_bits_compares_and_says_what_did_not_run() -> None:
    """The reference alone, where there is no compiler: a digest, and a reason for everything else."""
    options = ["--board", "mega", "--board", "crazyflie", "--steps", "100"]
    result = json.loads(run("check-bits", *options, "--json")[0])
    assert (result["steps"], len(result["builds"])) == (100, 1 + 4 * 6)
    reference, *others = result["builds"]
    assert (reference["where"], len(reference["digest"])) == ("reference", 10)
    assert all(one["digest"] is None and one["reason"] for one in others)
    text, _ = run("check-bits", *options)
    assert reference["digest"] in text
    assert "no compiler for Arduino Mega 2560 found" in text
    assert unwrapped(text).startswith(
        "mambo: the bits of the reference in 0 of 0 builds, over 100 self-test steps; 24 builds not run"
    )


@pytest.mark.usefixtures("_no_tool")
def test_the_doctor_answers() -> None:
    """Text for people, JSON for machines, and exit 0 though everything is missing."""
    assert "apt install" in run("doctor")[0]
    findings = json.loads(run("doctor", "--json")[0])
    tools = {tool for finding in findings for tool in finding["tool"].split(" or ")}
    assert {"arm-none-eabi-gcc", "libsimavr", "unicorn"} <= tools


NAMES_THE_EXTRA = (
    "unicorn, the optional package that emulates cortex-m4, is missing: pip install unicorn "
    '(the extra "emulation")'
)


@pytest.mark.usefixtures("_crazyflie")
def test_without_the_emulator_a_footprint_has_flash_ram_and_stack() -> None:
    """It needs no package of another licence; the note says what instructions and cycles want."""
    done = command("footprint", "--board", "crazyflie", "--json", "-o", "out", script=without("unicorn"))
    assert done.returncode == 0, done.stderr
    (board,) = json.loads(done.stdout)["boards"]
    assert [limit["name"] for limit in board["limits"]] == ["flash", "RAM", "stack"]
    assert board["notes"] == [f"crazyflie: instructions, cycles and time are not measured: {NAMES_THE_EXTRA}"]


@pytest.mark.long
@pytest.mark.usefixtures("_crazyflie")
@pytest.mark.parametrize(
    "words", ["fly --on crazyflie --duration-s 1", "sweep --vary cost.response_time_s=0.1:0.2:2"]
)
def test_without_the_emulator_what_needs_it_names_the_extra(words: str) -> None:
    """In one sentence."""
    done = command(*words.split(), script=without("unicorn"))
    assert done.returncode == 2
    assert done.stderr == f"{NAMES_THE_EXTRA}\n"


def test_the_doctor_names_the_extra() -> None:
    """In the row of its package."""
    said = run("doctor")[0]
    (row,) = (line for line in said.splitlines() if line.startswith("emulator  unicorn"))
    assert "the extra emulation" in row
