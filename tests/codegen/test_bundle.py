"""Bundles on disk: whole, idempotent, and never at the cost of somebody else's file."""

import json
import os
from hashlib import sha256
from pathlib import Path

import pytest

from mambo_codegen.bundle import bundle
from mambo_codegen.bundle.bundle import Changes, Drift
from mambo_codegen.errors import ForeignFilesError, UnwritableError
from tests.support.bundles import FILES, NEXT, content, expected


def only(folder: Path) -> bool:
    """Whether nothing is left beside `folder`."""
    return [place.name for place in folder.parent.iterdir()] == [folder.name]


def test_bundle_is_written_as_it_is(tmp_path: Path) -> None:
    """Every file arrives byte for byte, parents are made, and nothing stays beside the folder."""
    folder = tmp_path / "made" / "too" / "controller"
    changes = bundle.write(FILES, folder)
    assert content(folder) == expected(FILES)
    assert changes == Changes(created=tuple(sorted(expected(FILES))))
    assert only(folder)


def test_manifest_is_a_pure_function_of_the_bundle() -> None:
    """The manifest names generator and SHA-256, sorted, whatever order the files came in."""
    listed = json.loads(bundle.manifest(FILES))
    assert listed["files"] == {path: sha256(FILES[path].encode()).hexdigest() for path in FILES}
    assert list(listed["files"]) == sorted(FILES)
    assert listed["generator"].startswith("mambo-nmpc ")
    assert set(listed) == {"generator", "files"}
    assert bundle.manifest(dict(reversed(FILES.items()))) == bundle.manifest(FILES)


def test_second_run_touches_nothing(folder: Path) -> None:
    """Writing the same bundle again leaves the very same files, times included."""

    def written() -> dict[Path, tuple[int, ...]]:  # to read a file may change its time of access
        found = {place: place.stat() for place in [folder, *folder.rglob("*")]}
        return {place: (now.st_ino, now.st_mode, now.st_ctime_ns) for place, now in found.items()}

    before = written()
    changes = bundle.write(FILES, folder)
    assert changes == Changes(unchanged=tuple(sorted(expected(FILES))))
    assert written() == before


def test_next_bundle_replaces_the_last_and_keeps_what_is_not_ours(folder: Path) -> None:
    """Changed files change, dropped ones go; unchanged and foreign files stay the same files."""
    (folder / "build").mkdir()
    (folder / "build" / "nmpc.o").write_bytes(b"\0object")
    (folder / "empty").mkdir()
    (folder / "src" / "mine.c").symlink_to("nowhere")
    os.utime(folder / "build", (1, 2))
    stay = ["build/nmpc.o", "src/nmpc.c", "README.md"]
    before = [(folder / path).stat() for path in stay]
    changes = bundle.write(NEXT, folder)
    assert changes == Changes(
        created=("src/b.c",),
        changed=("include/nmpc.h", "manifest.json"),
        removed=("src/a.c",),
        unchanged=("README.md", "src/nmpc.c"),
        kept=("build/nmpc.o", "src/mine.c"),
    )
    assert content(folder) == {**expected(NEXT), "build/nmpc.o": b"\0object"}
    after = [(folder / path).stat() for path in stay]
    assert [(s.st_ino, s.st_mtime_ns, s.st_nlink) for s in after] == [
        (s.st_ino, s.st_mtime_ns, s.st_nlink) for s in before
    ]
    assert (folder / "build").stat().st_mtime == 2
    assert (folder / "empty").is_dir()
    assert (folder / "src" / "mine.c").readlink() == Path("nowhere")
    assert only(folder)


def test_folder_that_held_only_dropped_files_goes(folder: Path) -> None:
    """No empty folder of ours is left behind."""
    bundle.write({"README.md": "What.\n"}, folder)
    assert sorted(place.name for place in folder.iterdir()) == ["README.md", "manifest.json"]


def test_file_edited_by_hand_is_refused_without_force(folder: Path) -> None:
    """An edited file stops the run, is named with the fix, and nothing changes on disk."""
    (folder / "src" / "nmpc.c").write_text("int mine;\n", encoding="utf-8")
    before = content(folder)
    with pytest.raises(ForeignFilesError) as caught:
        bundle.write(NEXT, folder)
    assert caught.value.paths == ("src/nmpc.c",)
    assert "src/nmpc.c (edited by hand)" in str(caught.value)
    assert "--force" in str(caught.value)
    assert content(folder) == before
    assert only(folder)


def test_file_edited_into_the_next_bundle_is_no_conflict(folder: Path) -> None:
    """Whoever wrote by hand what the generator would write loses nothing."""
    (folder / "include" / "nmpc.h").write_text(NEXT["include/nmpc.h"], encoding="utf-8")
    assert "include/nmpc.h" in bundle.write(NEXT, folder).unchanged


def test_force_overwrites_the_conflicts_and_nothing_else(folder: Path) -> None:
    """With force the edited file is ours again, a foreign one of another name stays."""
    (folder / "src" / "nmpc.c").write_text("int mine;\n", encoding="utf-8")
    (folder / "src" / "other.c").write_text("int other;\n", encoding="utf-8")
    changes = bundle.write(FILES, folder, force=True)
    assert changes.changed == ("src/nmpc.c",)
    assert content(folder) == {**expected(FILES), "src/other.c": b"int other;\n"}


def test_folder_of_somebody_else_is_shared_unless_paths_collide(tmp_path: Path) -> None:
    """Without a manifest every file is foreign: other names stay, the same name is refused."""
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "notes.txt").write_text("notes", encoding="utf-8")
    assert bundle.write(FILES, tmp_path / "out").kept == ("notes.txt",)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "README.md").write_text("mine", encoding="utf-8")
    with pytest.raises(ForeignFilesError, match=r"README\.md \(not ours\)"):
        bundle.write(FILES, tmp_path / "other")


@pytest.mark.parametrize(
    "text",
    [
        '{"files": {"index.js": "/static/index.js"}}',
        '{"generator": "webpack 5", "files": {}}',
        '{"generator": 1}',
        "[]",
        "no json",
        "[" * 100_000,
    ],
    ids=lambda text: text[:20],
)
def test_manifest_of_another_tool_is_foreign(tmp_path: Path, text: str) -> None:
    """A manifest.json that we did not write is somebody's file, whatever it holds."""
    (tmp_path / "manifest.json").write_text(text, encoding="utf-8")
    with pytest.raises(ForeignFilesError, match=r"manifest\.json \(not ours\)"):
        bundle.write(FILES, tmp_path)
    bundle.write(FILES, tmp_path, force=True)
    assert content(tmp_path) == expected(FILES)


def test_manifest_cannot_point_outside_its_folder(folder: Path) -> None:
    """A doctored manifest neither removes nor claims to remove a file beyond its folder."""
    victim = folder.parent / "victim"
    victim.write_text("precious", encoding="utf-8")
    listed = json.loads(bundle.manifest(FILES))
    for path in ("../victim", str(victim), "src/../../victim"):
        listed["files"][path] = sha256(b"precious").hexdigest()
    (folder / "manifest.json").write_text(json.dumps(listed), encoding="utf-8")
    assert bundle.write(NEXT, folder).removed == ("src/a.c",)
    assert victim.read_text(encoding="utf-8") == "precious"
    assert content(folder) == expected(NEXT)


def test_manifest_may_list_any_text(folder: Path) -> None:
    """A doctored manifest whose paths no file can have is read over, and put right."""
    listed = json.loads(bundle.manifest(FILES))
    for path in ("\ud800/x", "\udfff", "nul\0/x", "\n/\x1b[31m", ""):
        listed["files"][path] = sha256(b"").hexdigest()
    (folder / "manifest.json").write_text(json.dumps(listed), encoding="utf-8")
    assert bundle.check(FILES, folder)[0].path == "manifest.json"
    bundle.write(NEXT, folder)
    assert content(folder) == expected(NEXT)


@pytest.mark.parametrize("path", ["/etc/x", "../x", "a/../x", "a//b", "./a", "", "manifest.json"])
def test_bundle_cannot_point_outside_its_folder(tmp_path: Path, path: str) -> None:
    """A path that is not plainly inside the folder is a mistake of the caller."""
    with pytest.raises(ValueError, match="not a path of a bundle"):
        bundle.write({path: ""}, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_folder_or_link_in_the_way_is_refused_even_with_force(folder: Path) -> None:
    """A folder or pipe where a file belongs, a file or link where a folder belongs: no force removes them."""
    for make, remove in ((Path.mkdir, Path.rmdir), (os.mkfifo, Path.unlink)):
        make(folder / "src" / "b.c")
        with pytest.raises(ForeignFilesError, match=r"src/b\.c is in the way"):
            bundle.write(NEXT, folder, force=True)
        remove(folder / "src" / "b.c")
    for in_the_way in (Path.touch, lambda place: place.symlink_to(folder / "src")):
        in_the_way(folder / "example")
        with pytest.raises(ForeignFilesError, match="example is in the way"):
            bundle.write({**FILES, "example/main.c": ""}, folder, force=True)
        (folder / "example").unlink()


def test_force_replaces_a_link_and_not_what_it_points_to(folder: Path) -> None:
    """A link at a path of ours is foreign; with force the link goes and its target stays."""
    precious = folder.parent / "precious.c"
    precious.write_text("precious", encoding="utf-8")
    (folder / "src" / "b.c").symlink_to(precious)
    with pytest.raises(ForeignFilesError, match=r"src/b\.c \(not ours\)"):
        bundle.write(NEXT, folder)
    bundle.write(NEXT, folder, force=True)
    assert precious.read_text(encoding="utf-8") == "precious"
    assert not (folder / "src" / "b.c").is_symlink()


def test_linked_folder_is_written_where_it_points(folder: Path) -> None:
    """A link to the folder stays a link."""
    link = folder.parent.parent / "link"
    link.symlink_to(folder)
    bundle.write(NEXT, link)
    assert link.is_symlink()
    assert content(folder) == expected(NEXT)


def test_target_that_can_be_no_folder_is_refused(tmp_path: Path) -> None:
    """A file, something below a file and a loop of links get a message, and stay."""
    file, loop = tmp_path / "file", tmp_path / "loop"
    file.write_text("mine", encoding="utf-8")
    loop.symlink_to(loop)
    for target in (file, file / "below", loop):
        with pytest.raises(UnwritableError, match="cannot be written"):
            bundle.write(FILES, target)
    assert file.read_text(encoding="utf-8") == "mine"
    assert sorted(place.name for place in tmp_path.iterdir()) == ["file", "loop"]


def test_folder_stays_the_same_folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever stands in the folder, or holds it open, stays in it; `-o .` is a folder like any other."""
    monkeypatch.chdir(folder)
    before = Path().stat().st_ino, Path("src").stat().st_ino
    bundle.write(NEXT, Path())
    assert content(folder) == expected(NEXT)
    assert (Path().stat().st_ino, Path("src").stat().st_ino) == before


def test_replaced_file_keeps_its_permissions(folder: Path) -> None:
    """Who may read, write and run a file is not the generator's business."""
    for path, mode in (("include/nmpc.h", 0o640), ("manifest.json", 0o755)):
        (folder / path).chmod(mode)
    bundle.write(NEXT, folder)
    assert [(folder / path).stat().st_mode & 0o777 for path in ("include/nmpc.h", "manifest.json")] == [
        0o640,
        0o755,
    ]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_replaced_file_keeps_its_owner(folder: Path) -> None:
    """A run as root takes no file away from its owner."""
    os.chown(folder / "include" / "nmpc.h", 1234, 5678)
    bundle.write(NEXT, folder)
    found = (folder / "include" / "nmpc.h").stat()
    assert (found.st_uid, found.st_gid) == (1234, 5678)


def test_files_that_a_bundle_no_longer_has_go_and_edited_ones_stay(folder: Path) -> None:
    """A folder loses its own files, and keeps what was edited."""
    (folder / "src" / "a.c").write_text("mine", "utf-8")
    new = {"README.md": "one", "nmpc.h": "one", "nmpc.c": "one"}
    changes = bundle.write(new, folder)
    assert changes.removed == ("include/nmpc.h", "src/nmpc.c")
    assert changes.kept == changes.edited == ("src/a.c",)
    assert content(folder) == expected(new) | {"src/a.c": b"mine"}
    assert bundle.write(new, folder).edited == ()


def test_dry_run_tells_and_touches_nothing(folder: Path) -> None:
    """A dry run returns what a real one does and leaves the disk as it is."""
    before = content(folder)
    told = bundle.write(NEXT, folder, dry_run=True)
    assert content(folder) == before
    assert told == bundle.write(NEXT, folder)
    bundle.write(NEXT, folder.parent / "new" / "folder", dry_run=True)
    assert only(folder)


def test_failure_half_way_leaves_the_old_folder(folder: Path) -> None:
    """A file that cannot be written takes the whole run back, parents made for it included."""
    impossible = {**NEXT, "zzz/" + "x" * 300: "name too long"}
    with pytest.raises(UnwritableError, match="cannot be written: File name too long"):
        bundle.write(impossible, folder)
    with pytest.raises(UnwritableError):
        bundle.write(impossible, folder.parent / "new" / "folder")
    assert content(folder) == expected(FILES)
    assert only(folder)


def test_check_of_an_up_to_date_folder_finds_nothing(folder: Path) -> None:
    """No drift where nothing differs; foreign files are none."""
    (folder / "mine.txt").write_text("mine", encoding="utf-8")
    assert bundle.check(FILES, folder) == ()


def test_check_names_missing_changed_and_stale(folder: Path) -> None:
    """Each drift has its kind, and a change its diff."""
    (folder / "src" / "nmpc.c").write_text("int y;\n", encoding="utf-8")
    (folder / "README.md").unlink()
    (folder / "src" / "old.c").write_text("", encoding="utf-8")
    drifts = {drift.path: drift for drift in bundle.check(NEXT, folder)}
    assert {path: drift.kind for path, drift in drifts.items()} == {
        "README.md": "missing",
        "include/nmpc.h": "changed",
        "manifest.json": "changed",
        "src/nmpc.c": "changed",
        "src/b.c": "missing",
        "src/a.c": "stale",
    }
    assert drifts["src/nmpc.c"].diff.splitlines() == [
        "--- src/nmpc.c (on disk)",
        "+++ src/nmpc.c (generated)",
        "@@ -1,2 +1,2 @@",
        "-int y;",
        "+int x;",
        " ",
    ]


@pytest.mark.parametrize(
    ("found", "line"),
    [(b"int x;\r\n", r"-int x;\r"), (b"int x;", "+"), (b"int \xff\x1b;\n", r"-int \xff\x1b;")],
    ids=["line ends", "no last newline", "no UTF-8"],
)
def test_check_makes_invisible_differences_visible(folder: Path, found: bytes, line: str) -> None:
    """Line ends, a missing last newline and odd bytes show in the diff."""
    (folder / "src" / "nmpc.c").write_bytes(found)
    (drift,) = bundle.check(FILES, folder)
    assert line in drift.diff.splitlines()
    assert all(shown.isprintable() for shown in drift.diff.splitlines())


def test_check_of_a_link_finds_a_change(folder: Path) -> None:
    """A link where the bundle has a file is no file of the bundle, even if it leads to the same text."""
    (folder / "copy.c").write_bytes((folder / "src" / "a.c").read_bytes())
    (folder / "src" / "a.c").unlink()
    (folder / "src" / "a.c").symlink_to(folder / "copy.c")
    assert bundle.check(FILES, folder) == (Drift("src/a.c", "changed"),)


def test_check_of_no_folder_finds_everything_missing(tmp_path: Path) -> None:
    """A folder that is not there, or is a file, misses every file of the bundle."""
    (tmp_path / "file").touch()
    for place in (tmp_path / "none", tmp_path / "file"):
        assert bundle.check(FILES, place) == tuple(Drift(path, "missing") for path in sorted(expected(FILES)))
