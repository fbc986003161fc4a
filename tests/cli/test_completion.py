"""Completion in the shell: commands, presets and boards."""

import os
import subprocess
import sys
from pathlib import Path

import pytest


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
    line: str, expected: list[str], tmp_path: Path
) -> None:
    """What bash asks for after the tab key; `all` is no board of sweep and fly."""
    asked = {"COMP_WORDS": line, "COMP_CWORD": str(len(line.split()) - 1)}
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys; sys.argv[0] = 'mambo-nmpc'; from mambo_sil.cli.app import main; main()",
        ],
        cwd=tmp_path,
        env=os.environ | asked | {"_MAMBO_NMPC_COMPLETE": "complete_bash"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.split() == expected, done.stderr
