"""The doctor reports tools with purpose and package; a compiler of another core is told the rule."""

import shutil
from ctypes.util import find_library
from importlib import metadata
from pathlib import Path

import pytest

from mambo_codegen import boards
from mambo_codegen.errors import BuildError
from mambo_codegen.toolchain import Toolchain
from mambo_sil.board.firmware import tool_report
from mambo_sil.board.firmware.firmware_build import Builder
from mambo_sil.board.firmware.tool_report import LIBFUZZER, LIBSIMAVR, Finding, doctor_text, examine

ENDLESS = "while :; do :; done"


@pytest.fixture
def bare(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a PATH with only the returned folder."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    return tmp_path


def put(folder: Path, tool: str, content: str) -> None:
    """Write an executable file into `folder`."""
    path = folder / tool
    path.write_text(content, encoding="utf-8")
    path.chmod(0o755)


def finding_of(tool: str) -> Finding:
    """Return the doctor's finding on a tool."""
    return next(finding for finding in examine() if tool in finding.tool.split(" or "))


def test_every_board_has_a_compiler_and_an_emulator() -> None:
    """Each board is named by one compiler and one emulator."""
    for kind in ("compiler", "emulator"):
        promises = " ".join(finding.enables for finding in examine() if finding.kind == kind)
        words = promises.replace(",", " ").split()
        assert [words.count(name) for name in boards.names()] == [1] * len(boards.names())


def test_installed_tools_are_found_with_their_version() -> None:
    """The findings agree with this machine."""
    for finding in examine():
        if finding.registry == "PyPI":
            installed = {distribution.name for distribution in metadata.distributions()}
            assert finding.here == (finding.tool in installed)
        elif finding.tool == LIBFUZZER:
            assert not finding.here or shutil.which("clang") is not None
        elif finding.tool == LIBSIMAVR:
            assert not finding.here or find_library("simavr") is not None
        else:
            commands = finding.tool.split(" or ")
            assert finding.here == any(shutil.which(command) is not None for command in commands)
        assert not finding.version or finding.version[0].isdigit()


def test_missing_tools_are_listed_with_purpose_and_package(bare: Path) -> None:
    """Every missing tool has a line with its purpose, and its package is in the install command."""
    assert not list(bare.iterdir())
    findings = examine()
    text = doctor_text(findings)
    commands = [finding for finding in findings if finding.registry == "Debian"]
    assert not any(finding.here or finding.version for finding in commands)
    assert "cc or gcc or clang" in text
    here = sum(finding.here for finding in findings)
    assert text.startswith(f"{here} of {len(findings)} tools are here; missing: ")
    for finding in commands:
        row = doctor_text([finding]).split("what for")[1].partition("install what")[0]
        assert sorted(row.split()) == sorted(
            f"{finding.kind} {finding.tool} missing {finding.enables}".split()
        )
        install = next(line for line in text.splitlines() if "apt install" in line)
        assert set(finding.packages) <= set(install.split())


def test_a_complete_machine_gets_no_install_command() -> None:
    """The text has the answer and the row of the tool."""
    here = Finding("compiler", "cc", True, "12.2.0", "flies", "Debian", ("gcc",))
    assert doctor_text([here]).splitlines() == [
        "1 of 1 tools are here",
        "",
        "kind      tool  version  what for",
        "compiler  cc    12.2.0   flies",
    ]


@pytest.mark.parametrize(
    ("said", "version"),
    [
        ("gcc (Debian 12.2.0-14+deb12u1) 12.3.0", "12.3.0"),
        ("arm-none-eabi-gcc (15:12.2.rel1-1) 12.2.1 20221205", "12.2.1"),
        ("Debian clang version 14.0.6", "14.0.6"),
        ("QEMU emulator version 7.2.22 (Debian 1:7.2+dfsg-7+deb12u18+b3)", "7.2.22"),
        ("GNU nm (GNU Binutils for Debian) 2.40", "2.40"),
        ("no number at all", ""),
        ("", ""),
    ],
)
def test_a_version_is_read_from_the_first_line(said: str, version: str, bare: Path) -> None:
    """Text of distributions in brackets is not the version."""
    put(bare, "cmake", f"#!/bin/sh\necho '{said}'\necho 99.9\n")
    found = finding_of("cmake")
    assert (found.here, found.version) == (True, version)


@pytest.mark.parametrize("content", [f"#!/bin/sh\n{ENDLESS}\n", "\x7fELF nonsense", "#!/none/such\n"])
def test_a_broken_tool_is_here_without_version(
    content: str, bare: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tool that hangs or cannot run is reported as here, without a version."""
    monkeypatch.setattr(tool_report, "TIME_LIMIT_S", 0.2)
    put(bare, "cmake", content)
    found = finding_of("cmake")
    assert (found.here, found.version) == (True, "")
    line = next(line for line in doctor_text(examine()).splitlines() if " cmake " in line)
    assert "  here " in line


def test_the_first_candidate_that_is_here_counts(bare: Path) -> None:
    """One installed candidate suffices; the first one installed is reported."""
    put(bare, "arm-linux-gnueabi-gcc", "#!/bin/sh\necho 12.2.0\n")
    assert finding_of("arm-linux-gnueabi-gcc").tool == "arm-linux-gnueabi-gcc"
    put(bare, "arm-none-linux-gnueabi-gcc", "#!/bin/sh\necho 4.6.3\n")
    assert finding_of("arm-none-linux-gnueabi-gcc").version == "4.6.3"


def test_a_clang_without_its_library_cannot_fuzz(bare: Path) -> None:
    """LibFuzzer has a package of its own; it is here only if clang finds its file."""
    put(bare, "clang", "#!/bin/sh\necho 14.0.6\n")
    assert (finding_of("clang").here, finding_of(LIBFUZZER).here) == (True, False)
    (bare / "fuzzer.a").touch()
    answer = f'case "$1" in -print*) echo {bare}/fuzzer.a;; *) echo 14.0.6;; esac'
    put(bare, "clang", f"#!/bin/sh\n{answer}\n")
    assert (finding_of(LIBFUZZER).here, finding_of(LIBFUZZER).version) == (True, "14.0.6")


def test_the_compiler_that_cc_names_is_examined(bare: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command in CC is examined with its options; an invalid one is reported as missing."""
    put(bare, "mycc", '#!/bin/sh\necho "mycc $1 1.2.3"\n')
    monkeypatch.setenv("CC", "mycc -m64")
    assert finding_of("mycc -m64").version == "1.2.3"
    monkeypatch.setenv("CC", "\x1b[31m-gcc")
    assert not examine()[0].here
    assert doctor_text(examine()).replace("\n", "").isprintable()
    monkeypatch.setenv("CC", 'open "quote')
    assert not examine()[0].here


def test_a_compiler_for_another_core_is_told_the_rule(tmp_path: Path) -> None:
    """Board, compiler, flags, and the package with the right one, before the compiler's words."""
    program = tmp_path / "old-gcc"
    program.write_text("#!/bin/sh\necho \"old-gcc: error: unrecognized option '-mthumb'\" >&2\nexit 1\n")
    program.chmod(0o755)
    wrong = Toolchain((str(program),))
    board = boards.load("crazyflie")
    with pytest.raises(BuildError) as caught:
        Builder(board, wrong, wrong).firmware({"src/a.c": "int a;\n"}, tmp_path)
    rule, _, words = str(caught.value).partition("\n")
    assert rule.startswith(f"{board.title}: {program} does not build for it; it must be a C99 compiler for ")
    assert " ".join(board.compiler.flags) in rule
    assert "gcc-arm-none-eabi" in rule
    assert words.endswith("unrecognized option '-mthumb'")
