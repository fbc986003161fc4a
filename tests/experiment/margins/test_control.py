"""Margins against python-control, on the same matrices joined by its own operations."""

from typing import Any

import control
import numpy as np
import pytest

from mambo_codegen.settings.presets import preset
from mambo_sil.drone.plant.vehicle import Vehicle
from tests.support.hover import margins_of, opened_at_the_command

NEAR = 1.0 + 1e-3 * np.linspace(-1.0, 1.0, 801)
"""Factors on frequencies at which python-control, which interpolates between points, needs many."""
PAIRS = [("mambo", "mambo"), ("crazyflie", "crazyflie"), ("mambo", "crazyflie"), ("crazyflie", "generic")]


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
