"""`design`: from a drone, or from a log of one, to a controller.toml that flies it."""

import json
import re
from pathlib import Path

import pytest

from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.presets import load
from tests.support.command import run, unwrapped

DRONE = """\
[body]
mass_kg = 0.1
drag_1_s = 0.1

[attitude]
kind = "first_order"
acceleration_per_tilt_g = 0.95
roll = { gain = 0.9, lag_s = 0.06, dead_time_s = 0.05 }
pitch = { gain = 0.9, lag_s = 0.06, dead_time_s = 0.05 }
"""


@pytest.mark.long
def test_it_writes_a_file_that_flies() -> None:
    """And says what to do next, and for which drone the settings are."""
    Path("mine.toml").write_text(DRONE, "utf-8")
    _, said = run("design", "mine.toml")
    wrote, *height, reach, flown, pushed, seen, roll, pitch, least = said.splitlines()
    assert wrote == "wrote controller.toml; next: mambo-nmpc fly controller.toml"
    height_text = unwrapped("\n".join(height))
    assert height_text.startswith(
        "height: not in the settings, since the thrust is not known; by its altitude"
    )
    assert reach == "largest horizontal acceleration: 4.5 m/s^2, by limits.tilt_rad = 0.5"
    assert flown == "flown for 10 s: stays at its target (true state)"
    assert pushed == "bears a steady push of 4 m/s^2 from every side"
    assert re.fullmatch(r"bears to be seen \d+ cm below and \d+ cm above where sensors\.lever_m says", seen)
    assert re.fullmatch(r"roll: tolerates [\d.]+ times the gain or \d+ ms more delay \(true state\)", roll)
    assert pitch == roll.replace("roll", "pitch")
    assert re.fullmatch(r"least margin: (roll|pitch), .* at the command", least)
    assert Path("controller.toml").read_text("utf-8").startswith("# For vehicle mine.toml, derived")
    run("fly", "controller.toml", "--no-pictures", "--duration-s", "20")
    assert json.loads(Path("flight/summary.json").read_text("utf-8"))["metrics"]["max_error_m"] < 0.2


@pytest.mark.long
def test_a_log_gives_settings_with_two_commands() -> None:
    """`identify`, then `design`: the drone of the log flies closer with them than with any preset."""
    run("identify", "--manoeuvre", "eight.csv")
    drone = ("--vehicle", "crazyflie-flown", "--sensors", "mocap", "--no-pictures")
    flown = ("--trajectory", "eight.csv", "--duration-s", "30", "-o", "log")
    run("fly", "crazyflie", *drone, *flown)
    run("identify", "log/trace.csv", "-o", "identified", "--mass-kg", "0.03")
    run("design", "identified/vehicle.toml")
    errors = {}
    for source in ("controller.toml", "mambo", "crazyflie"):
        run("fly", source, *drone, "--duration-s", "20")
        errors[source] = json.loads(Path("flight/summary.json").read_text("utf-8"))["metrics"]["iae_m_s"]
    assert errors["controller.toml"] < 0.7 * min(errors["mambo"], errors["crazyflie"])


@pytest.mark.long
def test_it_warns_of_slow_motors() -> None:
    """A Mambo with motors of 0.12 s crashes and is unstable through its sensors, and they are named."""
    text = run("vehicles", "mambo")[0]
    Path("slow.toml").write_text(re.sub(r"(?m)^lag_s = .*", "lag_s = 0.12", text), "utf-8")
    _, said = run("design", "slow.toml", code=1)
    assert "flown for 10 s: CRASHES after " in said
    assert "UNSTABLE" in said
    warning = "warning: a loop tolerates less than 1.5 times the gain or 30 ms more delay; the main cause is "
    assert warning in unwrapped(said)


@pytest.mark.long
def test_firm_settings_come_with_their_price() -> None:
    """After the push that they bear; the file says what is firm."""
    _, said = run("design", "crazyflie-flown", "--firm")
    assert re.search(
        r"bears a steady push of 3 m/s\^2 from every side bears to be seen .* sensors\.lever_m says "
        r"firm: a push of 0\.5 m/s\^2 moves it by \d+ mm, "
        r"with --calm by \d+; its commands change [\d.]+ times as much",
        unwrapped(said),
    )
    assert Path("controller.toml").read_text("utf-8").count("# Firm: ") == 2


@pytest.mark.long
def test_to_stdout_it_prints_the_file_alone() -> None:
    """Which is that of -o."""
    text, said = run("design", "generic", "-o", "-")
    heads = [line.partition(":")[0] for line in said.splitlines() if ":" in line]
    assert [head for head in heads if " " not in head] == ["height", "roll", "pitch"]
    run("design", "generic", "-o", "made/generic.toml")
    assert Path("made/generic.toml").read_text("utf-8") == text
    assert controller_toml.parse(text, "stdout") == load("made/generic.toml")


@pytest.mark.usefixtures("_no_tool")
def test_a_file_somebody_worked_on_stays() -> None:
    """Until --force."""
    Path("controller.toml").write_text("mine", "utf-8")
    _, said = run("design", "generic", code=2)
    assert said == "controller.toml: already exists; name another with -o, or overwrite it with --force\n"
    assert Path("controller.toml").read_text("utf-8") == "mine"
    run("design", "generic", "--force")
    assert load("controller.toml").controller.method == "quadratic"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("mass_kg = 0.1", "mass_kg = -1.0", "mine.toml: body.mass_kg = -1.0 must lie in 0.001..100"),
        (
            "roll = { gain = 0.9",
            "roll = { gain = 2.5",
            "settings for vehicle mine.toml: model.roll_gain = 2.5 must lie in 0.2..2",
        ),
    ],
)
def test_a_drone_without_settings_is_refused(old: str, new: str, said: str) -> None:
    """With file, key, value and rule; nothing is written."""
    Path("mine.toml").write_text(DRONE.replace(old, new), "utf-8")
    assert run("design", "mine.toml", code=2)[1].startswith(said)
    assert not Path("controller.toml").exists()


@pytest.mark.usefixtures("_no_tool")
def test_without_a_compiler_the_file_is_written() -> None:
    """And it says that nothing was flown."""
    _, said = run("design", "generic")
    assert load("controller.toml").controller.method == "quadratic"
    assert "neither flown nor margins: no C compiler found" in said


@pytest.mark.usefixtures("_no_tool")
def test_tilt_that_is_not_to_be_had_is_told() -> None:
    """With the reason; not where more tilt is of no use."""
    _, said = run("design", "hummingbird")
    assert "tilt: small angles, since no compiler: not flown with the exact tilt largest" in unwrapped(said)
    for vehicle in ("generic", "mambo"):
        assert "small angles" not in run("design", vehicle, "--force")[1]


def test_a_thrust_that_cannot_lift_is_refused() -> None:
    """With key, value and rule; nothing is written."""
    weak = (
        "\n[altitude]\np_n_m = 1.0\nd_n_s_m = 0.5\nthrust_max_n = 1.962\n[thrust]\ngain = 0.3\nlag_s = 0.1\n"
    )
    Path("mine.toml").write_text(DRONE + weak, "utf-8")
    for command in ("design", "margins", "fly"):
        arguments = ("mine.toml",) if command == "design" else ("crazyflie", "--vehicle", "mine.toml")
        assert run(command, *arguments, code=2)[1] == (
            "mine.toml: altitude.thrust_max_n = 1.962 must be more than 3.27, the weight of body.mass_kg "
            "over thrust.gain\n"
        )
    assert not Path("controller.toml").exists()


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("strong", "said"),
    [
        ("", "vehicle mine: altitude.thrust_max_n = 3.27 does not lift it with thrust.gain = 0.2, an end of"),
        (
            "\n[altitude]\np_n_m = 1.0\nd_n_s_m = 0.5\nthrust_max_n = 9.81\n",
            "height: a drone that hovers with 3 times the expected thrust does not hold its height",
        ),
    ],
)
def test_intervals_that_no_controller_learns_have_no_margins(strong: str, said: str) -> None:
    """Where the thrust may be a third of that in the file; the flight of the file's own drone is good."""
    wide = "\n[thrust]\ngain = 0.6\nlag_s = 0.1\n[uncertainty]\nthrust_gain = 0.4\n"
    Path("mine.toml").write_text(DRONE + strong + wide, "utf-8")
    found = unwrapped(run("design", "mine.toml")[1])
    assert "flown for 10 s: stays at its target (true state)" in found
    assert f"no margins: {said}" in found
