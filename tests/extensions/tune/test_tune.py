"""Tuning: tune.toml, objectives, interrupted studies, Pareto front and the controller found."""

import csv
import json
import math
import shutil
import signal
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from random import Random

import pytest

from mambo_codegen.errors import INTERRUPTED, ForeignFilesError, InvalidSettingsError
from mambo_codegen.settings import controller_toml, presets
from mambo_extensions.tune import tuning_file
from mambo_extensions.tune.study import (
    CRASH_ERROR_M,
    DRAWN_AT_RANDOM,
    IAE_ALLOWANCE,
    ROUND,
    RULE,
    FinishedTrial,
    choose,
    finished_trials,
    judge,
    open_study,
    owner_of,
    pareto_front,
    propose,
    search,
)
from mambo_extensions.tune.tune_command import tune
from mambo_extensions.tune.tuning_report import controller_text, front_csv, judge_trials, summarise
from mambo_sil.errors import StudyError
from mambo_sil.experiment.campaign.executors import Pool
from mambo_sil.experiment.campaign.store import claim
from mambo_sil.results.blocks import Sentence
from tests.support.command import command, run
from tests.support.tools import require_module

TRIALS = 3
TUNE = """
base = "mambo-1norm"
flights = 1
flight.duration_s = 1.0
[search]
cost.effort_weight = { log_uniform = [0.1, 1000.0] }
optimizer.initial_step_rad = { uniform = [0.001, 0.02] }
optimizer.iterations = { choice = [4, 5] }
"""


@pytest.fixture(scope="module", name="source")
def _source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the tune.toml of a study with short flights."""
    require_module("optuna")
    path = tmp_path_factory.mktemp("source") / "tune.toml"
    path.write_text(TUNE)
    return path


@pytest.fixture(scope="module", name="whole")
def _whole(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run that study without interruption."""
    folder = tmp_path_factory.mktemp("whole")
    claim(folder, "study", {"command": "tune", **tuning_file.read(source).document()})
    search_on_threads(source, folder)
    tune(source, output=folder, trials=TRIALS)
    return folder


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    """Return a copy of that study's folder."""
    return shutil.copytree(whole, tmp_path / "out")


def search_on_threads(
    source: Path,
    folder: Path,
    trials: int = TRIALS,
    *,
    storage: str | None = None,
    progress: Callable[[int], None] = lambda _: None,
) -> list[FinishedTrial]:
    """Run a study on two threads of this process; return the finished trials."""
    tuning = tuning_file.read(source)
    with open_study(tuning, folder, storage) as study, ThreadPoolExecutor(2) as threads:
        owner, pool = owner_of(folder, storage), Pool(threads, 2, lambda _: None)
        search(tuning, study, owner, trials, pool=pool, progress=progress)
        return finished_trials(study)


def found_in(folder: Path, source: Path, storage: str | None = None) -> list[FinishedTrial]:
    """Return the finished trials of a study."""
    with open_study(tuning_file.read(source), folder, storage) as study:
        return finished_trials(study)


def one(number: int, iae_m_s: float, variation_rad: float) -> FinishedTrial:
    """Return a trial."""
    return FinishedTrial(number, {"cost.effort_weight": 1.0}, iae_m_s, variation_rad, 0)


def row(iae_m_s: float, variation_rad: float, crashed: int = 0) -> dict[str, float | str]:
    """Return the results of a flight."""
    keys = ("tuned_iae_m_s", "tuned_command_variation_rad", "tuned_crashed")
    return dict(zip(keys, (iae_m_s, variation_rad, crashed), strict=True))


@pytest.mark.long
def test_the_search_starts_at_the_base_and_stays_in_its_ranges(source: Path, whole: Path) -> None:
    """The first trial is the base; in all trials, settings that are not searched are the base's."""
    tuning = tuning_file.read(source)
    found = found_in(whole, source)
    assert [trial.number for trial in found] == list(range(TRIALS))
    assert tuning.settings(found[0].values) == tuning.base == presets.preset("mambo-1norm")
    for trial in found:
        settings = tuning.settings(trial.values)
        assert 0.1 <= settings.cost.effort_weight <= 1000.0
        assert settings.optimizer.iterations in (4, 5)
        assert settings.model == tuning.base.model
    assert len({trial.values["cost.effort_weight"] for trial in found}) == TRIALS


@pytest.mark.long
def test_an_extended_study_has_the_same_trials(source: Path, whole: Path, tmp_path: Path) -> None:
    """Two trials, extended to three, equal three trials at once."""
    assert len(search_on_threads(source, tmp_path, 2)) == 2
    assert search_on_threads(source, tmp_path) == found_in(whole, source)


@pytest.mark.long
def test_folders_share_a_storage(source: Path, whole: Path, tmp_path: Path) -> None:
    """A second folder with the same URL has the trials of the first and no database of its own."""
    url = f"sqlite:///{whole / 'study.db'}"
    assert search_on_threads(source, tmp_path, storage=url) == found_in(whole, source)
    assert list(tmp_path.iterdir()) == []


def test_the_folder_has_front_picture_and_a_controller_that_loads(source: Path, whole: Path) -> None:
    """controller.toml is the chosen point of the front, and its head names trial, study and seed."""
    rows = list(csv.DictReader((whole / "front.csv").read_text().splitlines()))
    picked = [line for line in rows if line["chosen"] == "1"]
    assert len(picked) == 1
    settings = controller_toml.read(whole / "controller.toml")
    assert settings.cost.effort_weight == float(picked[0]["cost.effort_weight"])
    found = found_in(whole, source)
    chosen = choose(found)
    assert chosen is not None
    assert settings == tuning_file.read(source).settings(chosen.values)
    head = " ".join((whole / "controller.toml").read_text().split("[horizon]")[0].replace("#", "").split())
    assert f"trial {picked[0]['trial']} of {TRIALS} in study mambo-nmpc-" in head
    assert "seed 1:" in head
    assert (whole / "front.png").read_bytes().startswith(b"\x89PNG")
    assert (whole / "front.svg").is_file()


@pytest.mark.long
def test_a_finished_study_prints_its_result_only(source: Path, whole: Path, folder: Path) -> None:
    """Base and chosen point are printed, progress only on a terminal; no trial is flown again."""
    said, talk = run("tune", str(source), "--trials", str(TRIALS), "-o", str(folder))
    lines = said.splitlines()
    assert lines[0].startswith("trial ")
    assert " in the mean, the base " in lines[0]
    assert [line.split()[0] for line in lines[-3:]] == ["trial", "base", "chosen"]
    assert talk.count("\n") == 1
    assert (folder / "controller.toml").read_bytes() == (whole / "controller.toml").read_bytes()


@pytest.mark.long
def test_the_summary_is_what_json_prints(source: Path, folder: Path) -> None:
    """It has base, chosen trial and front, with the values of controller.toml."""
    said, _ = run("tune", str(source), "--trials", str(TRIALS), "-o", str(folder), "--json")
    assert said == (folder / "summary.json").read_text()
    summary = json.loads(said, parse_constant=pytest.fail)
    assert (summary["command"], summary["trials"], summary["base"]["number"]) == ("tune", TRIALS, 0)
    settings = controller_toml.read(folder / "controller.toml")
    assert summary["chosen"]["values"]["cost.effort_weight"] == settings.cost.effort_weight
    assert summary["chosen"] in summary["front"]


def test_machines_that_share_a_study_propose_different_trials(source: Path, tmp_path: Path) -> None:
    """Two folders that ask at the same moment get different values, but for the base."""
    tuning, url = tuning_file.read(source), f"sqlite:///{tmp_path / 'shared.db'}"
    owners = [owner_of(tmp_path / name, url) for name in ("one", "two")]
    with open_study(tuning, tmp_path, url) as study:
        first = [propose(tuning, study, owner).params for owner in owners]
        study.add_trial(propose(tuning, study, owners[0]))
        second = [propose(tuning, study, owner).params for owner in owners]
        again = propose(tuning, study, owners[1]).params
    assert first[0] == first[1] == tuning.start
    assert second[0] != second[1] == again


def test_folders_of_another_study_or_other_files_are_refused(
    source: Path, whole: Path, tmp_path: Path
) -> None:
    """A folder with another study, or with foreign files, raises `ForeignFilesError`."""
    other = tmp_path / "tune.toml"
    other.write_text(source.read_text().replace("flights = 1", "flights = 2"))
    with pytest.raises(ForeignFilesError, match="holds another study, with flights = 1 instead of 2"):
        tune(other, output=whole, trials=1)
    with pytest.raises(ForeignFilesError, match="not from a mambo-nmpc study"):
        tune(other, output=tmp_path, trials=1)


def test_missing_optuna_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message says how to install it for the Python that runs; no folder is made."""
    monkeypatch.setitem(sys.modules, "optuna", None)
    with pytest.raises(StudyError, match=r"^tuning needs Optuna; install it: .* -m pip install optuna$"):
        tune(output=tmp_path / "out", trials=1)
    assert not (tmp_path / "out").exists()


@pytest.mark.first_is_quick
@pytest.mark.parametrize("url", [None, "nonsense", "nosuch://host/db", "sqlite:////no/such/folder/a.db"])
def test_a_database_that_refuses_access_is_reported(url: str | None, source: Path, tmp_path: Path) -> None:
    """The message is one line that names option or study.db and shows the form of a URL."""
    (tmp_path / "study.db").write_text("no database at all, but long enough to be looked at as one" * 100)
    named = r"[^\n]*study\.db" if url is None else "--storage"
    with (
        pytest.raises(StudyError, match=rf"^{named}: the database refused [^\n]*postgresql://[^\n]*$"),
        open_study(tuning_file.read(source), tmp_path, url),
    ):
        pass


def test_a_crashed_flight_counts_as_worst() -> None:
    """A crashed flight is assigned the bounds of both objectives, and no other flight exceeds them."""
    crashed, means = judge([row(1.0, 0.01), row(0.5, 0.001, crashed=1), row(1e9, 9.0)], 20.0, 0.35)
    assert crashed == 1
    worst = (CRASH_ERROR_M * 20.0, 4 * 0.35)
    assert means == pytest.approx(((1.0 + 2 * worst[0]) / 3, (0.01 + 2 * worst[1]) / 3))
    crashed, means = judge([row(math.nan, math.nan, crashed=1)], 20.0, 0.35)
    assert (crashed, means) == (1, worst)


def test_the_front_is_pareto_optimal_and_the_choice_follows_the_rule() -> None:
    """The front is sorted by IAE and has equal trials once; within 10 % the least variation is chosen."""
    best, calm, calmest = one(3, 1.0, 0.5), one(1, IAE_ALLOWANCE, 0.2), one(0, 1.2, 0.1)
    front = pareto_front([calmest, calm, one(2, 1.1, 0.3), best, one(4, 1.0, 0.5), one(5, 1.05, 0.6)])
    assert front == [best, calm, calmest]
    assert choose(front) == calm
    assert choose(front[:1]) == best


def test_the_choice_is_among_trials_that_keep_their_margins() -> None:
    """Also a trial that another beats, which keeps none; it asks of no more trials than it needs."""
    trials = [one(0, 1.0, 0.2), one(1, 1.04, 0.5), one(2, 1.1, 0.3), one(3, 1.12, 0.1), one(4, 2.0, 0.05)]
    asked: list[int] = []

    def keeps(trial: FinishedTrial) -> bool:
        asked.append(trial.number)
        return trial.number not in (0, 3)

    assert choose(trials, keeps) == trials[2]
    assert 4 not in asked
    assert choose(trials, lambda _: False) is None


@pytest.mark.long
def test_the_closest_trial_is_not_chosen_without_its_margins() -> None:
    """A response time on the edge, which is the closest, stands in the front with what it tolerates."""
    tuning = tuning_file.default()
    quick = tuning.start | {"cost.response_time_s": 0.1}
    trials = [
        FinishedTrial(0, tuning.start, 1.0, 0.002, 0),
        FinishedTrial(1, quick, 0.5, 0.001, 0),
    ]
    judged = judge_trials(tuning, trials)
    assert (judged.chosen.number, judged.keeps_margins) == (0, True)
    assert [trial.number for trial in judged.front] == [1, 0]
    first, _second = csv.DictReader(front_csv(judged).splitlines())
    assert first["chosen"] == "0"
    assert float(first["gain_margin"]) == pytest.approx(1.5, abs=0.01)
    said = summarise(tuning, trials, judged).result(Path()).blocks[0]
    assert said == Sentence(
        f"chosen: {RULE}, of trials without a loop more than 20 % worse than with preset mambo"
    )
    alone = judge_trials(tuning, trials[1:])
    assert (alone.chosen.number, alone.keeps_margins, alone.base) == (1, False, None)
    assert "MARGINS NOT KEPT: every trial has a loop" in controller_text(tuning, trials[1:], alone).replace(
        "\n# ", " "
    )


ONE_NORM = 'base = "mambo-1norm"\n'
FAULTS = {
    "fligths = 1": "fligths is not a key of this file; did you mean flights?",
    "flights = 0": "flights = 0 must lie in 1..1000",
    'base = "mamba"': "base: mamba is neither a preset nor a file",
    "draws.mass_kg = -1": "draws.mass_kg = -1 must lie in 0.01..1",
    "search.cost.effort = 1": "search.cost.effort = 1 must name a number of a controller.toml",
    "search.observer.age_s = 1": "search.observer.age_s = 1 is now observer.measurement_age_s",
    "search.code.prefix = 1": "search.code.prefix = 1 must name a number",
    "search.cost.effort_weight = 1": "search.cost.effort_weight = 1 must name a number of a controller.toml",
    "search.horizon.update_period_s = 0.01": "update_period_s = 0.01 must name a number",
    ONE_NORM + "search.cost.effort_weight = 3.0": "search.cost.effort_weight = 3.0 must be a range",
    ONE_NORM + "search.cost.effort_weight = { uniform = [2, 3] }": "must include the base's 1: ",
    ONE_NORM + "search.horizon.control = { uniform = [1, 3] }": "must be a whole number or { choice",
    ONE_NORM + "search.horizon.control = { choice = [2, 60] }": "must lie in 1..50",
    ONE_NORM + "search.horizon.control = { choice = [2, 20] }": "a combination of the ranges' ends is",
    "search = {}": "search must have 1 to 10 keys",
}


@pytest.mark.parametrize(("text", "message"), FAULTS.items())
def test_a_fault_names_file_key_value_and_rule(text: str, message: str, tmp_path: Path) -> None:
    """An error in tune.toml raises `InvalidSettingsError` before any flight."""
    path = tmp_path / "tune.toml"
    path.write_text(text)
    with pytest.raises(InvalidSettingsError) as caught:
        tuning_file.read(path)
    assert str(caught.value).startswith("/")
    assert message in str(caught.value)
    assert "tune.toml: " in str(caught.value)


def test_no_trial_of_the_default_study_costs_more_than_its_base(tmp_path: Path) -> None:
    """With a 1-norm the largest horizons and iteration count of the search are those of the base."""
    path = tmp_path / "tune.toml"
    path.write_text('base = "mambo-1norm"')
    tuning = tuning_file.read(path)
    for key in ("horizon.prediction", "horizon.control", "optimizer.iterations"):
        assert max(tuning.search[key].numbers) == tuning.start[key]


def test_the_documented_study_is_the_default_one(tmp_path: Path) -> None:
    """The tune.toml in docs/reference/campaign-toml.md equals the default study."""
    text = (Path(__file__).parents[3] / "docs" / "reference" / "campaign-toml.md").read_text("utf-8")
    text = text.partition("## Studies: tune.toml")[2]
    path = tmp_path / "tune.toml"
    path.write_text(text.split("```toml\n")[1].split("```")[0])
    assert tuning_file.read(path) == tuning_file.default()


STOPPED = """
import os, signal
from optuna import Study
from mambo_nmpc.__main__ import main
tell = Study.tell
def tell_and_stop(self, *arguments, **options):
    tell(self, *arguments, **options)
    os.killpg(0, signal.SIGINT)
Study.tell = tell_and_stop
main()
"""


@pytest.mark.long
def test_a_study_resumes_after_ctrl_c(source: Path, whole: Path, tmp_path: Path) -> None:
    """Ctrl-C, which also signals the workers, exits with 130 and one line."""
    arguments = ("tune", source, "--trials", TRIALS, "--workers", 2, "-o", tmp_path)
    done = command(*arguments, script=STOPPED)
    assert done.returncode == INTERRUPTED
    assert done.stdout == ""
    assert done.stderr.endswith(
        f"stopped with 1 of {TRIALS} trials finished; the same command continues from there\n"
    )
    assert done.stderr.count("\n") == 1
    run(*map(str, arguments))
    assert found_in(tmp_path, source) == found_in(whole, source)
    assert (tmp_path / "controller.toml").read_bytes() == (whole / "controller.toml").read_bytes()


KILLED = """
import os, signal, sys
from sqlalchemy import event
from sqlalchemy.engine import Engine
from mambo_nmpc.__main__ import main
left = int(sys.argv.pop(1))
@event.listens_for(Engine, "commit")
def kill_before_commit(connection):
    global left
    left -= 1
    if left == 0:
        os.kill(os.getpid(), signal.SIGKILL)
main()
"""


@pytest.mark.long
def test_a_study_killed_again_and_again_equals_an_undisturbed_one(source: Path, tmp_path: Path) -> None:
    """Killed before any transaction, also after the random trials, it proposes the same trials again."""
    trials = DRAWN_AT_RANDOM + ROUND
    whole, folder = tmp_path / "whole", tmp_path / "killed"
    whole.mkdir()
    search_on_threads(source, whole, trials)
    random, kills = Random(0), 0
    arguments = ("tune", source, "--trials", trials, "--workers", 1, "-o", folder)
    while (done := command(random.randint(50, 130), *arguments, script=KILLED)).returncode != 0:
        assert done.returncode == -signal.SIGKILL, done.stderr
        kills += 1
    assert kills >= 3
    assert found_in(folder, source) == found_in(whole, source)
