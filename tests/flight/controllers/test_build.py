"""Building the C of a controller: once, and with messages that say what is missing."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from mambo_codegen.errors import BuildError
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.toolchain import host_toolchain
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.controller_library import build_library
from tests.support.one_norm import ONE_NORM
from tests.support.tools import require

MAMBO = ONE_NORM


@pytest.mark.long
def test_two_processes_may_build_the_same_code_at_once(empty_cache: Path) -> None:
    """Both fly, and one file remains."""
    require("cc", "gcc")
    script = (
        "from mambo_codegen.settings import presets;"
        "from mambo_sil.flight.controllers.compiled import CompiledController as C;"
        "print(C(presets.load('table1')).step([[0]*7], [[1,0,0,0]], [9.81]).command_rad.tolist())"
    )
    command = [sys.executable, "-c", script]
    both = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    printed = [process.communicate()[0] for process in both]
    assert [process.returncode for process in both] == [0, 0]
    assert printed[0] == printed[1] != ""
    assert len(list(empty_cache.glob("*.so"))) == 1


@pytest.mark.usefixtures("empty_cache")
@pytest.mark.parametrize("options", [["-mfma"], ["-march=skylake-avx512"]], ids=" ".join)
def test_no_operation_is_fused(
    options: list[str], monkeypatch: pytest.MonkeyPatch, empty_cache: Path
) -> None:
    """Not even where CC allows it, and gcc 12 does so in spite of -ffp-contract=off."""
    require("gcc", "gcc")
    monkeypatch.setenv("CC", shlex.join(["gcc", *options]))
    settings = with_option(presets.load("mambo"), "code.scalar", "float64", "test")
    build_library(settings, host_toolchain())
    (library,) = empty_cache.glob("*.so")
    command = [require("objdump", "binutils"), "-d", str(library)]
    code = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert re.search(r"\bv?mulsd\b", code)
    assert not re.search(r"\bvf(n?m)(add|sub)", code)


def test_without_a_compiler_the_message_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """No cc, gcc or clang on the path, and no CC."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BuildError, match=r"no C compiler found.*install one"):
        host_toolchain()


@pytest.mark.usefixtures("empty_cache")
@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("no-such-compiler", "cannot run the C compiler no-such-compiler"),
        ("true", "true wrote no output; set CC to a C compiler"),
        ("false", r"(?s)^false .*failed:\nexit code 1, no output"),
        ("gcc '", "CC = gcc ' must be a command: no closing quotation"),
    ],
)
def test_a_command_that_compiles_nothing_is_named(
    line: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """CC may name anything."""
    monkeypatch.setenv("CC", line)
    with pytest.raises(BuildError, match=message):
        CompiledController(MAMBO)


@pytest.mark.usefixtures("empty_cache")
def test_a_relative_compiler_is_found_from_the_build_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A build runs in a folder of its own; CC, here with an argument, is relative to the current folder."""
    (tmp_path / "cc").symlink_to(require("gcc", "gcc"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CC", "./cc -O1")
    assert host_toolchain().command == (str(tmp_path / "cc"), "-O1")
    assert CompiledController(MAMBO).settings == MAMBO
