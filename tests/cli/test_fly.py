"""The command `fly`, used as a person would: what it prints, writes, and says when it goes wrong."""

import csv
import json
import re
from pathlib import Path

import pytest

from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.loop import fly
from mambo_sil.flight.names import PD_NAMES, PdName
from mambo_sil.flight.scenario import Record, Scenario, flight_of, write_record
from mambo_sil.flight.traces import CSV_COLUMNS, SEEN_COLUMNS, read_npz
from tests.support.command import MAIN, command, run, unwrapped
from tests.support.one_norm import ONE_NORM

PLAIN = ("--json", "--no-pictures")


def test_a_flight_leaves_trace_metrics_and_pictures(tmp_path: Path) -> None:
    """CSV and NPZ of the same length, a summary, PNG and SVG; the metrics on stdout."""
    assert "IAE" in run("fly", "--duration-s", "2", "-o", "out")[0]
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} == {
        "trace.csv",
        "trace.npz",
        "flight.png",
        "flight.svg",
        "summary.json",
    }
    trace = read_npz(out / "trace.npz")
    rows = list(csv.DictReader((out / "trace.csv").read_text().splitlines()))
    assert tuple(rows[0])[: len(CSV_COLUMNS)] == CSV_COLUMNS
    assert list(rows[0])[-1] == "target_known"
    assert len(rows) == len(trace.time_s) == 201
    assert (out / "flight.png").read_bytes().startswith(b"\x89PNG")
    drawn = (out / "flight.svg").read_text()
    assert "bernoulli, 2 m, 0.5 rad/s, 2 s, state true, no wind" in drawn
    assert "in the first 10 s" not in drawn


def test_the_axis_of_the_error_is_for_what_follows_the_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The picture says how large the error was before; its title says what flies where."""
    monkeypatch.chdir(tmp_path)
    run("fly", "--duration-s", "12", "--wind", "gusts", "-o", "out")
    drawn = Path("out/flight.svg").read_text("utf-8")
    assert "NMPC, mambo on mambo, one flight: " in drawn
    assert "wind 7.72 m/s<" in drawn
    (found,) = re.findall(r"up to (\S+) m in the first 10 s", drawn)
    assert float(found) == pytest.approx(
        json.loads(Path("out/summary.json").read_text())["metrics"]["max_error_m"], rel=0.01
    )


@pytest.mark.long
def test_without_pictures_the_earlier_ones_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What lies in the folder is of one flight; in NumPy its trace is the same."""
    traces = []
    for engine, options in (("c", []), ("c", ["--no-pictures"]), ("numpy", ["--no-pictures"])):
        monkeypatch.setenv("MAMBO_NMPC_ENGINE", engine)
        run("fly", "--duration-s", "1", *options, "-o", "out")
        traces.append((tmp_path / "out" / "trace.csv").read_text())
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"trace.csv", "trace.npz", "summary.json"}
    assert traces[0] == traces[1] == traces[2]


def test_reference_and_compiled_flights_print_the_same() -> None:
    """--controller reference flies the very same flight as the C."""
    nmpc, reference = (
        json.loads(run("fly", "--duration-s", "1", "--controller", kind, *PLAIN, "-o", kind)[0])
        for kind in ("nmpc", "reference")
    )
    assert nmpc["metrics"] == reference["metrics"]


@pytest.mark.parametrize(
    "trajectory",
    [
        "lissajous",
        *(pytest.param(name, marks=pytest.mark.long) for name in ("hover", "step")),
    ],
)
def test_every_kind_of_curve_flies(trajectory: str) -> None:
    """With size and rate, and without; with wind, heading, motor lag and a start from the ground."""
    options = ["--push", "0.2,-0.1", "--yaw-rad", "0.5", "--motor-lag-s", "0.02", "--start", "take-off"]
    said, _ = run("fly", "--trajectory", trajectory, *options, "--duration-s", "1", *PLAIN)
    assert json.loads(said)["lost"] is False


def test_a_seed_decides_gusts_and_noise(tmp_path: Path) -> None:
    """The same seed gives the same flight, another another; true and seen metrics are told apart."""
    options = ["--sensors", "mambo", "--wind", "gusts", "--controller", "pd", "--duration-s", "0.2", *PLAIN]
    flights = [
        run("fly", *options, "--seed", seed, "-o", f"{number}")[0]
        for number, seed in enumerate(("7", "7", "8"))
    ]
    assert flights[0] == flights[1]
    first, _, third = map(json.loads, flights)
    assert first["metrics"] != first["metrics_as_seen"]
    assert first["metrics"] != third["metrics"]
    assert (first["seed"], first["sensors"], first["push_m_s2"]) == (7, "mambo", [0, 0])
    header = (tmp_path / "0" / "trace.csv").read_text().splitlines()[0]
    assert header == ",".join((*CSV_COLUMNS, *SEEN_COLUMNS))


def test_polynomial_pieces_fly(tmp_path: Path) -> None:
    """A CSV file with a duration in its header has pieces, and a bad one is named by its line."""
    header = ",".join(("Duration", *(f"{axis}^{k}" for axis in ("x", "y", "z", "yaw") for k in range(8))))
    piece = tmp_path / "piece.csv"
    piece.write_text(f"{header}\n2,0,0.1,0.05{',0' * 29}\n")
    run("fly", "--trajectory", "piece.csv", "--duration-s", "3", "--no-pictures")
    piece.write_text(f"{header}\n2{',0' * 32}\n-1{',0' * 32}\n")
    _, said = run("fly", "--trajectory", "piece.csv", "--no-pictures", code=2)
    assert "piece.csv: line 3: duration = -1.0 must be a number of seconds" in unwrapped(said)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["mamba"], "did you mean mambo"),
        (["--trajectory", "triangle"], "--trajectory triangle must be bernoulli"),
        (["--trajectory", "none.CSV"], "none.CSV: cannot be read: No such file or directory\n"),
        (
            ["--wind", "0.5,0"],
            "--wind 0.5,0 must be none, gusts or a speed in m/s; a steady acceleration is --push X,Y",
        ),
        (["--push", "strong"], "--push strong must be two numbers, as in 0.5,0"),
        (["--seed", "-1"], "--seed = -1 must lie in 0.."),
        (["--repeat", "none.json"], "none.json: cannot be read: No such file or directory"),
        (["--push", "nan,0"], "--push = nan must be a finite number"),
        (["--yaw-rad", "inf"], "--yaw-rad = inf must be a finite number"),
        (["--yaw-rad", "90"], "must lie in -6.28319..6.28319; it is in radians: for 90 degrees write 1.571"),
        (["--yaw-rad", "-7"], "for -7 degrees write -0.1222"),
        (["--yaw-rad", "361"], "--yaw-rad = 361.0 must lie in -6.28319..6.28319"),
        (["--motor-lag-s", "nan"], "--motor-lag-s = nan must be a finite number; it must lie in 0..1"),
        (["--size-m", "1e4"], "--size-m = 10000.0 must lie in -1000..1000"),
        (["--duration-s", "0"], "--duration-s = 0.0 must lie in 0.01..3600"),
        (["--duration-s", "1e9"], "--duration-s = 1000000000.0 must lie in 0.01..3600"),
        (["--size-m", "900"], "the target's speed along an axis, up to 450 m/s, exceeds ranges.velocity_m_s"),
        (
            ["odd.toml"],
            "odd.toml: horizon.update_period_s = 0.012 must be a whole multiple of 0.005; the inner",
        ),
        (["-o", "taken"], "taken: holds files that are not results of mambo-nmpc"),
        (["-o", "a-file"], "a-file: is a file, or inside one"),
    ],
)
def test_bad_input_gets_a_message_and_exit_2(arguments: list[str], message: str, tmp_path: Path) -> None:
    """One line, no traceback, nothing written."""
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "thesis.tex").write_text("years of work")
    (tmp_path / "a-file").write_text("")
    (tmp_path / "odd.toml").write_text("[horizon]\nupdate_period_s = 0.012\n")
    before = sorted(tmp_path.rglob("*"))
    said, talk = run("fly", *arguments, code=2)
    assert (said, message in talk, "Traceback" in talk) == ("", True, False), talk
    assert sorted(tmp_path.rglob("*")) == before


def test_the_summary_says_what_flew(tmp_path: Path) -> None:
    """A PD has no settings, a hover no size; the time is a whole number of periods, which is also said."""
    (tmp_path / "way.csv").write_text("time_s,x_m,y_m\n0,0,0\n1,0.2,0.1\n")
    line = ["--controller", "pd", "--trajectory", "hover", "--duration-s", "0.015"]
    said, talk = run("fly", *line, *PLAIN)
    flown = json.loads(said)
    assert "--duration-s = 0.015: flown 0.02 s, a whole number of update periods of 0.01 s" in talk
    found = [flown[key] for key in ("settings", "source", "size_m", "rate_rad_s", "duration_s")]
    assert found == [None, None, None, None, 0.02]
    said, talk = run("fly", "--trajectory", "step", "--duration-s", "0.57", *PLAIN)
    flown = json.loads(said)
    assert [flown[key] for key in ("source", "size_m", "rate_rad_s", "duration_s")] == [
        "mambo",
        2,
        None,
        0.57,
    ]
    assert "--duration-s" not in talk


def test_a_refusing_controller_is_an_explained_failure(tmp_path: Path) -> None:
    """More than half of the inputs refused: exit 1, with the range that was exceeded."""
    (tmp_path / "deaf.toml").write_text("[ranges]\nthrust_acceleration_min_m_s2 = 20.0\n")
    said, _ = run(
        "fly", "deaf.toml", "--controller", "reference", "--duration-s", "1", "--no-pictures", code=1
    )
    said = unwrapped(said)
    assert "101 steps: thrust out of range, 9.81..9.81 m/s^2, but ranges" in said
    assert "thrust_acceleration_* = 20..50; the drone kept the last command" in said
    assert "NOT CONTROLLED" in said


def test_a_crash_is_a_failure_that_says_when_and_how(tmp_path: Path) -> None:
    """Motors too slow for the stock roll loop: exit 1, the time and the tilt, in the summary too."""
    said, _ = run("fly", "--motor-lag-s", "0.2", "--duration-s", "2", "--no-pictures", code=1)
    line = unwrapped(said[said.index("CRASHED") : said.index("whole flight")])
    crash = json.loads((tmp_path / "flight" / "summary.json").read_text())["crash"]
    assert line == f"CRASHED at {crash['time_s']:.2f} s: {crash['how']}"
    assert 0.0 < crash["time_s"] < 2.0
    assert "the thrust limit no longer carries the weight" in line


@pytest.mark.parametrize("pd", PD_NAMES)
def test_a_repeated_crash_is_a_failure(tmp_path: Path, pd: PdName) -> None:
    """Exit 1 although the trace is the recorded one; a record that does not crash exits 0."""
    for name, tilt_rad, code in (("upside.json", 1.2, 1), ("level.json", 0.0, 0)):
        scenario = Scenario(duration_s=0.1, start_tilt_rad=(tilt_rad, 0.0))
        flight = flight_of([scenario], 0.01)
        flown = fly(flight, pd_controller(pd, flight))
        record = Record(scenario=scenario, controller=pd, settings=ONE_NORM, trace_sha256=flown.digest())
        write_record(record, tmp_path / name)
        said, _ = run("fly", "--repeat", name, "--no-pictures", code=code)
        assert "repetition: the trace equals the recorded one" in said
        assert ("CRASHED at 0.00 s: tilted 68.8 degrees" in said) == (code == 1)


def test_refusals_during_lift_off_are_explained() -> None:
    """They belong to every start from the ground, which does well."""
    options = ["--start", "take-off", "--duration-s", "0.1", "--no-pictures"]
    assert "77 steps during lift-off: thrust out of range" in run("fly", *options)[0]


def test_a_flight_just_longer_than_the_transient_has_no_second_column() -> None:
    """10.001 s are flown as 10 s, of which nothing is left after 10 s."""
    options = ["--controller", "pd", "--duration-s", "10.001", "--no-pictures"]
    assert "after 10 s" not in run("fly", *options)[0]


def test_the_summary_repeats_the_flight(tmp_path: Path) -> None:
    """Everything asked for is in it, what was not flown is null, and stdout has the same text."""
    options = ["--controller", "pd", "--push", "90,0", "--duration-s", "40", "--trajectory", "way.csv"]
    (tmp_path / "way.csv").write_text("time_s,x_m,y_m\n0,9000,0\n")
    said, talk = run("fly", *options, *PLAIN, code=1)
    assert talk.count("\n") == 1
    assert said == (tmp_path / "flight" / "summary.json").read_text()
    summary = json.loads(said, parse_constant=pytest.fail)
    assert summary["lost"]
    assert summary["metrics"]["iae_m_s"] is None
    assert len(summary["trajectory_sha256"]) == 64
    keys = "generator command controller source settings update_period_s trajectory size_m rate_rad_s yaw_rad"
    assert set(keys.split()) < set(summary)
    assert [summary[key] for key in ("push_m_s2", "motor_lag_s", "start")] == [[90, 0], 0, "hover"]


@pytest.mark.long
def test_pictures_heed_no_settings_of_the_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither a backend that does not exist nor LaTeX, nor a name that reads like a formula."""
    monkeypatch.setenv("MPLBACKEND", "no-such-backend")
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\n")
    (tmp_path / "$x_\u65e5$.toml").write_text("[horizon]\ncontrol = 2\n")
    options = ["--controller", "reference", "--duration-s", "0.1"]
    done = command("fly", "$x_\u65e5$.toml", *options, folder=tmp_path)
    assert (done.returncode, done.stderr.count("\n")) == (0, 1), done.stderr
    assert "$x_\u65e5$.toml" in (tmp_path / "flight" / "flight.svg").read_text("utf-8")


@pytest.mark.long
def test_a_full_disk_keeps_the_earlier_results(tmp_path: Path) -> None:
    """A limit on the size of files stands for it: one line, exit 2, and the old flight is whole."""
    run("fly", "--controller", "pd", "--duration-s", "0.1")
    before = {path.name: path.read_bytes() for path in (tmp_path / "flight").iterdir()}
    script = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)); {MAIN}"
    done = command("fly", "--controller", "pd", "--duration-s", "1", folder=tmp_path, script=script)
    assert (done.returncode, done.stderr) == (2, "flight: cannot be written: File too large\n")
    assert {path.name: path.read_bytes() for path in (tmp_path / "flight").iterdir()} == before


def test_a_missing_compiler_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit 2, and what to install."""
    monkeypatch.setenv("CC", "no-such-compiler")
    _, talk = run("fly", "--duration-s", "1", code=2)
    assert "no-such-compiler" in talk
    assert "Traceback" not in talk
