"""Files of version 0.1.0 in this version: what docs/how-to/upgrade.md promises of them.

tests/data/version_0_1 was written by 0.1.0. Of 2026-11-22: its preset mambo as a file (one-norm), the log of
a flight, of which the first second is kept, the commands that a C program of that time printed, a result
folder, a campaign and a record. Of 2026-11-23: preset mambo (quadratic), the commands of another program, a
vehicle, settings derived for it (derived), and their flight. Of each program one command in four is kept, of
the last flight one sample in five: what differs once differs from then on, for the loop is closed.
"""

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.settings import controller_toml, presets
from tests.support.command import run, unwrapped
from tests.support.tools import require

DATA = Path(__file__).parent / "data" / "version_0_1"
PAGE = (Path(__file__).parents[1] / "docs" / "how-to" / "upgrade.md").read_text("utf-8")
CLOSE_RAD = 2e-5
"""What the page says of a quadratic cost."""

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def columns(path: Path, *names: str) -> "np.ndarray[tuple[int, ...], np.dtype[np.float64]]":
    """Return columns of a trace.csv."""
    header = path.read_text("utf-8").splitlines()[0].split(",")
    return np.loadtxt(path, delimiter=",", skiprows=1, usecols=[header.index(name) for name in names])


@pytest.mark.parametrize(
    ("name", "digest"), [("one-norm", "0b8111c251952992"), ("quadratic", "6be943adab3a6f0a")]
)
def test_settings_are_valid_and_the_same(name: str, digest: str) -> None:
    """Their digest is that of 0.1."""
    assert controller_toml.read(DATA / f"{name}.toml").short_digest == digest


def test_the_old_preset_is_what_the_page_says() -> None:
    """A preset of today with another value."""
    named = controller_toml.with_option(presets.preset("mambo-1norm"), "target.acceleration", "none")
    assert named == controller_toml.read(DATA / "one-norm.toml")
    assert '`mambo-1norm` with `target.acceleration = "none"`' in PAGE


def test_a_log_replays() -> None:
    """With a 1-norm bit for bit."""
    require("gcc", "gcc")
    said, _ = run("replay", str(DATA / "one-norm.csv"), str(DATA / "one-norm.toml"))
    assert said.startswith("all 101 commands of the log are those of this controller, bit for bit")


@pytest.mark.parametrize(("name", "most_rad"), [("one-norm", 0.0), ("quadratic", CLOSE_RAD)])
def test_a_c_program_compiles_unchanged_and_gets_the_same_commands(name: str, most_rad: float) -> None:
    """Only the names of the files that it is built from are others."""
    gcc = require("gcc", "gcc")
    run("generate", str(DATA / f"{name}.toml"), "-o", "controller")
    flags = ("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Icontroller")
    subprocess.run([gcc, *flags, str(DATA / f"{name}.c"), "controller/nmpc.c", "-o", "flight"], check=True)
    with Path("flown.txt").open("w") as file:
        subprocess.run(["./flight"], check=True, stdout=file)
    flown_rad, then_rad = np.loadtxt("flown.txt")[::4], np.loadtxt(DATA / f"{name}.txt")
    assert flown_rad.shape == then_rad.shape == (100, 2)
    assert np.abs(flown_rad - then_rad).max() <= most_rad
    assert np.ptp(then_rad, axis=0).min() > 0.1


def test_a_vehicle_flies_its_settings_as_then() -> None:
    """Through its sensors: the same files, the same flight."""
    drone = ("--vehicle", str(DATA / "vehicle.toml"), "--sensors", "mocap", "--yaw-rad", "0.8")
    run("fly", str(DATA / "derived.toml"), *drone, "--duration-s", "3", "--no-pictures", "-o", "flown")
    names = ("x_m", "y_m", "roll_command_rad", "pitch_command_rad")
    now, then = (columns(path, *names) for path in (Path("flown/trace.csv"), DATA / "derived.csv"))
    assert now[::5].shape == then.shape == (61, 4)
    assert np.abs(now[::5] - then).max() < CLOSE_RAD
    assert "differ by less than 2e-5 rad" in PAGE


def test_renamed_keys_of_a_campaign_are_refused_with_the_new_name() -> None:
    """With these it flies as then."""
    rows = {"wind_x_m_s2": "push_x_m_s2", "push_x_n_s": "impulse_x_n_s"}
    _, said = run("campaign", str(DATA / "campaign.toml"), code=2)
    for old, new in rows.items():
        assert f"draws.{old} is called {new} since version 0.2" in unwrapped(said)
    shutil.copy(DATA / "one-norm.toml", "one-norm.toml")
    text = re.sub("|".join(rows), lambda old: rows[old[0]], (DATA / "campaign.toml").read_text("utf-8"))
    Path("campaign.toml").write_text(text, "utf-8")
    worst = json.loads(run("campaign", "campaign.toml", "--flights", "1", "--json")[0])["worst"]
    then = [line.split(",") for line in (DATA / "campaign" / "flights.csv").read_text("utf-8").splitlines()]
    (recorded,) = (float(value) for name, value in zip(*then, strict=True) if name == "mambo_iae_m_s")
    assert worst["one-norm"][0]["iae_m_s"] == pytest.approx(recorded, rel=1e-5)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("campaign", "--flights", "1", "-o", "campaign"), "holds a campaign of mambo-nmpc 0.1.0, which "),
        (("fly", "--repeat", "record.json"), "is a record of another version of mambo-nmpc; repeat it"),
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
    ("old", "hint", "row"),
    [
        ("fly --replay x.json", "--repeat", ""),
        ("fly --wind 0.5,0", "--push X,Y", ""),
        ("fly --engine numpy", "--engine", "| `--engine numpy` | "),
        ("footprint --board all", "all is neither a board nor a file", "| `footprint --board all`, "),
        ("same-bits --boards all", "--board", ", `same-bits --boards all` | "),
        ("generate mambo --amalgamate -o c", "--amalgamate", "| `generate --amalgamate` | "),
        ("sweep --prediction 5:30:5", "--prediction", "| `sweep --prediction 5:30:5 "),
        ("fly mambo-robust", "mambo-1norm", "| `mambo-robust` "),
    ],
)
def test_what_is_no_longer_there_is_refused_and_message_or_page_leads_on(
    old: str, hint: str, row: str
) -> None:
    """A row stands in the page where the message names nothing new."""
    _, said = run(*old.split(), code=2)
    assert hint in unwrapped(said)
    assert row in PAGE
