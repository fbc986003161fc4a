"""What `design` says of a drone for which it derives no height."""

import pytest

from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.model.derive.missing_height import missing_height

FLOWN = vehicle_toml.preset("crazyflie-flown")


def changed(**sections: object) -> VehicleFile:
    """Return `crazyflie-flown` with other sections."""
    return VehicleFile.model_validate({**FLOWN.model_dump(exclude_none=True), **sections})


def test_an_unknown_thrust_is_named_with_what_it_costs() -> None:
    """The statics of its altitude loop of 15 1/s^2: 0.2 x 9.81 over it, and 0.05 x 9.81."""
    said = missing_height(FLOWN)
    assert "sinks by 131 mm under 20 % more mass, by 33 mm with 5 % less thrust" in said
    assert said.endswith("write [thrust] with lag_s and gain into its file")


@pytest.mark.parametrize(("gain_n_m", "cost"), [(0.9, "65 mm"), (0.0, "")])
def test_the_cost_follows_the_gain(gain_n_m: float, cost: str) -> None:
    """Twice the gain, half of it; a loop without gain holds no height at all."""
    altitude = {"p_n_m": gain_n_m, "d_n_s_m": 0.21, "thrust_max_n": 0.575}
    said = missing_height(changed(altitude=altitude))
    assert cost in said
    assert ("sinks" in said) == (gain_n_m > 0.0)


def test_a_thrust_that_hardly_lifts_is_named() -> None:
    """A known one, of 1.05 times the weight."""
    altitude = {"p_n_m": 0.45, "d_n_s_m": 0.21, "thrust_max_n": 0.309}
    said = missing_height(changed(altitude=altitude, thrust={"lag_s": 0.1}))
    assert "the largest thrust, 10.3 m/s^2, hardly climbs" in said
