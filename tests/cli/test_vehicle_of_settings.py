"""Settings that name the drone they are for: commands fly it, and another only by --vehicle."""

import json
from pathlib import Path

import pytest

from mambo_codegen.bundle.render import render
from mambo_codegen.errors import InvalidSettingsError
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.presets import load
from mambo_codegen.settings.toml_file import PRESETS
from mambo_sil.drone.vehicles import VEHICLES, vehicle_toml
from tests.support.command import run

SUITE = '[flight]\nduration_s = 2.0\n[flights.calm]\ntrajectory = "hover"\n'


def write_settings(vehicle: str) -> Path:
    """Write preset mambo for a drone of 80 g into the folder `made`; its file is beside the folder."""
    text = VEHICLES.text("generic").splitlines()
    Path("light.toml").write_text(
        "\n".join("mass_kg = 0.08" if line.startswith("mass_kg") else line for line in text), "utf-8"
    )
    Path("made").mkdir(exist_ok=True)
    path = Path("made", "controller.toml")
    path.write_text(f"vehicle = {json.dumps(vehicle)}\n{PRESETS.text('mambo')}", "utf-8")
    return path


def flown(*words: str) -> str:
    """Return the name of the drone in the result of a command."""
    vehicle = json.loads(run(*words, "--json")[0])["vehicle"]
    return str(vehicle["name"] if isinstance(vehicle, dict) else vehicle)


@pytest.mark.parametrize(
    ("named", "found"),
    [("../light.toml", "made/../light.toml"), ("crazyflie", "crazyflie"), ("{}/light.toml", "{}/light.toml")],
)
def test_a_path_is_relative_to_the_settings(named: str, found: str) -> None:
    """A shipped drone keeps its name, an absolute path stays."""
    here = str(Path.cwd())
    assert vehicle_toml.of_settings(str(write_settings(named.format(here)))) == found.format(here)


def test_what_names_no_drone() -> None:
    """A preset, settings without the key, and a folder."""
    Path("plain.toml").write_text(PRESETS.text("mambo"), "utf-8")
    assert [vehicle_toml.of_settings(one) for one in ("mambo", "plain.toml", ".")] == [None] * 3


def test_the_c_does_not_depend_on_it() -> None:
    """Settings and bundle are those without the key."""
    settings = controller_toml.read(write_settings("../light.toml"))
    assert settings == load("mambo")
    assert render(settings) == render(load("mambo"))


def test_a_missing_file_is_a_sentence() -> None:
    """It names the settings, the drone and the fix; --vehicle flies another."""
    path = str(write_settings("../gone.toml"))
    assert run("margins", path, code=2)[1] == (
        f'{path}: vehicle = "../gone.toml" is neither a shipped drone nor a file; write where its '
        "vehicle.toml is, or name a drone with --vehicle\n"
    )
    assert flown("margins", path, "--vehicle", "crazyflie") == "crazyflie"


@pytest.mark.parametrize("value", ["3", '""', "[]"])
def test_another_value_is_refused(value: str) -> None:
    """By every command that reads the settings."""
    with pytest.raises(InvalidSettingsError, match="must be the name of a shipped drone"):
        controller_toml.parse(f"vehicle = {value}", "mine.toml")


def test_commands_fly_it() -> None:
    """From any folder; --vehicle flies another."""
    path = str(write_settings("../light.toml"))
    short = ("fly", path, "--duration-s", "1", "--no-pictures")
    assert flown(*short) == flown("margins", path) == "light"
    assert flown(*short, "--vehicle", "mambo") == "mambo"
    assert run(*short)[0].startswith("made/controller.toml on light: ")


def test_settings_for_two_drones_want_a_choice() -> None:
    """`diff` does not guess."""
    path = str(write_settings("../light.toml"))
    Path("other.toml").write_text(f'vehicle = "crazyflie"\n{PRESETS.text("mambo")}', "utf-8")
    _, said = run("diff", path, "other.toml", code=2)
    assert said == "the settings are for made/../light.toml and crazyflie; choose one with --vehicle\n"


def test_a_suite_that_names_no_drone_flies_it() -> None:
    """And a suite that names one flies that."""
    path = str(write_settings("../light.toml"))
    Path("mine.toml").write_text(SUITE, "utf-8")
    said, _ = run("regress", "mine.toml", "--controller", path)
    assert said.startswith("mine.light with controller on light: 1 of 1 flights passed")
    Path("mine.toml").write_text(SUITE.replace("[flight]", '[flight]\nvehicle = "crazyflie"'), "utf-8")
    said, _ = run("regress", "mine.toml", "--controller", path)
    assert said.startswith("mine with controller on crazyflie: 1 of 1 flights passed")


def test_a_campaign_that_names_no_drone_draws_from_it() -> None:
    """And one that names a drone draws from that."""
    path = str(write_settings("../light.toml"))
    few = ("--drones", "2")
    assert flown("margins", path, "--campaign", "default", *few) == "light"
    Path("campaign.toml").write_text("", "utf-8")
    assert flown("margins", path, "--campaign", "campaign.toml", *few) == "light"
    Path("campaign.toml").write_text('[flight]\nvehicle = "crazyflie"\n', "utf-8")
    assert flown("margins", path, "--campaign", "campaign.toml", *few) == "crazyflie"


@pytest.mark.long
def test_faults_and_what_design_writes() -> None:
    """`design` names the drone from the folder of its output, and `faults` flies it."""
    write_settings("../light.toml")
    run("design", "light.toml", "-o", "made/derived.toml")
    assert 'vehicle = "../light.toml"' in Path("made/derived.toml").read_text("utf-8")
    assert run("faults", "made/derived.toml", "-o", "out")[0].startswith("made/derived.toml on light: ")
    assert json.loads(Path("out/summary.json").read_text("utf-8"))["vehicle"]["name"] == "light"
