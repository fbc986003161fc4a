"""Altitude loops: closed forms of one tick; what each does with a height that moves, and with a weight."""

from dataclasses import replace

import numpy as np
import pytest

from mambo_sil.drone.plant.loops import altitude_thrust
from mambo_sil.drone.plant.vehicle import Seen, Vehicle
from mambo_sil.flight.altitude_loops import (
    INTEGRAL_SHARE,
    LEAST_LEVEL,
    AltitudeLaw,
    AltitudeLoop,
    HeightGains,
    Vertical,
    pid_altitude_gains,
)
from mambo_sil.flight.controllers.pd import pd_controller
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.loop import Flight
from mambo_sil.flight.metrics import measure
from mambo_sil.flight.names import AltitudeName
from mambo_sil.flight.trajectories import CURVES, Hover
from tests.support.scenarios import CRAZYFLIE

MASS_KG = CRAZYFLIE.body.mass_kg


def seen(z_m: float, climb_m_s: float, roll_rad: float = 0.0) -> Seen:
    """Return what one drone sees."""
    still = np.zeros((3, 1))
    position_m, velocity_m_s, euler_rad = still.copy(), still.copy(), still.copy()
    position_m[2], velocity_m_s[2], euler_rad[0] = z_m, -climb_m_s, roll_rad
    return Seen(position_m, velocity_m_s, euler_rad, still)


def thrust_n(law: AltitudeLaw, wanted: Vertical, state: Seen) -> float:
    """Return the thrust of the first tick."""
    return float(AltitudeLoop(law, CRAZYFLIE, 1).thrust_n(wanted, state)[0])


def test_the_stock_loop_is_that_of_the_vehicle() -> None:
    """It reads neither climb nor acceleration of the target, nor the tilt."""
    state = seen(-1.0, 0.2, roll_rad=0.4)
    expected = altitude_thrust(CRAZYFLIE, -1.1, state.position_m[2], state.velocity_m_s[2])[0]
    assert thrust_n(AltitudeLaw(), Vertical(-1.1, 0.3, 0.5), state) == expected


@pytest.mark.parametrize("roll_rad", [0.0, 0.4, 1.2])
def test_feed_forward_adds_climb_acceleration_and_tilt(roll_rad: float) -> None:
    """With the vehicle's gains; at 1.2 rad the compensation has its limit."""
    gains, altitude = CRAZYFLIE.altitude, 1.0 / max(np.cos(roll_rad), LEAST_LEVEL)
    expected = CRAZYFLIE.weight_n + gains.p_n_m * 0.02 + gains.d_n_s_m * (0.1 - 0.2) - MASS_KG * 0.5
    found = thrust_n(AltitudeLaw("feedforward"), Vertical(-1.02, 0.1, -0.5), seen(-1.0, 0.2, roll_rad))
    assert found == pytest.approx(altitude * expected, rel=1e-12)


def test_the_integral_grows_within_its_limit_and_rests() -> None:
    """By the error of each tick; with a large error, or a thrust at its limit, it stays."""
    law = AltitudeLaw("pid", HeightGains(2.0, 1.0, 10.0))
    loop = AltitudeLoop(law, CRAZYFLIE, 1)
    for _ in range(10):
        loop.thrust_n(Vertical(-1.1), seen(-1.0, 0.0))
    grown_n = 10 * CRAZYFLIE.step_s * MASS_KG * 10.0 * 0.1
    assert loop.integral_n == pytest.approx(grown_n, rel=1e-12)
    loop.thrust_n(Vertical(-2.0), seen(-1.0, 0.0))
    loop.thrust_n(Vertical(-1.1), seen(-1.0, -30.0))
    assert loop.integral_n == pytest.approx(grown_n, rel=1e-12)
    for _ in range(10_000):
        loop.thrust_n(Vertical(-1.1), seen(-1.0, 0.0))
    assert loop.integral_n == INTEGRAL_SHARE * CRAZYFLIE.weight_n


@pytest.mark.parametrize(
    ("law", "follows", "learns"),
    [("stock", False, False), ("feedforward", True, False), ("pid", True, True)],
)
def test_feed_forward_follows_and_the_integral_learns_the_weight(
    law: AltitudeName, follows: bool, learns: bool
) -> None:
    """Error of the height on a tilted circle (rms), and at the end of a hover with a fifth more mass."""
    vehicle = Vehicle.of(CRAZYFLIE)
    swinging = Flight(CURVES["tilted-circle"](1.0, 1.5), 10.0, vehicle=vehicle, altitude=AltitudeLaw(law))
    controller = pd_controller("pid-feedforward", swinging)
    rms_m = float(measure(fly(swinging, controller), 2.0).rms_height_error_m[0])
    assert rms_m < 0.005 if follows else rms_m > 0.1
    heavy = replace(vehicle, airframe=replace(vehicle.airframe, mass_kg=1.2 * MASS_KG))
    hover = Flight(Hover(), 10.0, vehicle=heavy, altitude=AltitudeLaw(law))
    trace = fly(hover, pd_controller("pid-feedforward", hover))
    sag_m = float(trace.position_m[-1, 0, 2] + 1.1)
    assert abs(sag_m) < 0.01 if learns else sag_m > 0.1


def test_every_shipped_gain_is_positive() -> None:
    """Of every drone that has any; others fly those of the Mambo."""
    assert "mambo" in pid_altitude_gains()
    for gains in pid_altitude_gains().values():
        assert min(vars(gains).values()) > 0.0
    assert AltitudeLaw("pid").gains_for(CRAZYFLIE) in pid_altitude_gains().values()
