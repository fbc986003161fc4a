"""The command `identify`, as a user types it."""

import json
import re
from pathlib import Path

import pytest

from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.toml_file import parse_document
from mambo_sil.drone.vehicles.vehicle_sections import FirstOrderAttitude
from mambo_sil.drone.vehicles.vehicle_toml import load
from mambo_sil.model.identify.curves import read_curves
from tests.support.command import run
from tests.support.logs import Flown, Truth, crazyflie_columns, fly, write_log

TRUTH = Truth()
FILES = {"model.toml", "vehicle.toml", "fit.csv", "fit.png", "fit.svg", "summary.json"}


def made(name: str, flown: Flown, seed: int = 1) -> str:
    """Write the log of a flight, and return its name."""
    write_log(fly(TRUTH, flown, 1, seed)[0], Path(name))
    return name


def names(folder: str) -> set[str]:
    """Return the names of the files in a folder."""
    return {path.name for path in Path(folder).iterdir()}


@pytest.mark.long
def test_a_log_becomes_a_model() -> None:
    """Text, files, settings that are valid, and a vehicle with what was found."""
    said, talk = run("identify", made("a.csv", Flown()), "-o", "out")
    assert names("out") == FILES
    assert "out: model.toml, vehicle.toml, fit.csv" in talk
    for words in (
        "gain ",
        "lag + dead time, ms",
        "good",
        "acceleration per tilt",
        "drag",
        "a.csv: 30.0 s used",
    ):
        assert words in said
    assert "--manoeuvre" not in said
    settings = controller_toml.read(Path("out/model.toml"))
    summary = json.loads(Path("out/summary.json").read_text("utf-8"))
    assert settings.model.roll_gain == summary["model"]["roll_gain"] == pytest.approx(0.83, abs=0.02)
    assert settings.model.pitch_delay_s == pytest.approx(0.09, abs=0.01)
    assert settings.model.roll_trim_rad == pytest.approx(0.01, abs=0.01)
    vehicle = parse_document(Path("out/vehicle.toml").read_text("utf-8"), "vehicle.toml")
    assert vehicle["attitude"]["kind"] == "first_order"
    assert vehicle["attitude"]["roll"]["gain"] == summary["model"]["roll_gain"]
    assert vehicle["attitude"]["acceleration_per_tilt_g"] == summary["model"]["acceleration_per_tilt"]
    assert vehicle["body"]["drag_1_s"] == summary["model"]["drag_1_s"]
    assert vehicle["attitude"].keys().isdisjoint({"roll_trim_rad", "pitch_trim_rad"}), "the heading stands"
    _, talk = run("design", "out/vehicle.toml", code=2)
    assert "out/vehicle.toml: body.mass_kg is missing; add it" in talk
    text = Path("out/vehicle.toml").read_text("utf-8")
    Path("out/vehicle.toml").write_text(text.replace("# mass_kg = ", "mass_kg = 0.03"), "utf-8")
    uncertainty = load("out/vehicle.toml").uncertainty
    assert uncertainty is not None
    assert uncertainty.roll_gain == float(f"{summary['roll']['first_order']['gain']['within']:.2g}")
    missing = {key for key, width in uncertainty.model_dump().items() if width is None}
    not_flown = {"thrust_gain", "thrust_lag_s", "roll_trim_rad", "pitch_trim_rad"}
    assert missing == {*not_flown, "roll_split_s", "pitch_split_s"}
    curves = read_curves(Path("out/fit.csv"))
    assert curves["time_s"][-1] > summary["split_s"] > 10.0


@pytest.mark.long
def test_a_vehicle_that_is_data_is_identified_again() -> None:
    """What `fly --vehicle` simulates is what its trace shows, and what vehicle.toml says again."""
    run("identify", "--manoeuvre", "eight.csv")
    drone = ("crazyflie", "--vehicle", "crazyflie-flown")
    run("fly", *drone, "--trajectory", "eight.csv", "--duration-s", "30", "--no-pictures", "-o", "flight")
    run("identify", "flight/trace.csv", "-o", "out", "--mass-kg", "0.03")
    assert load("out/vehicle.toml").body.mass_kg == 0.03
    truth, found = load("crazyflie-flown").attitude, load("out/vehicle.toml").attitude
    assert isinstance(truth, FirstOrderAttitude)
    assert isinstance(found, FirstOrderAttitude)
    for one, other in ((truth.roll, found.roll), (truth.pitch, found.pitch)):
        assert other.gain == pytest.approx(one.gain, abs=0.005)
        assert other.lag_s + other.dead_time_s == pytest.approx(one.lag_s + one.dead_time_s, abs=0.002)
    assert found.acceleration_per_tilt_g == pytest.approx(truth.acceleration_per_tilt_g, abs=0.01)


@pytest.mark.long
def test_the_screen_says_what_is_written() -> None:
    """The vehicle of a loop with an integrator has none: its gain, lag and dead time are printed, too."""
    run("identify", "--manoeuvre", "eight.csv")
    run("fly", "--trajectory", "eight.csv", "--duration-s", "20", "--no-pictures", "-o", "flight")
    said, _ = run("identify", "flight/trace.csv", "-o", "out", "--mass-kg", "0.1")
    settings, vehicle = controller_toml.read(Path("out/model.toml")), load("out/vehicle.toml").attitude
    assert isinstance(vehicle, FirstOrderAttitude)
    columns = (re.split(" {2,}", line) for line in said.splitlines())
    rows = {name: " ".join(cells).split() for name, *cells in columns}
    assert float(rows["integrator, 1/s"][0]) == pytest.approx(settings.model.roll_integral_1_s, abs=0.005)
    flown = vehicle.roll
    times = f"{1e3 * flown.lag_s:.0f} + {1e3 * flown.dead_time_s:.0f} ms"
    assert " ".join(rows["without it, vehicle.toml"]).startswith(f"{flown.gain:.3f}, {times}")


@pytest.mark.long
def test_json_is_the_summary() -> None:
    """And the same logs give the same files."""
    log = made("a.csv", Flown(duration_s=20.0))
    said, _ = run("identify", log, "-o", "out", "--json")
    first = {path.name: path.read_bytes() for path in Path("out").iterdir()}
    assert said == first["summary.json"].decode()
    run("identify", log, "-o", "out")
    assert {path.name: path.read_bytes() for path in Path("out").iterdir()} == first


@pytest.mark.long
def test_two_logs_of_a_crazyflie_are_pooled() -> None:
    """The client's CSV needs no option; what was read is said, and why a third log is left out."""
    for name, flown in zip(("a.csv", "b.csv"), fly(TRUTH, Flown(duration_s=16.0), 2), strict=True):
        write_log(crazyflie_columns(flown), Path(name))
    Path("broken.csv").write_text("time_s,roll_rad\n0,0\n", "utf-8")
    said, _ = run("identify", "a.csv", "b.csv", "broken.csv", "-o", "out")
    assert "left out: broken.csv: has no column for roll_command_rad" in said
    assert "a.csv: 16.0 s used; roll_command_rad = deg*controller.roll" in said
    assert "yaw_rad = -deg*stateEstimate.yaw" in said
    assert "b.csv: units, signs and axes agree with the motion" in said


@pytest.mark.long
def test_a_log_without_excitation_is_refused_with_advice() -> None:
    """Exit 1, no model; the picture is there, and what an earlier run left is not."""
    run("identify", made("good.csv", Flown(duration_s=16.0)), "-o", "out")
    hover = made("hover.csv", Flown(duration_s=16.0, size_m=0.0, sines_rad=0.0))
    said, talk = run("identify", hover, "-o", "out", code=1)
    assert names("out") == FILES - {"model.toml", "vehicle.toml"}
    assert "roll is refused: commanded by" in said
    assert "mambo-nmpc identify --manoeuvre eight.py" in said
    assert "model.toml" not in talk


@pytest.mark.long
def test_a_contradiction_is_mended_as_the_message_says() -> None:
    """The option that it names makes the same model as a sound log."""
    log = fly(TRUTH, Flown(duration_s=16.0), 1)[0]
    write_log(log, Path("sound.csv"))
    write_log(log | {"pitch_rad": -57.29577951308232 * log["pitch_rad"]}, Path("odd.csv"))
    said, talk = run("identify", "odd.csv", "-o", "odd", code=2)
    assert (said, Path("odd").exists()) == ("", False)
    first = talk.split("--columns ")[1].strip()
    _, talk = run("identify", "odd.csv", "-o", "odd", "--columns", first, code=2)
    second = talk.split("--columns ")[1].strip()
    assert (first, second) == ("pitch_rad=deg*pitch_rad", "pitch_rad=-deg*pitch_rad")
    run("identify", "odd.csv", "-o", "odd", "--columns", second)
    run("identify", "sound.csv", "-o", "sound")
    odd, sound = (json.loads(Path(f"{name}/summary.json").read_text())["model"] for name in ("odd", "sound"))
    assert odd == pytest.approx(sound, rel=1e-3, abs=1e-5)


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("identify", "name a flight log, or --manoeuvre FILE"),
        ("identify a.csv --manoeuvre b.py", "is used without logs"),
        ("identify --mass-kg 0.03 --manoeuvre b.py", "is used without logs"),
        ("identify a.csv --mass-kg 0", "--mass-kg"),
        ("identify a.csv --columns roll_rad", "must be SIGNAL=COLUMN"),
        ("identify --manoeuvre b.txt", "must end in .csv"),
        ("identify no.csv", "there is no such file"),
        ("identify a.csv -o a.csv", "a.csv"),
    ],
)
def test_a_wrong_line_is_refused(line: str, words: str, tmp_path: Path) -> None:
    """Exit 2, what to do instead, and nothing written."""
    made("a.csv", Flown(duration_s=12.0))
    said, talk = run(*line.split(), code=2)
    assert (said, words in talk) == ("", True), talk
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


def test_the_manoeuvre_is_written() -> None:
    """As waypoints or as a script."""
    assert "python eight.py" in run("identify", "--manoeuvre", "eight.py")[0]
    assert "44 s of waypoints" in run("identify", "--manoeuvre", "eight.csv")[0]
    assert names(".") == {"eight.py", "eight.csv"}
