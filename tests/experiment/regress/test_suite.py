"""Suites: lists of values multiply flights, keys of one flight are checked, all errors are reported."""

from pathlib import Path

import pytest

from mambo_codegen.errors import InvalidSettingsError, SourceNotFoundError, UnreadableFileError
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.experiment.campaign.campaign_flights import INDICES, fly_scenarios
from mambo_sil.experiment.inputs import load_entrant
from mambo_sil.experiment.regress.suite_file import MOST_FLIGHTS, FlightSuite, load_suite
from mambo_sil.flight.names import IN_SPACE
from mambo_sil.flight.scenario import Scenario
from mambo_sil.model.derive.derived_settings import controller_text


def suite(folder: Path, text: str) -> FlightSuite:
    """Write and load a suite."""
    path = folder / "mine.toml"
    path.write_text(text, "utf-8")
    return load_suite(str(path))


def faults(folder: Path, text: str) -> list[str]:
    """Return the messages on a suite, without the name of its file."""
    with pytest.raises(InvalidSettingsError) as caught:
        suite(folder, text)
    name = f"{folder}/mine.toml"
    short = name if len(name) <= 60 else f"{name[:28]}...{name[-28:]}"
    return [fault.removeprefix(f"{short}: ") for fault in caught.value.faults]


def test_lists_multiply_the_flights_of_a_group(tmp_path: Path) -> None:
    """Two headings, two winds and two views are eight flights; a group of one flight has its name alone."""
    found = suite(
        tmp_path,
        """
        [flights.eight]
        sensors = ["true", "mambo"]
        yaw_rad = [0.0, 0.5]
        push_m_s2 = [[0.5, 0.0], [0.0, -0.5]]
        [flights.hover]
        trajectory = "hover"
        push_m_s2 = [0.1, 0.2]
        """,
    )
    names = [flight.name for flight in found.flights]
    assert len(names) == len(set(names)) == 9
    assert names[0] == "eight/yaw_rad=0,push_m_s2=0.5;0,sensors=true"
    assert names[-1] == "hover"
    assert found.flights[7].scenario == Scenario(yaw_rad=0.5, push_m_s2=(0.0, -0.5), sensors="mambo")
    assert found.flights[8].scenario == Scenario(trajectory="hover", push_m_s2=(0.1, 0.2))


def test_names_do_not_depend_on_the_order_of_keys(tmp_path: Path) -> None:
    """A baseline finds its flights after the keys of a group were sorted anew."""
    keys = ["yaw_rad = [0.0, 0.5]", "size_m = [1.0, 2.0]"]
    one, other = (suite(tmp_path, "\n".join(["[flights.eight]", *lines])) for lines in (keys, reversed(keys)))
    assert one.flights == other.flights


@pytest.mark.parametrize(
    ("written", "values"),
    [
        ("{ from = 0.0, to = 1.0, count = 3 }", (0.0, 0.5, 1.0)),
        ("{ from = 1.0, to = 0.0, count = 2 }", (1.0, 0.0)),
        ("{ from = -3.14159, to = 3.14159, count = 3 }", (-3.14159, 0.0, 3.14159)),
        ("{ from = 0, to = 1, count = 4 }", (0.0, 0.333333, 0.666667, 1.0)),
    ],
)
def test_a_range_is_evenly_spaced_and_has_both_ends(
    tmp_path: Path, written: str, values: tuple[float, ...]
) -> None:
    """Values have six digits, which are those of the flight's name."""
    found = suite(tmp_path, f"[flights.eight]\nyaw_rad = {written}")
    assert tuple(flight.scenario.yaw_rad for flight in found.flights) == values
    assert found.flights[-1].name == f"eight/yaw_rad={values[-1]:g}"


def test_a_range_of_seeds_is_of_whole_numbers(tmp_path: Path) -> None:
    """Large seeds keep all their digits."""
    found = suite(tmp_path, "[flights.eight]\nseed = { from = 123456789012, to = 123456789014, count = 3 }")
    assert [flight.scenario.seed for flight in found.flights] == [123456789012 + k for k in range(3)]


def test_the_section_flight_holds_for_every_group_without_keys_of_its_own(tmp_path: Path) -> None:
    """Keys and bounds of a group replace those of all groups; a flight must not crash unless it may."""
    found = suite(
        tmp_path,
        """
        [flight]
        duration_s = 10
        yaw_rad = [0.0, 1.0]
        bounds = { iae_m_s = 1.0, refused_updates = 0 }
        [flights.eight]
        [flights.fall]
        yaw_rad = 2.0
        duration_s = 5
        bounds = { iae_m_s = 9.0, crashed = true }
        """,
    )
    eight, other, fall = found.flights
    assert (eight.scenario.yaw_rad, other.scenario.yaw_rad, fall.scenario.yaw_rad) == (0.0, 1.0, 2.0)
    assert (eight.scenario.duration_s, fall.scenario.duration_s) == (10.0, 5.0)
    assert eight.bounds == {"crashed": 0.0, "refused_updates": 0.0, "iae_m_s": 1.0}
    assert fall.bounds == {"crashed": 1.0, "refused_updates": 0.0, "iae_m_s": 9.0}


def test_every_metric_can_be_bounded_and_compared(tmp_path: Path) -> None:
    """Those of `mambo_sil.flight.metrics`, by their names; without [baseline] the IAE alone is compared."""
    keys = "\n".join(f"{metric} = 0.5" for metric in INDICES)
    found = suite(tmp_path, f"[baseline]\n{keys}\n[flights.eight.bounds]\n{keys}")
    assert dict(found.tolerances) == dict.fromkeys(INDICES, 0.5)
    assert found.flights[0].bounds == {"crashed": 0.0} | dict.fromkeys(INDICES, 0.5)
    assert dict(suite(tmp_path, "[flights.eight]").tolerances) == {"iae_m_s": 0.05}
    assert suite(tmp_path, "[baseline]\nsame_bits = true\n[flights.eight]").same_bits
    assert not suite(tmp_path, "[baseline]\n[flights.eight]").same_bits


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("yaw = 1.0", "yaw is not a key of this file; did you mean yaw_rad, yaw_rate_rad_s?"),
        ("wind_m_s2 = [0.5, 0.0]", "wind_m_s2 is called push_m_s2 since version 0.2"),
        ("size_m = [1, 5000]", "size_m = [1, 5000] must be less than or equal to 1000; 5000 is not"),
        ("size_m = 5000", "size_m = 5000 must be less than or equal to 1000"),
        ("seed = 1.5", "seed = 1.5 must be a valid integer"),
        ('rate_rad_s = "fast"', 'rate_rad_s = "fast" must be a valid number'),
        ("yaw_rad = nan", "yaw_rad = NaN must be a finite number"),
        ("yaw_rad = true", "yaw_rad = true must be a valid number"),
        ("yaw_rad = []", "yaw_rad = [] must have 1 to 1000 values"),
        ("yaw_rad = [1, 1.0]", "yaw_rad = [1, 1.0] must have different values; every value is a flight"),
        ("push_m_s2 = [1, 2, 3]", "push_m_s2 = [1, 2, 3] must be a vector of 2 finite numbers, or a list"),
        ("push_m_s2 = [[1, inf], [1, 2]]", "or a list of such vectors; [1, Infinity] is not"),
        ("yaw_rad = { from = 0, to = 1 }", "must be a value, a list of values, or { from = first, to ="),
        ("yaw_rad = { from = 0, to = 1, count = 3, step = 1 }", "must be a value, a list of values, or {"),
        ("yaw_rad = { from = 0, to = 1, count = 3.0 }", "must be a value, a list of values, or { from ="),
        ('yaw_rad = { from = "a", to = 1, count = 3 }', "must be a value, a list of values, or { from ="),
        ("yaw_rad = { from = 0, to = 1, count = 1001 }", "must have a count of 2 to 1000"),
        ("yaw_rad = { from = 0, to = nan, count = 3 }", "must be a value, a list of values, or { from ="),
        ("yaw_rad = { from = 0, to = 1, count = 1 }", "must have a count of 2 to 1000"),
        (
            'sensors = "all"',
            "sensors = \"all\" must be 'true', 'mocap', 'flow-deck', 'autopilot', 'mambo' or",
        ),
        ("yaw_rad = 1979-05-27", "must be a valid number"),
        ("bounds = 3", "bounds = 3 must be a section; write [flights.eight.bounds] and its keys below"),
        ("bounds.iae_m_s = -1", "bounds.iae_m_s = -1 must lie in 0..1000000000000"),
        ("bounds.refused_updates = -1", "bounds.refused_updates = -1 must lie in 0..1000000000"),
        ("bounds.refused_updates = 0.5", "bounds.refused_updates = 0.5 must be a valid integer"),
        ("bounds.crashed = 0", "bounds.crashed = 0 must be a valid boolean"),
        ("bounds.iae = 1", "bounds.iae is not a key of this file; did you mean iae_m_s?"),
    ],
)
def test_a_wrong_key_is_named_with_value_and_rule(tmp_path: Path, line: str, message: str) -> None:
    """One message, which begins with the path of the key."""
    (fault,) = faults(tmp_path, f"[flights.eight]\n{line}\n")
    assert fault.startswith("flights.eight.")
    assert message in fault


def test_all_errors_are_reported_together(tmp_path: Path) -> None:
    """Of every section."""
    text = (
        "[baseline]\niae_m_s = -1\n[flight]\nduration_s = 0\n[flights.a]\nyaw = 1\n[flights.b.bounds]\nx = 1"
    )
    assert [fault.split()[0] for fault in faults(tmp_path, text)] == [
        "baseline.iae_m_s",
        "flight.duration_s",
        "flights.a.yaw",
        "flights.b.bounds.x",
    ]


def test_rules_of_a_whole_flight_are_checked(tmp_path: Path) -> None:
    """A payload may not leave a negative mass; each group with an error is named."""
    assert faults(tmp_path, "[flights.a]\npayload_kg = -1.0\n[flights.b]\ninertia_kg_m2 = [0, 1, 1]") == [
        "flights.a: payload_kg must leave a positive mass",
        "flights.b: inertia_kg_m2 must be three positive numbers",
    ]


@pytest.mark.parametrize("count", [0, MOST_FLIGHTS + 4])
def test_the_number_of_flights_is_limited(tmp_path: Path, count: int) -> None:
    """At once, however many a file asks for."""
    group = f"[flights.eight]\nseed = {{ from = 1, to = {count // 4}, count = {count // 4} }}"
    group += "\nsize_m = [1, 2, 3, 4]"
    (fault,) = faults(tmp_path, group if count else "[flight]")
    assert fault.startswith(f"flights = {count} must be 1 to 2000; [flights.name] begins a group")


@pytest.mark.long
def test_the_largest_number_of_flights_is_accepted(tmp_path: Path) -> None:
    """The limit is inclusive, for the flights of all groups together."""
    seeds = f"seed = {{ from = 1, to = {MOST_FLIGHTS // 2}, count = {MOST_FLIGHTS // 2} }}"
    groups = f"[flights.one]\n{seeds}\n[flights.other]\n{seeds}"
    assert len(suite(tmp_path, groups).flights) == MOST_FLIGHTS
    (fault,) = faults(tmp_path, f"{groups}\n[flights.more]")
    assert fault.startswith(f"flights = {MOST_FLIGHTS + 1} must be 1 to {MOST_FLIGHTS};")


def test_a_million_million_flights_are_refused_without_making_them(tmp_path: Path) -> None:
    """The numbers of values are multiplied before any flight is made."""
    keys = ("size_m", "rate_rad_s", "yaw_rad", "motor_lag_s")
    lines = [f"{key} = {{ from = 0.0, to = 1.0, count = 1000 }}" for key in keys]
    (fault,) = faults(tmp_path, "\n".join(["[flights.eight]", *lines]))
    assert fault.startswith("flights = 1000000000000 must be 1 to 2000")


def test_a_group_needs_a_plain_name(tmp_path: Path) -> None:
    """Names of files and of test cases begin with it."""
    (fault,) = faults(tmp_path, '[flights."../eight"]')
    assert fault == "flights.../eight must have a name of at most 40 letters, digits, - and _"


def test_what_is_no_suite_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A name that is neither shipped nor a file, a file that is not TOML; ./envelope is a file."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SourceNotFoundError, match=r"nor a file \(did you mean envelope\?\)"):
        load_suite("envelop")
    with pytest.raises(
        SourceNotFoundError, match="nor a file; shipped suites are envelope, height, limits, space"
    ):
        load_suite("zzz")
    Path("envelope").write_text("no", "utf-8")
    with pytest.raises(UnreadableFileError, match="envelope: line 1"):
        load_suite("./envelope")
    assert load_suite("envelope").name == "envelope"


def test_the_envelope_has_33_headings_over_the_full_turn() -> None:
    """Ten groups: five courses with the true state and through sensors, each with a bound on the IAE."""
    found = load_suite("envelope")
    groups = {flight.group for flight in found.flights}
    assert len(groups) == 10
    for group in groups:
        flights = [flight for flight in found.flights if flight.group == group]
        yaws_rad = [flight.scenario.yaw_rad for flight in flights]
        assert len(set(yaws_rad)) == 33
        assert max(yaws_rad) - min(yaws_rad) == pytest.approx(6.28318)
        assert all("iae_m_s" in flight.bounds for flight in flights)
        sensors = {flight.scenario.sensors for flight in flights}
        assert sensors == {"mambo-derotated" if group.endswith("-sensors") else "true"}


def test_the_suite_in_space_flies_every_course_and_condition() -> None:
    """All curves with a height; heavy, sagging, unloaded, in gusts and close to the ground."""
    flights = [flight.scenario for flight in load_suite("space").flights]
    assert set(IN_SPACE) <= {one.trajectory for one in flights}
    for key in ("battery_sag_1_s", "payload_kg", "vertical_gust_m_s2", "ground_effect_radius_m"):
        assert any(getattr(one, key) for one in flights), key
    assert any(one.mass_kg == pytest.approx(1.3 * one.vehicle.body.mass_kg) for one in flights)


@pytest.mark.long
@pytest.mark.parametrize("name", ["space", "height"])
def test_no_bound_of_a_suite_in_space_is_exceeded_or_twice_what_is_flown(name: str, tmp_path: Path) -> None:
    """Suite `space` by preset crazyflie with the stock altitude loop, `height` by what design derives."""
    suite, source = load_suite(name), "crazyflie"
    if name == "height":
        derived = tmp_path / "controller.toml"
        derived.write_text(controller_text(vehicle_toml.load("crazyflie"), "crazyflie"), "utf-8")
        source = str(derived)
    entrant = load_entrant(source, tmp_path, "test")
    for group in dict.fromkeys((one.group, one.scenario.duration_s) for one in suite.flights):
        flights = [one for one in suite.flights if (one.group, one.scenario.duration_s) == group]
        rows = fly_scenarios([entrant], [one.scenario for one in flights], lambda _: None)
        for metric, bound in flights[0].bounds.items():
            worst = max(float(row[f"{entrant.name}_{metric}"]) for row in rows)
            assert 0.5 * bound <= worst <= bound, (group, metric, worst)
