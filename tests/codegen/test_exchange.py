"""Files exchanged in place: no mixture that compiles, whenever a run stops, and nothing of others lost."""

import fcntl
import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from mambo_nmpc.codegen import bundle
from mambo_nmpc.codegen.errors import BuildError
from mambo_nmpc.codegen.exchange import JOURNAL, STAND_IN, is_left_over
from mambo_nmpc.codegen.render import render
from mambo_nmpc.codegen.settings.model import Settings
from tests.support.bundles import FILES, NEXT, content, expected
from tests.support.tools import toolchain

OLD = {
    "README.md": "old",
    "include/nmpc.h": "old",
    "include/nmpc_config.h": "same",
    "src/nmpc.c": "old",
    "src/a.c": "",
}
NEW = {
    "include/nmpc.h": "new",
    "include/nmpc_config.h": "same",
    "include/extra/e.h": "new",
    "src/nmpc.c": "new",
    "src/b.c": "",
}
ROLL = {"include/roll.h": "new", "include/roll_config.h": "new", "lib/roll.c": "new"}
ONE = {"README.md": "one", "nmpc.h": "one", "nmpc.c": "one"}
GUARDS = ("include/nmpc_config.h", "include/roll_config.h", "nmpc.h")
MINE = {"src/mine.txt": b"mine", "build/nmpc.o": b"\0"}

STOPPED_RUNS = """
import json, os, shutil, signal, sys
from pathlib import Path
from mambo_nmpc.codegen import bundle

start, root, how, files = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], json.loads(sys.argv[4])
seen = 0

def stop_at(operation):
    def hook(event, arguments):
        global seen
        if event.startswith(("os.", "open", "shutil.", "fcntl.")):
            seen += 1
            if seen == operation:
                if how == "interrupt":
                    raise KeyboardInterrupt
                os.kill(os.getpid(), signal.SIGKILL)
    return hook

for operation in range(1, 1000):
    folder = root / str(operation) / "controller"
    shutil.copytree(start, folder)
    child = os.fork()
    if child == 0:
        sys.addaudithook(stop_at(operation))
        try:
            bundle.write(files, folder, force=True)
            os._exit(0)
        except KeyboardInterrupt:
            os._exit(1)
    if os.waitpid(child, 0)[1] == 0:
        break
"""
"""Runs that stop at their n-th operation on the disk, for every n: dead at once, or by Ctrl-C."""

STOPPED_AT_A_RENAME = """
import json, os, signal, sys
from pathlib import Path
from mambo_nmpc.codegen import bundle

def hook(event, arguments):
    global left
    if event == "os.rename":
        left -= 1
        if left < 0:
            os.kill(os.getpid(), signal.SIGKILL)

left = int(sys.argv[2])
sys.addaudithook(hook)
bundle.write(json.load(sys.stdin), Path(sys.argv[1]), force=True)
"""
"""A run that is killed when so many renames are done."""

FULL_DISK = """
import json, resource, sys
from pathlib import Path
from mambo_nmpc.codegen import bundle
from mambo_nmpc.codegen.errors import UnwritableError

resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
try:
    bundle.write(json.load(sys.stdin), Path(sys.argv[1]))
except UnwritableError as error:
    print(error)
"""
"""A run that may write no more than 20 kB into a file, and prints how it failed."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Write the bundle FILES into a folder that is alone in its parent."""
    folder = tmp_path / "home" / "controller"
    bundle.write(FILES, folder)
    return folder


def code(folder: Path) -> dict[str, bytes]:
    """Return {path: bytes} of the C that a build could take from `folder`."""
    return {path: text for path, text in content(folder).items() if Path(path).suffix in {".c", ".h"}}


def run_in_a_process(script: str, files: dict[str, str], *arguments: str | Path) -> str:
    """Run `script` with the bundle `files` as its input and return what it prints."""
    command = [sys.executable, "-c", script, *map(str, arguments)]
    done = subprocess.run(command, input=json.dumps(files), capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


def test_unchanged_header_stays_the_same_file_though_it_was_shut(tmp_path: Path) -> None:
    """The stand-in leaves no trace on a header that is the same in both bundles."""
    bundle.write(OLD, tmp_path)
    before = (tmp_path / "include" / "nmpc_config.h").stat()
    changes = bundle.write(NEW, tmp_path)
    after = (tmp_path / "include" / "nmpc_config.h").stat()
    assert "include/nmpc_config.h" in changes.unchanged
    assert (after.st_ino, after.st_mtime_ns, after.st_nlink) == (before.st_ino, before.st_mtime_ns, 1)


def test_full_disk_leaves_the_old_folder(folder: Path) -> None:
    """The file that finds no room is named, and no other has changed."""
    said = run_in_a_process(FULL_DISK, {**NEXT, "src/large.c": "x" * 30_000}, folder)
    assert "cannot be written: File too large" in said
    assert "large.c)" in said
    assert "unfinished" not in said
    assert content(folder) == expected(FILES)


@pytest.mark.parametrize(
    ("old", "new", "how"),
    [
        (OLD, NEW, "kill"),
        (OLD, NEW, "interrupt"),
        ({}, NEW, "kill"),
        (OLD, ONE, "kill"),
        (ONE, ROLL, "kill"),
    ],
    ids=["next", "next by Ctrl-C", "first", "layout", "prefix"],
)
def test_run_stopped_anywhere_is_old_new_or_shut(
    tmp_path: Path, old: dict[str, str], new: dict[str, str], how: str
) -> None:
    """Stopped at any operation, the C is old, new, or refuses to compile; the next run makes it whole."""
    start = tmp_path / "start"
    for path, mine in MINE.items():
        (start / path).parent.mkdir(parents=True, exist_ok=True)
        (start / path).write_bytes(mine)
    if old:
        bundle.write(old, start)
    before = code(start)
    run_in_a_process(STOPPED_RUNS, {}, start, tmp_path / "runs", how, json.dumps(new))
    folders = [run / "controller" for run in (tmp_path / "runs").iterdir()]
    assert len(folders) > 40
    after = {path: text.encode() for path, text in new.items() if Path(path).suffix in {".c", ".h"}}
    shut = 0
    for folder in folders:
        found = code(folder)
        intact = before.items() <= found.items() if before else not found
        if not intact and found != after:
            shut += 1
            assert {found[path] for path in GUARDS if path in found} == {STAND_IN}
        unfinished = (folder / JOURNAL).exists()
        visible = {path for path in content(folder) if not is_left_over(path)}
        assert unfinished or visible in ({*content(start)}, {*new, *MINE, "manifest.json"})
        repaired = new if int(folder.parent.name) % 2 else NEXT
        bundle.write(repaired, folder, force=not unfinished)
        assert content(folder) == {**expected(repaired), **MINE}
        assert not any(place.is_dir() and not any(place.iterdir()) for place in folder.rglob("*"))
    assert shut > 5


@pytest.mark.parametrize(
    ("amalgamate", "prefix"), [(False, "nmpc"), (False, "my_config"), (True, "nmpc"), (True, "my_config")]
)
def test_no_file_compiles_while_a_bundle_is_unfinished(tmp_path: Path, amalgamate: bool, prefix: str) -> None:
    """Killed between two renames, every C file of the bundle stops with what to do."""
    settings = Settings.model_validate({"code": {"prefix": prefix}})
    files = render(settings, amalgamate=amalgamate)
    bundle.write({path: f"{text}\n" for path, text in files.items()}, tmp_path)
    run_in_a_process(STOPPED_AT_A_RENAME, files, tmp_path, "3")
    compiler = toolchain("gcc")
    sources = [path for path in files if path.endswith(".c")]
    for source in sources:
        with pytest.raises(BuildError, match="generation was interrupted: run mambo-nmpc generate again"):
            compiler.run(["-fsyntax-only", "-Iinclude", "-I.", source], tmp_path)
    bundle.write(files, tmp_path)
    compiler.run(["-fsyntax-only", "-Iinclude", "-I.", *sources], tmp_path)


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


def test_second_run_waits_for_the_first_and_says_so(folder: Path) -> None:
    """Runs on the same folder take turns; one that waits long names the folder."""
    script = "import json, sys; from pathlib import Path; from codegen import bundle\n"
    script += "bundle.write(json.loads(sys.argv[2]), Path(sys.argv[1]))"
    command = [sys.executable, "-c", script, str(folder), json.dumps(NEXT)]
    handle = os.open(folder, os.O_RDONLY)
    fcntl.flock(handle, fcntl.LOCK_EX)
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as second:
        assert second.stderr is not None
        assert second.stderr.readline().startswith("waiting for another run in ")
        assert content(folder) == expected(FILES)
        os.close(handle)
    assert second.returncode == 0
    assert content(folder) == expected(NEXT)
