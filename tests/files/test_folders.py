"""Result folders: whole or not at all, one run at a time, and nobody else's files."""

import json
from pathlib import Path

import pytest

from mambo_nmpc.codegen.errors import ForeignFilesError, MamboNmpcError, UnwritableError
from mambo_nmpc.sil.errors import BusyError
from mambo_nmpc.sil.files.folders import SUMMARY, new_results, summary_text


def run(folder: Path, content: str = "new", command: str = "fly") -> None:
    """Leave the results of one run in `folder`."""
    with new_results(folder, command, ("trace.csv",)) as fresh:
        (fresh / "trace.csv").write_text(content)
        (fresh / SUMMARY).write_text(summary_text(command, {"content": content}))


def files(folder: Path) -> dict[str, str]:
    """Return name and text of every file below `folder`."""
    return {str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*") if p.is_file()}


def test_results_replace_those_of_an_earlier_run(tmp_path: Path) -> None:
    """And leave files of other names alone."""
    run(tmp_path / "a" / "b", "old")
    (tmp_path / "a" / "b" / "notes.txt").write_text("mine")
    run(tmp_path / "a" / "b")
    summary = summary_text("fly", {"content": "new"})
    assert files(tmp_path / "a" / "b") == {"trace.csv": "new", SUMMARY: summary, "notes.txt": "mine"}


def test_nothing_moves_before_the_run_is_complete(tmp_path: Path) -> None:
    """Whoever looks meanwhile sees the earlier results; so does one who looks after a failure."""
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
    """By Ctrl-C, or by the disk: a mixture without a summary is left, and is known as ours."""
    run(tmp_path, "old")

    def stop() -> None:
        with new_results(tmp_path, "fly", ("trace.csv", "missing.csv")) as fresh:
            (fresh / "trace.csv").write_text("new")
            (fresh / SUMMARY).write_text(summary_text("fly", {}))

    with pytest.raises(UnwritableError, match="cannot be written: No such file"):
        stop()
    assert not (tmp_path / SUMMARY).exists()
    run(tmp_path)
    assert files(tmp_path) == {"trace.csv": "new", SUMMARY: summary_text("fly", {"content": "new"})}


def test_a_failed_run_leaves_no_folder_of_its_own(tmp_path: Path) -> None:
    """Neither the result folder nor the parents that it needed."""
    with pytest.raises(KeyboardInterrupt), new_results(tmp_path / "a" / "b", "fly", ()):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_one_run_at_a_time(tmp_path: Path) -> None:
    """A second run into the same folder is refused before it starts."""
    with pytest.raises(BusyError, match="another run"), new_results(tmp_path, "fly", ()):
        run(tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("moved", [False, True])
def test_what_a_killed_run_left_is_cleared(tmp_path: Path, moved: bool) -> None:
    """Killed while it flew, or while it moved its files into place."""
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
def test_work_of_others_is_refused(tmp_path: Path, summary: str | None) -> None:
    """A file named summary.json does not make a folder ours."""
    (tmp_path / "thesis.tex").write_text("years of work")
    if summary is not None:
        (tmp_path / SUMMARY).write_text(summary)
    before = files(tmp_path)
    with pytest.raises(ForeignFilesError, match="not our results"):
        run(tmp_path)
    assert files(tmp_path) == before


def test_results_of_another_command_are_refused(tmp_path: Path) -> None:
    """Two kinds of results in one folder could not be told apart."""
    run(tmp_path, command="table2")
    with pytest.raises(ForeignFilesError, match="holds results of table2, not of fly"):
        run(tmp_path)


@pytest.mark.parametrize("name", ["trace.csv", SUMMARY])
@pytest.mark.parametrize("kind", ["link", "folder"])
def test_links_and_folders_in_the_way_are_refused(tmp_path: Path, name: str, kind: str) -> None:
    """Nothing is written through a link, and no folder is taken for a file."""
    run(tmp_path / "out")
    precious = tmp_path / "precious"
    (tmp_path / "out" / name).rename(precious)
    before = precious.read_text()
    if kind == "link":
        (tmp_path / "out" / name).symlink_to(precious)
    else:
        (tmp_path / "out" / name).mkdir()
    with pytest.raises(MamboNmpcError, match=r"not a plain file|not our results"):
        run(tmp_path / "out")
    assert precious.read_text() == before


def test_a_summary_has_no_number_that_json_cannot_spell() -> None:
    """NaN and infinity become null, however deep."""
    text = summary_text("fly", {"a": float("nan"), "b": [1.5, (float("inf"), {"c": -float("inf")})]})
    summary = json.loads(text, parse_constant=pytest.fail)
    assert (summary["a"], summary["b"]) == (None, [1.5, [None, {"c": None}]])
