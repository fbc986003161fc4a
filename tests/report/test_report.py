"""The report: a page of whatever was run, and a message for whatever is no result."""

import contextlib
import json
import os
import re
import socket
import sqlite3
from collections.abc import Callable
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mambo_sil.experiment.campaign.store import DATABASE
from mambo_sil.experiment.faults.faults_report import FaultsSummary
from mambo_sil.flight.animation import LONGEST_S, animate
from mambo_sil.flight.traces import Trace
from mambo_sil.report.report_page import results
from mambo_sil.results.folders import SUMMARY
from mambo_sil.results.summary import Summary
from mambo_sil.results.terminal import result_text
from tests.support import command
from tests.support.command import unwrapped
from tests.support.results import HOSTILE, all_folders, campaign_folder, fly_folder, of_extensions, trace
from tests.support.tools import board_builder

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

VOID = {"meta", "input", "br", "img", "circle", "line", "path", "rect", "use"}
SEEN: dict[str, tuple[str, ...]] = {
    "fly": ("largest error", "Play", "emulated core of crazyflie: the trace equals", "wind with gusts 3 m/s"),
    "repeat": ("Repetition: PD", "✗", "the trace DIFFERS FROM the recorded one", "<dt>state</dt>", "Play"),
    "sensed": ("20, 1 lost", "7.123", "0.77", "drift, m"),
    "table2": (
        "flown PD-feedforward",
        "63.02",
        "204.2",
        "7.123",
        ">holds</span>",
        "does not hold",
        ">2.5<",
        "Play",
    ),
    "footprint": (">3000<", "is over its budget", "Arduino Mega 2560", "there is no emulator", "incomplete"),
    "sweep": (
        "closest: horizon.prediction 10, horizon.control 1",
        "2 of 6 controllers fit",
        "IAE, m s",
        "is refused: &lt;img",
    ),
    "faults": ("state NaN to the end", "crashed", "2376.50", "OK, BAD_STATE"),
    "verify": ("1 of 2 checks passed, 1 incomplete", "cppcheck is missing", "update_period_s"),
    "regress": ("1 of 2 flights passed, 1 failed", "the trace differs", "fly --repeat", ">1.5<", ">0.75<"),
    "identify": (
        "roll: good; gain 0.830",
        "pitch: refused",
        "m/s²",
        "±",
        "is refused: too calm",
        "<svg role",
    ),
    "margins": (
        "roll: tolerates 2.1 times the gain or 138 ms more delay",
        "pitch: UNSTABLE, grows e-fold in 2.00 s",
        "2 drones, drawn by",
        "roll: delay margin at the command, ms",
        ">125<",
        "<svg role",
    ),
    "diff": ("limits.tilt_rad", "vehicle mambo", "B: ", "105", "Tilt limit"),
    "campaign": ("pd: 5 cm in the mean, 0 of 4 crashed", "1 of 4", "fly --repeat", "IAE, m s"),
}
FOLDERS = all_folders()
SEEN |= {one.COMMAND: one.SEEN for one in of_extensions()}
NO_FOLDERS = {
    *("PassedSummary", "LegSummary"),
    *("PlanSummary", "PlaygroundSummary", "ReportSummary", "UnfinishedCampaign"),
}
"""Summaries that no command writes into a result folder as its own."""


class Outline(HTMLParser):
    """Reads a page: elements in order, headings' levels, ids, and whether all that is opened is closed."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element."""
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note an element without content."""
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        """Demand that the last one opened is closed."""
        assert tag in VOID or self.open.pop() == tag


def run(*arguments: str, code: int = 0) -> str:
    """Run the command, demand its exit code, and return all that it says."""
    return "".join(command.run("report", *arguments, code=code))


def made(kind: str) -> str:
    """Make a result folder in the working folder, and return its name."""
    Path(kind).mkdir()
    FOLDERS[kind](Path(kind))
    return kind


def page_of(*folders: str) -> str:
    """Return the page of folders."""
    run(*folders)
    return Path("report.html").read_text("utf-8")


def demand_sound(page: str) -> None:
    """Demand well-formed markup without a reference to anything outside, and nothing hostile in it."""
    outline = Outline(page)
    assert outline.open == []
    assert "http:" not in page
    assert "https:" not in page
    assert "url(" not in re.sub(r"url\(#[a-z0-9]+\)", "", page)
    names = [tag for tag, _ in outline.elements]
    assert not {"img", "link", "iframe", "object", "image", "base"} & set(names)
    for tag, attributes in outline.elements:
        assert "src" not in attributes, tag
        assert not any(name.startswith("on") for name in attributes), tag
        assert (attributes.get("href") or "#").startswith("#")
    ids = [attributes["id"] for _, attributes in outline.elements if attributes.get("id")]
    assert {one for _, a in outline.elements if (one := (a.get("href") or "#")[1:])} <= set(ids)
    levels = [int(tag[1]) for tag in names if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    for tag, attributes in outline.elements:
        if tag == "svg":
            assert attributes["role"] == "img"
            assert attributes["aria-label"]


def test_every_result_folder_can_be_reported() -> None:
    """Whatever a command writes into a folder; a page is no folder, nor is a plan."""

    def kinds(base: type[Summary]) -> set[type[Summary]]:
        return {base}.union(*map(kinds, base.__subclasses__()))

    found = set(results())
    own = {one for one in kinds(Summary) if one.__module__.startswith("mambo")}
    written = {one for one in own if "command" in vars(one)}
    assert {one for one in written if one.__name__ not in NO_FOLDERS} == found


def test_a_flight_far_from_its_target_has_no_tick() -> None:
    """Nobody has said how close is good, so there is no verdict unless it crashed."""
    page = page_of(made("fly"))
    assert "✓" not in page
    (flown,) = json.loads(command.run("report", "fly", "--json")[0])["results"]
    assert flown["good"] is None


def test_faults_are_counted_as_on_the_console() -> None:
    """A fault counts once, by the worse of its flights."""
    made("faults")
    (found,) = json.loads(command.run("report", "faults", "--json")[0])["results"]
    assert found["finding"] == "2 faults, 1 recovered, 1 crashed"
    summary = FaultsSummary.model_validate_json(Path("faults", SUMMARY).read_bytes())
    assert found["finding"] in unwrapped(result_text(summary.result(Path())))


@pytest.mark.first_is_quick
@pytest.mark.parametrize("kind", FOLDERS)
def test_a_folder_of_each_command_is_shown(kind: str) -> None:
    """What it found is on the page, in markup that holds, and hostile names are text."""
    page = page_of(made(kind))
    demand_sound(page)
    for word in SEEN[kind]:
        assert word in page
    assert "<img" not in page
    assert "&lt;img src=x" in page


@pytest.mark.long
def test_many_folders_make_one_page_of_headlines() -> None:
    """Each is folded, in the order asked for; only flights bring the script, once."""
    page = page_of(*map(made, FOLDERS))
    demand_sound(page)
    assert page.count('<details class="part">') == len(FOLDERS)
    assert page.count("requestAnimationFrame(step)") == 2
    assert page.index("Flight: NMPC") < page.index("Table II of the paper") < page.index("Verification of")


def test_json_has_the_overview_of_the_page() -> None:
    """Name and size of the page, and of each folder command, title, verdict and finding."""
    folders = [made("verify"), made("campaign")]
    said = command.run("report", *folders, "--json")[0]
    summary = json.loads(said, parse_constant=pytest.fail)
    assert summary["page"] == "report.html"
    assert summary["bytes"] == Path("report.html").stat().st_size
    assert [one["folder"] for one in summary["results"]] == folders
    assert [one["command"] for one in summary["results"]] == folders
    page = Path("report.html").read_text("utf-8")
    for one in summary["results"]:
        assert one["finding"] in page
        assert one["good"] is False
        assert one["missing"] == []


@pytest.mark.long
def test_the_same_folders_give_the_same_page() -> None:
    """No clock, no random ids."""
    folders = [made("sweep"), made("verify")]
    assert page_of(*folders) == page_of(*folders)


def test_a_page_runs_no_script_but_its_own() -> None:
    """The policy names the digest of the script that is there, and allows no connection."""
    page = page_of(made("verify"))
    assert "<script>" not in page
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    assert policy.startswith("default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-")


def test_data_of_a_flight_cannot_end_its_script() -> None:
    """A hostile name survives as JSON, without a tag in it."""
    page = page_of(made("fly"))
    (data,) = re.findall(r'<script type="application/json">(.*?)</script>', page, re.DOTALL)
    assert "<" not in data
    assert json.loads(data)["drones"][0]["name"] == f"NMPC, {HOSTILE}"


@pytest.mark.long
def test_missing_traces_are_named_and_the_rest_is_shown() -> None:
    """Partial results: Table II keeps its rows when the traces are gone."""
    made("table2")
    Path("table2/mambo.npz").unlink()
    page = page_of("table2")
    assert "therefore not shown: mambo.npz" in page
    assert "Play" in page
    Path("table2/pd.npz").unlink()
    page = page_of("table2")
    assert "therefore not shown: pd.npz, mambo.npz" in page
    assert page.count("Play</button>") == 1
    Path("table2/pd-feedforward.npz").unlink()
    Path("table2/pid-feedforward.npz").unlink()
    page = page_of("table2")
    assert "therefore not shown: pd.npz, pd-feedforward.npz, pid-feedforward.npz, mambo.npz" in page
    assert "Play" not in page
    assert "7.123" in page


@pytest.mark.long
def test_a_table2_of_one_pd_lacks_nothing() -> None:
    """Results of an earlier version, which flew the paper's PD alone."""
    path = Path(made("table2")) / SUMMARY
    summary = json.loads(path.read_text())
    summary["rows"] = [row for row in summary["rows"] if "feedforward" not in row["controller"]]
    path.write_text(json.dumps(summary))
    for name in ("pd-feedforward", "pid-feedforward"):
        (path.parent / f"{name}.npz").unlink()
    page = page_of("table2")
    assert "not shown" not in page
    assert "feedforward" not in page


@pytest.mark.long
def test_a_campaign_that_goes_on_is_shown_as_it_stands() -> None:
    """Without a summary: the flights so far."""
    Path("campaign").mkdir()
    campaign_folder(Path("campaign"), finished=False)
    page = page_of("campaign")
    demand_sound(page)
    assert "not finished, 4 flights so far" in page
    assert "Distribution of IAE" in page
    Path("campaign", DATABASE).unlink()
    assert "not finished, 0 flights so far" in page_of("campaign")


def test_a_lost_flight_is_shown_as_far_as_it_went() -> None:
    """Said in words, and null where there is no position."""
    Path("fly").mkdir()
    fly_folder(Path("fly"), lost=True)
    page = page_of("fly")
    assert "LOST: the drone diverged before the end" in page
    assert "[null,null,null]" in page.replace(" ", "")
    assert "NaN" not in page


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda folder: folder.rename("flight"), "fly: is not a folder; name a result folder of fly"),
        (lambda folder: (folder / SUMMARY).unlink(), "fly: has no summary.json; name a result folder"),
        (lambda folder: (folder / SUMMARY).write_text("{"), "summary.json: cannot be read as JSON"),
        (
            lambda folder: (folder / SUMMARY).write_text("[]"),
            "summary.json: is the result of no command; run one of fly, ",
        ),
        (
            lambda folder: (folder / SUMMARY).write_text('{"command": "dance"}'),
            "command = dance must be one of fly, fly --repeat, table2, ",
        ),
        (
            lambda folder: (folder / SUMMARY).write_text('{"command": "fly", "generator": "x"}'),
            "summary.json: controller is not what fly writes: Field required; run fly again",
        ),
        (lambda folder: (folder / "trace.npz").write_bytes(b"no"), "trace.npz: is no trace"),
    ],
)
def test_what_is_no_result_is_named_and_nothing_written(change: Callable[[Path], Any], message: str) -> None:
    """Exit 2 with folder or file and what was expected."""
    change(Path(made("fly")))
    said = run("fly", code=2)
    assert message in said.replace("\n", " ")
    assert not Path("report.html").exists()


def test_a_campaign_whose_flights_cannot_be_read_is_refused() -> None:
    """Text instead of a database."""
    database = Path(made("campaign"), DATABASE)
    database.write_text("flight,seed\n" * 100)
    assert "flights.sqlite: cannot be read as the database of a campaign" in run("campaign", code=2)


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        *(
            (name, lambda array: array[1:], "trace.npz: is no trace")
            for name in ("position_m", "time_s", "status", "thrust_acceleration_m_s2")
        ),
        ("target", lambda array: np.where(array == array[3], np.nan, array), "must be finite"),
        ("time_s", lambda array: np.where(array == array[3], np.inf, array), "must be finite"),
        ("time_s", lambda array: np.where(array == array[3], 9.0, array), "must rise"),
    ],
)
def test_a_trace_that_cannot_be_drawn_is_refused(
    name: str, change: Callable[[NDArray[Any]], NDArray[Any]], message: str
) -> None:
    """An array of another length, an instant that is not finite, a clock that goes back."""
    made("fly")
    with np.load("fly/trace.npz") as file:
        arrays = dict(file)
    np.savez_compressed("fly/trace.npz", **arrays | {name: change(arrays[name])})
    assert message in run("fly", code=2)


@pytest.mark.long
def test_names_that_are_no_text_or_a_formula_are_shown() -> None:
    """Half a surrogate pair, and what a picture would take for mathematics."""
    made("verify")
    path = Path("verify") / SUMMARY
    path.write_text(json.dumps(json.loads(path.read_text("utf-8")) | {"source": "a\ud800b"}), "utf-8")
    assert r"Verification of a\ud800b" in page_of("verify")
    made("campaign")
    with contextlib.closing(sqlite3.connect(Path("campaign", DATABASE))) as database:
        for key in ("crashed", "iae_m_s", "trace_sha256"):
            database.execute(f'ALTER TABLE flights RENAME COLUMN mambo_{key} TO "$^{{$_{key}"')
    for file in Path("campaign").glob("*.json"):
        file.write_text(file.read_text("utf-8").replace("mambo", "$^{$"), "utf-8")
    page = page_of("campaign")
    assert "Distribution of IAE, m s, for pd, $^{$" in page
    assert page.count("$^{$</text>") == page.count("pd</text>") == 1


def test_only_a_report_is_overwritten() -> None:
    """A file of somebody's stays as it is."""
    made("verify")
    Path("notes.html").write_text("mine")
    assert "notes.html: exists and is no report of mambo-nmpc" in run("verify", "-o", "notes.html", code=2)
    assert Path("notes.html").read_text() == "mine"
    run("verify")
    run("verify")


def test_an_output_that_cannot_be_written_is_named() -> None:
    """What is no file stays as it is; a folder that is not there is made; a link stays one."""
    made("verify")
    os.mkfifo("pipe")
    with socket.socket(socket.AF_UNIX) as made_socket:
        made_socket.bind("socket")
    Path("dangling").symlink_to("nothing")
    obstacles = {"pipe": "a pipe", "socket": "a socket", "dangling": "a link to nothing"}
    for name, kind in {**obstacles, "verify": "a folder", ".": "a folder", "/": "a folder"}.items():
        assert run("verify", "-o", name, code=2) == f"{name}: is {kind}, not a file; name one with -o\n"
    assert Path("pipe").is_fifo()
    assert Path("socket").is_socket()
    assert not Path("nothing").exists()
    run("verify")
    Path("link.html").symlink_to("report.html")
    run("verify", "-o", "link.html")
    assert Path("link.html").is_symlink()
    run("verify", "-o", "pages/report.html")
    assert Path("pages/report.html").is_file()


def test_what_moves_is_what_was_flown() -> None:
    """Positions in cm and angles in mrad, ten a second, those of the trace at these times."""
    flown = trace()
    data = animate({"PD": flown}).data
    drone = data["drones"][0]
    for sample in (0, 7, 33):
        instant = int(np.argmin(np.abs(flown.time_s - (data["start"] + sample * data["step"]))))
        assert drone["position"][sample] == pytest.approx(100 * flown.position_m[instant, 0], abs=0.051)
        assert drone["angles"][sample] == pytest.approx(1000 * flown.euler_rad[instant, 0], abs=0.51)
        assert data["target"][sample] == pytest.approx(100 * flown.target[instant, 0, :2], abs=0.051)


def test_each_pd_has_its_own_colour_on_every_page() -> None:
    """Whatever flies beside it; the NMPC has the first one."""
    flown = trace()
    assert animate({"NMPC, mambo": flown, "PD": flown, "PD-feedforward": flown}).hues == [0, 1, 2]
    assert animate({"PD-feedforward": flown}).hues == [2]


def test_the_view_holds_the_target_and_does_not_follow_a_stray() -> None:
    """A drone 100 m off leaves the picture, which stays as wide as the target makes it."""
    flown = trace()
    x = 100 * flown.target[:, 0, 0]
    left, _, width, _ = animate({"PD": flown}).above.box
    assert left < x.min()
    assert left + width > x.max()
    flown.position_m[-1, 0, 0] = 100.0
    assert animate({"PD": flown}).above.box[2] < 4 * width


def test_a_long_flight_is_shown_in_part() -> None:
    """So that the page stays small; it says so."""
    flown = trace()
    times = np.linspace(0.0, 1000.0, len(flown.time_s))
    shown = animate({"PD": Trace(**{**vars(flown), "time_s": times})})
    assert shown.shown_s == LONGEST_S
    assert not shown.whole
    assert len(shown.data["target"]) == 2001


def luminance(colour: str) -> float:
    """Return the relative luminance of a colour as #rrggbb (WCAG 2.2)."""
    parts = [int(colour[first : first + 2], 16) / 255 for first in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return float(np.dot(linear, [0.2126, 0.7152, 0.0722]))


def test_colours_are_told_from_the_paper_by_weak_eyes_too() -> None:
    """Contrast of at least 4.5 for text and 3 for lines, in light, in the dark and in print (WCAG AA)."""
    palettes = re.findall(r"--paper: [^}]*", page_of(made("verify")))
    assert len(palettes) == 3
    for palette in palettes:
        colours = dict(re.findall(r"--(\w+): (#\w{6})", palette))
        for name in ("ink", "quiet", "flown", "other", "good", "bad", "open", "fourth", "target"):
            low, high = sorted((luminance(colours[name]), luminance(colours["paper"])))
            assert (high + 0.05) / (low + 0.05) >= (3.0 if name == "target" else 4.5), (name, palette)


@pytest.mark.long
def test_what_the_commands_write_is_read() -> None:
    """The commands whose summaries no function writes, for real, and one page of their folders."""
    board_builder("crazyflie")
    small = ["--vary", "cost.response_time_s=0.2:0.2:1"]
    for line in (
        ["fly", "--duration-s", "12", "-o", "fly"],
        ["fly", "--controller", "pd", "--start", "take-off", "--duration-s", "2", "-o", "pd"],
        ["footprint", "--board", "crazyflie", "-o", "footprint"],
        ["sweep", "--board", "crazyflie", *small, "-o", "sweep"],
    ):
        command.run(*line)
    page = page_of("fly", "pd", "footprint", "sweep")
    demand_sound(page)
    assert "Not shown" not in page
    assert page.count("Play</button>") == 2


@pytest.mark.long
def test_no_warning_of_a_library_reaches_the_user(tmp_path: Path) -> None:
    """Neither of matplotlib's log, which cannot keep its cache, nor of its pictures and settings."""
    folders = [made("fly"), made("table2"), made("margins")]
    Path("matplotlibrc").write_text("nonsense: 1\n", "utf-8")
    (tmp_path / "no-folder").write_text("", "utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MPLCONFIGDIR", str(tmp_path / "no-folder"))
        done = command.command("report", *folders)
    assert (done.returncode, done.stderr) == (0, "")
