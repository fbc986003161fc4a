"""C samples of the manual and of a bundle's README: one compiler, every kind of settings."""

import re
import subprocess
from pathlib import Path

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.settings import presets
from mambo_codegen.settings.model import Settings
from tests.support.bundles import place
from tests.support.height_settings import height_settings
from tests.support.tools import require

OWN_FIRMWARE = Path(__file__).parents[2] / "docs" / "how-to" / "own-firmware.md"
KINDS = {
    "two axes": presets.preset("mambo"),
    "three axes": height_settings(),
    "1-norm": presets.preset("mambo-1norm"),
    "1-norm without limits": presets.preset("table1"),
}
FLAGS = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off", "-fsyntax-only"]


def first_c(page: str) -> str:
    """Return the first block of C on a page."""
    found = re.search(r'^```c(?: title="[^"]*")?\n(.*?)^```$', page, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


@pytest.mark.first_is_quick
@pytest.mark.parametrize("settings", KINDS.values(), ids=KINDS)
def test_samples_take_every_command_of_the_settings(settings: Settings, tmp_path: Path) -> None:
    """A firmware's call and the ten lines of the README compile; with a height both hand over the thrust."""
    files = render(settings, with_digest=False)
    place({path: text for path, text in files.items() if path.endswith(".h")}, tmp_path)
    angles = "nmpc_real_t roll_rad, nmpc_real_t pitch_rad"
    taken = angles + ", nmpc_real_t thrust_m_s2" * (settings.height is not None)
    given = f'#include "nmpc.h"\nvoid fly_attitude({taken});\nvoid report(nmpc_status_t status);\n'
    place(
        {
            "position.c": first_c(OWN_FIRMWARE.read_text("utf-8")),
            "ten.c": given + first_c(files["README.md"]),
        },
        tmp_path,
    )
    subprocess.run([require("gcc", "gcc"), *FLAGS, "position.c", "ten.c"], cwd=tmp_path, check=True)
