"""SIGTERM while the command starts: exit 143 at any time; SIGINT that is ignored stays so."""

import pytest

from tests.support.command import command

TERMINATE = "os.kill(os.getpid(), signal.SIGTERM)"
DURING_IMPORT = f"""
class Finder:
    def find_spec(self, name, *_):
        if name == "mambo_sil.cli.settings":
            {TERMINATE}
sys.meta_path.insert(0, Finder())
"""
DURING_PARSING = f"""
from mambo_sil.cli import command
make_context = command.RootGroup.make_context
def make(*arguments, **options):
    {TERMINATE}
    return make_context(*arguments, **options)
command.RootGroup.make_context = make
"""
DURING_COMMAND = f"""
from mambo_sil.cli import command
echo = command.typer.echo
def stop(*arguments, **options):
    {TERMINATE}
    echo(*arguments, **options)
command.typer.echo = stop
"""


@pytest.mark.first_is_quick
@pytest.mark.parametrize("when", [DURING_IMPORT, DURING_PARSING, DURING_COMMAND])
def test_a_terminated_command_exits_with_143(when: str) -> None:
    """While modules are imported, while the command line is parsed, and while the command runs."""
    script = f"import os, signal, sys\n{when}\nfrom mambo_nmpc.__main__ import main\nmain()"
    done = command("presets", script=script)
    assert (done.returncode, done.stdout, done.stderr) == (143, "", "")


def test_a_command_started_with_ctrl_c_ignored_goes_on() -> None:
    """As in the background of a script, where the shell ignores it: the command leaves that as it is."""
    interrupted = DURING_COMMAND.replace("SIGTERM", "SIGINT")
    ignored = "import os, signal, sys\nsignal.signal(signal.SIGINT, signal.SIG_IGN)"
    script = f"{ignored}\n{interrupted}\nfrom mambo_nmpc.__main__ import main\nmain()"
    done = command("presets", script=script)
    assert (done.returncode, done.stderr) == (0, "")
    assert "mambo-1norm" in done.stdout
