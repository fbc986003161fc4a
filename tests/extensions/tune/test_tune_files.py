"""The files of `tune`: what reads them, and what `design` has to do with them."""

import json
import os
from pathlib import Path

import pytest

from mambo_codegen.errors import MamboNmpcError
from mambo_codegen.settings.presets import load
from mambo_extensions.tune.tuning_file import read
from mambo_sil.drone.vehicles import vehicle_toml
from tests.support.command import run
from tests.support.tools import require_module


@pytest.mark.usefixtures("in_an_empty_folder")
def test_a_study_starts_from_a_design(monkeypatch: pytest.MonkeyPatch) -> None:
    """The tune.toml in docs/how-to/design.md holds the values that are derived for its drone."""
    text = (Path(__file__).parents[3] / "docs" / "how-to" / "design.md").read_text("utf-8")
    Path("tune.toml").write_text(text.split('```toml title="tune.toml"\n')[1].split("```")[0], "utf-8")
    monkeypatch.setenv("PATH", str(Path("bin").absolute()))  # without a compiler nothing is flown
    run("design", "crazyflie-flown")
    assert read(Path("tune.toml")).base == load("controller.toml")


def test_curves_of_files_are_the_same_in_every_folder(tmp_path: Path) -> None:
    """A study is known by their names and hashes."""
    studies = []
    for folder, x_m in (("one", 1), ("other", 1), ("changed", 3)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "points.csv").write_text(f"time_s,x_m,y_m\n0,0,0\n4,{x_m},0\n", "utf-8")
        path = tmp_path / folder / "tune.toml"
        path.write_text('[flight]\nduration_s = 5.0\ntrajectory = { choice = ["points.csv"] }\n')
        studies.append(read(path).document())
    assert studies[0] == studies[1] != studies[2]


def test_a_pipe_is_refused_without_waiting_for_its_writer(tmp_path: Path) -> None:
    """Nothing ever writes to this pipe."""
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(MamboNmpcError, match=r"pipe: cannot be read: it is a pipe or a device; name a plain"):
        read(tmp_path / "pipe")


@pytest.mark.long
@pytest.mark.usefixtures("in_an_empty_folder")
def test_a_study_states_its_drone() -> None:
    """In its summary and in its identity."""
    require_module("optuna")
    Path("mine.toml").write_text(run("vehicles", "generic")[0], "utf-8")
    text = 'flights = 1\nbase = "mambo-1norm"\n[flight]\nduration_s = 1.0\nvehicle = "mine.toml"\n'
    Path("tune.toml").write_text(text + "[search]\noptimizer.iterations = { choice = [4, 5] }\n", "utf-8")
    run("tune", "tune.toml", "--trials", "1", "--workers", "1", "-o", "out")
    drone = vehicle_toml.load("mine.toml").model_dump(mode="json")
    assert json.loads(Path("out/summary.json").read_text("utf-8"))["vehicle"] == drone
    assert json.loads(Path("out/study.json").read_text("utf-8"))["vehicle"]["name"] == "mine"
