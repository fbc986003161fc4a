"""Margins of the height: against flights, against python-control, and what a load does to them."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

from mambo_codegen.settings.controller_toml import to_toml
from mambo_codegen.settings.presets import preset
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles import VEHICLES, vehicle_toml
from mambo_sil.errors import FlightError
from mambo_sil.experiment.margins.controller_jacobian import linear_controller
from mambo_sil.experiment.margins.corners import intervals, uncertain
from mambo_sil.experiment.margins.loop_margins import open_loop, sensitivity
from mambo_sil.flight.columns import SPACE
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.thrust_controller import ThrustController, numbers_of
from tests.support.command import run
from tests.support.height_settings import height_settings
from tests.support.hover import grows, grows_with_gains, height_loop, margins_of, opened_at_the_command

HEIGHT = 2
DRONES = ["crazyflie", "generic"]
"""One whose motors have the lag that the settings model, and one whose thrust has none."""


@pytest.mark.first_is_quick
@pytest.mark.parametrize("drone", DRONES)
def test_delay_margin_decides_about_a_flight(drone: str) -> None:
    """A millimetre too high decays with 5 % less delay than the margin, and grows with 10 % more."""
    settings, vehicle = height_settings("float64"), Vehicle.from_preset(drone)
    delay_s = margins_of(settings, vehicle)[HEIGHT].command.delay_s
    less, more = (factor * delay_s / vehicle.drone.step_s for factor in (0.95, 1.1))
    assert not grows(settings, vehicle, HEIGHT, delay_ticks=math.floor(less))
    assert grows(settings, vehicle, HEIGHT, delay_ticks=math.ceil(more))


@pytest.mark.first_is_quick
@pytest.mark.parametrize("drone", DRONES)
def test_gain_margins_decide_about_a_flight(drone: str) -> None:
    """A millimetre decays with gains a little inside both margins, and grows with gains outside."""
    settings, vehicle = height_settings("float64"), Vehicle.from_preset(drone)
    found = margins_of(settings, vehicle)[HEIGHT].command
    gains = [0.95 * found.gain_up, 1.05 * found.gain_up, 1.2 * found.gain_down, 0.8 * found.gain_down]
    assert grows_with_gains(settings, vehicle, HEIGHT, gains) == [False, True, False, True]


def test_loop_is_that_of_python_control() -> None:
    """The open loop at 200 frequencies is that of the same matrices joined by python-control."""
    settings, vehicle = height_settings(), Vehicle.from_preset("crazyflie")
    system = opened_at_the_command(settings, vehicle, HEIGHT)
    rad_s = np.geomspace(0.1, 300.0, 200)
    found = open_loop(sensitivity(height_loop(settings, vehicle), rad_s))
    assert found == pytest.approx(system(np.exp(1j * rad_s * system.dt)), rel=1e-6)


@pytest.mark.parametrize("learn", ["none", "acceleration"])
def test_a_load_divides_the_gain_of_a_loop_that_does_not_learn_it(learn: str) -> None:
    """With 1.2 times the mass both gain margins are 1.2 times larger: thrust has 1/1.2 of its effect."""
    settings = height_settings(learnt=learn)
    light, heavy = (margins_of(settings, _loaded(load))[HEIGHT].command for load in (1.0, 1.2))
    assert heavy.gain_up == pytest.approx(1.2 * light.gain_up, rel=1e-4)
    assert heavy.gain_down == pytest.approx(1.2 * light.gain_down, rel=1e-4)


def test_a_load_that_is_learnt_hardly_changes_the_margins() -> None:
    """With 1.2 times the mass the gain margin falls by 6 %: only the learnt gain counts 1.2 times."""
    light, heavy = (margins_of(height_settings(), _loaded(load))[HEIGHT].command for load in (1.0, 1.2))
    assert heavy.gain_up == pytest.approx(light.gain_up, rel=0.07)
    assert heavy.sensitivity == pytest.approx(light.sensitivity, rel=0.1)


def test_a_load_that_is_learnt_leaves_roll_and_pitch() -> None:
    """Their delay margin stays within 1 % with 1.2 times the mass."""
    settings = height_settings()
    light, heavy = (margins_of(settings, _loaded(load))[0].command for load in (1.0, 1.2))
    assert heavy.delay_s == pytest.approx(light.delay_s, rel=0.01)


def test_a_slow_thrust_that_is_learnt_leaves_roll_and_pitch() -> None:
    """Also if it is learnt by a controller whose model of the thrust lags much."""
    slow = height_settings(lag_s=0.137, response_time_s=0.212, velocity_weight_s=0.24)
    found, expected = (margins_of(slow, _loaded(load))[0].command for load in (1.2, 1.0))
    assert found.delay_s == pytest.approx(expected.delay_s, rel=0.01)


@pytest.mark.parametrize(("gain", "limit"), [(0.35, 0.5), (0.9, 0.0)])
def test_a_thrust_that_cannot_be_learnt_has_no_margins(gain: float, limit: float) -> None:
    """A controller that knows nothing of it hovers somewhere else, or not at all."""
    text = VEHICLES.text("crazyflie-flown") + f"\n[thrust]\nlag_s = 0.06\ngain = {gain}\n"
    drone = Vehicle.of(
        vehicle_toml.parse(text.replace("thrust_max_n = 0.575", "thrust_max_n = 1.5"), "mine", "mine.toml")
    )
    with pytest.raises(
        FlightError, match=f"does not hold its height with height.learnt_gain_limit = {limit:g} and"
    ):
        margins_of(height_settings(learnt_gain_limit=limit), drone)
    assert margins_of(height_settings(thrust_gain=gain), drone)[HEIGHT].stable


def test_linear_controller_commands_what_the_c_commands() -> None:
    """In 100 steps of small random states commands differ from those at rest as the linear system says."""
    settings = height_settings("float64")
    system, controller = linear_controller(settings), ThrustController(CompiledController(settings, 2))
    memory, target, reported = np.zeros(len(system.a)), np.zeros((2, SPACE.target)), np.full(2, np.nan)
    states = 1e-6 * np.random.default_rng(5).standard_normal((100, 10))
    states[:, [6, 9]] = 0.0
    controller.step(np.zeros((2, 10)), target, reported)
    for state in states:
        rest, sent = numbers_of(controller.step(np.stack([np.zeros(10), state]), target, reported))
        assert system.c @ memory + system.d @ state[:9] == pytest.approx(sent - rest, rel=1e-3, abs=1e-8)
        memory = system.a @ memory + system.b @ state[:9]


def test_the_gain_of_a_thrust_is_an_inverse_load() -> None:
    """Of a drone that gets 0.8 of the demanded thrust: the height sees it, roll and pitch in hover do not."""
    text = VEHICLES.text("crazyflie-flown") + "\n[thrust]\nlag_s = 0.06\n"
    full, weak = (
        Vehicle.of(vehicle_toml.parse(text + gain, "mine", "mine.toml")) for gain in ("", "gain = 0.8\n")
    )
    for settings, axis, factor in (
        (height_settings(learnt="none"), HEIGHT, 0.8),
        (preset("crazyflie"), 0, 1.0),
    ):
        found, expected = (margins_of(settings, one)[axis].command.gain_up for one in (weak, full))
        assert found == pytest.approx(expected / factor, rel=1e-4)


@pytest.mark.usefixtures("in_an_empty_folder")
def test_command_shows_the_height_beside_roll_and_pitch() -> None:
    """Verdict, table and JSON have the third axis, with its own units, broken at the command only."""
    Path("c.toml").write_text(to_toml(height_settings()), "utf-8")
    said, _ = run("margins", "c.toml", "--vehicle", "crazyflie", "--sensors", "mocap", "--all")
    assert "height: tolerates 1.7 times the gain or 60 ms more delay\n" in said
    assert "m/s^2 per m/s^2" in said
    axes = json.loads(run("margins", "c.toml", "--vehicle", "crazyflie", "--json")[0])["axes"]
    assert [axis["axis"] for axis in axes] == ["roll", "pitch", "height"]
    assert axes[2]["motors"] is None


@pytest.mark.long
@pytest.mark.usefixtures("in_an_empty_folder")
def test_design_judges_the_height() -> None:
    """`design` prints the margins of the height, and warns of a thrust that may be quicker than modelled."""
    _, said = run("design", "crazyflie", "-o", "c.toml")
    assert "height: tolerates 1.9 times the gain or 70 ms more delay (through sensors mocap)" in said
    assert "warning" not in said
    sections = "\n[thrust]\nlag_s = 0.09\n\n[uncertainty]\nthrust_lag_s = 0.08\n"
    Path("mine.toml").write_text(VEHICLES.text("crazyflie-flown") + sections, "utf-8")
    _, said = run("design", "mine.toml", "-o", "mine-c.toml")
    assert "warning: a loop tolerates less than 1.5 times the gain" in " ".join(said.split())


def test_intervals_of_the_thrust_need_a_height() -> None:
    """Without a height the drones at the ends of intervals differ in no property of the thrust."""
    sections = "\n[thrust]\nlag_s = 0.06\n\n[uncertainty]\nroll_gain = 0.1\nthrust_lag_s = 0.05\n"
    drone = vehicle_toml.parse(VEHICLES.text("crazyflie-flown") + sections, "mine", "mine.toml")
    assert set(intervals(uncertain(drone, height=True))) == {"gain", "lag_s"}
    assert set(intervals(uncertain(drone, height=False))) == {"gain"}


def _loaded(load: float) -> Vehicle:
    """Return a Crazyflie with `load` times its mass."""
    vehicle = Vehicle.from_preset("crazyflie")
    airframe = dataclasses.replace(vehicle.airframe, mass_kg=load * vehicle.airframe.mass_kg)
    return dataclasses.replace(vehicle, airframe=airframe)
