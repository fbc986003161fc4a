"""fly.py on the desk with a curve that is too quick for the drone: its time runs slower, its path stays."""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from mambo_codegen.toolchain import host_toolchain
from mambo_sil.board.desk import desk_library
from mambo_sil.board.desk.desk_flight import Desk, DeskConditions
from mambo_sil.drone.vehicles import vehicle_toml
from tests.support.bundles import write_target
from tests.support.derived import settings_for
from tests.support.scripts import DeskDrone, modules_of, ready_on_desk, run

SETTINGS = settings_for(vehicle_toml.preset("crazyflie"), exact=True)
HEAVY = {"mass_kg": 0.036}


@pytest.fixture(scope="module")
def app() -> Path:
    """Return the library of the app with the settings that `design crazyflie` writes."""
    return desk_library.build(SETTINGS, host_toolchain())


@pytest.fixture
def scripts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, ModuleType]:
    """Return the scripts of these settings, in an empty working folder."""
    folder = write_target("crazyflie", SETTINGS, tmp_path / "app")
    monkeypatch.chdir(tmp_path)
    return modules_of(folder, monkeypatch)


def fly(
    app: Path, scripts: dict[str, ModuleType], patch: pytest.MonkeyPatch, drone: dict[str, Any], *flown: str
) -> tuple[DeskDrone, int]:
    """Fly a figure on the desk; return drone and exit code."""
    desk = Desk(app, DeskConditions(seed=1, camera_offset_ms=3, **drone))
    desk.run(1500)
    found = ready_on_desk(scripts, patch, desk)
    return found, run(scripts, *flown)


@pytest.mark.parametrize("how", [(), ("--stream",)], ids=["uploaded", "streamed"])
def test_a_curve_that_is_too_quick_is_slowed_down(
    how: tuple[str, ...],
    app: Path,
    scripts: dict[str, ModuleType],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A drone of 36 g on a circle at 2.4 rad/s is 0.6 m off; slowed down, it ends near, and lands."""
    drone, code = fly(app, scripts, monkeypatch, HEAVY, "circle", "--rate", "2.4", *how)
    said = [
        line for line in capsys.readouterr().out.splitlines() if line.startswith("The figure is too quick")
    ]
    assert code == 0
    assert 1 <= len(said) <= 3
    assert drone.desk is not None
    assert drone.desk.console.count("too quick: the thrust does not carry this curve") >= 1
    assert drone.desk.state.position_m[2] < 0.02
    assert np.max(drone.off_m[-800:]) < 0.1
    assert len(drone.of("upload")) == (0 if how else 1 + len(said))


def test_a_drone_that_carries_the_curve_flies_it_as_it_is(
    app: Path,
    scripts: dict[str, ModuleType],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """An eight at 1.2 rad/s, which asks for 6.3 m/s^2."""
    drone, code = fly(app, scripts, monkeypatch, {}, "eight", "--size", "2", "--rate", "1.2")
    assert code == 0
    assert "too quick" not in capsys.readouterr().out
    assert np.max(drone.off_m) < 0.1


def test_the_path_stays_when_time_runs_slower(scripts: dict[str, ModuleType]) -> None:
    """Every place of the slowed figure is one of the figure, to half a centimetre; speeds do not jump."""
    figures, plan = scripts["figures"], scripts["fly"].arguments
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["fly.py", "eight", "--size", "2", "--rate", "1.2"])
        pieces = figures.pieces_of(plan(), (0.0, 0.0, 0.0, 0.0))
    slower = figures.slow_down(pieces, 10, 0.85)

    def motions(of: Any, order: int) -> Any:
        times_s = np.arange(0.0, figures.length_s(of), 0.005)
        return np.array([[axis[order] for axis in figures.at(of, time_s)[:3]] for time_s in times_s])

    places, path = motions(slower, 0), motions(pieces, 0)
    away = [np.min(np.linalg.norm(path - place, axis=1)) for place in places[::20]]
    assert np.max(away) < 0.012
    assert np.max(np.abs(np.diff(motions(slower, 1), axis=0))) < 0.06
    assert np.linalg.norm(places[-1] - path[-1]) < 1e-9
    fastest = [figures.fastest(of)[1] for of in (pieces[14:-1], slower[14:-1])]
    assert fastest[1] == pytest.approx(0.85**2 * fastest[0], rel=0.01)
