"""Two generations of a bundle: their files never compile together, whenever a run stops; nothing is lost."""

import json
import subprocess
import sys
import threading
from functools import cache
from pathlib import Path

import pytest

from mambo_codegen.atomic import is_left_over
from mambo_codegen.bundle import bundle
from mambo_codegen.bundle import render as rendering
from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from tests.support.bundles import FILES, NEXT, content, expected, place
from tests.support.one_norm import ONE_NORM
from tests.support.tools import require

AGAIN = "this file and its headers are of different bundles: run mambo-nmpc generate again"
MINE = {"src/mine.txt": "mine", "build/nmpc.o": "\0"}

STOPPED_RUNS = """
import json, os, shutil, signal, sys
from pathlib import Path
from mambo_codegen.bundle import bundle

start, root, how, force = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], sys.argv[4] == "True"
files = json.load(sys.stdin)
seen = 0

def stop_at(operation):
    def hook(event, arguments):
        global seen
        writes = event == "open" and "w" in (arguments[1] or "")
        if writes or event in ("os.rename", "os.remove", "os.mkdir", "os.rmdir"):
            seen += 1
            if seen == operation:
                if how == "error":
                    raise OSError(5, "Input/output error")
                os.kill(os.getpid(), signal.SIGKILL)
    return hook

for operation in range(1, 1000):
    folder = root / str(operation) / "controller"
    shutil.copytree(start, folder)
    child = os.fork()
    if child == 0:
        sys.addaudithook(stop_at(operation))
        try:
            bundle.write(files, folder, force=force)
        finally:
            os._exit(int(seen >= operation))
    if os.waitpid(child, 0)[1] == 0:
        break
"""
"""Runs that stop at the n-th operation that changes the disk, for every n: killed, or by an error."""

EDITED_MEANWHILE = """
import json, sys
from pathlib import Path
from mambo_codegen.bundle import bundle
from mambo_codegen.errors import ForeignFilesError

folder, edited = Path(sys.argv[1]), []

def hook(event, arguments):
    if event == "open" and "w" in (arguments[1] or "") and not edited:
        edited.append(True)
        (folder / "include" / "nmpc.h").write_text("mine")

sys.addaudithook(hook)
try:
    bundle.write(json.load(sys.stdin), folder)
except ForeignFilesError as error:
    print(error)
"""
"""A run during which somebody edits a file that it is about to replace."""

FULL_DISK = """
import json, resource, sys
from pathlib import Path
from mambo_codegen.bundle import bundle
from mambo_codegen.errors import UnwritableError

resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
try:
    bundle.write(json.load(sys.stdin), Path(sys.argv[1]))
except UnwritableError as error:
    print(error)
"""
"""A run that may write no more than 20 kB into a file, and prints how it failed."""


@cache
def generation(name: str) -> dict[str, str]:
    """Render the bundle of a preset, as in "mambo fixed"; "" is no bundle."""
    if not name:
        return {}
    preset, *options = name.split()
    settings = with_option(presets.load(preset), "code.scalar", "fixed" if "fixed" in options else "float32")
    return rendering.render(settings, with_digest=False)


def c_files(files: dict[str, bytes]) -> dict[str, bytes]:
    """Return what of `files` a compiler sees."""
    return {path: text for path, text in files.items() if path.endswith((".c", ".h"))}


def refusal(folder: Path, *files: str) -> str:
    """Compile `files`, or every source in `folder`; return what the compiler said, nothing if all is well."""
    require("gcc", "gcc")
    sources = files or sorted(str(path.relative_to(folder)) for path in folder.rglob("*.c"))
    flags = ["-fsyntax-only", "-I.", "-DNMPC_SELF_TEST_DIGEST=0UL", "-x", "c"]
    done = subprocess.run(["gcc", *flags, *sources], cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode == 0) == (done.stderr == "")
    return done.stderr


def run_in_a_process(script: str, files: dict[str, str], *arguments: str | Path) -> str:
    """Run `script` with the bundle `files` as its input and return what it prints."""
    command = [sys.executable, "-c", script, *map(str, arguments)]
    done = subprocess.run(command, input=json.dumps(files), capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


def test_one_file_of_another_generation_stops_the_compiler(tmp_path: Path) -> None:
    """Every C file of the bundle in turn comes from other settings; the compiler reads that file alone.

    So any mixture stops it: one file at least is not of the generation of nmpc.h.
    """
    ours, others = (generation(preset) for preset in ("table1-printed", "table1"))
    place(ours, tmp_path)
    assert refusal(tmp_path) == ""
    changed = [path for path in ours if path.endswith((".c", ".h"))]
    assert len(changed) == 7
    sources = {"nmpc.h": "nmpc.c"}  # it states the number
    for path in changed:
        place({path: others[path]}, tmp_path)
        assert AGAIN in refusal(tmp_path, sources.get(path, path)), path
        place({path: ours[path]}, tmp_path)


def test_files_of_another_version_stop_the_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same settings, another version of the generator."""
    place(generation("table1"), tmp_path)
    monkeypatch.setattr(rendering, "__version__", "99.0")
    newer = rendering.render(presets.load("table1"), with_digest=False)
    place({"nmpc.c": newer["nmpc.c"]}, tmp_path)
    assert AGAIN in refusal(tmp_path, "nmpc.c")


def test_the_check_carries_the_prefix() -> None:
    """Two controllers in one image have a number each."""
    files = rendering.render(with_option(ONE_NORM, "code.prefix", "roll"), with_digest=False)
    header = files["roll_self_test.h"]
    assert "#if !defined(ROLL_SETTINGS_ID) || (ROLL_SETTINGS_ID != 0x" in header
    assert f'#error "{AGAIN}"' in header
    assert "NMPC_SETTINGS_ID" not in "".join(files.values())


@pytest.mark.parametrize("how", ["kill", "error"])
@pytest.mark.parametrize(
    ("old", "new", "force"),
    [
        pytest.param("", "mambo", False, marks=pytest.mark.long),
        ("table1", "mambo", False),
        pytest.param("mambo", "mambo fixed", False, marks=pytest.mark.long),
        pytest.param("mambo fixed", "table1", True, marks=pytest.mark.long),
    ],
)
def test_run_stopped_anywhere_leaves_no_mixture_that_compiles(
    tmp_path: Path, old: str, new: str, force: bool, how: str
) -> None:
    """Every file is old or new; both together do not compile; the same run, repeated, makes it whole."""
    start = tmp_path / "start"
    place(MINE, start)
    mine, files = content(start), generation(new)
    if old:
        bundle.write(generation(old), start)
    before, after = content(start), expected(files)
    is_old, is_new = (c_files(whole).items() for whole in (before, after))
    run_in_a_process(STOPPED_RUNS, files, start, tmp_path / "runs", how, str(force))
    # No file changes before all new ones are on the disk.
    untouched, said = 0, dict[frozenset[tuple[str, bytes]], str]()
    for folder in (run / "controller" for run in (tmp_path / "runs").iterdir()):
        laid = content(folder)
        found = {path: text for path, text in laid.items() if not is_left_over(path)}
        untouched += found == before
        assert how == "kill" or laid == found
        assert mine.items() <= found.items()
        state = frozenset(c_files(found).items())
        assert state <= is_old | is_new
        if not (state <= is_old or state <= is_new):
            if state not in said:
                said[state] = refusal(folder)
            whole = is_old <= state or is_new <= state  # the rest is headers that no source of it includes
            assert AGAIN in said[state] or (whole and said[state] == "")
        bundle.write(files, folder, force=force)
        assert content(folder) == after | mine
    assert untouched > len(after.items() - before.items())
    assert bool(said) == bool(old)


def test_file_edited_during_the_run_is_not_lost(folder: Path) -> None:
    """The run stops before it replaces anything."""
    said = run_in_a_process(EDITED_MEANWHILE, NEXT, folder)
    assert "nmpc.h (edited by hand)" in said
    assert content(folder) == expected(FILES) | {"include/nmpc.h": b"mine"}


def test_full_disk_leaves_the_old_folder(folder: Path) -> None:
    """The file that finds no room is named, and no other has changed."""
    said = run_in_a_process(FULL_DISK, {**NEXT, "src/large.c": "x" * 30_000}, folder)
    assert "cannot be written: File too large" in said
    assert "large.c)" in said
    assert content(folder) == expected(FILES)


def test_what_others_write_meanwhile_is_not_lost(folder: Path) -> None:
    """Files made, saved over by a rename, or grown in the folder during many runs are there at the end."""
    (folder / "build").mkdir()
    done = threading.Event()
    saved: list[str] = []

    def work() -> None:
        while not done.is_set() or len(saved) < 100:
            name = str(len(saved))
            (folder / "build" / name).write_text(name, encoding="utf-8")
            (folder / "src" / "notes.new").write_text(name, encoding="utf-8")
            (folder / "src" / "notes.new").rename(folder / "src" / "notes.txt")
            with (folder / "log.txt").open("a", encoding="utf-8") as log:
                log.write(f"{name}\n")
            saved.append(name)

    other = threading.Thread(target=work)
    other.start()
    try:
        for files in [NEXT, FILES] * 20:
            bundle.write(files, folder)
    finally:
        done.set()
        other.join()
    found = content(folder)
    assert found["log.txt"].decode().split() == saved
    assert found["src/notes.txt"].decode() == saved[-1]
    assert all(found[f"build/{name}"].decode() == name for name in saved)
    assert {path: found[path] for path in expected(FILES)} == expected(FILES)
