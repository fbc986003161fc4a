"""Tools without space for their files: an error of the machine, not a fault of the C that they examine."""

from pathlib import Path

import pytest

from mambo_codegen.errors import UnwritableError
from mambo_codegen.toolchain import Toolchain
from mambo_sil.verify import bits
from mambo_sil.verify.tools import run
from tests.support.command import command
from tests.support.one_norm import ONE_NORM
from tests.support.subjects import subject
from tests.support.tools import require

NO_SPACE = r"cannot write its files: .*No space left on device; free some space in "


@pytest.fixture
def full(tmp_path: Path) -> Path:
    """Make a file that the disk has no space for."""
    (tmp_path / "full").symlink_to("/dev/full")
    return tmp_path / "full"


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_a_full_disk_is_named(compiler: str, full: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The compiler's line; then the folder for temporary files, and that of the build."""
    require(compiler, compiler)
    monkeypatch.setenv("TMPDIR", "/var/tmp")
    arguments = ["-S", "-x", "c", "/dev/null", "-o", str(full)]
    message = (
        f"^{compiler} {NO_SPACE}/var/tmp, or set TMPDIR to another folder; or free some in {full.parent}$"
    )
    with pytest.raises(UnwritableError, match=message):
        Toolchain((compiler,)).run(arguments, full.parent)
    with pytest.raises(UnwritableError, match=message):
        run([compiler, *arguments], full.parent)


def test_a_full_folder_for_temporary_files_is_named_alone(
    full: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If the compiler's line has a file in it."""
    require("gcc", "gcc")
    monkeypatch.setenv("TMPDIR", str(full.parent))
    with pytest.raises(UnwritableError, match=f"{NO_SPACE}{full.parent}, or set TMPDIR to another folder$"):
        Toolchain(("gcc",)).run(["-S", "-x", "c", "/dev/null", "-o", str(full)], Path("/"))


def test_a_check_without_space_has_no_result(full: Path) -> None:
    """It raises; the C is not said to fail, and no tool to be missing."""
    require("gcc", "gcc")
    build = bits.Build("gcc", "gcc", ("-MD", "-MF", str(full)))
    with pytest.raises(UnwritableError, match=NO_SPACE):
        bits.play(subject(ONE_NORM, full.parent), (build,), "bits")


@pytest.mark.parametrize(
    ("name", "reason"), [("gone", "No such file or directory"), ("full", "Not a directory")]
)
def test_an_unusable_folder_for_temporary_files_is_refused(
    name: str, reason: str, full: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """TMPDIR is checked before the first tool runs."""
    monkeypatch.setenv("TMPDIR", str(full.parent / name))
    done = command("verify", "--only", "bits", "-o", full.parent / "out")
    assert (done.returncode, done.stdout) == (2, "")
    assert f"{name}: temporary files cannot be written: {reason}; free some space there, or set TMPDIR" in (
        done.stderr
    )
    assert not (full.parent / "out").exists()
