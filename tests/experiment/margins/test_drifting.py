"""Estimates that drift have noise, and no dynamics of their own: margins are those of the true state."""

import pytest

from mambo_codegen.settings import presets
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.experiment.margins.axis_margins import AxisMargins
from mambo_sil.experiment.margins.many_drones import measure_drone
from mambo_sil.flight.names import SensorsName


@pytest.mark.parametrize("sensors", ["flow-deck", "autopilot"])
def test_margins_are_those_of_the_true_state(sensors: SensorsName) -> None:
    """Also where an error of the position never fades; the commands change by the noise."""
    settings, drone = presets.preset("crazyflie"), vehicle_toml.preset("crazyflie")
    true, seen = (measure_drone(settings, drone, name)[0] for name in ("true", sensors))
    assert isinstance(seen, AxisMargins)
    assert seen.stable
    assert seen.command is not None
    assert true.command is not None
    assert seen.command.model_dump() == pytest.approx(true.command.model_dump(), rel=1e-6)
    assert seen.sensed_variation_rad is not None
    assert 0.0 < seen.sensed_variation_rad < 0.05
