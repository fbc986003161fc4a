"""The command before its work: help, completion, what it imports, and signals while it starts."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mambo_codegen.errors import INTERRUPTED
from mambo_sil.cli.app import panels
from tests.support.command import HEARS_CTRL_C, MAIN, command, run

HEAVY = {"capstone", "cffi", "elftools", "jinja2", "matplotlib", "numpy", "optuna", "scipy", "unicorn"}
SETTINGS = "mambo_codegen.settings.model"
SCRIPT = """
import sys
from mambo_sil.cli.app import main
try:
    main()
except SystemExit as leaving:
    print(*sys.modules, file=sys.stderr)
    raise
"""


@pytest.mark.first_is_quick
@pytest.mark.parametrize("arguments", [["--help"], ["fly", "--help"], ["generate", "--help"]])
def test_help_loads_no_heavy_library(arguments: list[str]) -> None:
    """It answers at once: a command imports what it needs when it is called."""
    done = command(*arguments, script=SCRIPT)
    assert done.stdout
    assert "typer" in done.stderr.split()
    assert not {*HEAVY, SETTINGS} & set(done.stderr.split())


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("arguments", "unwanted"),
    [
        (["generate", "-o", "controller"], {"cffi", "matplotlib", "mpmath", "scipy"}),
        (["fly", "--no-pictures", "--duration-s", "1"], {"matplotlib", "mpmath", "pycparser", "scipy"}),
        (
            ["design", "mambo", "-o", "controller.toml"],
            {"matplotlib", "pycparser", "scipy.signal", "scipy.stats"},
        ),
    ],
    ids=lambda words: words[0] if isinstance(words, list) else "",
)
@pytest.mark.usefixtures("in_an_empty_folder")
def test_a_command_loads_only_what_it_needs(arguments: list[str], unwanted: set[str]) -> None:
    """With a preset, whose constants are shipped; each of these takes a tenth of a second or more."""
    done = command(*arguments, script=SCRIPT.replace("raise", "sys.exit(leaving.code)"))
    assert done.returncode == 0, done.stderr
    assert "numpy" in done.stderr.split()
    assert not unwanted & set(done.stderr.split())


def test_every_command_has_its_line() -> None:
    """The first sentence of what it does, in the panel of what it is for."""
    said, _ = run("--help")
    assert all(f"─ {panel} ─" in said for panel in panels())
    for name in (name for commands in panels().values() for name in commands):
        assert f"│ {name} " in said


def test_help_of_fly_fits_on_two_screens(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 80 columns, because the values of an option stand in its explanation, not beside its name."""
    monkeypatch.setenv("COLUMNS", "80")
    said, _ = run("fly", "--help")
    assert len(said.splitlines()) <= 110


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("mambo-nmpc footp", ["footprint"]),
        ("mambo-nmpc fly tab", ["table1", "table1-printed"]),
        ("mambo-nmpc init mam", ["mambo", "mambo-1norm"]),
        ("mambo-nmpc footprint --board cra", ["crazyflie"]),
        ("mambo-nmpc sweep --board al", []),
        ("mambo-nmpc fly --on rp", ["rp2040"]),
    ],
)
def test_the_shell_completes_commands_presets_and_boards(
    line: str, expected: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What bash asks for after the tab key; `all` is no board of sweep and fly."""
    words = {"COMP_WORDS": line, "COMP_CWORD": str(len(line.split()) - 1)}
    for name, value in (words | {"_MAMBO_NMPC_COMPLETE": "complete_bash"}).items():
        monkeypatch.setenv(name, value)
    done = command(script=f"import sys; sys.argv[0] = 'mambo-nmpc'; {MAIN}")
    assert done.stdout.split() == expected, done.stderr


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


def test_ctrl_c_while_the_command_starts_exits_130(tmp_path: Path) -> None:
    """A signal in the middle of the imports: no traceback."""
    (tmp_path / "typer.py").write_text(f"{HEARS_CTRL_C}import os\nos.kill(os.getpid(), signal.SIGINT)\n")
    search = os.pathsep.join([str(tmp_path), *sys.path])
    done = subprocess.run(
        [sys.executable, "-m", "mambo_nmpc", "presets"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": search},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (INTERRUPTED, "", "")
