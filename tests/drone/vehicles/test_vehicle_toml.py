"""vehicle.toml: what is shipped, what is refused, the schema, and what the manual says of drones."""

import re
from pathlib import Path

import jsonschema
import pytest

from docs.pages.settings_page import vehicle_part
from mambo_codegen.errors import InvalidSettingsError, SourceNotFoundError
from mambo_codegen.settings.toml_file import parse_document
from mambo_sil.drone.vehicles import VEHICLES, vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile, form
from tests.support.command import run

DOCS = Path(__file__).parents[3] / "docs"
MOST_LINES = 25
FLOWN = """\
[body]
mass_kg = 0.1
drag_1_s = 0.1

[attitude]
kind = "first_order"
roll = { gain = 0.9, lag_s = 0.06, dead_time_s = 0.05 }
pitch = { gain = 0.9, lag_s = 0.06 }
"""
"""The least that a drone needs."""


def refusals(text: str) -> tuple[str, ...]:
    """Return the faults of a vehicle.toml."""
    with pytest.raises(InvalidSettingsError) as caught:
        vehicle_toml.parse(text, "drone", "drone.toml")
    return caught.value.faults


def changed(old: str, new: str) -> str:
    """Return `FLOWN` with a change."""
    assert old in FLOWN
    return FLOWN.replace(old, new)


@pytest.mark.parametrize("name", vehicle_toml.names())
def test_a_shipped_drone_reads_and_fits_its_schema(name: str) -> None:
    """Its first line says what it is, and every value but those of kinds and rates has a source."""
    drone = vehicle_toml.load(name)
    assert drone.name == name
    assert VEHICLES.description(name)
    document = parse_document(VEHICLES.text(name), name)
    jsonschema.validate(document, VehicleFile.json_schema())
    assert VehicleFile.model_validate(drone.model_dump()) == drone


def test_a_drone_reads_from_a_file(tmp_path: Path) -> None:
    """It is called as the file; what it leaves out follows from its mass."""
    path = tmp_path / "my-drone.toml"
    path.write_text(FLOWN)
    drone = vehicle_toml.load(str(path))
    assert drone.name == "my-drone"
    assert drone.step_s == 0.005
    assert (drone.altitude.p_n_m, drone.altitude.d_n_s_m) == (1.0, 0.5)
    assert drone.altitude.thrust_max_n == pytest.approx(2.0 * 0.981)
    assert drone.sensors.kind == "true"
    assert vehicle_toml.parse(
        FLOWN + "[thrust]\ngain = 0.4\nlag_s = 0.1\n", "weak", "weak.toml"
    ).largest_thrust_n == (pytest.approx(2.0 * 0.981))
    jsonschema.validate(parse_document(FLOWN, "drone"), VehicleFile.json_schema())


def test_an_unknown_drone_is_refused_with_the_most_similar_one() -> None:
    """And with all that there are."""
    with pytest.raises(SourceNotFoundError, match=r"mamba is neither .* \(did you mean mambo\?\)"):
        vehicle_toml.load("mamba")


MOCAP = "position_noise_m = 0.0\nvelocity_filter_s = 0.0\nattitude_noise_rad = 0.0\n"
FAULTS: dict[str, tuple[str, list[str]]] = {
    "out of range, unknown": (
        changed("mass_kg = 0.1", "mass_kg = -1\nmas = 3"),
        [
            "body.mass_kg = -1 must lie in 0.001..100",
            "body.mas is not a setting; did you mean mass_kg?",
        ],
    ),
    "in a table": (
        changed("lag_s = 0.06 }", "lag = 3 }"),
        [
            "attitude.pitch.lag_s is missing; add it, it must lie in 0.001..2: "
            "Time constant of the first-order lag.",
            "attitude.pitch.lag is not a setting; did you mean lag_s?",
        ],
    ),
    "no kind": (
        changed('kind = "first_order"', ""),
        [
            'attitude.kind is missing; add it, it must be "mambo" or "cascade" or "first_order": '
            "decides which other keys the section has"
        ],
    ),
    "unknown kind": (
        changed("first_order", "second_order"),
        ['attitude.kind = "second_order" must be "mambo" or "cascade" or "first_order"'],
    ),
    "no sections": (
        "body = 3\nattitude = 4\n[mambo]\n",
        [
            "body = 3 must be a section; write [body] and its keys below",
            "attitude = 4 must be a section; write [attitude] and its keys below",
            "mambo is not a section; "
            "there are body, rotors, attitude, altitude, thrust, sensors, uncertainty",
        ],
    ),
    "torques without rotors": (
        changed('kind = "first_order"', 'kind = "mambo"')
        .replace("gain = 0.9, lag_s = 0.06, dead_time_s = 0.05", "p_n_m = 1.0, d_n_m_s = 1.0")
        .replace("gain = 0.9, lag_s = 0.06", "p_n_m = 1.0, d_n_m_s = 1.0")
        + "yaw = { p_n_m = 1.0, d_n_m_s = 1.0 }\nintegral_limit_rad_s = 1.0\n",
        [
            *(
                f"body.inertia_{axis}_kg_m2 is missing; add it, it must lie in 1e-9..100: "
                f"Moment of inertia about the {which} axis."
                for axis, which in (("x", "forward"), ("y", "right"), ("z", "down"))
            ),
            "rotors is missing; write [rotors] and its keys below: Four equal rotors in X configuration.",
        ],
    ),
    "inertia without torques": (
        changed("mass_kg = 0.1", "mass_kg = 0.1\ninertia_x_kg_m2 = 1e-5"),
        [
            'body.inertia_x_kg_m2 = 1e-05 must be left out: attitude.kind = "first_order" has no torques',
        ],
    ),
    "a response of the thrust with rotors": (
        VEHICLES.text("crazyflie") + "[thrust]\nlag_s = 0.05\n",
        [
            'attitude.kind = "cascade" has rotors, whose thrust lags by rotors.lag_s: leave out [thrust]',
        ],
    ),
    "too weak": (
        FLOWN + "[altitude]\np_n_m = 1.0\nd_n_s_m = 1.0\nthrust_max_n = 0.98\n",
        ["altitude.thrust_max_n = 0.98 must be more than 0.981, the weight of body.mass_kg"],
    ),
    "too weak by the gain of its thrust": (
        FLOWN
        + "[altitude]\np_n_m = 1.0\nd_n_s_m = 1.0\nthrust_max_n = 1.9\n[thrust]\ngain = 0.5\nlag_s = 0.1\n",
        ["altitude.thrust_max_n = 1.9 must be more than 1.962, the weight of body.mass_kg over thrust.gain"],
    ),
    "a place of two numbers": (
        FLOWN + '[sensors]\nkind = "true"\nlever_m = [0.0, 0.05]\n',
        ["sensors.lever_m = a list must be 3 numbers, each in -1..1, in metres"],
    ),
    "a place that is too far": (
        FLOWN + '[sensors]\nkind = "true"\nlever_m = [0, 0, -50]\n',
        ["sensors.lever_m = a list must be 3 numbers, each in -1..1, in metres"],
    ),
    "a rate that does not divide": (
        FLOWN + f'[sensors]\nkind = "mocap"\nposition_rate_hz = 60\n{MOCAP}',
        ["sensors.position_rate_hz = 60 must be a divisor of 200 (attitude.rate_hz)"],
    ),
    "a name": ("name = 'x'\n" + FLOWN, ["name is not a key; remove it, the file's name is the name"]),
}


@pytest.mark.parametrize("what", FAULTS)
def test_a_fault_names_file_key_value_rule_and_fix(what: str) -> None:
    """All faults of a file at once."""
    text, expected = FAULTS[what]
    assert list(refusals(text)) == [f"drone.toml: {fault}" for fault in expected]


@pytest.fixture
def example(tmp_path: Path) -> Path:
    """Return the file that a tutorial has its reader save."""
    text = (DOCS / "tutorials" / "own-drone.md").read_text("utf-8")
    blocks = re.findall(r'```toml title="my-drone.toml"\n(.*?)```', text, re.DOTALL)
    assert len(blocks) == 1
    path = tmp_path / "my-drone.toml"
    path.write_text(blocks[0])
    return path


@pytest.mark.parametrize("sensors", ["true", "mocap"])
def test_the_example_is_short_and_flies(example: Path, sensors: str, tmp_path: Path) -> None:
    """Within 25 lines, without a crash."""
    assert len(example.read_text().splitlines()) <= MOST_LINES
    flags = ["--duration-s", "20", "--no-pictures", "--sensors", sensors, "-o", str(tmp_path / "flight")]
    text, _ = run("fly", "--vehicle", str(example), *flags)
    assert "IAE" in text
    assert '"name": "my-drone"' in (tmp_path / "flight" / "summary.json").read_text()


def test_every_key_is_documented() -> None:
    """Of every kind of attitude loop and of sensors, on the page that the code writes."""
    page = vehicle_part()
    for attitude in ("mambo", "cascade", "first_order"):
        for sensors in ("true", "mambo", "mocap"):
            for path in form(attitude, sensors).keys:
                assert f"`{path.rpartition('.')[2]}`" in page, path


def test_every_shipped_drone_is_documented() -> None:
    """In the first table of docs/reference/vehicles.md."""
    text = (DOCS / "reference" / "vehicles.md").read_text("utf-8")
    for name in vehicle_toml.names():
        assert f"\n| `{name}` | " in text


def without_altitude(name: str) -> str:
    """Return the file of a shipped drone without its [altitude]."""
    return re.sub(r"(?ms)^\[altitude\].*?(?=^\[)", "", VEHICLES.text(name))


def test_rotors_say_the_largest_thrust() -> None:
    """Four at 1500 rad/s, ten weights; a drone without rotors has two."""
    drone = vehicle_toml.parse(without_altitude("hummingbird"), "drone", "drone.toml")
    assert drone.altitude.thrust_max_n == pytest.approx(4.0 * 5.57e-6 * 1500.0**2)
    plain = vehicle_toml.parse(FLOWN, "drone", "drone.toml")
    assert plain.altitude.thrust_max_n == pytest.approx(2.0 * 0.1 * 9.81)


@pytest.mark.parametrize(
    ("most", "fault"),
    [
        (
            "100000.0",
            "drone.toml: altitude.thrust_max_n = 2.228 (the default) must be more than 4.905, the weight",
        ),
        ("-1.0", "drone.toml: rotors.command_max = -1.0 must lie in "),
        ('"a"', 'drone.toml: rotors.command_max = "a" must be a number'),
    ],
)
def test_rotors_that_lift_nothing_are_refused(most: str, fault: str) -> None:
    """With key, value and rule, once."""
    text = re.sub("command_max = [0-9.]+", f"command_max = {most}", without_altitude("hummingbird"))
    (found,) = refusals(text)
    assert found.startswith(fault)


def test_sensors_say_the_firmware() -> None:
    """The app of a Crazyflie is flown by `design`; no other drone has one."""
    firmware = {name: vehicle_toml.preset(name).firmware for name in vehicle_toml.names()}
    assert {name for name, one in firmware.items() if one == "crazyflie"} == {
        name for name in firmware if name.startswith("crazyflie")
    }
    assert vehicle_toml.preset("crazyflie").with_sensors("flow-deck").firmware == "crazyflie"
    assert vehicle_toml.preset("crazyflie").with_sensors("true").firmware is None
