"""The commands that fly, used as a person would: what they print, write, and say when it goes wrong."""

import csv
import json
import subprocess
import sys
from pathlib import Path

import pytest

from sil.loop import Flight
from sil.traces import CSV_COLUMNS, read_npz


def command(*arguments: str | Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run mambo-nmpc in `folder`."""
    script = "from sil.cli import main; main()"
    line = [sys.executable, "-c", script, *map(str, arguments)]
    return subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False)


def test_a_flight_leaves_trace_metrics_and_pictures(tmp_path: Path) -> None:
    """CSV and NPZ of the same length, a summary, PNG and SVG; the metrics on stdout."""
    done = command("fly", "--duration-s", "2", "-o", "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "IAE" in done.stdout
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
    assert tuple(rows[0]) == CSV_COLUMNS
    assert len(rows) == len(trace.time_s) == 201
    assert (out / "flight.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (out / "flight.svg").read_text()


def test_reference_and_compiled_flights_print_the_same(tmp_path: Path) -> None:
    """--controller reference flies the very same flight as the C."""
    flights = [
        command("fly", "--duration-s", "1", "--controller", kind, "--json", "-o", kind, folder=tmp_path)
        for kind in ("nmpc", "reference")
    ]
    metrics = [json.loads(flight.stdout)["metrics"] for flight in flights]
    assert metrics[0] == metrics[1]


@pytest.mark.parametrize("trajectory", ["gerono", "lissajous", "circle", "hover", "step"])
def test_every_curve_flies(trajectory: str, tmp_path: Path) -> None:
    """Each named trajectory, with wind, heading, motor lag and a start from the ground."""
    options = ["--wind", "0.2,-0.1", "--yaw-rad", "0.5", "--motor-lag-s", "0.02", "--start", "take-off"]
    done = command(
        "fly", "--trajectory", trajectory, *options, "--duration-s", "1", "--json", folder=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["lost"] is False


def test_waypoints_fly(tmp_path: Path) -> None:
    """A CSV file is a trajectory."""
    (tmp_path / "way.csv").write_text("time_s,x_m,y_m\n0,0,0\n1,0.2,0.1\n")
    done = command("fly", "--trajectory", "way.csv", "--duration-s", "2", folder=tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["mamba"], "did you mean mambo"),
        (["--trajectory", "triangle"], "--trajectory triangle must be bernoulli"),
        (["--trajectory", "none.csv"], "none.csv: cannot be read"),
        (["--wind", "strong"], "--wind strong must be two numbers, as in 0.5,0"),
        (["--wind", "nan,0"], "--wind = nan must be a finite number"),
        (["--yaw-rad", "inf"], "--yaw-rad = inf must be a finite number"),
        (["--duration-s", "0"], "duration_s = 0 must be finite and at least"),
        (["-o", "taken"], "taken: holds files that are not our results"),
        (["-o", "a-file"], "a-file: cannot be written"),
    ],
)
def test_bad_input_gets_a_message_and_exit_2(arguments: list[str], message: str, tmp_path: Path) -> None:
    """One line, no traceback, nothing written."""
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "thesis.tex").write_text("years of work")
    (tmp_path / "a-file").write_text("")
    before = sorted(tmp_path.rglob("*"))
    done = command("fly", *arguments, folder=tmp_path)
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert sorted(tmp_path.rglob("*")) == before


def test_an_update_period_that_no_tick_meets_is_refused(tmp_path: Path) -> None:
    """A controller at 100/3 Hz cannot run on ticks of 5 ms: message, exit 2."""
    (tmp_path / "odd.toml").write_text("[horizon]\nupdate_period_s = 0.012\n")
    done = command("fly", "odd.toml", folder=tmp_path)
    assert (done.returncode, "whole multiple" in done.stderr) == (2, True)


def test_a_missing_compiler_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit 2, and what to install."""
    monkeypatch.setenv("CC", "no-such-compiler")
    done = command("fly", "--duration-s", "1", folder=tmp_path)
    assert done.returncode == 2
    assert "no-such-compiler" in done.stderr
    assert "Traceback" not in done.stderr


def test_flying_again_overwrites_our_own_results(tmp_path: Path) -> None:
    """The second flight into a folder replaces the first."""
    for duration in ("1", "2"):
        done = command("fly", "--duration-s", duration, folder=tmp_path)
        assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "flight" / "summary.json").read_text())["duration_s"] == 2


def test_table2_judges_the_claims(tmp_path: Path) -> None:
    """The PD row is reproduced, table1 and mambo beat the claim, the printed step does not fly."""
    done = command("table2", "--json", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    verdicts = {
        claim["text"].split(" improves")[0]: claim["holds"] for claim in json.loads(done.stdout)["claims"]
    }
    assert verdicts == {
        "the PD of Table II flies Bernoulli 0.5 rad/s": True,
        "the PD of Table II flies Bernoulli 0.25 rad/s": False,
        "the PD of Table II flies Gerono 0.25 rad/s": False,
        "mambo": True,
        "table1": True,
        "table1-printed": False,
    }
    assert (tmp_path / "table2" / "figure3.png").is_file()


def test_the_default_flight_is_the_table_2_case() -> None:
    """100 s, as in the paper."""
    assert Flight.__dataclass_fields__["duration_s"].default == 100.0
