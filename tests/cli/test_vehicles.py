"""--vehicle on every command that flies, and the command that lists the drones."""

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from mambo_codegen.settings.toml_file import parse_document
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.scenario import read_record
from tests.support.command import of_installed, run, unwrapped
from tests.support.tools import require_module

FLYING = of_installed(("fly", "sweep", "tune", "campaign", "faults", "regress"))
DRONE = """\
[body]
mass_kg = 0.03
drag_1_s = 0.2

[attitude]
kind = "first_order"
roll = { gain = 0.9, lag_s = 0.06, dead_time_s = 0.05 }
pitch = { gain = 0.9, lag_s = 0.06 }

[sensors]
kind = "mocap"
position_noise_m = 0.001
velocity_filter_s = 0.03
attitude_noise_rad = 0.003
"""

GROUP = "[flight]\nduration_s = 1.0\n[flights.eight]\nbounds = { iae_m_s = 9.0 }\n"
"""The beginning of a suite."""


@pytest.fixture(autouse=True)
def _drone(_in_the_folder: None) -> None:
    """Put a drone where the commands run."""
    Path("mine.toml").write_text(DRONE, "utf-8")


def summary(folder: str) -> dict[str, Any]:
    """Return the summary in a folder."""
    found: dict[str, Any] = json.loads((Path(folder) / "summary.json").read_text("utf-8"))
    return found


def test_the_list_names_every_drone() -> None:
    """With what it is, as text and as JSON."""
    listed = unwrapped(run("vehicles")[0])
    described = json.loads(run("vehicles", "--json")[0])
    assert list(described) == list(vehicle_toml.names())
    assert listed == " ".join(f"{name} {description}" for name, description in described.items())


def test_a_shipped_file_is_one_to_start_from() -> None:
    """It is printed as it is, and reads under another name."""
    Path("copy.toml").write_text(run("vehicles", "generic")[0], "utf-8")
    assert vehicle_toml.load("copy.toml") == vehicle_toml.load("generic").model_copy(update={"name": "copy"})


def test_the_schema_fits_a_file() -> None:
    """And refuses one with a wrong key."""
    schema = json.loads(run("vehicles", "--schema")[0])
    jsonschema.validate(parse_document(DRONE, "mine"), schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(parse_document(DRONE.replace("gain", "gian"), "mine"), schema)


@pytest.mark.parametrize("command", FLYING)
def test_a_wrong_drone_is_refused_and_nothing_is_left(command: str) -> None:
    """With the message of its file, before anything is written."""
    if command == "tune":
        require_module("optuna")
    Path("wrong.toml").write_text(DRONE.replace("0.03\n", "-1\n", 1), "utf-8")
    source = ["--vary", "limits.tilt_rad=0.2:0.3:2"] if command == "sweep" else []
    _, said = run(command, *source, "--vehicle", "wrong.toml", "-o", "out", code=2)
    assert said.startswith("wrong.toml: body.mass_kg = -1 must lie in 0.001..100")
    assert not Path("out").exists()
    _, said = run(command, *source, "--vehicle", "crazyfly", "-o", "out", code=2)
    assert said.startswith("crazyfly is neither a shipped vehicle nor a file (did you mean crazyflie?)")


def test_fly_states_the_whole_drone() -> None:
    """Its summary has every value; the motor lag is the drone's unless one is given."""
    flags = ["--duration-s", "1", "--controller", "pd", "--no-pictures"]
    run("fly", "--vehicle", "mine.toml", "--sensors", "mocap", *flags, "-o", "mine")
    assert summary("mine")["vehicle"] == vehicle_toml.load("mine.toml").model_dump(mode="json")
    run("fly", "--vehicle", "crazyflie", *flags, "-o", "crazyflie")
    assert summary("crazyflie")["motor_lag_s"] == 0.072
    run("fly", "--vehicle", "crazyflie", "--motor-lag-s", "0.01", *flags, "-o", "quick")
    assert summary("quick")["motor_lag_s"] == 0.01
    run("fly", *flags, "-o", "mambo")
    assert summary("mambo")["vehicle"]["name"] == "mambo"
    traces = {(Path(folder) / "trace.csv").read_bytes() for folder in ("crazyflie", "quick", "mambo")}
    assert len(traces) == 3


def test_sensors_of_another_drone_are_refused() -> None:
    """With those it has."""
    _, said = run("fly", "--vehicle", "crazyflie", "--sensors", "mambo", code=2)
    assert said == ('--sensors = "mambo" needs its figures, [sensors], in the file of vehicle crazyflie\n')


def test_one_list_of_sensors_for_every_command() -> None:
    """A wrong name prints it."""
    kinds = "'true', 'mocap', 'flow-deck', 'autopilot', 'mambo'"
    for command, more in (("design", ""), ("fly", ", 'mambo-derotated'"), ("margins", ", 'mambo-derotated'")):
        _, said = run(command, "crazyflie", "--sensors", "sonar", code=2)
        assert f"'sonar' is not one of {kinds}{more}." in " ".join(said.replace("│", " ").split())


@pytest.mark.long
def test_a_campaign_flies_another_drone_and_its_flights_repeat() -> None:
    """With its own sensors, and draws around its own mass; the records do not need its file."""
    Path("campaign.toml").write_text('controllers = ["pd"]\n[flight]\nduration_s = 1.0\n', "utf-8")
    run("campaign", "campaign.toml", "--vehicle", "mine.toml", "--flights", "2", "-o", "out")
    campaign = summary("out")["campaign"]
    assert campaign["vehicle"] == vehicle_toml.load("mine.toml").model_dump(mode="json")
    assert (campaign["flight"]["vehicle"], campaign["flight"]["sensors"]) == ("mine", "mocap")
    path = Path("out") / "flights" / "000001-pd.json"
    scenario = read_record(path).scenario
    assert 0.03 <= scenario.mass_kg <= 0.0381
    assert 0.1 <= scenario.drag_1_s <= 0.3
    assert scenario.sensors == "mocap"
    Path("mine.toml").unlink()
    said, _ = run("fly", "--repeat", str(path), "--no-pictures", "-o", "again")
    assert "the trace equals the recorded one, bit for bit" in said
    _, said = run("campaign", "campaign.toml", "--flights", "2", "-o", "out", code=2)
    assert 'flight.vehicle = "mine" instead of "mambo"' in said


@pytest.mark.long
def test_a_suite_flies_any_drone() -> None:
    """Those that its groups name, or the one of the option, which has a baseline of its own."""
    text = GROUP + 'vehicle = ["mambo", "mine.toml"]\n'
    Path("suite.toml").write_text(text, "utf-8")
    run("regress", "suite.toml", "--controller", "pd", "-o", "out")
    assert [flight["name"] for flight in summary("out")["flights"]] == [
        "eight/vehicle=mambo",
        "eight/vehicle=mine",
    ]
    assert summary("out")["vehicles"] == ["mambo", "mine"]
    Path("suite.toml").write_text(text.replace('["mambo", "mine.toml"]', '"gone"'), "utf-8")
    _, said = run("regress", "suite.toml", code=2)
    assert said.startswith("suite.toml: flights.eight.vehicle: gone is neither a shipped vehicle nor a file")
    sensed = GROUP + 'sensors = ["true", "mambo"]\n'
    Path("suite.toml").write_text(sensed, "utf-8")
    run("regress", "suite.toml", "--controller", "pd", "--vehicle", "mine.toml", "--update", "-o", "other")
    assert Path("suite.mine.pd.baseline.json").exists()
    assert [flight["name"] for flight in summary("other")["flights"]] == [
        "eight/sensors=true",
        "eight/sensors=mocap",
    ]


@pytest.mark.long
def test_a_sweep_states_its_drone() -> None:
    """In its summary; `faults` does in test_vehicle_of_settings."""
    small = ["--vary", "cost.response_time_s=0.2:0.2:1"]
    run("sweep", *small, "--vehicle", "mine.toml", "-o", "mine")
    run("sweep", *small, "-o", "mambo")
    assert summary("mine")["vehicle"]["name"] == "mine"
    assert summary("mine")["points"][0]["iae_m_s"] != summary("mambo")["points"][0]["iae_m_s"]
