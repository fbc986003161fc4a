"""Every sentence that the Crazyflie's app prints has a row in the page for when something is wrong."""

import re
from pathlib import Path

from mambo_codegen.bundle.render import render_target
from mambo_codegen.bundle.targets import find_target
from mambo_codegen.settings.controller_toml import with_option
from mambo_sil.drone.vehicles import vehicle_toml
from tests.support.derived import settings_for

PAGE = Path(__file__).parents[2] / "docs/how-to/troubleshooting.md"
PRINTED = re.compile(r'(?:nmpc_app_say|DEBUG_PRINT)\((?:[^"();]*\? )?"([^"]+)"(?: : "([^"]+)")?')
FORMAT_ALONE = "%s\\n"


def sentences() -> set[str]:
    """Return what the apps for cameras and for a flow deck print; a number is shown as `...`."""
    cameras = settings_for(vehicle_toml.preset("crazyflie"), exact=True)
    flow = with_option(cameras, "observer.position_noise", 0.04)
    found: set[str] = set()
    for settings in (cameras, flow):
        for text in render_target(settings, find_target("crazyflie"), with_digest=False).values():
            for printed in PRINTED.findall(text):
                found |= {one for one in printed if one and one != FORMAT_ALONE}
    return {one.removesuffix("\\n").replace("%d", "...") for one in found}


def test_each_sentence_of_the_console_has_a_row() -> None:
    """And each row is a sentence that the app prints."""
    rows = set(re.findall(r"^\| `([^`]+)` \|", PAGE.read_text("utf-8"), re.MULTILINE))
    printed = sentences()
    assert len(printed) >= 13
    assert printed <= rows
    console = PAGE.read_text("utf-8").partition("## What the Crazyflie's console says")[2]
    assert set(re.findall(r"^\| `([^`]+)` \|", console, re.MULTILINE)) == printed
