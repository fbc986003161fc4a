"""The flight that `design` judges: calm settings, and a drone that falls, is far off or oscillates."""

import math
import re
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings import controller_toml
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.presets import preset
from mambo_sil.drone.vehicles import VEHICLES, vehicle_toml
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.names import DEFAULT_SENSORS
from mambo_sil.flight.scenario import Scenario, flight_of
from mambo_sil.flight.traces import SensedTrace, Trace
from mambo_sil.model.derive import derived_flight
from mambo_sil.model.derive.derived_flight import (
    _fault,
    choose_settings,
    chosen_text,
    firm_words,
    flies_quick_circle,
    fly_beside,
    fly_derived,
    fly_pushed,
    quick_rate_rad_s,
)
from mambo_sil.model.derive.derived_settings import EXACT_TILT_SHARES, controller_text, wants_exact
from tests.support.derived import settings_for
from tests.support.scenarios import CRAZYFLIE


def delivering(gain: float) -> VehicleFile:
    """Return a drone whose thrust is `gain` times the demanded one; it can demand ten times its weight."""
    text = VEHICLES.text("crazyflie-flown").replace("thrust_max_n = 0.575", "thrust_max_n = 3.0")
    return vehicle_toml.parse(f"{text}\n[thrust]\ngain = {gain}\nlag_s = 0.1\n", "mine", "mine.toml")


@pytest.mark.parametrize(
    ("learnt", "words"),
    [
        ("gain", "stays at its target"),
        ("none", "FAR OFF, "),
    ],
)
def test_a_drone_that_delivers_too_little_is_seen(learnt: str, words: str) -> None:
    """0.8 of the expected thrust: settings that learn it hold their place, others fly lower."""
    settings = with_option(settings_for(delivering(1.0)), "height.learnt", learnt)
    found = fly_derived(settings, delivering(0.8))
    assert found.good is (learnt == "gain")
    assert found.words.startswith(f"flown for 10 s: {words}")
    assert found.words.endswith("(through sensors mocap)")


def test_a_height_is_judged_only_if_the_settings_hold_it() -> None:
    """A drone whose own loop holds it lower, with 0.8 of the thrust, stays at its target."""
    assert fly_derived(preset("crazyflie"), delivering(0.8)).good


def test_a_drone_that_falls_is_seen() -> None:
    """A fifth of the expected thrust is less than can be learnt."""
    found = fly_derived(settings_for(delivering(1.0)), delivering(0.2))
    assert not found.good
    assert re.match(r"flown for 10 s: CRASHES after \d\.\d+ s, on the ground", found.words)
    assert fly_derived(settings_for(delivering(0.2)), delivering(0.2)).good


def test_a_drone_that_oscillates_is_seen() -> None:
    """A Mambo with motors of 0.06 s, through its sensors."""
    text = re.sub(r"(?m)^lag_s = .*", "lag_s = 0.06", VEHICLES.text("mambo"))
    drone = vehicle_toml.parse(text, "slow", "slow.toml")
    found = fly_derived(settings_for(drone), drone)
    assert not found.good
    assert found.words.startswith("flown for 10 s: OSCILLATES, by 0.")
    assert found.words.endswith(f"(through sensors {DEFAULT_SENSORS['mambo']})")


@pytest.mark.first_is_quick
@pytest.mark.parametrize(
    ("name", "exact", "borne_m_s2"), [("x500", True, 7.0), ("crazyflie", False, 4.0), ("mambo", False, 3.0)]
)
def test_a_push_is_borne_nearly_as_far_as_the_tilt_limit_holds(
    name: str, exact: bool, borne_m_s2: float
) -> None:
    """Flown here once more: what is borne is held within 2 cm, with a smaller limit it is not."""
    drone = vehicle_toml.preset(name)
    settings = settings_for(drone, exact=exact)
    found = fly_pushed(settings, drone)
    assert found.good
    assert found.words == f"bears a steady push of {borne_m_s2:g} m/s^2 from every side"
    assert borne_m_s2 < settings.observer.disturbance_limit_m_s2 < borne_m_s2 + 1.0
    pushed = Scenario(vehicle=drone, duration_s=15.0, trajectory="hover", push_m_s2=(0.0, -borne_m_s2))
    off_m = []
    for limit_m_s2 in (settings.observer.disturbance_limit_m_s2, borne_m_s2 - 1.0):
        flown = with_option(settings, "observer.disturbance_limit_m_s2", limit_m_s2)
        trace = fly(flight_of([pushed], settings.horizon.update_period_s), CompiledController(flown, 1))
        off_m.append(np.abs(trace.position_m[trace.time_s > 12.0, 0, 1]).max())
    assert off_m[0] < 0.02
    assert off_m[1] > 0.03


def test_a_push_that_is_not_learnt_is_seen() -> None:
    """Before it says which one the drone bears; beyond what good settings bear it only ends the search."""
    settings = with_option(settings_for(CRAZYFLIE), "observer.disturbance_noise", 0.001)
    found = fly_pushed(settings, CRAZYFLIE)
    assert not found.good
    assert re.fullmatch(r"pushed by 0.5 m/s\^2: FAR OFF, \d+ mm along [xy] in the mean", found.words)
    strong = with_option(settings_for(CRAZYFLIE), "observer.disturbance_limit_m_s2", 6.5)
    assert fly_pushed(strong, CRAZYFLIE).words == "bears a steady push of 4 m/s^2 from every side"
    assert not fly_pushed(with_option(strong, "observer.disturbance_limit_m_s2", 8.5), CRAZYFLIE).good
    weak = with_option(strong, "observer.disturbance_limit_m_s2", 0.4)
    assert fly_pushed(weak, CRAZYFLIE).words == "bears no steady push: its tilt limit holds 0.4 m/s^2"


@pytest.mark.parametrize(
    ("name", "tilt_rad"),
    [("crazyflie", 0.638), ("x500", 0.733), ("cf2x-pyflyt", 1.04), ("hummingbird", 0.736)],
)
def test_a_flight_chooses_the_exact_thrust_vector(name: str, tilt_rad: float) -> None:
    """The quick mixer of a Hummingbird loses the height in large swings: a smaller share of the tilt."""
    drone = vehicle_toml.preset(name)
    exact = settings_for(drone, exact=True)
    assert (exact.model.tilt, wants_exact(drone)) == ("exact", True)
    is_survived = flies_quick_circle(exact, drone)
    assert is_survived is (name != "hummingbird")
    written = choose_settings(drone, name)
    assert written.small_angles is None
    chosen = controller_toml.parse(written.text, name)
    assert (chosen == exact) is is_survived
    assert (chosen.model.tilt, chosen.limits.tilt_rad) == ("exact", tilt_rad)


def test_small_angles_stay_where_every_share_is_lost() -> None:
    """With firm settings a Hummingbird is lost with the least one, too, which is said."""
    written = choose_settings(vehicle_toml.preset("hummingbird"), "hummingbird", firm=True)
    assert written.small_angles is not None
    assert "up to 0.736 rad, it is lost on a circle of 1 m at 3.6 rad/s" in written.small_angles
    chosen = controller_toml.parse(written.text, "hummingbird")
    assert (chosen.model.tilt, chosen.limits.tilt_rad) == ("small-angle", 0.5)


def test_a_flight_chooses_the_largest_share_that_is_survived(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the tilt at which the thrust still carries the weight."""
    drone = vehicle_toml.preset("crazyflie")
    monkeypatch.setattr(
        derived_flight, "flies_quick_circle", lambda settings, _: settings.limits.tilt_rad < 0.6
    )
    written = controller_toml.parse(choose_settings(drone, "crazyflie").text, "crazyflie")
    assert written.limits.tilt_rad == pytest.approx(
        0.6 * math.acos(drone.weight_n / drone.largest_thrust_n), rel=0.01
    )


def test_the_quick_circle_asks_for_more_than_the_tilt_limit() -> None:
    """Its acceleration, r w^2, is 1.2^2 times g tan of the limit."""
    for tilt_rad in (0.4, 0.74):
        acceleration_m_s2 = 1.0 * quick_rate_rad_s(tilt_rad) ** 2
        assert acceleration_m_s2 == pytest.approx(1.44 * GRAVITY_M_S2 * math.tan(tilt_rad))


def test_the_quick_circle_has_slower_rotors() -> None:
    """1.5 times slower: a thrust with 0.15 s of lag, which flies it, is flown with 0.225 s, and is lost."""
    drone = vehicle_toml.preset("cf2x-pyflyt")
    exact = settings_for(drone, exact=True)
    assert drone.thrust is not None
    survives = [
        flies_quick_circle(
            exact,
            drone.model_copy(update={"thrust": drone.thrust.model_copy(update={"lag_s": lag_s})}),
        )
        for lag_s in (0.1, 0.15)
    ]
    assert survives == [True, False]


@pytest.mark.parametrize("name", ["crazyflie-flown", "mambo", "generic"])
def test_a_drone_whose_height_is_not_held_or_behind_optical_flow_keeps_small_angles(name: str) -> None:
    """And nothing is flown to find that out."""
    drone = vehicle_toml.preset(name)
    assert not wants_exact(drone)
    assert chosen_text(drone, name) == controller_text(drone, name)


TIME_S = np.arange(-1.0, 10.005, 0.01)
"""Ten seconds, and a take-off before."""
TARGET_M = np.array([0.3, -0.2, -1.4])


def still(**changes: Any) -> Trace:
    """Return four flights at rest at their target; changes are added to arrays from t = 5 s on."""
    shape = (len(TIME_S), 4)
    trace = Trace(
        time_s=TIME_S,
        position_m=np.broadcast_to(TARGET_M, (*shape, 3)).copy(),
        velocity_m_s=np.zeros((*shape, 3)),
        euler_rad=np.zeros((*shape, 3)),
        target=np.broadcast_to([0.3, -0.2, 0.0, 0.0, 1.4, 0.0], (*shape, 6)).copy(),
        command_rad=np.zeros((*shape, 2)),
        thrust_acceleration_m_s2=np.full(shape, 9.81),
        status=np.zeros(shape, dtype=np.int64),
    )
    for name, (flight, column, values) in changes.items():
        getattr(trace, name)[TIME_S >= 5.0, flight, column] += values
    return trace


LATE_S = TIME_S[TIME_S >= 5.0]
SINE = math.sqrt(2.0) * np.sin(4.0 * math.pi * LATE_S)
"""Whole periods, of rms 1."""


@pytest.mark.parametrize(
    ("changes", "axes", "fault"),
    [
        ({}, 3, None),
        ({"position_m": (0, 0, 0.049)}, 3, None),
        ({"position_m": (3, 0, 0.051)}, 3, "FAR OFF, 51 mm along x in the mean"),
        ({"position_m": (1, 1, -0.068)}, 2, "FAR OFF, 68 mm along y in the mean"),
        ({"position_m": (2, 2, 0.3)}, 3, "FAR OFF, 300 mm along z in the mean"),
        ({"position_m": (2, 2, 0.3)}, 2, None),
        ({"position_m": (0, 0, 0.1 * SINE)}, 3, None),
        ({"euler_rad": (0, 0, 0.145 * SINE)}, 3, None),
        ({"euler_rad": (3, 0, 0.155 * SINE)}, 3, "OSCILLATES, by 0.15 rad and 0 m/s (rms)"),
        ({"euler_rad": (0, 1, 0.24 * SINE)}, 3, "OSCILLATES, by 0.24 rad and 0 m/s (rms)"),
        ({"euler_rad": (0, 2, 0.5 * SINE)}, 3, None),
        ({"euler_rad": (0, 0, 0.3)}, 3, None),
        ({"velocity_m_s": (0, 2, 0.195 * SINE)}, 3, None),
        ({"velocity_m_s": (3, 2, 0.21 * SINE)}, 3, "OSCILLATES, by 0 rad and 0.21 m/s (rms)"),
        ({"velocity_m_s": (3, 2, 0.21 * SINE)}, 2, None),
        ({"velocity_m_s": (3, 0, 0.5)}, 2, None),
        ({"velocity_m_s": (1, 0, math.nan), "euler_rad": (1, 0, math.nan)}, 3, "OSCILLATES, by nan rad"),
        ({"position_m": (2, 2, 2.0)}, 2, "CRASHES after 5 s, on the ground"),
    ],
)
def test_the_end_of_a_flight_is_judged(
    changes: dict[str, tuple[int, int, Any]], axes: int, fault: str | None
) -> None:
    """Any of four flights: where it is in the mean, the rms of what moves, along the axes that are held."""
    found = _fault(still(**changes), CRAZYFLIE, axes)
    if fault is None:
        assert found is None
    else:
        assert found is not None
        assert found.startswith(fault)


def test_what_comes_before_the_end_is_not_judged() -> None:
    """But the first crash is told."""
    trace = still()
    trace.position_m[TIME_S < 4.99, 0, 0] += 1.0
    trace.euler_rad[TIME_S < 4.99, 0, 0] = 0.4 * np.sin(9.0 * TIME_S[TIME_S < 4.99])
    assert _fault(trace, CRAZYFLIE, 3) is None
    trace.position_m[TIME_S > 4.0, 1, 2] += 2.0
    trace.position_m[TIME_S > 3.255, 2, 2] += 2.0
    assert _fault(trace, CRAZYFLIE, 3) == "CRASHES after 3.26 s, on the ground"


def test_the_place_that_is_seen_is_judged() -> None:
    """Estimates drift; the settings hold what they see."""
    drifted = still(position_m=(0, 0, 0.4))
    columns = {field.name: getattr(drifted, field.name) for field in fields(Trace)}
    seen = {f"seen_{name}": getattr(still(), name) for name in ("position_m", "velocity_m_s", "euler_rad")}
    assert _fault(SensedTrace(**columns, **seen), CRAZYFLIE, 3) is None
    seen["seen_position_m"] = drifted.position_m
    assert _fault(SensedTrace(**columns, **seen), CRAZYFLIE, 3) == "FAR OFF, 400 mm along x in the mean"


def test_a_drone_is_seen_elsewhere_until_it_swings() -> None:
    """A Hummingbird, whose loop is quick, bears less than a Crazyflie; of other sensors nothing is said."""
    reaches = []
    for name in ("crazyflie", "hummingbird"):
        drone = vehicle_toml.preset(name)
        seen = fly_beside(settings_for(drone), drone)
        assert seen is not None
        assert seen.good
        found = re.fullmatch(r"bears to be seen (\d+) cm below and (\d+) cm above where .*says", seen.words)
        assert found
        reaches.append((int(found[1]), int(found[2])))
    assert reaches[1][0] < reaches[0][0] <= 5
    mambo = vehicle_toml.preset("mambo")
    assert fly_beside(preset("mambo"), mambo) is None


def borne_m_s2(settings: Settings, drone: VehicleFile) -> float:
    """Return the steady push that settings bear."""
    pushed = fly_pushed(settings, drone)
    found = re.fullmatch(r"bears a steady push of (\d+(?:\.\d)?) m/s\^2 from every side", pushed.words)
    assert pushed.good
    assert found
    return float(found[1])


@pytest.mark.long
@pytest.mark.sampled(4)
@pytest.mark.parametrize("name", VEHICLES.names())
def test_firm_settings_hold_their_place_better(name: str) -> None:
    """Two keys differ; a push moves the drone by less, it stays, and bears as much, or 1 m/s^2 less."""
    drone = vehicle_toml.preset(name)
    chosen = choose_settings(drone, name).text
    shares = (None, *EXACT_TILT_SHARES)
    (share,) = (one for one in shares if controller_text(drone, name, exact_share=one) == chosen)
    calm, firm = (
        controller_toml.parse(controller_text(drone, name, exact_share=share, firm=is_firm), name)
        for is_firm in (False, True)
    )
    cost = {"response_time_s": firm.cost.response_time_s}
    observer = {"disturbance_noise": pytest.approx(calm.observer.disturbance_noise / 0.3, rel=2e-3)}
    assert firm.model_dump(exclude={"cost", "observer"}) == calm.model_dump(exclude={"cost", "observer"})
    assert firm.cost.model_dump() == calm.cost.model_dump() | cost
    assert firm.observer.model_dump() == calm.observer.model_dump() | observer
    found = re.fullmatch(
        r"firm: a push of 0\.5 m/s\^2 moves it by (\d+) mm, with --calm by (\d+); "
        r"its commands change ([\d.]+) times as much",
        firm_words(firm, calm, drone),
    )
    assert found
    assert int(found[1]) < 0.78 * int(found[2])
    assert 1.0 < float(found[3]) < 7.0
    assert fly_derived(firm, drone).good
    assert borne_m_s2(firm, drone) >= borne_m_s2(calm, drone) - 1.0
