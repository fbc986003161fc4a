"""Settings: what controller.toml admits, what it says about the rest, and that it survives being written."""

import json
import math
from pathlib import Path

import jsonschema
import pytest
from hypothesis import given
from hypothesis import settings as profile
from hypothesis import strategies as st

from mambo_codegen.errors import LONGEST_ECHO, InvalidSettingsError, MamboNmpcError, UnreadableFileError, echo
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.controller_keys import KEYS
from mambo_codegen.settings.key import Key, spell
from mambo_codegen.settings.model import Settings
from tests.support.height_settings import height_settings
from tests.support.strategies import (
    LAGS,
    NUMBERS,
    QUADRATIC,
    RESERVED,
    Values,
    any_settings,
    base_of,
    faults_of,
    nested,
    other_value,
    toml,
)

COMPANIONS: dict[str, Values] = {
    "horizon.ramp_s = 2.0": {"cost.response_time_s": 2.0},
    "horizon.prediction = 1": {"horizon.control": 1},
    "horizon.control = 50": {"horizon.prediction": 50},
    "optimizer.initial_step_rad = 1": {"optimizer.step_max_rad": 1},
    "optimizer.step_max_rad = 1e-6": {"optimizer.initial_step_rad": 1e-6},
    "optimizer.step_min_rad = 1": {"optimizer.initial_step_rad": 1, "optimizer.step_max_rad": 1},
    "ranges.thrust_acceleration_min_m_s2 = 100": {"ranges.thrust_acceleration_max_m_s2": 1000},
}
"""What other keys must say before one may stand at its bound."""

SCHEMA = jsonschema.Draft202012Validator(Settings.json_schema())
COST_KEYS = "there are tracking_weight, effort_weight, response_time_s, velocity_weight_s"
ODD_VALUES = ("nan", "-inf", "-1", "1e300", "true", '"1"', '"\\u001b[31m"', "[]", "{a = 1}", "1979-05-27")
HUGE_VALUES = ("0x" + "f" * 6000, '"' + "x" * 9000 + '"')


def test_empty_file_is_table_1() -> None:
    """A file without a key gives the values that Table I prints."""
    settings = controller_toml.parse("", "empty")
    assert (settings.cost.tracking_weight, settings.cost.effort_weight) == (2250, 1)
    assert (settings.horizon.prediction, settings.horizon.control) == (10, 2)
    optimizer = settings.optimizer
    assert (optimizer.iterations, optimizer.tolerance, optimizer.initial_step_rad) == (5, 0.05, 0.01)
    assert (optimizer.increase, optimizer.decrease) == (1.2, 0.8)
    assert (optimizer.step_max_rad, optimizer.step_min_rad) == (0.1, 1e-6)
    assert settings.horizon.update_period_s == 0.01


@pytest.mark.long
@profile(max_examples=40)
@given(any_settings())
def test_written_settings_read_back_equal_and_fit_their_schema(settings: Settings) -> None:
    """A controller.toml holds every bit of its settings, whatever they are, and the JSON schema admits it."""
    read_back = controller_toml.parse(controller_toml.to_toml(settings), "written")
    assert read_back == settings
    assert read_back.digest == settings.digest
    SCHEMA.validate(settings.model_dump())


@pytest.mark.parametrize("values", [{}, QUADRATIC], ids=["1-norm", "quadratic"])
def test_written_file_explains_every_key_in_use_within_100_columns(values: Values) -> None:
    """Every key stands below its description and the values it admits, in lines that fit a screen."""
    settings = Settings.model_validate(nested(values))
    text = controller_toml.to_toml(settings, "A title.")
    unwrapped = text.replace("\n# ", " ")
    assert text.startswith("# A title.\n")
    assert max(map(len, text.splitlines())) <= 100
    for key in KEYS.values():
        name = key.path.rpartition(".")[2]
        admits = f"{key.description} {key.kind.capitalize()}: {key.domain}.\n{name} = "
        assert (admits in unwrapped) == settings.uses(key.path), key.path


@pytest.mark.parametrize("key", NUMBERS, ids=lambda key: key.path)
def test_bounds_are_closed(key: Key) -> None:
    """A number may stand at its bound and not beyond; the message names key, value and bounds."""
    assert key.low is not None
    assert key.high is not None
    base = base_of(key.path)
    for bound, outwards in ((key.low, -math.inf), (key.high, math.inf)):
        whole = key.kind == "whole number"
        beyond = int(bound + math.copysign(1, outwards)) if whole else math.nextafter(bound, outwards)
        faults = faults_of(toml({**base, key.path: beyond}))
        (fault, *_) = [line for line in faults if line.startswith(f"slow.toml: {key.path}")]
        assert f"{key.path} = {beyond} must {key.rule}" in fault
        companions = COMPANIONS.get(f"{key.path} = {spell(bound)}", {})
        if (key.path, bound) != ("ranges.thrust_acceleration_max_m_s2", 0.1):
            controller_toml.parse(toml({**base, key.path: bound, **companions}), "at the bound")


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("horizon.control = 11", "must lie in 1..10 (horizon.prediction)"),
        (
            "horizon.prediction_step_s = 100",
            "must lie in 0.001..1; it is a period in seconds: for 100 Hz write 0.01",
        ),
        ("limits.tilt_rad = 20", "must lie in 0.01..1.2; it is in radians: for 20 degrees write 0.3491"),
        ("cost.tracking_weight = nan", "must be a finite number; it must lie in 0.001..1000000"),
        ('horizon.prediction = "ten"', "must be a whole number and lie in 1..50"),
        ("horizon.prediction = 10.0", "must be a whole number and lie in 1..50"),
        ("horizon.control = true", "must be a whole number and lie in 1..50"),
        ("cost.effort_weight = false", "must be a number and lie in 0..1000000"),
        ('optimizer.variant = "rprop"', 'must be "rprop+" or "irprop-"'),
        (
            'target.acceleration = "given"',
            'must be "none" or "tracked"; with a quadratic cost leave it out: since version 0.4 each '
            "target says what it knows of its acceleration, in its member `known`",
        ),
        ("optimizer.step_max_rad = 0.005", "must lie in 0.01..1 (at least optimizer.initial_step_rad)"),
        ("optimizer.step_min_rad = 0.02", "must lie in 1e-9..0.01 (at most optimizer.initial_step_rad)"),
        (
            "ranges.thrust_acceleration_max_m_s2 = 1",
            "must be more than 1.0 (ranges.thrust_acceleration_min_m_s2)",
        ),
        (
            'model.position_update = "printed"\nmodel.roll_lag_s = 0.2',
            'must be 0 with model.position_update = "printed", which has no lag; '
            'write 0 here or position_update = "exact"',
        ),
        ("model.pitch_lag_s = 0.0001", "must be 0 or lie in 0.001..2; 0 means no lag"),
        ("horizon = 3", "must be a section; write [horizon] and its keys below"),
        ('code.prefix = "int"', "must not be a keyword of C or C++; write for example int_nmpc"),
        (
            'code.prefix = "pid"',
            "must not be a header or a name of the C library or POSIX; write for example pid_nmpc",
        ),
    ],
)
def test_fault_names_key_value_rule_and_fix(text: str, rule: str) -> None:
    """One line states what is wrong in a file, and what to write instead."""
    assert faults_of(text) == [f"slow.toml: {text.splitlines()[-1]} {rule}"]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("horizon.prediction = 1", "horizon.control = 2 (the default) must lie in 1..1 (horizon.prediction)"),
        ("cost.effort_weight = []", "cost.effort_weight = a list must be a number and lie in 0..1000000"),
        ("[[cost]]", "cost = a list must be a section; write [cost] and its keys below"),
        ("horizon.predicton = 9", "horizon.predicton is not a setting; did you mean prediction?"),
        ("cost.iterations = 9", "cost.iterations is not a setting; did you mean optimizer.iterations?"),
        ("cost.zzz = 9", f"cost.zzz is not a setting; {COST_KEYS}"),
        ("[horizn]", "horizn is not a section; did you mean horizon?"),
        ("tolerance = 1", "tolerance is not a section; did you mean optimizer.tolerance?"),
        (
            'cost."a\\u0007b" = 1',
            rf'cost."a\u0007b" is not a setting; {COST_KEYS}',
        ),
    ],
)
def test_fault_names_defaults_types_and_unknown_names(text: str, fault: str) -> None:
    """The line says what stands there instead of the text, or which names there are."""
    assert faults_of(text) == [f"slow.toml: {fault}"]


def test_all_faults_are_reported_at_once() -> None:
    """A fault of one key hides no other, not even a rule between two keys of the same section."""
    text = """
        speed = 1
        [horizon]
        control = 11
        predicton = 20
        update_period_s = 7
        [model]
        position_update = "printed"
        yaw_convention = 1
        roll_lag_s = 0.2
    """
    keys = [line.split()[1] for line in faults_of(text)]
    assert keys == [
        "horizon.control",
        "horizon.update_period_s",
        "horizon.predicton",
        "model.yaw_convention",
        "model.roll_lag_s",
        "speed",
    ]


@pytest.mark.parametrize("value", [*ODD_VALUES, *HUGE_VALUES], ids=lambda value: value[:12])
def test_odd_value_gets_short_printable_line(value: str) -> None:
    """No value, however long or strange, gets more than one printable line of bearable length."""
    for path in KEYS:
        try:
            controller_toml.parse(f"{path} = {value}", "odd")
        except InvalidSettingsError as error:
            assert any(line.startswith(f"odd: {path} = ") for line in error.faults)  # noqa: PT017 - some are valid
            assert all(line.isprintable() and len(line) < 300 for line in error.faults)  # noqa: PT017


NO_NAMES = ("", "Nmpc", "1nmpc", "_nmpc", "nmpc_", "n__c", "n-c", "n c", "nmpc\n", "na\u00efve", "a" * 25)


@pytest.mark.parametrize("prefix", [*NO_NAMES, *sorted(RESERVED)])
def test_prefix_that_is_no_c_name_is_refused(prefix: str) -> None:
    """A prefix is a lower-case C name without double or trailing underscores, and no keyword."""
    with pytest.raises(InvalidSettingsError, match=r"--prefix: code\.prefix = .* must "):
        controller_toml.with_option(Settings(), "code.prefix", prefix, "--prefix")


def test_option_replaces_one_value() -> None:
    """An option on the command line changes the value it names and nothing else."""
    changed = controller_toml.with_option(Settings(), "code.prefix", "a" * 24, "--prefix")
    assert changed.code.prefix == "a" * 24
    assert controller_toml.with_option(changed, "code.prefix", "nmpc", "--prefix") == Settings()


@pytest.mark.parametrize("key", KEYS.values(), ids=lambda key: key.path)
def test_digest_depends_on_every_value(key: Key) -> None:
    """Two settings that differ in one key have different digests."""
    base = LAGS if key.path == "controller.method" else base_of(key.path)
    changed = controller_toml.parse(toml({**base, key.path: other_value(key)}), "changed")
    assert changed.digest != Settings.model_validate(nested(base)).digest


def test_digest_ignores_spelling() -> None:
    """Equal values have one digest, whether written 1, 1.0 or left out, 0.0 or -0.0."""
    spelled_otherwise = "cost.effort_weight = 1\nmodel.roll_lag_s = -0.0\noptimizer.step_min_rad = 0.000001"
    settings = controller_toml.parse(spelled_otherwise, "other")
    assert settings.digest == Settings().digest
    assert len(settings.digest) == 64


def test_schema_is_valid_and_refuses_what_the_rules_refuse() -> None:
    """The JSON schema is one, and an editor that uses it finds unknown keys, bounds and lags too short."""
    schema = Settings.json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == jsonschema.Draft202012Validator.META_SCHEMA["$schema"]
    json.dumps(schema)
    for path, value in [
        ("horizon.predicton", 1),
        ("horizon.control", 0),
        ("cost.effort_weight", 1e7),
        ("model.roll_lag_s", 0.0005),
        ("code.prefix", "a__b"),
    ]:
        assert not SCHEMA.is_valid(nested({path: value})), path


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"[horizon]\nprediction 10\n", "line 2, column 12: Expected '=' after a key in a key/value pair"),
        (b"[horizon]\nprediction =\n", "line 2"),
        (b"[horizon]\nprediction = ", "line 2, column 14: Invalid value: prediction ="),
        (b"a = " + b"9" * 5000, "is not TOML: Exceeds the limit"),
        (
            b"[cost]\neffort_weight = 1\neffort_weight = 2",
            "line 3, column 18: Cannot overwrite a value; write each section and key once: effort_weight = 2",
        ),
        (
            b"[cost]\n[horizon]\n[cost] # again\n",
            "line 3, column 6: Cannot declare ('cost',) twice; write each section and key once: [cost]",
        ),
        (b"[cost", "line 1, column 6: Expected ']' at the end of a table declaration: [cost"),
        (b"a = [1\n", "is not TOML: Unclosed array"),
        (b"a = " + b"[" * 20000, "is nested too deeply; write [section] and key = value"),
        (b"# caf\xe9", "line 1: is not UTF-8; save the file as UTF-8"),
        (b"#" * 64_001, "is larger than 64 kB; a settings file needs a few kB"),
    ],
)
def test_file_that_is_not_toml_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    """A file that is no TOML gets the line and the reason."""
    path = tmp_path / "slow.toml"
    path.write_bytes(content)
    with pytest.raises(UnreadableFileError) as caught:
        controller_toml.read(path)
    assert f": {message}" in str(caught.value)


def test_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    """A missing file and a folder are told apart."""
    with pytest.raises(UnreadableFileError, match="there is no such file"):
        controller_toml.read(tmp_path / "none.toml")
    with pytest.raises(UnreadableFileError, match="is a folder"):
        controller_toml.read(tmp_path)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("controller.toml", "", "controller.toml: has no settings; name a preset or a controller.toml"),
        ("controller.toml", "# mine\n", "has no settings"),
        ("controller.toml", 'vehicle = "mambo"\n', "has no settings"),
        ("mypid.py", "", "mypid.py: is a Python program; name a preset or a controller.toml"),
        ("mypid.py", "cost = 1\n", "is a Python program"),
    ],
)
def test_a_file_without_settings_is_refused(name: str, text: str, message: str, tmp_path: Path) -> None:
    """Table I is flown by its name only; one key is enough to be settings."""
    (tmp_path / name).write_text(text)
    with pytest.raises(MamboNmpcError, match=message):
        controller_toml.read(tmp_path / name)
    (tmp_path / "few.toml").write_text("[horizon]\ncontrol = 3\n")
    assert controller_toml.read(tmp_path / "few.toml").horizon.control == 3


def test_byte_order_mark_is_read_over(tmp_path: Path) -> None:
    """A file saved by an editor that begins UTF-8 with a mark reads like any other."""
    path = tmp_path / "controller.toml"
    path.write_bytes(b"\xef\xbb\xbfhorizon.control = 3\r\n")
    assert controller_toml.read(path).horizon.control == 3


@pytest.mark.long
@given(st.text())
def test_any_text_is_settings_or_our_error(text: str) -> None:
    """No text whatever ends in an exception that is not ours."""
    try:
        controller_toml.parse(text, "any")
    except MamboNmpcError as error:
        assert error.exit_code == 2  # noqa: PT017 - most texts are wrong, some are not


@given(st.text(max_size=3000))
def test_echo_is_short_and_printable(text: str) -> None:
    """What a message repeats of foreign text fits one line and moves no cursor."""
    assert echo(text).isprintable()
    assert len(echo(text)) <= LONGEST_ECHO
    if text.isprintable() and len(text) <= LONGEST_ECHO:
        assert echo(text) == text


def test_without_a_section_what_it_alone_makes_useful_has_its_default() -> None:
    """Here the exact tilt, floor and ceiling of a controller without a height."""
    settings = height_settings()
    for path, value in {
        "limits.fence.ceiling_m": 2.0,
        "limits.fence.floor_m": 0.2,
        "model.tilt": "exact",
    }.items():
        settings = controller_toml.with_option(settings, path, value)
    bare = controller_toml.without(settings, "height")
    assert bare.height is None
    assert (bare.model.tilt, bare.limits.fence) == ("small-angle", Settings().limits.fence)
    assert bare.cost == settings.cost
