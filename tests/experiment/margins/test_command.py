"""The command `margins`, run as a person would type it."""

import csv
import json
import re
from pathlib import Path
from typing import Any

import pytest

from mambo_codegen.settings.controller_toml import to_toml, with_option
from mambo_codegen.settings.presets import preset
from mambo_sil.drone.vehicles import VEHICLES, vehicle_toml
from mambo_sil.experiment.campaign.campaign_file import default
from mambo_sil.experiment.margins.many_drones import campaign_drones
from mambo_sil.experiment.margins.margins_record import PICTURES, RESPONSES
from mambo_sil.model.derive.derived_flight import chosen_text
from tests.support.command import run
from tests.support.height_settings import height_settings

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def measured(*arguments: str, code: int = 0) -> dict[str, Any]:
    """Return the summary that `margins` prints."""
    summary: dict[str, Any] = json.loads(run("margins", *arguments, "--json", code=code)[0])
    return summary


def test_the_default_has_the_margins_of_the_manual() -> None:
    """Preset mambo on the Mambo, true state: another linearisation found the same figures."""
    roll, pitch = (axis["command"] for axis in measured()["axes"])
    for loop, gain, phase_deg, delay_s, largest in (
        (roll, 2.08, 31.0, 0.137, 2.39),
        (pitch, 2.52, 44.0, 0.193, 1.88),
    ):
        assert loop["gain_up"] == pytest.approx(gain, abs=0.01)
        assert loop["phase_deg"] == pytest.approx(phase_deg, abs=0.5)
        assert loop["delay_s"] == pytest.approx(delay_s, abs=0.001)
        assert loop["delay_updates"] == pytest.approx(100.0 * loop["delay_s"])
        assert loop["sensitivity"] == pytest.approx(largest, abs=0.01)


def test_it_says_in_words_how_far_the_edge_is() -> None:
    """A sentence for each axis; with --all every figure, of both places."""
    flown = ("margins", "crazyflie", "--vehicle", "crazyflie")
    said, _ = run(*flown)
    assert "roll: tolerates 2.5 times the gain or 164 ms more delay; at the motors' torque\n" in said
    assert "gain margin up" not in said
    assert len(said.splitlines()) < 8
    said, _ = run(*flown, "--all")
    assert "command: gain margin up" in said
    assert "motors: delay margin" in said


def test_it_says_what_is_left_where_the_drone_is_seen_elsewhere() -> None:
    """A slow loop keeps its margins; of a quick one 5 cm take all."""
    said = " ".join(run("margins", "mambo")[0].split())
    assert re.search(
        r"seen elsewhere: 5 cm below, 1\.6 times the gain or 36 ms; 5 cm above, 2\.9 times the gain or "
        r"36 ms; 10 cm above, 3\.5 times the gain or 36 ms$",
        said,
    )
    Path("quick.toml").write_text(chosen_text(vehicle_toml.load("hummingbird"), "quick"), "utf-8")
    said, _ = run("margins", "quick.toml", "--vehicle", "hummingbird", "--sensors", "mocap")
    assert "seen elsewhere: 5 cm below, where roll is UNSTABLE; " in said


def test_a_drone_without_motors_is_broken_at_the_command_only() -> None:
    """The file of such a drone has no torque."""
    summary = measured("crazyflie", "--vehicle", "generic")
    assert [axis["motors"] for axis in summary["axes"]] == [None, None]
    assert summary["axes"][0]["command"]["gain_up"] == pytest.approx(2.12, abs=0.01)


def test_a_1_norm_gets_a_reason_and_no_figure() -> None:
    """It is no smooth law."""
    summary = measured("mambo-1norm")
    assert summary["axes"] is None
    assert "describing function" in summary["reason"]
    assert "describing" in run("margins", "table1")[0]


def test_an_unstable_loop_exits_1() -> None:
    """The older estimators of the Mambo leave the camera's rotation in the optical flow."""
    said, _ = run("margins", "--sensors", "mambo", code=1)
    assert "roll: UNSTABLE, grows e-fold in " in said


@pytest.mark.long
def test_results_are_pictures_and_files_that_report_shows() -> None:
    """The folder has three pictures, responses, the drawn drones and a summary; a page shows them.

    The height is the third axis, broken at the command only.
    """
    Path("c.toml").write_text(to_toml(height_settings()), "utf-8")
    drawn = ("--campaign", "default", "--drones", "3")
    said, written = run("margins", "c.toml", "--vehicle", "crazyflie", *drawn, "-o", "out")
    assert "height: gain margin at the command" in said
    assert "height: gain margin at the motors" not in said
    files = {*PICTURES, RESPONSES, "drones.csv", "summary.json"}
    assert {path.name for path in Path("out").iterdir()} == files
    assert all(name in written for name in files)
    rows = list(csv.DictReader(Path("out/drones.csv").read_text("utf-8").splitlines()))
    assert [row["drone"] for row in rows] == ["0", "1", "2"]
    assert len({row["mass_kg"] for row in rows}) == 3
    assert "height_command_gain_up" in rows[0]
    responses = Path("out", RESPONSES).read_text("utf-8")
    assert ("height,command," in responses, "roll,motors," in responses) == (True, True)
    assert "height,motors," not in responses
    many = json.loads(Path("out/summary.json").read_text("utf-8"))["many"]
    assert {one["axis"] for one in many["spreads"]} == {"roll", "pitch", "height"}
    spread = next(one for one in many["spreads"] if one["figure"] == "gain margin")
    gains = [float(row["roll_command_gain_up"]) for row in rows]
    assert (spread["worst"], spread["median"]) == pytest.approx((min(gains), sorted(gains)[1]), rel=1e-5)
    run("report", "out")
    page = Path("report.html").read_text("utf-8")
    assert "height: tolerates" in page
    assert "bode of roll, pitch and height" in page


@pytest.mark.long
def test_draws_do_not_depend_on_how_many_there_are() -> None:
    """Drone 1 of two is drone 1 of four; its sensors are those of the campaign, or given."""
    few, many = (list(campaign_drones(preset("mambo"), default(), drones)) for drones in (2, 4))
    assert len(many) == 4
    assert list(map(repr, few)) == list(map(repr, many[:2]))
    first = ("--campaign", "default", "--drones", "1")
    drawn, true = measured(*first), measured(*first, "--sensors", "true")
    assert drawn["many"]["spreads"] != true["many"]["spreads"]


def test_uncertainty_takes_the_ends_of_the_intervals() -> None:
    """Two intervals make four drones; one of those with more dead time has the least delay margin."""
    text = VEHICLES.text("crazyflie-flown") + "\n[uncertainty]\nroll_lag_s = 0.03\nroll_dead_time_s = 0.02\n"
    Path("mine.toml").write_text(text, "utf-8")
    summary = measured("crazyflie", "--vehicle", "mine.toml", "--uncertainty")
    many = summary["many"]
    assert many["drones"] == 4
    assert set(many["worst_values"]) == {"lag_s", "dead_time_s"}
    delay = next(one for one in many["spreads"] if one["figure"] == "delay margin" and one["axis"] == "roll")
    assert delay["drone"] in (1, 3)  # the ends of dead_time_s alternate
    assert delay["worst"] < summary["axes"][0]["command"]["delay_s"] - 0.015


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--uncertainty",), "vehicle mambo: has no section [uncertainty]"),
        (("--campaign", "default", "--uncertainty"), "leave out one of the two"),
        (("--campaign", "missing.toml"), "missing.toml"),
        (("--campaign", "default", "--sensors", "mocap"), '--sensors = "mocap" needs its figures'),
        (("--sensors", "mocap"), "needs its figures, [sensors], in the file of vehicle mambo"),
        (("--vehicle", ""), "must not be empty"),
        (("--drones", "0"), "Invalid value for '--drones'"),
        (("missing.toml",), "missing.toml"),
        (("slow.toml", "--vehicle", "crazyflie"), "update_period_s"),
    ],
)
def test_bad_input_is_an_error_that_names_it(arguments: tuple[str, ...], said: str) -> None:
    """Exit 2 with a message, without a traceback."""
    slow = with_option(preset("mambo"), "horizon.update_period_s", 0.025)
    Path("slow.toml").write_text(to_toml(with_option(slow, "horizon.update_period_s", 0.0125)), "utf-8")
    out, error = run("margins", *arguments, code=2)
    assert said in out + error
