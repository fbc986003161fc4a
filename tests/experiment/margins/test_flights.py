"""Margins against simulated flights, and against python-control on the same matrices."""

import dataclasses
import math
from typing import Any

import control
import numpy as np
import pytest

from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.presets import preset
from mambo_sil.drone.plant.vehicle import Vehicle
from tests.support.hover import grows, grows_with_gains, margins_of, opened_at_the_command

PAIRS = [("mambo", "mambo"), ("crazyflie", "crazyflie"), ("mambo", "crazyflie"), ("crazyflie", "generic")]


def in_float64(name: str) -> Any:
    """Return a preset with a scalar type whose rounding does not disturb a drone at hover."""
    return with_option(preset(name), "code.scalar", "float64")


@pytest.mark.first_is_quick
@pytest.mark.parametrize("axis", [0, 1], ids=["roll", "pitch"])
@pytest.mark.parametrize(("name", "drone"), PAIRS)
def test_delay_margin_decides_about_a_flight(name: str, drone: str, axis: int) -> None:
    """A disturbance of 1 mm decays with 5 % less delay than the margin, and grows with 10 % more."""
    settings, vehicle = in_float64(name), Vehicle.from_preset(drone)
    delay_s = margins_of(settings, vehicle)[axis].command.delay_s
    less, more = (factor * delay_s / vehicle.drone.step_s for factor in (0.95, 1.1))
    assert not grows(settings, vehicle, axis, delay_ticks=math.floor(less))
    assert grows(settings, vehicle, axis, delay_ticks=math.ceil(more))


@pytest.mark.sampled(6)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("axis", [0, 1], ids=["roll", "pitch"])
@pytest.mark.parametrize(("name", "drone"), PAIRS)
def test_gain_margin_decides_about_a_flight(name: str, drone: str, axis: int) -> None:
    """A disturbance of 1 mm decays with 5 % less gain than the margin, and grows with 10 % more."""
    settings, vehicle = in_float64(name), Vehicle.from_preset(drone)
    gain = margins_of(settings, vehicle)[axis].command.gain_up
    assert grows_with_gains(settings, vehicle, axis, [0.95 * gain, 1.1 * gain]) == [False, True]


@pytest.mark.long
def test_gain_margin_at_the_motors_is_one_of_the_inertia() -> None:
    """A drone that is harder to turn than the margin at the torque allows oscillates."""
    settings, drone = in_float64("mambo"), Vehicle.from_preset("mambo")
    margin = margins_of(settings, drone)[0].motors.gain_down
    assert 0.05 < margin < 0.5

    def with_gain(factor: float) -> Vehicle:
        x, y, z = drone.airframe.inertia_kg_m2
        airframe = dataclasses.replace(drone.airframe, inertia_kg_m2=(x / factor, y, z))
        return dataclasses.replace(drone, airframe=airframe)

    assert not grows(settings, with_gain(1.05 * margin), 0)
    assert grows(settings, with_gain(0.9 * margin), 0)
    assert margins_of(settings, with_gain(1.01 * margin))[0].stable
    assert not margins_of(settings, with_gain(0.99 * margin))[0].stable


NEAR = 1.0 + 1e-3 * np.linspace(-1.0, 1.0, 801)
"""Factors on frequencies at which python-control, which interpolates between points, needs many."""


@pytest.mark.sampled(3)
@pytest.mark.first_is_quick
@pytest.mark.parametrize("axis", [0, 1], ids=["roll", "pitch"])
@pytest.mark.parametrize(("name", "drone"), PAIRS)
def test_margins_at_the_command_are_those_of_python_control(name: str, drone: str, axis: int) -> None:
    """Gain and phase margin, crossover and largest sensitivity agree to 1e-6."""
    settings, vehicle = preset(name), Vehicle.from_preset(drone)
    found = margins_of(settings, vehicle)[axis].command
    loop = opened_at_the_command(settings, vehicle, axis)
    at = (found.crossover_rad_s, found.sensitivity_rad_s, turning_rad_s(loop))
    rad_s = np.unique(np.concatenate([np.geomspace(0.1, np.pi / loop.dt, 2000), *(one * NEAR for one in at)]))
    magnitude, phase, _ = control.frequency_response(loop, rad_s)
    gain, lead_deg, distance, _, crossover_rad_s, _ = control.stability_margins(
        (magnitude, np.degrees(phase), rad_s)
    )
    assert gain == pytest.approx(found.gain_up, rel=1e-6)
    assert lead_deg == pytest.approx(found.phase_deg, rel=1e-6)
    assert crossover_rad_s == pytest.approx(found.crossover_rad_s, rel=1e-6)
    assert 1.0 / distance == pytest.approx(found.sensitivity, rel=1e-6)


def turning_rad_s(loop: Any) -> float:
    """Return about where the phase of a loop passes -180 degrees with the largest gain."""
    rad_s = np.geomspace(1.0, np.pi / loop.dt, 1000)
    magnitude, phase, _ = control.frequency_response(loop, rad_s)
    values = magnitude * np.exp(1j * phase)
    turns = np.flatnonzero((values.imag[:-1] * values.imag[1:] < 0.0) & (values.real[:-1] < 0.0))
    last = turns[np.argmax(magnitude[turns])]
    before, behind = values.imag[last], values.imag[last + 1]
    return float(rad_s[last] + ((rad_s[last + 1] - rad_s[last]) * before / (before - behind)))
