"""The mechanism of `generate --for`: one folder a target, protected as every bundle is."""

import json
import re
from pathlib import Path

import pytest

from mambo_codegen.bundle.render import render, render_target
from mambo_codegen.bundle.targets import FirmwareTarget, find_target, target_names
from mambo_codegen.settings import presets
from mambo_codegen.settings.model import Settings
from tests.support.command import run
from tests.support.height_settings import height_settings

LONGEST_PAGE = 110
"""Lines of a README that is one page."""


def settings_of(target: FirmwareTarget) -> Settings:
    """Return the settings of a target's preset, or of a drone whose height is flown."""
    return height_settings() if target.preset is None else presets.preset(target.preset)


@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", [name for name in target_names() if find_target(name).preset])
def test_a_folder_is_made_of_the_preset_of_its_target_and_kept(name: str, tmp_path: Path) -> None:
    """Without a source it has the target's preset; its own controller.toml makes it again; --check agrees."""
    folder = str(tmp_path / "out")
    run("generate", "--for", name, "-o", folder)
    settings = f"{folder}/controller.toml"
    assert presets.load(settings) == settings_of(find_target(name))
    assert run("generate", settings, "--for", name, "-o", folder)[0] == ""
    run("generate", "--for", name, "-o", folder, "--check")
    assert json.loads((tmp_path / "out" / "manifest.json").read_text("utf-8"))["target"] == name


@pytest.mark.first_is_quick
@pytest.mark.parametrize("name", target_names())
def test_the_library_is_that_of_a_bundle_with_every_prefix(name: str) -> None:
    """What a target compiles is what the other tests prove; its own files carry the prefix too."""
    target = find_target(name)
    settings = settings_of(target)
    files, library = (
        render_target(settings, target, with_digest=False),
        render(settings, with_digest=False),
    )
    assert files[f"{target.source_folder}nmpc.h"] == library["nmpc.h"]
    assert files[f"{target.source_folder}nmpc.c"] == target.opening + library["nmpc.c"]
    left = settings.model_copy(update={"code": settings.code.model_copy(update={"prefix": "left"})})
    renamed = render_target(left, target, with_digest=False)
    assert f"{target.source_folder}left.c" in renamed
    assert not [path for path, text in renamed.items() if path != "controller.toml" and "nmpc_step" in text]


@pytest.mark.parametrize("name", target_names())
def test_a_page_says_how_to_build_to_watch_and_to_go_back(name: str) -> None:
    """The README of a target is one page."""
    target = find_target(name)
    text = render_target(settings_of(target), target, with_digest=False)["README.md"]
    assert len(text.splitlines()) <= LONGEST_PAGE
    for heading in ("Build", "Watch", "Go back"):
        assert f"**{heading}.**" in text
    assert f"--for {name}" in text


def test_the_manual_has_a_page_for_every_target() -> None:
    """docs/how-to/firmware.md: a row with the preset, which links to a page with the command."""
    folder = Path(__file__).parents[2] / "docs" / "how-to"
    manual = (folder / "firmware.md").read_text("utf-8")
    assert set(re.findall(r"^\| \[`(\w+)`\]", manual, re.MULTILINE)) == set(target_names())
    for name in target_names():
        target = find_target(name)
        preset = f"`{target.preset}`" if target.preset else "-"
        row = re.search(rf"^\| \[`{name}`\]\(([\w.]+)[^)]*\) \|.*\| {preset} \|", manual, re.MULTILINE)
        assert row
        page = (folder / row[1]).read_text("utf-8")
        assert re.search(rf"mambo-nmpc generate (?:controller\.toml )?--for {name} -o ", page)


@pytest.mark.parametrize(
    ("first", "then", "message"),
    [
        (["--for", "espidf"], [], "is for target espidf; add --for espidf"),
        (["--for", "espidf"], ["--for", "platformio"], "is for target espidf; add --for espidf"),
        ([], ["--for", "espidf"], "is an ordinary bundle; leave out --for"),
    ],
)
def test_a_folder_of_another_target_is_replaced_only_by_force(
    first: list[str], then: list[str], message: str, tmp_path: Path
) -> None:
    """A forgotten --for would remove every file."""
    folder = str(tmp_path / "out")
    run("generate", *first, "-o", folder)
    assert message in run("generate", *then, "-o", folder, code=2)[1]
    run("generate", *then, "-o", folder, "--force")
    run("generate", *then, "-o", folder, "--check")


def test_unknown_targets_and_contradictions_are_refused(tmp_path: Path) -> None:
    """With a guess, and with the targets that there are."""
    said = run("generate", "--for", "espid", "-o", str(tmp_path), code=2)[1]
    assert said.startswith("--for espid is not a target (did you mean espidf?); targets are ")
    assert all(name in said for name in target_names())
    assert not list(tmp_path.iterdir())
