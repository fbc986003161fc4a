"""Result folders: all results or none, one run at a time, foreign files stay; and temporary folders."""

import errno
import json
import os
import tempfile
from pathlib import Path
from typing import Any

import pytest

from mambo_codegen.errors import ForeignFilesError, MamboNmpcError, UnwritableError
from mambo_sil.errors import BusyError, ScratchError
from mambo_sil.results.build_folders import scratch_folder
from mambo_sil.results.folders import SUMMARY, new_results
from mambo_sil.results.summary import Summary


class Found(Summary):
    """What a run of a test found."""

    command = "fly"
    content: Any


def summary_text(command: str, content: Any) -> str:
    """Return the summary of a run of `command`."""
    return Found(content=content).text().replace('"fly"', f'"{command}"')


def run(folder: Path, content: str = "new", command: str = "fly") -> None:
    """Write the results of one run to `folder`."""
    with new_results(folder, command, ("trace.csv",)) as fresh:
        (fresh / "trace.csv").write_text(content)
        (fresh / SUMMARY).write_text(summary_text(command, content))


def files(folder: Path) -> dict[str, str]:
    """Return name and text of every file below `folder`."""
    return {str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*") if p.is_file()}


def test_results_replace_those_of_an_earlier_run(tmp_path: Path) -> None:
    """Files of other names stay."""
    run(tmp_path / "a" / "b", "old")
    (tmp_path / "a" / "b" / "notes.txt").write_text("mine")
    run(tmp_path / "a" / "b")
    summary = summary_text("fly", "new")
    assert files(tmp_path / "a" / "b") == {"trace.csv": "new", SUMMARY: summary, "notes.txt": "mine"}


def test_earlier_results_stay_until_the_run_is_complete(tmp_path: Path) -> None:
    """During a run, and after one that failed, the folder has the earlier results."""
    run(tmp_path, "old")
    before = files(tmp_path)

    def fail() -> None:
        with new_results(tmp_path, "fly", ("trace.csv",)) as fresh:
            (fresh / "trace.csv").write_text("new")
            assert files(tmp_path)["trace.csv"] == "old"
            raise OSError(28, "No space left")

    with pytest.raises(UnwritableError, match="cannot be written: No space left"):
        fail()
    assert files(tmp_path) == before


def test_a_run_stopped_while_its_files_move_does_not_block_the_next(tmp_path: Path) -> None:
    """It leaves a mixture of results without a summary, which the next run recognizes and replaces."""
    run(tmp_path, "old")

    def stop() -> None:
        with new_results(tmp_path, "fly", ("trace.csv", "in-the-way.csv")) as fresh:
            for name in ("trace.csv", "in-the-way.csv"):
                (fresh / name).write_text("new")
            (fresh / SUMMARY).write_text(summary_text("fly", {}))
            (tmp_path / "in-the-way.csv").mkdir()

    with pytest.raises(UnwritableError, match="cannot be written: Is a directory"):
        stop()
    (tmp_path / "in-the-way.csv").rmdir()
    assert not (tmp_path / SUMMARY).exists()
    run(tmp_path)
    assert files(tmp_path) == {"trace.csv": "new", SUMMARY: summary_text("fly", "new")}


def test_a_result_that_this_run_does_not_have_goes(tmp_path: Path) -> None:
    """Of the files that the command may write, those of an earlier run do not stay beside the new ones."""
    run(tmp_path, "old")
    (tmp_path / "flight.png").write_text("old")
    with new_results(tmp_path, "fly", ("trace.csv", "flight.png")) as fresh:
        (fresh / "trace.csv").write_text("new")
        (fresh / SUMMARY).write_text(summary_text("fly", "new"))
    assert files(tmp_path) == {"trace.csv": "new", SUMMARY: summary_text("fly", "new")}


def test_a_failed_run_leaves_no_folder_of_its_own(tmp_path: Path) -> None:
    """A failed run removes the result folder and the parents that it created."""
    with pytest.raises(KeyboardInterrupt), new_results(tmp_path / "a" / "b", "fly", ()):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_one_run_at_a_time(tmp_path: Path) -> None:
    """A second run in the same folder raises `BusyError` before it starts."""
    with pytest.raises(BusyError, match="another run"), new_results(tmp_path, "fly", ()):
        run(tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("moved", [False, True])
def test_the_rest_of_a_killed_run_is_removed(tmp_path: Path, moved: bool) -> None:
    """The run was killed before or while it moved its files into place."""
    hidden = tmp_path / ".mambo-nmpc-new-abc"
    hidden.mkdir()
    if moved:
        (tmp_path / "trace.csv").write_text("killed")
        (hidden / SUMMARY).write_text(summary_text("fly", {}))
    else:
        (hidden / "trace.csv").write_text("killed")
    run(tmp_path)
    assert sorted(files(tmp_path)) == [SUMMARY, "trace.csv"]


@pytest.mark.parametrize(
    "summary", [None, "", "[]", "{}", '{"generator": 1}', '{"generator": "other 1"}', "[" * 10**5]
)
def test_a_folder_with_other_files_is_refused(tmp_path: Path, summary: str | None) -> None:
    """A summary.json that mambo-nmpc did not write does not mark a folder of results."""
    (tmp_path / "thesis.tex").write_text("years of work")
    if summary is not None:
        (tmp_path / SUMMARY).write_text(summary)
    before = files(tmp_path)
    with pytest.raises(ForeignFilesError, match="not results of mambo-nmpc"):
        run(tmp_path)
    assert files(tmp_path) == before


def test_results_of_another_command_are_refused(tmp_path: Path) -> None:
    """A folder holds the results of one command only."""
    run(tmp_path, command="table2")
    with pytest.raises(ForeignFilesError, match="holds results of table2, not of fly"):
        run(tmp_path)


@pytest.mark.parametrize("name", ["trace.csv", SUMMARY])
@pytest.mark.parametrize("kind", ["link", "folder"])
def test_links_and_folders_in_the_way_are_refused(tmp_path: Path, name: str, kind: str) -> None:
    """A link or a folder in the place of a result is not replaced."""
    run(tmp_path / "out")
    precious = tmp_path / "precious"
    (tmp_path / "out" / name).rename(precious)
    before = precious.read_text()
    if kind == "link":
        (tmp_path / "out" / name).symlink_to(precious)
    else:
        (tmp_path / "out" / name).mkdir()
    with pytest.raises(MamboNmpcError, match=r"not a plain file|not results of mambo-nmpc"):
        run(tmp_path / "out")
    assert precious.read_text() == before


def test_a_summary_has_null_for_nan_and_infinity() -> None:
    """Numbers that JSON cannot represent become null at any depth."""
    text = summary_text("fly", {"a": float("nan"), "b": [1.5, (float("inf"), {"c": -float("inf")})]})
    summary = json.loads(text, parse_constant=pytest.fail)
    assert (summary["content"]["a"], summary["content"]["b"]) == (None, [1.5, [None, {"c": None}]])


def test_the_folder_is_removed() -> None:
    """With everything in it."""
    with scratch_folder() as folder:
        (folder / "a.c").write_text("int a;")
    assert not folder.exists()


def test_a_full_disk_names_the_folder_for_temporary_files() -> None:
    """Not the folder for the results."""
    with pytest.raises(ScratchError) as caught, scratch_folder():
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert str(caught.value) == (
        f"{tempfile.gettempdir()}: temporary files cannot be written: No space left on device; "
        "free some space there, or set TMPDIR to another folder"
    )


def test_a_folder_that_was_removed_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """TMPDIR may vanish during a run."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "gone"))
    with (
        pytest.raises(ScratchError, match="gone: temporary files cannot be written"),
        scratch_folder(),
    ):
        pass
