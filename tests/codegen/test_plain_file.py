"""Files that a user names: a pipe is refused at once, whatever would have read it."""

import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from mambo_codegen import boards
from mambo_codegen.atomic import put, put_stream
from mambo_codegen.errors import MamboNmpcError
from mambo_codegen.plain_file import find_obstacle, read_plain_file
from mambo_codegen.settings import presets
from mambo_sil.experiment.campaign import campaign_file
from mambo_sil.flight.scenario import read_record
from mambo_sil.flight.trajectories import Waypoints


@pytest.fixture
def socket_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the path of a socket, made in the working folder because its name must be short."""
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as made:
        made.bind("socket")
    return tmp_path / "socket"


def test_what_is_no_plain_file_is_not_replaced(tmp_path: Path, socket_path: Path) -> None:
    """Pipe, socket, folder and dangling link stay; a file, a link to one and a new file are written."""
    (tmp_path / "folder").mkdir()
    (tmp_path / "dangling").symlink_to("nothing")
    (tmp_path / "endless").symlink_to("endless")
    os.mkfifo(tmp_path / "pipe")
    before = {path: path.lstat() for path in tmp_path.iterdir()}
    obstacles = {"dangling": "a link to nothing", "endless": "a link to nothing", "folder": "a folder"}
    for name, kind in {**obstacles, "pipe": "a pipe", socket_path.name: "a socket"}.items():
        assert find_obstacle(tmp_path / name) == kind
        with pytest.raises(OSError, match=f"it is {kind}; name a plain file"):
            put(tmp_path / name, b"new")
    with pytest.raises(OSError, match="it is a folder"):
        put(Path(), b"new")
    assert {path: path.lstat() for path in tmp_path.iterdir()} == before
    (tmp_path / "file").write_bytes(b"old")
    (tmp_path / "link").symlink_to("file")
    for name in ("file", "link", "made"):
        assert find_obstacle(tmp_path / name) is None
        put(tmp_path / name, b"new")
        assert (tmp_path / name).read_bytes() == b"new"


def test_a_plain_file_is_read_up_to_a_limit(tmp_path: Path) -> None:
    """At most so many bytes, all of a shorter file."""
    path = tmp_path / "a.toml"
    path.write_bytes(b"12345")
    assert [read_plain_file(path, most) for most in (3, 5, 9)] == [b"123", b"12345", b"12345"]


@pytest.mark.parametrize(
    "read",
    [
        lambda path: presets.load(str(path)),
        lambda path: boards.load(str(path)),
        campaign_file.read,
        Waypoints.read,
        read_record,
    ],
)
def test_a_pipe_is_refused_without_waiting_for_its_writer(
    read: Callable[[Path], object], tmp_path: Path
) -> None:
    """Nothing ever writes to this pipe."""
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with pytest.raises(MamboNmpcError, match=r"pipe: cannot be read: it is a pipe or a device; name a plain"):
        read(path)


def test_a_device_and_a_folder_are_refused(tmp_path: Path) -> None:
    """/dev/zero has no end."""
    with pytest.raises(OSError, match="pipe or a device"):
        read_plain_file(Path("/dev/zero"), 10)
    with pytest.raises(IsADirectoryError):
        read_plain_file(tmp_path, 10)


def write_lines(path: Path, *, fail: bool = False) -> None:
    """Write two lines to a stream; with `fail` raise between them."""
    with put_stream(path) as file:
        file.write(b"one\n")
        if fail:
            raise KeyboardInterrupt
        file.write(b"two\n")


def test_a_stream_replaces_a_file_whole_or_not_at_all(tmp_path: Path) -> None:
    """What is interrupted leaves the old file, or none, and nothing else."""
    path = tmp_path / "table.csv"
    with pytest.raises(KeyboardInterrupt):
        write_lines(path, fail=True)
    assert not list(tmp_path.iterdir())
    write_lines(path)
    assert path.read_bytes() == b"one\ntwo\n"
    with pytest.raises(KeyboardInterrupt):
        write_lines(path, fail=True)
    assert [one.read_bytes() for one in tmp_path.iterdir()] == [b"one\ntwo\n"]


def test_a_stream_replaces_no_folder(tmp_path: Path) -> None:
    """Nor a pipe; the error names the place."""
    with pytest.raises(OSError, match="name a plain file") as raised:
        write_lines(tmp_path)
    assert raised.value.filename == str(tmp_path)
    with pytest.raises(FileNotFoundError) as missing:
        write_lines(tmp_path / "no" / "table.csv")
    assert missing.value.filename == str(tmp_path / "no" / "table.csv")
