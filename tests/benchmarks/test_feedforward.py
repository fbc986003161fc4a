"""The search for the gains of the laws with feed-forward, and of the altitude loop `pid`."""

from dataclasses import astuple

from benchmarks.gains import altitude
from benchmarks.gains.feedforward import (
    DRAWS_PER_GAIN,
    FIRST,
    SLACK,
    STEPS,
    Judged,
    choose,
    drawn_flights,
    judge,
    search,
)
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.flight.altitude_loops import AltitudeLaw, pid_altitude_gains
from mambo_sil.flight.columns import SPACE
from mambo_sil.flight.controllers.pd import GAINS, PdGains, PidGains, pid_gains

STOCK = FIRST["pd-feedforward"]


def bowl(gains: PdGains) -> Judged:
    """Judge gains by their distance from (0.4, 0.3, 0.1); those with a large velocity gain crash."""
    distance = abs(gains.position_rad_m - 0.4) + abs(gains.velocity_rad_s_m - 0.3)
    distance += abs(gains.acceleration_rad_s2_m - 0.1)
    return Judged((1.0 + distance,) * 3, (gains.velocity_rad_s_m,) * 3, int(gains.velocity_rad_s_m > 0.35))


def test_the_search_is_repeatable_and_closes_in() -> None:
    """From the stock gains, whatever crashes left out."""
    found = dict(search(STOCK, bowl, 0))
    assert list(found) == list(dict(search(STOCK, bowl, 0)))
    assert STOCK in found
    assert len(found) <= 1 + 3 * DRAWS_PER_GAIN * len(STEPS)
    assert all(gains.velocity_rad_s_m <= 0.35 for gains in found)
    assert min(judged.error for judged in found.values()) < 1.05


def test_all_gains_of_the_pid_are_searched() -> None:
    """Every candidate is of the PID, and every gain takes many values."""
    found = list(dict(search(FIRST["pid-feedforward"], bowl, 0)))
    assert all(isinstance(gains, PidGains) for gains in found)
    assert all(len(set(values)) > len(found) / 2 for values in zip(*map(astuple, found), strict=True))


def test_the_calmest_of_the_closest_is_chosen() -> None:
    """A calmer one that is too far off is not, nor is the closest one."""
    closest, calm, far = PdGains(1, 1, 1), PdGains(2, 2, 2), PdGains(3, 3, 3)
    found = {
        closest: Judged((1.0,) * 3, (0.05,) * 3, 0),
        calm: Judged((SLACK - 0.01,) * 3, (0.02,) * 3, 0),
        far: Judged((SLACK + 0.01,) * 3, (0.01,) * 3, 0),
    }
    assert choose(found) == calm


def test_the_flights_are_those_of_a_campaign() -> None:
    """Drawn, with sensors; on the first two of each curve the shipped gains fly closer from law to law."""
    flights = drawn_flights(count=2)
    assert len({flight.seeds for flight in flights}) == 1
    assert all(flight.sensors is not None and flight.disturbances.windy for flight in flights)
    errors_m_s = [judge(flights, gains).error for gains in (None, GAINS, pid_gains()["mambo"])]
    assert errors_m_s == sorted(errors_m_s, reverse=True)


def test_there_are_gains_for_shipped_drones_only() -> None:
    """Another drone flies those of the Mambo."""
    for gains in (pid_gains(), pid_altitude_gains()):
        assert vehicle_toml.DEFAULT in gains
        assert set(gains) <= set(vehicle_toml.names())


def test_the_flights_have_heights_and_the_shipped_gains_follow_closest() -> None:
    """Drawn, with sensors; on the first six of each curve the errors fall from law to law."""
    flights = drawn_flights(altitude.CURVES, altitude.DURATION_S, count=6, vehicle="crazyflie")
    assert len(flights) == len(altitude.CURVES)
    assert all(
        flight.sensors is not None and flight.given_targets.shape[2] == SPACE.target for flight in flights
    )
    errors = [altitude.judge(flights, AltitudeLaw(name)).error for name in ("stock", "feedforward", "pid")]
    assert errors == sorted(errors, reverse=True)
