"""Who deletes an extension's folders and its entry points has a product whose tests pass."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Final

import pytest

from mambo_codegen import __version__, extensions
from mambo_sil.cli.app import panels
from tests.support.tools import require

ROOT: Final = Path(__file__).parents[1]
EXTENSIONS: Final = ("crazyflie", "fmu", "mavlink", "pil", "plan", "playground", "px4", "tune")
ROOTS: Final = ("codegen", "sil", "templates")
TESTED: Final = (
    *("tests/test_house.py", "tests/api/test_api.py", "tests/report/test_report.py"),
    *("tests/cli/test_start.py", "tests/cli/test_design.py", "tests/cli/test_refusals.py"),
    *("tests/codegen/test_targets.py", "tests/codegen/test_sbom.py", "tests/codegen/test_plain_file.py"),
    *("tests/experiment/campaign/test_campaign.py", "tests/targets/test_mambo.py"),
)
"""Tests of the core that speak of what extensions give."""
MORE: Final = (
    "tests/test_made_up_member.py",
    "tests/test_options.py",
    "tests/cli",
    "tests/life",
    "tests/model",
)
"""What is tested too without all of them."""
OF_PAGES: Final = ("tests/codegen/test_targets.py::test_the_manual_has_a_page_for_every_target",)
"""Tests of pages: these speak of all extensions."""
LINT: Final = "from importlinter.cli import lint_imports; raise SystemExit(lint_imports(no_cache=True))"
FOLDERS: Final = (
    "sil/mambo_extensions/{}",
    "templates/mambo_templates/{}",
    "templates/mambo_templates/firmware/{}",
    "tests/extensions/{}",
)


def folders_of(extension: str) -> list[Path]:
    """Return the folders of an extension, relative to that of the project."""
    found = (Path(one.format(extension)) for one in FOLDERS)
    return [one for one in found if (ROOT / one).is_dir()]


def without(deleted: tuple[str, ...], folder: Path) -> dict[str, str]:
    """Copy the tracked files, delete extensions, and return an environment with the rest installed."""
    git = (require("git", "git"), "ls-files", "-z")
    listed = subprocess.run(git, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    gone = tuple(f"{one}/" for name in deleted for one in folders_of(name))
    for path in filter(None, listed.split("\0")):
        if not path.startswith(gone) and (ROOT / path).is_file():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / path, folder / path)
    settings = folder / "pyproject.toml"
    line = rf'(?m)^[\w-]+ = "mambo_extensions\.(?:{"|".join(deleted)})\..*\n'
    settings.write_text(re.sub(line, "", settings.read_text("utf-8")), "utf-8")
    install(folder)
    path = os.pathsep.join(str(folder / one) for one in (*ROOTS, ""))
    return {"PYTHONPATH": path, "CI": ""}


def install(folder: Path) -> None:
    """Write the metadata of the project in a folder, as an editable install does."""
    points = tomllib.loads((folder / "pyproject.toml").read_text("utf-8"))["project"]["entry-points"]
    made = folder / ROOTS[0] / f"mambo_nmpc-{__version__}.dist-info"
    made.mkdir()
    head = f"Metadata-Version: 2.1\nName: mambo-nmpc\nVersion: {__version__}\n"
    (made / "METADATA").write_text(head, "utf-8")
    text = "".join(
        f"[{group}]\n" + "".join(f"{name} = {place}\n" for name, place in entries.items())
        for group, entries in points.items()
    )
    (made / "entry_points.txt").write_text(text, "utf-8")


def run(*command: str, folder: Path, environment: dict[str, str]) -> str:
    """Run Python in a folder; return what it says, and show it if it fails."""
    done = subprocess.run(
        [sys.executable, *command],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]
    return done.stdout


def test_every_extension_has_folders_and_is_joined() -> None:
    """A folder of Python, one of tests, and an entry point that leads to it."""
    folders = {path.name for path in (ROOT / "sil" / "mambo_extensions").iterdir() if path.is_dir()}
    assert folders - {"__pycache__"} == set(EXTENSIONS)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    places = [place for entries in project["entry-points"].values() for place in entries.values()]
    assert {place.split(".")[1] for place in places} == set(EXTENSIONS)
    for name in EXTENSIONS:
        assert Path("tests/extensions", name) in folders_of(name)


def test_the_installed_metadata_are_those_of_the_sources() -> None:
    """All entry points are there and can be loaded; else: python -m pip install -e ."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    for group, entries in project["entry-points"].items():
        own = group.removeprefix("mambo_nmpc.")
        assert set(entries) <= set(extensions.names(own)), f"{group}: {extensions.AGAIN}"
        assert None not in extensions.load_all(own).values()
    assert "plan" in panels()["Fly"]


def test_what_no_extension_gives_is_refused_with_what_to_do() -> None:
    """By its group and name."""
    with pytest.raises(
        extensions.MissingExtensionError, match=r"no installed extension gives dance .*pip inst"
    ):
        extensions.load("commands", "dance")


@pytest.mark.long
@pytest.mark.parametrize(
    "deleted",
    [
        ("crazyflie",),
        *(pytest.param((one,), marks=pytest.mark.thorough) for one in EXTENSIONS[1:]),
        pytest.param(EXTENSIONS, marks=pytest.mark.thorough),
    ],
    ids="-".join,
)
def test_without_an_extension_the_tests_of_the_core_pass(deleted: tuple[str, ...], tmp_path: Path) -> None:
    """The contracts of imports too; no test of the rest wants what is not there."""
    require("gcc", "gcc")
    environment = without(deleted, tmp_path)
    assert not [one for name in deleted for one in folders_of(name) if (tmp_path / one).exists()]
    run("-c", LINT, folder=tmp_path, environment=environment)
    pytest_run = ("pytest", "-q", "-p", "no:cacheprovider", "--no-header")
    everywhere = ("tests", "--ignore=tests/docs", "--ignore=tests/benchmarks", "--collect-only")
    run("-m", *pytest_run, *everywhere, folder=tmp_path, environment=environment)
    left_out = [f"--deselect={one}" for one in OF_PAGES]
    tested = TESTED if len(deleted) == 1 else (*TESTED, *MORE)
    said = run("-m", *pytest_run, *tested, *left_out, folder=tmp_path, environment=environment)
    last = said.splitlines()[-1]
    print(f"without {', '.join(deleted)}: {last}")
    assert re.search(r"\d{2,} passed", last)
    assert "failed" not in last
