"""fly.py on the desk with a curve that is too quick for the drone: its time runs slower, its path stays."""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from mambo_codegen.toolchain import host_toolchain
from mambo_extensions.crazyflie.desk import desk_library
from mambo_extensions.crazyflie.desk.desk_flight import Desk, DeskConditions
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.errors import FlightError
from tests.extensions.crazyflie.support.scripts import DeskDrone, figure_of, modules_of, ready_on_desk, run
from tests.support.bundles import write_target
from tests.support.derived import settings_for

SETTINGS = settings_for(vehicle_toml.preset("crazyflie"), exact=True)
HEAVY: dict[str, Any] = {"mass_kg": 0.036}


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


@pytest.mark.parametrize(
    "how",
    [pytest.param((), id="uploaded"), pytest.param(("--stream",), id="streamed")],
)
def test_a_curve_that_is_too_quick_is_slowed_down(
    how: tuple[str, ...],
    app: Path,
    scripts: dict[str, ModuleType],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A drone of 36 g leaves a circle at 2.4 rad/s; slowed down, it ends near, and lands.

    What is uploaded slows down a second later: the pieces still to come are written first.
    """
    drone, code = fly(app, scripts, monkeypatch, HEAVY, "circle", "--rate", "2.4", *how)
    said = [
        line for line in capsys.readouterr().out.splitlines() if line.startswith("The figure is too quick")
    ]
    assert code == 0
    assert 1 <= len(said) <= 3
    assert drone.desk is not None
    assert drone.desk.console.count("thrust limits the tilt: too quick a curve") >= 1
    assert drone.desk.state.position_m[2] < 0.02
    assert np.max(drone.off_m) < (0.5 if how else 0.65)
    assert np.max(drone.off_m[-800:]) < 0.1
    assert (len(drone.of("upload")) > 29) is (not how)


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


def test_steps_that_are_refused_say_nothing_of_the_thrust(app: Path) -> None:
    """The limits of the last one that was accepted stand for them."""
    desk = Desk(app, DeskConditions(seed=1, **HEAVY))
    desk.run(1500)
    desk.take_off(1.0, 2.0)
    desk.run(3000)
    while int(desk.log("nmpc.limits")) & 32 == 0:
        desk.full_state(np.array([[6.0, 0.0, 1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]))
        desk.run(5)
    desk.yield_()
    desk.go_to((1e4, 0.0, 1.0), 0.01)
    for _ in range(70):
        desk.run(10)
        assert desk.log("nmpc.tooQuick") == 0
    assert desk.log("nmpc.status") == 3
    assert int(desk.log("nmpc.limits")) & 32


def test_the_desk_takes_as_many_pieces_as_the_memory_holds(app: Path) -> None:
    """More would be written beyond it."""
    desk = Desk(app, DeskConditions())
    desk.write_pieces(np.zeros((31, 33)))
    for first, count in ((0, 32), (31, 1), (-1, 2)):
        with pytest.raises(FlightError, match="the memory holds 31"):
            desk.write_pieces(np.zeros((count, 33)), first)


def test_the_path_stays_when_time_runs_slower(scripts: dict[str, ModuleType]) -> None:
    """Every place of the slowed figure is one of the figure, to half a centimetre; motions do not jump."""
    figures = scripts["figures"]
    figure = figure_of(scripts, "eight", "--size", "2", "--rate", "1.2")
    pieces = figures.pieces_of(figure, (0.0, 0.0, 0.0, 0.0))
    slower = figures.slow_down(pieces, 10, 0.85)

    def motions(of: Any, order: int) -> Any:
        times_s = np.arange(0.0, figures.length_s(of), 0.002)
        return np.array([[axis[order] for axis in figures.at(of, time_s)[:3]] for time_s in times_s])

    places, path = motions(slower, 0), motions(pieces, 0)
    away = [np.min(np.linalg.norm(path - place, axis=1)) for place in places[::50]]
    assert np.max(away) < 0.005
    for order, largest in (
        (0, 3.0),
        (1, 8.0),
    ):  # m/s, m/s^2: what a place or a speed changes by in 2 ms is its rate
        assert np.max(np.abs(np.diff(motions(slower, order), axis=0))) < 0.002 * largest
    assert np.linalg.norm(places[-1] - path[-1]) < 1e-9
    fastest = [figures.fastest(of)[1] for of in (pieces[14:-1], slower[14:-1])]
    assert fastest[1] == pytest.approx(0.85**2 * fastest[0], rel=0.01)
