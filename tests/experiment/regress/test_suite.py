"""Suites: lists multiply flights, keys are checked, all errors are told, and flights are flown in batches."""

from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from pathlib import Path

import pytest

from mambo_codegen.errors import InvalidSettingsError, SourceNotFoundError, UnreadableFileError
from mambo_sil.experiment.campaign.campaign_flights import INDICES, fly_scenarios
from mambo_sil.experiment.campaign.executors import Pool
from mambo_sil.experiment.inputs import Entrant, load_entrant
from mambo_sil.experiment.regress.suite_file import MOST_FLIGHTS, FlightSuite, load_suite
from mambo_sil.experiment.regress.suite_flights import _batches, demand_flyable, fly_suite
from mambo_sil.flight.scenario import Scenario


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


def controller(folder: Path, period_s: float) -> Entrant:
    """Return preset table1 with another update period."""
    path = folder / "slow.toml"
    path.write_text(f"horizon.update_period_s = {period_s}\n", "utf-8")
    return load_entrant("slow.toml", folder, "test")


@pytest.mark.parametrize(
    ("flights", "duration_s", "workers", "sizes"),
    [
        (1, 1.0, 1, [1]),
        (20, 1.0, 1, [20]),
        (45, 1.0, 1, [20, 20, 5]),
        (45, 1.0, 2, [20, 20, 5]),
        (45, 1.0, 4, [12, 12, 12, 9]),
        (3, 1.0, 8, [1, 1, 1]),
        (6, 2500.0, 1, [4, 2]),
        (5, 3600.0, 1, [2, 2, 1]),
    ],
)
def test_a_batch_is_a_share_of_the_flights_up_to_a_limit(
    tmp_path: Path, *, flights: int, duration_s: float, workers: int, sizes: list[int]
) -> None:
    """At most 20 flights, 10000 s of flight, and no more than leaves a batch for each worker."""
    seeds = "7" if flights == 1 else f"{{ from = 1, to = {flights}, count = {flights} }}"
    found = suite(tmp_path, f"[flights.eight]\nduration_s = {duration_s}\nseed = {seeds}")
    batches = list(_batches(found, workers))
    assert [len(batch) for batch in batches] == sizes
    assert list(chain.from_iterable(batches)) == list(range(flights))


def test_flights_are_flown_in_groups_of_one_kind_and_come_back_in_order(tmp_path: Path) -> None:
    """Durations, starts and sensors cannot be mixed in a batch; each row is that of the flight alone."""
    found = suite(
        tmp_path,
        """
        [flights.eight]
        yaw_rad = [0.0, 0.5]
        duration_s = [0.2, 0.1]
        sensors = ["true", "mambo"]
        """,
    )
    pd, finished = load_entrant("pd", tmp_path, "test"), list[int]()
    with ThreadPoolExecutor(1) as thread:
        rows = fly_suite(found, pd, Pool(thread, 1, lambda _: None), finished.append)
    assert finished == [0, 2, 4, 6, 8]
    for row, flight in zip(rows, found.flights, strict=True):
        (alone,) = fly_scenarios([pd], [flight.scenario])
        assert {f"pd_{key}": value for key, value in row.items()} == alone


def test_a_flight_that_cannot_be_simulated_is_named(tmp_path: Path) -> None:
    """Its duration against the update period, which must be a multiple of the tick."""
    found = suite(tmp_path, "[flights.eight]\nduration_s = 1.0\n[flights.brief]\nduration_s = 0.01")
    demand_flyable(found, controller(tmp_path, 0.01), "here")
    with pytest.raises(
        InvalidSettingsError,
        match=r"^here: flights\.brief: duration_s = 0\.01 must be .*update_period_s = 0\.02",
    ):
        demand_flyable(found, controller(tmp_path, 0.02), "here")
