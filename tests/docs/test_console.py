"""The tutorials and how-tos, typed in as they stand."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.console import Command, faults, fits, read
from tests.support.tools import require, require_module
from tests.support.warm_command import serve

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted([*DOCS.glob("tutorials/*.md"), *DOCS.glob("how-to/*.md")])
RUN = [page for page in PAGES if read(page).steps]
NAMES = [str(page.relative_to(DOCS)) for page in RUN]
LONG = {
    *(
        f"tutorials/{name}.md"
        for name in ("crazyflie", "first-flight", "lap", "own-drone", "paper", "px4-ardupilot")
    ),
    *(f"how-to/{name}.md" for name in ("campaign", "crazyflie", "design", "footprint", "identify")),
    "how-to/simulators.md",
    *(f"how-to/{name}.md" for name in ("own-firmware", "plan", "regress", "replay", "verify")),
}
"""Pages whose commands take two seconds or more of an idle core."""
ARM = ("arm-none-eabi-gcc", "gcc-arm-none-eabi")
TOOLS = {
    "how-to/footprint.md": [ARM],
    "how-to/pil.md": [ARM],
    "how-to/verify.md": [("cppcheck", "cppcheck"), ("clang", "clang"), ("g++", "g++")],
    "tutorials/own-drone.md": [ARM],
}
"""What the commands of a page need besides bash, make and a C compiler: tool and Debian package."""
NOT_RUN = {
    "how-to/betaflight.md": (
        "it installs, and builds for two minutes",
        "needs the SITL, and a machine with an idle core",
    ),
    "how-to/campaign.md": ("needs a cluster; tests of their own start one",),
    "how-to/design.md": ("it installs",),
    "how-to/footprint.md": ("needs a board, or QEMU with its firmware",),
    "how-to/identify.md": ("needs a Crazyflie",),
    "how-to/libraries.md": ("needs arduino-cli", "needs PlatformIO", "needs ESP-IDF"),
    "how-to/mambo.md": ("needs the toolbox of MathWorks or MIT",),
    "how-to/offboard.md": ("needs a Crazyflie",),
    "how-to/pil.md": (
        "needs a board; tests of their own fly it in QEMU",
        "needs a board; tests of their own fly it in QEMU",
    ),
    "how-to/px4.md": ("needs PX4",) * 3,
    "how-to/release.md": (
        "takes hours where evidence is old",
        "it changes the version",
        "needs the keys of a person, and the packages build and twine",
        "it changes the version",
    ),
    "how-to/simulators.md": ("it installs",) * 5,
    "how-to/verify.md": ("takes minutes; tests of their own run every check",),
    "tutorials/crazyflie.md": (
        "needs a Crazyflie",
        "needs the firmware of Bitcraze, and a Crazyflie",
        "needs a Crazyflie",
    ),
    "tutorials/px4-ardupilot.md": (
        "needs ArduCopter",
        "needs PX4",
        "asks for a passphrase, and needs an autopilot",
    ),
    "tutorials/own-drone.md": ("takes minutes; tests of their own run every check",),
    "tutorials/race.md": (
        "needs the course",
        "needs the course",
        "needs crazyflow; a test of its own runs it",
        "a test of the examples runs it",
    ),
    "tutorials/first-flight.md": ("it makes the environment in which they run",),
}
"""The console blocks that are not run, by page: the reason, which is in the title of the block."""


@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Give the folder of a mambo-nmpc that is imported already."""
    with serve(tmp_path_factory.mktemp("warm")) as binaries:
        yield binaries


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long) if name in LONG else name for name in NAMES]
)
def test_every_command_of_a_page_prints_what_the_page_says(name: str, tmp_path: Path, warm: Path) -> None:
    """In an empty folder, in order, with the files that the page says to save."""
    for tool, package in [("bash", "bash"), ("cc", "gcc"), ("make", "make"), *TOOLS.get(name, [])]:
        require(tool, package)
    if name == "how-to/design.md":
        require_module("optuna")
    if name == "how-to/simulators.md":
        require_module("gymnasium")
        require_module("rotorpy")
    found = faults(read(DOCS / name), tmp_path, warm)
    assert not found, "\n\n".join(found)


def test_only_what_needs_hardware_or_much_time_is_not_run() -> None:
    """All others are."""
    reasons = {str(page.relative_to(DOCS)): read(page).not_run for page in PAGES}
    assert {name: found for name, found in reasons.items() if found} == NOT_RUN


def test_a_wrong_line_of_output_is_found(tmp_path: Path) -> None:
    """And a command that fails; `...` stands for text that may differ."""
    page = tmp_path / "page.md"
    page.write_text(
        '```text title="a.txt"\none\ntwo\n```\n\n```console\n$ cat a.txt\none\n2\n$ cat a.txt\n...\ntwo\n'
        "$ cat b.txt\n$ false\n$ echo $?\n1\n```\n"
    )
    found = faults(read(page), tmp_path)
    assert [fault.partition(":")[0] for fault in found] == ["line 7", "line 13"]
    assert read(page).steps[1] == Command(7, "cat a.txt", ("one", "2"))
    assert fits(("a ... c", "..."), "a b c")
    assert not fits(("a ... c",), "a b c\nd")
