"""`fly --controller FILE.py:CLASS`: a class of a file flies."""

import json
import shutil
from pathlib import Path

import pytest

from tests.support.command import run, unwrapped

LAWS = """
from gains import POSITION, VELOCITY


class Pd:
    update_period_s = 0.02

    def step(self, state, target):
        error_m, error_m_s = target.position_m - state.position_m, target.velocity_m_s - state.velocity_m_s
        x, y, _ = target.acceleration_m_s2 + POSITION * error_m + VELOCITY * error_m_s
        return y / 9.81, -x / 9.81


class Own(Pd):
    pass


class Ending(Pd):
    steps = 0

    def step(self, state, target):
        self.steps += 1
        if self.steps > 50:
            raise RuntimeError("no more")
        return super().step(state, target)


class Needing:
    def __init__(self, gain):
        pass


class Idle:
    pass


class Odd(Pd):
    update_period_s = 0.0071
"""
LINE = ("--vehicle", "crazyflie", "--duration-s", "4", "--no-pictures")


@pytest.fixture(autouse=True)
def _laws() -> None:
    Path("laws.py").write_text(LAWS, "utf-8")
    Path("gains.py").write_text("POSITION, VELOCITY = 6.0, 4.0\n", "utf-8")


def test_a_class_of_a_file_flies() -> None:
    """At its own period, with what lies beside it; table and summary name it, and no settings."""
    said, _ = run("fly", "--controller", "laws.py:Pd", *LINE)
    assert said.startswith("laws.py:Pd on crazyflie: ")
    summary = json.loads(Path("flight/summary.json").read_text("utf-8"))
    assert summary["controller"] == "laws.py:Pd"
    assert summary["source"] is summary["settings"] is None
    assert summary["update_period_s"] == 0.02
    assert summary["metrics"]["rms_error_m"] < 0.15


def test_a_law_that_raises_loses_the_drone() -> None:
    """With the sentence that says why."""
    said, why = run("fly", "--controller", "laws.py:Ending", *LINE, code=1)
    assert "LOST: the drone diverged" in said
    assert "1 s: law.step: RuntimeError: no more" in unwrapped(why)


@pytest.mark.parametrize(
    ("named", "words"),
    [
        ("gone.py:Pd", "gone.py:Pd: there is no file gone.py"),
        ("laws.py:Gone", "laws.py:Gone: the file has no Gone"),
        ("laws.py:Needing", "laws.py:Needing: TypeError: Needing.__init__() missing 1"),
        ("laws.py:Idle", "laws.py:Idle: Idle has no method step(state, target)"),
        ("laws.py:Odd", "laws.py:Odd: update_period_s = 0.0071 must be a whole multiple"),
        ("nmcp", "nmcp is none of nmpc, pd, pd-feedforward, pid-feedforward, reference, FILE.py:CLASS"),
    ],
)
def test_what_is_no_law_is_refused(named: str, words: str) -> None:
    """In a sentence."""
    _, said = run("fly", "--controller", named, *LINE, code=2)
    assert words in unwrapped(said.replace("\u2502", ""))


def test_a_law_takes_no_module_s_place() -> None:
    """Whatever its file is called; and it flies on no board."""
    Path("json.py").write_text(LAWS, "utf-8")
    run("fly", "--controller", "json.py:Pd", *LINE)
    _, said = run("fly", "--controller", "laws.py:Pd", "--on", "crazyflie", *LINE, code=2)
    assert "--on crazyflie runs the C: use it with --controller nmpc only" in unwrapped(said)


def test_settings_beside_a_law_are_refused() -> None:
    """It has none."""
    _, said = run("fly", "mambo", "--controller", "laws.py:Pd", code=2)
    assert "mambo: --controller laws.py:Pd has no settings; leave it out" in unwrapped(said)


CAMPAIGN = """
controllers = ["pd", "laws.py:Own", "laws.py:Ending"]
[flight]
vehicle = "crazyflie"
duration_s = 3.0
rate_rad_s = 0.5
[draws]
yaw_rad = 0.0
"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fly a campaign of three controllers, one of which fails in each flight."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "gains.py").write_text("POSITION, VELOCITY = 6.0, 4.0\n", "utf-8")
    (folder / "laws.py").write_text(LAWS, "utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN, "utf-8")
    said, why = run("campaign", str(folder / "campaign.toml"), "--flights", "6", "-o", str(folder / "out"))
    assert "Own: " in said
    assert "0 of 6 crashed" in said
    assert "in the mean, 6 of 6 crashed" in said
    assert "Ending failed in 6 flights, as in flight 0, 1.02 s: law.step: RuntimeError: no more" in unwrapped(
        why
    )
    return folder


def test_a_campaign_flies_it_beside_others(whole: Path) -> None:
    """One that fails ends its own flights, the same seeds of the others go on."""
    summary = json.loads((whole / "out/summary.json").read_text("utf-8"))
    crashed = {name: one["crashed"]["count"] for name, one in summary["controllers"].items()}
    assert crashed == {"pd": 0, "Own": 0, "Ending": 6}
    of_pd, of_law = (summary["controllers"][name]["quantiles"]["iae_m_s"]["0.5"] for name in ("pd", "Own"))
    assert of_law < 0.5 * of_pd
    header, *rows = (whole / "out/flights.csv").read_text("utf-8").splitlines()
    assert len(rows) == 6
    assert len({len(row.split(",")) for row in (header, *rows)}) == 1


def test_a_flight_of_a_campaign_is_repeated(whole: Path) -> None:
    """From its record, and from the database; of a law that fails with the reason."""
    record = min((whole / "out/flights").glob("*-Own.json"))
    other = record.with_name(record.name.replace("-Own", "-Ending"))
    other.unlink()
    said, _ = run("fly", "--repeat", str(record), "--no-pictures")
    assert "repetition: the trace equals the recorded one, bit for bit" in said
    said, why = run("fly", "--repeat", str(other), "--no-pictures", "-o", "again", code=1)
    assert "repetition: the trace equals the recorded one, bit for bit" in said
    assert "s: law.step: RuntimeError: no more" in unwrapped(why)


def test_a_changed_law_is_another_campaign(whole: Path) -> None:
    """What is in the folder was flown by the file as it was."""
    laws = whole / "laws.py"
    laws.write_text(LAWS + "\n", "utf-8")
    _, why = run("campaign", str(whole / "campaign.toml"), "--flights", "6", "-o", str(whole / "out"), code=2)
    laws.write_text(LAWS, "utf-8")
    assert "holds another campaign, with controllers[1].law.sha256" in unwrapped(why)
    (whole / "gains.py").write_text("POSITION, VELOCITY = 6.0, 4.5\n", "utf-8")
    _, why = run("campaign", str(whole / "campaign.toml"), "--flights", "6", "-o", str(whole / "out"), code=2)
    (whole / "gains.py").write_text("POSITION, VELOCITY = 6.0, 4.0\n", "utf-8")
    assert "holds another campaign, with controllers[1].law.sha256" in unwrapped(why)


def test_a_campaign_may_be_moved(whole: Path, tmp_path: Path) -> None:
    """With its law: the same command goes on there, and its flights are repeated from there."""
    moved = shutil.copytree(whole, tmp_path / "moved")
    before = (moved / "out/flights.csv").read_bytes()
    run("campaign", str(moved / "campaign.toml"), "--flights", "6", "-o", str(moved / "out"))
    assert (moved / "out/flights.csv").read_bytes() == before
    assert json.loads((moved / "out/campaign.json").read_text("utf-8"))["laws"]["Own"].startswith(str(moved))


def test_laws_in_two_folders_have_helpers_of_their_own(tmp_path: Path) -> None:
    """Of the same name: each flies with the gains beside it."""
    means = {}
    for name, gain in (("a", 6.0), ("b", 2.0)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "gains.py").write_text(f"POSITION, VELOCITY = {gain}, 4.0\n", "utf-8")
        (tmp_path / name / "laws.py").write_text(LAWS.replace("class Own", f"class Own{name}"), "utf-8")
        text = CAMPAIGN.replace('"laws.py:Own", "laws.py:Ending"', f'"{name}/laws.py:Own{name}"')
        Path("one.toml").write_text(text, "utf-8")
        run("campaign", "one.toml", "--flights", "2", "-o", name * 2)
        found = json.loads(Path(name * 2, "summary.json").read_text("utf-8"))
        means[name] = found["controllers"][f"Own{name}"]["quantiles"]["iae_m_s"]["0.5"]
    both = '"a/laws.py:Owna", "b/laws.py:Ownb"'
    Path("both.toml").write_text(CAMPAIGN.replace('"laws.py:Own", "laws.py:Ending"', both), "utf-8")
    run("campaign", "both.toml", "--flights", "2", "-o", "both")
    found = json.loads(Path("both/summary.json").read_text("utf-8"))["controllers"]
    assert {name: found[f"Own{name}"]["quantiles"]["iae_m_s"]["0.5"] for name in "ab"} == means
    assert means["a"] < 0.8 * means["b"]


@pytest.mark.parametrize(
    ("named", "sentence"),
    [
        ("gone.py:Pd", "there is no file"),
        ("laws.py:Idle", "Idle has no method step(state, target)"),
        ("laws.py:Odd", "update_period_s = 0.0071 must be a whole multiple"),
        ("laws.py:Own", "two are called Own"),
        ("laws.py", "laws.py must be laws.py:CLASS, a law of your own"),
    ],
)
def test_a_campaign_names_a_bad_one(named: str, sentence: str) -> None:
    """With its place in the file, before anything flies."""
    text = CAMPAIGN.replace("laws.py:Ending", named)
    Path("campaign.toml").write_text(text, "utf-8")
    _, why = run("campaign", "campaign.toml", "--flights", "2", code=2)
    assert unwrapped(why).startswith("campaign.toml: controllers: ")
    assert sentence in unwrapped(why)
