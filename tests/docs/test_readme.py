"""README, typed in: its commands run, and its Python and its C compute the same command."""

import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.support.command import run
from tests.support.tools import require

README = (Path(__file__).parents[2] / "README.md").read_text("utf-8")
INSTALL, VERIFY = "python3 -m venv", "mambo-nmpc verify"
"""What is not run here: tests of their own install a wheel and run every check."""

PROGRAM = """\
#include <stdio.h>
#include "nmpc.h"
static void fly_attitude(nmpc_real_t roll_rad, nmpc_real_t pitch_rad, nmpc_real_t thrust_m_s2)
{
    (void)printf("%.9g %.9g %.9g\\n", (double)roll_rad, (double)pitch_rad, (double)thrust_m_s2);
}
int main(void)
{
"""


def blocks(language: str) -> list[str]:
    """Return the blocks of code in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


def test_it_is_short() -> None:
    """Who reads it wants to know whether to go on."""
    assert len(README.split()) <= 750
    programs = (*blocks("python"), *blocks("c"))
    assert [len([line for line in program.splitlines() if line]) for program in programs] == [6, 6]


@pytest.mark.long
def test_its_commands_run_and_its_programs_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In an empty folder; the C has the bits that Python has."""
    require("cc", "gcc")
    monkeypatch.chdir(tmp_path)
    commands = [line.partition("  #")[0].strip() for block in blocks("sh") for line in block.splitlines()]
    commands += re.findall(r"by `(mambo-nmpc generate [^`]+)`", README)
    typed = [command for command in commands if not command.startswith((INSTALL, VERIFY))]
    assert len(typed) == len(commands) - 2 == 5
    for command in typed:
        run(*command.split()[1:])
    names: dict[str, Any] = {}
    exec("".join(blocks("python")), names)
    first, *others = blocks("c")[0].splitlines()
    lines = [PROGRAM, first, "nmpc_init(&controller);", *others, "return (int)status;", "}"]
    Path("main.c").write_text("\n".join(lines) + "\n", "utf-8")
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off", "-Icontroller"]
    subprocess.run(["cc", *flags, "main.c", "controller/nmpc.c", "-o", "main"], check=True)
    printed = subprocess.run(["./main"], capture_output=True, text=True, check=True).stdout
    outcome = names["outcome"]
    assert [f"{float(one):.9g}" for one in (*outcome.command_rad, outcome.thrust_m_s2)] == printed.split()
