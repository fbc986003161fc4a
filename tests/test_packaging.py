"""What is installed is mambo_nmpc, all of it, and it works beside folders that have our folders' names."""

import email
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
import trove_classifiers

from hatch_build import described
from mambo_codegen import __version__
from tests.support.tools import require

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
OF_DEVELOPERS = {"docs", "test"}
"""Extras that nobody needs who uses the commands."""
FAMILIES = ("Apache", "BSD", "GPL", "LGPL", "MIT", "Public Domain", "PSF")
ROOTS = ("codegen", "sil", "templates")
BUILD_SDIST = "import sys; from hatchling import build; print(build.build_sdist(sys.argv[1]))"
# Runs each line of stdin as a command; the exit code of this script is that of the first that fails.
MANY_COMMANDS = """
import sys
from mambo_nmpc.__main__ import main
for line in sys.stdin.read().splitlines():
    sys.argv = ["mambo-nmpc", *line.split()]
    try:
        main()
    except SystemExit as leaving:
        if leaving.code:
            sys.exit(f"{line}: exit code {leaving.code}")
"""


def run(*command: str | Path, folder: Path, stdin: str = "", **environment: str) -> str:
    """Run a command in `folder` and return its stdout; a failure shows its stderr."""
    done = subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        input=stdin,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def names_of(requirements: list[str]) -> set[str]:
    """Return the names of packages, without versions."""
    return {re.split(r"[<>=\[]", one)[0] for one in requirements}


def families(text: str) -> set[str]:
    """Return the kinds of licenses that a text names."""
    plain = text.replace("Python Software Foundation", "PSF")
    return {one for one in FAMILIES if re.search(rf"\b{one}", plain, re.IGNORECASE)}


def licence_of(package: str) -> str:
    """Return what the metadata of an installed package say of its license, or else the license itself."""
    found = metadata.metadata(package).json
    said = [str(one) for key in ("license_expression", "license") if (one := found.get(key))]
    said += [one for one in found.get("classifier", ()) if one.startswith("License")]
    said += re.findall(r"(?m)^.*free software license.*$", str(found.get("description")))
    files = [one for one in metadata.files(package) or () if "dist-info" in str(one)]
    texts = (one.read_text() for one in files if "LICENSE" in one.name)
    return "\n".join(said or texts)


def tracked() -> list[str]:
    """Return the paths of all files under version control."""
    return run(require("git", "git"), "ls-files", folder=ROOT).splitlines()


def installed(path: str) -> str:
    """Return where a tracked file of ours stands in site-packages."""
    return path.partition("/")[2]


def files_of(wheel: Path) -> set[str]:
    """Return the files of a wheel, without those that describe it."""
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    return {name for name in names if not re.match(r"mambo_nmpc-[^/]*\.dist-info/", name)}


def environment(folder: Path, *packages: str | Path) -> Path:
    """Return the Python of a new environment that has nothing but `packages`, which no one has compiled."""
    run(sys.executable, "-m", "venv", "--without-pip", folder, folder=folder.parent)
    python = folder / "bin" / "python"
    options = ("-q", "--no-compile", "--disable-pip-version-check")
    run(sys.executable, "-m", "pip", "--python", python, "install", *options, *packages, folder=folder)
    return python


def wheel_of(source: Path, folder: Path) -> Path:
    """Build the wheel of a source folder or archive."""
    run(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", "wheels", source, folder=folder)
    return next((folder / "wheels").glob("*.whl"))


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the tracked files, in which an earlier build left a module that is no more."""
    folder = tmp_path_factory.mktemp("source")
    for path in tracked():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / path, folder / path)
    stale = folder / "build" / "lib" / "mambo_nmpc" / "stale.py"
    stale.parent.mkdir(parents=True)
    stale.write_text("", "utf-8")
    (folder / "sil" / "mambo_nmpc" / "__pycache__").mkdir()
    (folder / "sil" / "mambo_nmpc" / "__pycache__" / "stale.pyc").write_text("", "utf-8")
    return folder


def test_the_license_of_each_dependency_stands_in_the_manual() -> None:
    """As its installed metadata say, and no package that everybody installs is under the GPL."""
    text = (ROOT / "docs" / "reference" / "compatibility.md").read_text("utf-8")
    rows = dict(re.findall(r"(?m)^\| `(\w+)` \| ([^|]*) \|[^|]*\|$", text))
    extras = PROJECT["optional-dependencies"]
    used = [one for name, extra in extras.items() if name not in OF_DEVELOPERS for one in extra]
    always = names_of(PROJECT["dependencies"])
    assert set(rows) == always | names_of(used)
    assert not any("GPL" in rows[package] for package in always)
    checked = always | (names_of(used) & names_of(extras["test"]))
    assert {"numpy", "unicorn"} <= checked
    for package in checked:
        assert families(rows[package]), package
        assert families(rows[package]) <= families(licence_of(package)), package


def test_nobody_is_sent_to_a_name_on_the_index_that_is_not_ours() -> None:
    """Until it is, the project is installed from its folder."""
    wrong = re.compile(r"pip install [^\n`]*mambo-nmpc")
    for path in tracked():
        if path.endswith((".md", ".j2", ".py", ".toml", ".yml")) and path != "tests/test_packaging.py":
            assert not wrong.search((ROOT / path).read_text("utf-8")), path


def test_the_description_holds_on_the_index_too() -> None:
    """Its links lead into the repository, or are left out, pictures too, while nobody knows where that is."""
    readme = (ROOT / "README.md").read_text("utf-8")
    relative = re.compile(r"\]\((?!https?:)[^)]*\)")
    assert relative.search(readme)
    without = described(readme, "")
    assert not relative.search(without)
    assert "![" not in without
    found = described(readme, "https://h.invalid/us/nmpc/")
    assert not relative.search(found)
    links = re.findall(r"\]\(https://h\.invalid/us/nmpc/(blob|raw)/HEAD/([^)#]*)", found)
    assert {kind for kind, _ in links} == {"blob", "raw"}
    assert [path for _, path in links if not (ROOT / path).exists()] == []


def test_the_version_stands_alike_everywhere() -> None:
    """In the citation and at the top of the changelog, a release with the same date in both."""
    citation = dict(
        re.findall(r"(?m)^(version|date-released): (\S+)$", (ROOT / "CITATION.cff").read_text("utf-8"))
    )
    (heading, *_) = re.findall(r"(?m)^## (.*)$", (ROOT / "CHANGELOG.md").read_text("utf-8"))
    assert citation["version"] == __version__
    if ".dev" in __version__:
        assert (heading, "date-released" in citation) == ("[Unreleased]", False)
    else:
        assert heading == f"[{__version__}] - {citation['date-released']}"


def test_the_changelog_names_the_version_of_the_interface() -> None:
    """The newest one that it names is that of the C."""
    named = re.findall(r"`NMPC_INTERFACE_VERSION`(?: is|,) (\d+)", (ROOT / "CHANGELOG.md").read_text("utf-8"))
    header = (ROOT / "generated" / "mambo" / "nmpc.h").read_text("utf-8")
    assert re.search(r"#define NMPC_INTERFACE_VERSION (\d+)", header)[1] == max(named, key=int)  # type: ignore[index]


def test_the_classifiers_are_known_and_let_it_be_uploaded() -> None:
    """An index refuses others."""
    assert set(PROJECT["classifiers"]) <= set(trove_classifiers.classifiers)
    assert not any(one.startswith("Private") for one in PROJECT["classifiers"])


@pytest.mark.long
def test_wheel_and_source_archive_hold_every_tracked_file_and_no_other(source: Path, tmp_path: Path) -> None:
    """A package missing in pyproject.toml, or a file that an earlier build left, changes the list."""
    expected = {installed(path) for path in tracked() if path.startswith(tuple(f"{name}/" for name in ROOTS))}
    assert {"mambo_nmpc/py.typed", "mambo_templates/common/nmpc.c.j2"} <= expected
    wheel = wheel_of(source, tmp_path)
    assert files_of(wheel) == expected
    with zipfile.ZipFile(wheel) as content:
        (name,) = (one for one in content.namelist() if one.endswith("/METADATA"))
        said = email.message_from_bytes(content.read(name))
    assert said["Version"] == __version__
    address = PROJECT.get("urls", {}).get("Repository", "")
    assert said.get_payload() == described((ROOT / "README.md").read_text("utf-8"), address)

    python = environment(tmp_path / "builder", "hatchling>=1.27")
    run(python, "-c", BUILD_SDIST, tmp_path, folder=source)
    (tmp_path / "again").mkdir()
    archive = next(tmp_path.glob("*.tar.gz"))
    assert files_of(wheel_of(archive, tmp_path / "again")) == expected


@pytest.mark.long
def test_the_wheel_generates_and_flies_in_a_clean_environment(source: Path, tmp_path: Path) -> None:
    """Our names alone are added to site-packages, and the bundle equals the committed one."""
    wheel = wheel_of(source, tmp_path)
    binaries = environment(tmp_path / "clean", "-c", ROOT / "constraints.txt", wheel).parent
    packages = next((tmp_path / "clean" / "lib").glob("python*/site-packages"))
    assert not [name for name in ROOTS if (packages / name).exists()]
    command = binaries / "mambo-nmpc"
    run(command, "generate", "mambo", "-o", ROOT / "generated" / "mambo", "--check", folder=tmp_path)
    assert "IAE" in run(command, "fly", "--duration-s", "1", "-o", "flight", folder=tmp_path)


@pytest.mark.long
def test_every_command_works_beside_folders_of_our_names(tmp_path: Path) -> None:
    """A user's own packages codegen, sil and templates, on the search path, change nothing."""
    require("gcc", "gcc")
    for name in ROOTS:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("", "utf-8")
    path = str(tmp_path)
    module = (sys.executable, "-m", "mambo_nmpc")
    assert re.match(r"mambo-nmpc \d", run(*module, "--version", folder=tmp_path, PYTHONPATH=path))
    shown = run(*module, "--help", folder=tmp_path, PYTHONPATH=path, COLUMNS="200")
    commands = re.findall(r"^│ ([a-z][a-z0-9-]*) ", shown, re.MULTILINE)
    assert {"init", "generate", "fly", "doctor", "report"} <= set(commands)
    lines = [f"{command} --help" for command in commands]
    lines += ["presets", "init", "generate controller.toml -o c", "fly --duration-s 1 -o flight", "doctor"]
    run(sys.executable, "-c", MANY_COMMANDS, folder=tmp_path, stdin="\n".join(lines), PYTHONPATH=path)
    assert (tmp_path / "c" / "nmpc.c").is_file()
    assert (tmp_path / "flight" / "trace.csv").is_file()


def test_a_missing_template_is_a_bug_with_a_traceback(tmp_path: Path) -> None:
    """It is a broken installation, not a file that the user could provide."""
    templates = tmp_path / "mambo_templates"
    shutil.copytree(ROOT / "templates" / "mambo_templates", templates)
    (templates / "quadratic" / "observer.h.j2").unlink()
    command = [sys.executable, "-m", "mambo_nmpc", "generate", "-o", "c"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("Traceback")
    assert "TemplateNotFound: " in done.stderr.splitlines()[-1]
    assert "observer.h.j2" in done.stderr.splitlines()[-1]
    assert not (tmp_path / "c").exists()
