"""The commands that generate: what they print where, what they write, in place too, and how they fail."""

import hashlib
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest

from mambo_codegen import errors
from mambo_codegen.settings import controller_toml, presets
from mambo_codegen.settings.controller_toml import parse
from mambo_codegen.settings.toml_file import PRESETS
from tests.support.command import MAIN, command, run, unwrapped

INTERRUPTED = """
from mambo_sil.cli import command
app = command.root()
@app.command()
def stop(): raise KeyboardInterrupt
@app.command()
def other(): pass
app()
"""


def run_limited(*arguments: str) -> None:
    """Run the command where no file may have more than 1 kB, and demand a message of one line."""
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))"
    result = command(*arguments, script=f"{limit}; {MAIN}")
    assert (result.returncode, result.stderr.count("\n")) == (2, 1), result.stderr
    assert "cannot be written: File too large" in result.stderr


def test_init_writes_the_commented_settings_of_a_preset() -> None:
    """The file that init writes reads back as the preset, mambo if none is named."""
    run("init")
    run("init", "table1", "-o", "paper.toml")
    assert presets.load("controller.toml") == presets.preset("mambo")
    assert presets.load("paper.toml") == presets.preset("table1")


def test_init_overwrites_only_by_force() -> None:
    """A controller.toml somebody worked on stays until --force."""
    Path("controller.toml").write_text("mine", encoding="utf-8")
    _, talk = run("init", code=2)
    assert talk == "controller.toml: already exists; name another with -o, or overwrite it with --force\n"
    assert Path("controller.toml").read_text(encoding="utf-8") == "mine"
    run("init", "--force")
    assert presets.load("controller.toml") == presets.preset("mambo")


def test_init_to_stdout_prints_the_file_alone() -> None:
    """With -o - the settings are the whole of stdout."""
    text, talk = run("init", "-o", "-")
    assert controller_toml.parse(text, "stdout") == presets.preset("mambo")
    assert talk == ""
    assert not Path("controller.toml").exists()


def test_init_makes_the_folder_of_its_file() -> None:
    """A folder that is not there is made, as generate makes it."""
    run("init", "-o", "made/too/controller.toml")
    assert [path.name for path in Path("made/too").iterdir()] == ["controller.toml"]


@pytest.mark.first_is_quick
@pytest.mark.parametrize("force", [[], ["--force"]])
def test_init_that_fails_leaves_everything_as_it_was(force: list[str]) -> None:
    """No half file, no folder made for it, and the old file whole; what is no file is not replaced."""
    Path("file").touch()
    talk = run("init", "-o", "file/controller.toml", *force, code=2)[1]
    assert talk == "file/controller.toml: cannot be written: Not a directory\n"
    Path("folder").mkdir()
    assert "folder: is a folder, not a file" in run("init", "-o", "folder", *force, code=2)[1]
    Path("controller.toml").write_text("mine", encoding="utf-8")
    run_limited("init", "-o", "new/controller.toml", *force)
    run_limited("init", "-o", "controller.toml", "--force")
    assert Path("controller.toml").read_text(encoding="utf-8") == "mine"
    assert sorted(path.name for path in Path().iterdir()) == ["controller.toml", "file", "folder"]


def test_init_writes_where_a_link_leads() -> None:
    """Settings kept elsewhere and linked to stay linked to."""
    Path("kept.toml").touch()
    Path("controller.toml").symlink_to("kept.toml")
    run("init", "--force")
    assert Path("controller.toml").is_symlink()
    assert presets.load("kept.toml") == presets.preset("mambo")


def test_presets_lists_every_preset_with_its_use() -> None:
    """People get name and description of each, machines a JSON object."""
    described = {name: PRESETS.description(name) for name in presets.names()}
    listed = " ".join(f"{name} {description}" for name, description in described.items())
    assert unwrapped(run("presets")[0]) == listed
    assert json.loads(run("presets", "--json")[0]) == described


def test_schema_prints_the_json_schema() -> None:
    """What schema prints is a JSON schema that every preset fits."""
    schema = json.loads(run("schema")[0])
    for name in presets.names():
        jsonschema.validate(presets.preset(name).model_dump(), schema)


def test_generate_reports_what_it_did() -> None:
    """The first run creates; a second, from the bundle's own controller.toml, finds nothing to do."""
    created, talk = run("generate", "-o", "out")
    assert "created nmpc.c\n" in created
    assert talk == f"out: written, settings {presets.preset('mambo').short_digest}\n"
    assert {line.split()[1] for line in created.splitlines()} == {
        path.relative_to("out").as_posix() for path in Path("out").rglob("*") if path.is_file()
    }
    assert run("generate", "out/controller.toml", "-o", "out")[0] == ""


def test_generate_as_json_tells_digest_and_files() -> None:
    """Machines get the outcome of a run, dry or not, as one JSON object."""
    dry = json.loads(run("generate", "-o", "out", "--dry-run", "--json")[0])
    assert not Path("out").exists()
    real = json.loads(run("generate", "-o", "out", "--json")[0])
    assert (dry.pop("dry_run"), real.pop("dry_run")) == (True, False)
    assert dry == real
    assert real["digest"] == presets.preset("mambo").digest
    assert "manifest.json" in real["created"]


def test_check_passes_on_an_up_to_date_folder() -> None:
    """No output and exit code 0 where nothing drifted."""
    run("generate", "table1", "-o", "out")
    assert run("generate", "table1", "-o", "out", "--check") == ("", "out: up to date\n")


def test_check_shows_drift_and_exits_1() -> None:
    """A changed file is shown as a diff, to machines as JSON, and stays as it is."""
    run("generate", "-o", "out")
    source = Path("out/nmpc.c")
    source.write_text(source.read_text(encoding="utf-8") + "/* by hand */\n", encoding="utf-8")
    diff, talk = run("generate", "-o", "out", "--check", code=1)
    assert "--- nmpc.c (on disk)\n+++ nmpc.c (generated)\n" in diff
    assert "\n-/* by hand */\n" in diff
    assert talk.startswith("out: not up to date")
    (drift,) = json.loads(run("generate", "-o", "out", "--check", "--json", code=1)[0])["drifts"]
    assert (drift["path"], drift["kind"]) == ("nmpc.c", "changed")
    assert "by hand" in source.read_text(encoding="utf-8")


def test_generate_keeps_edited_files_until_forced() -> None:
    """An edited file is named and kept; --force takes it back."""
    run("generate", "-o", "out")
    Path("out/Makefile").write_text("mine", encoding="utf-8")
    assert "Makefile (edited by hand)" in run("generate", "-o", "out", code=2)[1]
    assert run("generate", "-o", "out", "--force")[0] == "changed Makefile\n"


@pytest.mark.long
def test_letters_that_the_terminal_has_not_are_shown_by_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """An edit in another script, on a terminal of another: the diff is shown, not a traceback."""
    run("generate", "-o", "out")
    with Path("out/README.md").open("a", encoding="utf-8") as file:
        file.write("\N{EURO SIGN}\n")
    monkeypatch.setenv("PYTHONIOENCODING", "latin-1")
    result = command("generate", "-o", "out", "--check")
    assert result.returncode == 1, result.stderr
    assert "\n-\\u20ac\n" in result.stdout


def test_name_of_a_removed_file_moves_no_cursor() -> None:
    """A manifest may have come from elsewhere, with any names in it."""
    name = "a\x1b[31m\udcffb"
    run("generate", "-o", "out")
    Path("out", name).write_bytes(b"")
    listed = json.loads(Path("out/manifest.json").read_text("utf-8"))
    listed["files"][name] = hashlib.sha256(b"").hexdigest()
    Path("out/manifest.json").write_text(json.dumps(listed), "utf-8")
    assert run("generate", "-o", "out")[0] == "changed manifest.json\nremoved a\\x1b[31m\\udcffb\n"


def test_check_refuses_options_that_write() -> None:
    """--check with --force would promise what it does not do."""
    assert "--check" in run("generate", "-o", "out", "--check", "--force", code=2)[1]


@pytest.mark.parametrize("prefix", ["roll", "nmpc_left", "left_nmpc"])
def test_options_override_the_settings_and_the_bundle_remembers(prefix: str) -> None:
    """--prefix and --scalar end up in the bundle's controller.toml, which generates the same bundle."""
    run("generate", "-o", "out", "--prefix", prefix, "--scalar", "float64")
    written = presets.load("out/controller.toml")
    assert (written.code.prefix, written.code.scalar) == (prefix, "float64")
    assert written.cost == presets.preset("mambo").cost
    assert Path(f"out/{prefix}.h").is_file()
    run("generate", "out/controller.toml", "-o", "out", "--check")


def test_a_folder_of_an_earlier_bundle_keeps_what_was_edited() -> None:
    """Sources that the bundle no longer has are removed; those that the user edited stay and are named."""
    run("generate", "-o", "out")
    manifest = Path("out/manifest.json")
    listed = json.loads(manifest.read_text("utf-8"))
    for name, text in (("nmpc_math.c", "old"), ("nmpc_cost.c", "edited")):
        Path("out/src").mkdir(exist_ok=True)
        Path("out/src", name).write_text(text, "utf-8")
        listed["files"][f"src/{name}"] = hashlib.sha256(b"old").hexdigest()
    manifest.write_text(json.dumps(listed), "utf-8")
    said = run("generate", "-o", "out")[0]
    assert "removed src/nmpc_math.c" in said
    assert "kept src/nmpc_cost.c: edited by hand, and no longer part of the bundle" in said
    assert [path.name for path in Path("out/src").iterdir()] == ["nmpc_cost.c"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--prefix", "int"], '--prefix: code.prefix = "int" must not be a keyword'),
        (["--scalar", "float16"], '--scalar: code.scalar = "float16" must be "float32" or "float64"'),
        (["nope"], "nope is neither a preset nor a file"),
        (["slow.toml"], "slow.toml: horizon.control = 11 must lie in 1..10 (horizon.prediction)"),
    ],
)
def test_bad_input_gets_a_message_and_exit_code_2(arguments: list[str], message: str) -> None:
    """What the user got wrong is said on stderr without a traceback, and nothing is written."""
    Path("slow.toml").write_text("horizon.control = 11", encoding="utf-8")
    results, talk = run("generate", "-o", "out", *arguments, code=2)
    assert results == ""
    assert talk.startswith(message)
    assert "Traceback" not in talk
    assert not Path("out").exists()


def test_debug_shows_the_traceback() -> None:
    """With --debug an error arrives whole."""
    result = command("--debug", "generate", "nope", "-o", "out")
    assert "Traceback" in result.stderr
    assert "SourceNotFoundError: nope is neither" in result.stderr


@pytest.mark.first_is_quick
@pytest.mark.parametrize("arguments", ["schema", "--help", "generate --help", "--version", ""])
def test_output_that_nobody_reads_ends_quietly(arguments: str) -> None:
    """A closed pipe (| head) ends the command as the signal would, without a traceback, help included."""
    reader, writer = os.pipe()
    os.close(reader)
    line = [sys.executable, "-c", MAIN, *arguments.split()]
    with os.fdopen(writer, "wb") as closed:
        result = subprocess.run(line, stdout=closed, stderr=subprocess.PIPE, check=False)
    assert (result.returncode, result.stderr) == (errors.NO_READER, b"")


@pytest.mark.first_is_quick
@pytest.mark.parametrize("arguments", [["schema"], ["--help"], ["generate", "-o", "out", "--json"]])
def test_stdout_that_takes_nothing_gets_a_message(arguments: list[str]) -> None:
    """A full disk or a closed stdout is said in one line, without a traceback."""
    line = shlex.join([sys.executable, "-c", MAIN, *arguments])
    for redirection, reason in ((">/dev/full", "No space left on device"), (">&-", "is closed")):
        result = subprocess.run(
            f"{line} {redirection}", shell=True, capture_output=True, text=True, check=False
        )
        assert result.returncode == 2, result.stderr
        assert result.stderr.endswith(f": {reason}\n")
        assert result.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("error", "message"),
    [
        ("MemoryError", "out of memory\n"),
        ("OSError(28, 'No space left on device', 'trace.csv')", "trace.csv: No space left on device\n"),
    ],
)
def test_what_the_system_refuses_gets_a_message(error: str, message: str) -> None:
    """An error that no command expects is one line, with --debug a traceback too."""
    script = INTERRUPTED.replace("KeyboardInterrupt", error)
    for debug in ([], ["--debug"]):
        result = command(*debug, "stop", script=script)
        assert result.returncode == 2
        assert result.stderr.endswith(message)
        assert (result.stderr == message) is not bool(debug)


def test_root_help_names_the_exit_codes() -> None:
    """Whoever writes a script finds them without the source."""
    text = run("--help")[0]
    assert all(str(number) in text for number in (errors.BAD_INPUT, errors.INTERRUPTED, errors.NO_READER))


def test_ctrl_c_exits_130() -> None:
    """An interrupted command says so by its exit code, without a traceback."""
    result = command("stop", script=INTERRUPTED)
    assert (result.returncode, result.stderr) == (errors.INTERRUPTED, "")


@pytest.mark.parametrize("name", ["init", "presets", "schema", "generate"])
def test_help_teaches_by_example(name: str) -> None:
    """Every command explains itself, and those with options show examples."""
    text = run(name, "--help")[0]
    assert name == "presets" or f"mambo-nmpc {name}" in text
    assert "\x1b" not in text


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
