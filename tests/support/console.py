"""The console blocks of a page, and how they are run: its commands in one shell, in one folder, in order."""

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from tests.support.command import without_progress

NOT_RUN = "Not run by the tests: "
"""What the title of a block begins with whose commands need what a test has not."""

_FENCE = re.compile(r'^```(\w+)(?: title="([^"]*)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)
_MARK = "-- end of command, exit code"


@dataclass(frozen=True)
class Command:
    """One command of a page: its line there, and the output below it, in which `...` stands for anything."""

    line: int
    text: str
    output: tuple[str, ...]


@dataclass(frozen=True)
class Page:
    """What a page asks its reader to do: files to save and commands to type, each in order."""

    steps: tuple[Command | tuple[str, str], ...]
    not_run: tuple[str, ...]


def read(path: Path) -> Page:
    """Return the steps of a page: a block titled by a file name is a file, a console block has commands."""
    text = path.read_text("utf-8")
    steps: list[Command | tuple[str, str]] = []
    not_run = []
    for block in _FENCE.finditer(text):
        language, title, body = block.groups()
        first = text.count("\n", 0, block.start()) + 2
        if title is not None and title.startswith(NOT_RUN):
            not_run.append(title.removeprefix(NOT_RUN))
        elif language == "console":
            steps += _commands(body, first)
        elif title is not None:
            steps.append((title, body))
    return Page(tuple(steps), tuple(not_run))


def _commands(body: str, first: int) -> list[Command]:
    """Return the commands of a console block whose first line has the number `first`."""
    found: list[Command] = []
    for number, line in enumerate(body.splitlines(), first):
        if line.startswith("$ "):
            found.append(Command(number, line.removeprefix("$ "), ()))
        else:
            assert found, f"line {number}: output without a command"
            last = found.pop()
            found.append(Command(last.line, last.text, (*last.output, line.rstrip())))
    return found


def faults(page: Page, folder: Path, *binaries: Path) -> list[str]:
    """Run the commands of a page in `folder`; return those that failed, or printed other than the page says.

    `binaries` are folders in which its shell looks for commands first.

    A command may fail if the next one is `echo $?`, which shows its exit code.
    """
    script = ""
    for step in page.steps:
        if isinstance(step, Command):
            script += f"{step.text}\n__code=$?\necho\necho '{_MARK}' $__code\n(exit $__code)\n"
        else:
            script += f"cat > {step[0]} <<'END OF FILE'\n{step[1]}END OF FILE\n"
    places = [*map(str, binaries), str(Path(sys.executable).parent), os.environ["PATH"]]
    environment = {
        "PATH": os.pathsep.join(places),
        "COLUMNS": "120",
        "PYTHONUNBUFFERED": "1",
    }
    done = subprocess.run(
        ["bash", "-c", script],
        cwd=folder,
        env=os.environ | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        start_new_session=True,
    )
    commands = [step for step in page.steps if isinstance(step, Command)]
    *printed, _ = re.split(rf"\n{_MARK} (\d+)\n", done.stdout)
    assert len(printed) == 2 * len(commands), done.stdout
    found = []
    for index, command in enumerate(commands):
        output, code = without_progress(printed[2 * index] + "\n").rstrip("\n"), printed[2 * index + 1]
        shown = index + 1 < len(commands) and commands[index + 1].text == "echo $?"
        if code != "0" and not shown:
            found.append(f"line {command.line}: {command.text}: exit code {code}\n{output}")
        elif command.output and not fits(command.output, output):
            found.append(f"line {command.line}: {command.text}: printed\n{output}")
    return found


def fits(lines: tuple[str, ...], output: str) -> bool:
    """Return whether `output` is `lines`; `...` stands for any text, on a line of its own for any lines."""
    printed = "".join(f"{line.rstrip()}\n" for line in output.splitlines())
    pattern = ""
    for line in lines:
        inside = ".*?".join(re.escape(part) for part in line.split("..."))
        pattern += "(?:.*\n)*?" if line.strip() == "..." else f"{inside}\n"
    return re.fullmatch(pattern, printed) is not None
