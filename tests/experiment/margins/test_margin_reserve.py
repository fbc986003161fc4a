"""How much of a reference's margins settings keep."""

import math
from dataclasses import replace

import pytest

from mambo_codegen.settings import presets
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.airframe import NOMINAL
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.experiment.margins.margin_reserve import MarginReference, Reserve, reserve
from mambo_sil.model.derive.margin_reference import margin_reference

MAMBO = presets.preset("mambo")


@pytest.fixture(scope="module", name="of_mambo")
def _of_mambo() -> MarginReference:
    """Return the margins of preset mambo on its drone."""
    return margin_reference("mambo", MAMBO, NOMINAL)


def answering(response_time_s: float) -> Settings:
    """Return preset mambo with another response time."""
    return with_option(MAMBO, "cost.response_time_s", response_time_s)


def test_a_preset_keeps_its_own_margins(of_mambo: MarginReference) -> None:
    """They are those that `margins` prints through the drone's own sensors."""
    assert (of_mambo.whose, of_mambo.sensors) == ("preset mambo", "mambo-derotated")
    kept = reserve(MAMBO, NOMINAL, of_mambo)
    assert kept.share == pytest.approx(1.0)
    assert kept.gain == pytest.approx(2.37, abs=0.01)
    assert kept.delay_s == pytest.approx(0.197, abs=0.001)
    assert kept.enough


@pytest.mark.long
def test_a_quick_response_spends_them(of_mambo: MarginReference) -> None:
    """One of 0.1 s tolerates 1.5 times the gain and 42 ms in pitch; one of 0.02 s is unstable."""
    quick = reserve(answering(0.1), NOMINAL, of_mambo)
    assert quick.gain == pytest.approx(1.50, abs=0.01)
    assert quick.delay_s == pytest.approx(0.042, abs=0.001)
    assert quick.share == pytest.approx(0.042 / 0.255, abs=0.005)
    assert not quick.enough
    unstable = reserve(answering(0.02), NOMINAL, of_mambo)
    assert unstable == Reserve(0.0, 0.0, 0.0)
    assert not unstable.enough


def test_a_fifth_less_is_allowed_and_large_margins_count_as_enough(of_mambo: MarginReference) -> None:
    """Of each loop: a better one does not make up for a worse one."""
    own = of_mambo.loops
    for name, share, enough in (("roll: command", 0.81, True), ("pitch: motors", 0.79, False)):
        gain, delay_s = own[name]
        other = replace(of_mambo, loops={**own, name: (gain / share, delay_s)})
        assert reserve(MAMBO, NOMINAL, other).enough == enough
    endless = replace(of_mambo, loops={"roll: motors": (math.inf, math.inf)})
    assert reserve(MAMBO, NOMINAL, endless).share == pytest.approx(min(0.273, 0.0245), rel=0.01)


@pytest.mark.long
def test_a_file_is_compared_with_what_design_derives(of_mambo: MarginReference) -> None:
    """For the drone that it flies; a 1-norm has no margins, and then none are demanded."""
    drone = vehicle_toml.load("crazyflie")
    derived = margin_reference("controller.toml", MAMBO, drone)
    assert derived.whose == "`design` for crazyflie"
    assert "height: command" in derived.loops
    one_norm = presets.preset("mambo-1norm")
    assert margin_reference("mambo-1norm", one_norm, NOMINAL).missing is not None
    assert reserve(one_norm, NOMINAL, of_mambo).enough
