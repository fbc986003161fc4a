"""Boards: contents of their files, agreement with the compilers, messages for invalid files."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from mambo_codegen import boards
from mambo_codegen.boards import Board
from mambo_codegen.errors import InvalidSettingsError, SourceNotFoundError, UnreadableFileError
from tests.support.tools import require

FOLDER = Path(boards.__file__).parent / "data" / "boards"
NAMES = ("crazyflie", "mambo", "mega", "nano33ble", "rp2040", "rv32", "stm32f103", "stm32h743", "teensy41")
SECTIONS = sorted(Board.model_fields.keys() - {"name", "title"})
OPTIONAL = {"cycles", "flash_wait"}
MACROS: dict[str, dict[str, str | None]] = {
    "crazyflie": {"__ARM_ARCH_7EM__": "1", "__thumb2__": "1", "__ARM_PCS_VFP": "1"},
    "mambo": {"__ARM_ARCH_5TEJ__": "1", "__SOFTFP__": "1", "__pic__": "2", "__pie__": None},
    "mega": {"__AVR_ATmega2560__": "1", "__SIZEOF_INT__": "2", "__SIZEOF_DOUBLE__": "4"},
    "nano33ble": {"__ARM_ARCH_7EM__": "1", "__thumb2__": "1", "__ARM_PCS": "1"},
    "rp2040": {"__ARM_ARCH_6M__": "1", "__SOFTFP__": "1"},
    "rv32": {"__riscv_xlen": "32", "__riscv_mul": "1", "__riscv_compressed": "1", "__riscv_atomic": "1"},
    "stm32f103": {"__ARM_ARCH_7M__": "1", "__SOFTFP__": "1"},
    "stm32h743": {"__ARM_ARCH_7EM__": "1", "__thumb2__": "1", "__ARM_PCS_VFP": "1"},
    "teensy41": {"__ARM_ARCH_7EM__": "1", "__thumb2__": "1", "__ARM_PCS_VFP": "1"},
}
"""Macros that each board's compiler must define with the board's flags (None: must not define)."""


def file_of(name: str) -> str:
    """Return the text of a board's file."""
    return (FOLDER / f"{name}.toml").read_text(encoding="utf-8")


def change(old: str, new: str) -> str:
    """Return the Crazyflie's file with `old`, which occurs once, replaced."""
    text = file_of("crazyflie")
    assert text.count(old) == 1, old
    return text.replace(old, new)


def write_board(folder: Path, text: str) -> str:
    """Write the file of a user's board; returns its path."""
    path = folder / "own.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def compile_empty(board: Board, folder: Path, *arguments: str) -> str:
    """Compile an empty file with the board's compiler, its flags and -Werror; returns stdout."""
    here = [command for command in board.compiler.candidates if shutil.which(command)]
    command = here[0] if here else require(board.compiler.candidates[-1], board.compiler.packages[0])
    (folder / "empty.c").write_text("", encoding="utf-8")
    done = subprocess.run(
        [command, *board.compiler.flags, "-Wall", "-Werror", *arguments, "empty.c"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def fpu_of(macros: dict[str, str]) -> str:
    """Return the widest format that the FPU computes, from __ARM_FP (ACLE) or __riscv_flen."""
    if "__riscv_flen" in macros:
        return {"32": "single", "64": "double"}[macros["__riscv_flen"]]
    formats = int(macros.get("__ARM_FP", "0"), 0)
    return "double" if formats & 0x8 else "single" if formats & 0x4 else "none"


def test_the_boards_are_those_with_a_file() -> None:
    """Every file is a board, named by the file's stem."""
    assert boards.names() == NAMES
    assert [boards.load(name).name for name in NAMES] == list(NAMES)


@pytest.mark.parametrize("key", ["source", "confidence"])
@pytest.mark.parametrize("section", SECTIONS)
def test_every_section_states_source_and_confidence(section: str, key: str, tmp_path: Path) -> None:
    """A file without one of them is refused, with the name of the missing key."""
    before, header, after = file_of("mambo" if section == "cycles" else "crazyflie").partition(
        f"[{section}]\n"
    )
    lines = after.splitlines(keepends=True)
    lines.remove(next(line for line in lines if line.startswith(f"{key} =")))
    with pytest.raises(InvalidSettingsError) as caught:
        boards.load(write_board(tmp_path, before + header + "".join(lines)))
    assert len(caught.value.faults) == 1
    assert f"own.toml: {section}.{key} is missing; add it: " in caught.value.faults[0]


@pytest.mark.parametrize("name", NAMES)
def test_the_compiler_accepts_the_flags(name: str, tmp_path: Path) -> None:
    """An empty file compiles without a warning."""
    compile_empty(boards.load(name), tmp_path, "-c", "-o", "empty.o")
    assert (tmp_path / "empty.o").stat().st_size > 0


@pytest.mark.parametrize("name", NAMES)
def test_the_compiler_confirms_core_and_fpu(name: str, tmp_path: Path) -> None:
    """With the board's flags it defines the macros of architecture, type sizes and the file's FPU."""
    board = boards.load(name)
    defined = (line.split(maxsplit=2) for line in compile_empty(board, tmp_path, "-dM", "-E").splitlines())
    macros = {words[1]: words[2] if len(words) > 2 else "" for words in defined}
    assert {macro: macros.get(macro) for macro in MACROS[name]} == MACROS[name]
    assert fpu_of(macros) == board.fpu.value


def test_unknown_board_lists_those_there_are() -> None:
    """The message for an unknown board lists the named boards and mentions files."""
    with pytest.raises(SourceNotFoundError) as caught:
        boards.load("teensy")
    message = str(caught.value)
    assert f"boards are {', '.join(NAMES)}, and a TOML file of the same shape describes another" in message
    assert "did you mean teensy41?" in message


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("168_000_000", "-1", "clock_hz.value = -1 must be greater than or equal to 1"),
        ("168_000_000", '"fast"', 'clock_hz.value = "fast" must be a valid integer'),
        ("168_000_000", "true", "clock_hz.value = true must be a valid integer"),
        (
            "168_000_000",
            f"0x{'f' * 6000}",
            "clock_hz.value = a value too long to repeat must be less than or",
        ),
        ('value = "single"', 'value = "half"', "fpu.value = \"half\" must be 'none', 'single' or 'double'"),
        ("share = 0.1\n", "share = 1.5\n", "budget.period_share = 1.5 must be less than or equal to 1"),
        ("share = 0.1\n", "share = nan\n", "budget.period_share = NaN must be a finite number"),
        ("16_384", "1_048_577", "budget.flash_bytes = 1048577 must lie in 1..1048576 (flash_bytes.value)"),
        (
            "stack_bytes = 1_024",
            "stack_bytes = 195_585",
            "ram_bytes + stack_bytes = 196609 must lie in 2..196608",
        ),
        ("stack_bytes = 1_024\n", "", "budget.stack_bytes is missing; add it: stack of one step, in bytes"),
        ("[clock_hz]", "[clok_hz]", "clok_hz is not a key of a board; did you mean clock_hz?"),
        (
            "[flash_wait]",
            "[flash_wait]\nodd = 1",
            "flash_wait.odd is not a key of a board; its keys are source",
        ),
        ("line_bytes = 16", "line_bytes = 1", "flash_wait.line_bytes = 1 must be greater than or equal to 2"),
        ('"cortex-m4"', '"cortex-m7"', "cycles is missing; add it: cortex-m7 has no model of its cycles"),
        ('["arm-none-eabi-gcc"]', "[]", "compiler.candidates = [] must have at least 1 item"),
        ('"-mthumb"', "7", "compiler.flags.1 = 7 must be a valid string"),
        ('title = "', 'title = "two\\nlines', "must be printable, without line ends and control characters"),
        ('= "single"', f"{'.a' * 2_000} = 1", "fpu.value = a value too long to repeat must be 'none'"),
        ("title =", "bits = 32\ntitle =", "bits is not a key of a board; its keys are title, core, fpu"),
        ("title =", "core = 5\ntitle =", "Cannot overwrite a value; write each section and key once: [core]"),
        ("title =", 'name = "own"\ntitle =', "name is not a key of a board; remove it, the file name"),
        ("title =", "title", "line 3"),
    ],
)
def test_bad_file_is_told_key_value_and_rule(old: str, new: str, fault: str, tmp_path: Path) -> None:
    """Every message names the file and what to write instead."""
    path = write_board(tmp_path, change(old, new))
    with pytest.raises((InvalidSettingsError, UnreadableFileError)) as caught:
        boards.load(path)
    lines = str(caught.value).splitlines()
    assert all("own.toml: " in line for line in lines)
    assert any(fault in line for line in lines), lines


@pytest.mark.parametrize(
    "command", ["sh", "./gcc", "/tmp/gcc", "rm", "gcc ", "touch", "gcc;id", "gcc\n", "a\0-gcc", "", "-gcc"]
)
def test_a_board_runs_compilers_of_the_path_alone(command: str, tmp_path: Path) -> None:
    """A candidate must be the name of a GCC or clang on the PATH, since the file may be untrusted."""
    text = change('candidates = ["arm-none-eabi-gcc"]', f"candidates = [{json.dumps(command)}]")
    with pytest.raises(
        InvalidSettingsError, match=r"^[^\n]*candidates\.0 = .* must be the name of a GCC or Clang[^\n]*$"
    ):
        boards.load(write_board(tmp_path, text))


@pytest.mark.parametrize(
    "flag",
    [
        *("-fplugin=x.so", "-fpass-plugin=x.so", "-wrapper", "-fuse-ld=/tmp/ld", "-B.", "-specs=x", "@flags"),
        *("-o/tmp/x", "-o", "/tmp/x", "-I/", "-L/", "-Wl,-T,x", "-Xlinker", "-save-temps", "-include", "x.c"),
        *(
            "-fdump-tree-all=/tmp/x",
            "-fprofile-dir=/",
            "-mcpu=x/../y",
            "-m a",
            "-mx\n",
            "-m\0x",
            "-D$(id)",
            "",
        ),
    ],
)
def test_a_board_s_flags_name_no_file_and_no_program(flag: str, tmp_path: Path) -> None:
    """Flags that name a plug-in, wrapper, linker, spec file, include or output are refused."""
    for text in (
        change('"-mthumb"', json.dumps(flag)),
        change('flags = ["-mcpu', f'link_flags = [{json.dumps(flag)}]\nflags = ["-mcpu'),
    ):
        with pytest.raises(InvalidSettingsError, match=r"flags\.\d = .* must be a flag for core, FPU"):
            boards.load(write_board(tmp_path, text))
    library = change('flags = ["-mcpu', f'libraries = [{json.dumps(flag)}]\nflags = ["-mcpu')
    with pytest.raises(InvalidSettingsError, match=r"libraries\.0 = .* must be a library"):
        boards.load(write_board(tmp_path, library))


@pytest.mark.parametrize(
    ("command", "flags"),
    [
        ("clang", ["--target=arm-none-eabi", "-mcpu=cortex-m4"]),
        ("arm-none-eabi-gcc-12.2", ["-ffreestanding"]),
        ("gcc-12", ["-march=rv32imac_zicsr", "-mtune=sifive-7-series", "-std=gnu++17", "-fshort-enums"]),
        ("xtensa-esp32-elf-cc", ["-mlongcalls", "-mno-unaligned-access", "-mcpu=x+nofp"]),
    ],
)
def test_a_board_s_compiler_may_be_any_of_the_usual(command: str, flags: list[str], tmp_path: Path) -> None:
    """Usual names of cross compilers and their machine options are accepted; the file names its board."""
    text = change('candidates = ["arm-none-eabi-gcc"]', f'candidates = ["{command}"]')
    text = text.replace('"-mthumb"', ", ".join(json.dumps(flag) for flag in flags))
    board = boards.load(write_board(tmp_path, text))
    assert set(flags) <= set(board.compiler.flags)
    assert board.name == "own"


def test_section_without_keys_is_told_to_be_a_section(tmp_path: Path) -> None:
    """The message for a number instead of a section shows the section's header."""
    document = "clock_hz = 5\n" + file_of("crazyflie").replace("[clock_hz]", "[core.clock]")
    with pytest.raises(InvalidSettingsError, match=r"clock_hz = 5 must be a section; write \[clock_hz\]"):
        boards.load(write_board(tmp_path, document))


def test_all_faults_of_a_file_come_at_once(tmp_path: Path) -> None:
    """One error has all missing keys of a file."""
    with pytest.raises(InvalidSettingsError) as caught:
        boards.load(write_board(tmp_path, 'title = ""\n'))
    assert len(caught.value.faults) == 1 + len(set(SECTIONS) - OPTIONAL)
