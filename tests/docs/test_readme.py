"""README, typed in: its two commands are those of the Makefile, the others run, its Python and C agree."""

import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.support.command import run
from tests.support.tools import require

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
MAKE = "make "
NOT_TYPED = (MAKE, "cd app && make", "mambo-nmpc verify")
"""What is not run here: it sets up, needs the Crazyflie's firmware, or tests of their own run every check."""
FIRST_SCREEN = 20
"""Lines of it."""

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
    assert len(README.split()) <= 700
    programs = (*blocks("python"), *blocks("c"))
    assert [len([line for line in program.splitlines() if line]) for program in programs] == [6, 6]


def two_commands(readme: str) -> dict[str, str]:
    """Return the commands of the first block on the first screen of a README, each with its comment."""
    screen = "\n".join(readme.splitlines()[:FIRST_SCREEN])
    block = re.search(r"^```sh\n(.*?)^```$", screen, re.MULTILINE | re.DOTALL)
    lines = block[1].splitlines() if block else []
    return {command.strip(): what.strip() for command, _, what in (line.partition("#") for line in lines)}


def test_its_two_commands_are_those_of_the_makefile_and_of_ci() -> None:
    """`make fly` and `make test`, with what they do and take; the check of every change is the second."""
    fly, test = two_commands(README).items()
    rules = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    for command, what in (fly, test):
        assert command.removeprefix(MAKE) in rules
        assert "minute" in what
        assert "sets up" in what
    assert (ROOT / ".ci" / "run").read_text("utf-8").splitlines()[-1] == test[0]
    done = subprocess.run(
        ["make", "--dry-run", *fly[0].split()[1:]], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    for word, step in {"generates": "generate", "flies": "table2", "picture": ".png"}.items():
        assert word in fly[1]
        assert step in done


def test_a_command_that_is_lost_or_below_the_first_screen_is_missed() -> None:
    """So that the test above can fail."""
    lost = re.sub(r"^make test .*\n", "", README, flags=re.MULTILINE)
    assert [*two_commands(lost)] == ["make fly"]
    assert two_commands("\n" * FIRST_SCREEN + README) == {}


@pytest.mark.long
def test_its_commands_run_and_its_programs_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In an empty folder; the C has the bits that Python has."""
    require("cc", "gcc")
    monkeypatch.chdir(tmp_path)
    commands = [line.partition("  #")[0].strip() for block in blocks("sh") for line in block.splitlines()]
    commands += re.findall(r"by `(mambo-nmpc generate [^`]+)`", README)
    typed = [command for command in commands if not command.startswith(NOT_TYPED)]
    assert len(typed) == len(commands) - 4 == 5
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
