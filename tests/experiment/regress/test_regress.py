"""A suite's results: limits from bounds and baselines, baselines as files, and what CI servers read."""

import json
import math
from hashlib import sha256
from pathlib import Path
from xml.etree import ElementTree

import pytest

from mambo_codegen.errors import FileExistsRefusedError, InvalidSettingsError
from mambo_sil.experiment.campaign.campaign_flights import INDICES, Row
from mambo_sil.experiment.inputs import Entrant, load_entrant
from mambo_sil.experiment.regress.baseline import (
    _scenario_digest,
    baseline_path,
    demand_replaceable,
    read_baseline,
    record_baseline,
)
from mambo_sil.experiment.regress.flight_limits import RECORDS
from mambo_sil.experiment.regress.regress_plots import _rows, _shares, draw_regress
from mambo_sil.experiment.regress.regress_report import (
    MOST_SHOWN,
    RegressSummary,
    group_rows,
    judge,
    junit_xml,
    write_records,
)
from mambo_sil.experiment.regress.suite_file import FlightSuite, load_suite
from mambo_sil.flight.names import PD_NAMES
from mambo_sil.flight.scenario import Scenario, read_record
from mambo_sil.results.terminal import result_text
from tests.support.scenarios import CRAZYFLIE

SUITE = """
[baseline]
iae_m_s = 0.1
{baseline}
[flights.eight]
yaw_rad = [0.0, 0.5, 1.0]
bounds = {{ iae_m_s = 3.0 }}
"""


def suite(folder: Path, baseline: str = "", more: str = "") -> FlightSuite:
    """Write and load a suite of three flights."""
    path = folder / "mine.toml"
    path.write_text(SUITE.format(baseline=baseline) + more, "utf-8")
    return load_suite(str(path))


def mambo() -> Entrant:
    """Return the preset as a controller."""
    return load_entrant("mambo", Path(), "test")


def row(iae_m_s: float, **others: float | str) -> Row:
    """Return the results of a flight."""
    plain: Row = {"crashed": 0, "refused_updates": 0, "saturated_share": 0.125, "trace_sha256": "ab"}
    return plain | dict.fromkeys(INDICES, 1.0) | {"iae_m_s": iae_m_s} | others


def text_of(summary: RegressSummary) -> str:
    """Return what the command prints."""
    return result_text(summary.result(Path("out")))


def judged(found: FlightSuite, rows: list[Row]) -> RegressSummary:
    """Compare rows with bounds and baseline."""
    path = baseline_path(found, "mambo")
    return judge(found, mambo(), rows, read_baseline(found, "mambo"), path)


def test_without_a_baseline_only_bounds_hold(tmp_path: Path) -> None:
    """A value at its bound holds, one above fails with flight, metric, value and bound."""
    summary = judged(suite(tmp_path), [row(3.0), row(3.001), row(0.0)])
    assert [flight.failures for flight in summary.flights] == [[], ["IAE 3.001 m s (bound 3)"], []]
    assert [flight.name for flight in summary.failed] == ["eight/yaw_rad=0.5"]
    assert summary.baseline is None
    assert "compared with the bounds only" in text_of(summary)


def test_a_recorded_value_limits_with_its_tolerance(tmp_path: Path) -> None:
    """10 % above the recorded value holds, more fails, whichever limit is the smaller one is named."""
    found = suite(tmp_path)
    record_baseline(found, mambo(), [row(2.0), row(2.0), row(2.9)])
    summary = judged(found, [row(2.19), row(2.21), row(3.1)])
    assert [flight.failures for flight in summary.flights] == [
        [],
        ["IAE 2.21 m s (bound 3; recorded 2, so at most 2.2)"],
        ["IAE 3.1 m s (bound 3; recorded 2.9)"],
    ]
    assert summary.baseline == str(tmp_path / "mine.mambo.baseline.json")
    assert "settings have changed" not in text_of(summary)


def test_a_better_flight_passes_and_is_said(tmp_path: Path) -> None:
    """Only within the tolerance does a better value go without saying."""
    found = suite(tmp_path)
    record_baseline(found, mambo(), [row(2.0)] * 3)
    summary = judged(found, [row(1.81), row(1.79), row(0.0)])
    assert summary.failed == []
    assert summary.better == 2
    assert judged(found, [row(1.8)] * 3).better == 0
    assert "2 flights are better than recorded by more than the tolerance; --update" in text_of(summary)


@pytest.mark.parametrize("tolerated", ["ise_m2_s = 0.0", ""])
def test_a_metric_without_a_tolerance_is_not_compared(tmp_path: Path, tolerated: str) -> None:
    """All metrics are recorded, so that a tolerance can be added without flying again."""
    found = suite(tmp_path)
    record_baseline(found, mambo(), [row(2.0)] * 3)
    summary = judged(suite(tmp_path, tolerated), [row(2.0, ise_m2_s=1.5)] * 3)
    assert len(summary.failed) == (3 if tolerated else 0)


def test_same_bits_are_compared_if_asked_for(tmp_path: Path) -> None:
    """Another digest fails, whatever the metrics say."""
    found = suite(tmp_path, "same_bits = true")
    record_baseline(found, mambo(), [row(2.0)] * 3)
    summary = judged(found, [row(2.0), row(2.0, trace_sha256="cd"), row(2.0)])
    assert [flight.same_bits for flight in summary.flights] == [True, False, True]
    differs = ["the trace differs from the recorded one"]
    assert [flight.failures for flight in summary.flights] == [[], differs, []]
    assert [flight.record for flight in summary.flights] == [None, "flights/0001-eight.json", None]


def test_same_bits_want_a_recorded_digest(tmp_path: Path) -> None:
    """Before the first recording nothing is compared."""
    summary = judged(suite(tmp_path, "same_bits = true"), [row(2.0)] * 3)
    assert [flight.same_bits for flight in summary.flights] == [None] * 3
    assert summary.failed == []


@pytest.mark.parametrize("name", PD_NAMES)
def test_the_record_of_a_failed_flight_names_the_kind_of_controller(tmp_path: Path, name: str) -> None:
    """A PD's flight is repeated with it."""
    found, pd = suite(tmp_path), load_entrant(name, Path(), "test")
    rows = [row(4.0), row(1.0), row(1.0)]
    write_records(judge(found, pd, rows, None, tmp_path), found, pd, rows, tmp_path)
    assert read_record(tmp_path / RECORDS / "0000-eight.json").controller == name


def test_a_crashed_or_lost_flight_fails(tmp_path: Path) -> None:
    """A metric of a lost flight is NaN, which exceeds every limit."""
    lost = row(math.nan, crashed=1) | dict.fromkeys(INDICES, math.nan)
    summary = judged(suite(tmp_path), [row(1.0, crashed=1), lost, row(1.0)])
    assert [flight.failures for flight in summary.flights] == [
        ["crashed"],
        ["crashed", "IAE nan m s (bound 3)"],
        [],
    ]
    assert "null" in summary.text()
    crashed, iae = group_rows(summary)
    assert (crashed.metric, crashed.failed, iae.metric, iae.failed) == ("crashed", 2, "iae_m_s", 1)
    assert iae.worst == math.inf


MIXED = """
[flights.fall]
bounds.crashed = true
seed = [1, 2]
[flights.calm]
seed = [1, 2]
bounds = { ise_m2_s = 2.0, refused_updates = 4 }
[flights.still]
"""
"""Groups that may crash, have other bounds, or none."""

TEXT = """\
mine with mambo on mambo: 4 of 8 flights passed, 4 failed
compared with the bounds and with here.json

group  metric           bound  median  worst  over recorded  at limit  failed
eight  IAE, m s             3     2.5    2.9           1.25    50.0 %  1 of 3
fall   IAE, m s             -     inf    inf            inf    12.5 %  1 of 2
calm   crashed              0     0.5      1              -    12.5 %  1 of 2
calm   refused updates      4     2.5      5              -    12.5 %  1 of 2
calm   IAE, m s             -       1      1              1    12.5 %  0 of 1
calm   ISE, m^2 s           2    1.75    2.5              -    12.5 %  1 of 2
still  crashed              0       0      0              -    12.5 %  0 of 1

eight/yaw_rad=0: IAE 2.5 m s (bound 3; recorded 2, so at most 2.2)
    mambo-nmpc fly --repeat out/flights/0000-eight.json
fall/seed=2: IAE nan m s (recorded 1, so at most 1.1)
    mambo-nmpc fly --repeat out/flights/0004-fall.json
calm/seed=1: crashed; ISE 2.5 m^2 s (bound 2)
    mambo-nmpc fly --repeat out/flights/0005-calm.json
calm/seed=2: refused updates 5 (bound 4)
    mambo-nmpc fly --repeat out/flights/0006-calm.json"""


def test_the_text_has_a_row_for_each_group_and_metric_and_then_what_failed(tmp_path: Path) -> None:
    """Median, worst value, worst ratio; a lost flight is infinite; crashes where nothing else is judged."""
    found = suite(tmp_path, more=MIXED)
    path = record_baseline(found, mambo(), [*map(row, (2.0, 1.0, 2.8, 1.0, 1.0, 1.0, math.nan, math.nan))])
    rows = [row(2.5), row(1.05), row(2.9, saturated_share=0.5), row(1.05), row(math.nan, crashed=1)]
    rows += [row(1.0, ise_m2_s=2.5, crashed=1), row(0.9, refused_updates=5), row(9.0)]
    assert path == baseline_path(found, "mambo")
    summary = judge(found, mambo(), rows, read_baseline(found, "mambo"), Path("here.json"))
    assert text_of(summary) == TEXT


def test_the_text_of_a_suite_that_passed_is_its_table_and_one_line(tmp_path: Path) -> None:
    """Without what failed or was recorded."""
    text = text_of(judged(suite(tmp_path), [row(1.0)] * 3))
    assert text.splitlines() == [
        "mine with mambo on mambo: 3 of 3 flights passed",
        "compared with the bounds only; --update records this run for later ones",
        "",
        "group  metric    bound  median  worst  at limit  failed",
        "eight  IAE, m s      3       1      1    12.5 %  0 of 3",
    ]


def test_a_lost_flight_is_recorded_as_null_and_then_not_compared(tmp_path: Path) -> None:
    """JSON has no NaN; the bound still holds."""
    found = suite(tmp_path)
    record_baseline(found, mambo(), [row(math.nan), row(1.0), row(1.0)])
    assert '"iae_m_s": null' in baseline_path(found, "mambo").read_text("utf-8")
    assert [flight.name for flight in judged(found, [row(2.9)] * 3).failed] == [
        "eight/yaw_rad=0.5",
        "eight/yaw_rad=1",
    ]


def test_a_baseline_has_one_line_for_each_flight(tmp_path: Path) -> None:
    """So that a difference of two versions shows which flights changed; digits end where noise begins."""
    found = suite(tmp_path)
    path = record_baseline(found, mambo(), [row(1 / 3), row(2.0), row(3.0)])
    lines = path.read_text("utf-8").splitlines()
    assert [line.strip().partition(":")[0] for line in lines if "iae_m_s" in line] == [
        f'"{flight.name}"' for flight in found.flights
    ]
    assert '"iae_m_s": 0.333333,' in path.read_text("utf-8")
    assert "sha256" not in path.read_text("utf-8")
    assert path.read_text("utf-8").endswith("}\n  }\n}\n")
    before = path.read_bytes()
    record_baseline(found, mambo(), [row(1 / 3 + 1e-9), row(2.0), row(3.0)])
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("baseline", "more", "message"),
    [
        ("", "[flights.new]", "1 new (new); record it anew with --update"),
        ("", "size_m = 1.0\n", "3 changed (eight/yaw_rad=0)"),
        ("", "rate_rad_s = [1.0, 2.0]\n", "6 new (eight/rate_rad_s=1,yaw_rad=0), 3 gone (eight/yaw_rad=0)"),
        ("same_bits = true", "", "3 without a value to compare (eight/yaw_rad=0)"),
    ],
)
def test_a_baseline_of_other_flights_is_refused(
    tmp_path: Path, baseline: str, more: str, message: str
) -> None:
    """New, changed or vanished flights are named; nothing is compared with what it is not."""
    record_baseline(suite(tmp_path), mambo(), [row(2.0)] * 3)
    with pytest.raises(InvalidSettingsError) as caught:
        read_baseline(suite(tmp_path, baseline, more), "mambo")
    assert "was recorded from other flights" in str(caught.value)
    assert message in str(caught.value)


def test_other_settings_than_recorded_are_said(tmp_path: Path) -> None:
    """A comparison of two settings is legitimate, and visible."""
    found = suite(tmp_path)
    table1 = load_entrant("table1", Path(), "test")
    path = record_baseline(found, Entrant("mambo", "nmpc", table1.settings), [row(2.0)] * 3)
    assert table1.settings.digest in path.read_text("utf-8")
    assert "settings have changed" in text_of(judged(found, [row(2.0)] * 3))


@pytest.mark.parametrize("text", ["", "[]", '{"generator": "x"}', "<<<<<<< HEAD\n"])
def test_a_file_that_is_no_baseline_is_refused_and_kept(tmp_path: Path, text: str) -> None:
    """Neither read nor overwritten."""
    found = suite(tmp_path)
    path = baseline_path(found, "mambo")
    path.write_text(text, "utf-8")
    with pytest.raises(InvalidSettingsError, match=r"is no baseline of mambo-nmpc: .*--update"):
        read_baseline(found, "mambo")
    with pytest.raises(FileExistsRefusedError, match="move it away"):
        demand_replaceable(path)


@pytest.mark.parametrize(
    ("old", "new", "rule"),
    [
        (
            '"iae_m_s": 2.0',
            '"iae_m_s": "fast"',
            r'eight/yaw_rad=0: iae_m_s = "fast" must be a number or null',
        ),
        ('"iae_m_s": 2.0', '"iae_m_s": true', "iae_m_s.*: Input should be a valid number"),
        ('"iae_m_s": 2.0', '"iae_m_s": NaN', "iae_m_s.*: Input should be a finite number"),
        ('"scenario": "', '"scenario": 3, "x": "', r"scenario = 3\.0 must be text"),
        ('"suite": "mine"', '"suite": 3', "suite: Input should be a valid string"),
        ('"flights": {', '"flights": [], "x": {', "flights: Input should be an object"),
    ],
)
def test_a_baseline_with_a_wrong_value_is_refused(tmp_path: Path, *, old: str, new: str, rule: str) -> None:
    """Before any flight, with the first wrong key and its rule."""
    found = suite(tmp_path)
    path = record_baseline(found, mambo(), [row(2.0)] * 3)
    path.write_text(path.read_text("utf-8").replace(old, new, 1), "utf-8")
    with pytest.raises(
        InvalidSettingsError, match=rf"is no baseline of mambo-nmpc: .*{rule}; record it anew"
    ):
        read_baseline(found, "mambo")


def test_a_baseline_needs_only_the_compared_metrics(tmp_path: Path) -> None:
    """Others may be left out, and keys of later versions may be there."""
    found = suite(tmp_path)
    path = record_baseline(found, mambo(), [row(2.0)] * 3)
    whole = json.loads(path.read_text("utf-8"))
    flights = whole["flights"]
    for name, held in flights.items():
        flights[name] = {key: held[key] for key in ("scenario", "iae_m_s")}
    path.write_text(json.dumps(whole | {"comment": "by hand"}), "utf-8")
    assert len(judged(found, [row(2.3)] * 3).failed) == 3
    flights["gone"] = {"scenario": "ab"}
    path.write_text(json.dumps(whole), "utf-8")
    with pytest.raises(InvalidSettingsError, match=r"other flights: 1 gone \(gone\); record"):
        read_baseline(found, "mambo")


def test_what_is_no_plain_file_is_neither_read_nor_replaced(tmp_path: Path) -> None:
    """A folder, and a link, even to a baseline; a path where nothing is may be written."""
    found = suite(tmp_path)
    path = baseline_path(found, "mambo")
    demand_replaceable(path)
    path.mkdir()
    with pytest.raises(InvalidSettingsError, match="is no baseline of mambo-nmpc: Is a directory; record"):
        read_baseline(found, "mambo")
    with pytest.raises(FileExistsRefusedError, match=r"is a .*, not a plain file; move it away"):
        demand_replaceable(path)
    path.rmdir()
    record_baseline(found, mambo(), [row(2.0)] * 3).rename(tmp_path / "elsewhere")
    for target in ("elsewhere", "nowhere"):
        path.symlink_to(target)
        with pytest.raises(FileExistsRefusedError, match=r"is a .*, not a plain file; move it away"):
            demand_replaceable(path)
        path.unlink()


def test_a_damaged_baseline_may_be_replaced(tmp_path: Path) -> None:
    """A merge of two versions leaves markers in it."""
    found = suite(tmp_path)
    path = record_baseline(found, mambo(), [row(2.0)] * 3)
    path.write_text(path.read_text("utf-8") + ">>>>>>> theirs\n", "utf-8")
    with pytest.raises(InvalidSettingsError, match="mambo-nmpc: file: Invalid JSON"):
        read_baseline(found, "mambo")
    demand_replaceable(path)


def test_each_controller_has_its_baseline(tmp_path: Path) -> None:
    """Beside the suite; of a shipped suite in the working directory."""
    found = suite(tmp_path)
    record_baseline(found, mambo(), [row(2.0)] * 3)
    assert read_baseline(found, "table1") is None
    assert baseline_path(found, "table1") == tmp_path / "mine.table1.baseline.json"
    assert baseline_path(load_suite("envelope"), "mambo") == Path("envelope.mambo.baseline.json")


def test_a_record_is_left_of_each_failed_flight_only(tmp_path: Path) -> None:
    """With the digest of its trace, for `fly --repeat`."""
    found = suite(tmp_path)
    rows = [row(1.0), row(4.0, trace_sha256="cd"), row(1.0)]
    summary = judged(found, rows)
    write_records(summary, found, mambo(), rows, tmp_path)
    assert [path.name for path in (tmp_path / RECORDS).iterdir()] == ["0001-eight.json"]
    record = read_record(tmp_path / RECORDS / "0001-eight.json")
    assert record.scenario == found.flights[1].scenario
    assert record.trace_sha256 == "cd"
    assert record.settings == mambo().settings


def test_junit_has_a_case_for_each_flight(tmp_path: Path) -> None:
    """A failure has the message that the text has; counts are those of the cases."""
    summary = judged(suite(tmp_path), [row(4.0), row(1.0, crashed=1), row(1.0)])
    root = ElementTree.fromstring(junit_xml(summary))
    (found,) = root
    assert {name: found.get(name) for name in ("name", "tests", "failures", "errors", "skipped")} == {
        "name": "mine.mambo",
        "tests": "3",
        "failures": "2",
        "errors": "0",
        "skipped": "0",
    }
    assert [case.get("name") for case in found] == [flight.name for flight in summary.flights]
    assert {case.get("classname") for case in found} == {"mine.mambo.eight"}
    text = junit_xml(summary).decode("utf-8")
    assert text.startswith("<?xml version='1.0' encoding='utf-8'?>\n<testsuites tests=\"3\"")
    assert text.endswith("\n</testsuites>\n")
    assert "repeat it: mambo-nmpc fly --repeat flights/0001-eight.json, in the result folder" in text
    messages = [case.find("failure") for case in found]
    assert [None if one is None else one.get("message") for one in messages] == [
        "IAE 4 m s (bound 3)",
        "crashed",
        None,
    ]


def test_the_text_lists_some_failed_flights_and_counts_the_rest(tmp_path: Path) -> None:
    """A hundred failed flights do not hide the table."""
    path = tmp_path / "many.toml"
    path.write_text(
        "[flights.eight]\nseed = { from = 1, to = 30, count = 30 }\nbounds.iae_m_s = 1.0", "utf-8"
    )
    found = load_suite(str(path))
    text = text_of(judge(found, mambo(), [row(2.0)] * 30, None, path))
    assert text.count("fly --repeat out/flights/") == MOST_SHOWN
    assert "and 20 more failed flights, all in junit.xml" in text
    assert "many with mambo on mambo: 0 of 30 flights passed, 30 failed" in text


@pytest.mark.long
def test_a_picture_of_many_groups_has_the_rows_closest_to_their_limits(tmp_path: Path) -> None:
    """A suite of 200 groups still has a picture that can be looked at."""
    path = tmp_path / "many.toml"
    groups = [f"[flights.group-{number}]\nbounds.iae_m_s = 1.0" for number in range(200)]
    path.write_text("\n".join(groups), "utf-8")
    found = load_suite(str(path))
    rows = [row(number / 100) for number in range(200)]
    png, svg = draw_regress(judge(found, mambo(), rows, None, path).flights, tmp_path / "many")
    assert png.read_bytes().startswith(b"\x89PNG")
    drawn = svg.read_text("utf-8")
    assert "group-199: IAE" in drawn
    assert "group-139: IAE" not in drawn


def test_a_suite_without_bounds_has_a_picture_without_rows(tmp_path: Path) -> None:
    """Crashed is its only metric with a limit, which is 0 and has no share."""
    path = tmp_path / "free.toml"
    path.write_text("[baseline]\n[flights.free]\nduration_s = 10.0\n", "utf-8")
    found = load_suite(str(path))
    summary = judge(found, mambo(), [row(1.0)], None, tmp_path / "none")
    _, svg = draw_regress(summary.flights, tmp_path / "free")
    assert "holds: 0" in svg.read_text("utf-8")


def test_the_picture_shows_shares_of_limits_within_its_edges(tmp_path: Path) -> None:
    """A lost flight, and any excess of a limit of 0, are at the right edge; a count of 0 has no row."""
    found = suite(
        tmp_path, more="[flights.calm]\nseed = [1, 2]\nbounds = { refused_updates = 0, ise_m2_s = 4 }"
    )
    rows = [row(1.5), row(1e-9), row(math.nan), row(1.0), row(1.0, ise_m2_s=1e9)]
    shares = {name: _shares(checks) for name, checks in _rows(judged(found, rows).flights).items()}
    assert shares == {"eight: IAE": [0.5, 0.01, 100.0], "calm: ISE": [0.25, 100.0]}
    rows[3] = row(1.0, refused_updates=1, crashed=1)
    shares = {name: _shares(checks) for name, checks in _rows(judged(found, rows).flights).items()}
    assert shares["calm: refused updates"] == shares["calm: crashed"] == [100.0]


def test_the_summary_is_read_back(tmp_path: Path) -> None:
    """As the record that was written."""
    summary = judged(suite(tmp_path), [row(4.0), row(1.0), row(1.0)])
    assert RegressSummary.model_validate(json.loads(summary.text())) == summary


def test_a_digest_holds_what_differs_from_the_drone() -> None:
    """No default, nor what a drone's file says: a version with more keys compares with older baselines."""
    plain = _scenario_digest(Scenario(yaw_rad=0.5))
    assert plain == sha256(b'{"yaw_rad":0.5}').hexdigest()[:16]
    assert _scenario_digest(Scenario(yaw_rad=0.5, mass_kg=0.063)) == plain
    other = _scenario_digest(Scenario(vehicle=CRAZYFLIE, yaw_rad=0.5))
    assert other == _scenario_digest(Scenario(vehicle=CRAZYFLIE, yaw_rad=0.5, mass_kg=0.03))
    assert len({plain, other, _scenario_digest(Scenario(yaw_rad=0.5, mass_kg=0.07))}) == 3
