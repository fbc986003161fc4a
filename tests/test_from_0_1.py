"""Files of version 0.1.0 in this version: what docs/how-to/from-0.1-to-0.2.md promises of them.

tests/data/version_0_1 was written by 0.1.0: settings of its preset mambo, a flight's trace.csv and summary,
a campaign and a record of it, and the commands that a C program of that time printed with that C.
"""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from mambo_codegen.settings import controller_toml, presets
from tests.support.command import run, unwrapped
from tests.support.tools import require

DATA = Path(__file__).parent / "data" / "version_0_1"
PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "from-0.1-to-0.2.md"
SETTINGS = str(DATA / "controller.toml")

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def test_settings_are_valid_and_those_of_the_page() -> None:
    """Their digest is that of 0.1, and the preset that the page names is the same controller."""
    settings = controller_toml.read(DATA / "controller.toml")
    assert settings.short_digest == "0b8111c251952992"
    named = controller_toml.with_option(presets.preset("mambo-1norm"), "target.acceleration", "none")
    assert named.digest == settings.digest
    assert '`mambo-1norm` with `target.acceleration = "none"`' in PAGE.read_text("utf-8")


def test_a_log_replays_bit_for_bit() -> None:
    """The C of this version gives the commands of 0.1."""
    require("gcc", "gcc")
    said, _ = run("replay", str(DATA / "trace.csv"), SETTINGS)
    assert said.startswith("all 301 commands of the log are those of this controller, bit for bit")


def test_a_c_program_compiles_unchanged_and_gets_the_same_commands() -> None:
    """Only the names of the files that it is built from are others."""
    gcc = require("gcc", "gcc")
    run("generate", SETTINGS, "-o", "controller")
    flags = ("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Icontroller")
    subprocess.run([gcc, *flags, str(DATA / "flight.c"), "controller/nmpc.c", "-o", "flight"], check=True)
    flown = subprocess.run(["./flight"], check=True, capture_output=True, text=True).stdout
    assert flown == (DATA / "commands.txt").read_text("utf-8")
    assert len(set(flown.splitlines())) > 100


def test_renamed_keys_of_a_campaign_are_refused_with_the_new_name() -> None:
    """Those of the table; with the new names it flies."""
    rows = dict(re.findall(r"\| `([a-z_0-9]+)`, .*? \| `(\w+)`, ", PAGE.read_text("utf-8")))
    assert rows == {"wind_x_m_s2": "push_x_m_s2", "push_x_n_s": "impulse_x_n_s"}
    _, said = run("campaign", str(DATA / "campaign.toml"), code=2)
    for old, new in rows.items():
        assert f"draws.{old} is called {new} since version 0.2" in unwrapped(said)
    shutil.copy(SETTINGS, "controller.toml")
    text = (DATA / "campaign.toml").read_text("utf-8")
    text = re.sub("|".join(rows), lambda old: rows[old[0]], text)
    Path("campaign.toml").write_text(text, "utf-8")
    said = run("campaign", "campaign.toml", "--flights", "1", "--json")[0]
    worst = json.loads(said)["worst"]["controller"][0]
    assert f"{worst['iae_m_s']:.4g}" == "0.7242"


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (
            ("campaign", "--flights", "1", "-o", "campaign"),
            "holds a campaign of mambo-nmpc 0.1.0, which ",
        ),
        (
            ("fly", "--repeat", "record.json"),
            "is a record of another version of mambo-nmpc; repeat it",
        ),
        (("report", "fly"), "is not what fly writes: Field required; run fly again"),
    ],
    ids=["campaign", "record", "report"],
)
def test_results_are_refused_in_one_sentence(words: tuple[str, ...], reason: str) -> None:
    """And stay as they are."""
    shutil.copytree(DATA, ".", dirs_exist_ok=True)
    _, said = run(*words, code=2)
    assert reason in unwrapped(said)
    assert len(said.splitlines()) == 1
    for path in DATA.rglob("*.*"):
        assert (Path.cwd() / path.relative_to(DATA)).read_bytes() == path.read_bytes()


@pytest.mark.parametrize(
    ("old", "hint"),
    [
        ("fly --replay x.json", "--repeat"),
        ("fly --wind 0.5,0", "--push X,Y"),
        ("footprint --board all", "all is neither a board nor a file"),
        ("same-bits --boards all", "--board"),
        ("generate mambo --amalgamate -o c", "--amalgamate"),
        ("sweep --prediction 5:30:5", "--prediction"),
        ("fly mambo-robust", "mambo-1norm"),
    ],
)
def test_old_options_are_refused_and_stand_in_the_page(old: str, hint: str) -> None:
    """The message leads on, and the page has the row."""
    _, said = run(*old.split(), code=2)
    assert hint in unwrapped(said)
    option = next((word for word in old.split() if word.startswith("--")), "mambo-robust")
    assert f"{option} " in PAGE.read_text("utf-8") or f"{option}`" in PAGE.read_text("utf-8")
