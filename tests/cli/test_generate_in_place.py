"""`generate controller.toml -o .` in a generated folder, whatever the user made of its controller.toml."""

import json
from pathlib import Path

import pytest

from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import parse
from tests.support.command import run

SOURCE = Path("controller.toml")
IN_PLACE = ("generate", "controller.toml", "-o", ".")


def spelled_anew(text: str) -> bytes:
    """Return a controller.toml with another order of sections, comments, numbers, line ends, and a BOM."""
    head, *sections = text.split("\n[")
    again = "\n[".join([head, *reversed(sections)])
    lines = [line for line in again.splitlines() if not line.startswith("#")]
    spelled = "\n".join(lines).replace("= 0.", "=   +0.") + "\n# calm enough\n"
    return spelled.replace("\n", "\r\n").encode("utf-8-sig")


def test_settings_of_any_spelling_stay_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """A change of spelling changes no file; the C of other settings is written; --check agrees each time."""
    run("generate", "--for", "mambo", "-o", "app")
    monkeypatch.chdir("app")
    respelled = spelled_anew(SOURCE.read_text("utf-8"))
    assert parse(respelled.decode("utf-8-sig"), "respelled") == presets.preset("mambo")
    SOURCE.write_bytes(respelled)
    for _ in range(2):
        assert run(*IN_PLACE, "--for", "mambo")[0] == ""
        assert run(*IN_PLACE, "--for", "mambo", "--check")[1] == ".: up to date\n"
    assert SOURCE.read_bytes() == respelled
    changed = respelled.replace(b"speed_m_s = 5.0", b"speed_m_s = 4.0")
    assert changed != respelled
    SOURCE.write_bytes(changed)
    assert "-#define NMPC_SPEED" in run(*IN_PLACE, "--for", "mambo", "--check", code=1)[0]
    said = run(*IN_PLACE, "--for", "mambo")[0].splitlines()
    assert {"changed src/nmpc.c", "changed manifest.json"} <= set(said)
    assert "changed controller.toml" not in said
    assert run(*IN_PLACE, "--for", "mambo", "--force")[0] == ""
    assert run(*IN_PLACE, "--for", "mambo", "--check")[1] == ".: up to date\n"
    assert SOURCE.read_bytes() == changed


@pytest.mark.parametrize("source", ["app/controller.toml", "linked.toml"])
def test_the_source_is_known_by_any_path(source: str) -> None:
    """From outside the folder, by a link, and where the folder holds nothing but the source."""
    Path("app").mkdir()
    Path("linked.toml").symlink_to("app/controller.toml")
    Path("app/controller.toml").write_bytes(b"[limits]\ntilt_rad=0.3 # mine\n")
    assert "created controller.toml" not in run("generate", source, "-o", "app")[0]
    assert Path("app/controller.toml").read_bytes() == b"[limits]\ntilt_rad=0.3 # mine\n"
    assert run("generate", source, "-o", "app", "--check") == ("", "app: up to date\n")


def test_a_source_spelled_by_the_user_is_the_users_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other settings, and options that change them, do not replace it; --force does."""
    run("generate", "-o", "app")
    monkeypatch.chdir("app")
    with SOURCE.open("a", encoding="utf-8") as file:
        file.write("# mine\n")
    assert json.loads(run(*IN_PLACE, "--json")[0])["changed"] == []
    for others in (("generate", "table1", "-o", "."), (*IN_PLACE, "--prefix", "left")):
        assert "controller.toml (edited by hand)" in run(*others, code=2)[1]
        assert "\n-# mine" in run(*others, "--check", code=1)[0]
    assert SOURCE.read_text("utf-8").endswith("# mine\n")
    assert "changed controller.toml" in run(*IN_PLACE, "--prefix", "left", "--force")[0]
    assert presets.load(str(SOURCE)).code.prefix == "left"


def test_another_file_edited_by_hand_is_refused_in_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """The source alone is left; what a run would overwrite is still named and kept."""
    run("generate", "-o", "app")
    monkeypatch.chdir("app")
    SOURCE.write_bytes(spelled_anew(SOURCE.read_text("utf-8")))
    Path("Makefile").write_text("mine\n", "utf-8")
    said = run(*IN_PLACE, code=2)[1]
    assert "Makefile (edited by hand)" in said
    assert "controller.toml" not in said
