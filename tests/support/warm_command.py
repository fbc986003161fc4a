"""A process that has imported all of mambo-nmpc, and runs each command of a page in a fork of itself.

To start Python, NumPy, SciPy and Matplotlib takes a second of processor time; pages have a hundred commands.
Their shell finds, in place of mambo-nmpc, a script that hands its files, arguments, folder and environment to
this process, and ends with the exit code of the fork.

python -m tests.support.warm_command SOCKET   serve until standard input ends
"""

import gc
import importlib
import json
import os
import pkgutil
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

_CLIENT: Final = """#!{python} -IS
import json, os, socket, sys
server = socket.socket(socket.AF_UNIX)
server.connect({socket!r})
socket.send_fds(server, [b"!"], [0, 1, 2])
server.sendall(json.dumps([sys.argv, os.getcwd(), dict(os.environ)]).encode())
server.shutdown(socket.SHUT_WR)
sys.exit(int(server.recv(4) or b"70"))
"""


@contextmanager
def serve(folder: Path) -> Iterator[Path]:
    """Start the process, and give the folder in which the script is that stands for mambo-nmpc."""
    name = str(folder / "socket")
    client = folder / "bin" / "mambo-nmpc"
    client.parent.mkdir()
    client.write_text(_CLIENT.format(python=sys.executable, socket=name), "utf-8")
    client.chmod(0o755)
    command = [sys.executable, "-m", __name__, name]
    root, unbuffered = Path(__file__).parents[2], os.environ | {"PYTHONUNBUFFERED": "1"}
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, cwd=root, env=unbuffered) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stdout.readline() == b"listening\n"
        yield client.parent
        process.stdin.close()


def _main(name: str) -> None:
    """Import what commands import, and serve one connection after the other, each in a fork."""
    import mambo_sil  # noqa: PLC0415 - the worker processes of a command import this file too
    from mambo_sil.cli.app import main  # noqa: PLC0415 - the same

    for module in pkgutil.walk_packages(mambo_sil.__path__, "mambo_sil."):
        importlib.import_module(module.name)
    importlib.import_module("matplotlib.pyplot")
    gc.freeze()  # a fork neither looks for garbage in what is imported nor copies it
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(name)
        server.listen()
        print("listening", flush=True)
        while select.select([server, sys.stdin], [], [])[0] == [server]:
            connection, _ = server.accept()
            if os.fork() == 0:
                break
            connection.close()
        else:
            return
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    if command := os.fork():
        status = os.waitpid(command, 0)[1]
        connection.sendall(str(os.waitstatus_to_exitcode(status) & 255).encode())
    else:
        _become(connection)
        main()


def _become(connection: socket.socket) -> None:
    """Take over files, arguments, folder and environment of the client."""
    _, files, _, _ = socket.recv_fds(connection, 1, 3)
    with connection.makefile() as sent:
        sys.argv, folder, environment = json.loads(sent.read())
    connection.close()
    for number, file in enumerate(files):
        os.dup2(file, number)
        os.close(file)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)


if __name__ == "__main__":
    _main(sys.argv[1])
